//! Arguments as written.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::cli::lines;
use crate::cli::live::intake::Origin;
use crate::cli::packed::{Bits, Packed};
use crate::cli::printed::Printed;
use crate::cli::sink::Spec;
use crate::gnss::exchange::Version;
use crate::gnss::samples::Format;
use crate::gnss::time::Epoch;
use crate::study::sweep::export::Directive;
use crate::study::sweep::part::Part;

/// A GNSS digital twin: generate IF samples from real ephemerides, receive them, judge the receiver.
///
/// Without a command it runs the scene of GPS and Galileo that comes with the program.
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
    /// Send a scene in real time, while motion and events come in
    Live(Live),
    /// Find position and time in a recording, from a cold start
    Receive(Receive),
    /// Judge an existing run again
    Analyze(Analyze),
    /// Say what a scene will compute, what not, and why
    Plan(Plan),
    /// Run a study: a base, axes and repetitions become tables, curves and a report
    Study(Study),
    /// Write the tables of a run or a study as Parquet too
    Parquet(Parquet),
    /// List every key of scenarios, receiver settings, studies and limits: default, unit, range, meaning
    Reference(Reference),
    /// List the scenes that come with the program, or copy some of them
    Scenes(Scenes),
    /// Write a scene with comments, to begin with
    Init(Init),
    /// Print a JSON schema for editors and validators
    Schema(Schema),
    /// Print the completions of a shell
    Completions(Completions),
    /// Write the manual's pages
    Man(Man),
}

