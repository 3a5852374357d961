//! Broadcast orbits and clocks: ephemerides and the user algorithms that turn them into states. Keplerian
//! elements are here, a state vector that is integrated in `vector`.
//!
//! Source: IS-GPS-200N, 20.3.3.3.3.1 (clock), 20.3.3.4.3 (orbit, table 20-IV; velocity from its
//! derivative, table 20-IV part 3). Limits: one ephemeris describes an orbit to about 2 m
//! within its fit interval.

use nalgebra::Vector3;

use crate::bits::FieldError;
use crate::earth::{EARTH_ROTATION_RADPS, GPS_MU_M3PS2};
use crate::satellite::{Sv, System};
use crate::signal::Signal;
use crate::time::{Epoch, WEEK_S};

mod carried;
mod error;
mod form;
mod kepler;
mod vector;

pub use error::OrbitError;
pub use form::{PLAIN, STRING_3_UNHEALTHY, SetForm, status_of_record};
pub use kepler::solve_kepler;
use kepler::wrap;
pub use vector::StateVector;

/// RINEX code whose delay is T_GD itself: P(Y) on L1, against the clock of P(Y) on L1 and L2 together
/// (IS-GPS-200N, 20.3.3.3.3.2).
pub const GPS_CLOCK_CODE: &str = "1W";

/// Broadcast ephemeris of one satellite, in SI units and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Ephemeris {
    /// The satellite.
    pub sv: Sv,
    /// Meaning of clock and health in the message from which the ephemeris was decoded.
    pub form: &'static SetForm,
    /// Reference time of the orbit.
    pub toe: Epoch,
    /// Reference time of the clock.
    pub toc: Epoch,
    /// Time of first transmission of this ephemeris, as far as known.
    pub transmitted: Epoch,
    /// Issue of data: IODE of GPS, IODnav of Galileo, IODEC of NavIC; of BeiDou a number of the
    /// reference time.
    pub iode: u16,
    /// Issue of the clock: IODC of GPS (IS-GPS-200N, 20.3.3.3.1.5), IODnav of Galileo, AODC of BeiDou.
    pub iodc: u16,
    /// User range accuracy index, 0..=15 (IS-GPS-200N, 20.3.3.3.1.3); SISA index of Galileo.
    pub ura_index: u8,
    /// Health bits, of which 0 is healthy. GPS has the six of IS-GPS-200N, 20.3.3.3.1.4. Galileo has validity
    /// (1) and health (2) of E1-B, then of E5b, then of E5a, from the lowest bit on. NavIC has the flags of S
    /// and L5. See [`Self::is_healthy`].
    pub health: u16,
    /// Codes on L2: 1 for P, 2 for C/A (IS-GPS-200N, 20.3.3.3.1.2).
    pub l2_codes: u8,
    /// True if the P code on L2 carries no message (IS-GPS-200N, 20.3.3.3.1.6).
    pub l2_p_data_off: bool,
    /// True if the curve fit interval exceeds four hours (IS-GPS-200N, 20.3.3.4.3.1).
    pub long_fit: bool,
    /// Age of data offset, in its 900 s units; AODE of BeiDou; days of GLONASS.
    pub aodo: u8,
    /// Square root of the semi-major axis at the reference time, √m.
    pub sqrt_a_sqrtm: f64,
    /// Rate of the semi-major axis, in m/s; zero for messages without it.
    pub axis_rate_mps: f64,
    /// Eccentricity of the orbit.
    pub eccentricity: f64,
    /// Mean anomaly at the reference time, in radians.
    pub m0_rad: f64,
    /// Mean motion correction in rad/s, relative to the semi-major axis.
    pub delta_n_radps: f64,
    /// Rate of the mean motion correction in rad/s²; zero for messages without it.
    pub delta_n_rate_radps2: f64,
    /// Longitude of the ascending node at the beginning of the week, in radians.
    pub omega0_rad: f64,
    /// Rate of right ascension of the node, rad/s.
    pub omega_dot_radps: f64,
    /// Argument of perigee, in radians.
    pub omega_rad: f64,
    /// Inclination at the reference time, in radians.
    pub i0_rad: f64,
    /// Rate of the inclination, rad/s.
    pub idot_radps: f64,
    /// Amplitude of the cosine harmonic correction to the argument of latitude, in radians.
    pub cuc_rad: f64,
    /// Amplitude of the sine harmonic correction to the argument of latitude, in radians.
    pub cus_rad: f64,
    /// Amplitude of the cosine harmonic correction to the orbit radius, in metres.
    pub crc_m: f64,
    /// Amplitude of the sine harmonic correction to the orbit radius, in metres.
    pub crs_m: f64,
    /// Amplitude of the cosine harmonic correction to the inclination, in radians.
    pub cic_rad: f64,
    /// Amplitude of the sine harmonic correction to the inclination, in radians.
    pub cis_rad: f64,
    /// Clock's offset at its reference time.
    pub af0_s: f64,
    /// Clock's drift, s/s.
    pub af1_sps: f64,
    /// Half the rate of that drift, s/s².
    pub af2_sps2: f64,
    /// Group delay in seconds: T_GD of GPS (IS-GPS-200N, 20.3.3.3.3.2), BGD(E1,E5b) of Galileo, T_GD of
    /// NavIC's S, T_GD1 of BeiDou.
    pub tgd_s: f64,
    /// Second group delay in seconds, for messages that have two: BGD(E1,E5a) of Galileo, T_GD2 of BeiDou.
    pub tgd2_s: f64,
    /// Inter-signal corrections in seconds, beside the group delay in `tgd_s`. CNAV has L1 C/A, L2C, I5 and
    /// Q5. CNAV-2 adds pilot and data of L1C. NavIC on L1 has two, at the last positions.
    pub isc_s: [f64; 6],
    /// Carriers of the clock, as the message states them: NavIC on L1 has 0 for L1 and L5, 1 for S and L5.
    /// Other messages have 0.
    pub reference_flag: u8,
    /// Group delays in seconds that another message of the satellite states, by RINEX code ("5Q"). T_GD of
    /// GPS's clock is under [`GPS_CLOCK_CODE`]. Other delays follow from `tgd_s`.
    pub signal_delays_s: Vec<(&'static str, f64)>,
    /// State and forces at the reference time, for messages without Keplerian elements, which are then zero
    /// here.
    pub vector: Option<StateVector>,
}

