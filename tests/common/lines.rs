//! Effect of sampling on a code, from its spectral lines.
//!
//! A periodic code consists of lines a period apart, whose amplitudes follow from its chips and the waveform
//! of a chip without any filter or sampling. These lines are the truth. The samples of one period are the
//! same lines, with the changes of the edges and with aliases. Their delay is that of an early-minus-late
//! correlator with the exact lines below half the rate. Only the judged samples come from the generator.
//! Limits: codes without data and secondary code, whose period is whole samples.

use std::f64::consts::{PI, TAU};

use fft::Planner;
use generator::synth::bank::Bank;
use generator::synth::waveform::{Voice, Waveform};
use generator::synth::{CODE_ONE, Kernel, RUN_SAMPLES, Run};
use gnss::satellite::Sv;
use gnss::signal::{Component, Layers, SecondaryCode, Signal};
use gnss::time::Epoch;
use num_complex::{Complex, Complex64};

const LIGHT_MPS: f64 = 299_792_458.0;

/// One component of a satellite, and the lines of its code.
pub struct Code {
    bare: &'static Signal,
    number: u8,
    pub period_s: f64,
    chip_s: f64,
    /// Early-late spacing of the correlator in seconds: half a step of the waveform.
    spacing_s: f64,
    /// Steps of the waveform in a period, transformed.
    lines: Vec<Complex<f64>>,
}

/// Errors of a period's samples against the exact code.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Delay of the code, in metres; a chip at most, where a correlator has lost the code.
    pub code_m: f64,
    /// Lead of the carrier, in cycles.
    pub carrier_cycles: f64,
    /// Share of the samples' power that the exact code, within the band, does not correlate with.
    pub lost: f64,
}

impl Code {
    /// The component of that place in a signal; `None` where the satellite has no code.
    pub fn new(signal: &'static Signal, index: usize, number: u8) -> Option<Self> {
        let component = &signal.components[index];
        let chips = (component.code)(number)?;
        let steps = component.layers.iter().fold(1, |all, layer| {
            let own = layer.pulse.len();
            (all..=all * own).step_by(all).find(|common| common % own == 0).unwrap()
        });
        let wave = |chip: usize, step: usize| -> Complex<f64> {
            let of = component.layers.iter().filter(|layer| layer.covers(chip)).map(|layer| {
                let level = f64::from(layer.pulse[step * layer.pulse.len() / steps]);
                Complex::from_polar(layer.weight * level, TAU * layer.phase_cycles)
            });
            of.sum::<Complex<f64>>() * f64::from(chips[chip])
        };
        let mut lines: Vec<_> = (0..chips.len())
            .flat_map(|chip| (0..steps).map(move |step| (chip, step)))
            .map(|(c, s)| wave(c, s))
            .collect();
        Planner::<f64>::new().plan_fft_forward(lines.len()).process(&mut lines);
        let scale = 1.0 / lines.len() as f64;
        lines.iter_mut().for_each(|line| *line *= scale);
        // The component by itself, and the same in each period.
        let alone = Component {
            secondary_code: SecondaryCode::None,
            message: None,
            power_share: 1.0,
            phase_cycles: 0.0,
            ..*component
        };
        let bare = Signal { components: Box::leak(Box::new([alone])), ..*signal };
        Some(Self {
            bare: Box::leak(Box::new(bare)),
            number,
            period_s: component.period_s(),
            chip_s: 1.0 / component.chip_rate_hz,
            spacing_s: 0.5 / (component.chip_rate_hz * steps as f64),
            lines,
        })
    }

    /// The generator's sequences of it; `None` where the rate does not do.
    pub fn voices(&self, kernel: Kernel<'_>, rate_hz: f64) -> Option<Vec<Voice>> {
        let link = self.bare.link(Sv { system: self.bare.system, number: self.number });
        Waveform::new(link, 0).ok()??.voices(Layers::Whole, kernel.edge, rate_hz).ok()
    }

