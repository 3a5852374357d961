//! The receiver at work: samples in, records out.
//!
//! Block by block: search when it is due, follow every channel in parallel, then, in a fixed order, read
//! messages, make observables, solve. Results do not depend on the number of threads. Memory holds one block,
//! one search window and what the satellites said.

pub(crate) mod summary;

use std::io::{ErrorKind, Read};

use num_complex::Complex;

use crate::acquire;
use crate::array::{ArrayError, Former};
use crate::correlate::correlator::{Model, Span};
use crate::diagnosis::{Diagnosis, Stage};
use crate::format::Check;
use crate::outcome::{Outcome, ReceiveError};
use crate::output::{Record, Sink};
use crate::session::{Session, held};
use crate::settings::Settings;
use crate::source::{Packed, Queue, Source, Stretch};
use gnss::gps::l1ca::L1_CA;
use gnss::samples::{Format, IfMetadata};
use summary::summary;

/// Length of the blocks that channels work on.
const BLOCK_MS: u64 = 50;
/// Samples in a block at most.
const BLOCK_SAMPLES: u64 = 1 << 17;
/// Bytes read at a time of each of several front ends.
const READ_BYTES: usize = 1 << 18;

/// Settings with the signals that are searched for: where they say `all`, what these bands hold and this
/// receiver can follow to a position; where they name none, GPS L1 C/A if it is among those, and else all of
/// them.
pub fn searched(metadata: &[IfMetadata], settings: &Settings) -> Settings {
    let mut own = settings.clone();
    if own.acquisition.is_all() {
        own.acquisition.signals.clear();
        own.acquisition.or_signals(&held(metadata, settings));
    } else if own.acquisition.signals.is_empty() {
        let mut held = held(metadata, settings);
        if held.contains(&&L1_CA) {
            held = vec![&L1_CA];
        }
        own.acquisition.or_signals(&held);
    }
    own
}

/// A reception that is given its samples piece by piece.
///
/// Records count samples: those of the first front end, where there are several.
pub struct Reception {
    metadata: Vec<IfMetadata>,
    /// Formats of the samples that are taken.
    formats: Vec<Format>,
    settings: Settings,
    checks: Vec<Check>,
    source: Input,
    /// Samples that a model answered for.
    modelled: u64,
    session: Session,
}

/// Samples on their way in: blocks of one front end, or of several that end at the same time.
enum Input {
    One(Source),
    Several {
        queues: Vec<Queue>,
        /// Samples of the first front end in a block.
        block: u64,
    },
    /// Elements of an array, of which one stream is made.
    Array {
        queues: Vec<Queue>,
        /// Samples of each element in a block.
        block: u64,
        former: Box<Former>,
        stream: Vec<u8>,
    },
}

impl Reception {
    /// A cold start on samples that are packed as `metadata` says.
    ///
    /// # Errors
    /// Settings out of range, samples that cannot be searched.
    pub fn new(metadata: &IfMetadata, settings: &Settings) -> Result<Self, ReceiveError> {
        Self::of_several(std::slice::from_ref(metadata), settings)
    }

