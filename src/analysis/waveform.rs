//! A signal's spectrum as a sampler meets it, and the correlation whose transform that is.
//!
//! Both are sums over the signal's components by their shares of power, each from its own pulses
//! ([`gnss::signal::Shape`]). Samples show a spectrum with its aliases, behind the response of what
//! samples it ([`Sampler`]). Limits: codes count as random, so that the lines of a short code, its secondary
//! code and the data are left out; a chip that is another component's turn counts as any other.

use std::sync::Arc;

pub use gnss::facts::Edge;
use gnss::facts::SceneFacts;
use gnss::signal::{Component, Layers, Shape, Signal};

/// Cut-off of band-limited edges where a scene's facts do not state it, in cycles a sample.
pub const CUTOFF_CPS: f64 = 0.40;
/// Half width in samples and shape parameter of the window of that filter.
const LIMITED: (f64, f64) = (8.0, 5.65);

/// A sinc under a Kaiser window (Kaiser 1974): its response in closed form.
///
/// The window's transform is 2h·sinh(√(β² − (2πfh)²))/(I0(β)·√(…)) for a half width of h samples, and the
/// response of the product is that of the ideal filter convolved with it: the integral of the transform
/// from f − cut-off to f + cut-off, over its whole.
#[derive(Clone, Debug)]
pub struct KaiserSinc {
    cutoff_cps: f64,
    step_cps: f64,
    /// Integral of the transform from 0 on, at multiples of the step.
    integral: Vec<f64>,
}

/// Steps of that integral in 1/half width, and side lobes up to which it goes: the rest is below 1e-4 of the
/// largest side lobe's share.
const STEPS: f64 = 64.0;
const LOBES: f64 = 24.0;

impl KaiserSinc {
    /// Response for a cut-off (−6 dB) in cycles a sample, a half width of the window in samples and its β.
    pub fn new(cutoff_cps: f64, half_width: f64, beta: f64) -> Self {
        let step_cps = 1.0 / (half_width * STEPS);
        let transform = |f: f64| {
            let turn = std::f64::consts::TAU * f * half_width;
            let square = beta * beta - turn * turn;
            let root = square.abs().sqrt();
            match (root < 1e-6, square > 0.0) {
                (true, _) => 1.0,
                (_, true) => libm::sinh(root) / root,
                (_, false) => libm::sin(root) / root,
            }
        };
        let mut integral = vec![0.0];
        let mut sum = 0.0;
        for k in 0..(LOBES * STEPS) as u32 {
            let at = |part: f64| transform((f64::from(k) + part) * step_cps);
            // Simpson's rule; the scale cancels.
            sum += at(0.0) + 4.0 * at(0.5) + at(1.0);
            integral.push(sum);
        }
        Self { cutoff_cps, step_cps, integral }
    }

    /// Amplitude at `f_cps` cycles a sample from the middle of the filter, 1 there.
    pub fn amplitude(&self, f_cps: f64) -> f64 {
        let between = |f: f64| self.to(f + self.cutoff_cps) - self.to(f - self.cutoff_cps);
        between(f_cps) / between(0.0)
    }

    fn to(&self, f_cps: f64) -> f64 {
        let place = f_cps.abs() / self.step_cps;
        let index = place as usize;
        let value = match (self.integral.get(index), self.integral.get(index + 1)) {
            (Some(a), Some(b)) => a + (b - a) * (place - index as f64),
            _ => self.integral.last().copied().unwrap_or(0.0),
        };
        value * f_cps.signum()
    }
}

/// Sampling of a waveform: the rule for chip edges between samples, and the rate.
#[derive(Clone, Debug)]
pub struct Sampler {
    edge: Edge,
    rate_hz: f64,
    limited: Option<Arc<KaiserSinc>>,
}

impl Sampler {
    /// A sampler at `rate_hz`, whose band-limited edges are cut off at [`CUTOFF_CPS`].
    pub fn new(edge: Edge, rate_hz: f64) -> Self {
        Self::with_cutoff(edge, rate_hz, CUTOFF_CPS)
    }

    /// A sampler whose band-limited edges are cut off (−6 dB) at so many cycles a sample.
    pub fn with_cutoff(edge: Edge, rate_hz: f64, cutoff_cps: f64) -> Self {
        let limited = (edge == Edge::BandLimited).then(|| {
            let (half_width, beta) = LIMITED;
            Arc::new(KaiserSinc::new(cutoff_cps, half_width, beta))
        });
        Self { edge, rate_hz, limited }
    }

