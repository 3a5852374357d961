//! The table that a terminal shows after a run.

use std::collections::BTreeSet;
use std::fmt;

use crate::judge::judgement::Status;
use crate::judge::rules::{CORRELATIONS, OBSERVATIONS};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::consistency::Calibration;
use crate::measure::inertial::Limited;
use crate::statistics::Spread;

/// True of a level of fidelity at which no samples are made.
pub(crate) fn is_modelled(level: &str) -> bool {
    [CORRELATIONS, OBSERVATIONS].contains(&level)
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rate_msps = self.sample_rate_hz / 1e6;
        let Self { scene, duration_s, seed, .. } = self;
        if is_modelled(&self.fidelity) {
            let level = &self.fidelity;
            writeln!(f, "{scene} · {duration_s} s modelled at level {level}, without samples · seed {seed}")?;
        } else {
            writeln!(f, "{scene} · {duration_s} s at {rate_msps} Msps · seed {seed}")?;
        }
        self.satellite_lines(f)?;
        writeln!(f, "\n{:<26}{:>12}{:>12}{:>12}", "error", "mean", "sigma", "95 %")?;
        let details = &self.details;
        line(f, "pseudorange* (m)", details.pseudorange_m)?;
        line(f, "carrier phase (cycles)", details.carrier_cycles)?;
        line(f, "Doppler (Hz)", details.doppler_hz)?;
        line(f, "C/N0 (dB)", details.cn0_db)?;
        line(f, "position east (m)", details.east_m)?;
        line(f, "position north (m)", details.north_m)?;
        line(f, "position up (m)", details.up_m)?;
        line(f, "clock (m)", details.clock_m)?;
        line(f, "velocity, magnitude (m/s)", details.velocity_mps)?;
        if let (Some(mean), Some(p95)) = (self.position.horizontal_mean_m, self.position.horizontal_p95_m) {
            writeln!(f, "{:<26}{mean:>12.3}{:>12}{p95:>12.3}", "horizontal distance (m)", "")?;
        }
        writeln!(f, "* the part common to all satellites of an epoch removed")?;
        self.loop_lines(f)?;
        self.clock_lines(f)?;
        write!(f, "\n{}", self.details.verdict)?;
        self.speed_line(f)
    }
}

