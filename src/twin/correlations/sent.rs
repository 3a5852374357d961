//! One satellite's signal over a second, prepared for questions.
//!
//! Phases count from an anchor in each polynomial, so that an answer needs neither epochs nor divisions of
//! long integers. Limits: phases are rounded to 2⁻³² cycle; the code to 1e-6 m, since polynomials are 16 s at
//! most.

use generator::scene::Scene;
use generator::transmit::{CodePhase, RayAt, Rays, Transmitter};

/// Code periods before and after the second for which signs are kept: of integrations that began before it.
const MOST_PERIODS: i64 = 50;
/// 2^32 as a float.
const HALF_WORD: f64 = 4_294_967_296.0;

/// Cycles in 2^-64 turn, rounded to 2^-32 turn.
#[inline]
pub(super) fn turns(cycles: f64) -> u64 {
    ((cycles * HALF_WORD) as i64 as u64) << 32
}

/// The largest whole number that is not above a number, and the rest. Processors without SSE4.1 have no
/// instruction for it.
#[inline]
pub(super) fn split(x: f64) -> (i64, f64) {
    let below = x as i64 - i64::from(x < 0.0);
    let rest = x - below as f64;
    if rest >= 1.0 { (below + 1, rest - 1.0) } else { (below, rest) }
}

/// A number from −`length`/2 to `length`/2 that is whole lengths from another.
#[inline]
pub(super) fn centred(x: f64, length: f64) -> f64 {
    x - split(x / length + 0.5).0 as f64 * length
}

/// A ray at one sample of its polynomial.
pub(super) struct Anchor {
    sample: u64,
    at: RayAt,
    turns: u64,
    step: u64,
    /// Positions of the components' codes.
    codes: Vec<Option<CodePhase>>,
}

impl Anchor {
    fn new(scene: &Scene, transmitter: &Transmitter, sample: u64, at: RayAt) -> Self {
        let (turns, step) = transmitter.turns_at(scene, sample, &at);
        let code = |index| transmitter.code_at(scene, index, sample, at.delay_s);
        let codes = (0..transmitter.signal.components.len()).map(code).collect();
        Self { sample, at, turns, step, codes }
    }

    fn samples(&self, sample: u64) -> i64 {
        sample.wrapping_sub(self.sample) as i64
    }

    /// Phase of the carrier in 2^-64 turn at a sample where the ray is `at`, and the step of the nominal IF.
    #[inline]
    pub fn turns_at(&self, sample: u64, at: &RayAt) -> (u64, u64) {
        let tone = self.turns.wrapping_add(self.step.wrapping_mul(self.samples(sample) as u64));
        (tone.wrapping_sub(turns(at.carrier_cycles - self.at.carrier_cycles)), self.step)
    }

    /// Number of the running code period of a component at a sample where the ray is `at`, and the share of
    /// it that has passed.
    #[inline]
    pub fn code_at(&self, component: usize, period_s: f64, elapsed_s: f64, at: &RayAt) -> Option<(i64, f64)> {
        let code = self.codes.get(component)?.as_ref()?;
        let (whole, share) = split(code.share + (elapsed_s - (at.delay_s - self.at.delay_s)) / period_s);
        Some((code.at.period + whole, share))
    }

    /// Seconds of the receiver's clock from the anchor to a sample.
    #[inline]
    pub fn elapsed_s(&self, sample: u64, rate_hz: f64) -> f64 {
        self.samples(sample) as f64 / rate_hz
    }
}

/// Rays of one polynomial, with an anchor for each.
pub(super) struct Leg<'a> {
    from: u64,
    end: u64,
    pub rays: Rays<'a>,
    pub anchors: Vec<Anchor>,
}

impl Leg<'_> {
    /// True if the polynomial holds from one sample to another.
    pub fn holds(&self, from: u64, to: u64) -> bool {
        self.from <= from && to <= self.end
    }
}

/// Signs of a component's code periods from number `first` on.
struct Signs {
    first: i64,
    signs: Vec<f64>,
}

/// A satellite's signal over a second.
pub(super) struct Sent<'a> {
    pub scene: &'a Scene,
    pub transmitter: &'a Transmitter,
    /// First sample of the second.
    first: u64,
    /// True if it is received in the second.
    in_view: bool,
    legs: Vec<Leg<'a>>,
    signs: Vec<Signs>,
}

impl<'a> Sent<'a> {
    pub fn new(scene: &'a Scene, transmitter: &'a Transmitter, (first, end): (u64, u64)) -> Self {
        let leg = |(number, (from, to)): (usize, (u64, u64))| {
            let rays = transmitter.rays_of(number)?;
            let sample = first.clamp(from, (to - 1).max(from));
            let anchor = |ray| Some(Anchor::new(scene, transmitter, sample, rays.at(ray, sample)?));
            Some(Leg { from, end: to, rays, anchors: (0..rays.count()).filter_map(anchor).collect() })
        };
        let in_view = transmitter.in_view(scene, first);
        let legs: Vec<Leg> = transmitter.spans().enumerate().filter_map(leg).collect();
        let mut sent = Self { scene, transmitter, first, in_view, legs, signs: Vec::new() };
        sent.signs = (0..transmitter.signal.components.len()).map(|index| sent.made_signs(index, end)).collect();
        sent
    }

    fn made_signs(&self, component: usize, end: u64) -> Signs {
        let period_s = self.transmitter.signal.components.get(component).map_or(1.0, |one| one.period_s());
        let second_s = end.saturating_sub(self.first) as f64 / self.scene.clock.rate.hz();
        let anchor = self.leg(self.first).and_then(|leg| Some((leg, leg.anchors.first()?)));
        let code = anchor.and_then(|(leg, anchor)| {
            let at = leg.rays.at(0, self.first)?;
            anchor.code_at(component, period_s, anchor.elapsed_s(self.first, self.scene.clock.rate.hz()), &at)
        });
        let Some((period, _)) = code else { return Signs { first: 0, signs: Vec::new() } };
        let first = period - MOST_PERIODS;
        let mut signs = vec![1.0; (second_s / period_s) as usize + 2 * MOST_PERIODS as usize];
        self.transmitter.signs(component, first, &mut signs);
        Signs { first, signs }
    }

    /// Rays about a sample; `None` where the satellite is not received.
    #[inline]
    pub fn leg(&self, sample: u64) -> Option<&Leg<'a>> {
        let in_view = if sample < self.first { self.transmitter.in_view(self.scene, sample) } else { self.in_view };
        let number = self.legs.partition_point(|leg| leg.end <= sample);
        self.legs.get(number).filter(|leg| in_view && leg.from <= sample)
    }

    /// True if phases or strength change within milliseconds.
    #[inline]
    pub fn is_quick(&self) -> bool {
        self.transmitter.is_quick()
    }

    /// Signs of a component's code periods, and the number of the first one.
    pub fn signs(&self, component: usize) -> Option<(i64, &[f64])> {
        self.signs.get(component).map(|all| (all.first, all.signs.as_slice()))
    }

    /// Sign of a component's code period by message and secondary code.
    #[inline]
    pub fn sign(&self, component: usize, period: i64) -> f64 {
        let known = self.signs.get(component).and_then(|all| all.signs.get((period - all.first) as usize));
        known.copied().unwrap_or_else(|| self.transmitter.sign(component, period))
    }
}
