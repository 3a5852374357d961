//! Models that a scene contains, and models that it does not, by the tables of its scenario.

use super::Model;
use crate::scene::{CodeEdge, Scene, is_outside};
use crate::stream::Kept;
use gnss::place::counted;
use gnss::signal::SIGNALS;

/// Everything that a scenario can switch on, and whether this one does.
pub(super) fn models(scene: &Scene, kept: &Kept) -> Vec<Model> {
    let mut models: Vec<Model> = scene
        .effects
        .iter()
        .map(|effect| Model { name: effect.name().to_owned(), present: true, why: effect.describe() })
        .collect();
    let mut add = |name: &str, present: bool, why: String| models.push(Model { name: name.to_owned(), present, why });
    let (orbits, departures) = scene.catalogue.describe();
    let broadcast = "no [orbits]: what satellites broadcast is true, smoothed where one ephemeris follows another";
    add("true orbits", orbits.is_some(), orbits.unwrap_or_else(|| broadcast.to_owned()));
    let faults = [departures, scene.satellite_clocks.descriptions.clone()].concat();
    if faults.is_empty() {
        add("satellite fault", false, "no [[satellite_fault]]".to_owned());
    }
    faults.into_iter().for_each(|fault| add("satellite fault", true, fault));
    if scene.message_faults.is_empty() {
        add("message fault", false, "no [[message_fault]]".to_owned());
    }
    for fault in &scene.message_faults {
        let spoofer = scene.spoofers.iter().find(|spoofer| spoofer.number == fault.constellation);
        let start = spoofer.map_or(scene.clock.start, |spoofer| spoofer.replayed(scene.clock.start));
        add("message fault", true, fault.describe(start));
    }
    if let Some(osnma) = &scene.osnma {
        add("authentication", true, osnma.describe());
    }
    for name in ["ionosphere", "troposphere"] {
        if !scene.effects.iter().any(|effect| effect.name() == name) {
            add(name, false, format!("the scenario has no [{name}]"));
        }
    }
    for signal in SIGNALS.into_iter().filter(|signal| !scene.signals.contains(signal)) {
        let outside = is_outside(&scene.metadata, signal);
        let why =
            if outside { "its main lobe lies outside the samples' band" } else { "not among the scenario's signals" };
        add(signal.name, false, why.to_owned());
    }
    if scene.trajectory.attitude().is_none() {
        add("attitude", false, "the scenario has no [attitude]: the antenna looks up, no wind-up".to_owned());
    }
    if let Some(imu) = &scene.imu {
        add("inertial sensors", true, imu.describe());
    }
    if !scene.effects.iter().any(|effect| effect.name() == "multipath") {
        add("multipath", false, "the scenario has no [[multipath]]".to_owned());
    }
    if !scene.effects.iter().any(|effect| effect.name() == "obstruction") {
        add("obstruction", false, "the scenario has no [[obstruction]]".to_owned());
    }
    if !scene.effects.iter().any(|effect| effect.name() == "city") {
        add("city", false, "the scenario has no [city]".to_owned());
    }
    let fading = scene.scintillation.as_ref().map(|fading| {
        let strength = &fading.strength;
        let who =
            strength.satellites.as_ref().map_or("all satellites".to_owned(), |list| counted(list.len(), "satellite"));
        format!("S4 {} on L1, as f^-1.5 on others, decorrelation {} s, {who}", strength.s4, strength.decorrelation_s)
    });
    let absent = || "the scenario has no [scintillation]".to_owned();
    add("scintillation", fading.is_some(), fading.unwrap_or_else(absent));
    let clock = &scene.receiver_clock;
    let noisy = clock.oscillator.as_ref().map(|oscillator| format!(", noise h = {:?}", oscillator.law.levels()));
    let aged = (clock.ageing_per_s != 0.0).then(|| format!(", ageing {:e} a second", clock.ageing_per_s));
    let shaken = clock.shaking.as_ref().map(|shaking| format!(", {:e} for 1 m/s2", shaking.per_mps2));
    let off = clock.bias_s != 0.0 || clock.drift != 0.0 || noisy.is_some() || aged.is_some() || shaken.is_some();
    let why = if off {
        let rest: String = [aged, shaken, noisy].into_iter().flatten().collect();
        format!("bias {:e} s, drift {:e} s/s{rest}", clock.bias_s, clock.drift)
    } else {
        "no [receiver_clock]: it reads GPS time".to_owned()
    };
    add("receiver clock", off, why);
    scene.stages(|stage| add(stage.name(), true, stage.describe()));
    scene.spoofers.iter().for_each(|spoofer| add("spoofer", true, spoofer.describe()));
    if scene.interference.is_empty() {
        add("interference", false, "no [[interference]] in the samples' band".to_owned());
    }
    if scene.spoofers.is_empty() {
        add("spoofer", false, "no [[spoofer]]".to_owned());
    }
    if !scene.noise {
        add("noise", false, "no [noise]".to_owned());
    }
    let rounds = scene.metadata.format.full_scale_lsb().is_some();
    add("quantiser", rounds, format!("format {}", scene.metadata.format));
    let losses: Vec<String> = kept.losses_db().map(|(name, db)| format!("{db:.2} dB of {name}")).collect();
    let losses = format!("takes from the C/N0 at the antenna {}", losses.join(", "));
    add(
        "chip edges",
        scene.fidelity.code_edge != CodeEdge::Nearest,
        match scene.fidelity.code_edge {
            CodeEdge::Nearest => "nearest sample: biased by up to half a sample".to_owned(),
            CodeEdge::Area => format!("mean of the chip over the sample's interval: {losses}"),
            CodeEdge::BandLimited => format!("through a low-pass filter below half the rate: {losses}"),
        },
    );
    models
}
