//! Motion that is pushed while samples go out: ticks, their record and its replay, in virtual time and
//! through the program.

mod program;
mod replay;
