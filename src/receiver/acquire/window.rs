//! The samples of one search.

use crate::receiver::source::Block;

/// The samples of one search, with their mean taken out: a front end's constant offset correlates with
/// the spectral lines of every code, one each kilohertz for C/A, and would pass for satellites there.
pub(super) struct Window {
    pub first: u64,
    pub i: Vec<f32>,
    pub q: Vec<f32>,
}

impl Window {
    pub fn centred(block: &Block, samples: usize) -> Self {
        let centred = |x: &[f32]| -> Vec<f32> {
            let mean = x.iter().take(samples).map(|x| f64::from(*x)).sum::<f64>() / samples.max(1) as f64;
            x.iter().take(samples).map(|x| (f64::from(*x) - mean) as f32).collect()
        };
        Self { first: block.first, i: centred(block.i), q: centred(block.q) }
    }

    pub fn block(&self) -> Block<'_> {
        Block { first: self.first, i: &self.i, q: &self.q }
    }

    #[cfg(test)]
    pub fn power(&self) -> f64 {
        self.i.iter().zip(&self.q).map(|(i, q)| f64::from(i * i + q * q)).sum()
    }
}
