//! The log of ticks: what each tick of a pushed motion became, so that it can be sent again bit by bit.
//!
//! A CSV table. The first row is the state at sample 0, each other one the state at the end of its tick, with
//! what the tick was made of. Numbers are the shortest decimals that give the same bits. Limits: rows read
//! are bounded ([`MAX_ROWS`]).

use std::io::{self, BufRead, BufReader, Read, Write};

use nalgebra::Vector3;

use super::Motion;
use super::file::{Fault, FileError};
use super::joining::Kind;

/// Rows read at most: a day at 100 ticks a second, 0.7 GB in memory.
pub const MAX_ROWS: usize = 8_640_001;
/// Bytes of a row at most.
const MAX_ROW_BYTES: u64 = 1 << 12;
/// The first line.
const HEADER: &str = "sample,kind,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2";
/// Kind of the first row.
const INITIAL: &str = "initial";

/// Writes the header and the state with which a motion begins.
///
/// # Errors
/// Those of the output.
pub fn begin(output: &mut dyn Write, first: &Motion) -> io::Result<()> {
    writeln!(output, "{HEADER}")?;
    row(output, 0, INITIAL, first)
}

/// Writes the tick that ends at `sample`.
///
/// # Errors
/// Those of the output.
pub fn write(output: &mut dyn Write, sample: u64, kind: Kind, end: &Motion) -> io::Result<()> {
    row(output, sample, kind.name(), end)
}

fn row(output: &mut dyn Write, sample: u64, kind: &str, motion: &Motion) -> io::Result<()> {
    write!(output, "{sample},{kind}")?;
    let vectors = [&motion.position_m, &motion.velocity_mps, &motion.acceleration_mps2];
    for value in vectors.into_iter().flat_map(|vector| vector.iter()) {
        write!(output, ",{value:?}")?;
    }
    writeln!(output)
}

/// Reads a log whose ticks have `tick_samples` samples: the first state, then the end of each tick; at most
/// `limit` states.
///
/// # Errors
/// [`FileError`] at the first line that is none of a log.
pub fn read(input: impl Read, file: &str, tick_samples: u64, limit: usize) -> Result<Vec<Motion>, FileError> {
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
            let fault = || Fault::Log { what: text.chars().take(80).collect(), expected: HEADER.to_owned() };
            if text == HEADER { continue } else { return Err(refuse(fault())) }
        }
        let (sample, kind) = (tick_samples.saturating_mul(states.len() as u64), states.is_empty());
        states.push(parse(text, sample, kind).map_err(refuse)?);
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

fn parse(text: &str, sample: u64, first: bool) -> Result<Motion, Fault> {
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
    let mut values = [0.0; 9];
    for value in &mut values {
        let field = fields.next().unwrap_or_default();
        let finite = field.parse().ok().filter(|value: &f64| value.is_finite());
        *value = finite.ok_or_else(|| wrong(field, "a finite number, nine in a row".to_owned()))?;
    }
    if let Some(more) = fields.next() {
        return Err(wrong(more, "eleven fields".to_owned()));
    }
    let [x, y, z, vx, vy, vz, ax, ay, az] = values;
    Ok(Motion {
        position_m: Vector3::new(x, y, z),
        velocity_mps: Vector3::new(vx, vy, vz),
        acceleration_mps2: Vector3::new(ax, ay, az),
    })
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
        begin(&mut text, &motion(0.0)).unwrap();
        write(&mut text, 26_000, Kind::Fresh, &motion(1.0)).unwrap();
        write(&mut text, 52_000, Kind::Snap, &motion(2.0)).unwrap();
        let text = String::from_utf8(text).unwrap();
        let bits = |motion: &Motion| {
            let all = [motion.position_m, motion.velocity_mps, motion.acceleration_mps2];
            all.map(|v| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()])
        };
        let states = read(text.as_bytes(), "ticks.csv", 26_000, MAX_ROWS).unwrap();
        assert_eq!(states.iter().map(bits).collect::<Vec<_>>(), [0.0, 1.0, 2.0].map(|k| bits(&motion(k))));
        assert_eq!(read(text.as_bytes(), "ticks.csv", 26_000, 1).unwrap().len(), 1);
        let refused = |text: &str| read(text.as_bytes(), "ticks.csv", 26_000, MAX_ROWS).unwrap_err().to_string();
        for (broken, message) in [
            (String::new(), "expected a row initial"),
            (text.replace("x_m", "x"), "line 1"),
            (text.replace("52000", "52001"), "line 4: '52001': expected sample 52000"),
            (text.replace("fresh", "stale"), "line 3: 'stale': expected waiting, fresh"),
            (text.replace("1e300", "inf"), "expected a finite number"),
            (text.replace("1e300", "NaN"), "expected a finite number"),
            (text.replace("snap,", "snap,1,"), "expected eleven fields"),
            (text.replace("fresh", &"x".repeat(10_000)), "a row of more than"),
        ] {
            let refusal = refused(&broken);
            assert!(refusal.contains(message), "{refusal}");
        }
    }
}
