//! Early and late correlators of a channel's rows, against the correlation functions of BPSK and BOC(1,1).

use num_complex::Complex64;

use super::stream_tests::Stream;
use super::*;
use crate::acquire::Acquired;
use crate::lead::lead;
use gnss::gps::l1ca::L1_CA;
use gnss::record::TrackingRow;
use gnss::satellite::{Sv, System};
use gnss::signal::Link;
use gnss::signal::synthetic::LONG_BOC;

/// Rows of the second half of 4 s at 50 dB-Hz, one in 20 ms.
fn rows(link: Link, rate_hz: f64) -> Vec<TrackingRow> {
    let mut stream = Stream::new(link, rate_hz, 1);
    (stream.doppler_hz, stream.cn0_dbhz, stream.sent_s) = (-1234.0, 50.0, 0.0123);
    let code_chips = f64::from(lead(link.signal).unwrap().code_chips);
    let hit = Acquired {
        sv: link.sv,
        signal: link.signal,
        sample: 0,
        code_phase_chips: stream.chips(0.0).rem_euclid(code_chips),
        doppler_hz: stream.doppler_hz + 20.0,
        cn0_dbhz: 50.0,
    };
    let mut channel = Channel::start(&hit, &stream.metadata(), &TrackingSettings::default());
    let (mut report, length) = (Report::default(), (0.02 * rate_hz) as usize);
    for _ in 0..200 {
        let block = stream.block(length);
        channel.advance(&block, &[block.first + length as u64 - 1], &mut report);
    }
    report.rows.split_off(100)
}

/// Early, prompt and late of a row.
fn taps(row: &TrackingRow) -> [Complex64; 3] {
    let early = Complex64::new(row.early_i.unwrap(), row.early_q.unwrap());
    let late = Complex64::new(row.late_i.unwrap(), row.late_q.unwrap());
    [early, Complex64::new(row.prompt_i, row.prompt_q), late]
}

/// Correlation of a code with itself one chip later.
fn neighbour(link: Link) -> f64 {
    let code = (lead(link.signal).unwrap().code)(link.sv.number).unwrap();
    let products = code.iter().zip(code.iter().cycle().skip(1)).map(|(a, b)| f64::from(a * b));
    products.sum::<f64>() / code.len() as f64
}

#[test]
fn early_and_late_of_a_row_lie_on_the_correlation_function_about_its_prompt() {
    let own = L1_CA.link(Sv::gps(7));
    let boc = LONG_BOC.link(Sv { system: System::Galileo, number: 5 });
    // The correlation falls by 1 a chip for BPSK and by 3 for BOC(1,1), where neighbouring chips are
    // independent. Those of a code have a correlation ρ: 1 − ρ and 3 + ρ.
    for (link, rate_hz, spacing_chips, free, slope) in
        [(own, 5e6, 0.5, 1.0, 1.0 - neighbour(own)), (boc, 12.3e6, 0.25, 3.0, 3.0 + neighbour(boc))]
    {
        let rows = rows(link, rate_hz);
        let found_chips = rows[0].tap_spacing_chips.unwrap();
        assert!((found_chips - spacing_chips).abs() < 1e-9, "{link}: {found_chips}");
        let mean = |tap: usize| rows.iter().map(|row| taps(row)[tap].norm()).sum::<f64>() / rows.len() as f64;
        let [early, prompt, late] = [0, 1, 2].map(mean);
        // Samples and replica are means over samples of w chips: the peak loses w/3 of the slope, and a side
        // that is further away than w loses nothing.
        let sample_chips = lead(link.signal).unwrap().chip_rate_hz / rate_hz;
        assert!(sample_chips < 0.5 * spacing_chips);
        let expected = (1.0 - 0.5 * slope * spacing_chips) / (1.0 - slope * sample_chips / 3.0);
        println!("{link}: {:.4} {:.4}, expected {expected:.4}", early / prompt, late / prompt);
        // The noise of a tap is 7 % of the prompt in 1 ms at 50 dB-Hz, and less in 4 ms at the 47 dB-Hz of
        // half of the power: means of 100 rows err by 0.7 %. Twice that is allowed.
        for side in [early, late] {
            assert!((side / prompt - expected).abs() < 0.015, "{link}: {early} {prompt} {late}, expected {expected}");
        }
        // The discriminator of the row is that of its taps, positive where early is the larger one. It knows
        // no ρ, and gives back a mean gain that at 100 = T·C/N0 is 0.9 % below one.
        let factor = (1.0 - 0.5 * free * spacing_chips) / (2.0 * free);
        for row in &rows {
            let [e, _, l] = taps(row).map(|tap| tap.norm_sqr());
            let expected_chips = factor * (e - l) / (e + l);
            let off_chips = (row.dll_discriminator_chips - expected_chips).abs();
            assert!(off_chips < 0.02 * expected_chips.abs() + 1e-9, "{link}: {row:?}, expected {expected_chips}");
        }
    }
}
