//! Closed loops: scenes are generated, received and judged, and the receiver finds what the scenes put in.

mod bdgim;
mod carriers;
mod closed_loop;
mod dual_band;
mod front_ends;
#[path = "../common/long.rs"]
mod long;
mod protection;
mod samples;
mod stream;
mod systems;
