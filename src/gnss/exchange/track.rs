//! Tracks for maps: KML 2.2 with the track of Google's extension, and GPX 1.1.
//!
//! Source: OGC 07-147r2 with `gx:Track`; GPX 1.1's schema of Topografix. A point a second of UTC is written,
//! the first of it. Limits: heights are those above the ellipsoid; programs that take them for heights above
//! the sea are off by the geoid, up to 106 m.

use std::io::{self, Write};

use nalgebra::Vector3;

use crate::earth::Geodetic;
use crate::time::Epoch;

/// A form of track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackForm {
    /// KML for Google Earth and similar programs.
    Kml,
    /// GPX for GPS programs.
    Gpx,
}

/// Track that is being written. Only the time of the newest point is kept in memory.
pub struct Track<W> {
    writer: W,
    form: TrackForm,
    newest: Option<i64>,
}

impl<W: Write> Track<W> {
    /// Begins a track with this name.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn new(mut writer: W, form: TrackForm, name: &str) -> io::Result<Self> {
        let name = escaped(name);
        let program = concat!("gnss-twin ", env!("CARGO_PKG_VERSION"));
        let opening = match form {
            TrackForm::Kml => format!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\" \
                 xmlns:gx=\"http://www.google.com/kml/ext/2.2\">\n<Document>\n<name>{name}</name>\n<Placemark>\n\
                 <name>{name}</name>\n<description>{program}; heights above the ellipsoid</description>\n<gx:Track>\n\
                 <altitudeMode>absolute</altitudeMode>\n"
            ),
            TrackForm::Gpx => format!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<gpx xmlns=\"http://www.topografix.com/GPX/1/1\" \
                 version=\"1.1\" creator=\"{program}\">\n<trk>\n<name>{name}</name>\n<desc>heights above the \
                 ellipsoid</desc>\n<trkseg>\n"
            ),
        };
        writer.write_all(opening.as_bytes())?;
        Ok(Self { writer, form, newest: None })
    }

    /// Adds a point, unless its second has one.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn add(&mut self, time: Epoch, position_m: &Vector3<f64>) -> io::Result<()> {
        if self.newest.is_some_and(|newest| newest >= time.seconds()) {
            return Ok(());
        }
        self.newest = Some(time.seconds());
        let utc = time.to_utc_text();
        let place = Geodetic::from_ecef(position_m);
        let (latitude_deg, longitude_deg) = (place.latitude_rad.to_degrees(), place.longitude_rad.to_degrees());
        let height_m = place.height_m;
        let line = match self.form {
            TrackForm::Kml => {
                format!("<when>{utc}</when>\n<gx:coord>{longitude_deg:.9} {latitude_deg:.9} {height_m:.4}</gx:coord>\n")
            }
            TrackForm::Gpx => format!(
                "<trkpt lat=\"{latitude_deg:.9}\" lon=\"{longitude_deg:.9}\"><ele>{height_m:.4}</ele>\
                 <time>{utc}</time></trkpt>\n"
            ),
        };
        self.writer.write_all(line.as_bytes())
    }

    /// Ends the track.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn finish(&mut self) -> io::Result<()> {
        let closing = match self.form {
            TrackForm::Kml => "</gx:Track>\n</Placemark>\n</Document>\n</kml>\n",
            TrackForm::Gpx => "</trkseg>\n</trk>\n</gpx>\n",
        };
        self.writer.write_all(closing.as_bytes()).and_then(|()| self.writer.flush())
    }
}

/// Replaces the characters that have a meaning in XML, and drops control characters.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_has_one_point_and_a_name_cannot_break_the_text() {
        let place = |height_m: f64| Geodetic::from_degrees(-26.5, 80.25, height_m).to_ecef();
        for form in [TrackForm::Kml, TrackForm::Gpx] {
            let mut bytes = Vec::new();
            let mut track = Track::new(&mut bytes, form, "a<b>&\"\u{1b}c").unwrap();
            for (n, height_m) in [(0, 1.0), (5, 2.0), (10, 3.0), (19, 4.0), (20, 5.0)] {
                let time = Epoch::parse("2010-07-01T08:00:00Z").unwrap().plus_s(0.1 * f64::from(n) + 1e-9);
                track.add(time, &place(height_m)).unwrap();
            }
            track.finish().unwrap();
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.contains("<name>a&lt;b&gt;&amp;&quot;c</name>"), "{text}");
            assert_eq!(text.matches("2010-07-01T08:00:0").count(), 3, "{text}");
            let point = match form {
                TrackForm::Kml => "<gx:coord>80.250000000 -26.500000000 3.0000</gx:coord>",
                TrackForm::Gpx => "<trkpt lat=\"-26.500000000\" lon=\"80.250000000\"><ele>3.0000</ele>",
            };
            assert!(text.contains(point), "{text}");
            // Every element that opens closes.
            for name in ["Document", "Placemark", "gx:Track", "gpx", "trk", "trkseg", "kml"] {
                assert_eq!(
                    text.matches(&format!("<{name}>")).count() + text.matches(&format!("<{name} ")).count(),
                    text.matches(&format!("</{name}>")).count(),
                    "{text}"
                );
            }
        }
    }
}
