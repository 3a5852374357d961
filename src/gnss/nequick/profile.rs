//! Electrons at a position: three Epstein layers up to the peak, one semi-Epstein layer above.

use nalgebra::Vector3;

use super::EARTH_KM;
use super::maps::{Maps, modip_deg};

/// Height of the E layer's peak, in kilometres (2.5.5.5).
const E_PEAK_KM: f64 = 120.0;
/// Height in kilometres below which the layers decrease like a Chapman layer (2.5.6.2).
const BOTTOM_KM: f64 = 100.0;
/// Zenith angle at which day passes into night, in degrees (2.5.4.7).
const TWILIGHT_DEG: f64 = 86.232_927_962_116_15;
/// Electrons per cubic metre in the unit of densities.
const DENSITY: f64 = 1e11;

/// State that is common to all positions: the Sun, and the maps for its time and strength.
#[derive(Clone, Debug)]
pub struct Sun {
    month: u8,
    ut_h: f64,
    ionisation_sfu: f64,
    sunspots: f64,
    /// Sine and cosine of its declination.
    declination: (f64, f64),
    maps: Maps,
}

impl Sun {
    /// Creates the state for a `month` (1 to 12), `ut_h` hours of the day, and the effective ionisation in
    /// solar flux units.
    pub fn new(month: u8, ut_h: f64, ionisation_sfu: f64) -> Self {
        // ITU-R P.371 (2.5.4.4).
        let sunspots = (167_273.0 + (ionisation_sfu - 63.7) * 1123.6).max(0.0).sqrt() - 408.99;
        // The middle of the month represents its days (2.5.4.5).
        let day = 30.5 * f64::from(month) - 15.0 + (18.0 - ut_h) / 24.0;
        let anomaly_rad = (0.9856 * day - 3.289).to_radians();
        let wobble_deg = 1.916 * libm::sin(anomaly_rad) + 0.020 * libm::sin(2.0 * anomaly_rad) + 282.634;
        let sine = 0.39782 * libm::sin(anomaly_rad + wobble_deg.to_radians());
        Self {
            month,
            ut_h,
            ionisation_sfu,
            sunspots,
            declination: (sine, (1.0 - sine * sine).sqrt()),
            maps: Maps::new(month, ut_h, sunspots),
        }
    }

    /// Electrons in a cubic metre at a position on the document's sphere, in kilometres from its centre.
    pub fn electrons_per_m3(&self, place_km: &Vector3<f64>) -> f64 {
        let radius_km = place_km.norm();
        let sin_latitude = (place_km.z / radius_km).clamp(-1.0, 1.0);
        let longitude_rad = libm::atan2(place_km.y, place_km.x);
        let layers = self.layers(sin_latitude, longitude_rad);
        DENSITY * layers.density(radius_km - EARTH_KM)
    }

    /// The layers at a position.
    fn layers(&self, sin_latitude: f64, longitude_rad: f64) -> Layers {
        let cos_latitude = (1.0 - sin_latitude * sin_latitude).sqrt();
        let latitude_rad = libm::atan2(sin_latitude, cos_latitude);
        let e_mhz = self.e_mhz((sin_latitude, cos_latitude), latitude_rad, longitude_rad);
        let (f2_mhz, factor) = self.maps.at(modip_deg(latitude_rad, longitude_rad), cos_latitude, longitude_rad);
        let f1_mhz = f1_mhz(e_mhz, f2_mhz);
        let f2_km = f2_peak_km(factor, f2_mhz, e_mhz);
        let f1_km = 0.5 * (E_PEAK_KM + f2_km);
        let steepness = 0.01 * libm::exp(-3.467 + 0.857 * libm::log(f2_mhz * f2_mhz) + 2.02 * libm::log(factor));
        let (f1_below_km, f1_above_km) = (0.5 * (f1_km - E_PEAK_KM), 0.3 * (f2_km - f1_km));
        let f2_below_km = 0.385 * density_of(f2_mhz) / steepness;
        let mut layers = Layers {
            e: Layer { peak_km: E_PEAK_KM, below_km: 5.0, above_km: f1_below_km.max(7.0), amplitude: 0.0 },
            f1: Layer { peak_km: f1_km, below_km: f1_below_km, above_km: f1_above_km, amplitude: 0.0 },
            f2: Layer {
                peak_km: f2_km,
                below_km: f2_below_km,
                above_km: f2_below_km,
                amplitude: 4.0 * density_of(f2_mhz),
            },
            top_km: self.top_km(f2_km, f2_below_km, density_of(f2_mhz)),
        };
        layers.set_amplitudes(density_of(e_mhz), density_of(f1_mhz), f1_mhz);
        layers
    }