/// Position and velocity in ECEF at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// ECEF position, in metres.
    pub position_m: Vector3<f64>,
    /// ECEF velocity, in m/s.
    pub velocity_mps: Vector3<f64>,
}

/// Offset of a clock from GPS time in seconds, and its rate in s/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockState {
    /// Clock time minus true time, in seconds.
    pub offset_s: f64,
    /// Rate of the offset, s/s.
    pub drift: f64,
}

/// Mean elements at a chosen reference time, without harmonics: [`Ephemeris::mean_at`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Square root of the semi-major axis, √m.
    pub sqrt_a_sqrtm: f64,
    /// Inclination, in radians.
    pub inclination_rad: f64,
    /// Node at the beginning of the reference time's week, in radians.
    pub omega0_rad: f64,
    /// Mean anomaly at the reference time, in radians.
    pub m0_rad: f64,
    /// Clock's offset at the reference time.
    pub af0_s: f64,
}

/// Constants with which users compute a system's orbits and clocks.
pub(crate) struct Constants {
    /// Gravitational constant of the Earth.
    pub mu_m3ps2: f64,
    /// Rotation of the Earth, in rad/s.
    pub rotation_radps: f64,
    /// Relativistic clock constant F = −2√μ/c².
    relativity_spsqrtm: f64,
    /// Time in seconds by which the week of the node begins after the GPS week.
    behind_gpst_s: f64,
    /// Carrier to which the message's group delay belongs as it is.
    delay_carrier_hz: f64,
}

/// IS-GPS-200N, table 20-IV and 20.3.3.3.3.1.
const OF_GPS: Constants = Constants {
    mu_m3ps2: GPS_MU_M3PS2,
    rotation_radps: EARTH_ROTATION_RADPS,
    relativity_spsqrtm: -4.442_807_633e-10,
    behind_gpst_s: 0.0,
    delay_carrier_hz: 1_575.42e6,
};
/// Galileo OS SIS ICD 2.1, tables 60 and 66.
const OF_GALILEO: Constants =
    Constants { mu_m3ps2: 3.986_004_418e14, relativity_spsqrtm: -4.442_807_309e-10, ..OF_GPS };
/// BDS-SIS-ICD-B1I-3.0, 5.2.4.10 and table 5-11: CGCS2000, and BDT.
const OF_BEIDOU: Constants = Constants { rotation_radps: 7.292_115_0e-5, behind_gpst_s: 14.0, ..OF_GALILEO };

/// IRNSS SIS ICD for SPS 1.1, user algorithms: constants of WGS 84, and a group delay of S.
const OF_NAVIC: Constants = Constants { delay_carrier_hz: 2_492.028e6, ..OF_GPS };

