//! The truth as a function of GPS time, for receivers that label their epochs with a clock of their own.
//!
//! Files give it at samples; their true GPS times are in `trajectory.csv`. The sampler's clock is taken
//! out, so that what is left is what a receiver with a perfect clock would have seen. Between rows a cubic
//! through values and rates (Hermite): its error is h⁴/384 of the fourth derivative. It is measured here, not
//! assumed: a row is predicted from its neighbours, 2h apart, and a sixteenth of what that misses is the
//! error in the middle of an interval. Limits: a step of acceleration between two rows costs a·h²/62 and
//! shows in that figure.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::error::JudgeError;
use crate::expect::multiple_access::MultipleAccess;
use crate::read::Run;
use crate::statistics::median;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Link;
use gnss::time::Epoch;

/// A satellite's signal at an instant, by a perfect clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Speed of light times (GPS time − time sent).
    pub range_m: f64,
    /// Range in cycles of the carrier.
    pub carrier_cycles: f64,
    /// Minus the carrier's rate.
    pub doppler_hz: f64,
    /// True C/N0, dB-Hz.
    pub cn0_dbhz: f64,
    /// C/N0 with the other satellites and interference counted as noise, dB-Hz.
    pub effective_dbhz: f64,
    /// Elevation of the satellite, degrees.
    pub elevation_deg: f64,
}

/// A satellite's range and carrier, as in [`State`].
#[derive(Clone, Copy, Debug)]
struct Ray {
    range_m: f64,
    carrier_cycles: f64,
    doppler_hz: f64,
}

/// Strength and elevation of a satellite, as in [`State`].
#[derive(Clone, Copy, Debug)]
struct Seen {
    cn0_dbhz: f64,
    effective_dbhz: f64,
    elevation_deg: f64,
}

impl Seen {
    const UNKNOWN: Self = Self { cn0_dbhz: f64::NAN, effective_dbhz: f64::NAN, elevation_deg: f64::NAN };
}

/// Rays of one satellite at ascending times, and what is seen there; nothing of a single satellite's.
#[derive(Clone, Debug, Default)]
struct Track {
    nodes: Vec<(f64, Ray)>,
    seen: Vec<Seen>,
}

/// Antenna and sampler's clock at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position, Earth-fixed, metres.
    pub position_m: Vector3<f64>,
    /// Velocity, Earth-fixed, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Reading of the sampler's clock minus true time, seconds.
    pub clock_bias_s: f64,
    /// Rate of that bias, seconds a second.
    pub clock_drift: f64,
}

/// Largest errors of the interpolation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interpolation {
    /// Error of a range, metres.
    pub range_m: f64,
    /// Error of a carrier, cycles.
    pub carrier_cycles: f64,
    /// Error of a Doppler, Hz.
    pub doppler_hz: f64,
}

/// The truth of a run over GPS time.
pub struct Timeline {
    /// GPS time that all times here count from.
    pub origin: Epoch,
    interval_s: f64,
    tracks: BTreeMap<Link, Track>,
    /// Positions by time; empty for a timeline of a single satellite.
    places: Vec<(f64, Place)>,
    /// Largest errors of interpolation between rows.
    pub interpolation: Interpolation,
}

/// Steps beyond this many usual ones are gaps.
const GAP: f64 = 1.5;

