//! The order of rooms within each crate, and the imports that run against it. The order of the crates is in
//! their manifests, where cargo refuses a ring.

use crate::source::Source;

/// Rooms of each folder of `src`, the ground first; rooms on one line do not import each other.
pub type Order<'a> = &'a [(&'a str, &'a [&'a [&'a str]])];

/// The whole. Names that are not there yet, or not any more, cost nothing.
pub const ORDER: Order<'static> = &[
    (
        "gnss",
        &[
            &["discriminator", "plant", "renamed"],
            &["time", "earth", "geoid", "satellite", "inflate", "place", "weil"],
            &["gravity"],
            &["bits", "bdgim", "cityjson", "klobuchar", "nequick", "ionex", "projection", "samples", "vienna"],
            &["crc", "troposphere"],
            &["fec"],
            &["ionosphere"],
            &["packed", "signal", "vmf3"],
            &["recording"],
            &["ion", "sigmf"],
            &["augmentation", "broadcast", "facts"],
            &["record"],
            &["message"],
            &["nmea", "exchange", "framed", "set_tables"],
            &["gps", "galileo", "navic", "beidou", "glonass"],
            &["qzss", "sbas"],
            &["rinex"],
            &["sp3"],
        ],
    ),
    (
        "generator",
        &[
            &["random"],
            &["low_pass"],
            &["fidelity"],
            &["vehicle"],
            &["inertial"],
            &["clock"],
            &["orbit_error"],
            &["precise"],
            &["catalogue"],
            &["ray"],
            &["sky"],
            &["message"],
            &["effect"],
            &["array"],
            &["fast_phase"],
            &["augmentation", "authentication"],
            &["spoof"],
            &["synth"],
            &["knots"],
            &["stopwatch", "switches"],
            &["stage"],
            &["scene"],
            &["event"],
            &["presence"],
            &["geometry"],
            &["arrival"],
            &["truth"],
            &["error"],
            &["transmit"],
            &["stream"],
            &["levels"],
            &["plan"],
            &["dynamics"],
            &["scenario"],
        ],
    ),
    (
        "receiver",
        &[
            &["described"],
            &["format"],
            &["threshold"],
            &["correlate"],
            &["source"],
            &["lead"],
            &["gap"],
            &["interference"],
            &["parting"],
            &["acquire"],
            &["looks"],
            &["track"],
            &["decode"],
            &["observe"],
            &["position"],
            &["settings"],
            &["followed"],
            &["diagnosis"],
            &["output"],
            &["array", "authentic", "detect"],
            &["outcome"],
            &["session"],
            &["run"],
            &["navigator"],
        ],
    ),
    (
        "analysis",
        &[
            &["error", "statistics", "waveform"],
            &["response"],
            &["read"],
            &["expect"],
            &["measure"],
            &["judge"],
            &["show"],
            &["logged"],
        ],
    ),
    (
        "logs",
        &[
            &["bits", "frames", "ntrip", "observed", "table"],
            &["content"],
            &["contents", "rtcm", "sbf", "ubx"],
            &["log"],
        ],
    ),
    (
        "analysis/read",
        &[
            &["facts", "fault", "files", "word_file"],
            &["numbers", "spill_store"],
            &["rinex_obs", "nmea", "delay", "detection", "emission", "levels", "protection", "rows", "table"],
            &["common", "derived", "fixes"],
            &["run"],
            &["attacks", "inertial", "sky"],
        ],
    ),
    (
        "analysis/expect",
        &[
            &["theory"],
            &[
                "array",
                "authenticated",
                "converter",
                "followed",
                "jamming",
                "message",
                "quantile",
                "smoothing",
                "welch",
            ],
            &["sweep"],
            &["front_end", "multiple_access"],
            &["samples"],
            &["spectrum"],
            &["stated"],
            &["peak", "timeline"],
            &["closed"],
            &["loops"],
            &["beats", "due", "multipath"],
        ],
    ),
    (
        "analysis/expect/theory",
        &[&["clock", "detection", "dll", "edges", "inertial", "linear", "pll"], &["fll", "oscillator"]],
    ),
    (
        "analysis/measure",
        &[
            &["allan", "errors", "independent", "ionosphere", "lines", "osnma", "peaks", "psd", "spectrum", "spoofing"],
            &["clock", "consistency", "elevation", "inertial", "jitter", "protection"],
            &["attitude", "detection", "slips"],
            &["labelled"],
        ],
    ),
    (
        "analysis/judge",
        &[
            &["schema"],
            &["forecast", "foreign", "integrity", "judgement"],
            &["verdict", "limits"],
            &["summary"],
            &["rules"],
        ],
    ),
    (
        "analysis/judge/forecast",
        &[&["air", "heard", "settled", "unshared"], &["links"], &["ranges"], &["dispersion", "rates"], &["solution"]],
    ),
    (
        "analysis/judge/foreign",
        &[&["fit", "pairs"], &["measured", "place"], &["carriers", "judged"], &["observables", "report"]],
    ),
    (
        "analysis/show",
        &[
            &["columns", "report", "staged"],
            &["write"],
            &["plot"],
            &["document", "tables", "trade"],
            &["page", "pdf"],
            &["run_report"],
            &["foreign"],
        ],
    ),
    (
        "analysis/show/plot",
        &[
            &["clip", "drawing", "marks", "names", "ticks"],
            &["chart"],
            &["series"],
            &["canvas"],
            &["dome"],
            &["sketch"],
            &["judged"],
            &[
                "array",
                "attitude",
                "clock",
                "consistency",
                "delays",
                "detection",
                "jitter",
                "peaks",
                "position",
                "protection",
                "signals",
                "sky",
                "spectrum",
            ],
            &["elevation", "foreign", "multipath"],
        ],
    ),
    (
        "osnma",
        &[
            &["bits", "time"],
            &["fields"],
            &["chain", "page", "tables"],
            &["data", "mac", "subframe"],
            &["dsm", "report"],
            &["keys"],
            &["files"],
            &["provider", "verifier"],
            &["tests"],
        ],
    ),
    (
        "rtk",
        &[
            &["carrier", "lambda", "normal", "orbits", "site"],
            &["error"],
            &["files"],
            &["pairs"],
            &["integers", "rows", "slips"],
            &["solver", "truth"],
            &["judge"],
            &["run"],
        ],
    ),
    (
        "study",
        &[
            &["correlation", "demand", "measure", "normal", "watch"],
            &["leaving", "motion"],
            &["search"],
            &["correlator", "detection"],
            &["expect"],
            &["limits", "proof"],
            &["report", "sweep"],
        ],
    ),
];

