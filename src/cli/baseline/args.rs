//! Arguments of `baseline` as written.

use std::path::PathBuf;

use clap::Args;

use crate::cli::printed::Printed;
use gnss::earth::Geodetic;
use gnss::satellite::System;
use rtk::carrier::Code;

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin baseline reports/base reports/rover --out reports/baseline\n  gnss-twin \
                        baseline reports/base reports/rover --signals G1C,E1C --check\n  gnss-twin baseline base.rnx \
                        rover.rnx --navigation brdc.rnx --base-position 37.605,-0.986,60\n  gnss-twin baseline \
                        reports/ship reports/drone --moving-base\n\nRuns with a truth are \
                        judged: error of the baseline, integers, fix rate, time to the first fix. Exit code with \
                        --check: 3 if a limit is broken"
)]
pub struct Baseline {
    /// Run of the base, or its RINEX observations
    #[arg(value_name = "BASE_RUN")]
    pub base: PathBuf,
    /// Run of the rover, or its RINEX observations
    #[arg(value_name = "ROVER_RUN")]
    pub rover: PathBuf,
    /// Directory for baseline.csv, verdict.csv and baseline.json [default: nothing is written]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// RINEX navigation file; may be repeated [default: those of both runs]
    #[arg(long, value_name = "FILE.rnx")]
    pub navigation: Vec<PathBuf>,
    /// Antenna of the base: latitude and longitude in degrees, height above the ellipsoid in metres [default:
    /// the truth of its run]
    #[arg(long, value_name = "LAT,LON,HEIGHT", allow_hyphen_values = true, value_parser = position)]
    pub base_position: Option<Geodetic>,
    /// Take the base's position from its own codes, epoch by epoch: the base moves
    #[arg(long, conflicts_with = "base_position")]
    pub moving_base: bool,
    /// Signals that take part, by system and RINEX code [default: all that both observe]
    #[arg(long, value_name = "G1C,E5Q,...", value_delimiter = ',', value_parser = signal)]
    pub signals: Vec<(System, Code)>,
    /// Estimate one position for all epochs: the rover is at rest
    #[arg(long = "static")]
    pub is_static: bool,
    /// Elevation in degrees below which satellites take no part
    #[arg(long, value_name = "DEG", default_value_t = 10.0, value_parser = mask)]
    pub mask_deg: f64,
    /// Least ratio of the second best integers' squared norm to that of the best
    #[arg(long, value_name = "RATIO", default_value_t = 3.0, value_parser = least_ratio)]
    pub ratio: f64,
    /// Least success rate of bootstrapping for a fix
    #[arg(long, value_name = "P", default_value_t = 0.999, value_parser = probability)]
    pub success_rate: f64,
    /// Deviation of the ionosphere between the receivers at the zenith on L1, millimetres per kilometre of
    /// baseline
    #[arg(long, value_name = "PPM", default_value_t = 1.0, value_parser = parts_per_million)]
    pub ionosphere_ppm: f64,
    /// End with exit code 3 if a limit of the verdict is broken
    #[arg(long)]
    pub check: bool,
    #[command(flatten)]
    pub printed: Printed,
}

/// Latitude and longitude in degrees, height in metres.
fn position(text: &str) -> Result<Geodetic, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([latitude, longitude, height])
            if latitude.abs() <= 90.0 && longitude.abs() <= 360.0 && (-1e4..=1e8).contains(height) =>
        {
            Ok(Geodetic::from_degrees(*latitude, *longitude, *height))
        }
        _ => Err("expected latitude and longitude in degrees and a height in metres, like 37.605,-0.986,60".to_owned()),
    }
}

/// System and code, such as `G1C`.
fn signal(text: &str) -> Result<(System, Code), String> {
    let found = text.chars().next().and_then(|letter| {
        let (system, _) = System::LETTERS.iter().find(|(_, own)| *own == letter)?;
        Some((*system, Code::new(text.get(1..)?)?))
    });
    found.ok_or_else(|| "expected a system's letter and the code of RINEX, like G1C or E5Q".to_owned())
}

/// Elevation mask in degrees.
fn mask(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|deg| (-90.0..90.0).contains(deg))
        .ok_or_else(|| "expected degrees from -90 to 90".to_owned())
}

/// Ratio of squared norms.
fn least_ratio(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|ratio| (1.0..=1e6).contains(ratio))
        .ok_or_else(|| "expected a ratio from 1 to 1e6".to_owned())
}

/// Millionths.
fn parts_per_million(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|ppm| (0.0..=1e4).contains(ppm))
        .ok_or_else(|| "expected a number from 0 to 1e4".to_owned())
}

/// Probability below one.
fn probability(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|p| (0.0..1.0).contains(p));
    value.ok_or_else(|| "expected a probability from 0 to below 1".to_owned())
}
