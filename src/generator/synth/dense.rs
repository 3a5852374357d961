//! Samples read from windows of signs of their own, however many steps each spans: the code at their instants
//! and its mean over each.
//!
//! Both are those of [`super::reference`] to the last bit: lengths are counted in 2^-48 steps, at most
//! fifteen steps to a sample, and sums of them are exact in either order.

use super::chips::window;
use super::{CODE_BITS, CODE_ONE, Run};

/// Samples of a block where a window has the steps of so many, and where steps are as short as they may be:
/// a window holds 62 beside the step in which a block begins.
const BLOCK: usize = 8;
const SHORT_BLOCK: usize = 4;
const STEPS: u64 = 62;

const _: () = assert!(SHORT_BLOCK as f64 * super::chips::MAX_STEP <= STEPS as f64);

/// The code's means over samples, the first about `position`.
#[inline(always)]
pub(super) fn means<T>(run: &Run<'_>, position: u64, out: &mut [T], number: impl Fn(f64) -> T) {
    if run.step * BLOCK as u64 <= STEPS * CODE_ONE {
        blocks(run, position, out, |position| means_of::<BLOCK>(run, position), number);
    } else {
        blocks(run, position, out, |position| means_of::<SHORT_BLOCK>(run, position), number);
    }
}

/// The code's signs at samples' instants, the first at `position`, each as the first bit of a word.
#[inline(always)]
pub(super) fn signs<T>(run: &Run<'_>, position: u64, out: &mut [T], number: impl Fn(u64) -> T) {
    if run.step * BLOCK as u64 <= STEPS * CODE_ONE {
        blocks(run, position, out, |position| signs_of::<BLOCK>(run, position), number);
    } else {
        blocks(run, position, out, |position| signs_of::<SHORT_BLOCK>(run, position), number);
    }
}

/// Writes numbers of samples, `N` at a time.
#[inline(always)]
fn blocks<const N: usize, V: Copy, T>(
    run: &Run<'_>,
    mut position: u64,
    out: &mut [T],
    block: impl Fn(u64) -> [V; N],
    number: impl Fn(V) -> T,
) {
    let (whole, rest) = out.as_chunks_mut::<N>();
    for out in whole {
        let values = block(position);
        for k in 0..N {
            out[k] = number(values[k]);
        }
        position += run.step * N as u64;
    }
    if !rest.is_empty() {
        for (out, value) in rest.iter_mut().zip(block(position)) {
            *out = number(value);
        }
    }
}

/// The signs at as many samples as one window has the steps of.
#[inline(always)]
fn signs_of<const N: usize>(run: &Run<'_>, position: u64) -> [u64; N] {
    let signs = window(run.bits, (position / CODE_ONE) as usize);
    let first = position % CODE_ONE;
    let mut found = [0; N];
    for (found, k) in found.iter_mut().zip(0..) {
        *found = signs.wrapping_shl((first.wrapping_add(run.step.wrapping_mul(k)) / CODE_ONE) as u32);
    }
    found
}

/// The means over as many samples as one window of signs has the steps of.
#[inline(always)]
fn means_of<const N: usize>(run: &Run<'_>, position: u64) -> [f64; N] {
    let from = position - run.step / 2;
    let signs = window(run.bits, (from / CODE_ONE) as usize);
    let (first, length) = (from % CODE_ONE, run.step as f64);
    let mut means = [0.0; N];
    for (mean, k) in means.iter_mut().zip(0..) {
        let at = first.wrapping_add(run.step.wrapping_mul(k));
        let signs = signs.wrapping_shl((at / CODE_ONE) as u32);
        let begin = at % CODE_ONE;
        let end = begin.wrapping_add(run.step);
        // Steps that end within the sample are counted whole, and what lies before it is taken off again.
        let steps = (end / CODE_ONE) as u32;
        let negative = (signs >> 1).wrapping_shr(63_u32.wrapping_sub(steps)).count_ones();
        let whole = i64::from(steps.wrapping_sub(2 * negative) as i32) << CODE_BITS;
        let parts = signed(end % CODE_ONE, signs.wrapping_shl(steps)).wrapping_sub(signed(begin, signs));
        *mean = whole.wrapping_add(parts) as f64 / length;
    }
    means
}

/// A length below zero where the first of `signs` is set.
#[inline(always)]
fn signed(length: u64, signs: u64) -> i64 {
    let negative = signs as i64 >> 63;
    (length as i64 ^ negative).wrapping_sub(negative)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::chips::{CodeTime, MAX_STEP};
    use crate::synth::waveform::plain;
    use crate::synth::{Edge, reference};
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn means_are_those_of_the_definition_to_the_last_bit() {
        const SAMPLES: usize = 1003;
        let spreading = plain(&L1_CA, 11).unwrap();
        let whole = [1.0, 2.0, 3.0, 10.0].map(|steps| (steps * CODE_ONE as f64) as u64);
        let others = [1.000_3, 1.5, 2.994, 7.7, MAX_STEP - 1e-6].map(|steps| (steps * CODE_ONE as f64) as u64);
        for step in whole.into_iter().chain(others) {
            for fraction in [0, 1, CODE_ONE / 2, CODE_ONE - 1] {
                let mut bits = Vec::new();
                let at = CodeTime::new(8, 1010 * CODE_ONE + fraction);
                let position = spreading.strip(at, step, SAMPLES, |period| period % 2 == 1, &mut bits);
                let run = Run { bits: &bits, position, step, turns: 0, turns_step: 0, amplitude: 1.0, pulse: None };
                let mut found = [0.0; SAMPLES];
                means(&run, position, &mut found, |mean| mean);
                for (n, found) in (0..).zip(found) {
                    let at = position + step * n;
                    assert_eq!(found, reference::waveform(Edge::Area, &run, at), "{step} {fraction} {n}");
                }
            }
        }
    }
}
