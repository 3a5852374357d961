//! Files beside samples with which other receivers open them at once: a configuration of GNSS-SDR, and a tag
//! of PocketSDR.

use std::path::Path;

use crate::cli::error::CliError;
use generator::scene::Scene;
use gnss::galileo::e1::E1;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Template of the configuration. Values to fill in are marked by signs.
const TEMPLATE: &str = include_str!("../../assets/gnss-sdr.conf.in");
/// Channels of a system that the samples have.
const CHANNELS: u32 = 12;
/// Distance of carriers from the middle of the samples that an acquisition to ±5 kHz does not notice.
const CENTRED_HZ: f64 = 100.0;

/// The configuration for a scene's samples in a file.
///
/// # Errors
/// Samples that it would not read, by name: real or unsigned ones, carriers off the middle, other signals.
pub fn gnss_sdr(scene: &Scene, samples: &Path) -> Result<String, CliError> {
    let metadata = &scene.metadata;
    let refuse = |what: String| CliError::usage(format!("--gnss-sdr: {what}"));
    let (item, adapter) = match metadata.format {
        Format::Ci8 => ("ibyte", "Ibyte_To_Complex"),
        Format::Ci16Le => ("ishort", "Ishort_To_Complex"),
        Format::Cf32Le => ("gr_complex", "Pass_Through"),
        other => return Err(refuse(format!("format {other}: expected ci8, ci16 or cf32"))),
    };
    let has = |wanted: &'static Signal| scene.signals.contains(&wanted);
    if let Some(other) = scene.signals.iter().find(|signal| ![&L1_CA, &E1].contains(signal)) {
        return Err(refuse(format!("{other}: expected {L1_CA}, {E1} or both")));
    }
    let off_hz = metadata.if_hz(L1_CA.centre_hz());
    if off_hz.abs() > CENTRED_HZ || metadata.inverted {
        let sense = if metadata.inverted { " in a mirrored spectrum" } else { "" };
        return Err(refuse(format!("a carrier at {off_hz} Hz{sense}: expected one in the middle of the samples")));
    }
    let samples = std::path::absolute(samples).map_err(|error| CliError::read(samples.display(), &error))?;
    let channels = |signal: &'static Signal| (if has(signal) { CHANNELS } else { 0 }).to_string();
    let filled = [
        ("@RATE_HZ@", metadata.rate.hz().to_string()),
        ("@SAMPLES@", samples.display().to_string()),
        ("@ITEM@", item.to_owned()),
        ("@ADAPTER@", adapter.to_owned()),
        ("@GPS@", channels(&L1_CA)),
        ("@GALILEO@", channels(&E1)),
        ("@IONOSPHERE@", if has(&L1_CA) { "Broadcast" } else { "OFF" }.to_owned()),
        ("@OUT@", ".".to_owned()),
    ];
    Ok(filled.into_iter().fold(TEMPLATE.to_owned(), |text, (sign, value)| text.replace(sign, &value)))
}

/// PocketSDR's tag for a scene's samples, of which the first is taken at that time: its program's lines of
/// format, sample rate, local oscillator and kind of sampling, in MHz.
///
/// PocketSDR's own front end has its quadrature turned: its `INT8X2` is an inverted spectrum, and `CS8` one
/// as it is.
///
/// # Errors
/// Samples that it would not read, by name.
pub fn pocketsdr(scene: &Scene, start: Epoch) -> Result<String, CliError> {
    let metadata = &scene.metadata;
    let refuse = |what: &str| Err(CliError::usage(format!("--pocketsdr: {what}")));
    let (format, values) = match (metadata.format, metadata.inverted) {
        (Format::Ci8, true) => ("INT8X2", 2),
        (Format::Ci8, false) => ("CS8", 2),
        (Format::Ri8, false) => ("INT8", 1),
        (Format::Ri8, true) => return refuse("real samples of a mirrored spectrum: expected one that is not"),
        (other, _) => return refuse(&format!("format {other}: expected ci8 or ri8")),
    };
    let time = start.to_utc_text();
    let second = time.split('.').next().unwrap_or_default();
    Ok(format!(
        "PROG = gnss-twin\nTIME = {second}Z\nFMT  = {format}\nF_S  = {}\nF_LO = {}\nIQ   = {values}\n",
        metadata.rate.hz() / 1e6,
        metadata.center_hz / 1e6
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::scenario::{compose_all, read};
    use generator::scenario::Overrides;

    fn composed(changes: &[(&str, &str)], format: Option<Format>) -> Scene {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("scene.toml");
        let scene = include_str!("../../scenarios/two_systems.toml").to_owned();
        let scene = changes.iter().fold(scene, |text, (from, to)| text.replace(from, to));
        std::fs::write(&path, scene).unwrap();
        let overrides = Overrides { format, ..Overrides::default() };
        let (mut scenes, _) = compose_all(&read(Some(&path), false).unwrap(), &overrides).unwrap();
        scenes.pop().unwrap()
    }

    fn text(changes: &[(&str, &str)], format: Option<Format>) -> Result<String, CliError> {
        gnss_sdr(&composed(changes, format), Path::new("/if/samples.bin"))
    }

    #[test]
    fn a_configuration_has_rate_format_and_systems_of_the_samples_and_nothing_is_left_to_fill_in() {
        let both = text(&[], None).unwrap();
        assert!(!both.contains('@'), "{both}");
        for line in ["filename=/if/samples.bin", "item_type=ibyte", "Channels_1C.count=12", "Channels_1B.count=12"] {
            assert!(both.contains(line), "{line} in {both}");
        }
        let galileo = text(&[("\"GPS L1 C/A\", ", "")], Some(Format::Cf32Le)).unwrap();
        for line in ["item_type=gr_complex", "implementation=Pass_Through", "Channels_1C.count=0", "iono_model=OFF"] {
            assert!(galileo.contains(line), "{line} in {galileo}");
        }
    }

    #[test]
    fn a_tag_has_the_lines_of_its_program_and_the_sense_of_the_spectrum() {
        let tag = |changes: &[(&str, &str)], format| {
            let scene = composed(changes, format);
            pocketsdr(&scene, scene.clock.start.plus_s(1.5)).map_err(|error| format!("{error:?}"))
        };
        let expected =
            "PROG = gnss-twin\nTIME = 2020-11-29T12:50:13Z\nFMT  = CS8\nF_S  = 6.5\nF_LO = 1575.42\nIQ   = 2\n";
        assert_eq!(tag(&[], None).unwrap(), expected);
        let mirrored = tag(&[("[front_end]", "[front_end]\nspectrum_inverted = true")], None).unwrap();
        assert!(mirrored.contains("FMT  = INT8X2\n"), "{mirrored}");
        let refused = tag(&[], Some(Format::Ci16Le)).unwrap_err();
        assert!(refused.contains("format ci16: expected ci8 or ri8"), "{refused}");
    }

    #[test]
    fn what_that_receiver_would_not_read_is_refused_by_name() {
        let refused = |changes: &[(&str, &str)], format| format!("{:?}", text(changes, format).unwrap_err());
        assert!(refused(&[], Some(Format::Cu8)).contains("format cu8: expected ci8, ci16 or cf32"));
        let off = refused(&[("[front_end]", "[front_end]\nif_hz = 1e5")], None);
        assert!(off.contains("a carrier at 100000 Hz"), "{off}");
    }
}
