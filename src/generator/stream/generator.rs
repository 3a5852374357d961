//! Generator as an iterator: batches of samples with the truth of each.

use super::{GenerateError, Generated, Options, Stream};
use crate::scene::Scene;
use crate::truth::Record;
use gnss::samples::Format;
use num_complex::Complex;

/// Batch of consecutive samples of a scene, with their true values.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Number of the first of them in the scene.
    pub first_sample: u64,
    /// Format of the samples.
    pub format: Format,
    /// Packed samples as the scene's metadata describe them.
    pub samples: Vec<u8>,
    /// Truth records at the ticks within the batch. The last batch ends with the messages that were sent and
    /// the passes.
    pub truth: Vec<Record>,
}

impl Batch {
    /// The samples as complex values, in units of the format's least significant bit.
    pub fn complex(&self) -> Vec<Complex<f32>> {
        self.format.unpack_complex(&self.samples)
    }
}

/// Iterates the batches of a scene; ends after the last sample or the first error.
///
/// A batch has half a million samples by default, and memory holds one: how the work is cut changes no byte.
pub struct Generator<'a> {
    scene: &'a Scene,
    /// Stream; `None` after the last sample.
    stream: Option<Stream<'a>>,
    next: u64,
    done: Option<Generated>,
}

impl<'a> Generator<'a> {
    /// Creates an iterator over the batches of `scene` from its first sample on.
    ///
    /// # Errors
    /// A rate that the scene's signals cannot have.
    pub fn new(scene: &'a Scene) -> Result<Self, GenerateError> {
        Self::with(scene, &Options::default())
    }

    /// [`Generator::new`] with the work cut as `options` state.
    ///
    /// # Errors
    /// Errors of [`Generator::new`].
    pub fn with(scene: &'a Scene, options: &Options) -> Result<Self, GenerateError> {
        Ok(Self { scene, stream: Some(Stream::new(scene, &mut (), options)?), next: 0, done: None })
    }

    /// Returns the summary of the run, after the last batch was returned.
    pub fn done(&self) -> Option<&Generated> {
        self.done.as_ref()
    }

    /// The next batch; `None` where there is none.
    fn batch(&mut self) -> Result<Option<Batch>, GenerateError> {
        let Some(mut stream) = self.stream.take() else { return Ok(None) };
        let (mut samples, mut truth) = (Vec::new(), Vec::new());
        let first_sample = self.next;
        let more = stream.next(&mut truth, &mut samples)?;
        self.next = stream.samples();
        if self.next < self.scene.samples {
            self.stream = Some(stream);
        } else {
            self.done = Some(stream.finish(&mut truth)?);
        }
        Ok(more.then_some(Batch { first_sample, format: self.scene.metadata.format, samples, truth }))
    }
}

impl Iterator for Generator<'_> {
    type Item = Result<Batch, GenerateError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.batch().transpose()
    }
}
