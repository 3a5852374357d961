//! Carriers of the elements of an array, satellite by satellite, and what follows from them at the end of
//! each interval: attitude, phases of channels, and a test of the directions.
//!
//! Of each satellite the sums `v` of all elements over code periods give `Σ v vᴴ`, which bits do not
//! touch. Less the covariance of the samples themselves, jammers among them, its principal vector is the
//! answer of the elements to the satellite's wave. With ρ the ratio of signal to noise of one element's
//! sum a phase of M sums scatters by `sqrt((1 + 1/(Nρ)) / (2Mρ))`. The residuals of the best rotation are
//! chi-square under a clean sky; signals that come from elsewhere than their satellites, as a spoofer's,
//! leave more (P. Y. Montgomery, T. E. Humphreys and B. M. Ledvina, Receiver-Autonomous Spoofing
//! Detection, ION GNSS 2009). Limits: the body turns little within an interval; noise is taken as equal in
//! all elements for the deviation of phases.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;

use super::attitude::{Body, Look, Solution};
use crate::settings::array::ArraySettings;
use crate::threshold::threshold;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{AttitudeRow, ElementRow};
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::time::Rate;

/// Iterations to the principal vector: 30 leave `0.3³⁰` of the others at a third of its eigenvalue.
const ITERATIONS: u32 = 30;
/// Largest deviation in radians of a phase that is compared: what noise or a jammer alone show as a signal
/// has `1/sqrt(2N)` and more, N elements.
const LARGEST_RAD: f64 = 0.15;
/// Smallest deviation in radians: rounding of samples without noise.
const SMALLEST_RAD: f64 = 1e-4;
/// Probability with which the latest attitude is given up although it is right.
const GIVEN_UP: f64 = 1e-6;

/// Sums of one signal over the running interval.
#[derive(Debug)]
struct Sum {
    /// Products of the elements' sums less those of noise.
    products: DMatrix<Complex64>,
    /// Mean power of noise in an element's sums, added up.
    noise: f64,
    periods: u32,
}

/// Result of an interval.
#[derive(Debug, Default)]
pub struct Compared {
    /// The attitude, where one rotation alone explains the phases.
    pub attitude: Option<AttitudeRow>,
    /// Phases of the channels, where there is an attitude.
    pub elements: Vec<ElementRow>,
    /// Sum of squares of the best rotation's residuals, and their degrees of freedom.
    pub tested: Option<(f64, usize)>,
}

/// Carriers of the elements over an interval.
#[derive(Debug)]
pub struct Compass {
    body: Body,
    rate: Rate,
    is_inverted: bool,
    interval_ms: u64,
    extra_rad: f64,
    /// Number of the running interval, and its first sample.
    number: u64,
    first: u64,
    sums: BTreeMap<Link, Sum>,
    latest: Option<Matrix3<f64>>,
}

impl Compass {
    /// A compass of elements that sample at `rate`; `None` where the settings ask for none.
    pub fn new(settings: &ArraySettings, rate: Rate, is_inverted: bool) -> Option<Self> {
        let interval_ms = u64::from(settings.attitude_ms);
        let body = (interval_ms > 0).then(|| Body::new(&settings.lever_arms_m)).flatten()?;
        Some(Self {
            body,
            rate,
            is_inverted,
            interval_ms,
            extra_rad: settings.phase_sigma_deg.to_radians(),
            number: 1,
            first: 0,
            sums: BTreeMap::new(),
            latest: None,
        })
    }

    /// Takes the sums of all elements over one code period of a signal, and the covariance of their noise.
    pub fn take(&mut self, link: Link, sums: &DVector<Complex64>, noise: &DMatrix<Complex64>) {
        let count = self.body.elements();
        let blank = || Sum { products: DMatrix::zeros(count, count), noise: 0.0, periods: 0 };
        let sum = self.sums.entry(link).or_insert_with(blank);
        sum.products.gerc(Complex64::ONE, sums, sums, Complex64::ONE);
        sum.products -= noise;
        sum.noise += noise.trace().re / count as f64;
        sum.periods += 1;
    }

    /// Forgets the running interval.
    pub fn interrupt(&mut self) {
        self.sums.clear();
    }

    /// True if the running interval ends at or before a sample.
    pub fn is_due(&self, sample: u64) -> bool {
        sample >= self.rate.first_sample_at(self.number * self.interval_ms, 1000)
    }

