//! States from sentences of NMEA: GGA alone has the position and RMC alone position, speed and course, at the
//! last height that was known. Where both come for one time they make one state, with what the height gained
//! since the one before. Altitudes are above mean sea level; a GGA without a geoid separation takes EGM96's.

use super::{Message, WireError};
use generator::vehicle::file::{Rmc, gga, rising, rmc};
use generator::vehicle::joining::Push;
use gnss::earth::Geodetic;
use gnss::time::Epoch;

/// Heights further apart say nothing of the speed upwards.
const CLIMB_S: f64 = 2.0;
/// Number of consecutive halves without the other one after which they are states of their own again.
const ALONE: u32 = 3;

/// Reads the sentences of one sender.
#[derive(Clone, Debug)]
pub struct Reader {
    start: Epoch,
    /// The last height, and when it was.
    height: (Option<f64>, f64),
    /// Vertical speed from the last two heights, in metres per second.
    up_mps: f64,
    /// The newest half.
    half: Option<Half>,
    /// True if halves come in pairs; `alone` counts consecutive halves without a partner.
    paired: bool,
    alone: u32,
}

#[derive(Clone, Copy, Debug)]
enum Half {
    Gga(f64),
    Rmc(Rmc),
}

impl Half {
    fn t_s(&self) -> f64 {
        match self {
            Self::Gga(t_s) => *t_s,
            Self::Rmc(rmc) => rmc.t_s,
        }
    }
}

impl Reader {
    pub fn new(start: Epoch, height_m: f64) -> Self {
        Self { start, height: (None, height_m), up_mps: 0.0, half: None, paired: false, alone: 0 }
    }

    /// Reads a sentence.
    pub fn sentence(&mut self, text: &str) -> Result<Message, WireError> {
        let wrong = |reason: String| WireError::Nmea(reason);
        let before_s = self.half.as_ref().map(Half::t_s);
        let missing = || wrong("without a fix".to_owned());
        let (half, own) = match text.get(3..7) {
            Some("GGA,") => {
                let row = gga(text, self.start, before_s).map_err(|fault| wrong(fault.to_string()))?;
                let row = row.ok_or_else(missing)?;
                let row = row.row;
                self.climb(row.t_s, Geodetic::from_ecef(&row.position_m).height_m);
                (Half::Gga(row.t_s), Push::at(row.t_s, row.position_m))
            }
            Some("RMC,") => {
                let rmc = rmc(text, self.start, before_s).map_err(|fault| wrong(fault.to_string()))?;
                let rmc = rmc.ok_or_else(missing)?;
                (Half::Rmc(rmc), self.moving(&rmc))
            }
            _ => return Err(wrong("expected GGA or RMC".to_owned())),
        };
        let before = self.half.replace(half);
        let pair = match (before, half) {
            (Some(Half::Gga(t_s)), Half::Rmc(rmc)) | (Some(Half::Rmc(rmc)), Half::Gga(t_s)) if rmc.t_s == t_s => {
                Some(rmc)
            }
            _ => None,
        };
        if let Some(rmc) = pair {
            (self.paired, self.alone) = (true, 0);
            return Ok(Message::Push(self.moving(&rmc)));
        }
        // The first of a pair is the second that came alone.
        self.alone += 1;
        self.paired &= self.alone < ALONE;
        Ok(if self.paired { Message::Half } else { Message::Push(own) })
    }

    fn climb(&mut self, t_s: f64, height_m: f64) {
        let (before_s, before_m) = self.height;
        let since_s = before_s.map(|before_s| t_s - before_s).filter(|since_s| *since_s > 0.0 && *since_s <= CLIMB_S);
        self.up_mps = since_s.map_or(0.0, |since_s| (height_m - before_m) / since_s);
        self.height = (Some(t_s), height_m);
    }

    fn moving(&self, rmc: &Rmc) -> Push {
        let (position_m, velocity_mps) = rising(rmc, self.height.1, self.up_mps);
        Push { velocity_mps: Some(velocity_mps), ..Push::at(rmc.t_s, position_m) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn with_sum(body: &str) -> String {
        format!("${body}*{:02X}", body.bytes().fold(0, |sum, byte| sum ^ byte))
    }

    /// 08:05:45 UTC is the scene's start; a position that climbs at 3 m/s.
    fn gga_at(second: u32) -> String {
        let height_m = 473.0 + 3.0 * f64::from(second);
        with_sum(&format!("GPGGA,0805{:02}.00,4806.0000,N,01136.0000,E,1,08,1.0,{height_m},M,47.0,M,,", 45 + second))
    }

    fn rmc_at(second: u32) -> String {
        // 36 km/h to the east-north-east.
        let knots = 10.0 / KNOT_MPS;
        with_sum(&format!("GPRMC,0805{:02}.00,A,4806.0000,N,01136.0000,E,{knots},60.0,010710,,", 45 + second))
    }

    const KNOT_MPS: f64 = 1852.0 / 3600.0;

    fn reader() -> Reader {
        Reader::new(Epoch::parse("2010-07-01T08:06:00").unwrap(), 777.0)
    }

    fn local(push: &Push) -> (f64, Vector3<f64>) {
        let place = Geodetic::from_ecef(&push.position_m);
        (place.height_m, push.velocity_mps.map_or(Vector3::zeros(), |v| place.ecef_to_enu() * v))
    }

    #[test]
    fn rmc_alone_has_speed_and_course_at_the_last_height_known() {
        let mut reader = reader();
        let Ok(Message::Push(push)) = reader.sentence(&rmc_at(1)) else { panic!() };
        let (height_m, velocity_mps) = local(&push);
        assert!((push.t_s - 1.0).abs() < 1e-9 && (height_m - 777.0).abs() < 1e-6, "{push:?}");
        let (sin, cos) = libm::sincos(60_f64.to_radians());
        assert!((velocity_mps - Vector3::new(10.0 * sin, 10.0 * cos, 0.0)).norm() < 1e-6, "{velocity_mps}");
        let silent = rmc_at(2).replace(",A,", ",V,");
        let body = silent.trim_start_matches('$').split('*').next().unwrap();
        assert_eq!(reader.sentence(&with_sum(body)), Err(WireError::Nmea("without a fix".to_owned())));
        assert!(matches!(reader.sentence(&rmc_at(3).replace("60.0", "61.0")), Err(WireError::Nmea(_))));
    }

    #[test]
    fn both_of_one_time_are_one_state_with_the_climb_whichever_comes_first() {
        for swapped in [false, true] {
            let mut reader = reader();
            for second in 1..10 {
                let mut pair = [gga_at(second), rmc_at(second)];
                if swapped {
                    pair.reverse();
                }
                let first = reader.sentence(&pair[0]).unwrap();
                // Until a pair was seen, each is a state of its own.
                assert_eq!(first == Message::Half, second > 1, "{second}");
                let Ok(Message::Push(push)) = reader.sentence(&pair[1]) else { panic!() };
                let (height_m, velocity_mps) = local(&push);
                assert!((height_m - 520.0 - 3.0 * f64::from(second)).abs() < 1e-6, "{second}: {height_m}");
                assert!(second == 1 || (velocity_mps.z - 3.0).abs() < 1e-6, "{velocity_mps}");
                assert!((velocity_mps.xy().norm() - 10.0).abs() < 1e-6);
            }
            // The other kind stays away: soon each is a state again.
            let alone = (10..15).map(|second| reader.sentence(&gga_at(second)).unwrap() != Message::Half);
            assert_eq!(alone.collect::<Vec<_>>(), [false, false, true, true, true]);
        }
    }
}
