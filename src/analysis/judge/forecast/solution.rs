//! Weighted least squares of the expected ranges at each fix: bias, noise, and the covariance to be stated.
//!
//! The rows are h = (−sight, 1 at the position of the range's clock). W are the weights of the receiver's
//! choices at the true C/N0, and N = Σ h W hᵀ. Biases b become N⁻¹ Σ h W b. Noise of covariance R becomes N⁻¹
//! (Σ h W R W hᵀ) N⁻¹. N⁻¹ is the covariance that the receiver ought to state. Fixes are taken one after the
//! other, with the rows of all satellites side by side, so that the sums of one fix are held. Of several
//! clocks the first with ranges is the fix's. Limits: weights by the measured C/N0 differ from these by its
//! noise.
//!
//! Two bands of a satellite that the receiver combines are one range here too, with a₁ = f₁²/(f₁²−f₂²) and a₂
//! = 1 − a₁. The ionosphere cancels, and noise grows to √(a₁²σ₁² + a₂²σ₂²).

use nalgebra::{Cholesky, DMatrix, DVector, Matrix4, Vector4};

use super::air::Air;
use super::ranges::{Forecast, Scene};
use super::rates::Rates;
use super::unshared::Unshared;
use crate::error::JudgeError;
use crate::measure::errors::Errors;
use crate::read::spill_store::Words;
use gnss::record::{Fix, IonosphereModel, TrajectoryRow};

/// Sums over the satellites of a fix. Vectors are east, north, up and the clocks of all time scales.
#[derive(Clone, Debug)]
struct Sums {
    /// Satellites, each with all its ranges.
    least: u32,
    most: u32,
    /// Ranges of the satellite that came last.
    pending: Vec<Forecast>,
    /// Left out, and whether any range is so wrong that residuals may show it, in whichever satellite.
    blameless: u32,
    faulty: bool,
    unsteady: bool,
    fading: bool,
    normal: DMatrix<f64>,
    plain: DMatrix<f64>,
    noise: DMatrix<f64>,
    bias: DVector<f64>,
    /// Biases that may be there or not.
    stepping: DVector<f64>,
    ionosphere: DVector<f64>,
    troposphere: DVector<f64>,
    rates: Rates,
    memory_s: f64,
}

/// Standard deviations from which on a bias is a fault that the residuals may show.
const FAULT: f64 = 3.0;
/// Carriers nearer to each other than this share are no two bands.
const SAME_BAND: f64 = 0.05;
/// Errors of the ionosphere that a fix estimates.
const COMMON: usize = 3;

impl Sums {
    /// No ranges yet, of as many time scales and signals.
    fn new(scales: usize, signals: usize) -> Self {
        let unknowns = 3 + scales + COMMON;
        let (matrix, vector) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        let mut prior = matrix.clone();
        prior.view_mut((3 + scales, 3 + scales), (COMMON, COMMON)).fill_with_identity();
        Self {
            least: 0,
            most: 0,
            pending: Vec::new(),
            blameless: 0,
            faulty: false,
            unsteady: false,
            fading: false,
            normal: prior,
            plain: matrix.clone(),
            noise: matrix,
            bias: vector.clone(),
            stepping: vector.clone(),
            ionosphere: vector.clone(),
            troposphere: vector,
            rates: Rates::new(signals),
            memory_s: 0.0,
        }
    }

    /// Takes a range; they come satellite by satellite. `choice`: whether the receiver combines bands, and
    /// the deviation of its models.
    fn take(&mut self, range: Forecast, choice: (bool, f64)) {
        if self.pending.first().is_some_and(|first| first.sv != range.sv) {
            self.finish(choice);
        }
        self.pending.push(range);
    }

    /// Adds what the last satellite has: its two bands farthest apart as one, or all its ranges.
    fn finish(&mut self, (combines, model_sigma_m): (bool, f64)) {
        let own = std::mem::take(&mut self.pending);
        let pairs = own.iter().flat_map(|a| own.iter().map(move |b| (a, b)));
        let apart = |(a, b): &(&Forecast, &Forecast)| a.carrier_hz / b.carrier_hz - 1.0;
        let widest = pairs.max_by(|one, other| apart(one).total_cmp(&apart(other)));
        let ranges = match widest.filter(|pair| combines && apart(pair) >= SAME_BAND) {
            Some((first, second)) => vec![combined(first, second)],
            None => own,
        };
        let used = || ranges.iter().filter(|range| !range.excluded);
        self.least += u32::from(used().any(|range| !range.near_mask));
        self.most += u32::from(used().next().is_some());
        ranges.iter().for_each(|range| self.add(range, model_sigma_m));
    }

