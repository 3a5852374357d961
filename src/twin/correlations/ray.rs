//! One ray in a correlator: the mean of the correlation over an interval.

use generator::scene::Scene;
use generator::transmit::RayAt;
use num_complex::Complex64;
use receiver::correlate::correlator::{Code, Interval};
use receiver::correlate::{phasor, units_to_chips};

use super::made::{Made, Peak};
use super::sent::{Anchor, Leg, Sent, centred, split, turns};

/// 2^64 as a float.
const TURN: f64 = 18_446_744_073_709_551_616.0;
/// Share of an interval below which a piece has one node.
const SHORT: f64 = 0.03;

/// Nodes and weights of Gauss and Legendre on [−1, 1], positive ones: M. Abramowitz, I. Stegun, table 25.4.
const TWO: [(f64, f64); 1] = [(0.577_350_269_189_625_8, 1.0)];
const FOUR: [(f64, f64); 2] =
    [(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_9)];
const EIGHT: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// The sums that a receiver asks for over one interval.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub interval: Interval,
    pub code: &'a Code,
    pub made: &'a Made,
    /// Index of the signal, if it is sent.
    pub place: Option<usize>,
}

/// Differences of a ray's component and a replica, as polynomials in the share of the interval that has
/// passed.
pub(super) struct Course<'a> {
    /// Number of the component in the signal.
    sent: usize,
    /// Correlation of the component with the replica.
    pub peak: &'a Peak,
    /// Code in chips: at the beginning, and what it gains.
    pub chips: [f64; 2],
    /// Carrier in cycles: at the beginning, and the coefficients of share and square.
    pub cycles: [f64; 3],
    /// Code periods of the ray: share of the running one at the beginning, and what passes.
    periods: [f64; 2],
    /// Number of the running one.
    period: i64,
    pub amplitude: f64,
}

/// One ray at the first sample of an interval, in the middle, and at the end.
pub(super) type Ends = [RayAt; 3];

impl Question<'_> {
    /// Adds the sums of a satellite's rays.
    pub fn add(&self, sent: &Sent, taps: &[f64], sums: &mut [Complex64]) {
        let Interval { from, to, .. } = self.interval;
        if to <= from {
            return;
        }
        let Some(leg) = sent.leg(from + (to - from) / 2) else { return };
        for ray in 0..leg.anchors.len() {
            for component in 0..self.made.signal.components.len() {
                self.add_component(sent, leg, (ray, component), taps, sums);
            }
        }
    }

    /// Adds the sums of a component by one ray of a satellite.
    pub fn add_component(
        &self,
        sent: &Sent,
        leg: &Leg,
        (ray, component): (usize, usize),
        taps: &[f64],
        sums: &mut [Complex64],
    ) {
        let Some((anchor, ends)) = self.ends(leg, ray) else { return };
        let cycles = self.cycles(anchor, &ends);
        if let Some(course) = self.course((sent.scene, anchor), (&ends, cycles), component) {
            self.integrate(sent, &course, taps, sums);
        }
    }

    /// A ray at the ends of the interval and in its middle.
    #[inline]
    pub fn ends<'l>(&self, leg: &'l Leg, ray: usize) -> Option<(&'l Anchor, Ends)> {
        let Interval { from, to, .. } = self.interval;
        let [first, half, last] = [from, from + (to - from) / 2, to].map(|sample| leg.rays.at(ray, sample));
        Some((leg.anchors.get(ray)?, [first?, half?, last?]))
    }

    /// Difference of the carriers in cycles: at the beginning, and the coefficients of share and square.
    #[inline]
    pub fn cycles(&self, anchor: &Anchor, [first, half, last]: &Ends) -> [f64; 3] {
        let Interval { nco, from, to, .. } = self.interval;
        let samples = (to - from) as f64;
        let (turns, step) = anchor.turns_at(from, first);
        let begin_cycles = turns.wrapping_sub(nco.carrier) as i64 as f64 / TURN;
        let local_cycles = step.wrapping_sub(nco.carrier_step) as i64 as f64 / TURN * samples;
        let at = ((to - from) / 2) as f64 / samples;
        let [to_half, to_end] = [half, last].map(|ray| ray.carrier_cycles - first.carrier_cycles);
        let bend = if at > 0.0 && at < 1.0 { (to_end * at - to_half) / (at * (1.0 - at)) } else { 0.0 };
        [begin_cycles, local_cycles - (to_end - bend), -bend]
    }

    /// Course of a component over the interval; `None` where it does not correlate with the replica.
    #[inline]
    pub fn course(
        &self,
        (scene, anchor): (&Scene, &Anchor),
        ([first, half, last], cycles): (&Ends, [f64; 3]),
        sent: usize,
    ) -> Option<Course<'_>> {
        let Interval { nco, from, to, end } = self.interval;
        let (made, rate_hz, samples) = (self.made, scene.clock.rate.hz(), (to - from) as f64);
        let component = made.signal.components.get(sent)?;
        let (period, share) = anchor.code_at(sent, component.period_s(), anchor.elapsed_s(from, rate_hz), first)?;
        let (length, local_length) = (f64::from(component.code_chips), f64::from(made.length));
        let sent_s = samples / rate_hz - (last.delay_s - first.delay_s);
        let passed = sent_s * component.chip_rate_hz;
        let phase = share * length;
        // Segment of a long code: that of the replica, or else that which is sent.
        let running = || ((phase + 0.5 * passed).rem_euclid(length) / local_length) as u64;
        let is_long = component.code_chips > made.length;
        let segment = self.code.segment.unwrap_or_else(|| if is_long { running() } else { 0 });
        let begin = if is_long { segment as f64 * local_length } else { 0.0 };
        // A jump back at the beginning of a period shows its last chips. They are those before it, where the
        // code is a segment.
        let rest = units_to_chips(nco.code_step as i64) * end.saturating_sub(from) as f64;
        let since = local_length - rest;
        let local = begin + since + centred(units_to_chips(nco.code) - since, local_length);
        let apart = centred(phase - local, length);
        let peak = made.peak(self.code.link.sv.number, segment as usize, sent)?;
        let gained = passed - units_to_chips(nco.code_step as i64) * samples;
        let [begin_cycles, rate, bend] = cycles;
        let noise_lsb = f64::from(scene.noise_lsb);
        Some(Course {
            sent,
            peak,
            chips: [apart, gained],
            cycles: [begin_cycles + component.phase_cycles, rate, bend],
            periods: [share, passed / length],
            period,
            amplitude: noise_lsb * (2.0 * half.cn0_hz / rate_hz * component.power_share).sqrt() * samples,
        })
    }

    /// Adds the mean of a course, piece by piece between changes of sign.
    fn integrate(&self, sent: &Sent, course: &Course, taps: &[f64], sums: &mut [Complex64]) {
        let reach = course.peak.reach_chips() + course.chips[1].abs();
        if taps.iter().all(|tap| (course.chips[0] - tap).abs() > reach) {
            return;
        }
        // The sum of samples is the integral from half a sample before the first one.
        let ahead = 0.5 / (self.interval.to - self.interval.from) as f64;
        course.pieces(sent, (-ahead, 1.0 - ahead), course.period, |ends, sign| {
            piece(course, ends, sign, taps, sums);
        });
    }
}

