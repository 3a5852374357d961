//! `live`: a scene in real time, tick by tick, while motion and events come in.
//!
//! One thread takes messages, one makes ticks, one writes to each sink. A tick is made as late as
//! `--latency` permits, of what had come by then; how old the newest state was when its first sample was
//! handed over is measured of every state that is used. Limits: what the sink itself buffers is not seen.

mod account;
pub mod intake;
mod output;
mod peers;
mod record;
mod ring;
mod sensors;
mod times;
mod web;

use std::collections::VecDeque;
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::cli::args::{self, MotionTime};
use crate::cli::error::CliError;
use crate::cli::interrupt;
use crate::cli::run::generator_error;
use crate::cli::scenario;
use crate::cli::sink::Spec;
use account::{Handed, Intake, Made};
use generator::GenerateError;
use generator::scenario::Overrides;
use generator::scene::Scene;
use generator::truth;
use generator::vehicle::joining::Push;
use gnss::earth::Geodetic;
use gnss::samples::Format;
use gnss::time::Rate;
use intake::Inbox;
use live::drive::{Driver, Made as Tick};
use live::wire::{Message, Reader};
use output::{Output, Pace};
use record::{Recorder, Run};
use ring::{Block, Put};
use sensors::Sender;
use times::{Zero, instant};
use web::Page;

/// Polling interval for signals during a wait.
const LOOK: Duration = Duration::from_millis(20);
/// Time limit of the sinks for the rest after a signal.
const PARTING: Duration = Duration::from_millis(500);
/// Pushes whose arrival is remembered until a tick shows them.
const REMEMBERED: usize = 8192;

/// Sends a scene in real time.
pub fn execute(arguments: &args::Live) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    if arguments.to.contains(&Spec::Stdout) && std::io::stdout().is_terminal() {
        return Err(CliError::usage(
            "--to -: standard output is a terminal: name a sink with --to, or a pipe behind |",
        ));
    }
    let mut named = scenario::read(Some(&arguments.scenario), arguments.allow_outside)?
        .at_station(arguments.station.as_deref())?
        .choose(arguments.front_end.as_deref())?;
    let start = arguments.start_at.map(instant).transpose()?;
    if let Some((epoch, _)) = start {
        named.scenario.start = epoch;
    }
    let own = arguments.to.iter().any(|spec| matches!(spec, Spec::RtlTcp(_))).then_some(Format::Cu8);
    let overrides =
        Overrides { seed: arguments.seed, format: arguments.format.or(own), allow_outside: arguments.allow_outside };
    let (scenes, warnings) = scenario::compose_all(&named, &overrides)?;
    warnings.iter().for_each(|warning| scenario::warn(warning));
    let [scene] = scenes.as_slice() else {
        return Err(CliError::usage("a stream carries one front end: choose one with --front-end NAME"));
    };
    // Before a sink or a record is opened.
    if !scene.fidelity.grade.is_sampled() {
        return Err(generator_error(GenerateError::NoSamples(scene.fidelity.grade.name())));
    }
    if arguments.motion.is_some() && scene.trajectory.grown().is_none_or(|grown| grown.ticks() > 0) {
        let name = &named.name;
        return Err(CliError::usage(format!("--motion: {name}: expected a scene with [motion] kind = \"pushed\"")));
    }
    let inbox = arguments
        .motion
        .map(|origin| {
            let first_m = scene.trajectory.body(0.0).position_m;
            intake::begin(origin, Reader::new(scene.clock.start, Geodetic::from_ecef(&first_m).height_m))
        })
        .transpose()?;
    let imu = arguments.imu.map(|to| Sender::begin(to, scene)).transpose()?;
    let page = Page::begin(arguments, scene)?;
    let mut recorder = arguments.record.as_ref().map(|target| Recorder::create(target, scene)).transpose()?;
    let driver = match &mut recorder {
        Some(recorder) => Driver::new(scene, &mut recorder.truth),
        None => Driver::new(scene, &mut ()),
    };
    let discard = || recorder.iter().for_each(Recorder::discard);
    let driver = driver.map_err(generator_error).inspect_err(|_| discard())?;
    let sinks: Result<Vec<_>, CliError> = arguments.to.iter().map(|spec| spec.open(&scene.metadata, true)).collect();
    let sinks = sinks.inspect_err(|_| discard())?;
    interrupt::ends_work();
    let pace = Pace::new(arguments, scene.clock.rate, start.map(|(_, at)| at));
    let tick_s = scene.clock.rate.elapsed_s(driver.tick_samples());
    let outputs: Result<Vec<Output>, CliError> = (0..)
        .zip(sinks)
        .zip(&arguments.to)
        .map(|((number, sink), spec)| Output::begin((number, spec), sink, pace, tick_s))
        .collect();
    scenario::note(&format!("the first sample is of {0}: gnss-twin receive --start {0}", scene.clock.start));
    let zero = (arguments.motion_time == MotionTime::First).then(Zero::default);
    let live = Live { driver, recorder, page, imu, inbox, outputs: outputs?, pace, scene, made: Made::default(), zero };
    live.run(arguments, &Run { named: &named, scene, overrides: &overrides, restarted: start.is_some() })
}