    fn add(&mut self, range: &Forecast, model_sigma_m: f64) {
        let mut row = DVector::zeros(self.bias.len());
        let common = row.len() - COMMON;
        row.fixed_rows_mut::<3>(0).copy_from(&-range.sight);
        row.fixed_rows_mut::<COMMON>(common).copy_from(&range.air.common_m);
        if let Some(slot) = row.get_mut(3 + range.clock) {
            *slot = 1.0;
        }
        let model_m = model_sigma_m * range.slant;
        let variance = range.noise_m2() + model_m * model_m + range.air.own_m2;
        let spread_m2 = variance + range.air.common_m.norm_squared();
        self.faulty |= range.other_m2 >= variance || range.bias_m.abs() >= FAULT * spread_m2.sqrt();
        if range.excluded {
            self.blameless += 1;
            return;
        }
        self.unsteady |= !range.steady;
        self.fading |= range.fading;
        let weight = 1.0 / variance;
        self.normal.ger(weight, &row, &row, 1.0);
        self.plain.ger(1.0, &row, &row, 1.0);
        self.noise.ger(weight * weight * (range.noise_m2() + range.other_m2), &row, &row, 1.0);
        let bias = if range.stepping { &mut self.stepping } else { &mut self.bias };
        bias.axpy(weight * range.bias_m, &row, 1.0);
        self.ionosphere.axpy(weight * range.air.delay_m, &row, 1.0);
        self.troposphere.axpy(weight * range.troposphere_m, &row, 1.0);
        self.rates.add(range);
        self.memory_s = self.memory_s.max(range.memory_s);
    }
}

/// Expected errors of one fix: east, north, up and clock, in the sign of the receiver's clock bias.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Least and most satellites that it should use.
    pub satellites: (u32, u32),
    /// Satellites that the fix leaves out though nothing is wrong with them.
    pub blameless: u32,
    /// Known bias, metres.
    pub bias: Vector4<f64>,
    /// Additional error that is allowed in either direction, metres.
    pub allowed: Vector4<f64>,
    /// Covariance of all that may vary, m².
    pub noise: Matrix4<f64>,
    /// Covariance of what varies within a run, m².
    pub thermal: Matrix4<f64>,
    /// Covariance that should be stated, m².
    pub stated: Matrix4<f64>,
    /// Cofactors without weights: squares of the dilutions.
    pub dilution: Matrix4<f64>,
    /// Ratio of the extreme singular values of the geometry, all clocks counted.
    pub condition: f64,
    /// True if the ionospheric correction is known.
    pub corrected: bool,
    /// True if every satellite's C/N0 was measured at its true value, on which the stated covariance depends.
    pub steady: bool,
    /// True if a signal of the fix fades. Its rate is then unknown.
    pub fading: bool,
    /// Correlation time of a fix's noise, seconds.
    pub memory_s: f64,
    /// Covariance of velocity and of c times the drift, (m/s)².
    pub rate_noise: Matrix4<f64>,
    /// Error of the rates that the atmosphere may add in either direction, m/s.
    pub rate_allowed: Vector4<f64>,
}

/// Expected offset of one more clock of a fix: the lag of its time scale behind that of the fix, in the sign
/// of the receiver's biases.
#[derive(Clone, Copy, Debug)]
pub struct Offset {
    /// Index of the time scale in [`Scene::scales`].
    pub scale: usize,
    /// Known bias, metres.
    pub bias_m: f64,
    /// Additional error that is allowed in either direction, metres.
    pub allowed_m: f64,
    /// Standard deviation of all that may vary, metres.
    pub sigma_m: f64,
    /// Standard deviation that should be stated of the clock itself, metres.
    pub stated_m: f64,
}

/// Share by which computed biases may be wrong: weights differ with the measured C/N0.
const BIAS_SHARE: f64 = 0.1;
/// Share of the true troposphere by which a standard atmosphere errs: 5 % or 12 cm at the zenith, the spread
/// of the wet delay (Saastamoinen 1972 against weather).
const TROPOSPHERE_SHARE: f64 = 0.05;