impl Timeline {
    /// Timeline of a run's truth; `None` without a trajectory.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn new(run: &Run) -> Result<Option<Self>, JudgeError> {
        let Some(mut timeline) = Self::of_links(run, Some(&MultipleAccess::new(run)), run.truth.keys())? else {
            return Ok(None);
        };
        let origin = timeline.origin;
        timeline.places = run.trajectory.map(|row| {
            let place = Place {
                position_m: row.position_m(),
                velocity_mps: row.velocity_mps(),
                clock_bias_s: row.clock_bias_s,
                clock_drift: row.clock_drift,
            };
            (row.time().since(origin), place)
        })?;
        timeline.interpolation = timeline.missed();
        Ok(Some(timeline))
    }

    /// Timeline of one satellite's range and carrier alone, without the errors of its interpolation.
    ///
    /// # Errors
    ///
    /// Same as [`Self::new`].
    pub fn of(run: &Run, link: Link) -> Result<Option<Self>, JudgeError> {
        Self::of_links(run, None, std::iter::once(link))
    }

    fn of_links(
        run: &Run,
        access: Option<&MultipleAccess<'_>>,
        links: impl Iterator<Item = Link>,
    ) -> Result<Option<Self>, JudgeError> {
        let Some(first) = run.trajectory.first() else { return Ok(None) };
        // The nearest second: a clock that is a little ahead does not begin a second earlier.
        let origin = Epoch::new(first.gps_s, first.gps_fraction_s.round());
        let mut steps: Vec<f64> = run.trajectory.map(|row| row.time().since(origin))?;
        for index in 1..steps.len() {
            steps[index - 1] = steps[index] - steps[index - 1];
        }
        steps.pop();
        let interval_s = median(&steps).unwrap_or(1.0);
        drop(steps);
        let mut places = run.trajectory.finder()?;
        let mut tracks = BTreeMap::new();
        for link in links {
            let mut sky = run.seen_at(link.sv)?;
            let (mut nodes, mut seen) = (Vec::with_capacity(run.truth.count(&link)), Vec::new());
            run.truth.each(link, |row| {
                let Some(place) = places.get(row.sample) else { return };
                let carrier_hz = row.signal.carrier_hz(row.sv);
                let ray = Ray {
                    range_m: row.pseudorange_m - SPEED_OF_LIGHT_MPS * place.clock_bias_s,
                    carrier_cycles: row.carrier_cycles - carrier_hz * place.clock_bias_s,
                    // Rates by the sampler's clock become rates by GPS time.
                    doppler_hz: (row.doppler_hz + carrier_hz * place.clock_drift) / (1.0 - place.clock_drift),
                };
                nodes.push((place.time().since(origin), ray));
                if let Some(access) = access {
                    let sky = sky.as_mut().and_then(|sky| sky.get(row.sample));
                    seen.push(Seen {
                        cn0_dbhz: row.cn0_dbhz,
                        effective_dbhz: access.effective_dbhz(&row),
                        elevation_deg: sky.map_or(f64::NAN, |row| row.elevation_deg),
                    });
                }
            })?;
            tracks.insert(link, Track { nodes, seen });
        }
        Ok(Some(Self { origin, interval_s, tracks, places: Vec::new(), interpolation: Interpolation::default() }))
    }

    /// First and last time.
    pub fn span_s(&self) -> (f64, f64) {
        (self.places.first().map_or(0.0, |p| p.0), self.places.last().map_or(0.0, |p| p.0))
    }

    /// True if a time is less than a row before the first one or after the last one: samples continue there.
    pub fn is_at_edge(&self, t_s: f64) -> bool {
        let (from_s, to_s) = self.span_s();
        let near = |beyond_s: f64| (0.0..=1.01 * self.interval_s).contains(&beyond_s);
        (t_s < from_s && near(from_s - t_s)) || (t_s > to_s && near(t_s - to_s))
    }

    /// Interval of its rows.
    pub fn interval_s(&self) -> f64 {
        self.interval_s
    }

    /// Times over which each satellite is there without a gap.
    pub fn stretches_s(&self) -> BTreeMap<Link, Vec<(f64, f64)>> {
        let whole = |a: &(f64, Ray), b: &(f64, Ray)| b.0 - a.0 <= GAP * self.interval_s;
        let ends = |nodes: &[(f64, Ray)]| Some((nodes.first()?.0, nodes.last()?.0));
        let of = |track: &Track| track.nodes.chunk_by(whole).filter_map(ends).collect();
        self.tracks.iter().map(|(link, track)| (*link, of(track))).collect()
    }

    /// A satellite at a time; `None` where it is not there on both sides.
    pub fn state(&self, link: &Link, t_s: f64) -> Option<State> {
        let Track { nodes, seen } = self.tracks.get(link)?;
        let place = before(nodes, t_s)?;
        let (a, b) = (nodes.get(place)?, nodes.get(place + 1)?);
        let Ray { range_m, carrier_cycles, doppler_hz } =
            (b.0 - a.0 <= GAP * self.interval_s).then(|| between(link, a, b, t_s))?;
        let u = (t_s - a.0) / (b.0 - a.0);
        let line = |of: fn(&Seen) -> f64| {
            let [x, y] = [place, place + 1].map(|place| of(seen.get(place).unwrap_or(&Seen::UNKNOWN)));
            x + (y - x) * u
        };
        Some(State {
            range_m,
            carrier_cycles,
            doppler_hz,
            cn0_dbhz: line(|seen| seen.cn0_dbhz),
            effective_dbhz: line(|seen| seen.effective_dbhz),
            elevation_deg: line(|seen| seen.elevation_deg),
        })
    }

    /// Antenna and sampler's clock at a time within the truth.
    pub fn place(&self, t_s: f64) -> Option<Place> {
        let place = before(&self.places, t_s)?;
        let (a, b) = (self.places.get(place)?, self.places.get(place + 1)?);
        if b.0 - a.0 > GAP * self.interval_s {
            return None;
        }
        let h_s = b.0 - a.0;
        let cubic = Cubic::at((t_s - a.0) / h_s);
        let u = (t_s - a.0) / h_s;
        let line = |x: f64, y: f64| x + (y - x) * u;
        Some(Place {
            position_m: a.1.position_m * cubic.value[0]
                + a.1.velocity_mps * (cubic.value[1] * h_s)
                + b.1.position_m * cubic.value[2]
                + b.1.velocity_mps * (cubic.value[3] * h_s),
            velocity_mps: a.1.position_m * (cubic.rate[0] / h_s)
                + a.1.velocity_mps * cubic.rate[1]
                + b.1.position_m * (cubic.rate[2] / h_s)
                + b.1.velocity_mps * cubic.rate[3],
            clock_bias_s: line(a.1.clock_bias_s, b.1.clock_bias_s),
            clock_drift: line(a.1.clock_drift, b.1.clock_drift),
        })
    }

    /// Each row from its neighbours: what that misses falls with the fourth power of the step, of Doppler
    /// with the third.
    fn missed(&self) -> Interpolation {
        let mut worst = Interpolation::default();
        for (link, track) in &self.tracks {
            for three in track.nodes.windows(3) {
                let [a, b, c] = three else { continue };
                if c.0 - a.0 > 2.0 * GAP * self.interval_s {
                    continue;
                }
                let guess = between(link, a, c, b.0);
                worst.range_m = worst.range_m.max((guess.range_m - b.1.range_m).abs() / 16.0);
                worst.carrier_cycles =
                    worst.carrier_cycles.max((guess.carrier_cycles - b.1.carrier_cycles).abs() / 16.0);
                worst.doppler_hz = worst.doppler_hz.max((guess.doppler_hz - b.1.doppler_hz).abs() / 8.0);
            }
        }
        worst
    }
}

