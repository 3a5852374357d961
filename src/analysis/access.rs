//! Multiple access and interference: what other waves take from a satellite's C/N0.
//!
//! Codes of the same kind are no more orthogonal than noise: each adds its power times the spectral
//! separation coefficient κ = ∫S² df / (∫S df)² to the noise density (J. W. Betz, NAVIGATION 48(4), 2001).
//! For rectangular chips of duration T that is 2T/3. S is the spectrum of the correlation between signal and
//! replica, so a sampler that averages over its interval, and a replica that does too, narrow it and raise κ.
//! Satellites of other signals are not counted. Interference adds its own power times its own separation
//! ([`super::jamming`]).

use std::collections::HashMap;

use super::jamming;
use super::load::Run;
use super::psd::pulse_density;
use crate::gnss::record::Observation;
use crate::gnss::signal::Signal;

/// C/N0 that a receiver can measure, per true observation.
pub struct Access<'r> {
    run: &'r Run,
    kappa_s: HashMap<&'static str, f64>,
    /// What interference adds to the noise density at a sample, in units of the thermal one.
    jammed: HashMap<(u64, &'static str), f64>,
}

impl<'r> Access<'r> {
    /// From the truth of a run.
    pub fn new(run: &'r Run) -> Self {
        let mut kappa_s = HashMap::new();
        for signal in run.truth.keys().map(|link| link.signal) {
            kappa_s.entry(signal.name).or_insert_with(|| kappa(signal, &run.scene.code_edge, run.scene.sample_rate_hz));
        }
        Self { run, jammed: jammed(run, kappa_s.keys().copied()), kappa_s }
    }

    /// C/N0 of a true observation with the other satellites and interference counted as noise; infinite without any.
    pub fn effective_dbhz(&self, row: &Observation) -> f64 {
        let own_hz = linear(row.cn0_dbhz);
        let sum_hz = self.run.cn0_sums_hz.get(&(row.sample, row.signal.name)).copied().unwrap_or(own_hz);
        let kappa_s = self.kappa_s.get(row.signal.name).copied().unwrap_or(0.0);
        let thermal = if self.run.scene.noise { 1.0 } else { 0.0 };
        let jammed = self.jammed.get(&(row.sample, row.signal.name)).copied().unwrap_or(0.0);
        10.0 * libm::log10(
            own_hz / (thermal + kappa_s * planted!("analysis.access.others", sum_hz - own_hz, 10.0 * sum_hz) + jammed),
        )
    }
}

fn jammed(run: &Run, signals: impl Iterator<Item = &'static str>) -> HashMap<(u64, &'static str), f64> {
    let sources = jamming::sources(run);
    let mut sums = HashMap::new();
    for signal in signals.filter_map(Signal::find) {
        let sign = if run.scene.inverted { -1.0 } else { 1.0 };
        let signal_hz = sign * (signal.centre_hz() - run.scene.center_hz.unwrap_or(signal.centre_hz()));
        let kappa: HashMap<usize, f64> = sources
            .iter()
            .map(|(number, source)| {
                let (edge, rate_hz) = (&run.scene.code_edge, run.scene.sample_rate_hz);
                (*number, jamming::separation_s(source, signal, signal_hz, edge, rate_hz))
            })
            .collect();
        for row in &run.interference {
            let kappa_s = kappa.get(&row.source).copied().unwrap_or(0.0);
            *sums.entry((row.sample, signal.name)).or_insert(0.0) += kappa_s * linear(row.jn0_dbhz);
        }
    }
    sums
}

fn linear(cn0_dbhz: f64) -> f64 {
    libm::pow(10.0, cn0_dbhz / 10.0)
}

/// κ of a signal's first component against its own kind, in seconds.
fn kappa(signal: &Signal, code_edge: &str, rate_hz: f64) -> f64 {
    let Some(component) = signal.components.first() else { return 0.0 };
    let chip_rate_hz = component.chip_rate_hz;
    // To ±30 chip rates, where the tail of S² is below 1e-7 of the whole; midpoints every hundredth.
    let step_hz = chip_rate_hz / 100.0;
    let (mut power, mut square) = (0.0, 0.0);
    for k in -3000..3000 {
        let density = pulse_density(code_edge, (f64::from(k) + 0.5) * step_hz, chip_rate_hz, rate_hz);
        power += density;
        square += density * density;
    }
    square / (power * power * step_hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::gps::l1ca::L1_CA;

    #[test]
    fn separation_is_two_thirds_of_a_chip_and_more_where_samples_are_means() {
        let chips = |edge: &str, rate_hz: f64| kappa(&L1_CA, edge, rate_hz) * 1.023e6;
        // The cut at ±30 chip rates leaves 1/(30 π²) = 0.3 % of the power out, twice that in the square.
        assert!((chips("nearest", 2.6e6) - 2.0 / 3.0).abs() < 0.006);
        // Computed by another program from the same definition.
        assert!((chips("area", 2.6e6) - 0.8267).abs() < 0.001);
        assert!((chips("area", 10e6) - 0.7110).abs() < 0.005);
    }
}
