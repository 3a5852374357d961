//! Times of a live run: of its first sample, and of the states of a sender with a zero of its own.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::cli::args::StartAt;
use crate::cli::error::CliError;
use crate::cli::scenario;
use generator::vehicle::joining::{Push, Refusal};
use gnss::time::Epoch;

/// Seconds from the Unix epoch to that of GPS time, leap seconds left out.
const GPS_UNIX_S: i64 = 315_964_800;
/// The GPS time with which a run starts, and the machine's.
pub fn instant(at: StartAt) -> Result<(Epoch, SystemTime), CliError> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_err(|_| CliError::usage("--start-at: no clock"))?;
    let unix = |gps: i64| gps - Epoch::new(gps, 0.0).leap_seconds() + GPS_UNIX_S;
    let (epoch, unix_s) = match at {
        StartAt::Utc(epoch) => (epoch, unix(epoch.seconds())),
        StartAt::After(seconds) => {
            let unix_s = (now.as_secs_f64() + seconds).ceil() as i64;
            let gps = unix_s - GPS_UNIX_S;
            // Leap seconds are those of the time itself, a second look for one just inserted.
            let gps = gps + Epoch::new(gps, 0.0).leap_seconds();
            (Epoch::new(gps, 0.0), unix_s)
        }
    };
    let at = UNIX_EPOCH + Duration::from_secs(unix_s.max(0) as u64);
    if at < SystemTime::now() {
        return Err(CliError::usage(format!(
            "--start-at: {} is over: expected a second to come, or +S",
            epoch.to_utc_text()
        )));
    }
    Ok((epoch, at))
}

/// Zero of a sender's times, which its first state defines.
#[derive(Default)]
pub struct Zero {
    offset_s: Option<f64>,
    /// States in a row that were refused for their times.
    astray: u32,
}

impl Zero {
    /// States in a row whose refusal shows that the first one had a wrong time.
    const ASTRAY: u32 = 10;

    /// A state by the scene's time, where the first one is of the instant `now_s` at which it is used.
    pub fn timed(&mut self, push: &Push, now_s: f64) -> Push {
        let offset_s = *self.offset_s.get_or_insert(now_s - push.t_s);
        Push { t_s: push.t_s + offset_s, ..*push }
    }

    /// Offset of the scene's time from the sender's in seconds, once there is one.
    pub fn offset_s(&self) -> Option<f64> {
        self.offset_s
    }

    /// Gives the zero up when no state fits it any more.
    pub fn judge(&mut self, taken: &Result<u64, Refusal>) {
        let is_time = |refusal: &Refusal| {
            matches!(refusal, Refusal::BeforeStart(_) | Refusal::Ahead(..) | Refusal::OutOfOrder(..))
        };
        self.astray = if taken.as_ref().is_err_and(is_time) { self.astray + 1 } else { 0 };
        if self.astray >= Self::ASTRAY {
            scenario::warn("motion: the times of states do not fit that of the first: the next one defines them again");
            *self = Self::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_state_with_a_wrong_time_costs_ten_states_and_not_the_run() {
        let mut zero = Zero::default();
        let push = |t_s: f64| Push::at(t_s, nalgebra::Vector3::zeros());
        assert_eq!(zero.timed(&push(1e12), 2.0).t_s, 2.0);
        for k in 0..Zero::ASTRAY {
            let t_s = zero.timed(&push(f64::from(k)), 2.0).t_s;
            assert!(t_s < -1e11, "{t_s}");
            zero.judge(&Err(Refusal::BeforeStart(t_s)));
        }
        assert_eq!(zero.timed(&push(20.0), 3.0).t_s, 3.0);
        // Other refusals do not count, nor do those with good states between.
        for _ in 0..20 {
            zero.judge(&Err(Refusal::NotFinite));
            zero.judge(&Err(Refusal::BeforeStart(-1.0)));
            zero.judge(&Ok(1));
        }
        assert_eq!(zero.offset_s(), Some(-17.0));
    }
}
