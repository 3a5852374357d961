//! The command line: arguments as written, one file a subcommand, and what they share.
//!
//! Everything printed goes through writers that return errors, so a full disk or a closed pipe
//! ends in an exit code and never in a panic. Exit codes are listed in `error`.

mod address;
mod analyze;
mod archive;
mod args;
mod baseline;
mod check;
mod collection;
mod error;
mod generate;
mod glimpse;
mod interrupt;
mod ladder;
mod lines;
mod live;
mod logs;
mod made;
mod ntrip;
mod osnma;
mod pack;
mod packed;
#[cfg(feature = "parquet")]
mod parquet;
mod plan;
mod platform;
mod printed;
mod progress;
mod receive;
mod recording;
mod reference;
mod rtcm;
mod run;
mod scenario;
mod scenes;
mod schema;
mod shell;
mod sidecar;
mod sink;
mod source;
mod speed;
mod staging;
mod stations;
mod study;
mod watch;
mod web;

use std::ffi::OsString;
use std::panic::catch_unwind;
use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};
use error::CliError;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    ExitCode::from(main_of(std::env::args_os()))
}

/// Runs the program with these arguments, of which the first is its own name; returns its exit code.
pub fn main_of(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> u8 {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(usage) => {
            let code = usage.exit_code();
            return match usage.print() {
                Ok(()) => code as u8,
                Err(io) => CliError::output("standard output", &io).exit_code(),
            };
        }
    };
    // The panic has been printed by then; what is left of outputs in the making is swept as they are dropped.
    let ended = catch_unwind(|| execute(arguments)).unwrap_or_else(|_| Err(CliError::bug("see above")));
    match ended {
        Ok(()) => 0,
        Err(error) => {
            interrupt::give_way();
            error.print();
            error.exit_code()
        }
    }
}

fn execute(arguments: Arguments) -> Result<(), CliError> {
    interrupt::install()?;
    let command = arguments.command.unwrap_or(Command::Run(args::Run::default()));
    match command {
        Command::Run(arguments) => run::execute(&arguments),
        Command::Generate(arguments) => generate::execute(&arguments),
        Command::Live(arguments) => live::execute(&arguments),
        Command::Watch(arguments) => watch::execute(&arguments),
        Command::Receive(arguments) => receive::execute(&arguments),
        Command::Analyze(arguments) => analyze::execute(&arguments),
        Command::Plan(arguments) => plan::execute(&arguments),
        Command::Study(arguments) => study::execute(&arguments),
        Command::Pack(arguments) => pack::execute(&arguments),
        Command::Logs(arguments) => logs::execute(&arguments),
        Command::Baseline(arguments) => baseline::execute(&arguments),
        Command::Rtcm(arguments) => rtcm::execute(&arguments),
        Command::Osnma(arguments) => osnma::execute(&arguments),
        #[cfg(feature = "parquet")]
        Command::Parquet(arguments) => parquet::execute(&arguments),
        #[cfg(not(feature = "parquet"))]
        Command::Parquet(_) => Err(no_parquet()),
        Command::Reference(arguments) => reference::execute(&arguments),
        Command::Scenes(arguments) => scenes::execute(&arguments),
        Command::Init(arguments) => scenes::init(&arguments),
        Command::Schema(arguments) => schema::execute(&arguments),
        Command::Completions(arguments) => shell::completions(&arguments),
        Command::Man(arguments) => shell::man(&arguments),
    }
}

/// Error of a program without the Parquet feature.
#[cfg(not(feature = "parquet"))]
fn no_parquet() -> CliError {
    CliError::usage("this program was built without Parquet: build it with --features parquet")
}
