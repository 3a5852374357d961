//! `osnma`: authentication of Galileo's navigation messages in recordings of pages.

pub mod args;
mod pages;
mod sent;
mod summary;
mod verify;

use crate::cli::error::CliError;
use args::{Osnma, OsnmaAction};

/// Carries out an action of `osnma`.
pub fn execute(arguments: &Osnma) -> Result<(), CliError> {
    match &arguments.action {
        OsnmaAction::Verify(arguments) => verify::execute(arguments),
        OsnmaAction::Pages(arguments) => sent::execute(arguments),
    }
}
