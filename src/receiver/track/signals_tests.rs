//! Search and channels on every synthetic signal, one satellite. Its samples are those of a [`Stream`], which
//! are held here to the signal's definition: chips, layers, secondary codes and symbols one by one.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::stream_tests::{Stream, symbol};
use super::*;
use crate::acquire::{Acquired, AcquisitionSettings, search};
use crate::lead::{BOTH_SIDES, followed_db, lead, long_beside, other_side};
use gnss::satellite::Sv;
use gnss::signal::synthetic::{CHANNELS, LONG_BOC, MIXED, MULTIPLEXED, MULTIPLEXED_DATA, QUADRATURE_DATA, SIDES};
use gnss::signal::{Component, Layers, Link, Signal};

/// One satellite's signal: its code at time zero, and a Doppler that code and carrier share.
struct Sky {
    link: Link,
    rate_hz: f64,
    doppler_hz: f64,
    /// Satellite clock at sample 0, in seconds since an epoch at which all codes begin.
    sent_s: f64,
    cn0_dbhz: f64,
    seed: u64,
}

/// A component's values, ready to be looked up.
struct Made {
    component: &'static Component,
    code: Vec<i8>,
    secondary_code: Vec<i8>,
    phasors: Vec<Complex64>,
    /// Amplitude for the mean power of the component's share.
    amplitude: f64,
}

impl Made {
    fn new(component: &'static Component, number: u8) -> Self {
        let code = (component.code)(number).unwrap();
        let duty = code.iter().filter(|chip| **chip != 0).count() as f64 / code.len() as f64;
        let phasor = |phase_cycles: f64| {
            let (sin, cos) = libm::sincos(TAU * phase_cycles);
            Complex64::new(cos, sin)
        };
        let layers = component.layers.iter();
        let phasors = layers.map(|l| phasor(component.phase_cycles + l.phase_cycles) * l.weight).collect();
        let secondary_code = component.secondary_code.of(number).unwrap();
        Self { component, code, secondary_code, phasors, amplitude: (component.power_share / duty).sqrt() }
    }

    /// Random symbols: those of a message, or one a period where the power is that of data.
    fn symbol(&self, period: i64) -> f64 {
        match self.component.periods_per_symbol() {
            Some(periods) => symbol(period.div_euclid(i64::from(periods))),
            None if self.component.power_share < 0.3 && self.secondary_code.len() == 1 => symbol(period),
            None => 1.0,
        }
    }

    /// The component when its code has run for so many chips.
    fn at(&self, chips: f64) -> Complex64 {
        let whole = chips.floor() as i64;
        let (length, steps) = (self.code.len() as i64, chips - chips.floor());
        let period = whole.div_euclid(length);
        let index = whole.rem_euclid(length) as usize;
        let layers = self.component.layers.iter().zip(&self.phasors).filter(|(layer, _)| layer.covers(index));
        let wave: Complex64 = layers
            .map(|(layer, phasor)| phasor * f64::from(layer.pulse[(steps * layer.pulse.len() as f64) as usize]))
            .sum();
        let secondary_code =
            f64::from(self.secondary_code[period.rem_euclid(self.secondary_code.len() as i64) as usize]);
        wave * (self.amplitude * f64::from(self.code[index]) * secondary_code * self.symbol(period))
    }
}

impl Sky {
    fn sent_s(&self, t_s: f64) -> f64 {
        self.sent_s + t_s * (1.0 + self.doppler_hz / self.link.carrier_hz())
    }

    /// Carrier phase by Doppler at a time, and the phase at zero.
    fn cycles(&self, t_s: f64) -> f64 {
        0.2 + self.doppler_hz * t_s
    }

    /// All components over the interval of the sample at a time, without the carrier, by so many looks.
    fn mean(&self, components: &[Made], t_s: f64, looks: u32) -> Complex64 {
        let look_s = |look: u32| (f64::from(look) + 0.5) / f64::from(looks) - 0.5;
        let sent_s = (0..looks).map(|look| self.sent_s(t_s + look_s(look) / self.rate_hz));
        let all = sent_s.flat_map(|sent_s| components.iter().map(move |m| m.at(sent_s * m.component.chip_rate_hz)));
        all.sum::<Complex64>() / f64::from(looks)
    }

