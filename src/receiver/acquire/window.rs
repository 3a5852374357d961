//! The samples of one search.

use crate::source::{Block, Stretch};

/// The samples of one search, with their mean taken out: a front end's constant offset correlates with
/// the spectral lines of every code, one each kilohertz for C/A, and would pass for satellites there.
pub(super) struct Window {
    pub first: u64,
    pub i: Vec<f32>,
    pub q: Vec<f32>,
}

impl Window {
    pub fn centred(stretch: &Stretch, samples: usize) -> Self {
        let mut planes = stretch.planes(samples);
        for plane in &mut planes {
            let mean = plane.iter().map(|x| f64::from(*x)).sum::<f64>() / samples.max(1) as f64;
            plane.iter_mut().for_each(|x| *x = (f64::from(*x) - mean) as f32);
        }
        let [i, q] = planes;
        Self { first: stretch.first(), i, q }
    }

    pub fn block(&self) -> Block<'_> {
        Block { first: self.first, i: &self.i, q: &self.q }
    }

    #[cfg(test)]
    pub fn power(&self) -> f64 {
        self.i.iter().zip(&self.q).map(|(i, q)| f64::from(i * i + q * q)).sum()
    }
}