/// Imports against the order that are still there. The list may only shrink.
pub const EXCEPTIONS: &[&str] = &[
    // The registry of signals names all of them, and a signal its message.
    "gnss/message: gnss/gps",
    "gnss/signal: gnss/beidou",
    "gnss/signal: gnss/galileo",
    "gnss/signal: gnss/glonass",
    "gnss/signal: gnss/gps",
    "gnss/signal: gnss/navic",
    "gnss/signal: gnss/qzss",
    "gnss/signal: gnss/sbas",
    "gnss/signal: gnss/message",
];

/// Imports against the order of a source, as "room: room that it imports".
pub fn arrows(source: &Source, order: Order<'_>) -> Vec<String> {
    let mut found = Vec::new();
    for path in paths(source) {
        for (folder, groups) in order {
            let folder: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
            let inside = |module: &[String]| {
                module.len() > folder.len() && module.iter().zip(&folder).all(|(own, part)| own == part)
            };
            if !inside(&source.module) || !inside(&path) {
                continue;
            }
            let (own, other) = (&source.module[folder.len()], &path[folder.len()]);
            let level = |room: &String| groups.iter().position(|group| group.contains(&room.as_str()));
            // What is not in the table is an item of the folder's root, above all rooms.
            let below = level(other).is_some_and(|other| level(own).is_none_or(|own| other < own));
            if own != other && !below {
                let full = |room: &String| [&folder[..], &[room.as_str()]].concat().join("/");
                found.push(format!("{}: {}", full(own), full(other)));
            }
        }
    }
    found.sort();
    found.dedup();
    found
}

/// Every path of its own crate that a source names, from `src`.
fn paths(source: &Source) -> Vec<Vec<String>> {
    let (module, tokens) = (&source.module, tokens(&source.code));
    let mut found = Vec::new();
    // Modules inside the file, with the depth of braces at which each ends.
    let (mut inner, mut depth) = (Vec::<(String, usize)>::new(), 0_usize);
    let mut i = 0;
    while i < tokens.len() {
        match tokens[i] {
            "mod" if tokens.get(i + 2) == Some(&"{") => inner.push((tokens[i + 1].to_owned(), depth)),
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                inner.retain(|(_, end)| *end < depth);
            }
            "crate" | "super" | "self" if tokens.get(i + 1) == Some(&"::") && !(i > 0 && tokens[i - 1] == "::") => {
                let here: Vec<String> =
                    module.iter().cloned().chain(inner.iter().map(|(name, _)| name.clone())).collect();
                let mut leaves = Vec::new();
                i = tree(&tokens, i, &[], &mut leaves);
                found.extend(leaves.iter().filter_map(|leaf| resolve(&here, source.root, leaf)));
                continue;
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// Reads a path or a tree of paths from token `i` on; gives the token behind it.
fn tree<'a>(tokens: &[&'a str], mut i: usize, before: &[&'a str], leaves: &mut Vec<Vec<&'a str>>) -> usize {
    let mut path = before.to_vec();
    loop {
        match tokens.get(i) {
            Some(&"{") => {
                i += 1;
                while i < tokens.len() && tokens[i] != "}" {
                    i = if tokens[i] == "," { i + 1 } else { tree(tokens, i, &path, leaves).max(i + 1) };
                }
                return i + 1;
            }
            Some(word) if word.chars().all(|c| c.is_alphanumeric() || c == '_') => path.push(word),
            // A star takes all that is there: the folder itself.
            _ => {
                leaves.push(path);
                return i;
            }
        }
        i += 1;
        if tokens.get(i) == Some(&"::") {
            i += 1;
        } else {
            leaves.push(path);
            if tokens.get(i) == Some(&"as") {
                i += 2;
            }
            return i;
        }
    }
}

/// A path as written in module `here`, whose crate begins behind `root` modules, from `src`; `None` of one
/// that leaves the crate.
fn resolve(here: &[String], root: usize, path: &[&str]) -> Option<Vec<String>> {
    let mut base = here.to_vec();
    let mut rest = path;
    match *path.first()? {
        "crate" => {
            base.truncate(root);
            rest = &path[1..];
        }
        "self" => rest = &path[1..],
        _ => {}
    }
    while let Some((&"super", behind)) = rest.split_first() {
        if base.len() <= root {
            return None;
        }
        base.pop();
        rest = behind;
    }
    base.extend(rest.iter().filter(|part| **part != "self").map(|part| (*part).to_owned()));
    Some(base)
}

/// Words, `::`, and single signs.
fn tokens(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let word = |c: char| c.is_alphanumeric() || c == '_';
        let end = if word(first) {
            rest.find(|c| !word(c)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        found.push(&rest[..end]);
        rest = rest[end..].trim_start();
    }
    found
}