impl Constants {
    /// Returns the constants that the interface document of `system` prints.
    pub const fn of(system: System) -> &'static Self {
        match system {
            System::Galileo => &OF_GALILEO,
            System::BeiDou => &OF_BEIDOU,
            System::Navic => &OF_NAVIC,
            System::Gps | System::Glonass | System::Qzss | System::Sbas => &OF_GPS,
        }
    }
}

/// Carriers whose delays against B3I BeiDou's messages D1 and D2 give as T_GD1 and T_GD2 (BDS-SIS-ICD-B1I
/// 3.0, 5.2.4.8 and BDS-SIS-ICD 2.1): clocks are those of B3I.
const B1I_HZ: f64 = 1_561.098e6;
const B2I_HZ: f64 = 1_207.14e6;
const B3I_HZ: f64 = 1_268.52e6;

/// Motion in the orbital plane, from which orbit and clock are both computed.
struct Anomaly {
    /// Time from the reference time of the orbit, in seconds.
    since_toe_s: f64,
    semi_major_m: f64,
    sin: f64,
    cos: f64,
    /// 1 − e cos E.
    shrink: f64,
    /// Rate of the eccentric anomaly, in rad/s.
    rate_radps: f64,
}

impl Ephemeris {
    /// All zero, with every time at `at`.
    pub fn blank(sv: Sv, at: Epoch) -> Self {
        Self {
            sv,
            form: &PLAIN,
            toe: at,
            toc: at,
            transmitted: at,
            iode: 0,
            iodc: 0,
            ura_index: 0,
            health: 0,
            l2_codes: 0,
            l2_p_data_off: false,
            long_fit: false,
            aodo: 0,
            sqrt_a_sqrtm: 0.0,
            axis_rate_mps: 0.0,
            eccentricity: 0.0,
            m0_rad: 0.0,
            delta_n_radps: 0.0,
            delta_n_rate_radps2: 0.0,
            omega0_rad: 0.0,
            omega_dot_radps: 0.0,
            omega_rad: 0.0,
            i0_rad: 0.0,
            idot_radps: 0.0,
            cuc_rad: 0.0,
            cus_rad: 0.0,
            crc_m: 0.0,
            crs_m: 0.0,
            cic_rad: 0.0,
            cis_rad: 0.0,
            af0_s: 0.0,
            af1_sps: 0.0,
            af2_sps2: 0.0,
            tgd_s: 0.0,
            tgd2_s: 0.0,
            isc_s: [0.0; 6],
            reference_flag: 0,
            signal_delays_s: Vec::new(),
            vector: None,
        }
    }

    /// The ephemeris if its reference times of orbit and clock are equal: some messages send one for both, or
    /// show by them which of their units belong together.
    ///
    /// # Errors
    /// Reference times that differ.
    pub(crate) fn with_one_reference(&self) -> Result<&Self, FieldError> {
        let (toe_s, toc_s) = (self.toe.tow_s(), self.toc.tow_s());
        if self.toe == self.toc { Ok(self) } else { Err(FieldError::References { toe_s, toc_s }) }
    }

    /// Returns the ephemeris with each of its times replaced by `change(time)`.
    pub fn timed(self, change: impl Fn(Epoch) -> Epoch) -> Self {
        Self { toe: change(self.toe), toc: change(self.toc), transmitted: change(self.transmitted), ..self }
    }

    /// ECEF state at GPS time `at`, in the ECEF axes of that instant. The velocity is that in the rotating
    /// frame.
    ///
    /// # Errors
    /// [`OrbitError`] for elements that describe no orbit. The age of the elements is not judged.
    pub fn state(&self, at: Epoch) -> Result<State, OrbitError> {
        match &self.vector {
            Some(vector) => vector.state(self.sv, at.since(self.toe)),
            None => Ok(self.state_of(&self.anomaly(at)?)),
        }
    }

    /// Computes [`Self::state`] and [`Self::clock_l1`] of one instant with one solution of Kepler's equation.
    ///
    /// # Errors
    /// Errors of [`Self::state`].
    pub fn state_and_clock_l1(&self, at: Epoch) -> Result<(State, ClockState), OrbitError> {
        if self.vector.is_some() {
            return Ok((self.state(at)?, self.clock_l1(at)?));
        }
        let anomaly = self.anomaly(at)?;
        let clock = self.clock_of(&anomaly, at);
        Ok((self.state_of(&anomaly), self.on_l1(clock)))
    }

