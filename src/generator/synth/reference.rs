//! The reference kernel: every sample by itself in `f64`, as the definitions read.
//!
//! It is what the fast kernel is measured against. Only the final sum is `f32`.

use super::band::HALF_WIDTH;
use super::chips::sign;
use super::{CODE_ONE, Edge, Run, radians, to_step};

/// Adds the run to planar samples; `i` and `q` have the same length.
pub fn accumulate(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32]) {
    for (n, (i, q)) in i.iter_mut().zip(q).enumerate() {
        let (sin, cos) = libm::sincos(radians(run.turns.wrapping_add(run.turns_step.wrapping_mul(n as u64))));
        let value = run.amplitude * waveform(edge, run, run.position + run.step * n as u64);
        *i += (value * cos) as f32;
        *q += (value * sin) as f32;
    }
}

/// The code waveform at one position (Q16.48 steps).
pub fn waveform(edge: Edge<'_>, run: &Run<'_>, position: u64) -> f64 {
    match edge {
        Edge::Nearest => sign(run.bits, (position / CODE_ONE) as usize),
        Edge::Area => mean(run, position - run.step / 2, position - run.step / 2 + run.step),
        Edge::BandLimited(filter) => {
            if let Some(pulse) = run.pulse {
                return pulse.waveform(filter, run, position);
            }
            let reach = HALF_WIDTH as u64 * run.step;
            let (first, last) = ((position - reach) / CODE_ONE, (position + reach) / CODE_ONE);
            let mut value = sign(run.bits, first as usize);
            for step in first + 1..=last {
                let change = sign(run.bits, step as usize) - sign(run.bits, step as usize - 1);
                let since = -to_step(position, step) / run.step as f64;
                value += change * filter.step(since);
            }
            value
        }
    }
}

/// Mean of the waveform from `from` to `to`.
fn mean(run: &Run<'_>, from: u64, to: u64) -> f64 {
    let mut sum = 0.0;
    let mut at = from;
    while at < to {
        let end = ((at / CODE_ONE + 1) * CODE_ONE).min(to);
        sum += sign(run.bits, (at / CODE_ONE) as usize) * (end - at) as f64;
        at = end;
    }
    sum / (to - from) as f64
}
