//! Continuous waves among the samples: lines that exceed the averaged spectrum.
//!
//! Ten times a second a segment of the samples is transformed (Hann window, bins of 0.5 to 1 kHz); ten powers
//! are averaged and each bin is held against those beside it. In Gaussian noise, white or coloured, a bin's
//! mean is chi-square with 20 degrees of freedom about its density, so the threshold over it follows from the
//! probability of a false alarm, [`FALSE_ALARM`] for all bins of one spectrum. The density is the median of
//! 64 bins on either side, the greater of both, so that the edge of a filter is no line (a greatest-of CFAR
//! test: Hansen 1973; order statistics: Rohling 1983). Satellites have lines of their own, 1 kHz apart and at
//! most 21.3 dB below the whole for C/A: what is no stronger than those of the strongest satellite followed
//! is not reported, and where the codes of those followed raise a bin above the ones beside, its threshold
//! rises with it (`own`).
//!
//! Sensitivity: J/N0 of 37.5 dB-Hz at 2.6 Msps, far below what a loop minds. Limits: nothing is reported
//! within three bins of a constant offset, nor of a real recording's half rate; a wave that comes and goes
//! within a second is averaged; lines of a strong signal that is not followed pass for interference, and a
//! sweep shows as many lines.

mod own;

use std::sync::Arc;

use fft::{Fft, Planner};
use num_complex::Complex;

use crate::source::{Packed, Planes};
use crate::threshold::threshold;
use gnss::record::LineRow;
use gnss::samples::IfMetadata;

pub use own::Followed;

/// Probability that noise alone shows a line in one spectrum, a second's: once in three years.
pub const FALSE_ALARM: f64 = 1e-8;
/// Time between segments, in milliseconds.
const INTERVAL_MS: u64 = 100;
/// Number of segments in a spectrum.
const SEGMENTS: u32 = 10;
/// Widest bin; the segment is the next power of two.
const BIN_HZ: f64 = 1000.0;
/// Number of bins on either side whose mean is the density.
const BESIDE: usize = 64;
/// Number of bins between those and the tested one: a Hann window's lobe and more.
const GUARD: usize = 4;
/// Bins about a constant offset that are not looked at.
const OFFSET_BINS: usize = 3;
/// Largest line of a C/A code over its power (PRN 24; −21.26 dB), and room for two that meet and for the
/// estimate: 6 dB.
const OWN_LINE: f64 = 0.0075 * 4.0;

/// Spectra of the samples, second after second.
pub struct Watch {
    metadata: IfMetadata,
    rate: gnss::time::Rate,
    is_real: bool,
    fft: Arc<dyn Fft<f32>>,
    scratch: Vec<Complex<f32>>,
    window: Vec<f32>,
    threshold: f64,
    /// Median over mean of a bin in noise.
    median: f64,
    planes: Planes,
    segment: Vec<Complex<f32>>,
    /// The segment that is being filled, counted in intervals.
    number: u64,
    powers: Vec<f64>,
    segments: u32,
    first: u64,
    /// True if a spectrum has been reported.
    reported: bool,
}

/// A line, before it is known what the satellites are.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    bin: usize,
    statistic: f64,
}

impl Watch {
    /// A watch over samples as `metadata` describes them.
    pub fn new(metadata: &IfMetadata) -> Self {
        let bins = ((metadata.rate.hz() / BIN_HZ) as usize).next_power_of_two().clamp(1024, 1 << 17);
        let fft = Planner::<f32>::new().plan_fft_forward(bins);
        let angle = |n: usize| std::f64::consts::TAU * n as f64 / bins as f64;
        let is_real = !metadata.format.is_complex();
        let tested = if is_real { bins / 2 } else { bins };
        let (degrees, mean) = (2 * SEGMENTS, f64::from(2 * SEGMENTS));
        Self {
            metadata: metadata.clone(),
            rate: metadata.rate,
            is_real,
            scratch: vec![Complex::default(); fft.get_inplace_scratch_len()],
            fft,
            window: (0..bins).map(|n| (0.5 - 0.5 * libm::cos(angle(n))) as f32).collect(),
            threshold: threshold(FALSE_ALARM / tested as f64, degrees) / mean,
            median: threshold(0.5, degrees) / mean,
            planes: Planes::default(),
            segment: Vec::with_capacity(bins),
            number: 0,
            powers: vec![0.0; bins],
            segments: 0,
            first: 0,
            reported: false,
        }
    }

