//! Laws that need the whole generator: rooms below compose scenes and generate samples here.

mod arrays;
mod authentication;
mod described;
mod dynamics;
mod edges;
mod exchange;
mod fronts;
mod levels;
mod other_time;
mod plan;
mod presence;
mod signals;
mod stations;
