//! Elements of an array after a block: their carriers, satellite by satellite.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use super::Session;
use crate::array::compass::Compared;
use crate::array::sums::covariance;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::source::{Packed, Planes};
use gnss::satellite::Sv;
use gnss::signal::Link;

impl Session {
    /// Compares the elements' samples of the block that was processed last, where the settings ask for it.
    pub fn compare(&mut self, elements: &[Packed<'_>], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let (Some(compass), Some(front_end), Some(first)) =
            (&mut self.compass, self.front_ends.first(), elements.first())
        else {
            return Ok(());
        };
        let planes: Vec<Planes> = elements.iter().map(|element| element.planes(0..first.samples())).collect();
        if front_end.gap.is_busy() {
            compass.interrupt();
        } else {
            let covariance = covariance(&planes);
            // Sums of the elements over each code period, with the energy of the replica.
            let of = |track: &super::Track| -> (Link, Vec<(DVector<Complex64>, f64)>) {
                let (replica, periods) = track.channel.past(first.first);
                let sums = periods.iter().filter_map(|period| {
                    let range = (period.from - first.first) as usize..(period.to - first.first) as usize;
                    let of = |planes: &Planes| {
                        let samples = (planes.i.get(range.clone())?, planes.q.get(range.clone())?);
                        Some(period.prompt(replica?, samples))
                    };
                    let sums = planes.iter().map(of).collect::<Option<Vec<_>>>().map(DVector::from_vec);
                    sums.map(|sums| (sums, period.energy))
                });
                (track.channel.link(), sums.collect())
            };
            let kept = |track: &&super::Track| !track.dropped;
            let sums: Vec<_> = front_end.tracks.par_iter().filter(kept).map(of).collect();
            for (link, sums) in sums {
                for (sums, energy) in sums {
                    compass.take(link, &sums, &(&covariance * Complex64::from(energy)));
                }
            }
        }
        if !compass.is_due(first.end()) {
            return Ok(());
        }
        let towards: BTreeMap<Sv, Vector3<f64>> = (self.shared.sights.iter())
            .map(|row| {
                let ((sin_a, cos_a), (sin_e, cos_e)) =
                    (libm::sincos(row.azimuth_deg.to_radians()), libm::sincos(row.elevation_deg.to_radians()));
                (row.sv, Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e))
            })
            .collect();
        let Compared { attitude, elements, tested } = compass.close(first.end(), &towards);
        if let (Some(detection), Some(tested)) = (&mut self.shared.detection, tested) {
            detection.take_directions(tested);
        }
        if let Some(row) = attitude {
            sink.take(Record::Attitude(row, elements))?;
        }
        Ok(())
    }
}
