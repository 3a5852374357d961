//! Knots of a satellite's delay and carrier: cubic polynomials between them, on an absolute grid of samples.
//!
//! The grid's roots are 2^r samples, 8 to 16 s long. A root is halved until the cubic through four nodes of
//! each part misses the truth at three further points by less than half the tolerance, so the knots follow
//! from the scene and never from how the stream is cut or where it starts. Power is a straight line through
//! the ends where that keeps the amplitude to [`AMPLITUDE_ERROR`], a cubic elsewhere, and parts are halved
//! until it does. Parts also end at breaks of the motion. Rays that are silent throughout a part are left out
//! of it. Each signal has knots of its own, because tolerance, effects and power are its carrier's; what they
//! share is the geometry under them ([`super::geometry`]). All of that together is 1 % of the processor time
//! of a scene of two signals in two front ends. Where the motion is pushed, a root is a tick. Limits: parts
//! are not shorter than 1024 samples.

use crate::fast_phase::FastPhase;
use gnss::time::Rate;

/// Shortest part of the grid in samples. An error that remains there is reported.
const SHORTEST_SAMPLES: u64 = 1024;
/// Largest error of a ray's amplitude between knots, relative to its largest in the part: 0.0087 dB.
pub const AMPLITUDE_ERROR: f64 = 1e-3;
/// Half of the largest amplitude step from run to run, relative to the ray's largest in the part. A run keeps
/// the power of its middle, so the staircase has no bias, and its rms error is 45 dB below the ray.
pub const AMPLITUDE_STEP: f64 = 1e-2;

/// Signal of one ray at one time of the receiver's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Time of the receiver's clock minus the transmission time, by the code, in seconds.
    pub delay_s: f64,
    /// Absolute pseudorange of the carrier in cycles at RF: `rho_phi / lambda`.
    pub carrier_cycles: f64,
    /// Carrier power over noise density, in Hz.
    pub cn0_hz: f64,
}

impl Arrival {
    /// Adds the phases that change too quickly for knots.
    pub fn with_fast_phase(self, fast: FastPhase) -> Self {
        Self {
            delay_s: self.delay_s + fast.delay_s,
            carrier_cycles: self.carrier_cycles + fast.carrier_cycles,
            cn0_hz: self.cn0_hz * fast.gain * fast.gain,
        }
    }
}

/// Placement of the knots between which polynomials are fitted.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Samples of a root part: a power of two, or a tick.
    root_samples: u64,
    /// Samples at which a part must end, ascending.
    breaks: Vec<u64>,
    tolerance_cycles: f64,
    carrier_hz: f64,
}

/// Cubic polynomial in the fraction (0..1) of its part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic([f64; 4]);

/// Delay, carrier and amplitude of one ray within a part.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// Seconds.
    pub delay: Cubic,
    /// Carrier phase in cycles, without the whole cycles at the start of the part.
    pub carrier: Cubic,
    /// Linear C/N0 (Hz).
    pub cn0_hz: Cubic,
    /// Longest run in samples, a power of two. A secant of the carrier then stays within the tolerance, and
    /// the amplitude within [`AMPLITUDE_STEP`].
    pub run_samples: u64,
}

/// Part of the grid, with the rays that exist throughout it.
#[derive(Clone, Debug)]
pub struct Part {
    /// First sample.
    pub start: u64,
    /// Number of the sample after the last one.
    pub end: u64,
    /// Polynomials of each ray.
    pub paths: Vec<Path>,
    /// Largest error met at the points of comparison, in cycles.
    pub error_cycles: f64,
    /// Largest amplitude error met at the points of comparison, relative to the ray's largest amplitude.
    pub amplitude_error: f64,
}

impl Cubic {
    /// The straight line from `left` to `right`.
    fn line(left: f64, right: f64) -> Self {
        Self([left, right - left, 0.0, 0.0])
    }

    /// Through four points of the unit interval.
    fn through(u: [f64; 4], y: [f64; 4]) -> Self {
        let f = |a: usize, b: usize, lower: f64, upper: f64| (upper - lower) / (u[b] - u[a]);
        let (f01, f12, f23) = (f(0, 1, y[0], y[1]), f(1, 2, y[1], y[2]), f(2, 3, y[2], y[3]));
        let (f012, f123) = (f(0, 2, f01, f12), f(1, 3, f12, f23));
        let f0123 = f(0, 3, f012, f123);
        // Newton's form expanded about u = 0 (u[0] = 0).
        Self([y[0], f01 - f012 * u[1] + f0123 * u[1] * u[2], f012 - f0123 * (u[1] + u[2]), f0123])
    }

