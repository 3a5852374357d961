//! Ephemerides and messages of spoofers that do not repeat the true ones.
//!
//! A spoofer that claims another time has the sky and the messages of a scene that starts then; one with
//! navigation files has theirs. Its orbits are those of its own messages: precise orbits and the faults of
//! the true satellites do not concern it.

use std::path::PathBuf;
use std::sync::Arc;

use super::files::Files;
use super::interference::SpooferSpec;
use super::osnma::Spoofed;
use super::{Scenario, ScenarioError, parts};
use crate::spoof::OwnSky;
use gnss::message::{Authentication, Common};

/// Sky and messages of a spoofer.
pub(super) struct Own {
    /// Number of the spoofer, from 1.
    pub number: usize,
    /// Ephemerides of its own; `None` for the scene's.
    pub sky: Option<OwnSky>,
    /// Content of its messages besides ephemerides; `None` for the scene's.
    common: Option<Common>,
}

impl SpooferSpec {
    /// True if it has ephemerides of its own.
    fn has_sky(&self) -> bool {
        self.ahead_s != 0 || !self.navigation.is_empty() || self.moved_to.is_some()
    }
}

impl Scenario {
    /// The spoofers with ephemerides of their own, over a scene that lasts `end_s`.
    pub(super) fn own_skies(
        &self,
        files: &Files<'_>,
        end_s: f64,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Own>, ScenarioError> {
        let mut found = Vec::new();
        for (number, spec) in (1..).zip(&self.spoofers) {
            if !spec.has_sky() {
                continue;
            }
            if self.osnma.is_some() && spec.osnma != Spoofed::None {
                let reason = format!("number {number}: expected \"none\", because its messages are not the true ones");
                return Err(self.conflict("spoofer.osnma", reason));
            }
            let own_files: &[PathBuf] = if spec.navigation.is_empty() { &self.navigation } else { &spec.navigation };
            let scene = Self {
                start: self.start.plus_s(spec.ahead_s as f64),
                navigation: own_files.to_vec(),
                moved_to: spec.moved_to.or(self.moved_to.filter(|_| spec.navigation.is_empty())),
                orbits: None,
                satellite_faults: Vec::new(),
                message_faults: Vec::new(),
                ..self.clone()
            };
            let mut own = Vec::new();
            // Moved files are those of the scene's day, where it names none.
            let near = if scene.moved_to.is_some() { self.start } else { scene.start };
            let composed = parts::navigation(&scene, near, files, &mut own)
                .and_then(|navigation| parts::sky(&scene, &navigation, files, end_s, &mut own));
            warnings.extend(own.into_iter().map(|warning| format!("spoofer number {number}: {warning}")));
            let parts::Sky { catalogue, common, excluded } =
                composed.map_err(|error| self.of_spoofer(number, error))?;
            let sky = Some(OwnSky { catalogue: Arc::new(catalogue), excluded });
            found.push(Own { number, sky, common: Some(common) });
        }
        Ok(found)
    }

    /// An error of a spoofer's own sky by the spoofer's key.
    fn of_spoofer(&self, number: usize, error: ScenarioError) -> ScenarioError {
        match error {
            ScenarioError::Conflict { key: "start", reason, .. } => {
                let cure = "; or give its navigation, or move its ephemerides with navigation_moved_to";
                self.conflict("spoofer.time_offset_s", format!("number {number}: {reason}{cure}"))
            }
            ScenarioError::Conflict { reason, .. } => {
                self.conflict("spoofer.navigation", format!("number {number}: {reason}"))
            }
            other => other,
        }
    }

    /// Content of spoofers' messages besides ephemerides, where it is not that of the true ones.
    pub(super) fn spoofed_messages(
        &self,
        common: &Common,
        own: &[Own],
        authenticated: Vec<(usize, Option<Arc<dyn Authentication>>)>,
    ) -> Vec<(usize, Common)> {
        let mut found = Vec::new();
        for (number, spec) in (1..).zip(&self.spoofers) {
            let sky = own.iter().find(|own| own.number == number).and_then(|own| own.common.as_ref());
            let signed = authenticated.iter().find(|(signed, _)| *signed == number);
            if sky.is_none() && signed.is_none() && spec.leap_s.is_none() {
                continue;
            }
            let mut content = sky.map_or_else(
                || common.clone(),
                |sky| Common { network: common.network.clone(), authentication: None, ..sky.clone() },
            );
            if let Some((_, authentication)) = signed {
                content.authentication.clone_from(authentication);
            }
            if let Some(leap_s) = spec.leap_s {
                content.utc.leap_s = leap_s;
                content.utc.event.iter_mut().for_each(|event| event.after_s = leap_s);
            }
            found.push((number, content));
        }
        found
    }
}