    /// Takes the next block and reports to `each` every spectrum that it completes: the number of its first
    /// sample, and its strongest line if it has one. `strongest_cn0_hz` is that of the satellites followed.
    pub fn take(
        &mut self,
        block: &Packed,
        (strongest_cn0_hz, followed): (f64, &[Followed]),
        mut each: impl FnMut(u64, Option<LineRow>),
    ) {
        let bins = self.window.len();
        loop {
            let begins = self.rate.first_sample_at(self.number * INTERVAL_MS, 1000);
            let from = begins + self.segment.len() as u64;
            if from < block.first || from >= block.end() {
                return;
            }
            let start = (from - block.first) as usize;
            let part = block.unpack(start..start + bins - self.segment.len(), &mut self.planes);
            self.segment.extend(part.i.iter().zip(part.q).map(|(i, q)| Complex::new(*i, *q)));
            if self.segment.len() < bins {
                return;
            }
            if self.segments == 0 {
                self.first = begins;
            }
            self.transform();
            // At rates so low that a segment is longer than the interval the next one begins after it.
            let end = begins + bins as u64;
            while self.rate.first_sample_at(self.number * INTERVAL_MS, 1000) < end {
                self.number += 1;
            }
            if self.segments == SEGMENTS {
                each(self.first, self.judge(strongest_cn0_hz, followed));
                self.reported = true;
                self.powers.fill(0.0);
                self.segments = 0;
            }
        }
    }

    /// Reports the spectrum of fewer segments that a recording shorter than a second leaves: the threshold is
    /// that of so many.
    pub fn rest(
        &mut self,
        (strongest_cn0_hz, followed): (f64, &[Followed]),
        mut each: impl FnMut(u64, Option<LineRow>),
    ) {
        if self.segments == 0 || self.reported {
            return;
        }
        let tested = if self.is_real { self.powers.len() / 2 } else { self.powers.len() };
        let (degrees, mean) = (2 * self.segments, f64::from(2 * self.segments));
        self.threshold = threshold(FALSE_ALARM / tested as f64, degrees) / mean;
        self.median = threshold(0.5, degrees) / mean;
        each(self.first, self.judge(strongest_cn0_hz, followed));
        self.segments = 0;
    }

    fn transform(&mut self) {
        let mean = self.segment.iter().fold(Complex::new(0.0_f64, 0.0), |sum, x| {
            Complex::new(sum.re + f64::from(x.re), sum.im + f64::from(x.im))
        }) / self.segment.len().max(1) as f64;
        let mean = Complex::new(mean.re as f32, mean.im as f32);
        for (x, w) in self.segment.iter_mut().zip(&self.window) {
            *x = (*x - mean) * w;
        }
        self.fft.process_with_scratch(&mut self.segment, &mut self.scratch);
        for (power, x) in self.powers.iter_mut().zip(&self.segment) {
            *power += f64::from(x.norm_sqr());
        }
        self.segment.clear();
        self.segments += 1;
    }

    /// Mean density beside every bin; the spectrum is a ring.
    fn density(&self) -> Vec<f64> {
        let bins = self.powers.len();
        let mut medians = Sliding::new(self.powers.iter().copied().cycle().take(BESIDE));
        // Entry n: of the bins from n on.
        let ahead: Vec<f64> = (0..bins)
            .map(|n| {
                let median = medians.median();
                medians.slide(self.powers[n], self.powers[(n + BESIDE) % bins]);
                median
            })
            .collect();
        let scale = 1.0 / self.median;
        (0..bins)
            .map(|n| scale * ahead[(n + GUARD) % bins].max(ahead[(n + bins - GUARD + 1 - BESIDE) % bins]))
            .collect()
    }

    /// Ratio of a bin's expected power to that of the bins beside it, caused by the satellites' own codes.
    fn raised(&self, shares: &[f64], bin: usize) -> f64 {
        let bins = shares.len();
        let beside = (GUARD..GUARD + BESIDE).flat_map(|n| [(bin + n) % bins, (bin + bins - n) % bins]);
        let mean = beside.map(|n| shares[n]).sum::<f64>() / (2 * BESIDE) as f64;
        ((1.0 + shares[bin]) / (1.0 + mean)).max(1.0)
    }