impl Course<'_> {
    /// Number of the code period that runs at a share of the interval.
    #[inline]
    pub fn period_at(&self, share: f64) -> i64 {
        let [begin, passed] = self.periods;
        self.period + split(begin + passed * share).0
    }

    /// Calls `each` for what lies between changes of sign from one share of the interval to another, with the
    /// sign; `period` is the code period that runs there.
    #[inline]
    pub fn pieces(
        &self,
        sent: &Sent,
        (mut from, end): (f64, f64),
        mut period: i64,
        mut each: impl FnMut((f64, f64), f64),
    ) {
        let [share, passed] = self.periods;
        let mut sign = sent.sign(self.sent, period);
        while from < end {
            let (mut to, mut next) = (end, sign);
            // The next change of sign.
            loop {
                let edge = ((period - self.period + 1) as f64 - share) / passed;
                if edge >= end {
                    break;
                }
                period += 1;
                next = sent.sign(self.sent, period);
                if next != sign && edge > from {
                    to = edge;
                    break;
                }
                sign = next;
            }
            each((from, to), sign);
            (from, sign) = (to, next);
        }
    }
}

/// Adds the mean of a course between two shares of the interval.
fn piece(course: &Course, (from, to): (f64, f64), sign: f64, taps: &[f64], sums: &mut [Complex64]) {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let [_, rate, bend] = course.cycles;
    let turned = (rate + 2.0 * bend * middle).abs() * 2.0 * half + bend.abs() * half * half;
    let mut node = |share: f64, weight: f64| {
        let chips = course.chips[0] + course.chips[1] * share;
        let cycles = course.cycles[0] + share * (rate + share * bend);
        let phasor = phasor(turns(cycles)) * (sign * weight * course.amplitude);
        for (sum, tap) in sums.iter_mut().zip(taps) {
            *sum += phasor * course.peak.value(chips - tap);
        }
    };
    if half < SHORT {
        return node(middle, 2.0 * half);
    }
    let rule: &[(f64, f64)] = match turned {
        turned if turned < 0.06 => &TWO,
        turned if turned < 0.6 => &FOUR,
        _ => &EIGHT,
    };
    for (at, weight) in rule {
        node(middle - half * at, half * weight);
        node(middle + half * at, half * weight);
    }
}
