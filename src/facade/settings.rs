//! Settings of the receiver, with defaults for all of them.
//!
//! [`Settings`] has four groups: [`AcquisitionSettings`], [`TrackingSettings`], [`PositionSettings`] and
//! [`OperationSettings`], and [`IntegritySettings`] where fixes are to have protection levels:
//!
//! ```
//! use gnss_twin::settings::{
//!     AcquisitionSettings, IntegritySettings, OperationSettings, PositionSettings, Settings,
//!     TrackingSettings,
//! };
//!
//! let settings = Settings {
//!     acquisition: AcquisitionSettings { signals: vec!["Galileo E1".to_owned()], ..Default::default() },
//!     tracking: TrackingSettings { pll_bandwidth_hz: 10.0, ..Default::default() },
//!     position: PositionSettings { mask_deg: 15.0, ..Default::default() },
//!     operation: OperationSettings { measurement_interval_ms: 200, ..Default::default() },
//!     integrity: Some(IntegritySettings { p_const: 1e-8, ..Default::default() }),
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
//!     CodeDiscriminator, IntegrityMethod, IonosphereChoice, Operation, SbasChoice, Settings, SystemClocks,
//!     TroposphereChoice,
//! };
//!
//! let mut settings = Settings::default();
//! // For a scene without atmosphere.
//! settings.position.ionosphere = IonosphereChoice::None;
//! settings.position.troposphere = TroposphereChoice::None;
//! settings.tracking.dll_discriminator = CodeDiscriminator::DotProduct;
//! let (_, _): (SbasChoice, SystemClocks) = (settings.position.sbas, settings.position.system_clocks);
//! assert_ne!(IntegrityMethod::Araim.name(), format!("{:?}", Operation::Approach));
//! let text = "position = { ionosphere = \"none\", troposphere = \"none\" }\n\
//!             tracking = { dll_discriminator = \"dot_product\" }\n";
//! assert_eq!(settings, Settings::parse(text, "own.toml")?);
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
pub use ::receiver::position::protection::{IntegritySettings, Method as IntegrityMethod, Operation};
#[doc(inline)]
pub use ::receiver::position::{IonosphereChoice, PositionSettings, SbasChoice, SystemClocks, TroposphereChoice};
#[doc(inline)]
pub use ::receiver::settings::{OperationSettings, Settings, SettingsError};
#[doc(inline)]
pub use ::receiver::track::settings::{CodeDiscriminator, TrackingSettings};