#[derive(Args, Debug)]
#[command(
    after_help = "Example: gnss-twin parquet reports/static\n\nBeside TABLE.csv comes TABLE.parquet, with the same \
                        names of columns"
)]
pub struct Parquet {
    /// Directories with tables, of runs or studies, or tables (.csv)
    #[arg(required = true, value_name = "DIR|FILE.csv")]
    pub paths: Vec<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  gnss-twin scenes\n  gnss-twin scenes jammed ionex --out my-scenes")]
pub struct Scenes {
    /// Scenes to copy, with the files that they name [default: none, all are listed]
    pub names: Vec<String>,
    /// Directory to copy them to
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Replace files that are there
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin init my.toml && gnss-twin run my.toml")]
pub struct Init {
    /// Where to write it
    #[arg(default_value = "scene.toml")]
    pub path: PathBuf,
    /// Replace a file that is there
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin schema scenario > scenario.schema.json, and in the scene's first line:\n  \
                  #:schema scenario.schema.json")]
pub struct Schema {
    /// Of which kind of file
    pub of: SchemaOf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SchemaOf {
    /// A scene
    Scenario,
    /// The settings of `receive --receiver`
    Receiver,
    /// A study
    Study,
    /// Limits of `--check`
    Limits,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin completions bash > ~/.local/share/bash-completion/completions/gnss-twin")]
pub struct Completions {
    /// The shell
    pub shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin man --out ~/.local/share/man/man1")]
pub struct Man {
    /// Directory that takes gnss-twin.1 and a page for each command
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin reference front_end")]
pub struct Reference {
    /// One table by its name: motion, receiver.tracking, study.axis, limits [default: all]
    pub table: Option<String>,
}

#[derive(Args, Debug, Default)]
#[command(after_help = "Example: gnss-twin run scenarios/static.toml --seed 7 --keep-if")]
pub struct Run {
    /// Scene to run [default: the embedded scene of GPS and Galileo]
    pub scenario: Option<PathBuf>,
    /// Directory for the results [default: reports/<scene's name>, and -NAME with --front-end NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Front end to receive, of a scene that has several [default: all of them in one reception]
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Seed of the noise, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Version of the RINEX files: 3.05 or 4.02
    #[arg(long, value_name = "VERSION", default_value_t)]
    pub rinex: Version,
    /// Also keep the samples: if.sigmf-data and if.sigmf-meta
    #[arg(long)]
    pub keep_if: bool,
    /// Exit with 3 if a limit is broken: one of this file's for summary.json, or of the verdict's own without
    /// a file
    #[arg(long, value_name = "LIMITS.toml", num_args = 0..=1)]
    pub check: Option<Option<PathBuf>>,
    /// Also read files that lie outside the scenario's directory
    #[arg(long)]
    pub allow_outside: bool,
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin generate scenarios/static.toml --out static.sigmf-data --format ci16\n  \
                  gnss-twin generate scenarios/static.toml --out - | hackrf_transfer -t - -f 1575420000 -s \
                  2600000\n  gnss-twin generate scenarios/static.toml --out rtl-tcp:1234 --truth static.truth"
)]
pub struct Generate {
    /// Scene to generate
    pub scenario: PathBuf,
    /// Also read files that lie outside the scenario's directory
    #[arg(long)]
    pub allow_outside: bool,
    /// File for the samples; metadata (.sigmf-meta) and truth (.truth/) are written beside it. Of a scene
    /// with several front ends a directory, for NAME.sigmf-data and NAME.sigmf-meta of each, a
    /// .sigmf-collection and truth/. Or a stream of samples alone, at the reader's pace: - (standard output),
    /// fifo:PATH, file:PATH, tcp:ADDR, rtl-tcp:ADDR. ADDR is where to listen for one client: PORT on this
    /// machine alone, or IP:PORT
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Directory for the truth of a stream [default: none]
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Also write RINEX into the truth, what an ideal receiver would have and the sets that are sent: 3.05,
    /// or --rinex=4.02
    #[arg(long, value_name = "VERSION", num_args = 0..=1, require_equals = true, default_missing_value = "3.05")]
    pub rinex: Option<Version>,
    /// Also write the antenna's place into the truth as NMEA 0183: trajectory.nmea
    #[arg(long)]
    pub nmea: bool,
    /// Also write it as tracks for maps, a point a second: trajectory.kml and trajectory.gpx
    #[arg(long)]
    pub maps: bool,
    /// Also write NAME.gnss-sdr.conf beside the samples, with which GNSS-SDR opens them
    #[arg(long)]
    pub gnss_sdr: bool,
    /// Also write FILE.tag beside the samples, with which PocketSDR opens them
    #[arg(long)]
    pub pocketsdr: bool,
    /// How samples of a few bits are packed: those of the scene's converter
    #[command(flatten)]
    pub packed: Bits,
    /// Front end to generate, of a scene that has several [default: all of them]
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Sample format, in place of the scene's: ci8, cu8, ci16, cf32, ri8, ri16 [default to rtl-tcp: cu8]
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
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin live scene.toml --motion udp:4567 --to - | hackrf_transfer -t - -f 1575420000 \
                  -s 2600000\n  gnss-twin live scene.toml --clock host --motion udp:4567 --to tcp:5000 --record \
                  reports/flight\n  gnss-twin generate reports/flight/replay.toml --out again.sigmf-data\n\nStatus: a \
                  line of JSON a second on standard error. Exit code: 3 past --max-underruns or --max-late, 130 or \
                  143 by signal"
)]
pub struct Live {
    /// Scene to send; where its motion is "pushed" it takes motion and events
    pub scenario: PathBuf,
    /// Where samples go, several times for several: - (standard output), fifo:PATH, tcp:ADDR, rtl-tcp:ADDR,
    /// file:PATH. The first one sets the pace; others lose whole ticks, which are counted, while they are
    /// slow
    #[arg(long, value_name = "SINK", default_value = "-")]
    pub to: Vec<Spec>,
    /// What the pace follows: the first sink's reading, this machine's clock, or nothing
    #[arg(long, value_enum, default_value_t = Clock::Sink)]
    pub clock: Clock,
    /// How far ahead of their time samples are made: what a sluggish machine may lose without an underrun
    #[arg(long, value_name = "MS", default_value_t = 8.0, value_parser = latency)]
    pub latency: f64,
    /// When the first sample is sent, and the time that it has: a UTC second like 2026-11-23T05:00:00Z, or +S
    /// seconds from now [default: at once, at the scene's own time]
    #[arg(long, value_name = "UTC|+S", value_parser = start_at)]
    pub start_at: Option<StartAt>,
    /// Where motion and events come in: udp:ADDR, tcp:ADDR or - (standard input). ADDR is PORT on this
    /// machine alone, or IP:PORT
    #[arg(long, value_name = "ORIGIN")]
    pub motion: Option<Origin>,
    /// What the times of states count from: sample 0 of the scene, or the first state, which is then of the
    /// instant at which it is used: for a rig whose clock shares no start with the scene's
    #[arg(long, value_enum, default_value_t = MotionTime::Scene)]
    pub motion_time: MotionTime,
    /// Directory for a record of the run: what came in, what was sent, its truth, and replay.toml
    #[arg(long, value_name = "DIR")]
    pub record: Option<PathBuf>,
    /// Exit with 3 after more underruns than that
    #[arg(long, value_name = "N")]
    pub max_underruns: Option<u64>,
    /// Exit with 3 after more states that came too late than that
    #[arg(long, value_name = "N")]
    pub max_late: Option<u64>,
    /// Front end to send, of a scene that has several
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Sample format, in place of the scene's: ci8, cu8, ci16, cf32, ri8, ri16 [default to rtl-tcp: cu8]
    #[arg(long)]
    pub format: Option<Format>,
    /// Seed of the noise, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Also read files that lie outside the scenario's directory
    #[arg(long)]
    pub allow_outside: bool,
}

/// What the pace of a live run follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Clock {
    /// The first sink's reading: a radio's own clock
    Sink,
    /// This machine's clock
    Host,
    /// Nothing: as fast as sinks take it
    Free,
}

/// What the times of pushed states count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MotionTime {
    /// The scene's sample 0
    Scene,
    /// The first state, which is of the instant at which it is used
    First,
}

/// When a live run starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartAt {
    /// At this instant.
    Utc(Epoch),
    /// At the first whole second that is so many seconds away.
    After(f64),
}

fn start_at(text: &str) -> Result<StartAt, String> {
    let expected = || "expected a whole UTC second like 2026-11-23T05:00:00Z, or +S with 0 to 86400 seconds".to_owned();
    if let Some(seconds) = text.strip_prefix('+') {
        let seconds = seconds.parse().ok().filter(|s| (0.0..=86_400.0).contains(s));
        return seconds.map(StartAt::After).ok_or_else(expected);
    }
    let at = Some(text).filter(|text| text.ends_with('Z')).and_then(|text| Epoch::parse(text).ok());
    at.filter(|at| at.fraction() == 0.0).map(StartAt::Utc).ok_or_else(expected)
}

fn latency(text: &str) -> Result<f64, String> {
    let ms = text.parse().ok().filter(|ms| (0.5..=10_000.0).contains(ms));
    ms.ok_or_else(|| "expected 0.5 to 10000 milliseconds".to_owned())
}

#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin receive if.sigmf-data --out reports/mine\n  gnss-twin receive raw.bin --out \
                  reports/raw --format ci8 --rate-hz 4e6\n  gnss-twin receive rtl-tcp:1234 --rate-hz 2.4e6 --out \
                  reports/now --live --nmea tcp:10110 --json -\n\nExit code: 0 with a fix, 2 for a command line \
                  that is refused, 3 without a fix (results are written, the reason is printed), 74 when the sender \
                  broke off (results end there), 130 after Ctrl-C with --live, 65 when the input is no recording"
)]
pub struct Receive {
    /// Recording: a SigMF pair (either file), archive (.sigmf) or collection of front ends that share a
    /// clock, ION metadata (.xml, .sdrx), or a raw file with --format or --bits and --rate-hz; - is standard
    /// input. Or a stream: fifo:PATH, tcp:ADDR of a server of samples alone, rtl-tcp:ADDR of one that drives
    /// a dongle (ADDR is HOST:PORT, or PORT on this machine)
    pub file: PathBuf,
    /// Directory for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Rows and lines can be read as they come, in DIR.unfinished until the end; Ctrl-C ends the stream, and
    /// what came before it is finished
    #[arg(long)]
    pub live: bool,
    /// NMEA 0183 of every fix (GGA, RMC, VTG, ZDA, GSA, GSV): a file, - (standard output), fifo:PATH, or
    /// tcp:ADDR to listen on
    #[arg(long, value_name = "TO")]
    pub nmea: Option<lines::Spec>,
    /// JSON lines of fixes, satellites, channels, searches and events: a file, -, fifo:PATH or tcp:ADDR;
    /// without one of these, print the results as one JSON object
    #[arg(long, value_name = "TO", num_args = 0..=1)]
    pub json: Option<Option<lines::Spec>>,
    /// Print neither results nor progress: only warnings and errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Also write RINEX, observations.rnx and navigation.rnx: 3.05, or --rinex=4.02
    #[arg(long, value_name = "VERSION", num_args = 0..=1, require_equals = true, default_missing_value = "3.05")]
    pub rinex: Option<Version>,
    /// Receiver settings [default: the built-in ones]
    #[arg(long, value_name = "SETTINGS.toml")]
    pub receiver: Option<PathBuf>,
    /// Signals to search for: all that the bands hold, or names like "GPS L1 C/A,Galileo E1" [default: the
    /// settings'; those that the metadata name; GPS L1 C/A, or all where the bands do not hold it]
    #[arg(long, value_name = "all|NAMES", value_delimiter = ',')]
    pub signals: Vec<String>,
    /// Sample format of a raw file or stream: ci8, cu8, ci16, cf32, ri8, ri16
    #[arg(long)]
    pub format: Option<Format>,
    /// Sample rate of a raw file or stream
    #[arg(long, value_name = "HZ")]
    pub rate_hz: Option<f64>,
    /// Frequency at which GPS L1, 1575.42 MHz, lies in a raw file's samples: above zero where their 0 Hz is
    /// at 1575.42 MHz less HZ, below zero where it is above 1575.42 MHz; with --inverted also as it lies in
    /// the samples [default: 0 of complex samples; real ones need it]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub if_hz: Option<f64>,
    /// The raw file's spectrum is mirrored (local oscillator above the signal)
    #[arg(long)]
    pub inverted: bool,
    /// How samples of a few bits, or of several channels, lie in the file
    #[command(flatten)]
    pub packed: Packed,
    /// Time of the first sample, as GPS time or with a final Z as UTC; only labels the clock
    #[arg(long, value_name = "TIME")]
    pub start: Option<String>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin analyze reports/static --check scenarios/limits.toml\n  gnss-twin analyze \
                  --truth static.truth --rinex-obs rx.26O --nmea rx.nmea --out reports/mine"
)]
pub struct Analyze {
    /// Directory of a run, with truth/ and rx/
    #[arg(required_unless_present = "truth", conflicts_with = "truth")]
    pub run: Option<PathBuf>,
    /// Exit with 3 if a limit is broken: one of this file's for summary.json (foreign.json with --truth), or
    /// of the verdict's own without a file
    #[arg(long, value_name = "LIMITS.toml", num_args = 0..=1)]
    pub check: Option<Option<PathBuf>>,
    /// Judge another receiver, which was fed a scene's samples, against that scene's truth/ directory
    #[arg(long, value_name = "DIR", requires = "files")]
    pub truth: Option<PathBuf>,
    #[command(flatten)]
    pub files: ReceiverFiles,
    /// Directory for what is found of another receiver [default: reports/<scene's name>-foreign]
    #[arg(long, value_name = "DIR", requires = "truth")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[group(id = "files", multiple = true)]
pub struct ReceiverFiles {
    /// Its observations: RINEX 2.11, 3 or 4, plain, by Hatanaka's scheme (CRINEX) or packed by gzip
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub rinex_obs: Option<PathBuf>,
    /// Its positions: NMEA 0183 with GGA, RMC or ZDA for the date, RMC or VTG for the velocity
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub nmea: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin plan scenarios/high_dynamics.toml")]
pub struct Plan {
    /// Scene to plan [default: the embedded scene of GPS and Galileo]
    pub scenario: Option<PathBuf>,
    /// Also read files that lie outside the scenario's directory
    #[arg(long)]
    pub allow_outside: bool,
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  gnss-twin study studies/pll_jitter.toml\n  gnss-twin study plan \
                  studies/pll_jitter.toml -o big && gnss-twin study export slurm big | sbatch"
)]
pub struct Study {
    #[command(subcommand)]
    pub action: Option<StudyAction>,
    /// Study to plan, run and report on this machine; after a kill the same command goes on
    pub study: Option<PathBuf>,
    /// Directory of the study [default: reports/<name of the study's file>]
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Forget what an earlier plan in that directory has computed
    #[arg(long)]
    pub fresh: bool,
}

#[derive(Debug, Subcommand)]
pub enum StudyAction {
    /// Write a study's manifest and copies of its inputs into a directory
    Plan(StudyPlan),
    /// Compute missing shards: all of them, or one
    Run(StudyRun),
    /// Say what is there; exit 3 if something is missing
    Status(StudyStatus),
    /// Put all shards together: each case once, in order, or an error
    Merge(StudyMerge),
    /// Write tables, pictures and report.md into the study's directory
    Report(StudyReport),
    /// Print a script that hands the missing shards to an engine
    Export(StudyExport),
    /// Hand the missing shards to an engine, wait, and again what is missing then; started anew, it goes on
    Submit(StudySubmit),
}

#[derive(Args, Debug)]
pub struct StudyPlan {
    /// Study to plan
    pub study: PathBuf,
    /// Directory of the study
    #[arg(long, short, value_name = "DIR")]
    pub out: PathBuf,
    /// Number of shards [default: 50 to 1000, of a minute at most]
    #[arg(long, value_name = "N", conflicts_with = "shard_minutes")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub shards: Option<u64>,
    /// Length of a shard in minutes of one core, roughly
    #[arg(long, value_name = "M")]
    pub shard_minutes: Option<f64>,
    /// Forget what an earlier plan in that directory has computed
    #[arg(long)]
    pub fresh: bool,
}

#[derive(Args, Debug)]
pub struct StudyRun {
    /// Directory of the study
    pub directory: PathBuf,
    /// Number of a shard, or auto: the number that the engine gives to this task [default: all that are
    /// missing]
    #[arg(long, value_name = "K")]
    pub shard: Option<Shard>,
    /// Part of the plan, what is missing of it: part K of N, counted from 0
    #[arg(long, value_name = "K/N", conflicts_with = "shard")]
    pub part: Option<Part>,
    /// Threads to use [default: one a core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
}

/// Which shard to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shard {
    Auto,
    Number(u32),
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        if word == "auto" {
            return Ok(Self::Auto);
        }
        word.parse().map(Self::Number).map_err(|_| "expected a number or auto".to_owned())
    }
}

