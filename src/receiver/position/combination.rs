//! Two carriers of one satellite in a combination that is free of the ionosphere.
//!
//! The ionosphere delays code by I·(f₁/f)² and advances the carrier by as much, to first order. With a₁ =
//! f₁²/(f₁²−f₂²) and a₂ = −f₂²/(f₁²−f₂²) the sum a₁x₁ + a₂x₂ has none of it, of codes and of carriers alike
//! (IS-GPS-200N, 20.3.3.3.3.3; Kaplan and Hegarty, 7.2.4). Codes are smoothed in the combination, so that
//! nothing diverges. The difference of both, times −a₂, is the ionosphere on the first carrier. Clock and
//! group delays go the same way, each signal with its own. Noise grows to √(a₁²σ₁² + a₂²σ₂²): 2.98 of equal
//! ones on L1 and L2. Limits: terms of higher order (centimetres) stay; a front end that delays one band
//! against the other adds a₂ times that, alike for all satellites that are combined, but not for those beside
//! them that have one carrier alone.

use gnss::broadcast::ClockState;
use gnss::record::Observation;
use gnss::satellite::Sv;
use gnss::signal::Signal;

/// Carriers nearer to each other than this share are one band: noise would grow by ten and more.
const LEAST_APART: f64 = 0.05;

/// Two observations of one satellite at one sample, and their weights.
#[derive(Clone, Copy, Debug)]
pub struct Combination<'a> {
    /// The signal that comes first.
    pub first: &'a Observation,
    /// The other signal.
    pub second: &'a Observation,
    /// Weights of both, which add up to one.
    pub weights: [f64; 2],
}

impl<'a> Combination<'a> {
    /// Combination of two signals of a satellite; `None` where their carriers are in one band.
    pub fn of(first: &'a Observation, second: &'a Observation) -> Option<Self> {
        let weights = weights(first.sv, first.signal, second.signal)?;
        Some(Self { first, second, weights })
    }

    /// The sum of a figure of each signal by the weights.
    pub fn sum(&self, first: f64, second: f64) -> f64 {
        let [a, b] = self.weights;
        a * first + b * second
    }

    /// The standard deviation of the sum, from that of each signal.
    pub fn sigma(&self, first: f64, second: f64) -> f64 {
        let [a, b] = self.weights;
        libm::hypot(a * first, b * second)
    }

    /// Code.
    pub fn pseudorange_m(&self) -> f64 {
        // The difference first: both are near 2e7 m.
        self.first.pseudorange_m + self.weights[1] * (self.second.pseudorange_m - self.first.pseudorange_m)
    }

    /// Carrier in metres, but for a constant.
    pub fn carrier_m(&self) -> f64 {
        let metres = |row: &Observation| row.carrier_cycles * row.signal.wavelength_m(row.sv);
        self.sum(metres(self.first), metres(self.second))
    }

    /// Group delay of the ionosphere on the first carrier by the codes, with what the satellite's clocks and
    /// the receiver's bands are apart.
    pub fn dispersion_m(&self) -> f64 {
        let apart_m = self.second.pseudorange_m - self.first.pseudorange_m;
        planted!("receiver.position.dispersion", -self.weights[1], self.weights[0]) * apart_m
    }

    /// Ionospheric group delay on the first carrier in metres, from the carrier phases, except for a
    /// constant. The ionosphere advances carriers by the amount that it delays codes.
    pub fn carrier_dispersion_m(&self) -> f64 {
        let metres = |row: &Observation| row.carrier_cycles * row.signal.wavelength_m(row.sv);
        -self.weights[1] * (metres(self.first) - metres(self.second))
    }

    /// Ionospheric part of a difference of both signals, second minus first.
    pub fn dispersed(&self, apart: f64) -> f64 {
        -self.weights[1] * apart
    }

    /// Time since either carrier was locked.
    pub fn locked_s(&self) -> f64 {
        let (first_s, second_s) = (self.first.locked_s, self.second.locked_s);
        planted!("receiver.position.locked", first_s.min(second_s), first_s.max(second_s))
    }

    /// The satellite's clock as the combination carries it.
    pub fn clock(&self, first: ClockState, second: ClockState) -> ClockState {
        let offset_s = first.offset_s + self.weights[1] * (second.offset_s - first.offset_s);
        ClockState { offset_s, ..first }
    }
}

/// The weights of two signals of a satellite.
fn weights(sv: Sv, first: &Signal, second: &Signal) -> Option<[f64; 2]> {
    let (f1, f2) = (first.carrier_hz(sv), second.carrier_hz(sv));
    let apart = f1 * f1 - f2 * f2;
    ((f1 / f2 - 1.0).abs() >= LEAST_APART).then(|| [f1 * f1 / apart, -f2 * f2 / apart])
}