    fn state_of(&self, anomaly: &Anomaly) -> State {
        let Constants { rotation_radps, behind_gpst_s, .. } = *Constants::of(self.sv.system);
        let flatness = (1.0 - self.eccentricity * self.eccentricity).sqrt();
        let flattened = planted!("gnss.orbit.true_anomaly", flatness, 1.0) * anomaly.sin;
        let true_anomaly_rad = libm::atan2(flattened, anomaly.cos - self.eccentricity);
        let true_rate = flatness * anomaly.rate_radps / anomaly.shrink;
        let latitude_rad = true_anomaly_rad + self.omega_rad;
        let (sin2, cos2) = libm::sincos(2.0 * latitude_rad);

        // Second harmonic perturbations and their derivatives.
        let argument_rad =
            latitude_rad + planted!("gnss.orbit.cus", self.cus_rad, self.cuc_rad) * sin2 + self.cuc_rad * cos2;
        let argument_rate = true_rate * (1.0 + 2.0 * (self.cus_rad * cos2 - self.cuc_rad * sin2));
        let radius_m = anomaly.semi_major_m * anomaly.shrink
            + planted!("gnss.orbit.crs", self.crs_m, -self.crs_m) * sin2
            + self.crc_m * cos2;
        let radius_rate = anomaly.semi_major_m * self.eccentricity * anomaly.sin * anomaly.rate_radps
            + self.axis_rate_mps * anomaly.shrink
            + 2.0 * true_rate * (self.crs_m * cos2 - self.crc_m * sin2);
        let inclination_rad = self.i0_rad
            + planted!("gnss.orbit.idot", self.idot_radps, 0.0) * anomaly.since_toe_s
            + self.cis_rad * sin2
            + self.cic_rad * cos2;
        let inclination_rate = self.idot_radps + 2.0 * true_rate * (self.cis_rad * cos2 - self.cic_rad * sin2);

        // Of BeiDou's geostationary satellites the plane is computed in axes that do not turn with the Earth.
        let is_geostationary = self.sv.is_geostationary();
        let turning_radps = if is_geostationary { 0.0 } else { rotation_radps };
        let node_rate = planted!("gnss.orbit.omega_dot", self.omega_dot_radps, 0.0) - turning_radps;
        // Whole turns are taken from the constant part, so that rounding does not grow with the time of week.
        let node_at_toe_rad = wrap(self.omega0_rad - rotation_radps * (self.toe.tow_s() - behind_gpst_s));
        let node_rad = node_at_toe_rad + node_rate * anomaly.since_toe_s;

        let (sin_u, cos_u) = libm::sincos(argument_rad);
        let (sin_i, cos_i) = libm::sincos(inclination_rad);
        let (sin_node, cos_node) = libm::sincos(node_rad);
        let (x, y) = (radius_m * cos_u, radius_m * sin_u);
        let x_rate = radius_rate * cos_u - y * argument_rate;
        let y_rate = radius_rate * sin_u + x * argument_rate;
        // The plane's y axis projected on the equator, and its rate.
        let level = y * cos_i;
        let level_rate = y_rate * cos_i - y * sin_i * inclination_rate;
        let position_m = Vector3::new(x * cos_node - level * sin_node, x * sin_node + level * cos_node, y * sin_i);
        let velocity_mps = Vector3::new(
            x_rate * cos_node - level_rate * sin_node - planted!("gnss.orbit.velocity", position_m.y, 0.0) * node_rate,
            x_rate * sin_node + level_rate * cos_node + position_m.x * node_rate,
            y_rate * sin_i + y * cos_i * inclination_rate,
        );
        let state = State { position_m, velocity_mps };
        if is_geostationary { tilted(state, rotation_radps, anomaly.since_toe_s) } else { state }
    }

    /// Mean elements without harmonics at another reference time, as almanacs need them. The axis absorbs the
    /// mean motion correction, and the node refers to the beginning of that week.
    pub fn mean_at(&self, at: Epoch) -> Mean {
        let Constants { mu_m3ps2, rotation_radps, .. } = *Constants::of(self.sv.system);
        let age_s = at.since(self.toe);
        let a = self.sqrt_a_sqrtm;
        let motion_radps = mu_m3ps2.sqrt() / (a * a * a) + self.delta_n_radps;
        // Another week's beginning is the Earth's rotation away.
        let weeks = (at.week() - self.toe.week()) as f64;
        let clock_age_s = at.since(self.toc);
        Mean {
            sqrt_a_sqrtm: libm::cbrt(mu_m3ps2.sqrt() / motion_radps),
            inclination_rad: self.i0_rad + self.idot_radps * age_s,
            omega0_rad: self.omega0_rad + self.omega_dot_radps * age_s - rotation_radps * WEEK_S as f64 * weeks,
            m0_rad: self.m0_rad + motion_radps * age_s,
            af0_s: self.af0_s + clock_age_s * (self.af1_sps + clock_age_s * self.af2_sps2),
        }
    }