    fn judge(&self, strongest_cn0_hz: f64, followed: &[Followed]) -> Option<LineRow> {
        let (bins, density) = (self.powers.len(), self.density());
        let half = bins / 2;
        let open = |n: usize| {
            let offset = n.min(bins - n);
            offset > OFFSET_BINS && !(self.is_real && (n >= half || half - n <= OFFSET_BINS))
        };
        let ratio = |n: usize| if density[n] > 0.0 { self.powers[n] / density[n] } else { 0.0 };
        let mut lines: Vec<Line> = (0..bins)
            .filter(|&n| open(n) && ratio(n) > self.threshold)
            .filter(|&n| {
                let (before, after) = ((n + bins - 1) % bins, (n + 1) % bins);
                self.powers[n] > self.powers[before] && self.powers[n] >= self.powers[after]
            })
            .map(|bin| Line { bin, statistic: ratio(bin) })
            .collect();
        if !lines.is_empty() && !followed.is_empty() {
            let shares = own::shares(followed, (&self.metadata, self.first), (&*self.fft, &self.window));
            lines.iter_mut().for_each(|line| line.statistic /= self.raised(&shares, line.bin));
            lines.retain(|line| line.statistic > self.threshold);
        }
        // Power over the density of the whole lobe: Σ (P/F − 1) bins.
        let bin_hz = self.rate.hz() / bins as f64;
        let jn0_hz = |line: &Line| {
            let near = (0..5).map(|k| (line.bin + bins + k - 2) % bins);
            bin_hz * near.map(|n| self.powers[n] / density[line.bin] - 1.0).sum::<f64>()
        };
        // A correlator's noise is the density where it is high; beside it the same line exceeds it further.
        let mut sorted = density.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0);
        let share = |line: &Line| if usual > 0.0 { (density[line.bin] / usual).min(1.0) } else { 1.0 };
        let found: Vec<(f64, Line)> = (lines.into_iter())
            .map(|line| (jn0_hz(&line), line))
            .filter(|(power_hz, line)| *power_hz * share(line) > OWN_LINE * strongest_cn0_hz)
            .collect();
        let (power_hz, line) = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied()?;
        Some(LineRow {
            sample: self.first,
            frequency_hz: bin_hz * self.place(line.bin),
            jn0_dbhz: 10.0 * libm::log10(power_hz),
            js_db: None,
            statistic: line.statistic,
            threshold: self.threshold,
            lines: found.len() as u32,
            resolution_hz: bin_hz,
        })
    }

    /// Peak frequency of a line, in bins from the middle of the samples' band.
    fn place(&self, bin: usize) -> f64 {
        let bins = self.powers.len();
        let power = |n: usize| self.powers[n % bins];
        let off = hann_peak(power(bin + bins - 1), power(bin), power(bin + 1));
        let middle = if bin >= bins / 2 { bin as f64 - bins as f64 } else { bin as f64 };
        middle + off
    }
}

/// Peak frequency of a line, in bins from the middle bin, from three powers with a Hann window. The
/// amplitudes of two neighbours have the ratio (1 + δ)/(2 − δ).
pub(super) fn hann_peak(before: f64, at: f64, after: f64) -> f64 {
    let [before, at, after] = [before, at, after].map(f64::sqrt);
    let beyond = |neighbour: f64| (2.0 * neighbour - at) / (neighbour + at);
    let off = if after > before { beyond(after) } else { -beyond(before) };
    off.clamp(-0.5, 0.5)
}

/// The median of a window that slides.
struct Sliding(Vec<f64>);

