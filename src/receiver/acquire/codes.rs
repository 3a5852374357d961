//! Spectra of the codes that a search looks for, made when they are first needed and kept for the next
//! search as far as there is room.
//!
//! A spectrum has a value for each lag: 10 kB of C/A, 500 kB of a pilot and its data of 10 ms in BOC(1,1).
//! All candidates of a full sky would take 100 MB, and the codes themselves in the forms that correlators
//! want twice as much, so only spectra stay, and a code is made again for what is found.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::dwells::Spectra;
use super::grid::Grid;
use super::kernel::Spectrum;
use super::refine::Refined;
use super::removal;
use super::replica::Replica;
use super::window::Window;
use super::{AcquireError, Band, companion};
use crate::correlate::correlator::{Code as Made, Coded};
use crate::correlate::{self, Edge, Wave};
use crate::lead::lead;
use gnss::signal::{Component, Layers, Link};

/// Spectra that are kept from one search to the next, in bytes.
const KEPT_BYTES: usize = 8 << 20;

/// A component of one satellite: its code's spectrum, and how to make the code.
struct Sent {
    component: &'static Component,
    number: u8,
    spectrum: Spectrum,
}

impl Sent {
    fn new(grid: &Grid, component: &'static Component, number: u8) -> Option<Self> {
        let spectrum = grid.spectrum(&Replica::new(component, number)?);
        Some(Self { component, number, spectrum })
    }

    fn replica(&self) -> Option<Replica> {
        Replica::new(self.component, self.number)
    }

    fn bytes(&self) -> usize {
        self.spectrum.bytes()
    }
}

/// Codes of one satellite's signal that are searched for.
pub(super) struct Code {
    leading: Sent,
    /// The data beside a pilot, where both are searched for.
    companion: Option<Sent>,
}

impl Code {
    fn new(grid: &Grid, link: Link) -> Option<Self> {
        let component = lead(link.signal)?;
        let leading = Sent::new(grid, component, link.sv.number)?;
        let companion = match companion(component, link.signal) {
            Some(companion) => Some(Sent::new(grid, companion, link.sv.number)?),
            None => None,
        };
        Some(Self { leading, companion })
    }

    /// The code as correlators want it.
    pub fn correlator(&self, link: Link) -> Option<Coded> {
        coded(link, self.leading.component)
    }

    /// True if the leading codes are equal.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.leading.spectrum == other.leading.spectrum
    }

    /// Takes the code, and the one beside it, out of the samples; returns the mean power of the former's sum
    /// over a period.
    pub fn subtract(&self, grid: &Grid, (chips, complex): (f64, bool), place: &Refined, window: &mut Window) -> f64 {
        let mut one = |sent: &Sent| {
            let replica = sent.replica()?;
            let samples = (&mut window.i[..], &mut window.q[..]);
            Some(removal::subtract(grid, chips, &replica, place, complex, samples))
        };
        let power = one(&self.leading);
        self.companion.as_ref().and_then(&mut one);
        power.unwrap_or(0.0)
    }

    /// Spectra of the code and of the one beside it; of a code that is alone the same twice.
    pub fn spectra(&self) -> Spectra<'_> {
        let beside = self.companion.as_ref().unwrap_or(&self.leading);
        [&self.leading.spectrum, &beside.spectrum]
    }

    fn bytes(&self) -> usize {
        self.leading.bytes() + self.companion.as_ref().map_or(0, Sent::bytes)
    }
}

/// A replica of the strongest layer of a component, by which cells are refined.
pub(super) fn coded(link: Link, component: &'static Component) -> Option<Coded> {
    let replica = correlate::Replica::of(Wave::new(component, link.sv.number)?, Edge::Area)?;
    Some(Coded { replica, code: Made::new(link, component, SEARCHED) })
}

/// Replicas that searches make.
pub const SEARCHED: (Layers, Edge) = (Layers::Strongest, Edge::Area);

/// The codes that were needed so far, as far as they are kept.
#[derive(Default)]
pub(super) struct Codes(BTreeMap<Link, Code>);

impl Codes {
    /// Makes the codes of `links` that are not there; each has to have its grid among `grids`.
    pub fn make<'a>(
        &mut self,
        grids: &BTreeMap<Band, Grid>,
        links: impl Iterator<Item = &'a Link>,
    ) -> Result<(), AcquireError> {
        let missing: Vec<Link> = links.copied().filter(|link| !self.0.contains_key(link)).collect();
        let make = |link: &Link| Code::new(grids.get(&Band::of(*link))?, *link);
        let made: Vec<Option<Code>> = missing.par_iter().map(make).collect();
        for (link, code) in missing.into_iter().zip(made) {
            let code = code.ok_or(AcquireError::NoCode { signal: link.signal.name, sv: link.sv })?;
            self.0.insert(link, code);
        }
        Ok(())
    }

    pub fn get(&self, link: &Link) -> Option<&Code> {
        self.0.get(link)
    }

    /// Codes that exist, in the order of satellite and signal.
    #[cfg(test)]
    pub fn values(&self) -> impl Iterator<Item = &Code> {
        self.0.values()
    }

    /// Lets go of what does not fit.
    pub fn trim(&mut self) {
        let mut bytes = 0;
        self.0.retain(|_, code| {
            bytes += code.bytes();
            bytes <= KEPT_BYTES
        });
    }
}