    /// Critical frequency of the E layer in megahertz (2.5.5.1).
    fn e_mhz(&self, (sin, cos): (f64, f64), latitude_rad: f64, longitude_rad: f64) -> f64 {
        // Cosine of the hour angle of the Sun.
        let local_rad = (15.0 * (self.ut_h - 12.0)).to_radians() + longitude_rad;
        let cos_zenith = sin * self.declination.0 + cos * self.declination.1 * libm::cos(local_rad);
        let sin_zenith = (1.0 - cos_zenith * cos_zenith).max(0.0).sqrt();
        let zenith_deg = libm::atan2(sin_zenith, cos_zenith).to_degrees();
        let night_deg = 90.0 - 0.24 * exponential(20.0 - 0.20 * zenith_deg);
        let effective_deg = join(night_deg, zenith_deg, 12.0, zenith_deg - TWILIGHT_DEG);
        let season = match self.month {
            1 | 2 | 11 | 12 => -1.0,
            3 | 4 | 9 | 10 => 0.0,
            _ => 1.0,
        };
        // (e^x − 1)/(e^x + 1) with x = 0.3 of the latitude in degrees.
        let winter = season * libm::tanh(0.15 * latitude_rad.to_degrees());
        let strength = (1.112 - 0.019 * winter) * self.ionisation_sfu.sqrt().sqrt();
        let sunlit = exponential(0.3 * libm::log(libm::cos(effective_deg.to_radians())));
        libm::hypot(strength * sunlit, 0.7)
    }

    /// Thickness of the layer above the peak, in kilometres (2.5.5.7).
    fn top_km(&self, f2_km: f64, f2_below_km: f64, density: f64) -> f64 {
        let ratio = f2_km / f2_below_km;
        let shape = if (4..=9).contains(&self.month) {
            6.705 - 0.014 * self.sunspots - 0.008 * f2_km
        } else {
            -7.77 + 0.097 * ratio * ratio + 0.153 * density
        };
        let shape = join(shape, 2.0, 1.0, shape - 2.0);
        let shape = join(8.0, shape, 1.0, shape - 8.0);
        let first_km = shape * f2_below_km;
        let x = (first_km - 150.0) / 100.0;
        first_km / ((0.041_163 * x - 0.183_981) * x + 1.424_472)
    }
}

/// Critical frequency of the F1 layer in megahertz; 0 where there is none (2.5.5.2).
fn f1_mhz(e_mhz: f64, f2_mhz: f64) -> f64 {
    let by_day = join(1.4 * e_mhz, 0.0, 1000.0, e_mhz - 2.0);
    let above_e = join(0.0, by_day, 1000.0, e_mhz - by_day);
    let below_f2 = join(above_e, 0.85 * above_e, 60.0, 0.85 * f2_mhz - above_e);
    if below_f2 < 1e-6 { 0.0 } else { below_f2 }
}

/// Height of the F2 layer's peak, in kilometres (2.5.5.5).
fn f2_peak_km(factor: f64, f2_mhz: f64, e_mhz: f64) -> f64 {
    let square = factor * factor;
    let correction = if e_mhz < 1e-30 {
        -0.012
    } else {
        let ratio = f2_mhz / e_mhz;
        0.253 / (join(ratio, 1.75, 20.0, ratio - 1.75) - 1.215) - 0.012
    };
    let shape = ((0.0196 * square + 1.0) / (1.2967 * square - 1.0)).sqrt();
    1490.0 * factor * shape / (factor + correction) - 176.0
}

/// Density at a peak, in 1e11 electrons per cubic metre, of a critical frequency in megahertz.
fn density_of(mhz: f64) -> f64 {
    0.124 * mhz * mhz
}

/// An Epstein layer.
#[derive(Clone, Copy, Debug)]
struct Layer {
    peak_km: f64,
    below_km: f64,
    above_km: f64,
    /// Four times the density at the peak.
    amplitude: f64,
}

