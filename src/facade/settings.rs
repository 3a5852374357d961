//! Settings of the receiver, with defaults for all of them.
//!
//! [`Settings`] has four groups: [`AcquisitionSettings`], [`TrackingSettings`], [`PositionSettings`] and
//! [`OperationSettings`]:
//!
//! ```
//! use gnss_twin::settings::{
//!     AcquisitionSettings, OperationSettings, PositionSettings, Settings, TrackingSettings,
//! };
//!
//! let settings = Settings {
//!     acquisition: AcquisitionSettings { signals: vec!["Galileo E1".to_owned()], ..Default::default() },
//!     tracking: TrackingSettings { pll_bandwidth_hz: 10.0, ..Default::default() },
//!     position: PositionSettings { mask_deg: 15.0, ..Default::default() },
//!     operation: OperationSettings { measurement_interval_ms: 200, ..Default::default() },
//!     ..Settings::default()
//! };
//! settings.validate("own")?;
//! assert_ne!(settings, Settings::default());
//! # Ok::<(), gnss_twin::settings::SettingsError>(())
//! ```
//!
//! Some settings are choices:
//!
//! ```
//! use gnss_twin::settings::{
//!     CodeDiscriminator, IonosphereChoice, SbasChoice, Settings, SystemClocks, TroposphereChoice,
//! };
//!
//! let mut settings = Settings::default();
//! // For a scene without atmosphere.
//! settings.position.ionosphere = IonosphereChoice::None;
//! settings.position.troposphere = TroposphereChoice::None;
//! settings.tracking.dll_discriminator = CodeDiscriminator::DotProduct;
//! let (_, _): (SbasChoice, SystemClocks) = (settings.position.sbas, settings.position.system_clocks);
//! let text = "position = { ionosphere = \"none\", troposphere = \"none\" }\n\
//!             tracking = { dll_discriminator = \"dot_product\" }\n";
//! assert_eq!(settings, Settings::parse(text, "own.toml")?);
//! # Ok::<(), gnss_twin::settings::SettingsError>(())
//! ```
//!
//! Authentication and protection levels have tables that a text sets:
//!
//! ```
//! use gnss_twin::settings::Settings;
//!
//! let settings = Settings::parse("[integrity]\nmethod = \"raim\"\n", "own.toml")?;
//! assert!(settings.integrity.is_some() && settings.osnma.is_none());
//! # Ok::<(), gnss_twin::settings::SettingsError>(())
//! ```
//!
//! A text is refused with its line, key and value, in a [`SettingsError`]:
//!
//! ```
//! use gnss_twin::settings::{Settings, SettingsError};
//!
//! let error = Settings::parse("[tracking]\npll_bandwidth_hertz = 5\n", "own.toml").unwrap_err();
//! assert!(matches!(error, SettingsError::UnknownKey { .. }));
//! assert!(error.to_string().starts_with("own.toml:2:1: unknown key"), "{error}");
//! ```

#[doc(inline)]
pub use ::receiver::acquire::AcquisitionSettings;
#[doc(inline)]
pub use ::receiver::position::{IonosphereChoice, PositionSettings, SbasChoice, SystemClocks, TroposphereChoice};
#[doc(inline)]
pub use ::receiver::settings::{OperationSettings, Settings, SettingsError};
#[doc(inline)]
pub use ::receiver::track::settings::{CodeDiscriminator, TrackingSettings};