    /// A cold start on the samples of several front ends that sample by one clock from one instant on, each
    /// at its own rate. Every signal is received in the first front end whose band holds its main lobes, or
    /// else its carrier.
    ///
    /// # Errors
    /// Errors of [`Reception::new`], and [`ReceiveError::NoFrontEnd`].
    pub fn of_several(metadata: &[IfMetadata], settings: &Settings) -> Result<Self, ReceiveError> {
        settings.validate("settings")?;
        let former = settings.array.as_ref().map(|array| Former::new(metadata, array)).transpose()?;
        let formats: Vec<Format> = metadata.iter().map(|metadata| metadata.format).collect();
        let formed = former.as_ref().map(|former| former.metadata().clone());
        let metadata = formed.as_ref().map_or(metadata, std::slice::from_ref);
        let settings = &searched(metadata, settings);
        let session = Session::new(metadata, settings)?;
        let interval = u64::from(settings.operation.measurement_interval_ms).min(BLOCK_MS);
        let length = |metadata: &IfMetadata| metadata.rate.first_sample_at(interval, 1000);
        let array = |former: &Former, one: &IfMetadata| {
            let own = former.block_samples();
            (length(one).min(BLOCK_SAMPLES) / own).max(1) * own
        };
        let source = match (former, metadata) {
            (Some(former), [one]) => Input::Array {
                queues: formats.iter().map(|format| Queue::new(*format)).collect(),
                block: array(&former, one),
                former: Box::new(former),
                stream: Vec::new(),
            },
            (_, [one]) => Input::One(Source::new(one.format, length(one).min(BLOCK_SAMPLES) as usize)),
            (_, several) => {
                // No front end has more samples in a block than one alone may have.
                let longest = several.iter().map(length).max().unwrap_or(1).max(1);
                let first = several.first().map_or(1, length);
                let block = if longest > BLOCK_SAMPLES {
                    (u128::from(first) * u128::from(BLOCK_SAMPLES) / u128::from(longest)) as u64
                } else {
                    first
                };
                let queues = several.iter().map(|metadata| Queue::new(metadata.format)).collect();
                Input::Several { queues, block: block.max(1) }
            }
        };
        Ok(Self {
            metadata: metadata.to_vec(),
            settings: settings.clone(),
            checks: formats.iter().map(|format| Check::new(*format)).collect(),
            formats,
            source,
            modelled: 0,
            session,
        })
    }