    /// One period of samples of a code at rest, sent `delay_s` before; the carrier turns by whole cycles.
    pub fn samples(&self, voices: &[Voice], kernel: Kernel<'_>, rate_hz: f64, delay_s: f64) -> Vec<Complex<f32>> {
        let samples = (self.period_s * rate_hz).round() as usize;
        let mut bank = Bank::default();
        let (mut i, mut q) = (vec![0.0; samples], vec![0.0; samples]);
        for begin in (0..samples).step_by(RUN_SAMPLES) {
            let count = RUN_SAMPLES.min(samples - begin);
            for (part, voice) in voices.iter().enumerate() {
                let step = (voice.spreading.pace().step_rate_hz() / rate_hz * CODE_ONE as f64).round() as u64;
                let at = voice.spreading.at(epoch(), delay_s - begin as f64 / rate_hz);
                let span = (begin as u64, (begin + count) as u64);
                bank.push(span, part, begin..begin + count, voice.pulse.as_ref(), |bits| Run {
                    bits: &[],
                    position: voice.spreading.strip(at, step, count, |_| false, bits),
                    step,
                    turns: turns(voice.phase_cycles),
                    turns_step: 0,
                    amplitude: 100.0 * voice.amplitude,
                    pulse: None,
                });
            }
        }
        bank.render(kernel, &mut i, &mut q);
        i.into_iter().zip(q).map(|(i, q)| Complex::new(i, q)).collect()
    }

    /// Samples of a period against the exact code sent `delay_s` before.
    pub fn against(&self, samples: &[Complex<f32>], delay_s: f64) -> Found {
        let count = samples.len();
        let mut found: Vec<_> = samples.iter().map(|x| Complex::new(f64::from(x.re), f64::from(x.im))).collect();
        Planner::<f64>::new().plan_fft_forward(count).process(&mut found);
        let (line_hz, steps) = (1.0 / self.period_s, self.lines.len() as i64);
        let sent = epoch().plus_s(-delay_s);
        let into = (sent.fraction() / self.period_s).fract();
        let half = (count as i64 - 1) / 2;
        let weight = |k: i64| 2.0 * libm::sin(PI * k as f64 * line_hz * self.spacing_s);
        let exact = |k: i64| {
            // A step is a pulse of its own length: sinc, and half a step of delay.
            let x = PI * k as f64 / steps as f64;
            let pulse = if k == 0 { 1.0 } else { libm::sin(x) / x };
            self.lines[k.rem_euclid(steps) as usize] * Complex64::from_polar(pulse, TAU * (k as f64 * into).fract() - x)
        };
        let [mut prompt, mut apart, mut steep, mut turning] = [Complex64::ZERO; 4];
        let mut exact_power = 0.0;
        for k in -half..=half {
            let line = exact(k);
            let cross = found[k.rem_euclid(count as i64) as usize] * line.conj();
            let turn = TAU * k as f64 * line_hz;
            exact_power += line.norm_sqr();
            prompt += cross;
            apart += cross * weight(k);
            turning += cross * turn;
            steep += cross * weight(k) * turn;
        }
        let power: f64 = found.iter().map(|x| x.norm_sqr()).sum();
        let ahead = prompt / prompt.norm();
        // A delay turns the prompt correlation by the mean frequency of what the samples have of the code,
        // and the carrier's loop follows that: what is left moves the code.
        let mean = (apart * ahead.conj()).re / prompt.norm();
        let slope = (steep * ahead.conj()).re - mean * (turning * ahead.conj()).re;
        Found {
            code_m: (-(apart * ahead.conj()).im / slope).clamp(-self.chip_s, self.chip_s) * LIGHT_MPS,
            carrier_cycles: ahead.arg() / TAU,
            lost: 1.0 - prompt.norm_sqr() / (power * exact_power),
        }
    }
}

/// A whole second, so that a code's place follows from the delay alone.
fn epoch() -> Epoch {
    Epoch::new(1_300_000_000, 0.0)
}

fn turns(cycles: f64) -> u64 {
    ((cycles - cycles.floor()) * 18_446_744_073_709_551_616.0) as u64
}