/// Something at a time.
type At<T> = (f64, T);

/// Index of the row before a time, if it has one after it.
fn before<T>(nodes: &[At<T>], t_s: f64) -> Option<usize> {
    let after = nodes.partition_point(|node| node.0 <= t_s);
    let after = if after == nodes.len() && nodes.last().is_some_and(|last| last.0 == t_s) { after - 1 } else { after };
    after.checked_sub(1).filter(|_| after < nodes.len())
}

/// Weights of value and rate at both ends of an interval of unit length, and those of the derivative.
struct Cubic {
    value: [f64; 4],
    rate: [f64; 4],
}

impl Cubic {
    fn at(u: f64) -> Self {
        let (u2, u3) = (u * u, u * u * u);
        Self {
            value: [2.0 * u3 - 3.0 * u2 + 1.0, u3 - 2.0 * u2 + u, 3.0 * u2 - 2.0 * u3, u3 - u2],
            rate: [6.0 * u2 - 6.0 * u, 3.0 * u2 - 4.0 * u + 1.0, 6.0 * u - 6.0 * u2, 3.0 * u2 - 2.0 * u],
        }
    }
}

fn between(link: &Link, a: &At<Ray>, b: &At<Ray>, t_s: f64) -> Ray {
    let h_s = b.0 - a.0;
    let u = (t_s - a.0) / h_s;
    let cubic = Cubic::at(u);
    // Differences from the first row keep the digits of a carrier of 1e8 cycles.
    let blend = |weights: &[f64; 4], rise: f64, rates: (f64, f64)| {
        weights[2] * rise + (weights[1] * rates.0 + weights[3] * rates.1) * h_s
    };
    let (near, far) = (&a.1, &b.1);
    let carrier_rise = far.carrier_cycles - near.carrier_cycles;
    let carrier_rates = (-near.doppler_hz, -far.doppler_hz);
    let wavelength_m = link.wavelength_m();
    let range_rise = far.range_m - near.range_m;
    let range_rates = (wavelength_m * carrier_rates.0, wavelength_m * carrier_rates.1);
    Ray {
        range_m: near.range_m + blend(&cubic.value, range_rise, range_rates),
        carrier_cycles: near.carrier_cycles + blend(&cubic.value, carrier_rise, carrier_rates),
        doppler_hz: -(cubic.rate[2] * carrier_rise / h_s
            + cubic.rate[1] * carrier_rates.0
            + cubic.rate[3] * carrier_rates.1),
    }
}
