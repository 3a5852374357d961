//! Scenes: what a scenario describes, from a text, a file or code.
//!
//! A [`Scenario`] is as written, a [`Scene`] as meant: checked, in SI units, with all its files loaded. The
//! reference (`gnss-twin reference`) lists every key.
//!
//! ```
//! use gnss_twin::scene::{Scenario, ScenarioError};
//!
//! let scenario = Scenario::from_toml(
//!     r#"
//!     name = "tenth"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 0.1
//!     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//!     noise = {}
//!     "#,
//! )?;
//! let scene = scenario.scene()?;
//! assert_eq!(scene.samples, 260_000);
//! # Ok::<(), ScenarioError>(())
//! ```
//!
//! A [`Builder`] sets the same keys without a text. Common keys have a method; [`Builder::set`] takes all:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let built = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .cn0_dbhz(47.0)
//!     .noise()
//!     .set("interference[1].kind", "cw")
//!     .set("interference[1].js_db", 20.0);
//! assert_eq!(built.build()?.scene()?.interference.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Both are refused with the same words, all that is wrong at once. A [`Place`] is the position in a text:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::scene::{Builder, Place, ScenarioError};
//!
//! let built: Builder = Scenario::builder("wrong").set("power.cn0_dbhz", 470.0).set("noice", 1);
//! let error: ScenarioError = built.build().unwrap_err();
//! assert_eq!(error.each().len(), 2, "{error}");
//! assert!(error.to_string().contains("power.cn0_dbhz = 470.0: expected "), "{error}");
//! let error = Scenario::parse("name = 7", "scene.toml").unwrap_err();
//! let place: Option<&Place> = error.each()[0].place();
//! assert_eq!(place.map(|place| (place.origin.as_str(), place.line)), Some(("scene.toml", 1)));
//! ```
//!
//! [`Overrides`] change a scenario when it is composed, for each of its front ends:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::scene::Overrides;
//!
//! let scenario = Scenario::builder("two")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?;
//! let overrides = Overrides { seed: Some(5), format: Some(Format::Ci16Le), ..Overrides::default() };
//! let (scenes, _warnings) = scenario.compose_all(".".as_ref(), &overrides)?;
//! assert_eq!((scenes.len(), scenes[0].seed, scenes[0].metadata.format), (1, 5, Format::Ci16Le));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Plan`] says what a scene will compute: satellites [`InView`], levels, sizes, times. The scene's
//! [`Trajectory`] gives its [`Motion`]:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::scene::{InView, Motion, Plan, Trajectory};
//!
//! let scene = Scenario::builder("planned")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let plan = Plan::of(&scene)?;
//! let above: Vec<&InView> = plan.satellites.iter().filter(|seen| seen.elevation_deg > 10.0).collect();
//! assert!(above.len() >= 4 && plan.bytes == 520_000, "{plan}");
//! let trajectory: &Trajectory = &scene.trajectory;
//! let Motion { velocity_mps, .. } = trajectory.at(0.05);
//! assert_eq!(velocity_mps.norm(), 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Fidelity`] is chosen by a [`Grade`]: a level, or a [`Budget`] of errors. Fields of a composed scene are
//! public: other ephemerides enter by a [`Catalogue`], other encoders of messages by [`Senders`].
//!
//! ```
//! use std::sync::Arc;
//!
//! use gnss_twin::message::Common;
//! use gnss_twin::orbit::embedded_navigation;
//! use gnss_twin::prelude::*;
//! use gnss_twin::scene::{Catalogue, Fidelity, Grade, Senders};
//!
//! let mut scene = Scenario::builder("own sky".replace(' ', "_").as_str())
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let Fidelity { grade, .. } = scene.fidelity;
//! assert_eq!(grade, Grade::Balanced);
//! let alone = embedded_navigation()?.ephemerides.into_iter().filter(|set| set.sv == Sv::gps(7));
//! let (catalogue, faults) = Catalogue::new(alone.collect());
//! assert!(faults.is_empty());
//! scene.catalogue = Arc::new(catalogue);
//! scene.messages = Arc::new(Senders::new(&Common::default(), &scene.signals)?);
//! assert_eq!(scene.catalogue.satellites().collect::<Vec<Sv>>(), [Sv::gps(7)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use ::generator::catalogue::Catalogue;
#[doc(inline)]
pub use ::generator::fidelity::Budget;
#[doc(inline)]
pub use ::generator::message::Senders;
#[doc(inline)]
pub use ::generator::plan::{InView, Plan};
#[doc(inline)]
pub use ::generator::scenario::{Builder, Overrides, Place, Scenario, ScenarioError};
#[doc(inline)]
pub use ::generator::scene::{Fidelity, Grade, Scene};
#[doc(inline)]
pub use ::generator::vehicle::{Motion, Trajectory};
