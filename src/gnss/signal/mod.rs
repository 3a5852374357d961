//! Signals as data: a carrier and components, each with a code, the pulses of its chips, and optionally a
//! secondary code and a message.
//!
//! To add a signal: one file in `gnss/<system>/` with a `static` [`Signal`], one word in [`SIGNALS`]. Law
//! tests walk that registry. A program that has a signal of its own calls [`register`] before it names it
//! anywhere; a text describes one by [`described`]. Nothing outside `gnss` may branch on a signal's name. A
//! component's spectrum and correlation follow from its pulses ([`Shape`]).

use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{PoisonError, RwLock};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::earth::SPEED_OF_LIGHT_MPS;
use crate::message::Message;
use crate::place::{bare, nearest};
use crate::satellite::{Sv, System};
use crate::time::{Epoch, TimeScale};
use crate::{beidou, galileo, glonass, gps, navic, qzss, sbas};

mod bands;
mod dated;
pub mod described;
mod peak;
mod shape;
#[cfg(any(test, feature = "planted"))]
pub mod synthetic;
#[cfg(test)]
mod table_tests;
mod tone;

pub use bands::band_hz;
pub use peak::PeakTable;
pub use shape::{Shape, chip_kinds, phasor, sinc, sinc_squared};
pub use tone::Tone;

/// The built-in signals.
pub static SIGNALS: [&Signal; 25] = [
    &gps::l1ca::L1_CA,
    &gps::l1c::L1C,
    &gps::l2c::L2C,
    &gps::l5::L5,
    &galileo::e1::E1,
    &galileo::e5::E5A,
    &galileo::e5::E5B,
    &galileo::altboc::E5,
    &galileo::e6::E6,
    &navic::sps::L5,
    &navic::sps::S,
    &navic::l1::L1,
    &beidou::in_phase::B1I,
    &beidou::in_phase::B2I,
    &beidou::in_phase::B3I,
    &beidou::b1c::B1C,
    &beidou::b2a::B2A,
    &beidou::b2b::B2B,
    &glonass::fdma::G1,
    &glonass::fdma::G2,
    &qzss::l1ca::L1_CA,
    &qzss::l1c::L1C,
    &qzss::l2c::L2C,
    &qzss::l5::L5,
    &sbas::l1::L1,
];

/// Signals that [`register`] has added. Names in files have to find them, so they are the program's, not a
/// scene's.
static ADDED: RwLock<Vec<&'static Signal>> = RwLock::new(Vec::new());

/// Adds a signal to those that names find. The receiver searches for it if its settings name it. A second
/// registration of the same signal changes nothing.
///
/// # Errors
/// Another signal of that name.
pub fn register(signal: &'static Signal) -> Result<(), NameTaken> {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    match SIGNALS.iter().chain(added.iter()).find(|other| other.name == signal.name) {
        Some(other) if std::ptr::eq(*other, signal) => {}
        Some(_) => return Err(NameTaken(signal.name)),
        None => added.push(signal),
    }
    Ok(())
}

/// Lists all registered signals: the built-in ones first, then those that were added, in order.
pub fn all() -> Vec<&'static Signal> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    SIGNALS.iter().chain(added.iter()).copied().collect()
}

/// Reason for which a signal cannot be added.
#[derive(Debug, Error, PartialEq)]
#[error("there is another signal named '{0}'")]
pub struct NameTaken(&'static str);

/// A signal that satellites of one system send.
#[derive(Debug)]
pub struct Signal {
    /// Name as people write it, unique.
    pub name: &'static str,
    /// RINEX 3 band and attribute, for `C1C`, `L1C`, `D1C`, `S1C`.
    pub rinex: &'static str,
    /// System whose satellites send the signal.
    pub system: System,
    /// Time scale of the codes and messages.
    pub time: &'static TimeScale,
    /// First and last number of the constellation's satellites. Codes of other numbers belong to other
    /// transmitters.
    pub constellation: [u8; 2],
    /// Carrier of the signal.
    pub carrier: Carrier,
    /// Function that returns true if the satellite with this number sends the signal at a time.
    pub sent: fn(u8, Epoch) -> bool,
    /// Least received power on the ground in dBW that the documents guarantee, for all components together.
    /// Without it a link budget is refused.
    pub minimum_power_dbw: Option<f64>,
    /// Components on the carrier; their power shares add up to one.
    pub components: &'static [Component],
}

/// One signal of one satellite. Links are ordered by satellite, then by signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Link {
    /// The satellite.
    pub sv: Sv,
    /// The signal.
    pub signal: &'static Signal,
}