    /// Sampler of a front end of a scene, by its index among several.
    pub fn of(scene: &SceneFacts, front_end: usize) -> Self {
        let (edge, rate_hz, cutoff_cps) = match scene.front_ends.get(front_end) {
            Some(own) => (own.code_edge, own.sample_rate_hz, own.edge_cutoff_cps),
            None => (scene.code_edge, scene.sample_rate_hz, scene.edge_cutoff_cps),
        };
        Self::with_cutoff(edge, rate_hz, cutoff_cps.unwrap_or(CUTOFF_CPS))
    }

    /// Rule for the chip edges.
    pub fn edge(&self) -> Edge {
        self.edge
    }

    /// Samples a second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Amplitude of its response at `hz` from the carrier.
    pub fn amplitude(&self, hz: f64) -> f64 {
        match (&self.limited, self.edge) {
            (Some(filter), _) => filter.amplitude(hz / self.rate_hz),
            // A mean over the sample's interval is a sinc.
            (None, Edge::Area) => sinc(hz / self.rate_hz),
            (None, _) => 1.0,
        }
    }

    /// Range of the aliases that count, in sample rates from the carrier.
    pub fn aliases(&self) -> std::ops::RangeInclusive<i32> {
        match self.edge {
            // Beyond one and a half rates the filter stops by more than 60 dB.
            Edge::BandLimited => -1..=1,
            // Densities fall with the fourth power of the frequency, of instants with the second: the tail is
            // below 1e-4 of the one and 1 % of the other, 40 and 50 dB below the peak.
            Edge::Area => -12..=12,
            Edge::Nearest => -50..=50,
        }
    }
}

fn sinc(x: f64) -> f64 {
    let turn = std::f64::consts::PI * x;
    if turn.abs() < 1e-9 { 1.0 } else { libm::sin(turn) / turn }
}

/// The components of a signal that a receiver correlates: all of them, by their shares of power.
#[derive(Clone, Debug)]
pub struct Waveform {
    parts: Vec<(f64, Shape)>,
    chip_rate_hz: f64,
}

/// A correlation that rises by less between two corners is level.
const RISE: f64 = 1e-9;
/// Share of a spectrum's peak below which there is nothing: 120 dB down.
const NOTHING: f64 = 1e-12;

/// The component whose chips count where distances are given in chips: the strongest, the first of equals.
pub fn leading(signal: &Signal) -> Option<&'static Component> {
    let stronger = |a: &'static Component, b: &'static Component| if b.power_share > a.power_share { b } else { a };
    signal.components.iter().reduce(stronger)
}

impl Waveform {
    /// Waveform of a whole signal; `None` for one without components.
    pub fn of(signal: &Signal) -> Option<Self> {
        Self::sent(signal, Layers::Whole)
    }

    /// Waveform of the layers of a signal that are sent. Its power is less than one where layers are left
    /// out.
    pub fn sent(signal: &Signal, layers: Layers) -> Option<Self> {
        let chip_rate_hz = leading(signal)?.chip_rate_hz;
        let part = |component: &Component| (component.power_share, component.shape_of(layers));
        Some(Self { parts: signal.components.iter().map(part).collect(), chip_rate_hz })
    }

    /// Waveform of one shape, for chips of that rate.
    pub fn of_shape(shape: Shape, chip_rate_hz: f64) -> Self {
        Self { parts: vec![(1.0, shape)], chip_rate_hz }
    }

    /// Rate of the chips in which distances are given.
    pub fn chip_rate_hz(&self) -> f64 {
        self.chip_rate_hz
    }

    /// Shortest distance of the correlation's corners, and longest chip.
    pub fn scales_s(&self) -> (f64, f64) {
        let shapes = || self.parts.iter().map(|(_, shape)| shape);
        let step_s = shapes().map(Shape::step_s).fold(f64::INFINITY, f64::min);
        (step_s, shapes().map(Shape::chip_s).fold(0.0, f64::max))
    }

    /// Correlation with itself `delay_s` later; at no delay the power, 1 of a whole signal.
    pub fn correlation(&self, delay_s: f64) -> f64 {
        self.parts.iter().map(|(share, shape)| share * shape.correlation(delay_s)).sum()
    }