impl Layer {
    fn thickness_km(&self, height_km: f64) -> f64 {
        if height_km > self.peak_km { self.above_km } else { self.below_km }
    }

    /// Density of the layer at a height, such as another layer's peak, expressed as an amplitude.
    fn amplitude_at(&self, height_km: f64) -> f64 {
        let e = exponential((height_km - self.peak_km) / self.thickness_km(height_km));
        4.0 * self.amplitude * e / ((1.0 + e) * (1.0 + e))
    }

    /// Density and its relative slope per kilometre. The argument is multiplied by `sharpness`.
    fn density(&self, height_km: f64, above_km: f64, sharpness: f64) -> (f64, f64) {
        let thickness_km = self.thickness_km(above_km);
        let x = sharpness * (height_km - self.peak_km) / thickness_km;
        if x.abs() > 25.0 {
            return (0.0, 0.0);
        }
        let e = libm::exp(x);
        (self.amplitude * e / ((1.0 + e) * (1.0 + e)), (1.0 - e) / (1.0 + e) / thickness_km)
    }
}

/// The layers at a position.
#[derive(Clone, Copy, Debug)]
struct Layers {
    e: Layer,
    f1: Layer,
    f2: Layer,
    /// Thickness above the peak, in kilometres.
    top_km: f64,
}

impl Layers {
    /// Amplitudes with which the sum of all has the wanted densities at the peaks (2.5.5.6).
    fn set_amplitudes(&mut self, e: f64, f1: f64, f1_mhz: f64) {
        let e_alone = 4.0 * e - self.f2.amplitude_at(self.e.peak_km);
        if f1_mhz < 0.5 {
            self.e.amplitude = e_alone;
        } else {
            let f1_alone = 4.0 * f1 - self.f2.amplitude_at(self.f1.peak_km);
            self.e.amplitude = 4.0 * e;
            for _ in 0..5 {
                let rest = f1_alone - self.e.amplitude_at(self.f1.peak_km);
                self.f1.amplitude = join(rest, 0.8 * f1, 1.0, rest - 0.8 * f1);
                self.e.amplitude = e_alone - self.f1.amplitude_at(self.e.peak_km);
            }
        }
        self.e.amplitude = join(self.e.amplitude, 0.05, 60.0, self.e.amplitude - 0.005);
    }

    /// Electrons at a height, in 1e11 per cubic metre (2.5.6).
    fn density(&self, height_km: f64) -> f64 {
        let above_km = height_km - self.f2.peak_km;
        if above_km <= 0.0 {
            return self.below_peak(height_km);
        }
        let stretch = 1.0 + 100.0 * 0.125 * above_km / (100.0 * self.top_km + 0.125 * above_km);
        let e = exponential(above_km / (self.top_km * stretch));
        let share = if e > 1e11 { 1.0 / e } else { e / ((1.0 + e) * (1.0 + e)) };
        4.0 * share * self.below_peak(self.f2.peak_km)
    }

    fn below_peak(&self, height_km: f64) -> f64 {
        let height_in_km = height_km.max(BOTTOM_KM);
        let sharpness = libm::exp(10.0 / (1.0 + (height_in_km - self.f2.peak_km).abs()));
        let parts = [(&self.f2, 1.0), (&self.f1, sharpness), (&self.e, sharpness)]
            .map(|(layer, sharpness)| layer.density(height_in_km, height_km, sharpness));
        let sum: f64 = parts.iter().map(|part| part.0).sum();
        if height_km >= BOTTOM_KM {
            return sum;
        }
        if sum <= 0.0 {
            return 0.0;
        }
        let slope = parts.iter().map(|(density, slope)| density * slope).sum::<f64>() / sum;
        let z = (height_km - BOTTOM_KM) / 10.0;
        sum * exponential(1.0 - (1.0 - 10.0 * slope) * z - exponential(-z))
    }
}

/// The document's exponential, which neither overflows nor vanishes.
fn exponential(x: f64) -> f64 {
    libm::exp(x.clamp(-80.0, 80.0))
}

/// A smooth passage from `before` where x is far below zero to `after` above (2.5.7.2).
fn join(after: f64, before: f64, sharpness: f64, x: f64) -> f64 {
    let e = exponential(sharpness * x);
    (after * e + before) / (e + 1.0)
}