/// Carrier frequencies of a signal.
#[derive(Clone, Copy, Debug)]
pub enum Carrier {
    /// One frequency for all satellites, in hertz.
    Common(f64),
    /// Frequency division: satellite `n` sends on `centre_hz + step_hz · channel(n)`.
    Channels {
        /// Carrier of channel 0, in Hz.
        centre_hz: f64,
        /// Distance of channels, in Hz.
        step_hz: f64,
        /// Channel of a satellite by its number; `None` where none is assigned.
        channel: fn(u8) -> Option<i8>,
    },
}

/// Codes of a component's satellites by their numbers ([`Component::code`]).
pub(crate) type Codes = dyn Fn(u8) -> Option<Vec<i8>> + Sync;

/// One spreading code on a carrier.
pub struct Component {
    /// Share of the signal's power.
    pub power_share: f64,
    /// Carrier phase relative to the signal's reference phase, in cycles.
    pub phase_cycles: f64,
    /// Chips per second, by the satellite's clock.
    pub chip_rate_hz: f64,
    /// Chips in one period of the code.
    pub code_chips: u32,
    /// Function that returns the code of a satellite number: `code_chips` values. They are +1 for a logical
    /// 0, −1 for a logical 1, and 0 where another component's code has its turn. `None` if the document
    /// assigns no code.
    pub code: &'static (dyn Fn(u8) -> Option<Vec<i8>> + Sync),
    /// Layers whose sum is the waveform of a chip.
    pub layers: &'static [Layer],
    /// Secondary code: a chip for each period of the code.
    pub secondary_code: SecondaryCode,
    /// Message that modulates the component; a pilot has none.
    pub message: Option<&'static Message>,
}

/// Pulse of chips, with its amplitude and phase. BPSK and BOC are one layer, CBOC and QMBOC two on every
/// chip, TMBOC two on different chips.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Amplitude of the layer. The mean power of all layers over all chips is one.
    pub weight: f64,
    /// Carrier phase relative to the component's, in cycles.
    pub phase_cycles: f64,
    /// Signs of equal steps of a chip.
    pub pulse: &'static [i8],
    /// Chips that have the pulse, repeated from the beginning of each code period; empty for all chips.
    pub chips: &'static [bool],
}

/// Layers of its components with which a signal is generated, by a transmitter or as a replica.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layers {
    /// All, with their weights and phases.
    #[default]
    Whole,
    /// Layer of each component with the largest power, at the amplitude that it has in the whole.
    Strongest,
}

impl Layers {
    /// Both, by the words of files.
    pub const NAMES: [(&'static str, Self); 2] = [("whole", Self::Whole), ("strongest", Self::Strongest)];

    /// Word for the value in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Strongest => "strongest",
        }
    }
}

/// Code that multiplies the spreading code, with one chip for each of its periods.
#[derive(Clone, Copy, Debug)]
pub enum SecondaryCode {
    /// No secondary code.
    None,
    /// Secondary code that all satellites share: values of ±1.
    Shared(&'static [i8]),
    /// A satellite's own by its number; `chips` values of ±1.
    PerSatellite {
        /// Length of each.
        chips: u32,
        /// A satellite's chips; `None` where none are assigned.
        of: fn(u8) -> Option<Vec<i8>>,
    },
}

/// Returns true at all times, for a signal that every satellite of its system has always sent.
pub fn always(_: u8, _: Epoch) -> bool {
    true
}

impl Signal {
    /// The signal of that name.
    pub fn find(name: &str) -> Option<&'static Self> {
        all().into_iter().find(|signal| signal.name == name)
    }

