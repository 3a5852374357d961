//! Carrier power over noise density: a link budget from transmitter to receiver, or a fixed value.
//!
//! C/N0 = P_t + G_t(off-nadir) − 20 lg(4πRf/c) − L_a + G_r(direction) − N0 − L_i, in dB (Friis). Transmit
//! patterns are means of a block of satellites, as published, or that of a typical shaped L1 beam (Kaplan &
//! Hegarty; beyond the Earth's edge at 13.9° it falls away as the mean of Block IIR). Limits: patterns are
//! means over azimuth, not those of one satellite; beyond their last angle they keep its gain. Satellites of
//! other systems have GPS's typical beam, nominally: its edge at their edge of the Earth, and as much more
//! power as their longer way takes, so that the ground receives the documents' minima in the same shape. From
//! 5° of elevation up no orbit in use is received below its document's minimum.

use super::antenna::{Antenna, Pattern, gain_db};
use super::transmit::Block;
use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{SEMI_MAJOR_AXIS_M, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::{Sv, System};
use gnss::signal::Signal;

/// k·T0 in dBW/Hz as the budget rounds it: a matched source at 290 K gives −203.98.
const REFERENCE_NOISE_DBWHZ: f64 = -204.0;

/// Height of a GPS orbit's lowest point, in metres: 26 560 km less 2 % (plausible eccentricities) less the
/// Earth's radius.
const ZENITH_RANGE_M: f64 = 1.965e7;

/// Part of a radius by which an orbit may differ from its system's: 0.1, that of the most eccentric satellite
/// of QZSS.
const FARTHEST: f64 = 0.1;

/// Link budget from transmitter to receiver. [`LinkBudget::default`] is a GPS L1 C/A satellite and an
/// ordinary receiver.
#[derive(Clone, Debug)]
pub struct LinkBudget {
    /// Power of L1 C/A into the satellite's antenna, in dBW. Other signals differ from it as their documents'
    /// minima on the ground do.
    pub transmit_dbw: f64,
    /// Block of all satellites without one of their own.
    pub block: Block,
    /// Satellites with a block of their own.
    pub blocks: Vec<(Sv, Block)>,
    /// Atmospheric and polarisation losses, in dB.
    pub path_loss_db: f64,
    /// The receiving antenna.
    pub antenna: Antenna,
    /// Noise figure of the receiver in dB, against 290 K.
    pub noise_figure_db: f64,
    /// Losses in the receiver, in dB.
    pub implementation_loss_db: f64,
    /// Additional losses of the scene, in dB.
    pub extra_loss_db: f64,
}

impl Default for LinkBudget {
    fn default() -> Self {
        Self {
            transmit_dbw: 14.3,
            block: Block::Typical,
            blocks: Vec::new(),
            path_loss_db: 0.5,
            antenna: Antenna::level(Pattern::Patch),
            noise_figure_db: 2.5,
            implementation_loss_db: 2.0,
            extra_loss_db: 0.0,
        }
    }
}

impl LinkBudget {
    /// C/N0 in dB-Hz along `sight` on `carrier_hz`.
    pub fn cn0_dbhz(&self, sight: &Sight, carrier_hz: f64) -> f64 {
        self.budget(sight, carrier_hz).0
    }

    /// Upper bound of C/N0 in dB-Hz on the Earth's surface with a receiving antenna of `peak_dbic`. It
    /// assumes the best of both patterns at once, from a satellite at the zenith.
    pub fn strongest_dbhz(&self, peak_dbic: f64, carrier_hz: f64) -> f64 {
        let blocks = self.blocks.iter().map(|(_, block)| block.peak_dbi());
        let transmit_db = blocks.fold(self.block.peak_dbi(), f64::max);
        self.over_noise_dbhz(self.incident_dbw(transmit_db, ZENITH_RANGE_M, carrier_hz) + peak_dbic)
    }

    /// C/N0 in dB-Hz and the receiving antenna's phase in cycles.
    fn budget(&self, sight: &Sight, carrier_hz: f64) -> (f64, f64) {
        let transmit_db = self.transmitted_db(sight);
        let (receive_db, phase_cycles) = self.antenna.response(sight);
        let received_dbw = self.incident_dbw(transmit_db, sight.range_m, carrier_hz);
        (self.over_noise_dbhz(received_dbw + receive_db), phase_cycles)
    }

    /// Power into an isotropic antenna at a range, in dBW.
    fn incident_dbw(&self, transmit_db: f64, range_m: f64, carrier_hz: f64) -> f64 {
        let spreading = 4.0 * std::f64::consts::PI * range_m * carrier_hz / SPEED_OF_LIGHT_MPS;
        self.transmit_dbw + transmit_db
            - planted!("generator.link.spreading", 20.0, 19.9) * libm::log10(spreading)
            - self.path_loss_db
    }

    /// Power at the antenna's port over the noise density, in dB-Hz.
    pub fn over_noise_dbhz(&self, received_dbw: f64) -> f64 {
        received_dbw - (REFERENCE_NOISE_DBWHZ + self.noise_figure_db) - self.implementation_loss_db - self.extra_loss_db
    }

    /// Transmit gain towards a user in dB, with the additional power by which a system compensates for its
    /// longer path.
    fn transmitted_db(&self, sight: &Sight) -> f64 {
        let Sight { sv, off_nadir_rad, .. } = *sight;
        let all = if sv.system == System::Gps { self.block } else { Block::Typical };
        let curve = self.blocks.iter().find(|(own, _)| *own == sv).map_or(all, |(_, block)| *block).gain_dbi();
        if sv.system == System::Gps {
            return gain_db(curve, off_nadir_rad.to_degrees());
        }
        let (own_m, gps_m) = (designed_m(sv, sight.satellite.position_m.norm()), System::Gps.orbit_m());
        // As far from nadir on the Earth as a GPS satellite's beam would be.
        let alike_rad = libm::asin((libm::sin(off_nadir_rad) * own_m / gps_m).min(1.0));
        let farther_db = 20.0 * libm::log10(lowest_range_m(own_m) / lowest_range_m(gps_m));
        gain_db(curve, alike_rad.to_degrees()) + farther_db
    }
}

/// Radius of the orbit for which a satellite's beam and power are made: that of its system, or, where the
/// satellite is farther from it than a tenth, the nearest that is not. These are Galileo's satellites on
/// eccentric orbits (E14 and E18) at their lowest, whose edge of the Earth leaves the beam, and inclined or
/// geostationary ones of BeiDou that the program does not know by number.
fn designed_m(sv: Sv, radius_m: f64) -> f64 {
    sv.orbit_m().clamp(radius_m / (1.0 + FARTHEST), radius_m * (1.0 + FARTHEST))
}

/// Range of a satellite on a circle of that radius, 5° above the horizon, where documents promise their
/// minima.
fn lowest_range_m(orbit_m: f64) -> f64 {
    let (sine, cosine) = libm::sincos(5_f64.to_radians());
    let across_m = SEMI_MAJOR_AXIS_M * cosine;
    (orbit_m * orbit_m - across_m * across_m).sqrt() - SEMI_MAJOR_AXIS_M * sine
}

/// Power into the satellite's antenna above that of L1 C/A: as much as brings the powers received, range and
/// patterns alike, as far apart as the documents' minima. Scenarios with signals without one are refused.
fn over_l1_db(signal: &Signal, sv: Sv) -> f64 {
    let minima = signal.minimum_power_dbw.zip(L1_CA.minimum_power_dbw);
    let apart_db = |(own_dbw, l1_dbw): (f64, f64)| own_dbw - l1_dbw;
    minima.map_or(0.0, apart_db) + 20.0 * libm::log10(signal.carrier_hz(sv) / L1_CA.carrier_hz(sv))
}

impl Effect for LinkBudget {
    fn name(&self) -> &'static str {
        "link_budget"
    }

    fn describe(&self) -> String {
        let blocks = match (self.block, self.blocks.is_empty()) {
            (_, false) => ", transmit patterns by block".to_owned(),
            (Block::Typical, true) => String::new(),
            (block, true) => format!(", transmit pattern of block {block:?}"),
        };
        format!(
            "{}, noise figure {} dB, losses {} dB{blocks}",
            self.antenna.pattern, self.noise_figure_db, self.extra_loss_db
        )
    }

    /// Sets the power of every ray to that of the direct one, and adds the antenna's phase.
    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let (cn0_dbhz, phase_cycles) = self.budget(sight, signal.carrier_hz(sight.sv));
        set_all(rays, cn0_dbhz + over_l1_db(signal, sight.sv));
        for ray in rays {
            ray.phase_cycles += phase_cycles;
        }
    }
}

