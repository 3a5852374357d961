//! Laws of two bands, of layers and of the files that a run writes, against documents.

use generator::synth::Edge;
use generator::synth::band::Filter;
use generator::synth::waveform::Waveform;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::exchange::{ObservationFile, Version};
use gnss::galileo::e1::E1;
use gnss::glonass::fdma::{G1, G2};
use gnss::gps::l1ca::L1_CA;
use gnss::record::Observation;
use gnss::satellite::{Sv, System};
use gnss::signal::{Carrier, Layers, Signal};
use gnss::time::Rate;
use receiver::position::combination::Combination;
use receiver::position::smooth::Smoother;

use crate::laws::{Ideal, SAMPLE, noise};

/// L1 C/A on carriers of which neither is L1.
static UPPER: Signal = Signal { name: "upper", carrier: Carrier::Common(1_268.52e6), ..L1_CA };
static LOWER: Signal = Signal { name: "lower", carrier: Carrier::Common(1_176.45e6), ..L1_CA };

/// An observation of a satellite by one of two carriers.
fn row(signal: &'static Signal, sample: u64, pseudorange_m: f64, locked_s: f64) -> Observation {
    let sv = Sv { system: signal.system, number: 7 };
    Observation {
        sample,
        sv,
        signal,
        sent_s: 962_006_778,
        sent_fraction_s: 0.93,
        pseudorange_m,
        carrier_cycles: 2.1e7 / signal.wavelength_m(sv),
        doppler_hz: 0.0,
        cn0_dbhz: 45.0,
        locked_s,
    }
}

/// Galileo OS SIS ICD 2.1, 2.3.3: α = √(10/11) of BOC(1,1) and β = √(1/11) of BOC(6,1), in data and pilot.
#[test]
fn composite_chips_have_a_tenth_as_much_power_in_the_quick_layer_as_in_the_slow_one() {
    let sv = Sv { system: System::Galileo, number: 11 };
    for component in 0..2 {
        let made = Waveform::new(E1.link(sv), component).unwrap().unwrap();
        let amplitudes: Vec<f64> =
            made.voices(Layers::Whole, Edge::Nearest, 1e8).unwrap().iter().map(|voice| voice.amplitude).collect();
        let [slow, quick] = amplitudes[..] else { panic!("{amplitudes:?}") };
        let (alpha, beta) = ((10.0_f64 / 11.0).sqrt(), (1.0_f64 / 11.0).sqrt());
        assert!((slow - alpha).abs() < 1e-6 && (quick - beta).abs() < 1e-6, "{component}: {amplitudes:?}");
    }
}

#[test]
fn what_edges_take_from_a_component_is_not_put_back() {
    let filter = Filter::default();
    let sv = Sv { system: System::Galileo, number: 11 };
    for component in 0..2 {
        let waveform = Waveform::new(E1.link(sv), component).unwrap().unwrap();
        let amplitudes = |edge: Edge<'_>| {
            let voices = waveform.voices(Layers::Whole, edge, 1e8).unwrap();
            voices.iter().map(|voice| voice.amplitude).collect::<Vec<f64>>()
        };
        let sent = amplitudes(Edge::Nearest);
        assert_eq!((amplitudes(Edge::Area), amplitudes(Edge::BandLimited(&filter))), (sent.clone(), sent));
    }
}

/// The ionosphere on L1 follows from the square of the carriers' ratio (IS-GPS-200N, 20.3.3.3.3.3), and so
/// does what noise of both codes makes of it.
#[test]
fn two_bands_neither_of_which_is_l1_show_the_ionosphere_on_l1_and_how_well() {
    let ideal = Ideal::new();
    let [upper, lower] = [&UPPER, &LOWER].map(|signal| (L1_CA.centre_hz() / signal.centre_hz()).powi(2));
    let local = ideal.clock.epoch(SAMPLE);
    let ionosphere_m = 4.0;
    let mut both = Vec::new();
    for seen in ideal.observations(SAMPLE) {
        for (signal, ratio) in [(&UPPER, upper), (&LOWER, lower)] {
            let ahead_m = SPEED_OF_LIGHT_MPS * ideal.catalogue.signal_clock_s(seen.sv, local, signal);
            let pseudorange_m = seen.pseudorange_m + ratio * ionosphere_m - ahead_m;
            both.push(Observation { signal, pseudorange_m, ..seen.clone() });
        }
    }
    let noises = vec![(&UPPER, noise()), (&LOWER, noise())];
    let solved = ideal.solved(noises, &both);
    assert!(solved.ionosphere.len() >= 10);
    let sigma_m = std::f64::consts::SQRT_2 * noise().sigma_m(libm::pow(10.0, 4.5)) / (lower - upper);
    for row in &solved.ionosphere {
        assert!((row.delay_m - ionosphere_m).abs() < 1e-6, "{row:?}");
        assert!((row.sigma_m / sigma_m - 1.0).abs() < 1e-9, "{row:?} {sigma_m}");
    }
}

