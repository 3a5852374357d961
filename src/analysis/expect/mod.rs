//! Expecting: what theory and the scene's truth let one expect, before any result of a receiver is looked at.
//!
//! [`theory`] has the closed forms with their sources. [`samples`] is the density that the samples should
//! have as [`welch`] shows it, through a [`converter`] and the response of a filter, and [`spectrum`]
//! what follows from it; `sweep` is how a slow sweep scatters in it. [`jamming`] and [`multiple_access`] say
//! what interference and other satellites take from C/N0. [`timeline`] is the truth as a function of time.
//! `loops` are the receiver's three loops as linear systems, each one `closed`; [`multipath`] is the code
//! error that reflected rays leave in them, and `beats` what codes add that run alike. [`smoothing`] is what
//! the carrier makes of the code, [`quantile`] how far random errors may go. [`message`] is what the
//! satellites sent, [`due`] when each satellite must be found, observed and used, and [`authenticated`] when
//! data must be authentic. [`array`](mod@array) is what a spatial filter leaves. Of the receiver only its
//! settings enter, and the times at which it took its rows.

pub mod array;
pub mod authenticated;
pub(crate) mod beats;
pub(crate) mod closed;
pub mod converter;
pub mod due;
pub(crate) mod followed;
pub mod front_end;
pub mod jamming;
pub(crate) mod loops;
pub mod message;
pub mod multipath;
pub mod multiple_access;
pub(crate) mod peak;
pub mod quantile;
pub mod samples;
pub mod smoothing;
pub mod spectrum;
pub mod stated;
pub(crate) mod sweep;
pub mod theory;
pub mod timeline;
pub mod welch;
