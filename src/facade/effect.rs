//! Effects on rays and stages of a front end, also those of one's own.
//!
//! An [`Effect`] acts on the [`Ray`]s of a satellite along a [`Sight`]. A composed scene takes another one:
//!
//! ```
//! use gnss_twin::effect::{Effect, Ray, Sight};
//! use gnss_twin::prelude::*;
//!
//! struct Late(f64);
//!
//! impl Effect for Late {
//!     fn name(&self) -> &'static str {
//!         "late"
//!     }
//!     fn describe(&self) -> String {
//!         format!("{} m", self.0)
//!     }
//!     fn act(&self, sight: &Sight, _: &Signal, rays: &mut Vec<Ray>) {
//!         let delay_s = self.0 / 299_792_458.0 / sight.look.elevation_rad.sin();
//!         rays.iter_mut().for_each(|ray| ray.code_delay_s += delay_s);
//!     }
//! }
//!
//! let code_m = |late_m: f64| -> Result<Vec<f64>, Box<dyn std::error::Error>> {
//!     let built = Scenario::builder("late").start(Epoch::parse("2010-07-01T08:06:00")?).duration_s(0.1);
//!     let mut scene = built.fixed(Geodetic::from_degrees(48.1, 11.6, 520.0)).build()?.scene()?;
//!     scene.effects.push(Box::new(Late(late_m)));
//!     let mut records = Vec::new();
//!     gnss_twin::generator::generate(&scene, &mut std::io::sink(), &mut records, &mut |_| ())?;
//!     let code = |record| match record {
//!         truth::Record::Observation(row) => Some(row.pseudorange_m),
//!         _ => None,
//!     };
//!     Ok(records.into_iter().filter_map(code).collect())
//! };
//! let (without, with) = (code_m(0.0)?, code_m(3.0)?);
//! assert!(without.len() >= 4);
//! assert!(without.iter().zip(&with).all(|(without, with)| (3.0..40.0).contains(&(with - without))));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Stage`] acts on [`Block`]s of samples, after all signals are added:
//!
//! ```
//! use gnss_twin::effect::{Block, Stage};
//!
//! struct Attenuator(f32);
//!
//! impl Stage for Attenuator {
//!     fn name(&self) -> &'static str {
//!         "attenuator"
//!     }
//!     fn describe(&self) -> String {
//!         format!("amplitude times {}", self.0)
//!     }
//!     fn act(&self, block: &mut Block<'_>) {
//!         block.i.iter_mut().chain(block.q.iter_mut()).for_each(|sample| *sample *= self.0);
//!     }
//! }
//!
//! let (mut i, mut q) = ([1.0, 2.0], [3.0, 4.0]);
//! Attenuator(0.5).act(&mut Block::whole(0, &mut i, &mut q));
//! assert_eq!((i, q), ([0.5, 1.0], [1.5, 2.0]));
//! ```

#[doc(inline)]
pub use ::generator::ray::{Effect, Ray, Sight};
#[doc(inline)]
pub use ::generator::stage::{Block, Stage};
