//! Joint tracking of both sidebands of a sub-carrier.
//!
//! Either sideband alone is a code like any other. It is searched for and pulled in by itself, by the
//! triangle of its chips, which has no side peaks. The pilot of each sideband has its own secondary code, and
//! a sum of both needs them. Once the first one's is aligned, the replica has both sidebands, with the signs
//! of the period. Early and late then move nearer to the peak of the sum. A sideband alone brings the code to
//! a few hundredths of a chip. The neighbouring peak of the sum is a third of a chip away for AltBOC(15,10).
//! The channel leaves it like a side peak of any other signal ([`super::side`]).

use super::TrackingSettings;
use super::loops::CodeShape;
use super::model::ReplicaModel;
use super::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};
use super::side::SidePeaks;
use crate::correlate::{Replica, chips_to_units};
use crate::lead::other_side;
use gnss::signal::{Component, Signal};

/// State that a channel needs to track the other sideband too.
#[derive(Clone, Debug)]
pub struct Sides {
    /// Replica of both sidebands, handed over at its first use.
    replica: Option<Replica>,
    secondary_codes: [SecondaryCodeSync; 2],
    both: Both,
}

/// Model of both sidebands together in the correlators.
#[derive(Clone, Debug)]
pub struct Both {
    /// Code phases of early, prompt and late.
    pub taps: [i64; 3],
    /// Correlation there.
    pub shape: CodeShape,
    /// The neighbouring peaks.
    pub peaks: Option<SidePeaks>,
}

impl Sides {
    /// The other side of `pilot` in its signal, with settings that are fitted to it; `None` where it has
    /// none. `sense` is −1 in an inverted spectrum.
    pub fn beside(
        pilot: &Component,
        (signal, number): (&'static Signal, u8),
        settings: &TrackingSettings,
        (rate_hz, sense): (f64, f64),
    ) -> Option<Self> {
        let other = other_side(pilot, signal)?;
        let made = |component| Replica::made_in(component, number, (settings.waveform, settings.replica), sense < 0.0);
        let secondary_code = |component: &Component| Some(SecondaryCodeSync::new(component.secondary_code.of(number)?));
        let half = chips_to_units(0.5 * settings.spacing_chips);
        Some(Self {
            replica: Some(Replica::joined(&made(pilot)?, &made(other)?)?),
            secondary_codes: [secondary_code(pilot)?, secondary_code(other)?],
            both: Both {
                taps: [half, 0, -half],
                shape: ReplicaModel::of_both_sides(settings, pilot, rate_hz)?.shape,
                peaks: SidePeaks::of_both_sides(pilot),
            },
        })
    }

    /// The replica of both, the first time.
    pub fn replica(&mut self) -> Option<Replica> {
        self.replica.take()
    }

    /// Model of both sidebands together.
    pub fn both(&self) -> &Both {
        &self.both
    }

    /// True if the secondary codes of both sidebands have opposite signs in a code period.
    pub fn are_opposed(&self, phase: SecondaryCodePhase, number: u64) -> bool {
        let [first, second] = self.secondary_codes.each_ref().map(|secondary_code| secondary_code.chip(phase, number));
        planted!("receiver.sides.secondary_code", first != second, false)
    }
}