    /// Satellite clock at GPS time `at` with the relativistic term, without group delay (IS-GPS-200N,
    /// 20.3.3.3.3.1, equation 1).
    ///
    /// # Errors
    /// [`OrbitError`] for elements that describe no orbit.
    pub fn clock(&self, at: Epoch) -> Result<ClockState, OrbitError> {
        if self.vector.is_some() {
            self.check_clock()?;
            // Relativity is in the clock's own rate (GLONASS ICD L1, L2 5.1, 4.4, gamma).
            let dt_s = at.since(self.toc);
            let af1 = planted!("gnss.glonass.gamma", self.af1_sps, -self.af1_sps);
            return Ok(ClockState { offset_s: self.af0_s + af1 * dt_s, drift: af1 });
        }
        Ok(self.clock_of(&self.anomaly(at)?, at))
    }

    fn clock_of(&self, anomaly: &Anomaly, at: Epoch) -> ClockState {
        let dt_s = at.since(self.toc);
        let factor = Constants::of(self.sv.system).relativity_spsqrtm;
        let relativity_s = planted!("gnss.clock.relativity", factor, -factor) * self.eccentricity * self.sqrt_a_sqrtm;
        ClockState {
            offset_s: self.af0_s
                + (planted!("gnss.clock.af1", self.af1_sps, -self.af1_sps) + self.af2_sps2 * dt_s) * dt_s
                + relativity_s * anomaly.sin,
            drift: self.af1_sps + 2.0 * self.af2_sps2 * dt_s + relativity_s * anomaly.cos * anomaly.rate_radps,
        }
    }

    /// Satellite clock for a single-frequency user of L1 C/A: [`Self::clock`] minus T_GD (IS-GPS-200N,
    /// 20.3.3.3.3.2). For another system it is the clock on the carrier to which its group delay belongs.
    ///
    /// # Errors
    /// Errors of [`Self::clock`].
    pub fn clock_l1(&self, at: Epoch) -> Result<ClockState, OrbitError> {
        Ok(self.on_l1(self.clock(at)?))
    }

    fn on_l1(&self, clock: ClockState) -> ClockState {
        ClockState { offset_s: clock.offset_s - self.given_delay_s(), ..clock }
    }

    /// Group delay in seconds on the carrier for which the message gives it.
    pub fn given_delay_s(&self) -> f64 {
        let given_s = (self.form.given_delay_s)(self);
        planted!("gnss.clock.group_delay", given_s, -given_s)
    }

    /// Group delay of `signal` in seconds: [`Self::clock`] minus the clock offset for a user of this signal
    /// alone. The ephemeris states it for the signal, or the message derives it from other delays.
    pub fn group_delay_s(&self, signal: &Signal) -> f64 {
        self.delay_of_code_s(signal.rinex).unwrap_or_else(|| (self.form.group_delay_s)(self, signal))
    }

    /// Group delay on a BeiDou carrier, in seconds, scaled as 1/f² from the delay that the message gives on
    /// `given_hz`. It is zero on B3I, to which the clock refers.
    pub(crate) fn group_delay_on_s(&self, given_hz: f64, carrier_hz: f64) -> f64 {
        let against_b3i = |hz: f64| B3I_HZ * B3I_HZ / (hz * hz) - 1.0;
        if carrier_hz == given_hz {
            return self.given_delay_s();
        }
        self.given_delay_s() * against_b3i(carrier_hz) / against_b3i(given_hz)
    }

    /// Factor (f/f_signal)², with f the carrier for which the message gives its delay: L1, or S for NavIC
    /// (IRNSS SIS ICD for SPS 1.1, user algorithms).
    pub fn dispersion(&self, signal: &Signal) -> f64 {
        let ratio = Constants::of(self.sv.system).delay_carrier_hz / signal.carrier_hz(self.sv);
        planted!("gnss.delay.square", ratio * ratio, ratio)
    }

    /// Satellite clock for a user of `signal` alone.
    ///
    /// # Errors
    /// Errors of [`Self::clock`].
    pub fn clock_of_signal(&self, at: Epoch, signal: &Signal) -> Result<ClockState, OrbitError> {
        let clock = self.clock(at)?;
        Ok(ClockState { offset_s: clock.offset_s - self.group_delay_s(signal), ..clock })
    }

