//! Page of a run while it goes on, for browsers: a server on the standard library, frames, and what they
//! show.
//!
//! A thread makes frames, five a second; the run itself waits for nobody. It leaves out what it finds locked.

mod http;
mod hub;
mod server;
pub mod source;
mod state;

use std::fmt::Write as _;
use std::io::Read;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serde_json::json;

use crate::cli::address::listen;
use crate::cli::error::CliError;
use crate::cli::scenario;
use analysis::measure::psd::Psd;
use analysis::show::page::live::{self, LivePage, Words};
use gnss::samples::IfMetadata;
use hub::Hub;
pub use server::Events;
use server::Server;
pub use state::{State, Table};

/// Time between frames.
pub const FRAME: Duration = Duration::from_millis(200);
/// Frequencies of the spectrum.
const BINS: usize = 256;
/// Samples of which a spectrum is made.
const SAMPLES: usize = 8192;
/// Time in which browsers take the last frames.
const PARTING: Duration = Duration::from_millis(500);
/// Stack of a thread.
const STACK_BYTES: usize = 1 << 19;

/// Samples for the next spectrum.
struct Sampled {
    metadata: IfMetadata,
    bytes: Mutex<Vec<u8>>,
}

/// A page that is served.
pub struct Web {
    server: Arc<Server>,
    state: Mutex<State>,
    sampled: Option<Sampled>,
}

impl Web {
    /// Begins to serve a page of these words and notes its address. `metadata` is that of the samples, where
    /// there are some; `events` takes the lines of events.
    ///
    /// # Errors
    /// An address that cannot be listened on, a thread that cannot be started.
    pub fn begin(
        address: SocketAddr,
        words: &Words,
        metadata: Option<&IfMetadata>,
        events: Option<Box<Events>>,
    ) -> Result<Arc<Self>, CliError> {
        let LivePage { html, policy } = live::compose(words).map_err(CliError::bug)?;
        let (listener, own) = listen(address, "page")?;
        let server = Arc::new(Server {
            port: own.port(),
            token: token()?,
            html,
            policy,
            hub: Arc::new(Hub::default()),
            events,
            refused: server::Refused::default(),
            connections: Default::default(),
        });
        let sampled = metadata.map(|metadata| Sampled { metadata: metadata.clone(), bytes: Mutex::default() });
        let web = Arc::new(Self { server: Arc::clone(&server), state: Mutex::default(), sampled });
        let host = if own.ip().is_unspecified() { IpAddr::V4(Ipv4Addr::LOCALHOST) } else { own.ip() };
        scenario::note(&format!("page: http://{}/?token={}", SocketAddr::new(host, own.port()), server.token));
        let serving = Arc::clone(&server);
        spawn("page", move || serving.run(&listener))?;
        Ok(web)
    }

    /// Makes frames on a thread of its own to the end of the process.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn frames(self: &Arc<Self>) -> Result<(), CliError> {
        let own = Arc::clone(self);
        spawn("frames", move || {
            loop {
                thread::sleep(FRAME);
                own.publish();
            }
        })
    }

    /// State of the page, for who may wait.
    pub fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// State of the page, for who must not wait; `None` while it is in use.
    pub fn try_state(&self) -> Option<MutexGuard<'_, State>> {
        self.state.try_lock().ok()
    }

    /// Takes samples for the next spectrum, if the last ones are used.
    pub fn sample(&self, bytes: &[u8]) {
        let Some(sampled) = &self.sampled else { return };
        if let Ok(mut waiting) = sampled.bytes.try_lock()
            && waiting.is_empty()
        {
            let most = SAMPLES * sampled.metadata.format.bytes();
            waiting.extend_from_slice(bytes.get(..most).unwrap_or(bytes));
        }
    }

    /// Makes a frame of the state.
    pub fn publish(&self) {
        let spectrum = self.spectrum();
        let mut state = self.state();
        if spectrum.is_some() {
            state.spectrum = spectrum;
        }
        let (hub, refused) = (&self.server.hub, &self.server.refused);
        let page = json!({ "browsers": hub.browsers(), "dropped": hub.dropped(), "refused": refused.json() });
        let frame = state.frame(&page);
        drop(state);
        hub.publish(&frame.to_string().into());
    }

    /// Publishes the last frame and lets browsers take it.
    pub fn end(&self) {
        self.publish();
        self.server.hub.end(PARTING);
    }

    fn spectrum(&self) -> Option<([f64; 2], Vec<f64>)> {
        let sampled = self.sampled.as_ref()?;
        let bytes = std::mem::take(&mut *sampled.bytes.lock().unwrap_or_else(PoisonError::into_inner));
        let IfMetadata { format, rate, .. } = sampled.metadata;
        let (mut i, mut q) = (Vec::new(), Vec::new());
        format.unpack(&bytes, &mut i, &mut q);
        let bins = if format.is_complex() { BINS } else { 2 * BINS };
        let mut psd = Psd::new(rate.hz(), !format.is_complex(), bins);
        psd.add(&i, &q);
        let rows = psd.rows()?;
        let ends = [rows.first()?.frequency_hz, rows.last()?.frequency_hz];
        Some((ends, rows.iter().map(|row| (row.density_db * 100.0).round() / 100.0).collect()))
    }
}

/// Starts a thread that ends with the process.
pub fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), CliError> {
    let thread = thread::Builder::new().name(name.to_owned()).stack_size(STACK_BYTES).spawn(work);
    thread.map(drop).map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))
}

/// 128 random bits in hexadecimal digits.
fn token() -> Result<String, CliError> {
    let mut bytes = [0; 16];
    let source = "/dev/urandom";
    let read = std::fs::File::open(source).and_then(|mut file| file.read_exact(&mut bytes));
    read.map_err(|error| CliError::read(source, &error))?;
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}
