//! Table `[front_end]` as written: one table, or a list of front ends that share one antenna and one clock.
//!
//! In a list each has its `name`, and its own centre, rate, format, gain and stages. What is random about it
//! is keyed by its name alone, never by its position in the list.

use super::fidelity::fidelity_of;
use super::read::{Refusals, Table};
use super::stages::{self, Stages};
use super::{Scenario, ScenarioError, signal_list};
use crate::fidelity::Wishes;
use gnss::samples::Format;
use gnss::signal::Signal;
use gnss::time::Rate;

/// Front ends of one scene at most.
const MOST: usize = 16;
/// Sample rate where none is written.
const RATE_HZ: f64 = 2.6e6;

/// Frequency on which the samples are centred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tuned {
    /// The carrier of its first signal appears there in the samples.
    If {
        /// The carrier's frequency in the samples, in Hz.
        if_hz: f64,
    },
    /// Radio frequency that appears at 0 Hz.
    Centre {
        /// Radio frequency at 0 Hz in the samples.
        center_hz: f64,
    },
}

/// Front end, which defines the samples of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct FrontEnd {
    /// Name of the front end's files and key of its random numbers; required in a list of several.
    pub name: Option<String>,
    /// Number of the array's element that it belongs to, from 0.
    pub element: Option<usize>,
    /// The sample rate.
    pub rate: Rate,
    /// Tuning: the frequencies that the samples contain.
    pub tuned: Tuned,
    /// True if the spectrum is mirrored.
    pub inverted: bool,
    /// Packing of the samples.
    pub format: Format,
    /// Gain as the standard deviation of the noise in LSB, if the scenario sets it.
    pub noise_lsb: Option<f32>,
    /// Signals of the front end; absent means those of the scene that reach into its band.
    pub signals: Option<Vec<&'static Signal>>,
    /// Hardware stages that act on the samples.
    pub stages: Stages,
    /// Fidelity of the samples.
    pub fidelity: Wishes,
}

impl FrontEnd {
    /// Returns the first signal of the front end in a scene with `signals`.
    pub(super) fn first_signal(&self, signals: &[&'static Signal]) -> Option<&'static Signal> {
        self.signals.as_deref().unwrap_or(signals).first().copied()
    }

    /// The key that states where it is tuned to.
    pub(super) fn tuning_key(&self) -> &'static str {
        match self.tuned {
            Tuned::If { .. } => "front_end.if_hz",
            Tuned::Centre { .. } => "front_end.center_hz",
        }
    }

    /// The start of what is said of it, where it has a name.
    pub(super) fn of_it(&self) -> String {
        self.name.as_ref().map_or_else(String::new, |name| format!("front end {name}: "))
    }
}

impl Scenario {
    /// Returns the scenario with one front end of its list alone, which generates the same bytes as in the
    /// list.
    ///
    /// # Errors
    /// A name that no front end has, with those that there are.
    pub fn with_front_end(&self, name: &str) -> Result<Self, ScenarioError> {
        let own = self.front_ends.iter().find(|front_end| front_end.name.as_deref() == Some(name));
        let Some(own) = own else {
            let known = self.front_end_names();
            let known = if known.is_empty() { "none has a name".to_owned() } else { known.join(", ") };
            return Err(self.conflict("front_end.name", format!("none is called {name:?}: {known}")));
        };
        Ok(Self { front_ends: vec![own.clone()], ..self.clone() })
    }

    /// Names of the front ends, in order.
    pub fn front_end_names(&self) -> Vec<&str> {
        self.front_ends.iter().filter_map(|front_end| front_end.name.as_deref()).collect()
    }
}

/// Every front end of a scenario, each with the knobs of fidelity that suit its rate where code errors below
/// `allowed_m` do not matter; `None` where one cannot be read.
pub(super) fn front_ends(root: &Table<'_>, allowed_m: f64, refusals: &mut Refusals) -> Option<Vec<FrontEnd>> {
    let tables = refusals.take(root.one_or_more("front_end")).flatten();
    let fidelity = refusals.take(root.table("fidelity")).flatten();
    let tables: Vec<Option<Table<'_>>> = match tables {
        None => vec![None],
        Some(tables) if tables.is_empty() => {
            refusals.add(root.bad("front_end", "at least one front end"));
            return None;
        }
        Some(tables) => tables.into_iter().map(Some).collect(),
    };
    let many = tables.len() > 1;
    if many {
        alone(root, tables.len()).into_iter().for_each(|refusal| refusals.add(refusal));
    }
    let reader = Reader { root, many, fidelity: fidelity.as_ref(), allowed_m };
    let found: Vec<Option<FrontEnd>> = tables.iter().map(|table| reader.read(table.as_ref(), refusals)).collect();
    let found: Vec<FrontEnd> = found.into_iter().collect::<Option<_>>()?;
    // Names of files: some systems do not distinguish capitals.
    for (index, one) in found.iter().enumerate() {
        let same = |other: &FrontEnd| match (&one.name, &other.name) {
            (Some(one), Some(other)) => one.eq_ignore_ascii_case(other),
            _ => false,
        };
        if let (true, Some(Some(table))) = (found.iter().take(index).any(same), tables.get(index)) {
            refusals.add(table.bad("name", "a name that no other front end has, capitals apart"));
            return None;
        }
    }
    Some(found)
}

/// Errors for keys at the top of a scenario that are not allowed beside several front ends.
fn alone(root: &Table<'_>, count: usize) -> Vec<ScenarioError> {
    let mut refused = Vec::new();
    for table in ["local_oscillator", "filter", "iq", "adc"].into_iter().filter(|table| root.has(table)) {
        let expected = format!(
            "nothing at the top beside several front ends: write [front_end.{table}] below the [[front_end]] that \
             has it"
        );
        refused.push(root.bad(table, expected));
    }
    if root.has("playback") {
        refused.push(root.bad("playback", "one front end, whose samples the transmitter plays"));
    }
    if count > MOST {
        refused.push(root.bad("front_end", format!("at most {MOST} front ends, not {count}")));
    }
    refused
}