    /// Samples of the signal. Means over samples have less power than the signal itself. C/N0 is that of the
    /// samples.
    fn stream(&self) -> Stream {
        let mut stream = Stream::new(self.link, self.rate_hz, self.seed);
        (stream.sent_s, stream.doppler_hz) = (self.sent_s, self.doppler_hz);
        stream.send_symbols();
        stream.cn0_dbhz = self.cn0_dbhz - 10.0 * libm::log10(stream.power());
        stream
    }

    fn find(&self) -> Option<Acquired> {
        let settings = AcquisitionSettings { doppler_max_hz: 1500.0, ..Default::default() };
        let mut stream = self.stream();
        let metadata = stream.metadata();
        search(&metadata, &stream.block((0.25 * self.rate_hz) as usize), &[self.link], &settings).unwrap()[0].1
    }

    /// Code error of a phase of the leading component at sample 0, in chips.
    fn code_error_chips(&self, phase_chips: f64) -> f64 {
        let component = lead(self.link.signal).unwrap();
        let length = f64::from(component.code_chips);
        let true_chips = self.sent_s * component.chip_rate_hz;
        (phase_chips - true_chips + 0.5 * length).rem_euclid(length) - 0.5 * length
    }
}

/// Every synthetic signal at a rate that holds it.
fn skies() -> Vec<Sky> {
    let of = |signal: &'static Signal, number: u8, rate_hz: f64| Sky {
        link: signal.link(Sv { system: signal.system, number }),
        rate_hz,
        doppler_hz: 731.0,
        sent_s: 1_234.567_8,
        cn0_dbhz: 48.0,
        seed: u64::from(number),
    };
    vec![
        of(&LONG_BOC, 5, 5.3e6),
        of(&QUADRATURE_DATA, 7, 12.3e6),
        of(&CHANNELS, 3, 2.6e6),
        of(&MULTIPLEXED, 9, 2.6e6),
        of(&MULTIPLEXED_DATA, 11, 2.6e6),
        of(&MIXED, 2, 5.3e6),
        of(&SIDES, 4, 6.53e6),
    ]
}

#[test]
fn samples_are_the_means_of_the_waveform() {
    for sky in skies() {
        let components: Vec<Made> =
            sky.link.signal.components.iter().map(|component| Made::new(component, sky.link.sv.number)).collect();
        let mut stream = sky.stream();
        // As strong as it has to be for the noise not to be seen.
        stream.cn0_dbhz = 200.0;
        let amplitude = (libm::pow(10.0, 0.1 * stream.cn0_dbhz) / stream.rate_hz).sqrt();
        let block = stream.block((0.05 * sky.rate_hz) as usize);
        for (n, (i, q)) in block.i.iter().zip(block.q).enumerate().step_by(997) {
            let t_s = n as f64 / sky.rate_hz;
            let (sin, cos) = libm::sincos(TAU * (0.07 * n as f64 + sky.cycles(t_s)));
            let expected = sky.mean(&components, t_s, 400) * Complex64::new(cos, sin) * amplitude;
            let found = Complex64::new(f64::from(*i), f64::from(*q));
            // Four hundred looks a sample, which may hold twelve edges of two components.
            assert!((found - expected).norm() < 0.04 * amplitude, "{} {n}: {found} {expected}", sky.link);
        }
    }
}

#[test]
fn every_synthetic_signal_is_found() {
    for sky in skies() {
        let hit = sky.find().unwrap_or_else(|| panic!("{} is not found", sky.link));
        let error_chips = sky.code_error_chips(hit.code_phase_chips);
        println!("{}: {error_chips:+.3} chips, {:.1} Hz, {:.1} dB-Hz", sky.link, hit.doppler_hz, hit.cn0_dbhz);
        assert!(error_chips.abs() < 0.1, "{}: {error_chips} chips", sky.link);
        // A twentieth of the search's bin.
        let bin_hz = 0.5 / lead(sky.link.signal).unwrap().period_s();
        assert!((hit.doppler_hz - sky.doppler_hz).abs() < 0.05 * bin_hz, "{}: {} Hz", sky.link, hit.doppler_hz);
        assert!((hit.cn0_dbhz - sky.cn0_dbhz).abs() < 2.0, "{}: {} dB-Hz", sky.link, hit.cn0_dbhz);
    }
}

