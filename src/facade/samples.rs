//! IF samples: their formats, the description of a recording, and SigMF.
//!
//! An [`IfMetadata`] is what a data sheet says of a recording. It has no field for truth:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let rate = Rate::from_hz(4e6).ok_or("no rate")?;
//! let center_hz = 1_575.42e6 - 50e3;
//! let metadata = IfMetadata { format: Format::Ci16Le, rate, center_hz, inverted: false, start: None };
//! assert_eq!(metadata.if_hz(1_575.42e6), 50e3);
//! assert_eq!(metadata.format.bytes(), 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Format`] has a name, and packs [`Complex`] samples in units of its least significant bit:
//!
//! ```
//! use gnss_twin::samples::{Complex, Format, FormatError};
//!
//! let format: Format = "ci8".parse()?;
//! let bytes = format.pack_complex(&[Complex::new(1.2, -3.0), Complex::new(500.0, 0.0)]);
//! assert_eq!(bytes, [1, 253, 127, 0]);
//! assert_eq!(format.unpack_complex(&bytes), [Complex::new(1.0, -3.0), Complex::new(127.0, 0.0)]);
//! assert!(matches!("ci12".parse::<Format>(), Err(FormatError { .. })));
//! # Ok::<(), FormatError>(())
//! ```
//!
//! [`write_sigmf`] and [`read_sigmf`] are the texts of `.sigmf-meta` files:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::samples::{SigmfError, read_sigmf, write_sigmf};
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let center_hz = 1_575.42e6;
//! let metadata = IfMetadata { format: Format::Ci8, rate, center_hz, inverted: false, start: None };
//! assert_eq!(read_sigmf(&write_sigmf(&metadata), "own.sigmf-meta")?, metadata);
//! let refused: Result<IfMetadata, SigmfError> = read_sigmf("{}", "own.sigmf-meta");
//! assert!(refused.unwrap_err().to_string().starts_with("own.sigmf-meta"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use ::gnss::samples::{Format, FormatError, IfMetadata};
#[doc(inline)]
pub use ::gnss::sigmf::{SigmfError, parse as read_sigmf, write as write_sigmf};
#[doc(no_inline)]
pub use num_complex::Complex;