    /// Takes the next bytes of the first front end, cut anywhere, and gives what they bring to `sink`.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn take(&mut self, bytes: &[u8], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        self.take_of(0, bytes, sink)
    }

    /// Takes the next bytes of a front end, cut anywhere. What lies before the end of what all front ends
    /// have is worked on; the rest is kept in memory until the others have caught up.
    ///
    /// # Errors
    /// A front end that is not there, records that cannot be written.
    pub fn take_of(&mut self, number: usize, mut bytes: &[u8], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let have = self.checks.len();
        let check = self.checks.get_mut(number).ok_or(ReceiveError::UnknownFrontEnd { number, have })?;
        check.take(bytes);
        match &mut self.source {
            Input::One(source) => {
                while let Some(block) = source.next(&mut bytes) {
                    self.session.process(&[Stretch::Packed(block)], sink)?;
                }
            }
            Input::Several { queues, block } => {
                if let Some(queue) = queues.get_mut(number) {
                    queue.push(bytes);
                }
                loop {
                    let ends = self.session.ends(queues.first().map_or(0, Queue::samples) + *block);
                    if queues.iter().zip(&ends).any(|(queue, end)| queue.end() < *end) {
                        break;
                    }
                    take_blocks(&mut self.session, queues, &ends, sink)?;
                }
            }
            Input::Array { queues, block, former, stream } => {
                if let Some(queue) = queues.get_mut(number) {
                    queue.push(bytes);
                }
                loop {
                    let end = queues.first().map_or(0, Queue::samples) + *block;
                    if queues.iter().any(|queue| queue.end() < end) {
                        break;
                    }
                    take_elements(&mut self.session, queues, end, (former, stream), sink)?;
                }
            }
        }
        Ok(())
    }

    /// Takes the samples before number `to` of the first front end as `models` answer for them, one for each
    /// front end, in blocks as long as those of samples; the rest of a block waits unless it is the `last`
    /// one. A reception takes samples or models.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn take_models<M: Model>(
        &mut self,
        models: &[M],
        (to, last): (u64, bool),
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let block = match &self.source {
            Input::One(source) => source.block_samples(),
            Input::Several { block, .. } => *block,
            Input::Array { .. } => return Err(ArrayError::Modelled.into()),
        };
        while self.modelled + block <= to || (last && self.modelled < to) {
            let end = to.min(self.modelled + block);
            let [firsts, ends] = [self.modelled, end].map(|main| self.session.ends(main));
            let span = |((first, end), model)| Stretch::Modelled(Span { first, end, model: model as &dyn Model });
            let spans: Vec<Stretch> = firsts.into_iter().zip(ends).zip(models).map(span).collect();
            self.session.process(&spans, sink)?;
            self.modelled = end;
        }
        Ok(())
    }

    /// First sample of each front end about which the model of the next samples can be asked: that of a code
    /// period that runs, or of a search that waits for more.
    pub fn needs(&self) -> Vec<u64> {
        self.session.needs(self.modelled)
    }

    /// Bytes that are best taken at a time: a block, so that none has to be kept for the next.
    fn piece_bytes(&self) -> usize {
        match &self.source {
            Input::One(source) => source.block_bytes(),
            Input::Several { .. } | Input::Array { .. } => READ_BYTES,
        }
    }

    /// Samples of the first front end taken so far, those of a block that is not full yet left out.
    pub fn samples(&self) -> u64 {
        match &self.source {
            Input::One(source) => source.samples() + self.modelled,
            Input::Several { queues, .. } | Input::Array { queues, .. } => {
                queues.first().map_or(0, Queue::samples) + self.modelled
            }
        }
    }

    /// Works on what is left, as far as all front ends have it; returns the bytes of samples that were cut.
    fn take_rest(&mut self, sink: &mut dyn Sink) -> Result<usize, ReceiveError> {
        match &mut self.source {
            Input::One(source) => {
                let (rest, cut_bytes) = source.rest();
                if let Some(block) = rest {
                    self.session.process(&[Stretch::Packed(block)], sink)?;
                }
                Ok(cut_bytes)
            }
            Input::Several { queues, .. } => {
                let Some(first) = queues.first() else { return Ok(0) };
                // The most samples of the first front end over which all have theirs: less than a block.
                let (mut fits, mut too_far) = (first.samples(), first.end() + 1);
                while too_far - fits > 1 {
                    let middle = fits + (too_far - fits) / 2;
                    let ends = self.session.ends(middle);
                    let there = queues.iter().zip(&ends).all(|(queue, end)| queue.end() >= *end);
                    if there { fits = middle } else { too_far = middle }
                }
                if fits > first.samples() {
                    let ends = self.session.ends(fits);
                    take_blocks(&mut self.session, queues, &ends, sink)?;
                }
                Ok(queues.iter().map(Queue::cut_bytes).sum())
            }
            Input::Array { queues, former, stream, .. } => {
                let first = queues.first().map_or(0, Queue::samples);
                let end = queues.iter().map(Queue::end).min().unwrap_or(first);
                if end > first {
                    take_elements(&mut self.session, queues, end, (former, stream), sink)?;
                }
                Ok(queues.iter().map(Queue::cut_bytes).sum())
            }
        }
    }

    /// Ends the reception: gives what is left to `sink` and returns what came of it.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn finish(mut self, sink: &mut dyn Sink) -> Result<Outcome, ReceiveError> {
        let cut_bytes = self.take_rest(sink)?;
        self.session.search_rest(self.samples(), sink)?;
        self.session.end_verification(sink)?;
        let Some(metadata) = self.metadata.first() else { return Err(ReceiveError::NoFrontEnd) };
        let settings = &self.settings;
        let count = self.samples();
        let seconds = metadata.rate.elapsed_s(count);
        let mut outcome = self.session.outcome();
        let findings = self.session.findings();
        outcome.samples = count;
        outcome.seconds = seconds;
        outcome.cut_bytes = cut_bytes;
        outcome.format_warning = self.checks.iter().find_map(Check::warning);
        if let Input::Array { former, .. } = &self.source {
            outcome.array = Some(former.formed());
        }
        if outcome.fixes == 0 {
            let stage = if self.session.has_searched() {
                self.session.failed_stage()
            } else {
                let needed = acquire::least_samples(metadata, &settings.acquisition)?;
                Stage::NothingSearched { samples: count, needed }
            };
            let mut diagnosis = diagnosis(stage, metadata, settings, &outcome);
            if let Some(seen) = &outcome.interfered {
                diagnosis.advice.insert(0, format!("the spectrum: {seen}"));
            }
            diagnosis.advice.splice(0..0, findings);
            outcome.diagnosis = Some(diagnosis);
        } else {
            outcome.warnings.extend(findings);
        }
        sink.finish(&summary(&self.metadata, &self.session.signals(), settings, &outcome))?;
        Ok(outcome)
    }
}

