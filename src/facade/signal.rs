//! Signals as data: carrier, codes, pulses, secondary codes, messages.
//!
//! [`Signal::find`] gives a built-in signal by its name, and [`all`] lists them:
//!
//! ```
//! use gnss_twin::signal::{L1_CA, Signal, all};
//!
//! assert_eq!(Signal::find("GPS L1 C/A").map(|signal| signal.rinex), Some(L1_CA.rinex));
//! assert!(all().len() >= 25);
//! // IS-GPS-200, table 3-Ia: the code of PRN 7 begins with 1131 octal, and a 1 is sent as −1.
//! let code = L1_CA.code(7).ok_or("no code")?;
//! let first = code[..10].iter().fold(0, |word, &chip| word << 1 | u32::from(chip < 0));
//! assert_eq!((code.len(), first), (1023, 0o1131));
//! # Ok::<(), &str>(())
//! ```
//!
//! A [`Link`] is the signal of one satellite. The [`Carrier`] may depend on it:
//!
//! ```
//! use gnss_twin::satellite::Sv;
//! use gnss_twin::signal::{Carrier, Link, Signal};
//!
//! let signal = Signal::find("GLONASS G1").ok_or("no signal")?;
//! assert!(matches!(signal.carrier, Carrier::Channels { .. }));
//! let link = |name: &str| Ok::<Link, Box<dyn std::error::Error>>(Link { sv: name.parse()?, signal });
//! // Slot 1 sends on channel 1, slot 2 on channel −4.
//! assert_eq!(link("R01")?.carrier_hz() - link("R02")?.carrier_hz(), 5.0 * 562.5e3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Component`] has the shape of its chips in [`Layer`]s, and a [`SecondaryCode`]:
//!
//! ```
//! use gnss_twin::signal::{Component, E1, SecondaryCode};
//!
//! let [data, pilot]: &[Component; 2] = E1.components.try_into()?;
//! assert!(data.message.is_some() && pilot.message.is_none());
//! assert!(matches!(pilot.secondary_code, SecondaryCode::Shared(chips) if chips.len() == 25));
//! // CBOC: two layers on every chip.
//! assert_eq!(data.layers.len(), 2);
//! # Ok::<(), std::array::TryFromSliceError>(())
//! ```
//!
//! A signal of one's own is described by a file that the key `signal_file` of a scenario names. Or it is a
//! `static`, which takes from a built-in one what it does not change. It is [`register`]ed before a scenario
//! names it:
//!
//! ```
//! use gnss_twin::signal::{Component, L1_CA, Layer, NameTaken, Signal, always, register};
//!
//! static SPLIT: Signal = Signal {
//!     name: "split L1",
//!     components: &[Component { layers: &[Layer::BOC11], ..L1_CA.components[0] }],
//!     sent: always,
//!     ..L1_CA
//! };
//! static OTHER: Signal = Signal { name: "split L1", ..L1_CA };
//! register(&SPLIT)?;
//! assert!(Signal::find("split L1").is_some());
//! assert!(matches!(register(&OTHER), Err(NameTaken { .. })));
//! # Ok::<(), NameTaken>(())
//! ```

#[doc(inline)]
pub use ::gnss::galileo::e1::E1;
#[doc(inline)]
pub use ::gnss::gps::l1ca::L1_CA;
#[doc(inline)]
pub use ::gnss::signal::{Carrier, Component, Layer, Link, NameTaken, SecondaryCode, Signal, all, always, register};
