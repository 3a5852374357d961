//! Rows that generator and receiver write and the judge joins, one CSV file for each kind.
//!
//! A row states *when* by sample number: the only clock that truth and estimate share without
//! agreeing on anything. Columns end with their unit; angles are in degrees in files, in radians nowhere.

mod array;
mod detection;
mod inertial;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::earth::Geodetic;
use crate::satellite::Sv;
use crate::signal::{Link, Signal, by_name};
use crate::time::{Epoch, GPST};
pub use array::{AttitudeRow, ElementRow};
pub use detection::{DetectionRow, Detector};
pub use inertial::{BodyRow, InertialRow};

/// Rows that belong to one signal of one satellite.
macro_rules! linked {
    ($($row:ty),*) => {$(
        impl $row {
            /// The signal that the row is about.
            pub fn link(&self) -> Link {
                Link { sv: self.sv, signal: self.signal }
            }
        }
    )*};
}

linked!(Observation, SkyRow, RayRow, AcquisitionRow, TrackingRow, EventRow);

/// Observation of one satellite's signal at one sample: `observations.csv`, from generator and receiver.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Observation {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal of the satellite.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// Transmission time by the satellite's clock, whole GPS seconds, for the wave that arrives at this
    /// sample. The clock is that of the signal (IS-GPS-200N, 20.3.3.3.3).
    pub sent_s: i64,
    /// Fraction of the transmission time, in seconds.
    pub sent_fraction_s: f64,
    /// Pseudorange in metres: speed of light times (time of reception by the receiver's clock − transmission
    /// time).
    pub pseudorange_m: f64,
    /// Accumulated carrier phase in cycles, growing with range (RINEX sense); the receiver's has an unknown
    /// whole number.
    pub carrier_cycles: f64,
    /// Doppler in Hz, positive when approaching (RINEX sense).
    pub doppler_hz: f64,
    /// Carrier power over noise density of the whole signal, in dB-Hz.
    pub cn0_dbhz: f64,
    /// Time in seconds since the carrier was locked without interruption; in the truth, since the satellite
    /// appeared.
    pub locked_s: f64,
}

impl Observation {
    /// Returns the transmission time by the satellite's clock.
    pub fn sent(&self) -> Epoch {
        Epoch::new(self.sent_s, self.sent_fraction_s)
    }
}

/// True position of a satellite as seen from the antenna: one row of `truth/sky.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SkyRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal to which the clock and the ionosphere delay refer.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// Azimuth from north over east, in degrees.
    pub azimuth_deg: f64,
    /// Elevation above the horizon, in degrees.
    pub elevation_deg: f64,
    /// Geometric range with light time and Earth rotation, in metres.
    pub range_m: f64,
    /// Satellite clock offset for that signal in metres, with relativity and group delay included.
    pub satellite_clock_m: f64,
    /// Group delay of the ionosphere on that signal, in metres.
    pub ionosphere_m: f64,
    /// Delay of the troposphere, in metres.
    pub troposphere_m: f64,
}

/// Cause for which a pass of a satellite begins or ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PassEnd {
    /// The scene itself, or the part of it that was made.
    Scene,
    /// The mask's elevation.
    Mask,
    /// The Earth, as seen from space.
    Earth,
    /// The navigation file: no ephemeris is sent before, or after.
    Ephemeris,
}

/// Interval in which a satellite is in the scene's sky, in whole seconds of the receiver's clock:
/// `truth/passes.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PassRow {
    /// The satellite.
    pub sv: Sv,
    /// First sample in view.
    pub sample: u64,
    /// The first sample out of view again.
    pub until_sample: u64,
    /// Cause of the beginning.
    pub begins_by: PassEnd,
    /// Cause of the end.
    pub ends_by: PassEnd,
}

/// Reflected ray beside the direct one: `truth/rays.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RayRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal of the satellite.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// Counted from 1; the direct ray is 0.
    pub ray: u32,
    /// Delay of its code against the direct ray's, in metres.
    pub excess_m: f64,
    /// Amplitude relative to the direct ray; 0 while there is no direct ray.
    pub amplitude_ratio: f64,
    /// Carrier phase ahead of the direct ray, in cycles, 0 to 1.
    pub phase_cycles: f64,
}

