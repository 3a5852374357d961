//! Motion that is pushed while samples go out: ticks, their record and its replay, in virtual time and
//! through the program; and the page that browsers see of it.

mod clients;
mod program;
mod replay;
mod sensors;
mod web;