#[derive(Args, Debug)]
pub struct StudyStatus {
    /// Directory of the study
    pub directory: PathBuf,
    /// Print the missing shards alone, as an engine's array takes them
    #[arg(long)]
    pub missing: bool,
}

#[derive(Args, Debug)]
pub struct StudyMerge {
    /// Directory of the study
    pub directory: PathBuf,
    /// File for the table: .csv or .parquet
    #[arg(long, short, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Args, Debug)]
pub struct StudyReport {
    /// Directory of the study
    pub directory: PathBuf,
}

#[derive(Args, Debug)]
pub struct StudyExport {
    pub engine: Engine,
    /// Directory of the study
    pub directory: PathBuf,
    #[command(flatten)]
    pub terms: Terms,
}

#[derive(Args, Debug)]
pub struct StudySubmit {
    /// Directory of the study
    pub directory: PathBuf,
    /// What hands out shards
    #[arg(long, value_name = "ENGINE")]
    pub engine: Engine,
    /// How often what is missing is handed out
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    #[command(flatten)]
    pub terms: Terms,
}

/// What a site asks of an engine's tasks.
#[derive(Args, Debug)]
pub struct Terms {
    /// Tasks, each with as many shards [default: one a shard, as far as the engine's arrays go]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub tasks: Option<u32>,
    /// Tasks that may run at a time
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub at_once: Option<u32>,
    /// Slurm: minutes that a task may take [default: 5, and three times what the plan expects]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=525_600))]
    pub minutes: Option<u32>,
    /// Slurm: another option of sbatch, several times for several: --directive=--partition=long
    #[arg(long = "directive", value_name = "OPTION", allow_hyphen_values = true)]
    pub directives: Vec<Directive>,
}

/// What hands out shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// A job array of Slurm
    Slurm,
    /// GNU parallel
    Parallel,
}
