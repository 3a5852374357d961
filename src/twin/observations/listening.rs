//! Times in which a channel's symbols are handed to the decoder.
//!
//! Satellites send the same again and again, and decoders are most of the work of a day. Symbols are heard
//! for the whole cycle of a message after symbols are known, and again for a while after a satellite sends
//! another ephemeris than before. What changes all the time, or at times that messages do not show, is
//! always heard: augmentation, messages with faults, authentication.

use generator::scene::Scene;
use gnss::signal::Link;
use gnss::time::Epoch;

use super::clock::Instant;

/// Time in which every message has sent all that it has: the pages of LNAV take 12.5 minutes, in frames of 30
/// s.
const CYCLE_S: f64 = 790.0;
/// Time in which a new ephemeris has been sent whole by every message.
const RENEWED_S: f64 = 150.0;
/// Time between looks at what is sent.
const LOOK_S: f64 = 10.0;

/// Times of one channel.
pub(super) struct Listening {
    always: bool,
    is_open: bool,
    until_s: f64,
    look_s: f64,
    /// Time of the ephemeris that was sent last.
    sent: Option<(Epoch, u16)>,
}

impl Listening {
    pub fn new(always: bool) -> Self {
        Self { always, is_open: true, until_s: 0.0, look_s: 0.0, sent: None }
    }

    /// Begins with a signal that is found.
    pub fn begin(&mut self, now_s: f64) {
        (self.is_open, self.until_s) = (true, now_s + CYCLE_S);
    }

    /// Hears what comes next: the message has to show the polarity again.
    pub fn resume(&mut self, now_s: f64) {
        self.until_s = self.until_s.max(now_s + RENEWED_S);
    }

    /// True if symbols are heard.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Decides whether the symbols are heard that end in what begins at an instant.
    pub fn look(&mut self, scene: &Scene, link: Link, tick: &Instant) {
        if self.always || scene.osnma.is_some() || !scene.message_faults.is_empty() {
            return;
        }
        if tick.seconds >= self.look_s {
            self.look_s = tick.seconds + LOOK_S;
            let at = scene.clock.epoch(tick.sample);
            let sent = scene.catalogue.sent_at(link.sv, at).map(|set| (set.toe, set.iode));
            if self.sent.is_some() && self.sent != sent {
                self.until_s = self.until_s.max(tick.seconds + RENEWED_S);
            }
            self.sent = sent;
        }
        self.is_open = tick.seconds < self.until_s;
    }
}
