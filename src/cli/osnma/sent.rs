//! `osnma pages`: pages that a scene's satellites send on E1-B, in the form that `osnma verify` reads.

use std::fmt::Write;

use crate::cli::error::CliError;
use crate::cli::osnma::args::Pages;
use crate::cli::scenario;
use generator::authentication::gst;
use generator::message::{self, Slot};
use generator::scenario::Overrides;
use generator::scene::Scene;
use gnss::galileo::inav::{INAV, decode_soft};
use gnss::satellite::{Sv, System};
use gnss::time::GST;
use osnma::page::Page;

/// Pages of two seconds that are printed at once: a minute.
const BATCH: i64 = 30;

/// Prints the rows of all pages that begin in the scene.
pub fn execute(arguments: &Pages) -> Result<(), CliError> {
    let named = scenario::read(Some(&arguments.scenario), false)?;
    let overrides = Overrides { seed: arguments.seed, ..Overrides::default() };
    let (scenes, warnings) = scenario::compose_all(&named, &overrides)?;
    warnings.iter().for_each(|warning| scenario::warn(warning));
    let scene = scenes.iter().find(|scene| scene.messages.of(&INAV).is_some()).ok_or_else(|| {
        CliError::input(format!("{}: no satellite sends pages of E1-B: expected \"Galileo E1\" in signals", named.name))
    })?;
    let number = arguments.spoofer.unwrap_or(0);
    if number > scene.spoofers.len() || arguments.spoofer == Some(0) {
        let expected = match scene.spoofers.len() {
            0 => "nothing, because the scene has no spoofer".to_owned(),
            count => format!("a number from 1 to {count}, those of the scene"),
        };
        return Err(CliError::usage(format!("--spoofer {number}: expected {expected}")));
    }
    let begin = GST.label(scene.clock.start);
    let end = GST.label(scene.clock.epoch(scene.samples));
    // The first page that begins in the scene.
    let first = INAV.unit_at(begin.seconds() - 1) + 1;
    let last = INAV.unit_at(end.seconds() - i64::from(end.fraction() == 0.0));
    let mut unit = first;
    while unit <= last {
        let mut text = String::new();
        for unit in unit..=last.min(unit + BATCH - 1) {
            for sv in senders(scene, number) {
                if let Some(page) = page(scene, number, sv, unit)? {
                    let _ = writeln!(text, "{}", page.row());
                }
            }
        }
        scenario::print(&text)?;
        unit += BATCH;
    }
    Ok(())
}

/// Satellites whose pages a constellation sends.
fn senders(scene: &Scene, constellation: usize) -> impl Iterator<Item = Sv> {
    let spoofer = constellation.checked_sub(1).and_then(|index| scene.spoofers.get(index));
    let sends = move |sv: &Sv| spoofer.is_none_or(|spoofer| spoofer.sends(*sv));
    let carries =
        move |sv: &Sv| scene.signals_of(*sv).any(|signal| signal.components.iter().any(|c| c.message == Some(&INAV)));
    scene.senders().filter(|sv| sv.system == System::Galileo).filter(carries).filter(sends)
}

/// Page of a satellite, as it leaves with the faults of its message; `None` for one without an ephemeris or
/// with a symbol error that destroys it.
fn page(scene: &Scene, constellation: usize, sv: Sv, unit: i64) -> Result<Option<Page>, CliError> {
    let faults = if constellation == 0 { scene.message_faults.as_slice() } else { &[] };
    let slot = Slot { message: &INAV, time: &GST, unit };
    let sender = scene.messages.of_constellation(constellation).of(&INAV);
    let Some((sender, set)) = sender.zip(scene.catalogue.sent_at(sv, slot.set_chosen())) else { return Ok(None) };
    let sent = message::unit(faults, sender, [set, set], &slot).map_err(CliError::input)?;
    let soft: Vec<f32> = sent.symbols.iter().map(|&bit| if bit { -1.0 } else { 1.0 }).collect();
    let joined = |bits: &[bool]| bits.iter().fold(0_u128, |all, &bit| all << 1 | u128::from(bit));
    let read = decode_soft(&soft).map(|([even, odd], _)| (joined(&even), joined(&odd)));
    Ok(read.map(|(even, odd)| Page::new(sv.number, gst(INAV.unit_start(unit)), even, odd)))
}