/// A live run at work.
struct Live<'a> {
    driver: Driver<'a>,
    recorder: Option<Recorder>,
    page: Option<Page>,
    imu: Option<Sender>,
    inbox: Option<Arc<Inbox>>,
    outputs: Vec<Output>,
    pace: Pace,
    scene: &'a Scene,
    made: Made,
    /// Zero of the times of states, if the first state defines it.
    zero: Option<Zero>,
}

/// Reason why a run ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Scene,
    Signal,
    SinkGone,
}

impl Live<'_> {
    fn run(mut self, arguments: &args::Live, run: &Run<'_>) -> Result<(), CliError> {
        let ended = self.ticks(run);
        // Sinks have what was made, whatever ended it.
        self.outputs.iter().for_each(|output| output.ring.end());
        let patience = |output: &Output| {
            let mut since: Option<Instant> = None;
            while !output.is_done() && since.is_none_or(|since| since.elapsed() < PARTING) {
                if since.is_none() && (interrupt::ending().is_some() || ended.is_err()) {
                    since = Some(Instant::now());
                }
                thread::sleep(Duration::from_millis(2));
            }
        };
        self.outputs.iter().for_each(patience);
        let end = ended?;
        let intake = self.intake();
        let word = match end {
            End::Scene => "scene",
            End::Signal => "signal",
            End::SinkGone => "sink",
        };
        let (underruns, mut summary) = self.status(&intake);
        if let Some(object) = summary.as_object_mut() {
            object.insert("ended_by".to_owned(), word.into());
            object.insert("stated_latency_ms".to_owned(), self.stated(arguments));
            if let Some(imu) = &self.imu {
                object.insert("imu".to_owned(), imu.status());
            }
        }
        print(&json!({ "summary": &summary }));
        if let Some(page) = self.page.take() {
            page.end(&summary);
        }
        let rate = self.scene.clock.rate;
        match self.recorder {
            Some(mut recorder) => {
                self.driver.finish(&mut recorder.truth).map_err(generator_error)?;
                recorder.finish(run, summary)?;
            }
            None => drop(self.driver.finish(&mut ()).map_err(generator_error)?),
        }
        if let Some(signal) = interrupt::ending() {
            return Err(CliError::signal(signal));
        }
        let mut failures = self.outputs.into_iter().map(Output::failure);
        if let Some(Some(error)) = failures.next() {
            return Err(error);
        }
        failures.flatten().for_each(|error| error.print());
        let (late, made_s) = (self.made.late, rate.elapsed_s(self.made.samples));
        if let Some(most) = arguments.max_underruns.filter(|most| underruns > *most) {
            return Err(CliError::check(format!(
                "{underruns} underruns in {made_s:.3} s: --max-underruns {most}; a larger --latency, a lower rate or \
                 an idle machine helps"
            )));
        }
        match arguments.max_late.filter(|most| late > *most) {
            Some(most) => Err(CliError::check(format!(
                "{late} states came after their time was sent and the join was over: --max-late {most}"
            ))),
            None => Ok(()),
        }
    }

    /// The latency that is stated: a tick, the join and the ring; the sink's own comes on top.
    fn stated(&self, arguments: &args::Live) -> Value {
        let tick_ms = 1e3 * self.scene.clock.rate.elapsed_s(self.driver.tick_samples());
        let join_ms = self.scene.trajectory.grown().map_or(0.0, |grown| 1e3 * grown.joining().join_s);
        json!({ "tick": tick_ms, "join": join_ms, "ring": arguments.latency, "sink": "its own" })
    }

    /// Makes ticks to the scene's end, a signal, or the first sink's end.
    fn ticks(&mut self, run: &Run<'_>) -> Result<End, CliError> {
        let (mut messages, mut arrivals) = (Vec::new(), VecDeque::new());
        let mut used: VecDeque<Arc<Block>> = VecDeque::new();
        let mut status = Instant::now() + Duration::from_secs(1);
        let mut intake = Intake::default();
        while !self.driver.is_done() {
            if let Some(end) = self.wait() {
                return Ok(end);
            }
            if let Some(inbox) = &self.inbox {
                intake = inbox.drain(&mut messages);
            }
            if let Some(page) = &self.page {
                page.add_events(&mut messages);
            }
            self.take(&messages, &mut arrivals)?;
            messages.clear();
            let reused = used.pop_front().and_then(|block| match Arc::try_unwrap(block) {
                Ok(block) => Some(block.bytes),
                Err(block) => {
                    used.push_front(block);
                    None
                }
            });
            let mut bytes = reused.unwrap_or_default();
            let begun = Instant::now();
            let (mut unrecorded, mut unseen) = ((), ());
            let truth: &mut dyn truth::Sink = match &mut self.recorder {
                Some(recorder) => &mut recorder.truth,
                None => &mut unrecorded,
            };
            let seen: &mut dyn truth::Sink = match &mut self.page {
                Some(page) => page,
                None => &mut unseen,
            };
            let Some(tick) = self.driver.tick(&mut (truth, seen), &mut bytes).map_err(generator_error)? else { break };
            self.made.slowest_tick = self.made.slowest_tick.max(begun.elapsed());
            self.made.tick(tick.samples.0, tick.samples.1.min(self.scene.samples), tick.tick.as_ref());
            if let Some(imu) = &mut self.imu {
                imu.until(self.scene.elapsed_s(tick.samples.1.min(self.scene.samples)))?;
            }
            if let Some(recorder) = &mut self.recorder {
                recorder.tick(&tick, &bytes, self.scene.metadata.format.bytes())?;
                recorder.keep(run)?;
            }
            if let Some(page) = &mut self.page {
                page.tick(self.scene.clock.rate.elapsed_s(tick.samples.1), &bytes);
            }
            let block = Arc::new(Block { bytes, first: tick.samples.0, shows: shown(&tick, &mut arrivals) });
            self.hand(&block);
            used.push_back(block);
            if Instant::now() >= status {
                status += Duration::from_secs(1);
                let status = self.status(&intake).1;
                print(&status);
                if let Some(page) = &mut self.page {
                    page.status(&status);
                }
                self.made.low_water = None;
            }
        }
        Ok(End::Scene)
    }

    /// Waits until the next tick is to be made; why it is not to be, if so.
    fn wait(&mut self) -> Option<End> {
        let first = self.driver.next_tick() * self.driver.tick_samples();
        loop {
            if interrupt::ending().is_some() {
                return Some(End::Signal);
            }
            let Some(pacer) = self.outputs.first() else { return Some(End::SinkGone) };
            if pacer.is_done() {
                return Some(End::SinkGone);
            }
            let early = self.pace.until_made(first);
            if early > Duration::ZERO {
                thread::sleep(early.min(LOOK));
            } else if pacer.ring.has_room(LOOK) {
                let waiting = pacer.ring.waiting();
                self.made.low_water = Some(self.made.low_water.map_or(waiting, |least| least.min(waiting)));
                return None;
            }
        }
    }

    /// Uses what came.
    fn take(
        &mut self,
        messages: &[(Instant, Message)],
        arrivals: &mut VecDeque<(u64, Instant)>,
    ) -> Result<(), CliError> {
        let sample = self.driver.next_tick() * self.driver.tick_samples();
        let join_s = self.scene.trajectory.grown().map_or(0.0, |grown| grown.joining().join_s);
        let now_s = self.scene.elapsed_s(sample);
        for (at, message) in messages {
            match message {
                Message::Push(push) => {
                    let push = match &mut self.zero {
                        Some(zero) => &zero.timed(push, now_s),
                        None => push,
                    };
                    self.made.offset_s = self.zero.as_ref().and_then(Zero::offset_s);
                    self.count_turn(push);
                    let taken = self.driver.offer(push);
                    if let Some(zero) = &mut self.zero {
                        zero.judge(&taken);
                    }
                    match &taken {
                        Ok(number) => {
                            self.made.taken += 1;
                            self.made.late += u64::from(push.t_s < now_s - join_s);
                            arrivals.push_back((*number, *at));
                            if arrivals.len() > REMEMBERED {
                                arrivals.pop_front();
                            }
                        }
                        Err(refusal) => {
                            if self.made.refuse(refusal) {
                                scenario::warn(&format!("motion: {refusal}; further ones are counted"));
                            }
                        }
                    }
                    if let Some(recorder) = &mut self.recorder {
                        recorder.push(sample, taken.is_ok(), push)?;
                    }
                }
                Message::Event(event) => match self.driver.switch(event) {
                    Ok(sample) => {
                        self.made.events += 1;
                        if let Some(page) = &mut self.page {
                            page.event(now_s, event, None);
                        }
                        if let Some(recorder) = &mut self.recorder {
                            recorder.event(sample, event)?;
                        }
                    }
                    Err(error) => {
                        if let Some(page) = &mut self.page {
                            page.event(now_s, event, Some(&error));
                        }
                        if self.made.events_refused == 0 {
                            scenario::warn(&format!("event: {error}; further ones are counted"));
                        }
                        self.made.events_refused += 1;
                    }
                },
                Message::Bye => self.zero.iter_mut().for_each(|zero| *zero = Zero::default()),
                Message::Half | Message::Hello => {}
            }
        }
        Ok(())
    }

    /// Counts an attitude, and says once where the scene does not turn by it.
    fn count_turn(&mut self, push: &Push) {
        match (push.turn, self.scene.trajectory.is_turned()) {
            (None, _) => {}
            (Some(_), true) => self.made.attitudes += 1,
            (Some(_), false) => {
                if self.made.attitudes_not_used == 0 {
                    scenario::warn(
                        "motion: an attitude came, and the body does not turn by it: [attitude] kind = \"pushed\"",
                    );
                }
                self.made.attitudes_not_used += 1;
            }
        }
    }

    /// Hands a block to every sink; those behind the first lose it where they are slow.
    fn hand(&mut self, block: &Arc<Block>) {
        for (number, output) in self.outputs.iter().enumerate() {
            let put = output.ring.put(block);
            self.made.dropped_blocks += u64::from(number > 0 && put == Put::Full);
        }
    }

    fn intake(&self) -> Intake {
        self.inbox.as_ref().map_or_else(Intake::default, |inbox| inbox.drain(&mut Vec::new()))
    }

    /// Underruns so far, and everything.
    fn status(&self, intake: &Intake) -> (u64, Value) {
        let none = Handed::default();
        let rate: Rate = self.scene.clock.rate;
        match self.outputs.first() {
            Some(first) => first.with(|handed| (handed.underruns, self.made.json(rate, handed, intake))),
            None => (0, self.made.json(rate, &none, intake)),
        }
    }
}

/// Arrival of the push that a tick is the first to show; earlier ones are forgotten.
fn shown(tick: &Tick, arrivals: &mut VecDeque<(u64, Instant)>) -> Option<Instant> {
    let news = tick.tick.as_ref()?.news?;
    while arrivals.front().is_some_and(|(number, _)| *number < news) {
        arrivals.pop_front();
    }
    arrivals.pop_front().filter(|(number, _)| *number == news).map(|(_, at)| at)
}

/// Prints a line of status; a failure to do so is silent.
fn print(value: &Value) {
    let _ = writeln!(std::io::stderr(), "{value}");
}