    /// The corners of that correlation: their delays and by how much its slope, per second, grows there.
    pub fn corners(&self) -> Vec<(f64, f64)> {
        let corners = |(share, shape): &(f64, Shape)| {
            let step_s = shape.step_s();
            let last = (shape.chip_s() / step_s).round() as i32;
            let value = |k: i32| shape.correlation(f64::from(k) * step_s);
            let bend = |k: i32| share * (value(k + 1) - 2.0 * value(k) + value(k - 1)) / step_s;
            (-last..=last).map(|k| (f64::from(k) * step_s, bend(k))).collect::<Vec<_>>()
        };
        self.parts.iter().flat_map(corners).filter(|(_, bend)| *bend != 0.0).collect()
    }

    /// Delay up to which the correlation falls without rising again; endless where it never rises.
    pub fn reach_s(&self) -> f64 {
        let (step_s, chip_s) = self.scales_s();
        let steps = (chip_s / step_s).round() as i32;
        let value = |k: i32| self.correlation(f64::from(k) * step_s);
        let rises = |k: &i32| value(k + 1) > value(*k) + RISE;
        (0..steps).find(rises).map_or(f64::INFINITY, |k| f64::from(k) * step_s)
    }

    /// Frequency of the first null beyond the main lobe, if the spectrum has one.
    pub fn null_hz(&self) -> Option<f64> {
        let fine = |k: i32| f64::from(k) * self.chip_rate_hz / 200.0;
        let peak = (0..3000).map(|k| (fine(k), self.density(fine(k)))).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let null = |hz: &f64| *hz > peak.0 && self.density(*hz) < NOTHING * peak.1;
        (1..40).map(|k| f64::from(k) * 0.5 * self.chip_rate_hz).find(null)
    }

    /// Power density at `hz` from the carrier, per hertz, for unit power of the whole signal.
    pub fn density(&self, hz: f64) -> f64 {
        self.parts.iter().map(|(share, shape)| share * shape.density(hz)).sum()
    }

    /// Power density at `hz` after the sampler's response, before aliasing, per hertz.
    pub fn met(&self, sampler: &Sampler, hz: f64) -> f64 {
        let amplitude = sampler.amplitude(hz);
        if amplitude == 0.0 { 0.0 } else { self.density(hz) * amplitude * amplitude }
    }

    /// Power density at `hz` in the samples, with aliases, per hertz.
    pub fn sampled(&self, sampler: &Sampler, hz: f64) -> f64 {
        let rate_hz = sampler.rate_hz();
        let within_hz = hz - rate_hz * (hz / rate_hz).round();
        sampler.aliases().map(|k| self.met(sampler, within_hz + f64::from(k) * rate_hz)).sum()
    }

    /// Power that samples have of it when the whole signal has one at the antenna.
    pub fn power(&self, sampler: &Sampler) -> f64 {
        const HALF: i32 = 500;
        let step_hz = 0.5 * sampler.rate_hz() / f64::from(HALF);
        // Midpoints over half of the samples' band, which holds every alias: spectra are even.
        let at = |k: i32| self.sampled(sampler, (f64::from(k) + 0.5) * step_hz);
        2.0 * step_hz * (0..HALF).map(at).sum::<f64>()
    }