/// Errors of a channel between two times, a tick every 10 ms.
struct Followed {
    code_chips: Vec<f64>,
    carrier_cycles: Vec<f64>,
    cn0_dbhz: f64,
    symbols: Vec<Symbol>,
    half_cycle_known: bool,
    channel: Channel,
}

impl Sky {
    fn follow(&self, until_s: f64, from_s: f64) -> Followed {
        let hit = self.find().unwrap();
        let component = lead(self.link.signal).unwrap();
        let mut stream = self.stream();
        let mut channel = Channel::start(&hit, &stream.metadata(), &TrackingSettings::default());
        let mut report = Report::default();
        let (step, length) = ((0.01 * self.rate_hz) as u64, (0.05 * self.rate_hz) as usize);
        while (stream.now() as f64) < until_s * self.rate_hz {
            let block = stream.block(length);
            let inside = block.first..block.first + length as u64;
            let ticks: Vec<u64> = inside.filter(|n| n.is_multiple_of(step)).collect();
            channel.advance(&block, &ticks, &mut report);
        }
        let events: Vec<_> = report.events.iter().map(|(n, event)| (*n as f64 / self.rate_hz, *event)).collect();
        assert!(!channel.is_lost(), "{}: {events:?}", self.link);
        let late: Vec<&Measurement> =
            report.measurements.iter().filter(|m| m.sample as f64 >= from_s * self.rate_hz).collect();
        assert!(late.iter().all(|m| m.locked), "{}: {events:?}", self.link);
        let code = late.iter().map(|m| {
            let sent_s = self.sent_s(m.sample as f64 / self.rate_hz);
            self.wrapped(m.code_fraction * f64::from(component.code_chips) - sent_s * component.chip_rate_hz)
        });
        let carrier = late.iter().map(|m| {
            // In the RINEX sense, against Doppler; the receiver's IF has the phase of the sample count.
            let error = -m.carrier_cycles - self.cycles(m.sample as f64 / self.rate_hz);
            error - error.round()
        });
        let cn0 = late.iter().map(|m| m.cn0_dbhz).sum::<f64>() / late.len() as f64;
        Followed {
            code_chips: code.collect(),
            carrier_cycles: carrier.collect(),
            cn0_dbhz: cn0,
            half_cycle_known: late.iter().all(|m| m.half_cycle_known),
            symbols: report.symbols,
            channel,
        }
    }

    /// A code phase within half a period of zero.
    fn wrapped(&self, chips: f64) -> f64 {
        let length = f64::from(lead(self.link.signal).unwrap().code_chips);
        (chips + 0.5 * length).rem_euclid(length) - 0.5 * length
    }
}

fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64;
    (mean, square.sqrt())
}