impl Summary {
    fn satellite_lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = &self.satellites;
        write!(f, "satellites    {} in view, {} acquired, {} used", count.in_view, count.acquired, count.used)?;
        if !self.details.false_satellites.is_empty() {
            write!(f, ", false: {}", self.details.false_satellites.join(" "))?;
        }
        writeln!(f)?;
        match self.position.first_fix_s {
            Some(first_s) => writeln!(f, "first fix     {first_s:.1} s, {} fixes", self.position.fixes)?,
            None => writeln!(f, "first fix     none")?,
        }
        let navigation = &self.navigation;
        writeln!(
            f,
            "navigation    {} parameters checked, {} wrong",
            navigation.parameters_checked, navigation.parameters_wrong
        )?;
        for row in self.details.wrong_parameters.iter().take(5) {
            writeln!(f, "              {} issue {}: {} decoded as {}", row.sv, row.issue, row.parameter, row.raw)?;
        }
        let details = &self.details;
        if let (Some(measured), Some(expected), Some(set)) =
            (details.cn0_measured_dbhz, details.cn0_expected_dbhz, details.cn0_true_dbhz)
        {
            writeln!(
                f,
                "C/N0          {measured:.2} dB-Hz measured, {expected:.2} expected: {set:.2} at the antenna, less \
                 front end{} and the other satellites' codes",
                if self.jammed { ", interference" } else { "" }
            )?;
        }
        if self.details.unmatched_observations > 0 {
            writeln!(f, "observations  {} have no truth", self.details.unmatched_observations)?;
        }
        if let Some(lines) = &self.interference {
            write!(
                f,
                "interference  {} of {} s with a continuous wave reported, {} reported in error",
                lines.wave_seconds_told, lines.wave_seconds, lines.false_told
            )?;
            if let (Some(error_hz), Some(error_db)) = (lines.frequency_error_max_hz, lines.jn0_error_max_db) {
                write!(f, "; frequency within {error_hz:.1} Hz, J/N0 within {error_db:.1} dB")?;
            }
            writeln!(f)?;
        }
        if let Some(spoofing) = &self.spoofing {
            let metres = |value: Option<f64>| number(value, 1);
            let clock_m = spoofing.claimed_clock_max_m;
            let clock = if clock_m > 0.05 { format!(" and {clock_m:.1} m of clock") } else { String::new() };
            writeln!(
                f,
                "spoofing      fixes up to {} m from the truth, claims up to {:.1} m{clock}; {} % of the fixes \
                 captured, 95 % within {} m of the claim",
                metres(spoofing.displacement_max_m),
                spoofing.claimed_displacement_max_m,
                number(spoofing.captured_share.map(|share| 100.0 * share), 0),
                metres(spoofing.from_claim_p95_m)
            )?;
        }
        if let Some(osnma) = &self.osnma {
            let after = |value: Option<f64>| value.map_or("never".to_owned(), |s| format!("after {s:.1} s"));
            writeln!(
                f,
                "osnma         {} start, {}: {} tags authentic ({} of them false), {} refused ({} of them true), {} \
                 open; first authentic data {}, first authentic fix {}",
                osnma.start,
                osnma.state,
                osnma.tags_authentic,
                osnma.false_accepted,
                osnma.tags_refused,
                osnma.true_refused,
                osnma.tags_open,
                after(osnma.first_authentic_s),
                after(osnma.first_authentic_fix_s)
            )?;
        }
        if let Some(inertial) = &self.inertial {
            let back =
                |figure: Option<Limited>| figure.map_or("-".to_owned(), |figure| format!("{:.1e}", figure.value));
            writeln!(
                f,
                "inertial      {} measurements; integrated back: position within {} m, attitude within {} rad",
                inertial.rows,
                back(inertial.position_error_m),
                back(inertial.attitude_error_rad)
            )?;
        }
        if let Some(measured) = &self.ionosphere {
            writeln!(
                f,
                "ionosphere    by two bands: error 95 % {:.2} m, rms {:.2} m, of {:.2} m on average; stated {:.2} m",
                measured.error_p95_m, measured.error_rms_m, measured.true_mean_m, measured.stated_rms_m
            )?;
        }
        for null_hz in &self.details.psd_nulls_hz {
            writeln!(f, "spectrum      null at {:+.4} MHz from the carrier", null_hz / 1e6)?;
        }
        Ok(())
    }

    fn loop_lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (tracking, limits) = (&self.tracking, &self.details.thresholds);
        writeln!(f, "\n{:<26}{:>12}{:>12}", "loop (replica - truth)", "sigma", "threshold")?;
        let rows = [
            ("DLL (chips)", tracking.dll_sigma_chips, limits.dll_chips),
            ("PLL (degrees)", tracking.pll_sigma_deg, limits.pll_deg),
            ("FLL (Hz)", tracking.fll_sigma_hz, limits.fll_hz),
        ];
        for (name, sigma, limit) in rows {
            writeln!(f, "{name:<26}{:>12}{limit:>12.4}", number(sigma, 4))?;
        }
        writeln!(f, "{} losses of lock, {} cycle slips", tracking.losses_of_lock, tracking.cycle_slips)?;
        for (name, pooled) in [("DLL", tracking.dll_chips), ("PLL", tracking.pll_deg), ("FLL", tracking.fll_hz)] {
            let Some(pooled) = pooled else { continue };
            let (sigma, theory) = (pooled.sigma, pooled.theory_sigma);
            writeln!(
                f,
                "{name} jitter    measured/theory {:.3}, {} thresholds exceeded",
                sigma / theory,
                pooled.rules_broken
            )?;
        }
        if let (Some(mean), Some([low, high])) = (self.position.nees_mean, self.position.nees_band) {
            let fixes = number(self.position.nees_independent, 0);
            let verdict = self.position.nees_verdict.map_or("unjudged", Calibration::name);
            writeln!(
                f,
                "covariance    {verdict}: NEES {mean:.2}, expected 95 % band {low:.2} to {high:.2} ({fixes} \
                 independent fixes)"
            )?;
        }
        Ok(())
    }

    fn clock_lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let clock = &self.clock;
        if let (Some(drift), Some(true_drift)) = (clock.drift, clock.true_drift) {
            writeln!(f, "\nclock         drift {drift:+.4e} found, {true_drift:+.4e} true")?;
        }
        let Some(point) = self.details.clock_oadev_1s else { return Ok(()) };
        write!(f, "Allan, 1 s    {:.2e} found", point.deviation)?;
        if let Some((low, high)) = point.interval {
            write!(f, " (95 % within {low:.2e} to {high:.2e})")?;
        }
        match clock.true_oadev_1s {
            Some(truth) => write!(f, ", {truth:.2e} true")?,
            None => write!(f, ", a true clock without noise")?,
        }
        match clock.code_noise_oadev_1s {
            Some(code) => writeln!(f, ", {code:.2e} if code noise were white"),
            None => writeln!(f),
        }
    }

    fn speed_line(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let speed = &self.speed;
        let stages = [
            ("generate", speed.generate_x_real_time),
            ("receive", speed.receive_x_real_time),
            ("run", speed.run_x_real_time),
        ];
        let mut parts: Vec<String> =
            stages.iter().filter_map(|(name, times)| times.map(|times| format!("{name} {times:.1}x"))).collect();
        if parts.is_empty() {
            return Ok(());
        }
        parts.extend(speed.cpu_s.map(|cpu_s| format!("{cpu_s:.1} s of CPU")));
        parts.extend(speed.peak_memory_mib.map(|mib| format!("{mib:.0} MiB")));
        writeln!(f, "\nspeed         {} (x real time)", parts.join(", "))
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "verdict       {}", self.in_words())?;
        // A hint stands below the first figure that it explains.
        let mut hints = BTreeSet::new();
        for row in self.rows.iter().filter(|row| row.status != Status::Pass) {
            let (value, word, margin) = (row.value_text(), row.status.word(), row.margin_text());
            let value = format!("{value} {}", row.unit);
            writeln!(f, "{word:<14}{} {}, limit {}: {margin}", row.figure, value.trim_end(), row.bound)?;
            let mut why = row.why.iter().filter(|line| !line.starts_with("hint: ") || hints.insert(line.as_str()));
            why.try_for_each(|line| writeln!(f, "{:<14}  {line}", ""))?;
        }
        self.not_judged.iter().try_for_each(|text| writeln!(f, "{:<14}{text}", "not judged"))
    }
}