    /// Suggestion for a name that [`Signal::find`] does not know, for an error message. It lists the signals
    /// whose names contain the text, or else the most similar one. Case, blanks and slashes do not count. It
    /// is empty if there are none.
    pub fn suggestion(name: &str) -> String {
        let text = bare(name);
        let all: Vec<&str> = all().into_iter().map(|signal| signal.name).collect();
        let mut alike: Vec<&str> = all.iter().copied().filter(|known| bare(known).contains(&text)).collect();
        if text.is_empty() {
            return String::new();
        }
        // A whole name that others begin with is none of them.
        if let Some(whole) = alike.iter().copied().find(|known| bare(known) == text) {
            alike = vec![whole];
        }
        let names: Vec<String> = match nearest(name, &all) {
            Some(near) if alike.is_empty() => vec![format!("\"{near}\"")],
            _ => alike.into_iter().map(|known| format!("\"{known}\"")).collect(),
        };
        if names.is_empty() { String::new() } else { format!(" (did you mean {}?)", names.join(" or ")) }
    }

    /// Carrier frequency of a satellite in Hz, or the middle of the band if the satellite has no channel.
    pub fn carrier_hz(&self, sv: Sv) -> f64 {
        match self.carrier {
            Carrier::Common(hz) => hz,
            Carrier::Channels { centre_hz, step_hz, channel } => {
                let channel = f64::from(channel(sv.number).unwrap_or(0));
                centre_hz + step_hz * planted!("gnss.signal.channel", channel, -channel)
            }
        }
    }

    /// Code of the first component for a satellite number: chips of −1, 0 and +1 over one period. `None` if
    /// the document assigns no code to the number.
    pub fn code(&self, number: u8) -> Option<Vec<i8>> {
        self.components.first().and_then(|component| (component.code)(number))
    }

    /// True if one of the signal's components carries the message.
    pub fn carries(&self, message: &Message) -> bool {
        self.components.iter().any(|component| component.message == Some(message))
    }

    /// Returns the link of this signal and one satellite.
    pub fn link(&'static self, sv: Sv) -> Link {
        Link { sv, signal: self }
    }

    /// Middle of the band, in Hz: the carrier of all satellites, or that of channel 0.
    pub fn centre_hz(&self) -> f64 {
        match self.carrier {
            Carrier::Common(hz) => hz,
            Carrier::Channels { centre_hz, .. } => centre_hz,
        }
    }

    /// Lowest and highest carrier in Hz of the satellites to which one is assigned.
    pub fn carriers_hz(&self) -> (f64, f64) {
        match self.carrier {
            Carrier::Common(hz) => (hz, hz),
            Carrier::Channels { centre_hz, step_hz, channel } => {
                let carriers = || {
                    let channels = (1..=u8::MAX).filter_map(channel);
                    channels.map(|channel| centre_hz + step_hz * f64::from(channel))
                };
                (carriers().fold(centre_hz, f64::min), carriers().fold(centre_hz, f64::max))
            }
        }
    }

    /// Distance in Hz from the carrier to the outer end of the main lobes.
    pub fn lobe_hz(&self) -> f64 {
        self.components.iter().fold(0.0_f64, |most, component| most.max(component.lobe_hz()))
    }

    /// Carrier wavelength of a satellite, in metres.
    pub fn wavelength_m(&self, sv: Sv) -> f64 {
        SPEED_OF_LIGHT_MPS / self.carrier_hz(sv)
    }

    /// Satellites of the signal's system to which the documents assign a carrier and codes.
    pub fn satellites(&'static self) -> impl Iterator<Item = Sv> {
        (1..=u8::MAX).filter(|&number| self.is_assigned(number)).map(|number| Sv { system: self.system, number })
    }

    fn is_assigned(&self, number: u8) -> bool {
        let has_carrier = match self.carrier {
            Carrier::Common(_) => true,
            Carrier::Channels { channel, .. } => channel(number).is_some(),
        };
        has_carrier && self.components.iter().all(|component| component.has_code(number))
    }
}

impl Link {
    /// Carrier frequency, in Hz.
    pub fn carrier_hz(self) -> f64 {
        self.signal.carrier_hz(self.sv)
    }

    /// Frequency channel of the link, if satellites divide the band.
    pub fn channel(self) -> Option<i8> {
        match self.signal.carrier {
            Carrier::Common(_) => None,
            Carrier::Channels { channel, .. } => channel(self.sv.number),
        }
    }

