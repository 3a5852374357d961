//! Arguments as written.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::builder::UnknownArgumentValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::cli::address::{listen_address, udp_address};
use crate::cli::baseline::args::Baseline;
use crate::cli::lines;
use crate::cli::live::intake::Origin;
use crate::cli::osnma::args::Osnma;
use crate::cli::pack::args::Pack;
use crate::cli::packed::{Bits, Packed};
use crate::cli::printed::Printed;
use crate::cli::rtcm::args::Rtcm;
use crate::cli::sink::Spec;
use crate::cli::study::args::Study;
use crate::cli::watch::{Watched, tcp_peer};
use analysis::show::document::Forms;
use generator::fidelity::Grade;
use gnss::exchange::Version;
use gnss::samples::Format;
use gnss::time::Epoch;
use logs::frames::Protocol;

/// A GNSS digital twin: generates IF samples from real ephemerides, receives them and judges the receiver.
///
/// Without a command it runs its embedded scene of GPS and Galileo.
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
    /// Show a receiver or a run's directory in a browser, while it goes on
    Watch(Watch),
    /// Find position and time in a recording, from a cold start
    Receive(Receive),
    /// Judge an existing run again
    Analyze(Analyze),
    /// Show what a scene will compute, without computing it
    Plan(Plan),
    /// Run a parameter study: vary keys, repeat with other noise, write tables, curves and a report
    Study(Study),
    /// Run the scenes of a pack and write one matrix of their verdicts
    Pack(Pack),
    /// Show what a receiver's log holds, or convert it to tables
    Logs(Logs),
    /// Find the baseline between the receivers of two runs by their carriers, and judge it
    Baseline(Baseline),
    /// Send a run's observations and ephemerides as the RTCM 3.3 stream of a reference station
    Rtcm(Rtcm),
    /// Verify the authentication of Galileo's navigation messages (OSNMA)
    Osnma(Osnma),
    /// Convert the tables of a run or a study to Parquet
    Parquet(Parquet),
    /// List every key of scenarios, receiver settings, studies, packs and limits: default, unit, range,
    /// meaning
    Reference(Reference),
    /// List the scenes that come with the program, or copy some of them
    Scenes(Scenes),
    /// Write a commented scene to start from
    Init(Init),
    /// Print a JSON schema for editors and validators
    Schema(Schema),
    /// Print shell completions
    Completions(Completions),
    /// Write the manual pages
    Man(Man),
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin logs COM3.ubx\n  gnss-twin logs COM3.ubx --out tables\n\nMESSAGE.csv holds \
                  the fields of all messages of that name; observations.csv and fixes.csv have what can be judged"
)]
pub struct Logs {
    /// Log as it came out of the device: UBX, RTCM 3, SBF, also mixed with NMEA; - is standard input,
    /// ntrip://HOST:PORT/MOUNT the stream of a caster, with USER:PASSWORD@ before HOST if it asks for them
    pub log: PathBuf,
    /// Directory for one table per kind of message [default: no tables are written]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Time within three days of the log, for messages that name no week: UTC like 2026-11-23T05:00:00Z
    #[arg(long, value_name = "UTC", value_parser = Epoch::parse)]
    pub near: Option<Epoch>,
    #[command(flatten)]
    pub printed: Printed,
}

/// Binary protocol of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogProtocol {
    /// u-blox
    Ubx,
    /// RTCM 10403, version 3
    Rtcm3,
    /// Septentrio
    Sbf,
}

impl LogProtocol {
    /// Protocol of the reader.
    pub fn protocol(self) -> Protocol {
        match self {
            Self::Ubx => Protocol::Ubx,
            Self::Rtcm3 => Protocol::Rtcm,
            Self::Sbf => Protocol::Sbf,
        }
    }
}