/// Shows `see` the expectations of all fixes that have a truth and enough satellites, in the order of their
/// samples: each with its fix, the true position, and what is expected of clocks beyond the first.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read, and those of `see`.
pub fn expected(
    scene: &Scene<'_>,
    errors: &Errors,
    mut see: impl FnMut(Fix, TrajectoryRow, Expected, &[Offset]) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    let choice = (scene.choices.combined, scene.choices.model_sigma_m);
    let mut links = Vec::new();
    for link in errors.signals.keys() {
        links.extend(scene.ranges(errors, link)?);
    }
    let mut places = scene.run.trajectory.finder()?;
    for fix in scene.run.fixes.in_order()? {
        let (fix, mut sums) = (fix?, Sums::new(scene.scales.len().max(1), scene.run.signals.len()));
        let place = places.get(fix.sample);
        for ranges in &mut links {
            ranges.of_fix(&fix, place.as_ref(), |range| sums.take(range, choice))?;
        }
        sums.finish(choice);
        let corrected = fix.ionosphere != IonosphereModel::Grid;
        if let (Some(place), Some((expected, offsets))) = (place, one(fix.sample, &sums, corrected, &scene.unshared)) {
            see(fix, place, expected, &offsets)?;
        }
    }
    Ok(())
}

/// Two bands as one range; what is of the carrier and of the satellite is the first one's, the higher.
///
/// One filter smooths the combination, and it begins when both carriers have lock. It has the age of the
/// younger filter of the two, whose share of the variance is the larger. What parts code and carrier cancels
/// in the combination, here only as far as both filters lag alike: a band that is found 12 s after the other
/// leaves centimetres.
fn combined(first: &Forecast, second: &Forecast) -> Forecast {
    let square = |range: &Forecast| range.carrier_hz * range.carrier_hz;
    let a = square(first) / (square(first) - square(second));
    let b = 1.0 - a;
    Forecast {
        // Without the model's correction, which combined ranges do not get.
        bias_m: a * (first.bias_m + first.air.delay_m) + b * (second.bias_m + second.air.delay_m),
        air: Air::default(),
        code_m2: a * a * first.code_m2 + b * b * second.code_m2,
        variance_ratio: first.variance_ratio.max(second.variance_ratio),
        other_m2: a * a * first.other_m2 + b * b * second.other_m2,
        memory_s: first.memory_s.min(second.memory_s),
        steady: first.steady && second.steady,
        near_mask: first.near_mask || second.near_mask,
        excluded: first.excluded || second.excluded,
        ..*first
    }
}

fn one(sample: u64, sums: &Sums, corrected: bool, unshared: &Unshared) -> Option<(Expected, Vec<Offset>)> {
    if sums.most < 4 {
        return None;
    }
    // Clocks without ranges are not estimated.
    let common = sums.bias.len() - COMMON;
    let places: Vec<usize> = (0..common).filter(|place| sums.plain[(*place, *place)] > 0.0).collect();
    let with_common: Vec<usize> = places.iter().copied().chain(common..sums.bias.len()).collect();
    let selected = |matrix: &DMatrix<f64>, places: &[usize]| matrix.select_rows(places).select_columns(places);
    let plain = selected(&sums.plain, &places);
    let geometry = plain.symmetric_eigenvalues();
    let whole = Cholesky::new(selected(&sums.normal, &with_common))?.inverse();
    let solved = |right: &DVector<f64>| &whole * right.select_rows(&with_common);
    let thermal = &whole * selected(&sums.noise, &with_common) * &whole;
    let stated = whole.clone();
    let bias = solved(&sums.bias);
    let (ionosphere, stepping) = (solved(&sums.ionosphere), solved(&sums.stepping));
    let weather = TROPOSPHERE_SHARE * solved(&sums.troposphere);
    // A grid may leave any part of the ionosphere.
    let (centre, missing, noise) = if corrected {
        let none = DVector::zeros(bias.len());
        (bias, [none.clone(), none], &thermal)
    } else {
        (DVector::zeros(bias.len()), [bias, ionosphere], &stated)
    };
    let allowed = |of: &dyn Fn(&DVector<f64>) -> f64| {
        let sizes = [&weather, &missing[0], &missing[1], &stepping].map(|vector| of(vector).abs());
        sizes.iter().sum::<f64>() + BIAS_SHARE * of(&centre).abs()
    };
    let offset = |place: usize| Offset {
        scale: places[place] - 3,
        bias_m: centre[place] - centre[3],
        allowed_m: allowed(&|vector| vector[place] - vector[3]),
        sigma_m: (noise[(place, place)] + noise[(3, 3)] - 2.0 * noise[(place, 3)]).max(0.0).sqrt(),
        stated_m: stated[(place, place)].sqrt(),
    };
    let offsets = (4..places.len()).map(offset).collect();
    // Of all clocks the first is the fix's.
    let of = |matrix: &DMatrix<f64>| matrix.fixed_view::<4, 4>(0, 0).into_owned();
    let (rate_noise, rate_allowed) = sums.rates.solved(unshared)?;
    let expected = Expected {
        sample,
        satellites: (sums.least, sums.most),
        blameless: if sums.faulty || !corrected { 0 } else { sums.blameless },
        bias: centre.fixed_rows::<4>(0).into_owned(),
        allowed: Vector4::from_fn(|axis, _| allowed(&|vector| vector[axis])),
        noise: of(noise),
        thermal: of(&thermal),
        stated: of(&stated),
        dilution: of(&Cholesky::new(plain)?.inverse()),
        condition: (geometry.max() / geometry.min()).sqrt(),
        corrected,
        steady: !sums.unsteady,
        fading: sums.fading,
        memory_s: sums.memory_s,
        rate_noise,
        rate_allowed,
    };
    Some((expected, offsets))
}