    /// κ of another signal against this one: what its power adds to the noise density, over that power, in
    /// seconds. `apart_hz` is by how much the other's carrier is higher.
    ///
    /// ∫ S₁·S₂ df/(∫S₁ df · ∫S₂ df) (J. W. Betz, NAVIGATION 48(4), 2001) of the spectra that the sampler
    /// meets.
    pub fn separation_s(&self, other: &Self, apart_hz: f64, sampler: &Sampler) -> f64 {
        let ((own_step_s, own_chip_s), (step_s, chip_s)) = (self.scales_s(), other.scales_s());
        // To ±30 step rates, where the tail of S² is below 1e-7 of the whole; midpoints every hundredth of a
        // chip rate.
        let step_hz = 1.0 / own_chip_s.max(chip_s) / 100.0;
        let half = (30.0 / own_step_s.min(step_s) / step_hz).round() as i32;
        let (mut own, mut others, mut shared) = (0.0, 0.0, 0.0);
        for k in -half..half {
            let hz = (f64::from(k) + 0.5) * step_hz;
            let met = self.met(sampler, hz);
            let beside = other.met(sampler, hz);
            own += met;
            others += beside;
            shared += met * if apart_hz == 0.0 { beside } else { other.met(sampler, hz - apart_hz) };
        }
        shared / (own * others * step_hz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1c::L1C;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::synthetic::{LONG_BOC, MIXED, QUADRATURE, SYNTHETIC};

    fn of(signal: &Signal) -> Waveform {
        Waveform::of(signal).unwrap()
    }

    #[test]
    fn a_sampled_code_keeps_its_power_and_has_its_nulls() {
        let code = of(&L1_CA);
        for edge in [Edge::Nearest, Edge::BandLimited] {
            let sampler = Sampler::new(edge, 10.0e6);
            let step_hz = 1e3;
            let power: f64 = (-5000..5000).map(|k| step_hz * code.sampled(&sampler, f64::from(k) * step_hz)).sum();
            // Outside ±4.5 MHz, where the filter cuts off, lies 1/(pi^2 * 4.4) of the power or 2.3 %; aliases
            // bring it back.
            let expected = if edge == Edge::Nearest { 1.0 } else { 0.977 };
            assert!((power - expected).abs() < 5e-3, "{edge:?} {power}");
        }
        // What is left of the aliases is 60 dB down, of lobes that are 30 dB down.
        assert!(code.sampled(&Sampler::new(Edge::BandLimited, 10e6), 1.023e6) < 1e-8 * code.density(0.0));
    }

    #[test]
    fn the_power_that_is_met_is_that_of_the_averaged_correlation() {
        // The triangle over ±w about a BPSK peak leaves 1 − w/3 of it; the tail beyond the fiftieth alias is
        // below a thousandth.
        for rate_hz in [2.6e6, 10e6] {
            let found = of(&L1_CA).power(&Sampler::new(Edge::Area, rate_hz));
            assert!((found - (1.0 - 1.023e6 / rate_hz / 3.0)).abs() < 1e-3, "{found}");
            assert!((of(&L1_CA).power(&Sampler::new(Edge::Nearest, rate_hz)) - 1.0).abs() < 3e-3);
        }
    }

    #[test]
    fn separation_is_two_thirds_of_a_chip_and_more_where_samples_are_means() {
        let code = of(&L1_CA);
        let chips = |edge, rate_hz: f64| code.separation_s(&code, 0.0, &Sampler::new(edge, rate_hz)) * 1.023e6;
        // The cut at ±30 chip rates leaves 1/(30 π²) = 0.3 % of the power out, twice that in the square.
        assert!((chips(Edge::Nearest, 2.6e6) - 2.0 / 3.0).abs() < 0.006);
        // Computed by another program from the same definition.
        assert!((chips(Edge::Area, 2.6e6) - 0.8267).abs() < 0.001);
        assert!((chips(Edge::Area, 10e6) - 0.7110).abs() < 0.005);
    }

    #[test]
    fn separations_of_bpsk_and_boc_are_the_printed_ones() {
        // J. W. Betz, "Binary offset carrier modulations for radionavigation" (2001), within 24 MHz: −61.8 dB
        // of C/A from itself, −67.9 dB of BOC(1,1) from C/A, −64.8 dB of BOC(1,1) from itself.
        let ideal = Sampler {
            limited: Some(Arc::new(KaiserSinc::new(0.5, 800.0, 5.65))),
            ..Sampler::new(Edge::BandLimited, 24e6)
        };
        let db =
            |a: &Signal, b: &Signal, apart_hz: f64| 10.0 * libm::log10(of(a).separation_s(&of(b), apart_hz, &ideal));
        let inside = |signal: &Signal| -> f64 {
            let code = of(signal);
            (-12_000..12_000).map(|k| 1e3 * code.density(1e3 * (f64::from(k) + 0.5))).sum()
        };
        let signals: [&Signal; 2] = [&L1_CA, &LONG_BOC];
        for (a, b, printed_db) in [(0, 0, -61.8), (0, 1, -67.9), (1, 0, -67.9), (1, 1, -64.8)] {
            let (a, b) = (signals[a], signals[b]);
            // Printed are powers of the whole signals: 0.9 % of C/A and 2.6 % of BOC(1,1) lie beyond 24 MHz.
            let found_db = db(a, b, 0.0) + 10.0 * libm::log10(inside(a) * inside(b));
            // The last digit printed.
            assert!((found_db - printed_db).abs() < 0.1, "{a} {b}: {found_db}");
        }
        // ∫R²: BOC(1,1) is 1 − 3τ to half a chip and τ − 1 after it, 1/8 and 1/24 on either side.
        let exact = 2.0 * (1.0 / 8.0 + 1.0 / 24.0) / 1.023e6;
        let wide = of(&LONG_BOC).separation_s(&of(&LONG_BOC), 0.0, &Sampler::new(Edge::Nearest, 60e6));
        // The cut leaves 1 % of the power out.
        assert!((wide / exact - 1.0).abs() < 0.02, "{wide} {exact}");
        // A carrier a chip rate away meets the other's null: less than half of what one beside it takes.
        assert!(db(&L1_CA, &L1_CA, 1.023e6) < db(&L1_CA, &L1_CA, 0.0) - 6.0);
        // A whole number of the integral's steps, so that both ways have the same midpoints.
        let apart_hz = 293.0 * 10_230.0;
        assert!((db(&L1_CA, &QUADRATURE, apart_hz) - db(&QUADRATURE, &L1_CA, -apart_hz)).abs() < 1e-9);
    }

    #[test]
    fn the_correlation_s_corners_make_it_whole_again() {
        for signal in SYNTHETIC.into_iter().chain([&L1_CA]) {
            let waveform = of(signal);
            let (corners, chip_s) = (waveform.corners(), 1.0 / waveform.chip_rate_hz());
            for k in -150..150 {
                let delay_s = 0.01 * f64::from(k) * chip_s;
                let made: f64 = corners.iter().map(|(at_s, bend)| 0.5 * bend * (delay_s - at_s).abs()).sum();
                assert!((made - waveform.correlation(delay_s)).abs() < 1e-12, "{signal} {k}");
            }
            assert!((waveform.correlation(0.0) - 1.0).abs() < 1e-12, "{signal}");
        }
    }

    #[test]
    fn nulls_and_reach_follow_from_the_pulses() {
        let chips = |signal: &Signal| {
            let waveform = of(signal);
            (waveform.null_hz().unwrap() / waveform.chip_rate_hz(), waveform.reach_s() * waveform.chip_rate_hz())
        };
        assert_eq!(chips(&L1_CA), (1.0, f64::INFINITY));
        assert_eq!(chips(&QUADRATURE), (1.0, f64::INFINITY));
        // BOC(1,1): lobes about ±1 chip rate end at 2; the correlation's first minimum is half a chip away,
        // with 1/11 of BOC(6,1), which falls by 11 a chip there, a step further.
        for (signal, minimum) in [(&LONG_BOC, 0.5), (&MIXED, 7.0 / 12.0)] {
            let (null, reach) = chips(signal);
            assert_eq!(null, 2.0, "{signal}");
            assert!((reach - minimum).abs() < 1e-12, "{signal}: {reach}");
        }
    }

    #[test]
    fn in_samples_each_component_has_of_its_share_of_the_power_what_edges_leave() {
        let chip_rate_hz = L1C.components[0].chip_rate_hz;
        for edge in [Edge::Nearest, Edge::Area, Edge::BandLimited] {
            let sampler = Sampler::new(edge, 5.2e6);
            let whole = Waveform::sent(&L1C, Layers::Whole).unwrap();
            let [pilot, data] =
                [0, 1].map(|place: usize| Waveform::of_shape(L1C.components[place].shape(), chip_rate_hz));
            let [of_pilot, of_data] = [&pilot, &data].map(|one| one.power(&sampler));
            assert!((whole.power(&sampler) - 0.75 * of_pilot - 0.25 * of_data).abs() < 1e-12, "{edge:?}");
            // BOC(6,1) loses more to means and filters than BOC(1,1), and nothing at instants.
            let lost = of_data / of_pilot - 1.0;
            assert!(if edge == Edge::Nearest { lost.abs() < 0.02 } else { lost > 0.1 }, "{edge:?}: {lost}");
        }
    }

    #[test]
    fn a_signal_sent_without_its_weak_layers_lacks_their_power_and_their_spectrum() {
        let alone = Waveform::sent(&E1, Layers::Strongest).unwrap();
        assert!((alone.correlation(0.0) - 10.0 / 11.0).abs() < 1e-12);
        // Sine-phased BOC(m, 1) as printed (Betz 2001, eq. 12).
        let chip_s = 1.0 / 1.023e6;
        let wave = |hz: f64, m: f64| {
            let whole_rad = std::f64::consts::PI * hz * chip_s;
            libm::tan(0.5 * whole_rad / m) * libm::sin(whole_rad) / (std::f64::consts::PI * hz) / chip_s.sqrt()
        };
        let printed = |hz: f64, m: f64| wave(hz, m) * wave(hz, m);
        for hz in [0.31e6, 1.1e6, 2.9e6, 6.1e6] {
            assert!((alone.density(hz) / (10.0 / 11.0 * printed(hz, 1.0)) - 1.0).abs() < 1e-9, "{hz}");
        }
        let kept = |edge| alone.power(&Sampler::new(edge, 6.5e6));
        assert!((kept(Edge::Nearest) / (10.0 / 11.0) - 1.0).abs() < 3e-3, "{}", kept(Edge::Nearest));
        // Midpoints every kilohertz up to where the filter has stopped.
        let filter = |hz: f64| direct(hz / 6.5e6, 0.40).powi(2);
        let at = |k: i32| 1e3 * (f64::from(k) + 0.5);
        let expected = 10.0 / 11.0 * (0..4500).map(|k| 2e3 * printed(at(k), 1.0) * filter(at(k))).sum::<f64>();
        let found = kept(Edge::BandLimited);
        assert!((found - expected).abs() < 2e-4, "{found}: {expected}");
    }

    /// Amplitude of a sinc of that cut-off under a Kaiser window of ±8 samples and β 5.65, by summing its
    /// response.
    fn direct(f_cps: f64, cutoff_cps: f64) -> f64 {
        let bessel = |x: f64| {
            let term = |sum: &mut f64, k: i32| {
                *sum *= x * x / 4.0 / f64::from(k * k);
                Some(*sum)
            };
            1.0 + (1..40).scan(1.0, term).sum::<f64>()
        };
        let response = |x: f64| sinc(2.0 * cutoff_cps * x) * bessel(5.65 * (1.0 - (x / 8.0) * (x / 8.0)).sqrt());
        let sum = |f_cps: f64| -> f64 {
            let at = |k: i32| (f64::from(k) + 0.5) / 64.0 - 8.0;
            (0..1024).map(at).map(|x| response(x) * libm::cos(std::f64::consts::TAU * f_cps * x)).sum()
        };
        sum(f_cps) / sum(0.0)
    }

    #[test]
    fn a_band_limiting_filter_has_the_response_of_its_taps() {
        for cutoff_cps in [0.2, 0.40] {
            let sampler = Sampler::with_cutoff(Edge::BandLimited, 1.0, cutoff_cps);
            for k in 0..60 {
                let f_cps = 0.025 * f64::from(k);
                let (found, expected) = (sampler.amplitude(f_cps), direct(f_cps, cutoff_cps));
                // Lines between 64 points a lobe: 1e-4 of the lobe's height, and the rest of the lobes.
                assert!((found - expected).abs() < 3e-4, "{cutoff_cps} {f_cps}: {found} {expected}");
            }
            assert!((sampler.amplitude(cutoff_cps) - 0.5).abs() < 1e-3);
        }
        assert!((Sampler::new(Edge::Area, 2e6).amplitude(1e6) - 2.0 / std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn components_count_by_their_share_of_power() {
        // Three quarters TMBOC, itself 29/33 BOC(1,1), and a quarter BOC(1,1): 4/33 · 3/4 = 1/11 of BOC(6,1),
        // the MBOC spectrum that all of them share.
        let (chip_s, hz) = (1.0 / 1.023e6, 0.7e6);
        let boc = |m: f64| {
            let wave = libm::tan(std::f64::consts::PI * hz * chip_s / (2.0 * m))
                * libm::sin(std::f64::consts::PI * hz * chip_s)
                / (std::f64::consts::PI * hz);
            wave * wave / chip_s
        };
        let expected = 10.0 / 11.0 * boc(1.0) + boc(6.0) / 11.0;
        let found = of(&MIXED).density(hz);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        // A signal of unit power has it all within its spectrum.
        for signal in SYNTHETIC {
            let waveform = of(signal);
            let step_hz = waveform.chip_rate_hz() / 50.0;
            let power: f64 =
                (-20_000..20_000).map(|k| step_hz * waveform.density((f64::from(k) + 0.5) * step_hz)).sum();
            // To ±400 chip rates, or 33 step rates of BOC(6,1).
            assert!((power - 1.0).abs() < 0.004, "{signal}: {power}");
        }
    }
}
