//! `watch`: a page of a receiver's JSON lines, or of a run's directory, for a browser.
//!
//! The directory may be finished or grow. The program serves the page until it is stopped.

use std::path::PathBuf;
use std::str::FromStr;

use crate::cli::address::peer_address;
use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::stations;
use crate::cli::web::{Web, source};
use analysis::show::page::live::Words;

/// Origin of what is shown, as the command line names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Watched {
    /// `tcp:ADDR`: a server of a receiver's JSON lines.
    Tcp(String),
    Directory(PathBuf),
}

impl FromStr for Watched {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("tcp", peer)) => peer_address(peer).map(Self::Tcp),
            _ => crate::cli::address::path(text).map(Self::Directory),
        }
    }
}

/// Parses a peer behind `tcp:`.
///
/// # Errors
/// A message that states what was expected.
pub fn tcp_peer(text: &str) -> Result<String, String> {
    let peer = text.strip_prefix("tcp:").ok_or_else(|| format!("'{text}': expected tcp:HOST:PORT or tcp:PORT"))?;
    peer_address(peer)
}

/// Serves the page until the program is stopped.
pub fn execute(arguments: &args::Watch) -> Result<(), CliError> {
    let (title, subtitle, receiver) = match &arguments.source {
        Watched::Tcp(peer) => (
            format!("tcp:{peer}"),
            "A receiver while it runs",
            "Rows of the receiver's JSON lines. They have no truth.",
        ),
        Watched::Directory(path) => {
            stations::refuse_several(path)?;
            if source::directories(path).is_empty() {
                return Err(CliError::input(format!("{}: no such directory, finished or unfinished", shown(path))));
            }
            (shown(path), "A run's tables", "Rows of the receiver's tables, if there are any in rx/ or here.")
        }
    };
    let words = Words { title, subtitle: subtitle.to_owned(), sources: Vec::new(), receiver: receiver.to_owned() };
    let web = Web::begin(arguments.web, &words, None, None)?;
    match &arguments.source {
        Watched::Tcp(peer) => {
            web.frames()?;
            source::follow_lines(&web, peer, true)
        }
        Watched::Directory(path) => source::follow_directory(&web, path),
    }
}
