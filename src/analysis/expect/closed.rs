//! Closed loops as the receiver runs them: their answers to noise, to a step and to a moving phase.

use crate::expect::theory::linear::{Feedback, PhaseLoop, controlled_root, controlled_root_gains};

/// A loop of exact bandwidth whose roots all lie at one position; `None` where no such position is.
pub fn exact_loop(order: u32, bandwidth_time: f64) -> Option<PhaseLoop> {
    let of = |root: f64| PhaseLoop { gains: controlled_root_gains(order, root), feedback: Feedback::PhaseAndRate };
    let (mut low, mut high) = (1e-6_f64, 1.0 - 1e-6);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        // The bandwidth falls as the root nears one.
        if of(middle).bandwidth_time()? > bandwidth_time { low = middle } else { high = middle }
    }
    Some(of(0.5 * (low + high)))
}

/// Response of a loop to unit noise of its discriminator, computed from its response to one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Response {
    /// Variance of the estimate of an interval's mean phase.
    pub phase: f64,
    /// Variance of the discriminator's output.
    pub put_out: f64,
    /// Variance of the output's difference from one interval to the next.
    pub difference: f64,
    /// Variance of the rate, in phase an interval.
    pub rate: f64,
    /// Covariance of that phase and that rate.
    pub cross: f64,
    /// Variance of the same rate for steps of the phase in place of noise.
    pub rate_after_steps: f64,
}

/// Natural frequency of a loop whose roots all lie at exp(−ωT), radians a second.
pub(crate) fn natural_radps(closed: &PhaseLoop, order: u32, update_s: f64) -> f64 {
    -libm::log(controlled_root(order, closed.gains)) / update_s
}

/// Intervals after which nothing is left of a value in any loop that can be set: bandwidth times time is 1e-4
/// or more.
const LONGEST: usize = 200_000;

impl Response {
    pub fn of(closed: &PhaseLoop) -> Self {
        let mut state = [0.0; 3];
        let mut found =
            Self { phase: 0.0, put_out: 0.0, difference: 0.0, rate: 0.0, cross: 0.0, rate_after_steps: 0.0 };
        let (mut before, mut ran_after_step) = (0.0, 0.0);
        for k in 0..LONGEST {
            let noise = if k == 0 { 1.0 } else { 0.0 };
            found.phase += state[0] * state[0];
            // What the oscillator runs at in this interval, the mean of its rate.
            let ran = state[1] + 0.5 * state[2];
            found.rate += ran * ran;
            found.cross += state[0] * ran;
            // A step is one value in every interval from its own on.
            ran_after_step += ran;
            found.rate_after_steps += ran_after_step * ran_after_step;
            let put_out = noise - state[0];
            found.put_out += put_out * put_out;
            found.difference += (put_out - before) * (put_out - before);
            before = put_out;
            state = step(&closed.gains, state, put_out);
            if k > 10 && state.iter().all(|x| x.abs() < 1e-9) {
                break;
            }
        }
        found
    }
}

/// Mean rates in the intervals from a unit step of the phase on, in phase an interval. The step is at the
/// beginning of the first, in which the loop knows nothing of it.
pub(crate) fn rates_after_step(closed: &PhaseLoop) -> Vec<f64> {
    let (mut state, mut rates) = ([0.0; 3], Vec::new());
    let is_over = |[phase, rate, acceleration]: [f64; 3]| {
        (phase - 1.0).abs() < 1e-9 && rate.abs() < 1e-9 && acceleration.abs() < 1e-9
    };
    while rates.len() < LONGEST && !is_over(state) {
        rates.push(state[1] + 0.5 * state[2]);
        state = step(&closed.gains, state, 1.0 - state[0]);
    }
    rates
}

/// One update of (mean phase of the coming interval, rate, acceleration) by an error.
pub(crate) fn step([k1, k2, k3]: &[f64; 3], [phase, rate, acceleration]: [f64; 3], error: f64) -> [f64; 3] {
    let acceleration = acceleration + k3 * error;
    let rate = rate + k2 * error + acceleration;
    [phase + k1 * error + rate, rate, acceleration]
}

