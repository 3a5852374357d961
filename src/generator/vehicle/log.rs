//! The log of ticks: what each tick of a pushed motion became, so that it can be sent again bit by bit.
//!
//! A CSV table. The first row is the state at sample 0, each other one the state at the end of its tick, with
//! what the tick was made of, and where the attitude is pushed its quaternion and rate. Numbers are the
//! shortest decimals that give the same bits. Limits: rows read are bounded ([`MAX_ROWS`]).

use std::io::{self, BufRead, BufReader, Read, Write};

use nalgebra::Vector3;

use super::Motion;
use super::file::{Fault, FileError};
use super::joining::{Kind, Tick};
use super::turn::Turn;

/// Rows read at most: a day at 100 ticks a second, 0.7 GB in memory.
pub const MAX_ROWS: usize = 8_640_001;
/// Bytes of a row at most.
const MAX_ROW_BYTES: u64 = 1 << 12;
/// The first line.
const HEADER: &str = "sample,kind,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2";
/// Continuation of the header if the attitude is pushed.
const TURNED: &str = ",qw,qx,qy,qz,wx_radps,wy_radps,wz_radps";
/// Numbers of a motion, and of a turn.
const MOTION_NUMBERS: usize = 9;
const TURN_NUMBERS: usize = 7;

/// A motion and, where the attitude is pushed, the turn.
pub type State = (Motion, Option<Turn>);

/// Kind of the first row.
const INITIAL: &str = "initial";

/// Writes the header and the state with which a motion begins.
///
/// # Errors
/// Errors of the output.
pub fn begin(output: &mut dyn Write, (first, turn): (&Motion, Option<&Turn>)) -> io::Result<()> {
    writeln!(output, "{HEADER}{}", if turn.is_some() { TURNED } else { "" })?;
    row(output, 0, INITIAL, (first, turn))
}

/// Writes the tick that ends at `sample`.
///
/// # Errors
/// Errors of the output.
pub fn write(output: &mut dyn Write, sample: u64, tick: &Tick) -> io::Result<()> {
    row(output, sample, tick.kind.name(), (&tick.end, tick.turn.as_ref()))
}

fn row(output: &mut dyn Write, sample: u64, kind: &str, (motion, turn): (&Motion, Option<&Turn>)) -> io::Result<()> {
    write!(output, "{sample},{kind}")?;
    let vectors = [&motion.position_m, &motion.velocity_mps, &motion.acceleration_mps2];
    for value in vectors.into_iter().flat_map(|vector| vector.iter()) {
        write!(output, ",{value:?}")?;
    }
    for value in turn.into_iter().flat_map(|turn| turn.quaternion.iter().chain(turn.rate_radps.iter())) {
        write!(output, ",{value:?}")?;
    }
    writeln!(output)
}

/// Reads a log whose ticks have `tick_samples` samples, with turns if `turned`: the first state, then the end
/// of each tick; at most `limit` states.
///
/// # Errors
/// [`FileError`] at the first line that is none of a log.
pub fn read(
    input: impl Read,
    file: &str,
    (tick_samples, turned): (u64, bool),
    limit: usize,
) -> Result<Vec<State>, FileError> {
    let header = format!("{HEADER}{}", if turned { TURNED } else { "" });
    let mut input = BufReader::new(input);
    let (mut line, mut states, mut text) = (0, Vec::new(), Vec::new());
    loop {
        line += 1;
        let refuse = |fault| FileError { file: file.to_owned(), line, fault };
        text.clear();
        let length = input.by_ref().take(MAX_ROW_BYTES).read_until(b'\n', &mut text);
        let length = length.map_err(|error| refuse(Fault::Read(error)))?;
        if length == 0 || states.len() >= limit.min(MAX_ROWS) {
            break;
        }
        if length as u64 == MAX_ROW_BYTES {
            return Err(refuse(Fault::LongRow));
        }
        let text = std::str::from_utf8(&text).map_err(|_| refuse(Fault::NotText))?.trim_end();
        if line == 1 {
            let fault = || Fault::Log { what: text.chars().take(80).collect(), expected: header.clone() };
            if text == header { continue } else { return Err(refuse(fault())) }
        }
        let (sample, kind) = (tick_samples.saturating_mul(states.len() as u64), states.is_empty());
        states.push(parse(text, sample, kind, turned).map_err(refuse)?);
    }
    if states.is_empty() {
        let expected = format!("a row {INITIAL} at sample 0");
        return Err(FileError {
            file: file.to_owned(),
            line,
            fault: Fault::Log { what: "the end".to_owned(), expected },
        });
    }
    Ok(states)
}

