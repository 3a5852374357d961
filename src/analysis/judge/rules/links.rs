//! The worst satellite of each figure of the loops ([`crate::judge::forecast::links`]).

use crate::error::JudgeError;
use crate::judge::forecast::links::{Figure, LeftOut, Links};
use crate::judge::judgement::Bound;
use crate::judge::rules::OBSERVATIONS;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::measure::jitter::Loop;
use crate::read::Run;

impl Figure {
    /// Words and unit.
    fn text(self) -> (String, &'static str) {
        let of = |which| match which {
            Loop::Dll => "DLL",
            Loop::Pll => "PLL",
            Loop::Fll => "FLL",
        };
        let unit = |which| match which {
            Loop::Dll => "chips",
            Loop::Pll => "°",
            Loop::Fll => "Hz",
        };
        match self {
            Self::CodeBias => ("code bias".to_owned(), "m"),
            Self::CodeLargest => ("code error, largest".to_owned(), "m"),
            Self::CarrierBias => ("carrier bias".to_owned(), "cycles"),
            Self::CarrierLargest => ("carrier error, largest".to_owned(), "cycles"),
            Self::DopplerBias => ("Doppler bias".to_owned(), "Hz"),
            Self::DopplerLargest => ("Doppler error, largest".to_owned(), "Hz"),
            Self::Above(which) => (format!("{} jitter over theory, largest", of(which)), "of 1"),
            Self::Below(which) => (format!("{} jitter over theory, smallest", of(which)), "of 1"),
            Self::RawAbove(which) => (format!("{} discriminator over theory, largest", of(which)), "of 1"),
            Self::RawBelow(which) => (format!("{} discriminator over theory, smallest", of(which)), "of 1"),
            Self::RawBias(which) => (format!("{} discriminator's bias", of(which)), unit(which)),
            Self::Cn0Bias => ("C/N0 bias".to_owned(), "dB"),
            Self::Cn0Largest => ("C/N0 error, largest".to_owned(), "dB"),
            Self::LoopCn0Bias => ("C/N0 bias of loop updates".to_owned(), "dB"),
            Self::PromptPower => ("prompt's power against C/N0".to_owned(), "dB"),
            Self::PromptQuadrature => ("prompt's share in quadrature".to_owned(), "of 1"),
        }
    }
}

impl Verdict {
    /// A row for each figure.
    pub(super) fn links(&mut self, run: &Run, errors: &Errors, summary: &Summary) -> Result<(), JudgeError> {
        if !run.scene.expect.bounded(0.0) {
            self.not_judged.push("loops satellite by satellite: the scene expects any errors".to_owned());
            return Ok(());
        }
        if !run.scene.noise {
            self.not_judged.push("loops satellite by satellite: the scene has no noise".to_owned());
            return Ok(());
        }
        let links = Links::measure(run, errors, &summary.details.stated)?;
        // What a level does not have is named once.
        let is_due = |reason: &LeftOut| !(run.scene.fidelity == OBSERVATIONS && *reason == LeftOut::Updates);
        for (reason, names) in links.left_out.iter().filter(|(reason, _)| is_due(reason)) {
            let (what, why) = match reason {
                LeftOut::Unheld => ("loops", "the settings make no loop that holds the signal"),
                LeftOut::Unsettled => ("loops", "too few observations past pull-in at a steady C/N0"),
                LeftOut::Updates => ("loops' updates", "too few rows of tracking of the length that is stated"),
            };
            self.not_judged.push(format!("{what} of {}: {why}", names.join(", ")));
        }
        if links.worst.is_empty() {
            self.not_judged.push("loops satellite by satellite: no settings, or nothing past its pull-in".to_owned());
        }
        for (figure, worst) in &links.worst {
            let (words, unit) = figure.text();
            let bound = match figure {
                Figure::Below(_) | Figure::RawBelow(_) => Bound::Min(worst.limit),
                _ => Bound::Max(worst.limit),
            };
            let source =
                format!("theory at the true C/N0 of {}, the satellite nearest to its limit or beyond", worst.name);
            self.judge(&words, "", worst.value, unit, bound, &source);
        }
        Ok(())
    }
}
