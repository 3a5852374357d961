//! Rows of inertial sensors as datagrams, in time with the ticks.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

use serde_json::{Value, json};

use crate::cli::error::CliError;
use generator::inertial::Measurements;
use generator::scene::Scene;
use gnss::record::InertialRow;

/// Sender of the sensors' rows.
pub struct Sender {
    measurements: Measurements,
    socket: UdpSocket,
    to: SocketAddr,
    rows: u64,
    /// Datagrams that the system did not take.
    lost: u64,
}

impl Sender {
    /// A sender to an address, from the first sample on.
    pub fn begin(to: SocketAddr, scene: &Scene) -> Result<Self, CliError> {
        let start = scene.clock.start;
        let of = |imu| Measurements::new(imu, &scene.trajectory, start, scene.elapsed_s(0));
        let Some(measurements) = scene.imu.as_ref().and_then(of) else {
            return Err(CliError::usage(format!("--imu: {}: expected a scene with [imu]", scene.name)));
        };
        let own: SocketAddr = if to.is_ipv4() { (Ipv4Addr::UNSPECIFIED, 0).into() } else { ([0_u16; 8], 0).into() };
        let socket = UdpSocket::bind(own).map_err(|error| CliError::output(format!("udp:{to}"), &error))?;
        Ok(Self { measurements, socket, to, rows: 0, lost: 0 })
    }

    /// Sends the rows whose intervals have ended by a true time in seconds since the start.
    pub fn until(&mut self, to_s: f64) -> Result<(), CliError> {
        while let Some(row) = self.measurements.next(to_s) {
            let sent = self.socket.send_to(&line(&row)?, self.to);
            self.rows += 1;
            self.lost += u64::from(sent.is_err());
        }
        Ok(())
    }

    /// Counts of rows.
    pub fn status(&self) -> Value {
        json!({ "rows": self.rows, "lost": self.lost })
    }
}

/// The row as a line of `imu.csv`.
fn line(row: &InertialRow) -> Result<Vec<u8>, CliError> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    writer.serialize(row).map_err(CliError::bug)?;
    writer.into_inner().map_err(CliError::bug)
}
