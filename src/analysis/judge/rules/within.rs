//! Errors of fixes against the bound that the scene itself states ([`Expect::position_within_m`]): where it
//! expects more than theory does, a receiver that is lost still fails.

use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use gnss::facts::Expect;

impl Verdict {
    /// Time and error in space of every fix, seconds and metres.
    pub(super) fn within(&mut self, expect: &Expect, fixes: impl Iterator<Item = (f64, f64)>) {
        let bounded = fixes.filter_map(|(time_s, error_m)| {
            let (terms, bound_m) = expect.position_within_m(time_s)?;
            Some((time_s, error_m, bound_m, &terms.reason))
        });
        let worst = bounded.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)));
        if let Some((time_s, error_m, bound_m, reason)) = worst {
            let source = format!("the scene: {reason}; at {time_s:.1} s");
            self.judge("position error that the scene bounds, largest", "", error_m, "m", Bound::Max(bound_m), &source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::facts::{Interval, Terms};

    #[test]
    fn the_fix_nearest_to_the_bound_of_its_own_time_is_judged() {
        let within = |bound_m| Terms { position_within_m: Some(bound_m), reason: "walls".into(), ..Terms::default() };
        let interval = Interval { from_s: 10.0, to_s: 20.0, terms: within(100.0) };
        let expect = Expect { whole: Some(within(10.0)), intervals: vec![interval] };
        let judged = |fixes: &[(f64, f64)]| {
            let mut verdict = Verdict::default();
            verdict.within(&expect, fixes.iter().copied());
            verdict.rows.first().map(|row| row.status.word().to_owned())
        };
        assert_eq!(judged(&[(5.0, 8.0), (15.0, 60.0)]).as_deref(), Some("pass"));
        assert_eq!(judged(&[(5.0, 11.0), (15.0, 60.0)]).as_deref(), Some("FAIL"));
        assert_eq!(judged(&[(5.0, 8.0), (15.0, 110.0)]).as_deref(), Some("FAIL"));
        assert_eq!(judged(&[]), None);
    }
}