#[derive(Args, Debug)]
#[command(
    after_help = "Example: gnss-twin parquet reports/static\n\nTABLE.parquet is written beside TABLE.csv, with the \
                        same column names"
)]
pub struct Parquet {
    /// Directories with tables, of runs or studies, or tables (.csv)
    #[arg(required = true, value_name = "DIR|FILE.csv")]
    pub paths: Vec<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  gnss-twin scenes\n  gnss-twin scenes jammed ionex --out my-scenes\n  gnss-twin \
                        scenes --pack dynamics --out dynamics")]
pub struct Scenes {
    /// Scenes to copy, with the files that they name [default: list all scenes and packs]
    pub names: Vec<String>,
    /// Pack to copy, with its scenes and the files that they name
    #[arg(long, value_name = "NAME", conflicts_with = "names")]
    pub pack: Option<String>,
    /// Destination directory
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Overwrite existing files
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin init my.toml && gnss-twin run my.toml")]
pub struct Init {
    /// File to write
    #[arg(default_value = "scene.toml")]
    pub path: PathBuf,
    /// Overwrite an existing file
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin schema scenario > scenario.schema.json, and in the scene's first line:\n  \
                  #:schema scenario.schema.json")]
pub struct Schema {
    /// Kind of file that the schema describes
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
    /// Shell to write completions for
    pub shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin man --out ~/.local/share/man/man1")]
pub struct Man {
    /// Directory for gnss-twin.1 and one page per command
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin reference front_end")]
pub struct Reference {
    /// Table to list, such as motion, receiver.tracking, study.axis, pack or limits [default: all tables]
    pub table: Option<String>,
}

/// Level of fidelity by its name.
fn grade(name: &str) -> Result<Grade, String> {
    let known = Grade::NAMES.iter().find(|(known, _)| *known == name).map(|(_, grade)| *grade);
    known.ok_or_else(|| format!("expected {}", Grade::NAMES.map(|(name, _)| name).join(", ")))
}

#[derive(Args, Debug, Default)]
#[command(after_help = "Examples:\n  gnss-twin run scenarios/static.toml --seed 7 --keep-if\n  gnss-twin run \
                        scenarios/static.toml --level correlations\n  gnss-twin run scenarios/rtk_static.toml \
                        --station base\n  gnss-twin run scenarios/array_jammed.toml")]
pub struct Run {
    /// Scene to run [default: the embedded scene of GPS and Galileo]
    pub scenario: Option<PathBuf>,
    /// Directory for the results, with one below it for each of several stations [default: reports/SCENE, or
    /// reports/SCENE-NAME with --station NAME or --front-end NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Station to run in a scene with several [default: all, one after the other]
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// Front end to receive in a scene with several [default: all in one reception]
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Level of fidelity, overrides the scene's: fast, balanced, reference; or correlations or observations,
    /// which models give in place of samples
    #[arg(long, value_name = "LEVEL", value_parser = grade)]
    pub level: Option<Grade>,
    /// Noise seed, overrides the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Version of the RINEX files: 3.05 or 4.02
    #[arg(long, value_name = "VERSION", default_value_t)]
    pub rinex: Version,
    /// Keep the samples as if.sigmf-data and if.sigmf-meta
    #[arg(long)]
    pub keep_if: bool,
    /// Exit with code 3 if a limit is broken. Without a file the limits are the verdict's own; a file sets
    /// limits for figures of summary.json
    #[arg(long, value_name = "LIMITS.toml", num_args = 0..=1)]
    pub check: Option<Option<PathBuf>>,
    /// Report to write
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    pub report: ReportForm,
    /// Allow the scene to read files outside its own directory
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
    /// Allow the scene to read files outside its own directory
    #[arg(long)]
    pub allow_outside: bool,
    /// File for the samples. Metadata (.sigmf-meta) and truth (.truth/) are written beside it. A scene with
    /// several front ends needs a directory; it gets NAME.sigmf-data and NAME.sigmf-meta for each front end,
    /// a .sigmf-collection and truth/. A stream carries samples alone, at the reader's pace: - (standard
    /// output), fifo:PATH, file:PATH, tcp:ADDR, rtl-tcp:ADDR. ADDR is the address to listen on for one
    /// client: PORT on this machine alone, or IP:PORT
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Directory for the truth of a stream [default: no truth is written]
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Write RINEX files into the truth directory: the observations of an ideal receiver, and the broadcast
    /// ephemerides. Version 3.05, or --rinex=4.02
    #[arg(long, value_name = "VERSION", num_args = 0..=1, require_equals = true, default_missing_value = "3.05")]
    pub rinex: Option<Version>,
    /// Write the antenna's positions into the truth directory as NMEA 0183: trajectory.nmea
    #[arg(long)]
    pub nmea: bool,
    /// Write the antenna's track into the truth directory, one point per second: trajectory.kml,
    /// trajectory.gpx
    #[arg(long)]
    pub maps: bool,
    /// Write NAME.gnss-sdr.conf beside the samples, a configuration for GNSS-SDR
    #[arg(long)]
    pub gnss_sdr: bool,
    /// Write FILE.tag beside the samples, the description that PocketSDR reads
    #[arg(long)]
    pub pocketsdr: bool,
    /// Packing of samples whose width is that of the scene's converter
    #[command(flatten)]
    pub packed: Bits,
    /// Station whose samples are generated in a scene with several
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// Front end to generate in a scene with several [default: all]
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Sample format, overrides the scene's: ci8, cu8, ci16, cf32, ri8, ri16 [default for rtl-tcp: cu8]
    #[arg(long)]
    pub format: Option<Format>,
    /// Number of the first sample to write. Samples before it are not computed; those after it do not change
    #[arg(long, value_name = "SAMPLE", default_value_t = 0)]
    pub seek: u64,
    /// Number of samples to write [default: up to the end of the scene]
    #[arg(long, value_name = "COUNT")]
    pub samples: Option<u64>,
    /// Noise seed, overrides the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin live scene.toml --motion udp:4567 --to - | hackrf_transfer -t - -f 1575420000 \
                  -s 2600000\n  gnss-twin live scene.toml --clock host --motion udp:4567 --to tcp:5000 --record \
                  reports/flight\n  gnss-twin live scene.toml --clock host --to tcp:5000 --web 8080\n  gnss-twin \
                  generate reports/flight/replay.toml --out again.sigmf-data\n\nStatus: one line of JSON per second \
                  on standard error. Exit code: 3 beyond --max-underruns or --max-late, 130 or 143 after a signal"
)]
pub struct Live {
    /// Scene to send. With motion kind = "pushed" it takes motion and events from --motion
    pub scenario: PathBuf,
    /// Destination of the samples: - (standard output), fifo:PATH, tcp:ADDR, rtl-tcp:ADDR or file:PATH. May
    /// be given several times. The first destination sets the pace; a slower one loses whole ticks, which are
    /// counted
    #[arg(long, value_name = "SINK", default_value = "-")]
    pub to: Vec<Spec>,
    /// Source of the pace
    #[arg(long, value_enum, default_value_t = Clock::Sink)]
    pub clock: Clock,
    /// Time in seconds for which the first sink waits for a receiver in place of one that left tcp:ADDR or
    /// rtl-tcp:ADDR; 0 ends the run at once
    #[arg(long, value_name = "S", default_value_t = 30)]
    pub reconnect: u64,
    /// Lead of the samples over their due time, in milliseconds; a delay up to it causes no underrun
    #[arg(long, value_name = "MS", default_value_t = 8.0, value_parser = latency)]
    pub latency: f64,
    /// Time at which the first sample is sent and which it carries: a UTC second like 2026-11-23T05:00:00Z,
    /// or +S seconds from now [default: sent at once, with the scene's own start time]
    #[arg(long, value_name = "UTC|+S", value_parser = start_at)]
    pub start_at: Option<StartAt>,
    /// Source of motion and events: udp:ADDR, tcp:ADDR or - (standard input). ADDR is PORT on this machine
    /// alone, or IP:PORT
    #[arg(long, value_name = "ORIGIN")]
    pub motion: Option<Origin>,
    /// Origin of the times in motion states
    #[arg(long, value_enum, default_value_t = MotionTime::Scene)]
    pub motion_time: MotionTime,
    /// Destination of the rows of inertial sensors, a datagram each, with the columns of truth/imu.csv:
    /// udp:ADDR. ADDR is PORT on this machine, or IP:PORT. A row leaves when the tick is made in which its
    /// interval ends
    #[arg(long, value_name = "DEST", value_parser = udp_address)]
    pub imu: Option<SocketAddr>,
    /// Directory for a record of the run: the received motion and events, the truth, and replay.toml
    #[arg(long, value_name = "DIR")]
    pub record: Option<PathBuf>,
    /// Serve a page for browsers: PORT on this machine alone (0 for a free one), or IP:PORT. Its address with
    /// the token that admits is printed
    #[arg(long, value_name = "ADDR", value_parser = listen_address)]
    pub web: Option<SocketAddr>,
    /// Receiver that the page shows: the address of receive --json, as tcp:PORT or tcp:HOST:PORT
    #[arg(long, value_name = "PEER", value_parser = tcp_peer, requires = "web")]
    pub web_receiver: Option<String>,
    /// Exit with code 3 after more than N underruns
    #[arg(long, value_name = "N")]
    pub max_underruns: Option<u64>,
    /// Exit with code 3 after more than N late states
    #[arg(long, value_name = "N")]
    pub max_late: Option<u64>,
    /// Station whose samples are sent in a scene with several
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// Front end to send in a scene with several
    #[arg(long, value_name = "NAME")]
    pub front_end: Option<String>,
    /// Sample format, overrides the scene's: ci8, cu8, ci16, cf32, ri8, ri16 [default for rtl-tcp: cu8]
    #[arg(long)]
    pub format: Option<Format>,
    /// Noise seed, overrides the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Allow the scene to read files outside its own directory
    #[arg(long)]
    pub allow_outside: bool,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin watch reports/flight\n  gnss-twin watch tcp:5001 --web 8080\n\nThe page's \
                  address with the token that admits is printed. Ctrl-C ends the program"
)]
pub struct Watch {
    /// Source of the rows: the directory of a run, a record or a reception, finished or not, or tcp:ADDR for
    /// a receiver with --json tcp:ADDR
    pub source: Watched,
    /// Address of the page: PORT on this machine alone (0 for a free one), or IP:PORT
    #[arg(long, value_name = "ADDR", value_parser = listen_address, default_value = "0")]
    pub web: SocketAddr,
}

/// Forms of a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ReportForm {
    /// report.pdf, for paper
    Pdf,
    /// report.html, one page for a browser, with plots that zoom
    Html,
    /// Both files
    #[default]
    Both,
    /// No report
    None,
}

impl ReportForm {
    /// Files that are written.
    pub fn forms(self) -> Forms {
        Forms { pdf: matches!(self, Self::Pdf | Self::Both), html: matches!(self, Self::Html | Self::Both) }
    }
}

/// Source of the pace of a live run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Clock {
    /// The first destination's reading: a radio's own clock
    Sink,
    /// This machine's clock
    Host,
    /// None: as fast as the destinations read
    Free,
}

/// Origin of the times in pushed motion states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MotionTime {
    /// Sample 0 of the scene
    Scene,
    /// The first state, which counts as current when it is used; for a rig whose clock has another origin
    First,
}

