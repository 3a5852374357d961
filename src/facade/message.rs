//! Navigation messages: how a satellite's symbols are made and read.
//!
//! A [`Message`] has a [`Sender`], which makes the symbols of a unit, and a [`Reader`], which takes soft
//! symbols and returns [`Read`] values. A unit that is sent and read gives its time:
//!
//! ```
//! use gnss_twin::message::{Common, LNAV, Read};
//! use gnss_twin::orbit::embedded_navigation;
//!
//! let set = &embedded_navigation()?.ephemerides[0];
//! let sender = (LNAV.sender)(&Common::default())?;
//! let mut reader = (LNAV.reader)(set.sv);
//! let mut read = Vec::new();
//! // Four subframes: the first one is recognised by the preamble of the second.
//! for second in [0, 6, 12, 18] {
//!     let start = set.toe.plus_s(f64::from(second) - 1800.0);
//!     for symbol in sender.unit(set, start)? {
//!         read.extend(reader.take(if symbol { -1.0 } else { 1.0 }, set.toe));
//!     }
//! }
//! assert!(read.iter().any(|read| matches!(read, Read::Unit { inverted: false, .. })), "{read:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Message`] of one's own is a `static` too. [`FieldError`] is what a sender returns for a value that the
//! message cannot carry, [`SetForm`] what clock and health of its ephemerides refer to, [`SetFields`] what
//! their parameters are. The example `own_signal` has a whole message.
//!
//! ```
//! use gnss_twin::message::{INAV, LNAV, Message};
//!
//! static SLOW: Message = Message { name: "slow", symbol_s: 2.0 * LNAV.symbol_s, ..LNAV };
//! assert_eq!([&SLOW, &LNAV, &INAV].map(Message::unit_symbols), [150, 300, 500]);
//! ```

#[doc(inline)]
pub use ::gnss::bits::FieldError;
#[doc(inline)]
pub use ::gnss::broadcast::SetForm;
#[doc(inline)]
pub use ::gnss::galileo::inav::INAV;
#[doc(inline)]
pub use ::gnss::gps::lnav::LNAV;
#[doc(inline)]
pub use ::gnss::ionosphere::Model as IonosphereModel;
#[doc(inline)]
pub use ::gnss::message::{Common, IonosphereForm, Message, Parameters, Read, Reader, Sender, SetFields};
