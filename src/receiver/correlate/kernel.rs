//! The fast correlators compiled for three instruction sets, and all that is written for one of them.
//!
//! [`single`] and [`short`] are plain Rust for any processor and for AVX2; loops for AVX-512 are in `wide`.
//! Every level gives the same bits.

use num_complex::Complex64;

use super::carrier::LANES;
use super::short::{self, GROUP};
use super::single::{self, CHUNK};
use super::{CODE_BITS, Edge, Nco, Pattern};

mod reduce;
#[cfg(target_arch = "x86_64")]
mod wide;

#[cfg(test)]
pub(super) use reduce::fold_plain;
pub(super) use reduce::{fixed_power, fold, power};

/// Entries of a chip table beyond one period.
pub(super) const TABLE_MARGIN: usize = CHUNK + LANES;
/// Entries of a chip table of short integers beyond one period.
pub(super) const SHORT_MARGIN: usize = GROUP;
/// Steps of the code up to this keep a vector's chips within one register of the table.
#[cfg(target_arch = "x86_64")]
const LOOKUP_STEP: u64 = 15 << (CODE_BITS - 4);

/// Taps that share one pass, which unpacks the samples and wipes the carrier off once: the sums of five and
/// what they need fit the registers of AVX-512 but for a few.
const AT_ONCE: usize = 5;

/// Arithmetic of the fast correlators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fast {
    /// `short`, or `single` where the code's step does not suit it.
    Short,
    Single,
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// Instruction sets that this processor can run, the best one last.
    #[cfg(test)]
    pub(crate) fn all() -> Vec<Self> {
        let mut levels = vec![Self::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                levels.push(Self::Avx2);
            }
            if avx512() {
                levels.push(Self::Avx512);
            }
        }
        levels
    }

    /// The best that this processor can run.
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if avx512() {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }
}

#[cfg(target_arch = "x86_64")]
fn avx512() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

/// Samples and replica of one call.
pub(super) struct Job<'a> {
    pub replica: &'a Pattern,
    pub i: &'a [f32],
    pub q: &'a [f32],
    pub nco: Nco,
    /// Motion of the code in 16 bits, if requested and possible.
    short: Option<short::Steps>,
}

/// Correlates `taps`, those of up to [`AT_ONCE`] in one pass over the samples, more in passes of three and of
/// what is left. `level` must be one that this processor has.
pub(super) fn correlate<const T: usize>(
    level: Level,
    fast: Fast,
    replica: &Pattern,
    (i, q): (&[f32], &[f32]),
    nco: &Nco,
    taps: &[i64; T],
) -> [Complex64; T] {
    let length = i.len().min(q.len());
    let short = match fast {
        Fast::Short => short::Steps::new(replica, nco.code_step),
        Fast::Single => None,
    };
    let job = Job { replica, i: &i[..length], q: &q[..length], nco: *nco, short };
    let step = nco.code_step as i64;
    // Area edges look at the chip in which the sample's interval ends, and at the one before.
    let ahead = match replica.edge {
        Edge::Area => step - step / 2 - (1 << CODE_BITS),
        Edge::Nearest => 0,
    };
    let period = replica.period();
    let code = (nco.code + ahead).rem_euclid(period) as u64;
    let begin = |tap: i64| {
        let tap = if (0..period).contains(&tap) { tap } else { tap.rem_euclid(period) };
        // Both are below 2⁶³.
        wrapped(code + tap as u64, period as u64)
    };
    if T <= AT_ONCE {
        return at_level(level, &job, taps.map(begin));
    }
    let mut sums = [Complex64::ZERO; T];
    let (threes, rest) = taps.as_chunks::<3>();
    let (sums_of_threes, sums_of_rest) = sums.as_chunks_mut::<3>();
    let (twos, ones) = rest.as_chunks::<2>();
    let (sums_of_twos, sums_of_ones) = sums_of_rest.as_chunks_mut::<2>();
    for (taps, sums) in threes.iter().zip(sums_of_threes) {
        *sums = at_level(level, &job, taps.map(begin));
    }
    for (taps, sums) in twos.iter().zip(sums_of_twos) {
        *sums = at_level(level, &job, taps.map(begin));
    }
    for (tap, sum) in ones.iter().zip(sums_of_ones) {
        [*sum] = at_level(level, &job, [begin(*tap)]);
    }
    sums
}

fn at_level<const T: usize>(level: Level, job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match (level, job.replica.edge) {
        (Level::Baseline, Edge::Area) => plain::<T, true>(job, begins),
        (Level::Baseline, Edge::Nearest) => plain::<T, false>(job, begins),
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected
        // the features.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Area) => unsafe { plain_avx2::<T, true>(job, begins) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Nearest) => unsafe { plain_avx2::<T, false>(job, begins) },
        // SAFETY: as above; `avx512` asks for AVX2 too.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Area) => unsafe { avx512_or_less::<T, true>(job, begins) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Nearest) => unsafe { avx512_or_less::<T, false>(job, begins) },
    }
}

fn plain<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short::body(job, steps, begins, short::lanes::<T, AREA>),
        None => single::body(job, begins, single::lanes::<T, AREA>),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
// A closure has the instruction set of its function, `lanes` as a value has not.
#[expect(clippy::redundant_closure)]
fn plain_avx2<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short::body(job, steps, begins, |chunk, code| short::lanes::<T, AREA>(chunk, code)),
        None => single::body(job, begins, |chunk, code| single::lanes::<T, AREA>(chunk, code)),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2")]
fn avx512_or_less<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short_avx512::<T, AREA>(job, steps, begins),
        None if job.nco.code_step <= LOOKUP_STEP => single_avx512::<T, AREA>(job, begins),
        None => plain_avx2::<T, AREA>(job, begins),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn single_avx512<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    single::body(job, begins, |chunk, code| wide::lanes::<T, AREA>(chunk, code))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn short_avx512<const T: usize, const AREA: bool>(job: &Job, steps: &short::Steps, begins: [u64; T]) -> [Complex64; T] {
    short::body(job, steps, begins, |chunk, code| wide::short_lanes::<T, AREA>(chunk, code))
}

/// A code phase below `period`; few periods are taken off.
#[inline(always)]
pub(super) fn wrapped(mut code: u64, period: u64) -> u64 {
    while code >= period {
        code -= period;
    }
    code
}
