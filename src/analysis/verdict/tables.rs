//! Whether the receiver's tables are whole and agree with one another ([`crate::analysis::integrity`]).

use super::{Bound, Verdict};
use crate::analysis::JudgeError;
use crate::analysis::errors::Errors;
use crate::analysis::integrity;
use crate::analysis::load::Run;

impl Verdict {
    pub(super) fn tables(&mut self, run: &Run, errors: &Errors) -> Result<(), JudgeError> {
        for finding in integrity::findings(run, errors)? {
            self.judge(finding.figure, "", finding.value, finding.unit, Bound::Max(finding.limit), &finding.source);
        }
        Ok(())
    }
}
