//! Arguments of `rtcm` as written.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{ArgGroup, Args};

use crate::cli::address::listen_address;
use crate::cli::error::CliError;
use crate::cli::printed::Printed;
use gnss::earth::Geodetic;
use logs::rtcm::station::Plan;

#[derive(Args, Debug)]
#[command(
    group = ArgGroup::new("to").required(true).multiple(true).args(["out", "serve", "caster"]),
    after_help = "Examples:\n  gnss-twin rtcm reports/static --out base.rtcm3\n  gnss-twin rtcm reports/static \
                  --caster 2101/TWIN --messages 'msm4,1005(1),eph(10)'\n\nMessages: msm4 to msm7 are those of all \
                  systems, eph is 1019, 1020, 1041, 1042, 1044, 1045 and 1046; 1005, 1006, 1033, 1230 and each of \
                  them by its number, with an interval in seconds in brackets"
)]
pub struct Rtcm {
    /// Directory of a run, or a RINEX observation file
    #[arg(value_name = "RUN|FILE.rnx")]
    pub input: PathBuf,
    /// Send the run's truth instead of what its receiver observed
    #[arg(long)]
    pub truth: bool,
    /// RINEX navigation file with ephemerides (repeatable)
    #[arg(long, value_name = "FILE")]
    pub nav: Vec<PathBuf>,
    /// File to write
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// TCP listener: PORT on this machine, or IP:PORT
    #[arg(long, value_name = "tcp:ADDR", value_parser = tcp_listener)]
    pub serve: Option<SocketAddr>,
    /// NTRIP caster with one mount point
    #[arg(long, value_name = "ADDR/MOUNT", value_parser = mount_point)]
    pub caster: Option<(SocketAddr, String)>,
    /// Name and password that the caster's clients need, or a file with them [default: everyone is let in]
    #[arg(long, value_name = "NAME:PASSWORD|@FILE", requires = "caster")]
    pub user: Option<String>,
    /// Messages and their intervals
    #[arg(long, value_name = "LIST", default_value = "msm7,1006,1033,1230,eph")]
    pub messages: Plan,
    /// Number of the station
    #[arg(long, value_name = "NUMBER", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=4095))]
    pub station: u16,
    /// Position of the antenna in degrees and metres [default: that of the truth, if it does not move]
    #[arg(long, value_name = "LAT,LON,HEIGHT", value_parser = place, allow_hyphen_values = true)]
    pub position: Option<Geodetic>,
    /// Name of the antenna
    #[arg(long, value_name = "NAME", default_value = "ADVNULLANTENNA")]
    pub antenna: String,
    /// Height of the antenna above its marker in metres
    #[arg(long, value_name = "METRES", default_value_t = 0.0)]
    pub antenna_height: f64,
    /// Speed at which clients get the stream: 1 is real time
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    #[command(flatten)]
    pub printed: Printed,
}

impl Rtcm {
    /// Name and password of the caster's clients, with a colon between them.
    pub fn user(&self) -> Result<Option<String>, CliError> {
        let Some(text) = &self.user else { return Ok(None) };
        let user = match text.strip_prefix('@') {
            None => text.clone(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|error| CliError::read(path, &error))?;
                text.lines().next().unwrap_or_default().to_owned()
            }
        };
        match user.split_once(':') {
            Some((name, _)) if !name.is_empty() => Ok(Some(user)),
            _ => Err(CliError::usage("--user: expected NAME:PASSWORD, or @FILE with that in its first line")),
        }
    }
}

/// Address of a listener after `tcp:`.
fn tcp_listener(text: &str) -> Result<SocketAddr, String> {
    listen_address(text.strip_prefix("tcp:").unwrap_or(text))
}

/// Address of a caster and its mount point.
fn mount_point(text: &str) -> Result<(SocketAddr, String), String> {
    let is_named = |mount: &str| {
        !mount.is_empty() && mount.len() <= 100 && mount.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
    };
    match text.rsplit_once('/') {
        Some((address, mount)) if is_named(mount) => Ok((listen_address(address)?, mount.to_owned())),
        _ => {
            Err(format!("'{text}': expected PORT/MOUNT or IP:PORT/MOUNT, a mount point of letters, digits, -, _ and ."))
        }
    }
}

/// Latitude and longitude in degrees and height in metres.
fn place(text: &str) -> Result<Geodetic, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.unwrap_or_default()[..] {
        [latitude, longitude, height_m]
            if latitude.abs() <= 90.0 && longitude.abs() <= 360.0 && (-1e4..1e7).contains(&height_m) =>
        {
            Ok(Geodetic::from_degrees(latitude, longitude, height_m))
        }
        _ => Err(format!("'{text}': expected LATITUDE,LONGITUDE,HEIGHT in degrees and metres")),
    }
}

/// Factor of a speed.
fn speed(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|factor| (1e-3..=1e6).contains(factor));
    factor.ok_or_else(|| format!("'{text}': expected a factor of 0.001 to 1000000"))
}