/// True position of the antenna and true clock offsets: one row of `truth/trajectory.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrajectoryRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// True GPS time of the sample, whole seconds since 1980.
    pub gps_s: i64,
    /// Fraction of the true GPS time, in seconds.
    pub gps_fraction_s: f64,
    /// ECEF position x, in metres.
    pub x_m: f64,
    /// ECEF position y, in metres.
    pub y_m: f64,
    /// ECEF position z, in metres.
    pub z_m: f64,
    /// ECEF velocity x, in m/s.
    pub vx_mps: f64,
    /// ECEF velocity y, in m/s.
    pub vy_mps: f64,
    /// ECEF velocity z, in m/s.
    pub vz_mps: f64,
    /// Offset of the receiver's clock from true time, in seconds.
    pub clock_bias_s: f64,
    /// Rate of that bias, s/s.
    pub clock_drift: f64,
}

impl TrajectoryRow {
    /// True GPS time of the sample.
    pub fn time(&self) -> Epoch {
        Epoch::new(self.gps_s, self.gps_fraction_s)
    }

    /// ECEF position, in metres.
    pub fn position_m(&self) -> Vector3<f64> {
        Vector3::new(self.x_m, self.y_m, self.z_m)
    }

    /// ECEF velocity, in m/s.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        Vector3::new(self.vx_mps, self.vy_mps, self.vz_mps)
    }
}

/// Position and time in geographic form: additional columns after those of a [`TrajectoryRow`] and a [`Fix`]
/// in their files. They are not read again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Geographic {
    /// Geodetic latitude, north positive, in degrees.
    pub latitude_deg: f64,
    /// Longitude, east positive, in degrees.
    pub longitude_deg: f64,
    /// Height above the ellipsoid of WGS 84, in metres.
    pub height_m: f64,
    /// UTC, ISO 8601.
    pub utc: String,
}

impl Geographic {
    /// Names of its columns.
    pub const COLUMNS: [&'static str; 4] = ["latitude_deg", "longitude_deg", "height_m", "utc"];

    /// Converts an ECEF position in metres at a time.
    pub fn of(position_m: &Vector3<f64>, time: Epoch) -> Self {
        let place = Geodetic::from_ecef(position_m);
        Self {
            latitude_deg: place.latitude_rad.to_degrees(),
            longitude_deg: place.longitude_rad.to_degrees(),
            height_m: place.height_m,
            utc: time.to_utc_text(),
        }
    }
}

/// A source of interference at one sample: `truth/interference.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InterferenceRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// Number of the source among the computed ones, from 1.
    pub source: usize,
    /// Mean power over a repetition, relative to the density of the thermal noise, in dB-Hz.
    pub jn0_dbhz: f64,
    /// Carrier frequency in the samples, in Hz, with Doppler and the receiver's clock included; beyond their
    /// band for a sweep whose middle lies there.
    pub frequency_hz: f64,
}