    /// True if another satellite's signal differs only in its message: it has the same signal, carrier and
    /// code.
    pub fn is_alike(self, other: Self) -> bool {
        let same = |component: &Component| {
            let of = |sv: Sv| ((component.code)(sv.number), component.secondary_code.of(sv.number));
            of(self.sv) == of(other.sv)
        };
        let on_one_channel = self.channel().is_some() && self.channel() == other.channel();
        self == other || self.signal == other.signal && on_one_channel && self.signal.components.iter().all(same)
    }

    /// True if a satellite of the constellation sends the signal, and not another transmitter that borrows
    /// its code.
    pub fn is_of_constellation(self) -> bool {
        let [first, last] = self.signal.constellation;
        (first..=last).contains(&self.sv.number)
    }

    /// Carrier wavelength, in metres.
    pub fn wavelength_m(self) -> f64 {
        self.signal.wavelength_m(self.sv)
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{} {}", self.sv, self.signal))
    }
}

impl Layer {
    /// One rectangular pulse on every chip.
    pub const BPSK: Self = Self { weight: 1.0, phase_cycles: 0.0, pulse: &[1], chips: &[] };
    /// Layer of BOC(m, n) with m = n: one period of a sine-phased square wave on every chip.
    pub const BOC11: Self = Self { pulse: &[1, -1], ..Self::BPSK };
    /// BOC(m, n) with m = 6 n.
    pub const BOC61: Self = Self { pulse: &[1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1], ..Self::BPSK };

    /// Distance from the carrier to the outer end of the main lobes, in chip rates: 1 for BPSK, (m + n)/n for
    /// BOC(m, n).
    pub fn lobe_chips(&self) -> f64 {
        // Half a period of the square wave is its longest run of one sign; a cosine's begin and end in the
        // middle of one.
        let longest = self.pulse.chunk_by(|a, b| a == b).map(<[i8]>::len).max().unwrap_or(0);
        let steps = self.pulse.len();
        if longest == steps { 1.0 } else { 1.0 + 0.5 * steps as f64 / longest as f64 }
    }

    /// True if chip `index` of a code period has this pulse.
    pub fn covers(&self, index: usize) -> bool {
        self.chips.is_empty() || self.chips.get(index % self.chips.len()).copied().unwrap_or(false)
    }
}

impl SecondaryCode {
    /// Number of spreading code periods in one secondary code period; 1 without a secondary code.
    pub fn periods(&self) -> u32 {
        match self {
            Self::None => 1,
            Self::Shared(chips) => chips.len() as u32,
            Self::PerSatellite { chips, .. } => *chips,
        }
    }

    /// Chips of satellite `number`; `[1]` without a secondary code, `None` if the document assigns none.
    pub fn of(&self, number: u8) -> Option<Vec<i8>> {
        match self {
            Self::None => Some(vec![1]),
            Self::Shared(chips) => Some(chips.to_vec()),
            Self::PerSatellite { of, .. } => of(number),
        }
    }
}

impl Component {
    /// Duration of one code period in seconds, by the satellite's clock.
    pub fn period_s(&self) -> f64 {
        f64::from(self.code_chips) / self.chip_rate_hz
    }

    /// Number of code periods in one symbol of the message. `None` for a pilot, and for a symbol that is not
    /// a whole number of periods.
    pub fn periods_per_symbol(&self) -> Option<u32> {
        let periods = self.message?.symbol_s / self.period_s();
        ((periods - periods.round()).abs() < 1e-6 && periods > 0.5).then_some(periods.round() as u32)
    }

    /// Number of steps into which the pulses of all layers divide a chip.
    pub fn steps_per_chip(&self) -> usize {
        self.layers.iter().fold(1, |steps, layer| least_common_multiple(steps, layer.pulse.len().max(1)))
    }

    /// Layers of the component that `layers` selects. A sideband of a subcarrier always keeps all, because no
    /// single layer is the sideband.
    pub fn made_with(&self, layers: Layers) -> &[Layer] {
        match layers {
            Layers::Whole => self.layers,
            Layers::Strongest if self.tone().is_some() => self.layers,
            Layers::Strongest => self.strongest().map_or(&[], std::slice::from_ref),
        }
    }

