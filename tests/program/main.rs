//! The program as a user calls it: the command line, ports, live streams and studies.

mod baseline;
mod cli;
mod command;
mod live;
mod osnma;
mod pack;
mod ports;
mod rtcm;
mod stations;
mod study;
