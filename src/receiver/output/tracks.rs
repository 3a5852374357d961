//! The receiver's fixes as tracks for maps.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use super::{OutputError, Record, Sink, create_error, write_error};
use gnss::exchange::{Track, TrackForm};

/// Writes `fixes.kml` and `fixes.gpx`.
pub struct Tracks {
    tracks: Vec<(PathBuf, Track<BufWriter<File>>)>,
}

impl Tracks {
    /// Creates the files in an existing directory, for a track of that name.
    ///
    /// # Errors
    ///
    /// [`OutputError::Create`] with the path that cannot be made.
    pub fn create(directory: &Path, name: &str) -> Result<Self, OutputError> {
        let one = |(file, form): (&str, TrackForm)| {
            let path = directory.join(file);
            let made = File::create(&path).and_then(|made| Track::new(BufWriter::new(made), form, name));
            made.map(|track| (path.clone(), track)).map_err(|error| create_error(&path, error))
        };
        let forms = [("fixes.kml", TrackForm::Kml), ("fixes.gpx", TrackForm::Gpx)];
        Ok(Self { tracks: forms.into_iter().map(one).collect::<Result<_, _>>()? })
    }
}

impl Sink for Tracks {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        let Record::Fix(fix) = record else { return Ok(()) };
        let add = |(path, track): &mut (PathBuf, Track<_>)| {
            track.add(fix.time(), &fix.position_m()).map_err(|error| write_error(path, error))
        };
        self.tracks.iter_mut().try_for_each(add)
    }

    fn finish(&mut self, _: &serde_json::Value) -> Result<(), OutputError> {
        let end = |(path, track): &mut (PathBuf, Track<_>)| track.finish().map_err(|error| write_error(path, error));
        self.tracks.iter_mut().try_for_each(end)
    }
}