    /// True if the satellite reports its signal on L1 or E1, or the signal of its message, as usable.
    pub fn is_healthy(&self) -> bool {
        (self.form.is_healthy)(self)
    }

    /// True if the satellite reports `signal` as usable. `None` if the ephemeris does not state it.
    pub fn is_healthy_on(&self, signal: &Signal) -> Option<bool> {
        (self.form.healthy)(self, signal)
    }

    /// True if an ephemeris is first sent after its reference time. GPS sends it hours before.
    pub fn is_sent_after_reference(&self) -> bool {
        matches!(self.sv.system, System::Galileo | System::Navic | System::BeiDou)
    }

    /// Parameters that distinguish one orbit from another, as the bits of `f64` values.
    pub fn orbit_bits(&self) -> [u64; 5] {
        let vector = self.vector.unwrap_or_default();
        let of = |element: f64, own: f64| if self.vector.is_some() { own } else { element }.to_bits();
        [
            of(self.sqrt_a_sqrtm, vector.position_m.x),
            of(self.m0_rad, vector.position_m.y),
            of(self.omega0_rad, vector.position_m.z),
            of(self.omega_rad, vector.velocity_mps.x),
            of(self.eccentricity, vector.velocity_mps.y),
        ]
    }

    /// Start of transmission for an ephemeris that is sent only within its fit interval, as for GLONASS.
    /// `None` if the interval is longer.
    pub fn sent_from(&self) -> Option<Epoch> {
        match self.sv.system {
            // Ephemerides of a network are those of its next message.
            System::Sbas => Some(self.transmitted),
            _ => self.vector.map(|_| self.toe.plus_s(-0.5 * self.fit_interval_s())),
        }
    }

    /// Curve fit interval around the reference time, in seconds. A state vector has half an hour with the
    /// reference time in its middle (GLONASS ICD L1, L2 5.1, 4.4, P1). Galileo, NavIC and BeiDou document
    /// none: eight hours, because an ephemeris is used for four hours after its reference time.
    ///
    /// QZSS has two hours (IS-QZSS-PNT-005, 4.1.2.4), SBAS twelve minutes (RTCA DO-229D, table A-25).
    /// GPS has four hours, or the interval of the issue of data when the fit flag is set
    /// (IS-GPS-200N, 20.3.4.4, table 20-XII; intervals of extended operations beyond 26 h are read as 6 h).
    pub fn fit_interval_s(&self) -> f64 {
        let hours = match (self.long_fit, self.iodc) {
            _ if self.sv.system == System::Sbas => 0.2,
            _ if self.vector.is_some() => 0.5,
            _ if self.is_sent_after_reference() => 8.0,
            (false, _) if self.sv.system == System::Qzss => 2.0,
            (false, _) => 4.0,
            (true, 240..=247) => 8.0,
            (true, 248..=255 | 496) => 14.0,
            (true, 497..=503 | 1021..=1023) => 26.0,
            (true, _) => 6.0,
        };
        hours * 3600.0
    }