/// One position solution: `rx/fixes.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fix {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// Estimated GPS time of the sample, whole seconds since 1980.
    pub gps_s: i64,
    /// Fraction of the estimated GPS time, in seconds.
    pub gps_fraction_s: f64,
    /// Estimated ECEF position x, in metres.
    pub x_m: f64,
    /// Estimated ECEF position y, in metres.
    pub y_m: f64,
    /// Estimated ECEF position z, in metres.
    pub z_m: f64,
    /// Estimated ECEF velocity x, in m/s.
    pub vx_mps: f64,
    /// Estimated ECEF velocity y, in m/s.
    pub vy_mps: f64,
    /// Estimated ECEF velocity z, in m/s.
    pub vz_mps: f64,
    /// Offset of the receiver's clock from GPS time, in seconds.
    pub clock_bias_s: f64,
    /// Rate of that bias, s/s.
    pub clock_drift: f64,
    /// Formal standard deviation of the east coordinate, in metres.
    pub sigma_east_m: f64,
    /// Formal standard deviation of the north coordinate, in metres.
    pub sigma_north_m: f64,
    /// Formal standard deviation of the height, in metres.
    pub sigma_up_m: f64,
    /// Formal standard deviation of the clock offset times the speed of light, in metres.
    pub sigma_clock_m: f64,
    /// Formal correlations of east and north, east and up, north and up.
    pub correlation_en: f64,
    /// East and up.
    pub correlation_eu: f64,
    /// North and up.
    pub correlation_nu: f64,
    /// Geometric dilution of precision, position and clock.
    pub gdop: f64,
    /// Dilution of precision of the position.
    pub pdop: f64,
    /// Dilution of precision of the horizontal position.
    pub hdop: f64,
    /// Dilution of precision of the vertical position.
    pub vdop: f64,
    /// Dilution of precision of the clock.
    pub tdop: f64,
    /// Ratio of the extreme singular values of the geometry: 1 is the best, 10 000 and more is refused.
    pub condition: f64,
    /// Satellites in the solution.
    pub satellites: u32,
    /// Weighted sum of squared residuals; its degrees of freedom are [`Fix::freedom`].
    pub chi_square: f64,
    /// Satellites excluded by the residual test, separated by blanks.
    pub excluded: String,
    /// Ionosphere correction of the fix.
    pub ionosphere: IonosphereModel,
    /// Number of ranges in the solution; absent if the file does not state it.
    #[serde(default)]
    pub ranges: Option<u32>,
    /// Clocks that it estimates.
    #[serde(default)]
    pub clocks: Option<u32>,
    /// Time scale of `clock_bias_s` and of the fix's time: GPS time, or the scale of the only system.
    #[serde(default = "gpst")]
    pub time_scale: String,
}

fn gpst() -> String {
    GPST.name.to_owned()
}

/// Direction of a satellite from the receiver's fix. It is reported while the receiver runs and is not
/// written to a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SightRow {
    /// Sample number of the fix.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Azimuth from north over east, in degrees.
    pub azimuth_deg: f64,
    /// Elevation above the horizon, in degrees.
    pub elevation_deg: f64,
    /// True if the satellite is used in the fix.
    pub used: bool,
}

/// Ionosphere delay of a satellite, estimated from two of its carriers: `rx/ionosphere.csv`, for fixes with a
/// satellite on two bands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IonosphereRow {
    /// Sample number of the fix.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Group delay in metres on 1575.42 MHz, smoothed by the carriers. It includes the receiver's delay
    /// between its bands, which is common to all satellites of the same signals.
    pub delay_m: f64,
    /// Standard deviation by thermal noise, in metres.
    pub sigma_m: f64,
}

/// Protection levels of a fix: `rx/integrity.csv`, for receivers whose settings ask for them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntegrityRow {
    /// Sample number of the fix.
    pub sample: u64,
    /// GPS time of the fix, whole seconds since 1980.
    pub gps_s: i64,
    /// Fraction of that time, in seconds.
    pub gps_fraction_s: f64,
    /// Name of the method: araim, sbas or raim.
    pub method: String,
    /// Horizontal protection level in metres; absent where there is none.
    pub hpl_m: Option<f64>,
    /// Vertical protection level in metres; absent where there is none.
    pub vpl_m: Option<f64>,
    /// Effective monitor threshold in metres; absent of methods that have none.
    pub emt_m: Option<f64>,
    /// Vertical standard deviation for accuracy, in metres.
    pub sigma_v_acc_m: Option<f64>,
    /// Satellites in the fix.
    pub satellites: u32,
    /// True if a test showed a fault.
    pub detected: bool,
    /// Satellites that the residual test left out, separated by blanks.
    pub excluded: String,
    /// True if the fix has levels, no unexcluded fault shows, and all limits of the operation are kept.
    pub available: bool,
    /// Reason for which the fix is not available; empty where it is.
    pub reason: String,
}

/// Offset of the receiver's clock from one time scale: `rx/clocks.csv`, for fixes with a scale other than GPS
/// time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// Name of the time scale.
    pub time_scale: String,
    /// Offset of the receiver's clock from that time scale, in seconds, without the whole seconds to GPS
    /// time.
    pub clock_bias_s: f64,
    /// Formal standard deviation, in metres.
    pub sigma_clock_m: f64,
}