fn parse(text: &str, sample: u64, first: bool, turned: bool) -> Result<State, Fault> {
    let wrong = |what: &str, expected: String| Fault::Log { what: what.chars().take(80).collect(), expected };
    let mut fields = text.split(',');
    let number = fields.next().unwrap_or_default();
    if number.parse() != Ok(sample) {
        return Err(wrong(number, format!("sample {sample}: ticks follow each other, as long as tick_s says")));
    }
    let kind = fields.next().unwrap_or_default();
    let known = if first { kind == INITIAL } else { Kind::NAMES.iter().any(|(name, _)| *name == kind) };
    if !known {
        let names = Kind::NAMES.map(|(name, _)| name).join(", ");
        return Err(wrong(kind, if first { INITIAL.to_owned() } else { names }));
    }
    let mut values = [0.0; MOTION_NUMBERS + TURN_NUMBERS];
    let numbers = if turned { values.len() } else { MOTION_NUMBERS };
    for value in values.iter_mut().take(numbers) {
        let field = fields.next().unwrap_or_default();
        let finite = field.parse().ok().filter(|value: &f64| value.is_finite());
        *value = finite.ok_or_else(|| wrong(field, format!("a finite number, {numbers} in a row")))?;
    }
    if let Some(more) = fields.next() {
        return Err(wrong(more, format!("{} fields", numbers + 2)));
    }
    let [x, y, z, vx, vy, vz, ax, ay, az, qw, qx, qy, qz, wx, wy, wz] = values;
    let motion = Motion {
        position_m: Vector3::new(x, y, z),
        velocity_mps: Vector3::new(vx, vy, vz),
        acceleration_mps2: Vector3::new(ax, ay, az),
    };
    let turn = Turn { quaternion: [qw, qx, qy, qz], rate_radps: Vector3::new(wx, wy, wz) };
    let norm = turn.quaternion.iter().map(|x| x * x).sum::<f64>();
    if turned && (norm - 1.0).abs() > 1e-9 {
        return Err(wrong(&format!("{norm}"), "a quaternion of length 1".to_owned()));
    }
    Ok((motion, turned.then_some(turn)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_gives_back_the_same_bits_and_refuses_what_is_none() {
        let motion = |k: f64| Motion {
            position_m: Vector3::new(4e6 + 0.1 * k, -1.0 / 3.0, 5e-324),
            velocity_mps: Vector3::new(-0.0, 1e300, k / 7.0),
            acceleration_mps2: Vector3::new(0.1 + 0.2, -k, 1e-17),
        };
        let mut text = Vec::new();
        let tick = |kind, k: f64, turn| Tick {
            end: motion(k),
            turn,
            kind,
            news: None,
            gap_m: 0.0,
            age_s: 0.0,
            jerk_mps3: 0.0,
        };
        begin(&mut text, (&motion(0.0), None)).unwrap();
        write(&mut text, 26_000, &tick(Kind::Fresh, 1.0, None)).unwrap();
        write(&mut text, 52_000, &tick(Kind::Snap, 2.0, None)).unwrap();
        let text = String::from_utf8(text).unwrap();
        let bits = |motion: &Motion| {
            let all = [motion.position_m, motion.velocity_mps, motion.acceleration_mps2];
            all.map(|v| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()])
        };
        let states = read(text.as_bytes(), "ticks.csv", (26_000, false), MAX_ROWS).unwrap();
        assert_eq!(
            states.iter().map(|(motion, _)| bits(motion)).collect::<Vec<_>>(),
            [0.0, 1.0, 2.0].map(|k| bits(&motion(k)))
        );
        assert_eq!(read(text.as_bytes(), "ticks.csv", (26_000, false), 1).unwrap().len(), 1);
        let refused =
            |text: &str| read(text.as_bytes(), "ticks.csv", (26_000, false), MAX_ROWS).unwrap_err().to_string();
        for (broken, message) in [
            (String::new(), "expected a row initial"),
            (text.replace("x_m", "x"), "line 1"),
            (text.replace("52000", "52001"), "line 4: '52001': expected sample 52000"),
            (text.replace("fresh", "stale"), "line 3: 'stale': expected waiting, fresh"),
            (text.replace("1e300", "inf"), "expected a finite number"),
            (text.replace("1e300", "NaN"), "expected a finite number"),
            (text.replace("snap,", "snap,1,"), "expected 11 fields"),
            (text.replace("fresh", &"x".repeat(10_000)), "a row of more than"),
        ] {
            let refusal = refused(&broken);
            assert!(refusal.contains(message), "{refusal}");
        }

        // With turns, whose columns a scene without a pushed attitude does not expect.
        let turn = Turn { rate_radps: Vector3::new(0.1, -1.0 / 3.0, 1e-9), ..Turn::of(0.3, -0.2, 3.0) };
        let mut text = Vec::new();
        begin(&mut text, (&motion(0.0), Some(&turn))).unwrap();
        write(&mut text, 26_000, &tick(Kind::Fresh, 1.0, Some(turn.turned(0.1)))).unwrap();
        let states = read(text.as_slice(), "ticks.csv", (26_000, true), MAX_ROWS).unwrap();
        assert_eq!(states.iter().map(|(_, turn)| *turn).collect::<Vec<_>>(), [Some(turn), Some(turn.turned(0.1))]);
        assert!(read(text.as_slice(), "ticks.csv", (26_000, false), MAX_ROWS).is_err());
        let long = String::from_utf8(text).unwrap().replace("\n26000,fresh,", "\n26000,fresh,1,");
        assert!(read(long.as_bytes(), "ticks.csv", (26_000, true), MAX_ROWS).is_err());
    }
}