fn line(f: &mut fmt::Formatter<'_>, name: &str, spread: Option<Spread>) -> fmt::Result {
    let [mean, sigma, p95] =
        [spread.map(|s| s.mean), spread.map(|s| s.sigma), spread.map(|s| s.p95)].map(|value| number(value, 4));
    writeln!(f, "{name:<26}{mean:>12}{sigma:>12}{p95:>12}")
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::judgement::{Bound, Judgement, MARGINAL_SHARE};

    #[test]
    fn a_hint_stands_once_below_the_first_figure_that_it_explains_and_evidence_below_each() {
        let failed = |figure: &str, why: &[&str]| {
            let mut row = Judgement::new(figure, 9.0.into(), "m", Bound::Max(1.0), MARGINAL_SHARE, "test");
            row.why = why.iter().map(|line| (*line).to_owned()).collect();
            row
        };
        let both = ["G07 from 3 s to 8 s", "hint: give the scene [troposphere]", "hint: set --start"];
        let rows =
            vec![failed("mean error", &both[..2]), failed("horizontal error", &both), failed("vertical error", &both)];
        let text = Verdict::default().with_user(rows).to_string();
        let lines: Vec<&str> = text.lines().skip(1).map(str::trim).collect();
        let expected = [
            ("FAIL", "mean"),
            ("G07", "8 s"),
            ("hint", "[troposphere]"),
            ("FAIL", "horizontal"),
            ("G07", "8 s"),
            ("hint", "--start"),
            ("FAIL", "vertical"),
            ("G07", "8 s"),
        ];
        assert_eq!(lines.len(), expected.len(), "{text}");
        for (line, (begin, word)) in lines.iter().zip(expected) {
            assert!(line.starts_with(begin) && line.contains(word), "{line:?}: {begin} … {word}\n{text}");
        }
    }
}