#[test]
fn a_combination_is_as_old_as_its_younger_carrier_and_may_jump_by_as_much_more_as_it_is_noisier() {
    let rate = Rate::from_hz(1e6).unwrap();
    let smoothed = |second_locked_s: f64, jump_m: f64| {
        let mut smoother = Smoother::new(100.0, 1.0, rate);
        let (mut left, mut ratio) = (0.0, 0.0);
        for (sample, locked_s, off_m) in [(0, 5.0, 0.0), (100_000, second_locked_s, jump_m)] {
            let first = row(&L1_CA, sample, 2.1e7, 5.0 + 1e-6 * sample as f64);
            let second = row(&LOWER, sample, 2.1e7, locked_s);
            let pair = Combination::of(&first, &second).unwrap();
            let off = Observation { pseudorange_m: first.pseudorange_m + off_m, ..first.clone() };
            let pair = Combination { first: &off, ..pair };
            let found = smoother.smooth_combined(&pair);
            (left, ratio) = (found.pseudorange_m - pair.pseudorange_m(), found.variance_ratio);
        }
        (left.abs(), ratio)
    };
    // A carrier goes on, and the second code counts half.
    let (left_m, ratio) = smoothed(5.1, 1.0);
    assert!(left_m > 0.1 && ratio < 1.0, "{left_m} {ratio}");
    // Its partner was locked again: the filter begins with this code.
    assert_eq!(smoothed(0.05, 1.0), (0.0, 1.0));
    // 15 m on L1 are 34 m in the combination, whose noise is 2.6 times that of a code: 77 m may be noise.
    let (left_m, ratio) = smoothed(5.1, 15.0);
    assert!(left_m > 1.0 && ratio < 1.0, "{left_m} {ratio}");
    assert_eq!(smoothed(5.1, 60.0), (0.0, 1.0));
}

#[test]
fn half_of_the_power_is_as_noisy_as_a_signal_of_half_the_power() {
    let whole = noise();
    let half = receiver::position::CodeNoise { share: 0.5, ..whole };
    for cn0_hz in [3e3, 3e4] {
        assert!((half.sigma_m(2.0 * cn0_hz) / whole.sigma_m(cn0_hz) - 1.0).abs() < 1e-12);
        assert!(half.sigma_m(cn0_hz) > 1.4 * whole.sigma_m(cn0_hz));
    }
}

/// RINEX 3.05, tables A2 and A3: satellites and not observations are counted, bit 0 of the indicator is set
/// where lock was lost in between, and slots have the channels of the Russian system's almanac.
#[test]
fn observation_files_count_satellites_flag_slips_and_name_channels() {
    let mut bytes = Vec::new();
    let mut file = ObservationFile::new(&mut bytes, Version::Three, "roof", &[&G1, &G2]);
    for (sample, locked_s) in [(0_u64, 5.0), (1, 6.0), (2, 0.2)] {
        for signal in [&G1, &G2] {
            let one = row(signal, sample, 2.1e7, locked_s);
            let sent_s = one.sent_s + sample as i64;
            file.take(Observation { sent_s, ..one }).unwrap();
        }
    }
    file.finish().unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let slots = text.lines().find(|line| line.ends_with("GLONASS SLOT / FRQ #")).unwrap();
    assert!(slots.starts_with(" 24 R01  1 R02 -4 R03  5 R04  6 R05  1 R06 -4 R07  5 R08  6 "), "{slots}");
    let epochs: Vec<&str> = text.lines().filter(|line| line.starts_with('>')).collect();
    assert!(epochs.len() == 3 && epochs.iter().all(|line| line[32..35] == *"  1"), "{epochs:?}");
    let flags: Vec<&str> = text.lines().filter(|line| line.starts_with("R07")).map(|line| &line[33..34]).collect();
    assert_eq!(flags, [" ", " ", "1"], "{text}");
}
