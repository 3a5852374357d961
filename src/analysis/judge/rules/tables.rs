//! Rules for the completeness and consistency of the receiver's tables ([`crate::judge::integrity`]).

use crate::error::JudgeError;
use crate::judge::integrity;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::read::Run;

impl Verdict {
    pub(super) fn tables(&mut self, run: &Run, errors: &Errors) -> Result<(), JudgeError> {
        for finding in integrity::findings(run, errors)? {
            self.judge(finding.figure, "", finding.value, finding.unit, Bound::Max(finding.limit), &finding.source);
        }
        Ok(())
    }
}