/// The observations of one satellite that are used: two in combination, or all of them as they are.
#[derive(Clone, Debug)]
pub enum Used<'a> {
    /// Two carriers.
    Combined(Combination<'a>),
    /// One carrier.
    Single(&'a Observation),
}

/// Pairs of the satellites with two carriers, and all observations of the other satellites, in the order of
/// the satellites. A pair has the carriers that are farthest apart, of equal ones the first.
pub fn paired(observations: &[Observation]) -> Vec<Used<'_>> {
    let mut used = Vec::with_capacity(observations.len());
    for (index, observation) in observations.iter().enumerate() {
        let sv = observation.sv;
        if observations.iter().take(index).any(|earlier| earlier.sv == sv) {
            continue;
        }
        let own: Vec<&Observation> = observations.iter().skip(index).filter(|other| other.sv == sv).collect();
        let apart_hz = |combination: &Combination<'_>| {
            let carrier_hz = |row: &Observation| row.signal.carrier_hz(row.sv);
            (carrier_hz(combination.first) - carrier_hz(combination.second)).abs()
        };
        let pairs = own
            .iter()
            .enumerate()
            .flat_map(|(place, first)| own.iter().skip(place + 1).filter_map(|second| Combination::of(first, second)));
        let best = pairs.reduce(|best, next| if apart_hz(&next) > apart_hz(&best) { next } else { best });
        match best {
            Some(combination) => used.push(Used::Combined(combination)),
            None => used.extend(own.into_iter().map(Used::Single)),
        }
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::Carrier;

    static L2: Signal = Signal { name: "L2", carrier: Carrier::Common(1_227.60e6), ..L1_CA };
    static NEAR: Signal = Signal { name: "near", carrier: Carrier::Common(1_576e6), ..L1_CA };

    fn row(prn: u8, signal: &'static Signal, ionosphere_m: f64) -> Observation {
        let (sv, ratio) = (Sv::gps(prn), L1_CA.carrier_hz(Sv::gps(prn)) / signal.carrier_hz(Sv::gps(prn)));
        let delay_m = ionosphere_m * ratio * ratio;
        Observation {
            sample: 0,
            sv,
            signal,
            sent_s: 0,
            sent_fraction_s: 0.0,
            pseudorange_m: 2.2e7 + delay_m,
            carrier_cycles: (2.2e7 - delay_m) / signal.wavelength_m(sv),
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 1.0,
        }
    }

    #[test]
    fn neither_code_nor_carrier_has_an_ionosphere_and_noise_grows_by_the_printed_factor() {
        let (first, second) = (row(3, &L1_CA, 12.0), row(3, &L2, 12.0));
        for combination in [Combination::of(&first, &second), Combination::of(&second, &first)] {
            let combination = combination.unwrap();
            // The last digit of 2e7 m is 4e-9 m, three times over.
            assert!((combination.pseudorange_m() - 2.2e7).abs() < 3e-8);
            assert!((combination.carrier_m() - 2.2e7).abs() < 3e-8);
            // Kaplan and Hegarty, 7.2.4: 2.546 and −1.546 of L1 and L2.
            assert!((combination.sigma(1.0, 1.0) - libm::hypot(2.546, 1.546)).abs() < 1e-3);
        }
    }

    #[test]
    fn a_group_delay_that_goes_with_the_square_of_the_wavelength_leaves_the_clock_as_it_is_broadcast() {
        let (first, second) = (row(3, &L1_CA, 0.0), row(3, &L2, 0.0));
        let combination = Combination::of(&first, &second).unwrap();
        let clock = |tgd_s: f64| ClockState { offset_s: 1e-4 - tgd_s, drift: 0.0 };
        let gamma = (77.0 / 60.0_f64) * (77.0 / 60.0);
        // IS-GPS-200N, 20.3.3.3.3.2: L1 has T_GD, L2 γ T_GD, and both together none.
        assert!((combination.clock(clock(5e-9), clock(gamma * 5e-9)).offset_s - 1e-4).abs() < 1e-19);
    }

    #[test]
    fn the_carriers_farthest_apart_are_combined_and_a_satellite_with_one_band_stays_as_it_is() {
        let rows = [row(3, &L1_CA, 0.0), row(3, &L2, 0.0), row(3, &NEAR, 0.0), row(5, &L1_CA, 0.0), row(5, &NEAR, 0.0)];
        let used = paired(&rows);
        let names: Vec<Vec<&str>> = used
            .iter()
            .map(|used| match used {
                Used::Combined(pair) => vec![pair.first.signal.name, pair.second.signal.name],
                Used::Single(row) => vec![row.signal.name],
            })
            .collect();
        assert_eq!(names, [vec!["L2", "near"], vec!["GPS L1 C/A"], vec!["near"]]);
    }
}