    /// Ends the interval before a sample, with the satellites' directions in east, north and up.
    pub fn close(&mut self, sample: u64, towards: &BTreeMap<Sv, Vector3<f64>>) -> Compared {
        let middle = self.first + (sample - self.first) / 2;
        let interval = self.rate.first_sample_at(self.interval_ms, 1000).max(1);
        (self.first, self.number) = (sample, sample / interval + 1);
        let mut kinds: Vec<&'static str> = Vec::new();
        let mut looks = Vec::new();
        for (link, sum) in std::mem::take(&mut self.sums) {
            let Some(towards) = towards.get(&link.sv) else { continue };
            let Some((phasors, sigma_rad)) = self.phasors(&sum) else { continue };
            let name = link.signal.name;
            let kind = kinds.iter().position(|known| *known == name).unwrap_or_else(|| {
                kinds.push(name);
                kinds.len() - 1
            });
            let radians_per_m = TAU * link.carrier_hz() / SPEED_OF_LIGHT_MPS;
            let radians_per_m = planted!("receiver.array.attitude", radians_per_m, -radians_per_m);
            looks.push(Look { kind, towards: *towards, radians_per_m, phasors, sigma_rad });
        }
        let unknowns = 3 + kinds.len() * (self.body.elements() - 1);
        let freedom = (looks.len() * (self.body.elements() - 1)).saturating_sub(unknowns);
        let limit = if freedom > 0 { threshold(GIVEN_UP, freedom as u32) } else { 0.0 };
        let Some(found) = self.body.solve(&looks, self.latest.as_ref(), limit) else { return Compared::default() };
        let tested = Some((found.chi_square, found.freedom));
        if !found.is_unique || found.chi_square > limit {
            self.latest = None;
            return Compared { tested, ..Compared::default() };
        }
        self.latest = Some(found.rotation);
        let elements = kinds.iter().zip(&found.phases_rad).flat_map(|(name, phases)| {
            (2..).zip(phases).map(|(element, (phase_rad, sigma_rad))| ElementRow {
                sample: middle,
                signal: (*name).to_owned(),
                element,
                phase_deg: phase_rad.to_degrees(),
                sigma_deg: sigma_rad.to_degrees(),
            })
        });
        Compared { attitude: Some(row(middle, &found, looks.len())), elements: elements.collect(), tested }
    }

    /// Phasors of the elements against the first one, and the deviation of each phase; `None` where it is too
    /// large.
    fn phasors(&self, sum: &Sum) -> Option<(Vec<Complex64>, f64)> {
        let count = self.body.elements() as f64;
        let mut vector: DVector<Complex64> = sum.products.column(0).into_owned();
        for _ in 0..ITERATIONS {
            let next = &sum.products * &vector;
            let size = next.norm();
            if !(size.is_finite() && size > 0.0) {
                return None;
            }
            vector = next / Complex64::from(size);
        }
        let most = vector.dotc(&(&sum.products * &vector)).re;
        let ratio = most / (count * sum.noise.max(f64::MIN_POSITIVE));
        if !(most > 0.0 && ratio.is_finite()) {
            return None;
        }
        let noise_rad2 = (1.0 + 1.0 / (count * ratio)) / (2.0 * f64::from(sum.periods) * ratio);
        let first = vector.iter().next()?.conj();
        let unit = |x: &Complex64| {
            let x = if self.is_inverted { (x * first).conj() } else { x * first };
            (x.norm() > 0.0).then(|| x / x.norm())
        };
        let phasors: Vec<Complex64> = vector.iter().map(unit).collect::<Option<_>>()?;
        let sigma_rad = (noise_rad2 + self.extra_rad * self.extra_rad).sqrt().max(SMALLEST_RAD);
        (sigma_rad <= LARGEST_RAD).then_some((phasors, sigma_rad))
    }
}

fn row(sample: u64, found: &Solution, signals: usize) -> AttitudeRow {
    let [nose, right, down] = [0, 1, 2].map(|axis| found.rotation.column(axis).into_owned());
    let level = libm::hypot(nose.x, nose.y);
    let [sigma_east_deg, sigma_north_deg, sigma_up_deg] = found.sigmas_rad.map(f64::to_degrees);
    AttitudeRow {
        sample,
        yaw_deg: libm::atan2(nose.x, nose.y).to_degrees().rem_euclid(360.0),
        pitch_deg: libm::atan2(nose.z, level).to_degrees(),
        roll_deg: libm::atan2(-right.z, -down.z).to_degrees(),
        sigma_east_deg,
        sigma_north_deg,
        sigma_up_deg,
        signals,
        chi_square: found.chi_square,
        freedom: found.freedom,
    }
}