/// Ionosphere correction that a fix used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IonosphereModel {
    /// No correction, because the settings state that there is no ionosphere.
    None,
    /// Nominal ionosphere, whose error is in the covariance, because no satellite's parameters have been
    /// decoded yet.
    Nominal,
    /// Klobuchar's model with the parameters that the satellites send.
    Broadcast,
    /// NeQuick-G with the parameters that the satellites send.
    NequickG,
    /// BDGIM with the parameters that the satellites send.
    Bdgim,
    /// Two carriers of every satellite, in the combination that has no ionosphere.
    Combined,
    /// Grid of an augmentation system. Where it has no points, the correction is that without a grid.
    Grid,
}

impl Fix {
    /// Ranges beyond the unknowns.
    pub fn freedom(&self) -> u32 {
        self.ranges.unwrap_or(self.satellites).saturating_sub(3 + self.clocks.unwrap_or(1))
    }

    /// Estimated GPS time of the sample.
    pub fn time(&self) -> Epoch {
        Epoch::new(self.gps_s, self.gps_fraction_s)
    }

    /// ECEF position, in metres.
    pub fn position_m(&self) -> Vector3<f64> {
        Vector3::new(self.x_m, self.y_m, self.z_m)
    }

    /// ECEF velocity, in m/s.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        Vector3::new(self.vx_mps, self.vy_mps, self.vz_mps)
    }
}

/// Result of the search for one satellite: `rx/acquisition.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AcquisitionRow {
    /// First sample searched.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal that was searched.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// True if the satellite was found.
    pub acquired: bool,
    /// Largest detection statistic of the search.
    pub statistic: f64,
    /// Threshold of the statistic.
    pub threshold: f64,
    /// Doppler of the largest statistic, in Hz.
    pub doppler_hz: f64,
    /// Code phase at `sample`.
    pub code_phase_chips: f64,
    /// Carrier power over noise density of the whole signal, in dB-Hz.
    pub cn0_dbhz: f64,
}

/// Spectral line in the samples that no satellite sends: `rx/interference.csv`, one row for each second with
/// a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineRow {
    /// First sample looked at.
    pub sample: u64,
    /// Frequency of the strongest line in the samples, in Hz.
    pub frequency_hz: f64,
    /// Power of the line over the noise density beside it, in dB-Hz.
    pub jn0_dbhz: f64,
    /// Power of the line relative to the satellites' median C/N0 while there was no line, in dB. It is empty
    /// if there was always a line.
    pub js_db: Option<f64>,
    /// Power of the line's bin relative to the bins beside it.
    pub statistic: f64,
    /// Threshold of the statistic.
    pub threshold: f64,
    /// Number of lines above the threshold: one for a continuous wave, many for a sweep or for pulses.
    pub lines: u32,
    /// Width of a bin in Hz, which limits the resolution of the frequency.
    pub resolution_hz: f64,
}

/// A tracking loop at work: `rx/tracking.csv`, thinned.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrackingRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal of the satellite.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// In-phase prompt correlator, in units of its noise's standard deviation.
    pub prompt_i: f64,
    /// Quadrature prompt correlator, in units of its noise's standard deviation.
    pub prompt_q: f64,
    /// Raw discriminators of this update.
    pub dll_discriminator_chips: f64,
    /// Raw phase discriminator of this update, in cycles.
    pub pll_discriminator_cycles: f64,
    /// Raw frequency discriminator of this update, in Hz.
    pub fll_discriminator_hz: f64,
    /// Carrier power over noise density of the whole signal, in dB-Hz.
    pub cn0_dbhz: f64,
    /// Mean cosine of twice the phase error: 1 is perfect lock.
    pub phase_lock: f64,
    /// Time between updates of the loops, in seconds.
    pub integration_s: f64,
    /// In-phase early correlator, in units of the prompt's noise; `None` in files of receivers that
    /// record the prompt alone.
    pub early_i: Option<f64>,
    /// Quadrature early correlator.
    pub early_q: Option<f64>,
    /// In-phase late correlator.
    pub late_i: Option<f64>,
    /// Quadrature late correlator.
    pub late_q: Option<f64>,
    /// Distance from early to late, in chips.
    pub tap_spacing_chips: Option<f64>,
}