    /// Layer with the largest power over all chips; the first one if several are equal.
    pub fn strongest(&self) -> Option<&Layer> {
        let power = |layer: &Layer| {
            let covered = layer.chips.iter().filter(|&&covered| covered).count();
            let share = if layer.chips.is_empty() { 1.0 } else { covered as f64 / layer.chips.len() as f64 };
            layer.weight * layer.weight * share
        };
        self.layers.iter().rev().max_by(|a, b| power(a).total_cmp(&power(b)))
    }

    /// Distance in Hz from the carrier to the outer end of the main lobes of the strongest layer.
    pub fn lobe_hz(&self) -> f64 {
        self.chip_rate_hz * self.strongest().map_or(0.0, Layer::lobe_chips)
    }

    /// Correlation and spectrum of the waveform.
    pub fn shape(&self) -> Shape {
        self.shape_of(Layers::Whole)
    }

    /// Correlation and spectrum of some of the layers. Their power relative to the whole is the correlation
    /// at zero delay.
    pub fn shape_of(&self, layers: Layers) -> Shape {
        self.shape_between(layers, layers)
    }

    /// Cross correlation of some of the component's layers with others.
    pub fn shape_between(&self, sent: Layers, made: Layers) -> Shape {
        Shape::between(self.made_with(sent), self.made_with(made), self.chip_rate_hz)
    }

    /// Correlation of the waveform, sent with `sent`, with a replica of one of its layers. The replica has
    /// that layer's phase and sign. The second result is the correlation of the replica, of unit weight, with
    /// itself.
    pub fn shapes_by(&self, sent: Layers, made: &Layer) -> [Shape; 2] {
        let turned: Vec<Layer> = (self.made_with(sent).iter())
            .map(|layer| Layer {
                weight: made.weight.signum() * layer.weight,
                phase_cycles: layer.phase_cycles - made.phase_cycles,
                ..*layer
            })
            .collect();
        let alone = [Layer { weight: 1.0, phase_cycles: 0.0, ..*made }];
        [&turned, &alone[..]].map(|sent| Shape::between(sent, &alone, self.chip_rate_hz))
    }

    fn has_code(&self, number: u8) -> bool {
        (self.code)(number).is_some() && self.secondary_code.of(number).is_some()
    }
}

/// Least common multiple of two numbers above zero.
pub fn least_common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}

impl fmt::Debug for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { power_share, chip_rate_hz, code_chips, layers, message, .. } = self;
        let mut shown = f.debug_struct("Component");
        shown.field("power_share", power_share).field("chip_rate_hz", chip_rate_hz).field("code_chips", code_chips);
        shown.field("layers", layers).field("message", message).finish_non_exhaustive()
    }
}

impl PartialEq for Signal {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Signal {}

impl Hash for Signal {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

impl PartialOrd for Signal {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Signal {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.name.cmp(other.name)
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

/// Serialisation of a `&'static Signal` by its name, for `#[serde(with = …)]`.
pub mod by_name {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    use super::Signal;

    /// Writes the name.
    pub fn serialize<S: Serializer>(signal: &&'static Signal, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(signal.name)
    }

