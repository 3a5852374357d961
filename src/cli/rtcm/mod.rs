//! `rtcm`: observations and ephemerides of a run, or of RINEX files, as the RTCM 3.3 stream of a reference
//! station, to a file, to TCP clients and as a caster of NTRIP.
//!
//! A file is written at once. With clients the first epoch waits for the first of them, and the others
//! follow at the times of their labels. What cannot be written is left out and named with its count.

pub mod args;
mod audience;
mod input;

use std::collections::BTreeMap;
use std::io::Write;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::cli::error::{CliError, shown};
use crate::cli::interrupt;
use crate::cli::platform::LOOK;
use crate::cli::scenario;
use crate::cli::staging::Staging;
use args::Rtcm;
use audience::Audience;
use gnss::earth::Geodetic;
use gnss::satellite::System;
use gnss::time::Epoch;
use input::Input;
use logs::ntrip::Caster;
use logs::rtcm::station::{Sender, Station};

/// Writes or serves the stream.
pub fn execute(arguments: &Rtcm) -> Result<(), CliError> {
    let user = arguments.user()?;
    let input = Input::open(arguments)?;
    let station = station(arguments, &input)?;
    let staging = arguments.out.as_deref().map(Staging::file).transpose()?;
    let mut writer = staging.as_ref().map(Staging::writer);
    let audience = Audience::open(arguments, |mount| caster(mount, user, arguments, &station, &input))?;
    let Input { epochs, sets, systems, .. } = input;
    let mut sender = Sender::new(station, arguments.messages.clone(), sets);
    let mut pace = audience.as_ref().map(|_| Pace { speed: arguments.speed, begin: None });
    let (mut count, mut bytes) = (0_u64, 0_u64);
    for epoch in epochs {
        let (epoch, refused) = epoch?;
        refused.iter().for_each(|reason| sender.refuse(reason));
        let frames = sender.epoch(&epoch);
        if let (Some(pace), Some(audience)) = (&mut pace, &audience) {
            if count == 0 {
                audience.wait();
            }
            pace.wait(epoch.label);
            audience.send(&frames);
        }
        if interrupt::ending().is_some() {
            break;
        }
        if let (Some(writer), Some(out)) = (&mut writer, &arguments.out) {
            writer.write_all(&frames).map_err(|error| CliError::output(shown(out), &error))?;
        }
        count += 1;
        bytes += frames.len() as u64;
    }
    drop(writer);
    let clients = audience.map(Audience::end);
    if let Some(staging) = staging {
        staging.commit()?;
    }
    report(arguments, &sender, &Told { epochs: count, bytes, clients, systems })?;
    interrupt::ending().map_or(Ok(()), |signal| Err(CliError::signal(signal)))
}

/// Station as the arguments and the input describe it.
fn station(arguments: &Rtcm, input: &Input) -> Result<Station, CliError> {
    let position_m = arguments.position.map(Geodetic::to_ecef).or(input.position_m);
    let messages = &arguments.messages;
    if position_m.is_none() && (messages.has(1005) || messages.has(1006)) {
        scenario::note(
            "no position of an antenna that does not move is known, so 1005 and 1006 are not sent: --position gives it",
        );
    }
    let text = |text: &str| text.chars().filter(|char| char.is_ascii_graphic() || *char == ' ').take(31).collect();
    Ok(Station {
        number: arguments.station,
        position_m,
        height_m: arguments.antenna_height,
        antenna: text(&arguments.antenna),
        receiver: text(&input.receiver),
        version: text(env!("CARGO_PKG_VERSION")),
    })
}

fn caster(mount: &str, user: Option<String>, arguments: &Rtcm, station: &Station, input: &Input) -> Caster {
    let place = station.position_m.map(|position_m| Geodetic::from_ecef(&position_m));
    // As source tables of casters name systems.
    let name = |system: &System| match system {
        System::Gps => "GPS",
        System::Glonass => "GLO",
        System::Galileo => "GAL",
        System::BeiDou => "BDS",
        System::Qzss => "QZS",
        System::Navic => "IRS",
        System::Sbas => "SBAS",
    };
    let names: Vec<&str> = input.systems.iter().map(name).collect();
    Caster {
        mount: mount.to_owned(),
        user,
        messages: arguments.messages.of_systems(&input.systems),
        systems: names.join("+"),
        place_deg: place.map_or([0.0; 2], |place| [place.latitude_rad, place.longitude_rad].map(f64::to_degrees)),
    }
}

/// Times at which epochs are sent: those of their labels, counted from the first one.
struct Pace {
    speed: f64,
    begin: Option<(Instant, Epoch)>,
}

impl Pace {
    /// Waits for the time of a label, or a signal.
    fn wait(&mut self, label: Epoch) {
        let (began, first) = *self.begin.get_or_insert_with(|| (Instant::now(), label));
        let due_s = label.since(first) / self.speed;
        loop {
            let left_s = due_s - began.elapsed().as_secs_f64();
            if left_s <= 0.0 || interrupt::ending().is_some() {
                return;
            }
            thread::sleep(Duration::from_secs_f64(left_s).min(LOOK));
        }
    }
}

/// Figures of what was sent.
struct Told {
    epochs: u64,
    bytes: u64,
    clients: Option<u64>,
    systems: Vec<System>,
}

fn report(arguments: &Rtcm, sender: &Sender, told: &Told) -> Result<(), CliError> {
    let messages: Vec<String> = sender.counts.iter().map(|(number, count)| format!("{number} {count}")).collect();
    let systems: Vec<&str> = told.systems.iter().map(|system| system.name()).collect();
    let mut text = format!("{:<14}{} of {}\n", "epochs", told.epochs, systems.join(", "));
    text += &format!("{:<14}{}\n", "messages", messages.join(", "));
    for (reason, count) in &sender.refused {
        text += &format!("{:<14}{count} times: {reason}\n", "left out");
    }
    if let Some(clients) = told.clients {
        text += &format!("{:<14}{clients}\n", "clients");
    }
    if let Some(out) = &arguments.out {
        text += &format!("{} bytes in {}\n", told.bytes, out.display());
    }
    let counts: BTreeMap<String, u64> =
        sender.counts.iter().map(|(number, count)| (number.to_string(), *count)).collect();
    let object = || -> Value {
        json!({
            "epochs": told.epochs,
            "bytes": told.bytes,
            "messages": counts,
            "left_out": sender.refused,
            "clients": told.clients,
            "out": arguments.out,
        })
    };
    arguments.printed.results(&text, object)
}