    /// Value at fraction `u`.
    pub fn at(&self, u: f64) -> f64 {
        let [a, b, c, d] = self.0;
        a + u * (b + u * (c + u * d))
    }

    /// Value at `v` minus value at `u`, computed without their common part.
    pub fn change(&self, u: f64, v: f64) -> f64 {
        let [_, b, c, d] = self.0;
        planted!("generator.knots.change", v - u, 1.01 * (v - u)) * (b + c * (u + v) + d * (u * u + u * v + v * v))
    }

    /// A bound on the magnitude of the first derivative.
    fn steepness(&self) -> f64 {
        let [_, b, c, d] = self.0;
        b.abs() + 2.0 * c.abs() + 3.0 * d.abs()
    }

    /// Largest magnitude of the second derivative.
    fn curvature(&self) -> f64 {
        let [_, _, c, d] = self.0;
        (2.0 * c).abs().max((2.0 * c + 6.0 * d).abs())
    }
}

impl Part {
    /// The position of sample `n` in the part.
    pub fn fraction(&self, n: u64) -> f64 {
        (n as f64 - self.start as f64) / (self.end - self.start) as f64
    }
}

impl Grid {
    /// Creates a grid for `rate` whose carrier error stays below `tolerance_cycles`.
    pub fn new(rate: Rate, mut breaks: Vec<u64>, tolerance_cycles: f64, carrier_hz: f64) -> Self {
        breaks.sort_unstable();
        breaks.dedup();
        let longest = (16.0 * rate.hz()).max(2.0 * SHORTEST_SAMPLES as f64) as u64;
        Self { root_samples: 1 << longest.ilog2(), breaks, tolerance_cycles, carrier_hz }
    }

    /// Sets the root spacing to `samples`, if it is given.
    pub fn with_roots_of(self, samples: Option<u64>) -> Self {
        Self { root_samples: samples.map_or(self.root_samples, |samples| samples.max(1)), ..self }
    }

    /// Number of samples in a root part.
    pub fn root_samples(&self) -> u64 {
        self.root_samples
    }

    /// Parts that cover root number `root`; segments in which the satellite does not arrive are left out.
    ///
    /// `observe` gives the rays at a sample, or none where there is no orbit. Errors are its own.
    pub fn root<E>(
        &self,
        root: u64,
        observe: &impl Fn(u64) -> Result<Option<Vec<Arrival>>, E>,
    ) -> Result<Vec<Part>, E> {
        let (start, end) = (root * self.root_samples, (root + 1) * self.root_samples);
        let mut parts = Vec::new();
        // A file of motion may have breaks by the thousand in a root.
        let next = self.breaks.partition_point(|&at| at <= start);
        let breaks = self.breaks.get(next..).unwrap_or_default().iter().copied().take_while(|&at| at < end);
        let mut from = start;
        for to in breaks.chain([end]) {
            self.halve(start, end, from, to, observe, &mut parts)?;
            from = to;
        }
        Ok(parts)
    }

    /// Covers the dyadic cell [`low`, `high`) within [`start`, `end`), where there is no break.
    fn halve<E>(
        &self,
        low: u64,
        high: u64,
        start: u64,
        end: u64,
        observe: &impl Fn(u64) -> Result<Option<Vec<Arrival>>, E>,
        parts: &mut Vec<Part>,
    ) -> Result<(), E> {
        let part = self.fit(start, end, observe)?;
        let good = part.as_ref().is_some_and(|part| {
            part.error_cycles <= 0.5 * self.tolerance_cycles && part.amplitude_error <= AMPLITUDE_ERROR
        });
        if good || high - low <= SHORTEST_SAMPLES || end - start <= SHORTEST_SAMPLES {
            parts.extend(part);
            return Ok(());
        }
        let middle = low + (high - low) / 2;
        if start < middle {
            self.halve(low, middle, start, end.min(middle), observe, parts)?;
        }
        if middle < end {
            self.halve(middle, high, start.max(middle), end, observe, parts)?;
        }
        Ok(())
    }