/// A noise-free loop on the phases of successive intervals.
pub(super) struct Follower<'a> {
    closed: &'a PhaseLoop,
    first: Option<f64>,
    last: Option<f64>,
    state: Option<[f64; 3]>,
    /// Intervals of the first second, in which it runs in.
    running_in: usize,
}

impl<'a> Follower<'a> {
    pub fn new(closed: &'a PhaseLoop, update_s: f64) -> Self {
        Self { closed, first: None, last: None, state: None, running_in: (1.0 / update_s) as usize }
    }

    /// Error on the next phase; `None` while the loop settles. It begins with the rate of the first two.
    pub fn error(&mut self, phase: f64) -> Option<f64> {
        Some(self.errors(phase)?[0])
    }

    /// Errors on the next phase, and of the rate at the boundary before it, in phase an interval.
    pub fn errors(&mut self, phase: f64) -> Option<[f64; 2]> {
        let begun = self.first.map(|first| step(&self.closed.gains, [first, phase - first, 0.0], 0.0));
        self.first = self.first.or(Some(phase));
        let state = self.state.or(begun);
        let error = state.map_or(0.0, |state| phase - state[0]);
        let moved = self.last.replace(phase).map_or(0.0, |last| phase - last);
        let rate_error = state.map_or(0.0, |state| moved - state[1]);
        self.state = state.map(|state| step(&self.closed.gains, state, error));
        let counts = self.running_in == 0;
        self.running_in = self.running_in.saturating_sub(1);
        counts.then_some([error, rate_error])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expect::theory::pll;

    #[test]
    fn a_loop_has_the_bandwidth_that_it_is_given() {
        // Root of order 3 from the literature's table: 0.954395 at 0.05.
        let found = exact_loop(3, 0.05).unwrap();
        let root = controlled_root(3, found.gains);
        assert!((root - 0.954_395).abs() < 1e-6, "{root}");
        let response = Response::of(&found);
        assert!((0.5 * response.phase - 0.05).abs() < 1e-6, "{response:?}");
        // A value is white: what is put out is its own variance and the estimate's, which knows it not yet.
        assert!((response.put_out - 1.0 - response.phase).abs() < 1e-9, "{response:?}");
        let after_steps: f64 = rates_after_step(&found).iter().map(|rate| rate * rate).sum();
        assert!((response.rate_after_steps / after_steps - 1.0).abs() < 1e-6, "{response:?} {after_steps}");
    }

    #[test]
    fn a_jerk_leaves_the_error_that_theory_says() {
        let closed = exact_loop(3, 0.072).unwrap();
        let t_s: f64 = 4e-3;
        let mut follower = Follower::new(&closed, t_s);
        let errors: Vec<f64> =
            (0..2000).filter_map(|k| follower.error(50.0 / 6.0 * (f64::from(k) * t_s).powi(3))).collect();
        assert_eq!(errors.len(), 2000 - 250, "the first second is left out");
        let last = *errors.last().unwrap();
        let expected = pll::stress_discrete(3, closed.gains[2], t_s, 50.0);
        assert!((last / expected - 1.0).abs() < 1e-3, "{last} {expected}");
    }

    #[test]
    fn a_jerk_leaves_a_rate_error_of_three_over_the_square_of_the_natural_frequency() {
        // Roots at exp(−ωT) are those of (s + ω)³ for small ωT: the rate lacks K₁·e, e = J/ω³ and K₁ = 3ω.
        let (t_s, jerk) = (1e-3, 50.0);
        let closed = exact_loop(3, 20.0 * t_s).unwrap();
        let natural = natural_radps(&closed, 3, t_s);
        let mut follower = Follower::new(&closed, t_s);
        let phase = |k: u32| jerk / 6.0 * (f64::from(k) * t_s).powi(3);
        let errors: Vec<[f64; 2]> = (0..4000).filter_map(|k| follower.errors(phase(k))).collect();
        let found = errors.last().unwrap()[1] / t_s;
        let expected = 3.0 * jerk / (natural * natural);
        // ωT is 0.019: three halves of it is what the difference of two methods comes to.
        assert!((found / expected - 1.0).abs() < 0.04, "{found} {expected}");
    }
}
