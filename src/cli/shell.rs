//! `completions` and `man`, from the command line's own declaration.

use clap::CommandFactory;

use crate::cli::args::{self, Arguments};
use crate::cli::error::CliError;
use crate::cli::scenario;

/// Prints the completions of a shell.
pub fn completions(arguments: &args::Completions) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "gnss-twin", &mut script);
    scenario::print(&String::from_utf8_lossy(&script))
}

/// Writes a page of the manual for each command into a directory that is there.
pub fn man(arguments: &args::Man) -> Result<(), CliError> {
    let error = |error: std::io::Error| CliError::create(arguments.out.display(), &error);
    std::fs::create_dir_all(&arguments.out).map_err(error)?;
    clap_mangen::generate_to(Arguments::command(), &arguments.out).map_err(error)?;
    scenario::print(&format!("pages in {}\n", arguments.out.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn completions_and_pages_know_every_command() {
        let names: Vec<String> = Arguments::command().get_subcommands().map(|one| one.get_name().to_owned()).collect();
        let mut script = Vec::new();
        clap_complete::generate(clap_complete::Shell::Bash, &mut Arguments::command(), "gnss-twin", &mut script);
        let script = String::from_utf8(script).unwrap();
        let directory = tempfile::tempdir().unwrap();
        man(&args::Man { out: directory.path().join("man1") }).unwrap();
        for name in names {
            assert!(script.contains(&format!("gnss__twin__subcmd__{name}")) || script.contains(&name), "{name}");
            let page = std::fs::read_to_string(directory.path().join(format!("man1/gnss-twin-{name}.1"))).unwrap();
            assert!(page.contains(".SH SYNOPSIS"), "{name}");
        }
    }
}