    fn fit<E>(
        &self,
        start: u64,
        end: u64,
        observe: &impl Fn(u64) -> Result<Option<Vec<Arrival>>, E>,
    ) -> Result<Option<Part>, E> {
        let length = end - start;
        let nodes = [start, start + length / 3, start + 2 * length / 3, end];
        if nodes[0] == nodes[1] || nodes[2] == nodes[3] || nodes[1] == nodes[2] {
            return Ok(None);
        }
        let mut at = Vec::with_capacity(7);
        // Nodes, then points of comparison at the middles of the thirds.
        for n in nodes.into_iter().chain([start + length / 6, start + length / 2, start + 5 * length / 6]) {
            match observe(n)? {
                Some(rays) if rays.iter().all(|ray| ray.delay_s.is_finite() && ray.carrier_cycles.is_finite()) => {
                    at.push((n, rays));
                }
                _ => return Ok(None),
            }
        }
        let rays = at.iter().map(|(_, rays)| rays.len()).min().unwrap_or(0);
        let mut part = Part { start, end, paths: Vec::with_capacity(rays), error_cycles: 0.0, amplitude_error: 0.0 };
        for ray in 0..rays {
            let seen: Vec<(f64, Arrival)> =
                at.iter().filter_map(|(n, rays)| rays.get(ray).map(|r| (part.fraction(*n), *r))).collect();
            if seen.iter().all(|(_, r)| r.cn0_hz == 0.0) {
                continue;
            }
            if let Some((path, error_cycles, amplitude_error)) = self.path(&seen, length) {
                part.paths.push(path);
                part.error_cycles = part.error_cycles.max(error_cycles);
                part.amplitude_error = part.amplitude_error.max(amplitude_error);
            }
        }
        Ok(Some(part))
    }

    /// The path through seven sights of a ray, its error in cycles and that of its amplitude.
    fn path(&self, seen: &[(f64, Arrival)], length: u64) -> Option<(Path, f64, f64)> {
        let (nodes, checks) = seen.split_first_chunk::<4>()?;
        let whole = nodes[0].1.carrier_cycles.floor();
        let u = nodes.map(|(u, _)| u);
        let delay = Cubic::through(u, nodes.map(|(_, r)| r.delay_s));
        let carrier = Cubic::through(u, nodes.map(|(_, r)| r.carrier_cycles - whole));
        let error = checks.iter().fold(0.0_f64, |worst, (u, r)| {
            let code = (delay.at(*u) - r.delay_s).abs() * self.carrier_hz;
            worst.max(code).max((carrier.at(*u) - (r.carrier_cycles - whole)).abs())
        });
        let (cn0_hz, amplitude_error) = power(seen, u, nodes.map(|(_, r)| r.cn0_hz));
        // A secant of length s misses by at most s²/8 of the second derivative.
        let curvature = carrier.curvature() / (length as f64 * length as f64);
        // Power changes twice as fast as amplitude, and a run's ends are half of it away from its middle.
        let strongest = seen.iter().fold(0.0_f64, |most, (_, r)| most.max(r.cn0_hz));
        let steepness = cn0_hz.steepness() / (length as f64 * 4.0 * strongest);
        let within = |run: u64| {
            (run * run) as f64 * curvature / 8.0 <= 0.5 * self.tolerance_cycles
                && run as f64 * steepness <= AMPLITUDE_STEP
        };
        let mut run_samples = super::synth::RUN_SAMPLES as u64;
        while run_samples > 64 && !within(run_samples) {
            run_samples /= 2;
        }
        Some((Path { delay, carrier, cn0_hz, run_samples }, error, amplitude_error))
    }
}

