//! Playback: a transmitter that sends the signals over a cable through a converter of few bits, and an
//! attenuator.
//!
//! What is played is the sum of all signals without the receiver's noise, rounded to uniform levels around
//! zero; full scale is a multiple of the sum's deviation at the scene's start. Limits: images of the
//! converter lie outside the sampled band and are not made; an error of its reference acts on carriers, codes
//! and times alike and is therefore the receiver clock's drift, with the opposite sign.

use crate::stage::converter::level;
use crate::stage::{Block, Stage};

/// Converter and attenuator of a playback.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// Bits of a component.
    pub bits: u32,
    /// Width of a quantiser level, in LSB of the scene.
    pub step_lsb: f32,
    /// Attenuation beyond the scene's own link, in dB.
    pub attenuation_db: f64,
}

impl Stage for Playback {
    fn name(&self) -> &'static str {
        "playback"
    }

    fn describe(&self) -> String {
        format!("{} bits of {} LSB, attenuation {} dB", self.bits, self.step_lsb, self.attenuation_db)
    }

    fn act(&self, block: &mut Block<'_>) {
        let half = (1_i64 << (self.bits - 1)) as f32;
        let gain = libm::pow(10.0, -self.attenuation_db / 20.0) as f32;
        let (scale, height) = (1.0 / self.step_lsb, self.step_lsb * gain);
        let mut clipped = 0;
        let end = block.i.len() - block.tail.min(block.i.len());
        for plane in [&mut *block.i, &mut *block.q] {
            for (n, x) in plane.iter_mut().enumerate() {
                let y = *x * scale;
                clipped += u64::from((block.lead..end).contains(&n) && y.abs() > half);
                *x = (level(y, half) + 0.5) * height;
            }
        }
        block.clipped += clipped;
    }
}