impl Expected {
    /// Words of a spilled one, its sample left out.
    pub(in crate::judge) const WORDS: usize = 4 + 5 * 16 + 3 * 4 + 2;

    /// Appends them.
    pub(in crate::judge) fn put(&self, words: &mut Vec<u64>) {
        let flags = [self.corrected, self.steady, self.fading].map(u64::from);
        words.extend([self.satellites.0, self.satellites.1, self.blameless].map(u64::from));
        words.push(flags[0] | flags[1] << 1 | flags[2] << 2);
        for matrix in [&self.noise, &self.thermal, &self.stated, &self.dilution, &self.rate_noise] {
            words.extend(matrix.iter().map(|value| value.to_bits()));
        }
        for vector in [&self.bias, &self.allowed, &self.rate_allowed] {
            words.extend(vector.iter().map(|value| value.to_bits()));
        }
        words.extend([self.condition, self.memory_s].map(f64::to_bits));
    }

    /// The one of those words.
    pub(in crate::judge) fn take(sample: u64, words: &mut Words<'_>) -> Self {
        // Counts were put as such.
        let mut count = || u32::try_from(words.word()).unwrap_or(0);
        let (satellites, blameless) = ((count(), count()), count());
        let flags = words.word();
        let mut matrix = || Matrix4::from_iterator(std::iter::repeat_with(|| words.number()).take(16));
        let [noise, thermal, stated, dilution, rate_noise] = std::array::from_fn(|_| matrix());
        let mut vector = || Vector4::from_iterator(std::iter::repeat_with(|| words.number()).take(4));
        let [bias, allowed, rate_allowed] = std::array::from_fn(|_| vector());
        let [condition, memory_s] = std::array::from_fn(|_| words.number());
        Self {
            sample,
            satellites,
            blameless,
            bias,
            allowed,
            noise,
            thermal,
            stated,
            dilution,
            condition,
            corrected: flags & 1 != 0,
            steady: flags & 2 != 0,
            fading: flags & 4 != 0,
            memory_s,
            rate_noise,
            rate_allowed,
        }
    }

    /// True if that many satellites are all that should be used.
    pub fn is_whole(&self, satellites: u32) -> bool {
        (self.satellites.0..=self.satellites.1).contains(&satellites)
    }

    /// Deviation along the longest axis of the horizontal noise.
    pub fn flat_sigma_m(&self) -> f64 {
        self.noise.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max().max(0.0).sqrt()
    }