/// Effect that gives every satellite the same C/N0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedCn0 {
    /// C/N0 of every satellite, in dB-Hz.
    pub cn0_dbhz: f64,
}

impl Effect for FixedCn0 {
    fn name(&self) -> &'static str {
        "fixed_cn0"
    }

    fn describe(&self) -> String {
        format!("{} dB-Hz for every satellite", self.cn0_dbhz)
    }

    /// Sets the power of every ray.
    fn act(&self, _sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        set_all(rays, self.cn0_dbhz);
    }
}

fn set_all(rays: &mut [Ray], cn0_dbhz: f64) {
    let cn0_hz = libm::pow(10.0, cn0_dbhz / 10.0);
    for ray in rays {
        ray.cn0_hz = cn0_hz;
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Vector3;

    use super::*;
    use gnss::broadcast::State;
    use gnss::earth::{Geodetic, Look};
    use gnss::galileo::e1::E1;
    use gnss::signal::Carrier;
    use gnss::time::Epoch;

    /// A sight line with the spherical geometry of the reference table: radii 6378 and 26 560 km.
    pub(crate) fn sight(elevation_deg: f64, height_m: f64) -> Sight {
        from_orbit(elevation_deg, height_m, 26_560e3)
    }

    fn from_orbit(elevation_deg: f64, height_m: f64, orbit: f64) -> Sight {
        let elevation_rad = elevation_deg.to_radians();
        let earth = 6_378e3;
        let across = earth * libm::cos(elevation_rad);
        Sight {
            sv: Sv::gps(1),
            received: Epoch::from_week(1590, 374_400.0),
            user: Geodetic::from_degrees(40.0, -100.0, height_m),
            user_m: Vector3::zeros(),
            user_mps: Vector3::zeros(),
            satellite: State { position_m: Vector3::new(orbit, 0.0, 0.0), velocity_mps: Vector3::zeros() },
            range_m: (orbit * orbit - across * across).sqrt() - earth * libm::sin(elevation_rad),
            look: Look { azimuth_rad: 1.0, elevation_rad },
            off_nadir_rad: libm::asin(across / orbit),
        }
    }

    #[test]
    fn the_default_budget_is_the_reference_table() {
        // Computed outside this project from the same patterns; printed to 1e-4 dB.
        let table = [
            (5.0, 38.0649),
            (10.0, 39.7976),
            (15.0, 41.0843),
            (20.0, 42.4067),
            (30.0, 44.6481),
            (40.0, 46.363),
            (50.0, 47.4898),
            (60.0, 48.0209),
            (70.0, 48.1079),
            (80.0, 48.0985),
            (90.0, 47.905),
        ];
        for (elevation, expected) in table {
            let found = LinkBudget::default().cn0_dbhz(&sight(elevation, 0.0), L1_CA.centre_hz());
            assert!((found - expected).abs() < 1e-3, "{elevation}: {found} {expected}");
        }
    }

    #[test]
    fn the_power_on_the_ground_keeps_the_documents_minimum() {
        // IS-GPS-200N, table 3-Va: −158.5 dBW into a 3 dBi linearly polarised antenna above 5°, here 0 dBic.
        for elevation in [5.0, 45.0, 90.0] {
            let budget = LinkBudget { antenna: Antenna::level(Pattern::Isotropic), ..LinkBudget::default() };
            let received_dbw = budget.cn0_dbhz(&sight(elevation, 0.0), L1_CA.centre_hz()) - 204.0 + 2.5 + 2.0;
            assert!((-158.5..-154.0).contains(&received_dbw), "{elevation}: {received_dbw}");
        }
    }

    #[test]
    fn galileo_keeps_its_documents_minimum_on_the_ground_in_the_shape_of_gps() {
        let received_dbw = |sight: &Sight, signal: &Signal| {
            let budget = LinkBudget { antenna: Antenna::level(Pattern::Isotropic), ..LinkBudget::default() };
            let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
            budget.act(sight, signal, &mut rays);
            10.0 * libm::log10(rays[0].cn0_hz) - 204.0 + 2.5 + 2.0
        };
        for elevation in [5.0, 20.0, 45.0, 70.0, 90.0] {
            let sv = Sv { system: System::Galileo, number: 11 };
            let found = received_dbw(&Sight { sv, ..from_orbit(elevation, 0.0, 29_600.318e3) }, &E1);
            // OS SIS ICD 2.1, table 11: −157.25 dBW of both components above 5°.
            assert!((-157.25..-152.5).contains(&found), "{elevation}: {found}");
            // The ways from both orbits differ by 1.01 dB at 5° and by 1.22 dB at the zenith.
            let over_gps = found - received_dbw(&sight(elevation, 0.0), &L1_CA);
            assert!((1.25 - 0.22..1.25 + 0.01).contains(&over_gps), "{elevation}: {over_gps}");
        }
    }

    /// Satellites with the semi-major axis and eccentricity of their orbits, kilometres: nominal orbits of
    /// each kind, Galileo's two on the orbits of a failed launch, the first of QZSS, and an inclined one of
    /// BeiDou whose number the program does not know.
    const ORBITS: [(&str, f64, f64); 11] = [
        ("G05", 26_559.7, 0.02),
        ("E11", 29_600.3, 0.0005),
        ("E14", 27_977.6, 0.162),
        ("R05", 25_510.0, 0.003),
        ("C25", 27_906.1, 0.002),
        ("C38", 42_164.2, 0.01),
        ("C46", 42_164.2, 0.01),
        ("C03", 42_164.2, 0.0005),
        ("J02", 42_164.2, 0.1),
        ("I06", 42_164.2, 0.002),
        ("S31", 42_164.2, 0.0005),
    ];

    #[test]
    fn no_signal_is_received_below_its_document_s_minimum_on_any_orbit() {
        let mut seen = 0;
        for (sv, axis_km, eccentricity) in ORBITS {
            let sv: Sv = sv.parse().unwrap();
            let blocks: &[Block] = match sv.system {
                System::Gps => &[Block::Typical, Block::Iia, Block::Iir, Block::IirM],
                _ => &[Block::Typical],
            };
            let signals = gnss::signal::SIGNALS.into_iter().filter(|signal| signal.system == sv.system);
            for (signal, block) in signals.flat_map(|signal| blocks.iter().map(move |block| (signal, *block))) {
                let Some(minimum_dbw) = signal.minimum_power_dbw else { continue };
                let antenna = Antenna::level(Pattern::Isotropic);
                let budget = LinkBudget { antenna, block, ..LinkBudget::default() };
                let mut least_dbw = f64::INFINITY;
                for (elevation, around) in (5..=90).flat_map(|e| (0..=20).map(move |k| (e, f64::from(k) / 20.0))) {
                    let orbit_m = axis_km * 1e3 * (1.0 - eccentricity + 2.0 * eccentricity * around);
                    let sight = Sight { sv, ..from_orbit(f64::from(elevation), 0.0, orbit_m) };
                    let mut rays =
                        vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
                    budget.act(&sight, signal, &mut rays);
                    least_dbw = least_dbw.min(10.0 * libm::log10(rays[0].cn0_hz) - 204.0 + 2.5 + 2.0);
                }
                println!("{sv} {} {block:?}: {:.2} dB above", signal.name, least_dbw - minimum_dbw);
                assert!(least_dbw >= minimum_dbw, "{sv} {}: {least_dbw} {minimum_dbw}", signal.name);
                seen += 1;
            }
        }
        assert!(seen >= 30, "{seen}");
    }

    #[test]
    fn signals_of_other_bands_are_received_as_far_apart_as_their_minima() {
        let cn0_dbhz = |signal: &Signal| {
            let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
            LinkBudget::default().act(&sight(40.0, 0.0), signal, &mut rays);
            10.0 * libm::log10(rays[0].cn0_hz)
        };
        let stronger = Signal { carrier: Carrier::Common(1_176.45e6), minimum_power_dbw: Some(-154.0), ..L1_CA };
        // Friis' 2.5 dB between the carriers are in the transmitted power, not in the received one.
        assert!((cn0_dbhz(&stronger) - cn0_dbhz(&L1_CA) - 4.5).abs() < 1e-9);
    }

    #[test]
    fn a_fixed_ratio_is_the_same_everywhere() {
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }; 2];
        FixedCn0 { cn0_dbhz: 45.0 }.act(&sight(5.0, 0.0), &L1_CA, &mut rays);
        assert!(rays.iter().all(|ray| (ray.cn0_hz - 31_622.776_601_683_8).abs() < 1e-8));
    }
}