/// Diagnosis of an outcome without a fix, for the stage that failed.
pub(crate) fn diagnosis(stage: Stage, metadata: &IfMetadata, settings: &Settings, outcome: &Outcome) -> Diagnosis {
    let signals = settings.acquisition.signals();
    let if_hz = signals.first().map_or(0.0, |signal| metadata.if_hz(signal.centre_hz()));
    let format = metadata.format.to_string();
    let (rate_hz, acquired) = (metadata.rate.hz(), outcome.acquired.len());
    Diagnosis::new(stage, outcome.seconds, rate_hz, &format, if_hz, outcome.cut_bytes, acquired).with_messages(&signals)
}

/// Takes the samples before these ends from all queues through the session.
fn take_blocks(
    session: &mut Session,
    queues: &mut [Queue],
    ends: &[u64],
    sink: &mut dyn Sink,
) -> Result<(), ReceiveError> {
    let blocks: Vec<Stretch> = queues.iter().zip(ends).map(|(queue, end)| Stretch::Packed(queue.block(*end))).collect();
    session.process(&blocks, sink)?;
    queues.iter_mut().zip(ends).for_each(|(queue, end)| queue.take(*end));
    Ok(())
}

/// Takes the samples before `end` of all elements through the spatial filter and the session.
fn take_elements(
    session: &mut Session,
    queues: &mut [Queue],
    end: u64,
    (former, stream): (&mut Former, &mut Vec<u8>),
    sink: &mut dyn Sink,
) -> Result<(), ReceiveError> {
    let blocks: Vec<Packed<'_>> = queues.iter().map(|queue| queue.block(end)).collect();
    let first = blocks.first().map_or(0, |block| block.first);
    former.form(&blocks, stream)?;
    session.process(&[Stretch::Packed(Packed::new(first, former.metadata().format, stream))], sink)?;
    session.compare(&blocks, sink)?;
    queues.iter_mut().for_each(|queue| queue.take(end));
    Ok(())
}

/// A receiver whose results are values: nothing is written.
pub struct Receiver {
    reception: Reception,
}

impl Receiver {
    /// A cold start on samples that are packed as `metadata` says.
    ///
    /// # Errors
    /// Errors of [`Reception::new`].
    pub fn new(metadata: &IfMetadata, settings: &Settings) -> Result<Self, ReceiveError> {
        Reception::new(metadata, settings).map(|reception| Self { reception })
    }

    /// A cold start on the samples of several front ends: see [`Reception::of_several`].
    ///
    /// # Errors
    /// Errors of [`Reception::of_several`].
    pub fn of_several(metadata: &[IfMetadata], settings: &Settings) -> Result<Self, ReceiveError> {
        Reception::of_several(metadata, settings).map(|reception| Self { reception })
    }

    /// Takes the next bytes of a front end, cut anywhere, and returns what they bring once all front ends
    /// have come as far.
    ///
    /// # Errors
    /// Errors of [`Reception::take_of`].
    pub fn push_of(&mut self, number: usize, bytes: &[u8]) -> Result<Vec<Record>, ReceiveError> {
        let mut records = Vec::new();
        self.reception.take_of(number, bytes, &mut records)?;
        Ok(records)
    }

