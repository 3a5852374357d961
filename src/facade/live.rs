//! Twin while it runs: motion and events come in, samples go out at once.
//!
//! A scene with `[motion] kind = "pushed"` takes its motion step by step. [`Lockstep`] adds the receiver and
//! knows no clock of the machine:
//!
//! ```
//! use gnss_twin::live::{Finished, Lockstep, Push, Step, StepError};
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::from_toml(
//!     r#"
//!     name = "steps"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 0.1
//!     motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//!     "#,
//! )?
//! .scene()?;
//! let start_m: Vector3<f64> = scene.trajectory.composed_for().position_m;
//! let mut twin = Lockstep::new(&scene, Some(&Settings::default()))?;
//! while !twin.is_done() {
//!     // Where the vehicle is at the end of the step, a metre a second upwards.
//!     let t_s = twin.next_s();
//!     let step: Step = twin.step(Some(&Push::at(t_s, start_m + start_m.normalize() * t_s)))?;
//!     assert_eq!(twin.samples().len(), 26_000 * scene.metadata.format.bytes());
//!     assert!(step.made.tick.is_some_and(|tick| tick.gap_m < 0.2));
//! }
//! assert!(matches!(twin.step(None), Err(StepError::Over)));
//! let done: Finished = twin.finish(&mut ())?;
//! assert_eq!(done.generated.samples, 260_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Driver`] is the generator alone. A [`Push`] that no vehicle can have is a [`Refusal`]:
//!
//! ```
//! use gnss_twin::live::{Driver, Push, Refusal};
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("driven")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .set("motion.kind", "pushed")
//!     .build()?
//!     .scene()?;
//! let mut driver = Driver::new(&scene, &mut ())?;
//! assert!(driver.is_pushed());
//! let nowhere = Push::at(0.01, Vector3::new(f64::NAN, 0.0, 0.0));
//! assert_eq!(driver.offer(&nowhere), Err(Refusal::NotFinite));
//! let mut bytes = Vec::new();
//! while driver.tick(&mut (), &mut bytes)?.is_some() {
//!     assert!(!bytes.is_empty());
//! }
//! assert_eq!(driver.finish(&mut ())?.samples, 260_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! An [`Event`] switches a [`Source`] or lets a satellite's ranges err; one that the scene cannot have is an
//! [`EventError`]:
//!
//! ```
//! use gnss_twin::live::{Driver, Event, EventError, Source};
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("switched")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .set("motion.kind", "pushed")
//!     .build()?
//!     .scene()?;
//! let sv = Sv::gps(Plan::of(&scene)?.satellites[0].sv.number);
//! # use gnss_twin::scene::Plan;
//! let mut driver = Driver::new(&scene, &mut ())?;
//! driver.switch(&Event::Power(Source::Satellite(sv), None))?;
//! let absent = Event::Power(Source::Jammer(1), Some(3.0));
//! assert!(matches!(driver.switch(&absent), Err(EventError::NoSuch(_))));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use ::generator::event::{Event, EventError};
#[doc(inline)]
pub use ::generator::switches::Source;
#[doc(inline)]
pub use ::generator::vehicle::joining::{Push, Refusal};
#[doc(inline)]
pub use ::live::drive::Driver;
#[doc(inline)]
pub use ::live::lockstep::{Finished, Lockstep, Step, StepError};
