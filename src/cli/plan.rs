//! `plan`: what a scene will compute, what not, and why.

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::run::generator_error;
use crate::cli::scenario;
use crate::generator;
use crate::generator::levels::Levels;
use crate::generator::plan::Plan;
use crate::generator::scenario::Overrides;

/// Prints the plan of a scene.
pub fn execute(arguments: &args::Plan) -> Result<(), CliError> {
    let named = scenario::read(arguments.scenario.as_deref())?;
    let (scene, warnings) =
        scenario::compose(&named, &Overrides { allow_outside: arguments.allow_outside, ..Overrides::default() })?;
    scenario::receiver_settings(&named)?;
    for warning in warnings {
        scenario::warn(&warning);
    }
    let machinery = generator::stream::machinery(&scene).map_err(generator_error)?;
    let levels = Levels::new(&scene).map_err(generator_error)?;
    let plan = Plan::new(&scene, machinery, levels).map_err(CliError::input)?;
    scenario::print(&format!("{plan}\n"))
}
