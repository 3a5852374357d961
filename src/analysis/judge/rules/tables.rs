//! Whether the receiver's tables are whole and agree with one another
//! ([`crate::analysis::judge::integrity`]).

use crate::analysis::error::JudgeError;
use crate::analysis::judge::integrity;
use crate::analysis::judge::judgement::Bound;
use crate::analysis::judge::verdict::Verdict;
use crate::analysis::measure::errors::Errors;
use crate::analysis::read::Run;

impl Verdict {
    pub(super) fn tables(&mut self, run: &Run, errors: &Errors) -> Result<(), JudgeError> {
        for finding in integrity::findings(run, errors)? {
            self.judge(finding.figure, "", finding.value, finding.unit, Bound::Max(finding.limit), &finding.source);
        }
        Ok(())
    }
}