    /// Reads a name and looks the signal up.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static Signal, D::Error> {
        let name = String::deserialize(deserializer)?;
        Signal::find(&name).ok_or_else(|| D::Error::custom(format!("unknown signal '{name}'")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_added_signal_is_found_by_its_name_and_no_other_may_have_it() {
        static OWN: Signal = Signal { name: "own signal", ..gps::l1ca::L1_CA };
        static OTHER: Signal = Signal { name: "own signal", rinex: "9X", ..gps::l1ca::L1_CA };
        assert!(Signal::find("own signal").is_none());
        register(&OWN).unwrap();
        register(&OWN).unwrap();
        assert!(std::ptr::eq(Signal::find("own signal").unwrap(), &OWN));
        assert_eq!(all().iter().filter(|signal| signal.name == "own signal").count(), 1);
        assert_eq!(register(&OTHER), Err(NameTaken("own signal")));
        assert_eq!(&all()[..SIGNALS.len()], &SIGNALS);
    }

    #[test]
    fn an_unknown_name_suggests_the_signals_whose_names_contain_it() {
        let meant = Signal::suggestion("gps l1");
        assert!(meant.contains("\"GPS L1 C/A\" or \"GPS L1C\"") && !meant.contains("QZSS"), "{meant}");
        assert_eq!(Signal::suggestion("E6"), " (did you mean \"Galileo E6\"?)");
        assert_eq!(Signal::suggestion("GPS L1CA"), " (did you mean \"GPS L1 C/A\"?)");
        assert_eq!(Signal::suggestion("GPS-L1C"), " (did you mean \"GPS L1C\"?)");
        assert!(Signal::suggestion("L1CA").contains("\"GPS L1 C/A\" or "), "{}", Signal::suggestion("L1CA"));
        assert!(Signal::suggestion("Galileo E7").starts_with(" (did you mean \"Galileo E"));
        assert_eq!((Signal::suggestion("Transit"), Signal::suggestion("")), (String::new(), String::new()));
    }

    #[test]
    fn channels_divide_the_band() {
        let carrier = Carrier::Channels { centre_hz: 1_602e6, step_hz: 562_500.0, channel: |n| (n < 25).then_some(5) };
        let signal: &'static Signal =
            Box::leak(Box::new(Signal { carrier, system: System::Glonass, ..gps::l1ca::L1_CA }));
        let sv = Sv { system: System::Glonass, number: 3 };
        // GLONASS ICD L1, L2 (5.1), table 3.1: channel 5 is 1604.8125 MHz.
        assert_eq!(signal.link(sv).carrier_hz(), 1_604_812_500.0);
        assert_eq!(signal.centre_hz(), 1_602e6);
        // Codes are those of 37 numbers, channels of 24.
        assert_eq!(signal.satellites().count(), 24);
    }

    #[test]
    fn lobes_reach_as_far_as_the_pulses_oscillate() {
        let pulse = |pulse: &'static [i8]| Layer { pulse, ..Layer::BPSK }.lobe_chips();
        assert_eq!([Layer::BPSK, Layer::BOC11, Layer::BOC61].map(|layer| layer.lobe_chips()), [1.0, 2.0, 7.0]);
        // BOC(1.5, 1), BOC(1, 1) with a cosine, BOC(2, 1) with a cosine, and a chip in three equal steps.
        assert_eq!(pulse(&[1, -1, 1]), 2.5);
        assert_eq!(pulse(&[1, -1, -1, 1]), 2.0);
        assert_eq!(pulse(&[1, -1, -1, 1, 1, -1, -1, 1]), 3.0);
        assert_eq!(pulse(&[1, 1, 1]), 1.0);
        // A tenth of the power in BOC(6,1) reaches further.
        assert_eq!(synthetic::MIXED.lobe_hz(), 2.0 * 1.023e6);
        assert_eq!(synthetic::CHANNELS.carriers_hz(), (1_598_062_500.0, 1_605_375_000.0));
    }

    #[test]
    fn every_registered_signal_is_complete_and_found_by_its_name() {
        for signal in SIGNALS {
            assert!(std::ptr::eq(Signal::find(signal.name).unwrap(), signal));
            complete(signal);
        }
    }

    /// Checks the properties that every signal must have.
    pub(super) fn complete(signal: &'static Signal) {
        let power: f64 = signal.components.iter().map(|c| c.power_share).sum();
        assert!((power - 1.0).abs() < 1e-12, "{signal}");
        assert!(signal.satellites().count() > 0, "{signal}");
        for component in signal.components {
            // The layers' power over all chips that are not another component's.
            assert!((component.shape().correlation(0.0) - 1.0).abs() < 1e-12, "{signal}");
            for sv in signal.satellites() {
                let code = (component.code)(sv.number).unwrap();
                assert_eq!(code.len(), component.code_chips as usize, "{signal} {sv}");
                assert!(code.iter().all(|chip| chip.abs() <= 1), "{signal} {sv}");
                let secondary_code = component.secondary_code.of(sv.number).unwrap();
                assert_eq!(secondary_code.len(), component.secondary_code.periods() as usize, "{signal} {sv}");
                assert!(secondary_code.iter().all(|chip| chip.abs() == 1), "{signal} {sv}");
            }
            // A sub-carrier is upright again at a period's end.
            let halves = component.tone().map_or(0, |tone| tone.half_cycles.unsigned_abs());
            assert!((halves * component.code_chips).is_multiple_of(2), "{signal}");
        }
    }
}