/// Reader of the tables of front ends, with their common values.
struct Reader<'r, 't> {
    root: &'r Table<'t>,
    many: bool,
    fidelity: Option<&'r Table<'t>>,
    allowed_m: f64,
}

impl Reader<'_, '_> {
    fn read(&self, table: Option<&Table<'_>>, refusals: &mut Refusals) -> Option<FrontEnd> {
        let name = table.map_or(Ok(None), |table| self.name(table));
        let name = refusals.take(name);
        let rate_hz = refusals.take(table.map_or(Ok(RATE_HZ), |table| table.need("sample_rate_hz")))?;
        let rate = Rate::from_hz(rate_hz).ok_or_else(|| self.root.bad("front_end", "a sample rate"));
        let rate = refusals.take(rate)?;
        let format = refusals.take(table.map_or(Ok(Format::Ci8), format))?;
        let tuned = refusals.take(table.map_or(Ok(Tuned::If { if_hz: 0.0 }), |table| self.tuned(table, rate, format)));
        let signals = refusals.take(table.map_or(Ok(None), |table| signal_list(table, "signals")));
        let inverted = refusals.take(table.map_or(Ok(None), |table| table.flag("spectrum_inverted")));
        let noise_lsb = refusals.take(table.map_or(Ok(None), |table| table.number("noise_lsb")));
        let stages = self.stages(table, format, refusals);
        let fidelity = refusals.take(fidelity_of(self.fidelity, self.allowed_m));
        Some(FrontEnd {
            name: name?,
            element: None,
            rate,
            tuned: tuned?,
            inverted: inverted?.unwrap_or(false),
            format,
            noise_lsb: noise_lsb?.map(|x| x as f32),
            signals: signals?,
            stages,
            fidelity: fidelity?,
        })
    }

    fn name(&self, table: &Table<'_>) -> Result<Option<String>, ScenarioError> {
        let expected = "1 to 64 letters, digits, '-' and '_' (it names files)";
        let Some(name) = table.text("name")? else {
            let named = "a name, because there are several front ends: 1 to 64 letters, digits, '-' and '_'";
            return if self.many { Err(table.bad("name", named)) } else { Ok(None) };
        };
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.len() <= 64 && name.chars().all(fits) {
            Ok(Some(name.to_owned()))
        } else {
            Err(table.bad("name", expected))
        }
    }

    fn tuned(&self, table: &Table<'_>, rate: Rate, format: Format) -> Result<Tuned, ScenarioError> {
        if let Some(center_hz) = table.number("center_hz")? {
            if table.has("if_hz") {
                return Err(table.bad("if_hz", "nothing beside center_hz, which says where the samples are centred"));
            }
            return Ok(Tuned::Centre { center_hz });
        }
        if self.many {
            let expected = "the radio frequency at 0 Hz of the samples, because there are several front ends";
            return Err(table.bad("center_hz", expected));
        }
        let half = 0.5 * rate.hz();
        let if_hz = table.need("if_hz")?;
        if format.is_complex() && if_hz.abs() >= half {
            return Err(table.bad("if_hz", format!("less than half of sample_rate_hz in size, {half} Hz")));
        }
        if !format.is_complex() && !is_place_of_real(if_hz, rate) {
            return Err(table.bad(
                "if_hz",
                format!(
                    "more than 0 and no multiple of half of sample_rate_hz, {half} Hz, because format = {format} is \
                     real"
                ),
            ));
        }
        Ok(Tuned::If { if_hz })
    }

    /// The stages of a front end: below it, or of a single one at the top.
    fn stages(&self, own: Option<&Table<'_>>, format: Format, refusals: &mut Refusals) -> Stages {
        let mut open = |name: &'static str| {
            let below = own.and_then(|own| refusals.take(own.table(name)).flatten());
            let above = if self.many { None } else { refusals.take(self.root.table(name)).flatten() };
            if below.is_some() && above.is_some() {
                refusals.add(self.root.bad(name, format!("nothing beside [front_end.{name}]")));
            }
            below.or(above)
        };
        let [oscillator, filter, iq, adc] = ["local_oscillator", "filter", "iq", "adc"].map(&mut open);
        Stages {
            oscillator: refusals.take(oscillator.map(|t| stages::local_oscillator(&t)).transpose()).flatten(),
            filter: refusals.take(filter.map(|t| stages::filter(&t)).transpose()).flatten(),
            balance: refusals.take(iq.map(|t| stages::balance(&t, format)).transpose()).flatten(),
            converter: refusals.take(adc.map(|t| stages::converter(&t, format)).transpose()).flatten(),
        }
    }
}

fn format(table: &Table<'_>) -> Result<Format, ScenarioError> {
    match table.text("format")? {
        Some(text) => text.parse().map_err(|_| {
            let expected = format!("one of ci8, cu8, ci16, cf32, ri8, ri16{}", Format::suggestion(text));
            table.bad("format", expected)
        }),
        None => Ok(Format::Ci8),
    }
}

/// True if real samples can contain a carrier at this frequency. Above half the rate they contain a folded
/// band, as in bandpass sampling. On a multiple of half the rate the band overlaps itself.
pub(super) fn is_place_of_real(if_hz: f64, rate: Rate) -> bool {
    if_hz > 0.0 && (if_hz / (0.5 * rate.hz())).fract() != 0.0
}