impl Sliding {
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        Self(sorted)
    }

    fn median(&self) -> f64 {
        let half = self.0.len() / 2;
        0.5 * (self.0[half - 1] + self.0[half])
    }

    fn slide(&mut self, out: f64, next: f64) {
        let place = |sorted: &[f64], x: f64| sorted.partition_point(|y| y.total_cmp(&x).is_lt());
        self.0.remove(place(&self.0, out));
        self.0.insert(place(&self.0, next), next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Source;
    use gnss::samples::Format;
    use gnss::time::Rate;

    fn metadata(format: Format, rate_hz: f64) -> IfMetadata {
        let rate = Rate::from_hz(rate_hz).unwrap();
        IfMetadata { format, rate, center_hz: 1_575.42e6, inverted: false, start: None }
    }

    /// Gaussian numbers by sums of four, from Knuth's congruential generator: a spectrum's bins do not mind.
    struct Noise(u64);

    impl Noise {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }

        fn next(&mut self) -> f64 {
            ((0..4).map(|_| self.uniform()).sum::<f64>() - 2.0) * 3.0_f64.sqrt()
        }
    }

    /// Every spectrum of seconds of bytes that `of` makes of a sample's number.
    fn watch(metadata: &IfMetadata, seconds: f64, mut of: impl FnMut(u64) -> (f64, f64)) -> Vec<Option<LineRow>> {
        let mut watch = Watch::new(metadata);
        let count = (seconds * metadata.rate.hz()) as u64;
        let byte = |x: f64| x.round().clamp(-128.0, 127.0) as i8 as u8;
        let mut bytes = Vec::new();
        for n in 0..count {
            let (i, q) = of(n);
            bytes.push(byte(i));
            if metadata.format.is_complex() {
                bytes.push(byte(q));
            }
        }
        // Blocks of an odd length: the watch must not notice.
        let mut source = Source::new(metadata.format, 7777);
        let (mut rest, mut rows) = (&bytes[..], Vec::new());
        while let Some(block) = source.next(&mut rest) {
            watch.take(&block, (0.0, &[]), |_, row| rows.push(row));
        }
        rows
    }

    #[test]
    fn a_wave_is_reported_with_its_frequency_and_power_and_an_offset_is_none() {
        for (format, rate_hz, f_hz) in
            [(Format::Ci8, 2.6e6, -227_123.0), (Format::Ri8, 5.2e6, 1_234_567.0), (Format::Ci8, 1.1e6, 300_001.0)]
        {
            let metadata = metadata(format, rate_hz);
            let mut noise = Noise(5);
            // N0 = 2σ²/fs, both of complex samples and, one-sided, of real ones, whose tone has half of its
            // square as power.
            let n0 = 2.0 * 100.0 / rate_hz;
            let power = libm::pow(10.0, 4.5) * n0;
            let height = if format.is_complex() { power.sqrt() } else { (2.0 * power).sqrt() };
            let rows = watch(&metadata, 2.0, |n| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * (f_hz * n as f64 / rate_hz).fract());
                (30.0 + 10.0 * noise.next() + height * cos, -20.0 + 10.0 * noise.next() + height * sin)
            });
            assert!(!rows.is_empty());
            for row in rows {
                let row = row.expect("reported");
                assert!((row.frequency_hz - f_hz).abs() < 0.3 * row.resolution_hz, "{row:?}");
                // Ten segments at 15 dB over a bin: 0.7 dB, two sigma and the lobe's tails.
                assert!((row.jn0_dbhz - 45.0).abs() < 1.5 && row.lines == 1, "{row:?}");
            }
        }
    }

    #[test]
    fn noise_shows_lines_as_often_as_stated_and_the_edge_of_a_filter_is_none() {
        let metadata = metadata(Format::Ci8, 1.1e6);
        let mut noise = Noise(9);
        // White, and a moving mean of eight that leaves an eighth of the band.
        let mut past = [(0.0, 0.0); 8];
        for coloured in [false, true] {
            let rows = watch(&metadata, 8.0, |n| {
                past[n as usize % 8] = (noise.next(), noise.next());
                let (i, q) = past.iter().fold((0.0, 0.0), |sum, x| (sum.0 + x.0, sum.1 + x.1));
                if coloured {
                    (9.0 * i, 9.0 * q)
                } else {
                    (25.0 * past[n as usize % 8].0, 25.0 * past[n as usize % 8].1)
                }
            });
            assert!(rows.len() == 8 && rows.iter().all(Option::is_none), "{coloured} {rows:?}");
        }
        // At a designed false alarm in two spectra: 400 of them, drawn as what noise makes of them. The
        // greater of two medians lies 3 % above the density and scatters by 4 %, which leaves 0.79 of the
        // alarms of a bin at this threshold (and makes 1.15 of them at the real one, where the tail is
        // steeper): 0.42, and three sigma of 0.025.
        let mut watch = Watch::new(&metadata);
        watch.threshold = threshold(libm::log(2.0) / watch.powers.len() as f64, 2 * SEGMENTS) / f64::from(2 * SEGMENTS);
        let mut alarms = 0;
        for _ in 0..400 {
            for power in &mut watch.powers {
                *power = (0..SEGMENTS).map(|_| -2.0 * libm::log(noise.uniform())).sum();
            }
            alarms += u32::from(watch.judge(0.0, &[]).is_some());
        }
        let rate = f64::from(alarms) / 400.0;
        assert!((0.345..0.495).contains(&rate), "{rate}");
    }

    #[test]
    fn a_satellite_s_own_line_is_none_and_silence_has_none() {
        let metadata = metadata(Format::Ci8, 2.6e6);
        let silent = watch(&metadata, 1.1, |_| (0.0, 0.0));
        assert_eq!(silent, [None]);
        let mut watch = Watch::new(&metadata);
        watch.powers.fill(1.0);
        watch.powers[100] = 50.0;
        // 47 bins of 635 Hz are 44.8 dB-Hz: of a satellite of 67 dB-Hz it may be a line, of one of 57 not.
        assert!(watch.judge(libm::pow(10.0, 6.7), &[]).is_none() && watch.judge(5e5, &[]).is_some());
    }

    /// Ten satellites of 52 dB-Hz as an antenna may meet them.
    fn sky() -> Vec<Followed> {
        let one = |k: u8| Followed {
            link: gnss::gps::l1ca::L1_CA.link(gnss::satellite::Sv::gps(3 * k + 1)),
            cn0_hz: libm::pow(10.0, 5.2),
            doppler_hz: 731.0 * f64::from(k) - 3300.0,
            sample: 0,
            chips: 97.3 * f64::from(k),
        };
        (0..10).map(one).collect()
    }

    #[test]
    fn the_share_of_a_satellite_in_all_bins_is_its_power_over_the_noise_s() {
        let watch = Watch::new(&metadata(Format::Ci8, 2.6e6));
        let sky = sky();
        let shares = own::shares(&sky[..1], (&watch.metadata, 5), (&*watch.fft, &watch.window));
        // C/N0 over the rate in the mean of all bins: Parseval.
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        assert!((mean / (sky[0].cn0_hz / 2.6e6) - 1.0).abs() < 1e-3, "{mean}");
        // A code moved by so many samples, seen as many later, is the same; a Doppler of ten bins moves all.
        let later = [Followed { sample: 1000, ..sky[0] }];
        let same = own::shares(&later, (&watch.metadata, 1005), (&*watch.fft, &watch.window));
        assert!(same.iter().zip(&shares).all(|(a, b)| (a - b).abs() < 1e-3 * mean));
        let shifted = [Followed { doppler_hz: sky[0].doppler_hz + 2.6e7 / 4096.0, ..sky[0] }];
        let moved = own::shares(&shifted, (&watch.metadata, 5), (&*watch.fft, &watch.window));
        // The code's own Doppler moves edges across the middles of few samples.
        let common: f64 = (0..shares.len()).map(|n| shares[n].min(moved[(n + 10) % shares.len()])).sum();
        assert!(common > 0.85 * mean * shares.len() as f64, "{common}");
    }

    #[test]
    fn noise_on_the_satellites_own_lines_shows_no_more_lines_than_elsewhere() {
        let mut watch = Watch::new(&metadata(Format::Ci8, 2.6e6));
        let shares = own::shares(&sky(), (&watch.metadata, 0), (&*watch.fft, &watch.window));
        // At a designed false alarm of a tenth in noise of even density.
        watch.threshold = threshold(0.1 / watch.powers.len() as f64, 2 * SEGMENTS) / f64::from(2 * SEGMENTS);
        let mut noise = Noise(11);
        let (mut even, mut minded) = (0, 0);
        for _ in 0..200 {
            for (power, share) in watch.powers.iter_mut().zip(&shares) {
                let drawn: f64 = (0..SEGMENTS).map(|_| -2.0 * libm::log(noise.uniform())).sum();
                *power = (1.0 + share) * drawn;
            }
            even += u32::from(watch.judge(0.0, &[]).is_some());
            minded += u32::from(watch.judge(0.0, &sky()).is_some());
        }
        // By the law of every bin 0.6 to 0.9 alarms a spectrum (the greater of two medians is 0 to 3.5 %
        // above the density), and 0.034 to 0.068: 90 to 120 spectra of 200 with one, and 7 to 14. Three
        // sigma.
        assert!(even > 69 && (1..=25).contains(&minded), "{even} and {minded} of 200");
    }
}