/// Start of a live run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartAt {
    /// A given instant.
    Utc(Epoch),
    /// The first whole second at least this many seconds from now.
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
                  reports/now --live --nmea tcp:10110 --json -\n\nExit code: 0 with a fix, 2 for a refused \
                  command line, 3 without a fix (results are written, the reason is printed), 65 if the input is not \
                  a recording, 74 if the sender stopped early (results end there), 130 after Ctrl-C with --live"
)]
pub struct Receive {
    /// Recording or stream. A recording is a SigMF pair (either file), a SigMF archive (.sigmf), a SigMF
    /// collection of front ends that share a clock, ION metadata (.xml, .sdrx, .usbx, .tgx, .smfx), or a raw
    /// file with --format or --bits and --rate-hz. A stream is - (standard input), fifo:PATH, tcp:ADDR of a
    /// server of plain samples, or rtl-tcp:ADDR of an rtl_tcp server. ADDR is HOST:PORT, or PORT on this
    /// machine
    pub file: PathBuf,
    /// Directory for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Write rows as they are found, in DIR.unfinished, which is renamed to DIR at the end. Ctrl-C ends the
    /// stream and completes the results
    #[arg(long)]
    pub live: bool,
    /// Write each fix as NMEA 0183 (GGA, RMC, VTG, ZDA, GSA, GSV) to a file, - (standard output), fifo:PATH,
    /// or the clients of tcp:ADDR
    #[arg(long, value_name = "TO")]
    pub nmea: Option<lines::Spec>,
    /// Write fixes, satellites, channels, searches and events as JSON lines to a file, -, fifo:PATH or
    /// tcp:ADDR. Without a value: print the results as one JSON object
    #[arg(long, value_name = "TO", num_args = 0..=1)]
    pub json: Option<Option<lines::Spec>>,
    /// Print only warnings and errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Write observations.rnx and navigation.rnx in RINEX 3.05, or --rinex=4.02
    #[arg(long, value_name = "VERSION", num_args = 0..=1, require_equals = true, default_missing_value = "3.05")]
    pub rinex: Option<Version>,
    /// Receiver settings [default: built in]
    #[arg(long, value_name = "SETTINGS.toml")]
    pub receiver: Option<PathBuf>,
    /// Signals to search for: names like "GPS L1 C/A,Galileo E1", or all for every signal in the bands
    /// [default: those of the settings; else those of the metadata; else GPS L1 C/A, or all if L1 is outside]
    #[arg(long, value_name = "all|NAMES", value_delimiter = ',')]
    pub signals: Vec<String>,
    /// File that describes a signal, which --signals and the settings may then name; may be repeated
    #[arg(long = "signal-file", value_name = "FILE")]
    pub signal_files: Vec<PathBuf>,
    /// Sample format of a raw file or stream: ci8, cu8, ci16, cf32, ri8, ri16
    #[arg(long)]
    pub format: Option<Format>,
    /// Sample rate of a raw file or stream
    #[arg(long, value_name = "HZ")]
    pub rate_hz: Option<f64>,
    /// Name that other programs have for --rate-hz: refused with that one
    #[arg(long = "sample-rate", hide = true, value_name = "HZ",
          value_parser = UnknownArgumentValueParser::suggest_arg("--rate-hz"))]
    pub sample_rate: Option<String>,
    /// Frequency of GPS L1 (1575.42 MHz) within a raw file's samples. It is positive if 0 Hz of the samples
    /// is
    /// 1575.42 MHz − HZ, and negative if 0 Hz lies above 1575.42 MHz. With --inverted it is the frequency as
    /// it appears in the samples [default: 0 for complex samples; real samples need it]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub if_hz: Option<f64>,
    /// Radio frequency at 0 Hz of a raw file's samples, in place of --if-hz
    #[arg(long, value_name = "HZ", conflicts_with = "if_hz")]
    pub center_hz: Option<f64>,
    /// The raw file's spectrum is inverted (local oscillator above the signal)
    #[arg(long)]
    pub inverted: bool,
    /// Packing of samples and channels in the file
    #[command(flatten)]
    pub packed: Packed,
    /// Time of the first sample: GPS time, or UTC with a final Z. It labels results and resolves the era
    #[arg(long, value_name = "TIME")]
    pub start: Option<String>,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  gnss-twin analyze reports/static --check scenarios/limits.toml\n  gnss-twin analyze \
                  --truth static.truth --rinex-obs rx.26O --nmea rx.nmea --out reports/mine"
)]
pub struct Analyze {
    /// Directory of a run, which holds truth/ and rx/
    #[arg(required_unless_present = "truth", conflicts_with = "truth")]
    pub run: Option<PathBuf>,
    /// Exit with code 3 if a limit is broken. Without a file the limits are the verdict's own; a file sets
    /// limits for figures of summary.json (foreign.json with --truth)
    #[arg(long, value_name = "LIMITS.toml", num_args = 0..=1)]
    pub check: Option<Option<PathBuf>>,
    /// Truth directory of the scene whose samples another receiver was given; judges that receiver
    #[arg(long, value_name = "DIR", requires = "files")]
    pub truth: Option<PathBuf>,
    #[command(flatten)]
    pub files: ReceiverFiles,
    /// Protocol of --log [default: the one with the most frames]
    #[arg(long = "as", value_name = "PROTOCOL", value_enum, requires = "log")]
    pub log_as: Option<LogProtocol>,
    /// Directory for the results about another receiver [default: reports/SCENE-foreign]
    #[arg(long, value_name = "DIR", requires = "truth")]
    pub out: Option<PathBuf>,
    /// Report to write
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    pub report: ReportForm,
    #[command(flatten)]
    pub printed: Printed,
}

#[derive(Args, Debug)]
#[group(id = "files", multiple = true)]
pub struct ReceiverFiles {
    /// Observations of the other receiver: RINEX 2.11, 3 or 4, plain, compact (CRINEX) or gzip
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub rinex_obs: Option<PathBuf>,
    /// Positions of the other receiver: NMEA 0183 with GGA; RMC or ZDA give the date, RMC or VTG the velocity
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub nmea: Option<PathBuf>,
    /// Log of the other receiver as it came out of the device: UBX, RTCM 3 or SBF, known by its content.
    /// Observations of --rinex-obs and positions of --nmea go before its own
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub log: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_help = "Example: gnss-twin plan scenarios/high_dynamics.toml")]
pub struct Plan {
    /// Scene to plan [default: the embedded scene of GPS and Galileo]
    pub scenario: Option<PathBuf>,
    /// Station to plan in a scene with several [default: all]
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// Allow the scene to read files outside its own directory
    #[arg(long)]
    pub allow_outside: bool,
    #[command(flatten)]
    pub printed: Printed,
}
