//! Names in words, with units, of figures and keys in plots, for those that a study gives no words of its
//! own.
//!
//! Limits: words of keys follow from their names; a study with a better word gives it as `label`.

use super::{UNITS, unit_of};

/// Figures whose names say too little, without units.
const FIGURES: [(&str, &str); 29] = [
    ("held", "share of runs that hold lock"),
    ("slip_free", "share of runs without a cycle slip"),
    ("lost_after_s", "time until lock is lost"),
    ("interruptions", "interruptions of lock"),
    ("slips_per_hour", "cycle slips"),
    ("on_main_peak", "share of runs on the main correlation peak"),
    ("off_main_peak_s", "time off the main correlation peak"),
    ("phase_mean_deg", "mean phase error"),
    ("phase_peak_deg", "largest phase error"),
    ("code_mean_chips", "mean code error"),
    ("acquisition.detected_share", "share of satellites found by the first search"),
    ("acquisition.false", "false detections of the first search"),
    ("satellites.false_acquired", "satellites acquired that are absent"),
    ("position.fixes", "number of fixes"),
    ("position.first_fix_s", "time to first fix"),
    ("position.error_3d_p95_m", "position error in space, 95 %"),
    ("position.bias_enu_m.0", "mean error east"),
    ("position.bias_enu_m.1", "mean error north"),
    ("position.bias_enu_m.2", "mean error up"),
    ("clock.drift", "clock drift, estimated"),
    ("clock.true_drift", "clock drift, true"),
    ("message.ready_s", "time at which the message is complete"),
    ("message.in_time", "share of runs with a fix once the message is complete"),
    ("first.nees", "NEES of the first fix"),
    ("nominal.last_nees", "NEES of the last fix with nominal ionosphere"),
    ("broadcast.last_nees", "NEES of the last fix with broadcast ionosphere"),
    ("broadcast.step_m", "step to the broadcast ionosphere"),
    ("broadcast.step_sigmas", "step to the broadcast ionosphere (σ)"),
    ("spoofing.displacement_max_m", "largest displacement by the spoofer"),
];

/// Parts of names that are written otherwise in words.
const PARTS: [(&str, &str); 24] = [
    ("p95", "error, 95 %"),
    ("sigma", "jitter, 1 σ"),
    ("rms", "error, rms"),
    ("cn0", "C/N0"),
    ("dll", "DLL"),
    ("pll", "PLL"),
    ("fll", "FLL"),
    ("nees", "NEES"),
    ("oadev", "Allan deviation"),
    ("mdev", "modified Allan deviation"),
    ("1s", "at 1 s"),
    ("doppler", "Doppler"),
    ("if", "IF"),
    ("adc", "ADC"),
    ("agc", "AGC"),
    ("hz", "Hz"),
    ("max", "maximum"),
    ("min", "minimum"),
    ("snr", "SNR"),
    ("prn", "PRN"),
    ("tcxo", "TCXO"),
    ("ocxo", "OCXO"),
    ("nav", "navigation"),
    ("raim", "RAIM"),
];

/// A unit as it is printed.
fn printed(name: &str) -> Option<&'static str> {
    match unit_of(name) {
        "1" => None,
        "m/s^2" => Some("m/s²"),
        "m/s^3" => Some("m/s³"),
        "cycle" => Some("cycles"),
        "chip" => Some("chips"),
        "deg" => Some("degrees"),
        unit => Some(unit),
    }
}

/// A figure in words, with its unit.
pub fn of_figure(name: &str) -> String {
    let name = name.strip_prefix("theory.").unwrap_or(name);
    let known = FIGURES.iter().find(|(known, _)| *known == name);
    let words = known.map_or_else(|| in_words(name), |(_, words)| (*words).to_owned());
    with_unit(words, name)
}

/// A figure in words, beside a column with its unit.
pub fn without_unit(name: &str) -> String {
    let (theory, figure) = name.strip_prefix("theory.").map_or(("", name), |figure| ("theory of ", figure));
    let words = of_figure(figure);
    let unit = printed(figure).map(|unit| format!(" ({unit})")).unwrap_or_default();
    format!("{theory}{}", words.strip_suffix(&unit).unwrap_or(&words))
}

/// A key of the base in words, with its unit.
pub fn of_key(key: &str) -> String {
    // The table's name says where it is written, not what it is.
    let last = key.rsplit('.').next().unwrap_or(key);
    let whole = match last {
        "name" | "mode" | "kind" | "integration" => key.rsplitn(3, '.').take(2).collect::<Vec<_>>(),
        _ => vec![last],
    };
    let stem = whole.into_iter().rev().filter(|part| *part != "name").collect::<Vec<_>>().join("_");
    with_unit(in_words(&stem), last)
}

fn with_unit(words: String, name: &str) -> String {
    match printed(name) {
        Some(unit) => format!("{words} ({unit})"),
        _ => words,
    }
}

/// Words between the lines and points of a name, without its unit.
fn in_words(name: &str) -> String {
    let stem = UNITS.iter().find_map(|(end, _)| name.strip_suffix(end)).unwrap_or(name);
    let part = |part: &str| {
        let known = PARTS.iter().find(|(short, _)| *short == part);
        known.map_or_else(|| part.to_owned(), |(_, words)| (*words).to_owned())
    };
    stem.split(['_', '.']).filter(|part| !part.is_empty()).map(part).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{fixes, model, sampled};

    #[test]
    fn every_figure_has_words_without_underlines_or_points() {
        let names = model::FIGURES.iter().map(|figure| figure.name);
        for name in names.chain(sampled::FIGURES.iter().copied()).chain(fixes::FIGURES.iter().copied()) {
            let words = of_figure(name);
            assert!(!words.contains('_') && !words.replace("95 %", "").contains('.'), "{name}: {words}");
            assert!(unit_of(name) == "1" || words.ends_with(')'), "{name} has a unit: {words}");
        }
        for (name, _) in FIGURES {
            let known = model::FIGURES.iter().any(|figure| figure.name == name)
                || sampled::FIGURES.contains(&name)
                || fixes::FIGURES.contains(&name);
            assert!(known, "{name} is no figure");
        }
    }

    #[test]
    fn names_become_words_with_units() {
        assert_eq!(of_figure("phase_peak_deg"), "largest phase error (degrees)");
        assert_eq!(of_figure("theory.phase_sigma_deg"), "phase jitter, 1 σ (degrees)");
        assert_eq!(of_figure("position.horizontal_p95_m"), "position horizontal error, 95 % (m)");
        assert_eq!(without_unit("position.first_fix_s"), "time to first fix");
        assert_eq!(of_key("receiver.tracking.pll_bandwidth_hz"), "PLL bandwidth (Hz)");
        assert_eq!(of_key("motion.jerk_mps3"), "jerk (m/s³)");
        assert_eq!(of_key("motion.acceleration_mps2"), "acceleration (m/s²)");
        assert_eq!(of_key("front_end.offset_ns"), "offset (ns)");
        assert_eq!(of_key("signal.name"), "signal");
        assert_eq!(of_key("scenario"), "scenario");
    }
}