/// The power between the ends of a part, and the largest error of its amplitude, of the largest amplitude
/// seen.
fn power(seen: &[(f64, Arrival)], u: [f64; 4], nodes: [f64; 4]) -> (Cubic, f64) {
    let strongest = seen.iter().fold(0.0_f64, |most, (_, r)| most.max(r.cn0_hz)).sqrt();
    let error = |cubic: &Cubic| {
        seen.iter().fold(0.0_f64, |worst, (u, r)| {
            worst.max((cubic.at(*u).max(0.0).sqrt() - r.cn0_hz.max(0.0).sqrt()).abs() / strongest)
        })
    };
    let line = Cubic::line(nodes[0], nodes[3]);
    let missed = error(&line);
    if missed <= AMPLITUDE_ERROR {
        return (line, missed);
    }
    let cubic = Cubic::through(u, nodes);
    let missed = error(&cubic);
    (cubic, missed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CARRIER_HZ: f64 = 1_575.42e6;

    /// Range (m) of a passing satellite, sharpened by a jerk at 4 s.
    fn arrival(t: f64, jerk: f64) -> Arrival {
        let range = 2.2e7 + 600.0 * t + 0.07 * t * t + jerk * (t - 4.0).max(0.0).powi(3) / 6.0;
        let delay_s = range / 299_792_458.0;
        Arrival { delay_s, carrier_cycles: delay_s * CARRIER_HZ, cn0_hz: 1e4 }
    }

    fn parts(rate: Rate, jerk: f64, breaks: Vec<u64>) -> Vec<Part> {
        let observe = |n: u64| Ok::<_, ()>(Some(vec![arrival(rate.elapsed_s(n), jerk)]));
        Grid::new(rate, breaks, 1e-4, CARRIER_HZ).root(0, &observe).unwrap()
    }

    #[test]
    fn a_smooth_range_takes_one_part_and_a_jerk_short_ones_unless_it_is_a_break() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        assert_eq!(parts(rate, 0.0, vec![]).len(), 1);
        let blind = parts(rate, 100.0, vec![]).len();
        let with_break = parts(rate, 100.0, vec![4 * 2_600_000]).len();
        assert_eq!(with_break, 2);
        assert!(blind > with_break);
    }

    #[test]
    fn power_is_a_line_where_that_will_do_and_keeps_its_bound_where_an_antenna_turns() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let made = |cn0_hz: &dyn Fn(f64) -> f64| {
            let observe = |n: u64| {
                let t_s = rate.elapsed_s(n);
                Ok::<_, ()>(Some(vec![Arrival { cn0_hz: cn0_hz(t_s), ..arrival(t_s, 0.0) }]))
            };
            Grid::new(rate, vec![], 1e-4, CARRIER_HZ).root(0, &observe).unwrap()
        };
        // A hundredth of a decibel a second, as satellites rise.
        let slow = |t_s: f64| 1e4 * libm::pow(10.0, 1e-3 * t_s);
        let rising = made(&slow);
        assert_eq!((rising.len(), rising[0].paths[0].run_samples), (1, crate::synth::RUN_SAMPLES as u64));
        assert_eq!(rising[0].paths[0].cn0_hz, Cubic::line(slow(0.0), slow(rate.elapsed_s(rising[0].end))));
        // 9.5 dB from side to side, a hundred times a second.
        let turning = |t_s: f64| {
            let amplitude = 1.0 + 0.5 * libm::sin(std::f64::consts::TAU * 100.0 * t_s);
            1e4 * amplitude * amplitude
        };
        let parts = made(&turning);
        assert!(parts.iter().all(|part| part.amplitude_error <= AMPLITUDE_ERROR));
        for part in parts.iter().step_by(37) {
            for k in 0..=40 {
                let n = part.start + (part.end - part.start) * k / 40;
                let cn0_hz = part.paths[0].cn0_hz.at(part.fraction(n));
                // Points of comparison lie where a cubic's error is half its largest and more.
                let error = (cn0_hz.sqrt() - turning(rate.elapsed_s(n)).sqrt()).abs() / 150.0;
                assert!(error < 2.0 * AMPLITUDE_ERROR, "{n}: {error}");
            }
            let steepest = 2.0 * 150.0 * 50.0 * std::f64::consts::TAU * 100.0 / 2.6e6;
            let run = part.paths[0].run_samples as f64;
            assert!(run <= 64.0 || steepest * run / (4.0 * 150.0 * 150.0) < AMPLITUDE_STEP * 1.5, "{run}");
        }
        // A ray that is silent needs no path.
        assert!(made(&|_| 0.0).iter().all(|part| part.paths.is_empty()));
    }

    #[test]
    fn breaks_by_the_hundred_thousand_in_a_root_each_end_a_part() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        // A row of motion every 64 µs, in a root of 13 s.
        let breaks: Vec<u64> = (0..300_000).map(|k| 167 * k + 50).collect();
        let observe = |n: u64| Ok::<_, ()>(Some(vec![arrival(rate.elapsed_s(n), 0.0)]));
        let grid = Grid::new(rate, breaks, 1e-4, CARRIER_HZ);
        let size = grid.root_samples();
        let parts = [0, 1].map(|root| grid.root(root, &observe).unwrap()).concat();
        let inside = (0..300_000).map(|k| 167 * k + 50).filter(|at| *at < 2 * size).count();
        assert!(inside > 200_000, "{inside}");
        // And where the second root begins.
        assert_eq!(parts.len(), inside + 2);
        assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start && pair[0].end > pair[0].start));
        assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, 2 * size));
    }

    #[test]
    fn parts_join_without_gap_and_stay_within_the_tolerance_everywhere() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        for breaks in [vec![], vec![4 * 2_600_000]] {
            let parts = parts(rate, 200.0, breaks);
            for pair in parts.windows(2) {
                assert_eq!(pair[0].end, pair[1].start);
            }
            for part in &parts {
                for k in 0..=50 {
                    let n = part.start + (part.end - part.start) * k / 50;
                    let u = part.fraction(n);
                    let truth = arrival(rate.elapsed_s(n), 200.0);
                    let turns = part.paths[0].carrier.at(u) - truth.carrier_cycles;
                    assert!((turns - turns.round()).abs() < 1e-4, "{n}");
                    assert!((part.paths[0].delay.at(u) - truth.delay_s).abs() * CARRIER_HZ < 1e-4);
                }
            }
        }
    }
}
