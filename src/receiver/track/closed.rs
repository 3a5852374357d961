//! The three loops of a channel as they are closed: which discriminator drives which loop, with which gains.
//!
//! Takes the correlations of an integration and gives the rates and jumps of the oscillators. It knows
//! neither samples nor time of day, so that modelled correlations can drive the loops of a channel as well as
//! real ones. The code loop is aided by the carrier, which is left to the owner of the oscillators.

use num_complex::Complex64;

use super::loops::{self, CodeGain, CodeShape, Gains, Rates};
use super::{CodeDiscriminator, TrackingSettings};

/// Set of loops that correct the carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The frequency loop alone, updated every code period.
    Frequency,
    /// The phase loop with a frequency loop of order 1 beside it, updated every code period.
    Assisted,
    /// The phase loop alone, updated every `integration` code periods.
    Phase,
}

impl Mode {
    /// Code periods a loop update, of `group` in a symbol.
    pub fn periods_per_update(self, settings: &TrackingSettings, group: u32) -> u32 {
        match self {
            Self::Phase => (1..=settings.integration.max(1)).rev().find(|m| group.is_multiple_of(*m)).unwrap_or(1),
            Self::Frequency | Self::Assisted => 1,
        }
    }
}

/// Measurements of an update, and the jumps of the oscillators' phases that follow from them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Update {
    /// Prompt sum, scaled to noise of the variance of one code period's.
    pub prompt: Complex64,
    /// Early and late sums, scaled as the prompt.
    pub sides: [Complex64; 2],
    /// Time of the integration.
    pub integration_s: f64,
    /// Code discriminator.
    pub dll_chips: f64,
    /// Phase discriminator.
    pub pll_cycles: f64,
    /// Frequency error in hertz. In mode [`Mode::Phase`] it is only reported.
    pub fll_hz: f64,
    /// Phase that the loop adds at once.
    pub carrier_jump_cycles: f64,
    /// Code phase that the loop adds at once.
    pub code_jump_chips: f64,
}

/// Gains and rates of the loops of one channel.
#[derive(Clone, Debug)]
pub struct Loops {
    /// Carrier: hertz. Its [`Rates::mean`] over an update is what the oscillator runs at.
    pub carrier: Rates,
    /// Code, beyond what the carrier's aid brings: chips a second.
    pub code: Rates,
    pll: Gains,
    fll: Gains,
    dll: Gains,
    discriminator: CodeDiscriminator,
    shape: CodeShape,
    gain: CodeGain,
    has_symbols: bool,
}

impl Loops {
    /// Loops that run at `carrier_hz` and correct nothing before they are designed.
    pub fn new(settings: &TrackingSettings, shape: CodeShape, has_symbols: bool, carrier_hz: f64) -> Self {
        let none = Gains::of_root(1, 1.0);
        Self {
            carrier: Rates { rate: carrier_hz, acceleration: 0.0 },
            code: Rates::default(),
            pll: none,
            fll: none,
            dll: none,
            discriminator: settings.dll_discriminator,
            shape,
            gain: gain(settings, shape),
            has_symbols,
        }
    }

    /// The correlation at early and late is another from now on.
    pub fn reshape(&mut self, settings: &TrackingSettings, shape: CodeShape) {
        (self.shape, self.gain) = (shape, gain(settings, shape));
    }

    /// Prompts have no signs of symbols from now on.
    pub fn wipe(&mut self) {
        self.has_symbols = false;
    }

