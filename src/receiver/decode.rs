//! Decoding of symbols into messages: the satellite's time in code periods, and the content of its message.
//!
//! A [`Decoder`] belongs to one channel. It gives the symbols to the reader of the signal's message. It ties
//! the channel's code period number to the satellite's time of week, and converts the times of messages to
//! GPS time. A time that contradicts the one before drops both. A message may not state its time. The
//! beginnings of its units are then known, and another signal of the satellite identifies them.

use crate::track::Symbol;
use gnss::augmentation::Content;
use gnss::broadcast::Ephemeris;
use gnss::ionosphere::Coefficients;
use gnss::message::{Read, Reader, SentPage};
use gnss::record::NavigationRow;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::{Epoch, TimePolynomial, TimeScale, WEEK_S};

/// Event that a symbol completes.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// The frame was found: the satellite's time is known from here on.
    FrameSynchronised,
    /// Polarity of the symbols, as the latest unit of the message showed it.
    Polarity {
        /// True if a logical 0 arrives as a logical 1.
        inverted: bool,
    },
    /// The time that the latest unit says contradicts the frame: synchronisation starts again.
    Contradiction,
    /// Start of a unit, with the week that it says, resolved near the given epoch.
    Time(Epoch),
    /// Complete ephemeris.
    Ephemeris(Box<Ephemeris>),
    /// Reduced elements.
    Reduced {
        /// Elements of the satellite.
        set: Box<Ephemeris>,
        /// True if the elements come with group delays and health.
        with_delays: bool,
    },
    /// The ionosphere's parameters.
    Ionosphere(Coefficients),
    /// Offset of a system's time from GPS time, without whole seconds.
    AheadOfGps {
        /// The system's time.
        scale: &'static TimeScale,
        /// System time less GPS time, as a polynomial in GPS time.
        ahead: TimePolynomial,
    },
    /// The satellite that sends, where it is another than was assumed.
    Sender(Sv),
    /// Statement of an augmentation system about other satellites.
    Augmentation {
        /// Beginning of the block, GPS time.
        sent: Epoch,
        /// Content of the block.
        content: Box<Content>,
    },
    /// Whole page, of a decoder that keeps them.
    Page(SentPage),
    /// Raw parameters as decoded.
    Parameters(Vec<NavigationRow>),
    /// A unit that passed its checks is not used: why.
    Refused(String),
}

/// Satellite time of a code period: periods since the start of the week, modulo a week.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Anchor {
    period: u64,
    of_week: i64,
}

/// Reads the message of one channel.
#[derive(Debug)]
pub struct Decoder {
    time: &'static TimeScale,
    reader: Box<dyn Reader>,
    periods_per_symbol: u64,
    periods_per_second: i64,
    /// First code period of the symbol to come.
    expected: Option<u64>,
    anchor: Option<Anchor>,
    /// Position of the message's units in the week, for a message that does not state its time.
    undated: Option<Units>,
}

/// Units of a message that does not say when they begin.
#[derive(Clone, Copy, Debug)]
struct Units {
    /// Length of a unit in seconds.
    unit_s: i64,
    /// Beginning of the first unit after the beginning of the week, seconds.
    first_s: i64,
    /// First code period of one that was read.
    begin: Option<u64>,
}

impl Decoder {
    /// A decoder of the first message of `signal`; `None` for a pilot or a code without whole periods a
    /// second.
    pub fn new(signal: &Signal, sv: Sv) -> Option<Self> {
        let component = signal.components.iter().find(|component| component.message.is_some())?;
        let message = component.message?;
        let rate_hz = 1.0 / component.period_s();
        let periods_per_second = rate_hz.round();
        // Far from any rounding: a code that does not fit the second misses by more than a millionth.
        ((rate_hz - periods_per_second).abs() < 1e-6).then_some(Self {
            time: signal.time,
            reader: (message.reader)(sv),
            periods_per_symbol: u64::from(component.periods_per_symbol()?),
            periods_per_second: periods_per_second as i64,
            expected: None,
            anchor: None,
            undated: (!message.is_dated()).then_some(Units {
                unit_s: message.unit_s,
                first_s: message.first_s,
                begin: None,
            }),
        })
    }

    /// Decoder that hands on the whole pages of a message that carries authentication.
    pub fn with_pages(mut self) -> Self {
        self.reader.keep_pages();
        self
    }

    /// True if another signal of the satellite has to give the time.
    pub fn is_dated_elsewhere(&self) -> bool {
        self.undated.is_some()
    }

    /// True if units of the message were found, with known time or without.
    pub fn has_units(&self) -> bool {
        self.anchor.is_some() || self.undated.is_some_and(|units| units.begin.is_some())
    }

    /// Takes the time of week by the satellite's clock in the code period `period` from another of its
    /// signals; whether the time of this one is known from here on. One that puts the beginnings of units
    /// further from their positions than a code period is not believed.
    pub fn date(&mut self, period: u64, of_week: (i64, f64)) -> bool {
        let Some(Units { unit_s, first_s, begin: Some(begin) }) = self.undated else { return false };
        let rate = self.periods_per_second as f64;
        let passed_s = (i128::from(period) - i128::from(begin)) as f64 / rate;
        // Half a code period in the mean after its beginning.
        let begun_s = (of_week.0 - first_s) as f64 + (of_week.1 - passed_s) - 0.5 / rate;
        let unit = (begun_s / unit_s as f64).round();
        if (begun_s - unit * unit_s as f64).abs() > 1.0 / rate {
            return false;
        }
        let unit = planted!("receiver.decode.dated", unit as i64, unit as i64 + 1);
        let of_week = (unit * unit_s + first_s).rem_euclid(WEEK_S) * self.periods_per_second;
        self.anchor.replace(Anchor { period: begin, of_week }).is_none()
    }