    fn check_clock(&self) -> Result<(), OrbitError> {
        let parameters = [("af0", self.af0_s), ("af1", self.af1_sps), ("tgd", self.tgd_s)];
        match parameters.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((element, value)) => {
                Err(OrbitError::Element { sv: self.sv, element, value, expected: "a finite number" })
            }
            None => Ok(()),
        }
    }

    fn check(&self) -> Result<(), OrbitError> {
        let error = |element, value, expected| Err(OrbitError::Element { sv: self.sv, element, value, expected });
        if !(self.sqrt_a_sqrtm > 0.0 && self.sqrt_a_sqrtm < 1e5) {
            return error("sqrt_a", self.sqrt_a_sqrtm, "above 0 and below 1e5");
        }
        if !(0.0..1.0).contains(&self.eccentricity) {
            return error("eccentricity", self.eccentricity, "0 to below 1");
        }
        let elements = [
            ("m0", self.m0_rad),
            ("delta_n", self.delta_n_radps),
            ("omega0", self.omega0_rad),
            ("omega_dot", self.omega_dot_radps),
            ("omega", self.omega_rad),
            ("i0", self.i0_rad),
            ("idot", self.idot_radps),
            ("cuc", self.cuc_rad),
            ("cus", self.cus_rad),
            ("crc", self.crc_m),
            ("crs", self.crs_m),
            ("cic", self.cic_rad),
            ("cis", self.cis_rad),
            ("af0", self.af0_s),
            ("af1", self.af1_sps),
            ("af2", self.af2_sps2),
            ("tgd", self.tgd_s),
        ];
        let delays = self.signal_delays_s.iter().map(|(_, delay_s)| ("group delay of a signal", *delay_s));
        match elements.into_iter().chain(delays).find(|(_, value)| !value.is_finite()) {
            Some((element, value)) => error(element, value, "a finite number"),
            None => Ok(()),
        }
    }

    fn anomaly(&self, at: Epoch) -> Result<Anomaly, OrbitError> {
        self.check()?;
        let since_toe_s = at.since(self.toe);
        let semi_major_m = self.sqrt_a_sqrtm * self.sqrt_a_sqrtm;
        let at_toe_radps = self.mean_motion_radps();
        // Half the rate until now, the whole of it now (IS-GPS-705J, table 20-II).
        let changed_radps = 0.5 * self.delta_n_rate_radps2 * since_toe_s;
        let anomaly_rad = solve_kepler(self.m0_rad + (at_toe_radps + changed_radps) * since_toe_s, self.eccentricity)
            .ok_or(OrbitError::Kepler { sv: self.sv, eccentricity: self.eccentricity })?;
        let (sin, cos) = libm::sincos(anomaly_rad);
        let shrink = 1.0 - self.eccentricity * cos;
        let mean_radps = at_toe_radps + self.delta_n_rate_radps2 * since_toe_s;
        let semi_major_m = semi_major_m + self.axis_rate_mps * since_toe_s;
        Ok(Anomaly { since_toe_s, semi_major_m, sin, cos, shrink, rate_radps: mean_radps / shrink })
    }

    /// Mean motion at the reference time, in rad/s.
    pub fn mean_motion_radps(&self) -> f64 {
        let semi_major_m = self.sqrt_a_sqrtm * self.sqrt_a_sqrtm;
        (Constants::of(self.sv.system).mu_m3ps2 / (semi_major_m * semi_major_m * semi_major_m)).sqrt()
            + planted!("gnss.orbit.delta_n", self.delta_n_radps, -self.delta_n_radps)
    }
}