    /// Deviation along the longest axis of the noise of a velocity, which no axis of the coordinates need be
    /// near.
    pub fn rate_sigma_mps(&self) -> f64 {
        self.rate_noise.fixed_view::<3, 3>(0, 0).symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::expect::smoothing::Smoothing;
    use gnss::satellite::Sv;

    const L1_HZ: f64 = 1_575.42e6;
    const L5_HZ: f64 = 1_176.45e6;

    fn range(number: u8, carrier_hz: f64, near_mask: bool, excluded: bool) -> Forecast {
        Forecast {
            sv: Sv::gps(number),
            signal: 0,
            clock: 0,
            carrier_hz,
            sight: Vector3::new(0.6, 0.0, 0.8),
            bias_m: 0.0,
            stepping: false,
            air: Air::default(),
            troposphere_m: 0.0,
            code_m2: 1.0,
            variance_ratio: 1.0,
            short_m2: 0.0,
            other_m2: 0.0,
            memory_s: 0.0,
            rate_sigma_mps: 0.0,
            rate_bias_mps: 0.0,
            cn0_hz: 1e4,
            steady: true,
            fading: false,
            slant: 1.25,
            near_mask,
            excluded,
        }
    }

    #[test]
    fn a_satellite_counts_once_whatever_it_sends_and_only_if_one_of_its_ranges_is_used() {
        let all = [
            // Three ranges of one, two of one at the mask, one of two left out, both of one left out.
            range(1, L1_HZ, false, false),
            range(1, L1_HZ, false, false),
            range(1, L5_HZ, false, false),
            range(2, L1_HZ, true, false),
            range(2, L5_HZ, true, false),
            range(3, L1_HZ, false, true),
            range(3, L5_HZ, false, false),
            range(4, L1_HZ, false, true),
            range(4, L5_HZ, false, true),
        ];
        // A combination of two is left out with either.
        for (combines, expected) in [(false, (2, 3)), (true, (1, 2))] {
            let mut sums = Sums::new(1, 1);
            all.iter().for_each(|range| sums.take(*range, (combines, 0.5)));
            sums.finish((combines, 0.5));
            assert_eq!((sums.least, sums.most), expected, "{combines}");
        }
    }

    #[test]
    fn a_combination_is_as_smooth_as_one_filter_of_both_bands_though_one_of_them_was_found_later_or_lost() {
        let filter = || Smoothing::new(30.0, 0.5);
        let (mut one, mut two, mut both) = (filter(), filter(), filter());
        let (gain, rest) = (2.26 * 2.26, 1.26 * 1.26);
        for tenth in 0..900 {
            let time_s = 0.1 * f64::from(tenth);
            // The second band comes 12 s later, the first breaks at 50 s.
            let locked_s = [if tenth < 500 { time_s + 1.0 } else { time_s - 49.9 }, time_s - 11.9];
            let first = one.take(time_s, locked_s[0], 0.0);
            if tenth < 120 {
                continue;
            }
            let second = two.take(time_s, locked_s[1], 0.0);
            let pair = both.take(time_s, locked_s[0].min(locked_s[1]), 0.0);
            let of = |carrier_hz: f64, code_m2: f64, smooth: crate::expect::smoothing::Smoothed| Forecast {
                code_m2,
                variance_ratio: smooth.variance_ratio,
                memory_s: smooth.memory_s,
                short_m2: 4.0,
                ..range(1, carrier_hz, false, false)
            };
            let found = combined(&of(L1_HZ, 0.1, first), &of(L5_HZ, 0.4, second));
            // The elements are the satellite's, not a band's.
            let expected_m2 = (gain * 0.1 + rest * 0.4) * pair.variance_ratio + 4.0;
            assert!((found.noise_m2() / expected_m2 - 1.0).abs() < 2e-3, "{time_s} s: {found:?}, {expected_m2} m²");
            assert!((found.memory_s / pair.memory_s - 1.0).abs() < 1e-9, "{time_s} s");
        }
    }

    #[test]
    fn the_longest_axis_of_a_covariance_need_not_be_a_coordinate_s() {
        let mut sums = Sums::new(1, 1);
        let sights = [[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.0, -0.8, 0.6], [0.0, 0.0, 1.0]];
        for (number, [east, north, up]) in (1..).zip(sights) {
            let sight = Vector3::new(east, north, up);
            sums.take(Forecast { sight, rate_sigma_mps: 0.1, ..range(number, L1_HZ, false, false) }, (false, 0.5));
        }
        sums.finish((false, 0.5));
        let (mut expected, _) = one(0, &sums, true, &Unshared::default()).unwrap();
        // 3 m/s along the diagonal of the cube, 1 m/s across it: √(1 + 8/3) along each coordinate.
        let diagonal = Vector3::new(1.0, 1.0, 1.0) / 3.0_f64.sqrt();
        let turned = nalgebra::Matrix3::identity() + 8.0 * diagonal * diagonal.transpose();
        expected.rate_noise.fixed_view_mut::<3, 3>(0, 0).copy_from(&turned);
        assert!((expected.rate_sigma_mps() - 3.0).abs() < 1e-9, "{}", expected.rate_sigma_mps());
        // 2 m towards north-east, 1 m across: √2.5 along either.
        expected.noise.fixed_view_mut::<2, 2>(0, 0).copy_from(&nalgebra::Matrix2::new(2.5, 1.5, 1.5, 2.5));
        assert!((expected.flat_sigma_m() - 2.0).abs() < 1e-9, "{}", expected.flat_sigma_m());
    }
}