    /// True if the satellite's time of week is known.
    pub fn is_synchronised(&self) -> bool {
        self.anchor.is_some()
    }

    /// Parts of an ephemeris that have not been decoded.
    pub fn missing(&self) -> Vec<u8> {
        self.reader.missing()
    }

    /// Time of week by the satellite's clock, in its system's time, in the code period `period`, at
    /// `fraction` of it: whole seconds and a fraction. Exact in the periods. `None` before frame
    /// synchronisation.
    pub fn time_of_week(&self, period: u64, fraction: f64) -> Option<(i64, f64)> {
        let anchor = self.anchor?;
        let periods = anchor.of_week + (i128::from(period) - i128::from(anchor.period)) as i64;
        let periods = periods.rem_euclid(WEEK_S * self.periods_per_second);
        let whole = periods.div_euclid(self.periods_per_second);
        let fraction = planted!("receiver.observe.code_fraction", fraction, fraction + 3e-6);
        let rest = periods.rem_euclid(self.periods_per_second) as f64 + fraction;
        Some((whole, rest / self.periods_per_second as f64))
    }

    /// Takes a time that is known to within a year.
    pub fn know(&mut self, near: Epoch) {
        self.reader.know(self.time.label(near));
    }

    /// Takes the channel's next symbol. `near` resolves weeks.
    pub fn take(&mut self, symbol: &Symbol, near: Epoch) -> Vec<News> {
        if self.expected.is_some_and(|period| period != symbol.first_period) {
            // Symbols were lost. The frame is looked for again, the time stays.
            self.reader.skip();
        }
        let next = symbol.first_period + self.periods_per_symbol;
        self.expected = Some(next);
        let soft = symbol.soft - planted!("receiver.decode.bit_threshold", 0.0, 80.0);
        let mut news = Vec::new();
        for read in self.reader.take(soft, self.time.label(near)) {
            match read {
                Read::Unit { symbols, of_week_s, inverted } => {
                    self.tie(next.checked_sub(symbols * self.periods_per_symbol), of_week_s, inverted, &mut news);
                }
                Read::Undated { symbols, inverted } => {
                    self.place(next.checked_sub(symbols * self.periods_per_symbol), inverted, &mut news);
                }
                Read::Time(label) => news.push(News::Time(self.time.instant(label))),
                Read::Ephemeris(set) => {
                    news.push(News::Ephemeris(Box::new(set.timed(|label| self.time.instant(label)))));
                }
                Read::Reduced { set, with_delays } => {
                    let set = Box::new(set.timed(|label| self.time.instant(label)));
                    news.push(News::Reduced { set, with_delays });
                }
                Read::AheadOfGps(ahead) => {
                    let ahead = TimePolynomial { reference: self.time.instant(ahead.reference), ..ahead };
                    news.push(News::AheadOfGps { scale: self.time, ahead });
                }
                Read::Ionosphere(coefficients) => news.push(News::Ionosphere(coefficients)),
                Read::Sender(sv) => news.push(News::Sender(sv)),
                Read::Page(page) => news.push(News::Page(page)),
                Read::Parameters(rows) => news.push(News::Parameters(rows)),
                Read::Refused(why) => news.push(News::Refused(why)),
                Read::Augmentation(label, content) => {
                    news.push(News::Augmentation { sent: self.time.instant(label), content });
                }
            }
        }
        news
    }

    /// Takes in where a unit of unknown time began. What does not fit those before drops the time.
    fn place(&mut self, period: Option<u64>, inverted: bool, news: &mut Vec<News>) {
        let (Some(period), Some(units)) = (period, &mut self.undated) else { return };
        let length = (units.unit_s * self.periods_per_second).unsigned_abs();
        let fits = units.begin.is_none_or(|begin| begin.abs_diff(period).is_multiple_of(length));
        units.begin = fits.then_some(period);
        if !fits {
            self.anchor = None;
            self.reader.doubt();
            news.push(News::Contradiction);
            return;
        }
        news.push(News::Polarity { inverted });
    }

    /// Ties period numbers to the time at which a unit says that it began.
    fn tie(&mut self, period: Option<u64>, of_week_s: i64, inverted: bool, news: &mut Vec<News>) {
        let Some(period) = period else { return };
        let anchor = Anchor { period, of_week: of_week_s * self.periods_per_second };
        let week = WEEK_S * self.periods_per_second;
        match self.anchor {
            None => news.push(News::FrameSynchronised),
            Some(old) => {
                let passed = (i128::from(anchor.period) - i128::from(old.period)) as i64;
                if (old.of_week + passed - anchor.of_week).rem_euclid(week) != 0 {
                    self.anchor = None;
                    self.reader.doubt();
                    news.push(News::Contradiction);
                    return;
                }
            }
        }
        self.anchor = Some(anchor);
        news.push(News::Polarity { inverted: planted!("receiver.decode.polarity", inverted, !inverted) });
    }
}

#[cfg(test)]
mod tests;