#[test]
fn every_synthetic_signal_is_followed_with_the_phase_of_the_whole_signal() {
    for sky in skies() {
        let found = sky.follow(4.0, 2.5);
        let (code, carrier) = (moments(&found.code_chips), moments(&found.carrier_cycles));
        println!(
            "{}: code {:+.4} ± {:.4} chips, carrier {:+.4} ± {:.4} cycles, {:.2} dB-Hz, {} symbols",
            sky.link,
            code.0,
            code.1,
            carrier.0,
            carrier.1,
            found.cn0_dbhz,
            found.symbols.len()
        );
        let component = lead(sky.link.signal).unwrap();
        let sides = other_side(component, sky.link.signal).map_or(1.0, |_| BOTH_SIDES);
        let followed_db = followed_db(component, Layers::Strongest);
        let followed_hz = sides * libm::pow(10.0, 0.1 * (sky.cn0_dbhz + followed_db));
        // Early minus late of a correlation of slope s at ±d/2: σ² = B·(1 − R(d))/(2 s² C/N0) (squaring loss
        // apart), and both the mean over a second and a half of a loop of half a hertz and its scatter are
        // within 4 σ.
        let settings = TrackingSettings::default().fitted(component);
        let model = if sides > 1.0 { ReplicaModel::of_both_sides } else { ReplicaModel::new };
        let shape = model(&settings, component, sky.rate_hz).unwrap().shape;
        let sigma =
            (settings.dll_bandwidth_hz * (1.0 - shape.common) / (2.0 * shape.slope * shape.slope * followed_hz)).sqrt();
        assert!(code.0.abs() < 4.0 * sigma + 0.002, "{}: {} chips for {sigma}", sky.link, code.0);
        assert!(code.1 < 2.5 * sigma + 0.002, "{}: {} chips for {sigma}", sky.link, code.1);
        // σ² = B/(C/N0)·(1 + 1/(2T·C/N0)) rad².
        let t_s = component.period_s();
        let squaring = 1.0 + 0.5 / (t_s * followed_hz);
        let sigma = (settings.pll_bandwidth_hz / followed_hz * squaring).sqrt() / TAU;
        assert!(carrier.1 < 1.5 * sigma, "{}: {} cycles for {sigma}", sky.link, carrier.1);
        // The whole signal's phase, where the secondary code shows half cycles; the mean of 27 independent
        // values.
        let overlaid = component.message.is_none() && component.secondary_code.periods() > 1;
        let is_pilot = overlaid || long_beside(component, sky.link.signal).is_some();
        assert_eq!(found.half_cycle_known, is_pilot, "{}", sky.link);
        let off = if is_pilot { carrier.0 } else { carrier.0 - 0.5 * (2.0 * carrier.0).round() };
        assert!(off.abs() < 0.004 + sigma, "{}: {} cycles", sky.link, carrier.0);
        assert!((found.cn0_dbhz - sky.cn0_dbhz).abs() < 1.0, "{}: {} dB-Hz", sky.link, found.cn0_dbhz);
        // Data beside a pilot: the channel's periods are counted from its own first.
        let data = sky.link.signal.components.iter().find(|c| c.message.is_some());
        if let Some(periods) = data.and_then(Component::periods_per_symbol).filter(|_| is_pilot) {
            let length = i64::from(periods);
            let first = (sky.sent_s / component.period_s()).floor() as i64;
            assert!(found.symbols.len() >= 50, "{}", sky.link);
            for found in found.symbols.iter().filter(|symbol| symbol.end as f64 > 2.5 * sky.rate_hz) {
                let number = (first + found.first_period as i64).div_euclid(length);
                assert_eq!(f64::from(found.soft.signum()), symbol(number), "{} symbol {number}", sky.link);
            }
        }
        assert_eq!(found.channel.link(), sky.link);
    }
}