/// Parameter of a navigation message as its raw integer: `navigation.csv`, from generator and receiver.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NavigationRow {
    /// Sample at which a receiver had read it; in the truth, the one at which the data set began to be sent,
    /// 0 for those before the samples. Short issues come again within hours: this is what tells sets apart.
    #[serde(default)]
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Identifier of the data set within the satellite: the issue of data for ephemerides, 0 otherwise.
    pub issue: u32,
    /// Name in the message's field table.
    pub parameter: String,
    /// Raw integer as sent, with its sign extended.
    pub raw: i64,
    /// Name of the message, because satellites may send several. A file that does not state it contains LNAV.
    #[serde(default = "lnav")]
    pub message: String,
}

fn lnav() -> String {
    "LNAV".to_owned()
}

impl NavigationRow {
    /// Creates one row for each parameter of a satellite's message, at sample 0.
    pub fn each(
        sv: Sv,
        message: &'static str,
        issue: u32,
        parameters: Vec<(&'static str, i64)>,
    ) -> impl Iterator<Item = Self> {
        let row = move |(parameter, raw): (&str, i64)| Self {
            sample: 0,
            sv,
            issue,
            parameter: parameter.to_owned(),
            raw,
            message: message.to_owned(),
        };
        parameters.into_iter().map(row)
    }

    /// Content of the row, without its sample.
    pub fn content(&self) -> (Sv, &str, u32, &str, i64) {
        (self.sv, &self.message, self.issue, &self.parameter, self.raw)
    }
}

/// Result of one tag of Galileo's message authentication: `rx/osnma.csv`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TagRow {
    /// Week of GST in which the tag's sub-frame began.
    pub gst_week: u16,
    /// Second of the week at which the sub-frame began.
    pub tow_s: u32,
    /// Satellite that sent the tag.
    pub sender: String,
    /// Satellite whose data it covers, as the tag states it.
    pub satellite: String,
    /// Kind of the data: 0 ephemeris, 4 timing parameters, 12 ephemeris under the slow key.
    pub adkd: u8,
    /// Position of the tag in its sub-frame, from 1 on.
    pub position: u8,
    /// Result: `authentic`, `no_data`, `refused` or `not_verifiable`.
    pub result: String,
    /// Reason; empty for a tag that is right.
    pub reason: String,
}

impl TagRow {
    /// Columns of the table.
    pub const COLUMNS: [&str; 8] = ["gst_week", "tow_s", "sender", "satellite", "adkd", "position", "result", "reason"];
}

/// Something that happened to a channel: `rx/events.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EventRow {
    /// Number of the sample, from 0 at the start of the scene or recording.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal of the channel.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// Event that occurred.
    pub event: Event,
}

/// Events of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// A search found it.
    Acquired,
    /// The carrier loop locked.
    PhaseLocked,
    /// The edges of symbols are known.
    BitSynchronised,
    /// The message identifies the satellite. Earlier records of the channel, under another satellite with the
    /// same carrier and code, belong to this one.
    Identified,
    /// The message's frame is known, and with it the time.
    FrameSynchronised,
    /// Elements in short came, which serve until the ephemeris is complete.
    ReducedElements,
    /// A whole ephemeris was read.
    EphemerisComplete,
    /// The ionosphere's parameters came, for the first time or other than before: fixes are corrected by them
    /// from here on.
    IonosphereDecoded,
    /// The satellite states that it is unhealthy: it is not used from here on.
    Unhealthy,
    /// The satellite reports itself healthy again.
    Healthy,
    /// The channel gave the signal up.
    LossOfLock,
    /// The half-cycle or whole-cycle count of the carrier was broken and restarted.
    CycleSlip,
    /// Samples are missing in the recording: the code of this satellite, like all others, was ahead by as
    /// many.
    SamplesLost,
    /// Samples are in the recording twice.
    SamplesDoubled,
}