    /// Sets the gains for updates every `update_s`; `wide` asks for the code loop's pull-in bandwidth.
    pub fn design(&mut self, settings: &TrackingSettings, mode: Mode, wide: bool, update_s: f64) {
        let (fll_order, fll_hz) = match mode {
            Mode::Frequency => (settings.fll_order, settings.fll_bandwidth_hz),
            Mode::Assisted | Mode::Phase => (1, settings.fll_assist_bandwidth_hz),
        };
        let dll_hz = if wide { settings.dll_pull_in_bandwidth_hz } else { settings.dll_bandwidth_hz };
        self.fll = Gains::design(fll_order, fll_hz * update_s);
        let pll_scale = planted!("receiver.loops.pll_bandwidth", 1.0, 1.5);
        let dll_hz = planted!("receiver.loops.dll_bandwidth", dll_hz, 6.0 * dll_hz);
        self.pll = Gains::design(settings.pll_order, pll_scale * settings.pll_bandwidth_hz * update_s);
        self.dll = Gains::design(settings.dll_order, dll_hz * update_s);
    }

    /// The code's aid brings `chips_per_s` more from now on: the loop need not. Gives the error that it had
    /// for that, which is the jump of the code's oscillator: a loop of order 1 lags by rate · T / K1, one of
    /// order 2 knows the rate.
    pub fn aid_code(&mut self, chips_per_s: f64, update_s: f64) -> f64 {
        if self.dll.rate > 0.0 {
            self.code.rate -= chips_per_s;
            return 0.0;
        }
        chips_per_s * update_s / self.dll.phase
    }

    /// Closes the loops with the sums of early, prompt, late, and very early less very late where the
    /// discriminator takes them, over the `periods` code periods of an integration of `t_s`. `before` is the
    /// prompt `t_s` earlier, `cn0_hz` the best estimate of C/N0.
    pub fn close(
        &mut self,
        mode: Mode,
        [early, prompt, late, outer]: [Complex64; 4],
        before: Option<Complex64>,
        periods: u32,
        t_s: f64,
        cn0_hz: Option<f64>,
    ) -> Update {
        let mut update = Update { prompt, sides: [early, late], integration_s: t_s, ..Update::default() };
        let scale = f64::from(periods).sqrt();
        update.prompt /= scale;
        update.sides.iter_mut().for_each(|side| *side /= scale);
        if let Some(before) = before {
            // Two quadrants do not mind a symbol in between.
            update.fll_hz = if self.has_symbols || mode == Mode::Phase {
                loops::frequency_two_quadrant(before, prompt, t_s)
            } else {
                loops::frequency_four_quadrant(before, prompt, t_s)
            };
            match mode {
                Mode::Frequency => self.carrier = loops::frequency_step(&self.fll, &self.carrier, update.fll_hz, t_s),
                Mode::Assisted => self.carrier.rate += self.fll.phase * update.fll_hz,
                Mode::Phase => {}
            }
        }
        update.pll_cycles = if self.has_symbols { loops::costas(prompt) } else { loops::phase(prompt) };
        if mode != Mode::Frequency {
            (self.carrier, update.carrier_jump_cycles) = loops::step(&self.pll, &self.carrier, update.pll_cycles, t_s);
        }
        let gain = cn0_hz.map_or(1.0, |hz| self.gain.at(hz * t_s));
        update.dll_chips = match self.discriminator {
            CodeDiscriminator::EarlyMinusLate => loops::early_minus_late(early, late, &self.shape, gain),
            CodeDiscriminator::DotProduct => loops::dot_product(early, prompt, late, &self.shape, gain),
            CodeDiscriminator::DoubleDelta => {
                let inner = early - planted!("receiver.loops.outer", 0.5, 0.0) * outer;
                loops::dot_product(inner, prompt, late, &self.shape, gain)
            }
        };
        (self.code, update.code_jump_chips) = loops::step(&self.dll, &self.code, update.dll_chips, t_s);
        update
    }
}

/// Mean gain of the code discriminator.
fn gain(settings: &TrackingSettings, shape: CodeShape) -> CodeGain {
    match settings.dll_discriminator {
        CodeDiscriminator::EarlyMinusLate => CodeGain::new(shape, |shape, snr| shape.early_minus_late_gain(snr)),
        CodeDiscriminator::DotProduct | CodeDiscriminator::DoubleDelta => {
            CodeGain::new(shape, |_, snr| loops::dot_product_gain(snr))
        }
    }
}