/// A period's half cycle beside the carrier, 1/(2T), where sums of periods with signs of their own have side
/// lobes.
#[test]
fn no_channel_stays_locked_beside_its_carrier_where_each_period_has_a_sign_of_its_own() {
    use gnss::beidou::b2b::B2B;
    use gnss::beidou::in_phase::{B1I, B3I};
    use gnss::galileo::e1::E1;
    use gnss::gps::l1c::L1C;
    use gnss::satellite::System;
    let all: [(&'static Signal, System, u8, f64); 6] = [
        (&B1I, System::BeiDou, 20, 5e6),
        (&B1I, System::BeiDou, 2, 5e6),
        (&B3I, System::BeiDou, 20, 21e6),
        (&B2B, System::BeiDou, 20, 21e6),
        (&E1, System::Galileo, 11, 5e6),
        (&L1C, System::Gps, 4, 5e6),
    ];
    for (signal, system, number, rate_hz) in all {
        let link = signal.link(Sv { system, number });
        let component = lead(signal).unwrap();
        for (cn0_dbhz, side) in [(44.0, 1.0), (44.0, -1.0), (38.0, 1.0)] {
            let mut stream = Stream::new(link, rate_hz, 17);
            (stream.doppler_hz, stream.cn0_dbhz, stream.sent_s) = (1234.0, cn0_dbhz, 0.0123);
            stream.send_symbols();
            let doppler_hz = stream.doppler_hz + side * 0.5 / component.period_s();
            let chips = stream.chips(0.0).rem_euclid(f64::from(component.code_chips));
            let (sv, code_phase_chips) = (link.sv, chips);
            let hit = Acquired { sv, signal, sample: 0, code_phase_chips, doppler_hz, cn0_dbhz };
            let mut channel = Channel::start(&hit, &stream.metadata(), &TrackingSettings::default());
            let (mut report, length) = (Report::default(), (0.02 * rate_hz) as usize);
            for _ in 0..150 {
                let block = stream.block(length);
                channel.advance(&block, &[], &mut report);
            }
            let events: Vec<_> = report.events.iter().map(|(n, event)| (*n as f64 / rate_hz, *event)).collect();
            let off_hz = channel.doppler_hz() - stream.doppler_hz;
            println!("{link} {cn0_dbhz} dB-Hz {side:+}: {off_hz:+.1} Hz, {events:?}");
            // Three seconds after its start: locked, and nowhere near the other side of a quarter.
            assert!(channel.is_settled() && off_hz.abs() < 0.05 / component.period_s(), "{link}: {off_hz} {events:?}");
        }
    }
}

#[test]
fn integrations_are_as_long_as_set_under_the_code_of_bits_and_nothing_looks_like_a_slip_at_36_dbhz() {
    use gnss::beidou::d1d2::D1_D2;
    use gnss::beidou::in_phase::B1I;
    use gnss::record::Event;
    use gnss::satellite::System;
    // D1 has bits of 20 ms under a code, D2 of 2 ms.
    for (number, integration_s) in [(20, 4e-3), (2, 2e-3)] {
        let link = B1I.link(Sv { system: System::BeiDou, number });
        let signs = (D1_D2.bit)(link.sv);
        for seed in 1..=4 {
            let mut stream = Stream::new(link, 5e6, seed);
            (stream.doppler_hz, stream.cn0_dbhz, stream.sent_s) = (-1234.0, 36.0, 0.0123 + 1e-3 * seed as f64);
            stream.send_bits(signs);
            let code_phase_chips = stream.chips(0.0).rem_euclid(2046.0);
            let hit = Acquired {
                sv: link.sv,
                signal: &B1I,
                sample: 0,
                code_phase_chips,
                doppler_hz: stream.doppler_hz + 20.0,
                cn0_dbhz: 36.0,
            };
            let mut channel = Channel::start(&hit, &stream.metadata(), &TrackingSettings::default());
            let (mut report, length) = (Report::default(), 100_000);
            for _ in 0..250 {
                let block = stream.block(length);
                let last = block.first + length as u64 - 1;
                channel.advance(&block, &[last], &mut report);
            }
            let events: Vec<Event> = report.events.iter().map(|(_, event)| *event).collect();
            println!("{link}: {events:?}");
            assert_eq!(events.iter().filter(|event| **event == Event::CycleSlip).count(), 0, "{link} {events:?}");
            assert_eq!(report.rows.last().unwrap().integration_s, integration_s, "{link}");
            // Every symbol comes out once, in order and as it was sent, the same way up: one in 430 is wrong.
            let numbers: Vec<u64> = report.symbols.iter().map(|symbol| symbol.first_period).collect();
            assert!(numbers.len() > 3000 && numbers.windows(2).all(|two| two[1] == two[0] + 1), "{link}");
            let first = (stream.sent_s / 1e-3).floor() as i64;
            let late = report.symbols.iter().filter(|symbol| symbol.end > 10_000_000);
            let alike = late.map(|found| {
                let (number, length) = (first + found.first_period as i64, signs.len() as i64);
                let sign = f64::from(signs[number.rem_euclid(length) as usize]);
                f64::from(found.soft.signum()) == sign * symbol(number.div_euclid(length))
            });
            let alike: Vec<bool> = alike.collect();
            let share = alike.iter().filter(|alike| **alike).count() as f64 / alike.len() as f64;
            assert!(!(0.01..0.99).contains(&share), "{link}: {share}");
        }
    }
}
