//! Page of a live run: truth, status and samples for it, and the events that its browsers post.
//!
//! The stream never waits for the page: what is collected here is handed over when nobody else has the state.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde_json::Value;

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::web::{Events, FRAME, State, Table, Web, source, spawn};
use analysis::show::page::live::Words;
use generator::event::{Event, EventError};
use generator::scene::Scene;
use generator::truth::{Record, Sink, TruthError};
use live::wire::Message;

/// Rows that wait for the state at most.
const MOST_ROWS: usize = 10_000;
/// Events that wait for the next tick at most.
const MOST_EVENTS: usize = 256;

/// Page of a live run.
pub struct Page {
    web: Arc<Web>,
    posted: Arc<Mutex<Vec<(Instant, Event)>>>,
    rows: Vec<(Table, Value)>,
    log: Vec<String>,
    status: Option<Value>,
    next: Instant,
}

impl Page {
    /// Begins to serve the page that the arguments ask for; `None` without one.
    ///
    /// # Errors
    /// An address that cannot be listened on, a thread that cannot be started.
    pub fn begin(arguments: &args::Live, scene: &Scene) -> Result<Option<Self>, CliError> {
        let Some(address) = arguments.web else { return Ok(None) };
        let posted = Arc::new(Mutex::new(Vec::new()));
        let is_pushed = scene.switches.is_some();
        let taker = Arc::clone(&posted);
        let events: Box<Events> = Box::new(move |line| {
            let event: Event = line.parse().map_err(|error: EventError| error.to_string())?;
            let mut waiting = taker.lock().unwrap_or_else(PoisonError::into_inner);
            if waiting.len() >= MOST_EVENTS {
                return Err("too many events wait".to_owned());
            }
            waiting.push((Instant::now(), event));
            Ok(())
        });
        let receiver = match &arguments.web_receiver {
            Some(_) => "Rows of the receiver that --web-receiver names.",
            None => {
                "No receiver is connected. Start gnss-twin receive with --json tcp:ADDR, and this run with \
                 --web-receiver tcp:ADDR, to see its channels and fixes here."
            }
        };
        let words = Words {
            title: scene.name.clone(),
            subtitle: format!("Live run, first sample of {}", scene.clock.start.to_utc_text()),
            sources: if is_pushed { sources(scene) } else { Vec::new() },
            receiver: receiver.to_owned(),
        };
        let web = Web::begin(address, &words, Some(&scene.metadata), is_pushed.then_some(events))?;
        web.frames()?;
        if let Some(peer) = arguments.web_receiver.clone() {
            let own = Arc::clone(&web);
            spawn("receiver", move || source::follow_lines(&own, &peer, false))?;
        }
        let next = Instant::now();
        Ok(Some(Self { web, posted, rows: Vec::new(), log: Vec::new(), status: None, next }))
    }

    /// Adds the events that came to the messages of a tick.
    pub fn add_events(&self, messages: &mut Vec<(Instant, Message)>) {
        if let Ok(mut posted) = self.posted.try_lock() {
            messages.extend(posted.drain(..).map(|(at, event)| (at, Message::Event(event))));
        }
    }

    /// Notes what became of an event at a time of the scene.
    pub fn event(&mut self, t_s: f64, event: &Event, refused: Option<&EventError>) {
        if self.log.len() < MOST_EVENTS {
            let why = refused.map(|error| format!(" refused: {error}")).unwrap_or_default();
            self.log.push(format!("{t_s:.3} s: {event}{why}"));
        }
    }

    /// Notes a line of status.
    pub fn status(&mut self, status: &Value) {
        self.status = Some(status.clone());
    }

    /// Hands over what was collected up to a tick of these samples, a few times a second.
    pub fn tick(&mut self, t_s: f64, bytes: &[u8]) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + FRAME;
        self.web.sample(bytes);
        let web = Arc::clone(&self.web);
        if let Some(state) = web.try_state() {
            self.hand_over(state, t_s);
        }
    }

    fn hand_over(&mut self, mut state: MutexGuard<'_, State>, t_s: f64) {
        self.rows.drain(..).for_each(|(table, row)| state.take(table, &row));
        self.log.drain(..).for_each(|text| state.event(text));
        if let Some(status) = self.status.take() {
            state.status = status;
        }
        state.t_s = t_s;
    }

    /// Shows the summary and lets browsers take it.
    pub fn end(mut self, summary: &Value) {
        self.status(summary);
        let web = Arc::clone(&self.web);
        self.hand_over(web.state(), summary.get("t_s").and_then(Value::as_f64).unwrap_or(0.0));
        web.end();
    }
}

/// Words and names of everything that events switch.
fn sources(scene: &Scene) -> Vec<(String, String)> {
    let is_sent = |sv: &gnss::satellite::Sv| !scene.excluded.contains(sv) && scene.signals_of(*sv).next().is_some();
    let satellites = scene.catalogue.satellites().filter(is_sent).map(|sv| ("power", sv.to_string()));
    let jammers = scene.interference.iter().map(|one| ("jammer", one.source.to_string()));
    let spoofers = scene.spoofers.iter().map(|one| ("spoofer", one.number.to_string()));
    let all = satellites.chain(jammers).chain(spoofers);
    all.map(|(word, name)| (word.to_owned(), name)).collect()
}

impl Sink for Page {
    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        let (table, row) = match &record {
            Record::Trajectory(row) => (Table::Trajectory, serde_json::to_value(row)),
            Record::Sky(row) => (Table::Sky, serde_json::to_value(row)),
            Record::Observation(row) => (Table::Observations, serde_json::to_value(row)),
            _ => return Ok(()),
        };
        if let (Ok(row), true) = (row, self.rows.len() < MOST_ROWS) {
            self.rows.push((table, row));
        }
        Ok(())
    }
}