/// The state of a geostationary satellite of BeiDou: computed in a plane that is tilted by 5°, as its own
/// would leave the node undefined, in axes of the reference time (BDS-SIS-ICD-B1I 3.0, 5.2.4.10, table 5-11).
fn tilted(state: State, rotation_radps: f64, since_toe_s: f64) -> State {
    let tilt_rad = planted!("gnss.beidou.tilt", -5_f64, 5_f64).to_radians();
    let (sin_tilt, cos_tilt) = libm::sincos(tilt_rad);
    let about_x = |v: Vector3<f64>| Vector3::new(v.x, cos_tilt * v.y + sin_tilt * v.z, cos_tilt * v.z - sin_tilt * v.y);
    let (sin_turn, cos_turn) = libm::sincos(rotation_radps * since_toe_s);
    let about_z = |v: Vector3<f64>| Vector3::new(cos_turn * v.x + sin_turn * v.y, cos_turn * v.y - sin_turn * v.x, v.z);
    let position_m = about_z(about_x(state.position_m));
    let carried = Vector3::new(position_m.y, -position_m.x, 0.0) * rotation_radps;
    State { position_m, velocity_mps: about_z(about_x(state.velocity_mps)) + carried }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gps::l1ca::L1_CA;
    use crate::signal::Carrier;

    fn example() -> Ephemeris {
        let toe = Epoch::from_week(1590, 345_600.0);
        Ephemeris {
            sv: Sv::gps(2),
            form: &PLAIN,
            toe,
            toc: toe,
            transmitted: toe,
            iode: 85,
            iodc: 85,
            ura_index: 0,
            health: 0,
            l2_codes: 1,
            l2_p_data_off: false,
            long_fit: false,
            aodo: 0,
            sqrt_a_sqrtm: 5_153.597_391_13,
            eccentricity: 0.009_606_978_041_12,
            m0_rad: 1.657_721_674_12,
            delta_n_radps: 5.255_575_974_42e-9,
            omega0_rad: -1.274_587_197_64,
            omega_dot_radps: -8.387_849_526_06e-9,
            omega_rad: 3.097_399_039_49,
            i0_rad: 0.939_349_150_611,
            idot_radps: -2.321_525_263_69e-11,
            cuc_rad: 2.322_718_501_09e-6,
            cus_rad: 6.174_668_669_7e-6,
            crc_m: 249.9375,
            crs_m: 41.4375,
            cic_rad: -5.587_935_447_69e-9,
            cis_rad: 1.676_380_634_31e-7,
            af0_s: 2.691_089_175_64e-4,
            af1_sps: 3.183_231_456_21e-12,
            af2_sps2: 0.0,
            tgd_s: -1.722_946_751_76e-8,
            tgd2_s: 0.0,
            axis_rate_mps: 0.0,
            delta_n_rate_radps2: 0.0,
            isc_s: [0.0; 6],
            reference_flag: 0,
            signal_delays_s: Vec::new(),
            vector: None,
        }
    }

    #[test]
    fn velocity_and_drift_are_the_derivatives_of_position_and_offset() {
        for eccentricity in [0.0, 0.0096, 0.1, 0.5] {
            let set = Ephemeris { eccentricity, axis_rate_mps: 0.02, delta_n_rate_radps2: 1e-14, ..example() };
            for minute in -12..=12 {
                let at = set.toe.plus_s(f64::from(minute) * 600.0 + 0.3);
                let p = |dt: f64| set.state(at.plus_s(dt)).unwrap().position_m;
                // Five-point rule: truncation h^4/30 |r^(5)| = 3e-8 m/s at h = 10 s and e = 0.5;
                // rounding 1.5 * 4e-9 m / 10 s = 6e-10 m/s.
                let h = 10.0;
                let numeric = (p(-2.0 * h) - p(2.0 * h) + (p(h) - p(-h)) * 8.0) / (12.0 * h);
                assert!((numeric - set.state(at).unwrap().velocity_mps).norm() < 5e-6, "{eccentricity} {minute}");
                let c = |dt: f64| set.clock(at.plus_s(dt)).unwrap().offset_s;
                // Truncation h²/6 F e √A n³ < 1e-17; rounding 5e-20 / 10 s.
                assert!(((c(h) - c(-h)) / (2.0 * h) - set.clock(at).unwrap().drift).abs() < 2e-15);
            }
        }
    }

    #[test]
    fn what_is_no_orbit_is_an_error_that_names_the_element() {
        let at = example().toe;
        let cases = [
            (Ephemeris { sqrt_a_sqrtm: 0.0, ..example() }, "sqrt_a"),
            (Ephemeris { eccentricity: 1.5, ..example() }, "eccentricity"),
            (Ephemeris { eccentricity: f64::NAN, ..example() }, "eccentricity"),
            (Ephemeris { crs_m: f64::INFINITY, ..example() }, "crs"),
        ];
        for (set, name) in cases {
            assert!(matches!(set.state(at), Err(OrbitError::Element { element, .. }) if element == name));
            assert!(set.clock_l1(at).is_err());
        }
    }

    #[test]
    fn every_signal_has_the_clock_less_its_own_group_delay() {
        static L2: Signal = Signal { name: "on L2", carrier: Carrier::Common(1_227.6e6), ..L1_CA };
        static OWN: Signal = Signal { rinex: "2L", ..L2 };
        let set = Ephemeris { signal_delays_s: vec![("2L", 3.5e-9)], ..example() };
        let at = set.toe.plus_s(1234.0);
        let (l1, bare) = (set.clock_l1(at).unwrap(), set.clock(at).unwrap());
        assert_eq!(set.clock_of_signal(at, &L1_CA).unwrap(), l1);
        // IS-GPS-200N, 20.3.3.3.3.2: γ = (77/60)² for L2.
        let (gamma, l2) = (77.0 * 77.0 / 3600.0, set.clock_of_signal(at, &L2).unwrap());
        assert!((l2.offset_s - (bare.offset_s - gamma * set.tgd_s)).abs() < 1e-19);
        assert_eq!(set.group_delay_s(&OWN), 3.5e-9);
        let wrong = Ephemeris { signal_delays_s: vec![("2L", f64::NAN)], ..example() };
        assert!(wrong.state(at).is_err());
    }

    #[test]
    fn the_week_s_end_leaves_no_step() {
        // The reference time lies in the next week; the instants on both sides of the rollover.
        let set = Ephemeris { toe: Epoch::from_week(1591, 0.0), toc: Epoch::from_week(1591, 0.0), ..example() };
        let before = set.state(Epoch::from_week(1590, 604_799.0).plus_s(1.0 - 1e-9)).unwrap().position_m;
        let after = set.state(Epoch::from_week(1591, 0.0)).unwrap().position_m;
        // 4 km/s for a nanosecond is 4e-6 m.
        assert!((after - before).norm() < 5e-6);
    }
}