    /// Takes the next bytes, cut anywhere, and returns what they bring, in the order in which the receiver
    /// found it.
    ///
    /// # Errors
    /// Samples that cannot be searched.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Vec<Record>, ReceiveError> {
        let mut records = Vec::new();
        self.reception.take(bytes, &mut records)?;
        Ok(records)
    }

    /// Takes the next samples as complex values, in units of the metadata's least significant bit, and
    /// returns what they bring. The format of the metadata holds: integers are rounded and saturate. A
    /// receiver of `cf32_le` takes the values as they are.
    ///
    /// # Errors
    /// [`ReceiveError::Real`] for a front end whose samples are real, and errors of [`Receiver::push`].
    pub fn push_complex(&mut self, samples: &[Complex<f32>]) -> Result<Vec<Record>, ReceiveError> {
        match self.reception.formats.first().copied() {
            Some(format) if format.is_complex() => self.push(&format.pack_complex(samples)),
            Some(format) => Err(ReceiveError::Real { format }),
            None => Err(ReceiveError::NoFrontEnd),
        }
    }

    /// Ends the reception: returns what was left, and what came of it.
    ///
    /// # Errors
    /// Samples that cannot be searched.
    pub fn finish(self) -> Result<(Vec<Record>, Outcome), ReceiveError> {
        let mut records = Vec::new();
        let outcome = self.reception.finish(&mut records)?;
        Ok((records, outcome))
    }
}

/// Receives `samples`, packed as `metadata` says, from the first to the last, and gives everything to `sink`.
/// `progress` gets the number of samples done after every block.
///
/// # Errors
/// Settings out of range, samples that cannot be searched or read, records that cannot be written. No fix is
/// no error: see [`Outcome::diagnosis`].
pub fn receive<R: Read>(
    metadata: &IfMetadata,
    samples: R,
    settings: &Settings,
    sink: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
) -> Result<Outcome, ReceiveError> {
    receive_several(&mut [(metadata.clone(), samples)], settings, sink, progress)
}

/// [`receive`] of several front ends that share a clock: their streams are read in step, so that memory stays
/// flat. The reception ends where the first of them does.
///
/// # Errors
/// Errors of [`receive`], and [`ReceiveError::NoFrontEnd`].
pub fn receive_several<R: Read>(
    front_ends: &mut [(IfMetadata, R)],
    settings: &Settings,
    sink: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
) -> Result<Outcome, ReceiveError> {
    let metadata: Vec<IfMetadata> = front_ends.iter().map(|(metadata, _)| metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, settings)?;
    let mut bytes = vec![0; reception.piece_bytes()];
    let mut read_s = vec![0.0_f64; front_ends.len()];
    loop {
        // The one that is least far.
        let least = read_s.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map(|(number, _)| number);
        let Some(number) = least else { return reception.finish(sink) };
        let Some((metadata, samples)) = front_ends.get_mut(number) else { return reception.finish(sink) };
        match samples.read(&mut bytes) {
            Ok(0) => return reception.finish(sink),
            Ok(count) => {
                let bytes_a_second = metadata.format.bytes() as f64 * metadata.rate.hz();
                read_s.iter_mut().skip(number).take(1).for_each(|read_s| *read_s += count as f64 / bytes_a_second);
                reception.take_of(number, bytes.get(..count).unwrap_or_default(), sink)?;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(ReceiveError::Read { sample: reception.samples(), error }),
        }
        progress(reception.samples());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::samples::Format;
    use gnss::time::Rate;

    #[test]
    fn a_failing_reader_is_an_error_with_its_place_and_an_interruption_is_none() {
        /// Gives 1000 bytes, is interrupted, gives 1000 more and breaks.
        struct Broken(u32);
        impl Read for Broken {
            fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
                self.0 += 1;
                match self.0 {
                    1 | 3 => Ok(buffer.len().min(1000)),
                    2 => Err(ErrorKind::Interrupted.into()),
                    _ => Err(std::io::Error::other("unplugged")),
                }
            }
        }
        let rate = Rate::from_hz(1e5).unwrap();
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
        let mut records: Vec<Record> = Vec::new();
        let error = receive(&metadata, Broken(0), &Settings::default(), &mut records, &mut |_| ()).unwrap_err();
        assert!(error.to_string().contains("sample 0") && error.to_string().contains("unplugged"), "{error}");
    }
}
