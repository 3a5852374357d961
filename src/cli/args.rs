//! Arguments as written.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::gnss::samples::Format;

/// A GNSS digital twin: generate IF samples from real ephemerides, receive them, judge the receiver.
///
/// Without a command it runs the static scene that comes with the program.
#[derive(Debug, Parser)]
#[command(version, after_help = "Example: gnss-twin run scenarios/moderate.toml --out reports/moderate")]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Generate a scene, receive it in memory and judge the result
    Run(Run),
    /// Write a scene's IF samples, their metadata and the truth
    Generate(Generate),
    /// Find position and time in a recording, from a cold start
    Receive(Receive),
    /// Judge an existing run again
    Analyze(Analyze),
    /// Say what a scene will compute, what not, and why
    Plan(Plan),
}

#[derive(Args, Debug, Default)]
#[command(after_help = "Example: gnss-twin run scenarios/static.toml --seed 7 --keep-if")]
pub struct Run {
    /// Scene to run [default: the embedded static scene]
    pub scenario: Option<PathBuf>,
    /// Directory for the results [default: reports/<scene's name>]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Seed of the noise, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Also keep the samples: if.sigmf-data and if.sigmf-meta
    #[arg(long)]
    pub keep_if: bool,
    /// Hold the figures of summary.json against these limits; exit with 3 if one is broken
    #[arg(long, value_name = "LIMITS.toml")]
    pub check: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin generate scenarios/static.toml --out static.sigmf-data --format ci16")]
pub struct Generate {
    /// Scene to generate
    pub scenario: PathBuf,
    /// File for the samples; metadata (.sigmf-meta) and truth (.truth/) are written beside it
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Sample format, in place of the scene's: ci8, cu8, ci16, cf32, ri8, ri16
    #[arg(long)]
    pub format: Option<Format>,
    /// First sample of the scene to write: the same bits as in the whole, without making what lies before
    #[arg(long, value_name = "SAMPLE", default_value_t = 0)]
    pub seek: u64,
    /// Samples to write [default: to the scene's end]
    #[arg(long, value_name = "COUNT")]
    pub samples: Option<u64>,
    /// Seed of the noise, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin receive if.sigmf-data --out reports/mine\n  gnss-twin receive raw.bin --out reports/raw --format ci8 --rate-hz 4e6"
)]
pub struct Receive {
    /// Recording: a SigMF pair (either file), or a raw file with --format and --rate-hz; - is standard input
    pub file: PathBuf,
    /// Directory for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Receiver settings [default: the built-in ones]
    #[arg(long, value_name = "SETTINGS.toml")]
    pub receiver: Option<PathBuf>,
    /// Sample format of a raw file: ci8, cu8, ci16, cf32, ri8, ri16
    #[arg(long)]
    pub format: Option<Format>,
    /// Sample rate of a raw file
    #[arg(long, value_name = "HZ")]
    pub rate_hz: Option<f64>,
    /// Frequency of GPS L1 in a raw file [default: 0]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub if_hz: Option<f64>,
    /// The raw file's spectrum is mirrored (local oscillator above the signal)
    #[arg(long)]
    pub inverted: bool,
    /// Time of the first sample, as GPS time or with a final Z as UTC; only labels the clock
    #[arg(long, value_name = "TIME")]
    pub start: Option<String>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin analyze reports/static --check scenarios/limits.toml\n  gnss-twin analyze --truth static.truth --rinex-obs rx.26O --nmea rx.nmea --out reports/mine"
)]
pub struct Analyze {
    /// Directory of a run, with truth/ and rx/
    #[arg(required_unless_present = "truth", conflicts_with = "truth")]
    pub run: Option<PathBuf>,
    /// Hold the figures of summary.json against these limits; exit with 3 if one is broken
    #[arg(long, value_name = "LIMITS.toml", conflicts_with = "truth")]
    pub check: Option<PathBuf>,
    /// Judge another receiver, which was fed a scene's samples, against that scene's truth/ directory
    #[arg(long, value_name = "DIR", requires = "files")]
    pub truth: Option<PathBuf>,
    #[command(flatten)]
    pub files: ReceiverFiles,
    /// Directory for what is found of another receiver [default: reports/<scene's name>-foreign]
    #[arg(long, value_name = "DIR", requires = "truth")]
    pub out: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[group(id = "files", multiple = true)]
pub struct ReceiverFiles {
    /// Its observations: a RINEX 3 file
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub rinex_obs: Option<PathBuf>,
    /// Its positions: NMEA 0183 with GGA, and RMC for date and velocity
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub nmea: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin plan scenarios/high_dynamics.toml")]
pub struct Plan {
    /// Scene to plan [default: the embedded static scene]
    pub scenario: Option<PathBuf>,
}
