//! Summary of a reception as JSON.

use serde_json::json;

use crate::followed::Followed;
use crate::outcome::Outcome;
use crate::settings::Settings;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;

/// Summary of a reception, written as `receiver.json`.
pub(crate) fn summary(
    metadata: &[IfMetadata],
    signals: &[Vec<&'static str>],
    settings: &Settings,
    outcome: &Outcome,
) -> serde_json::Value {
    let names = |svs: &[Sv]| svs.iter().map(Sv::to_string).collect::<Vec<_>>();
    let of = |metadata: &IfMetadata| {
        json!({
            "format": metadata.format.name(),
            "sample_rate_hz": metadata.rate.hz(),
            "center_hz": metadata.center_hz,
            "inverted": metadata.inverted,
            "start": metadata.start.map(|start| start.to_string()),
        })
    };
    let all = settings.acquisition.signals();
    let followed: Vec<Followed> = all.into_iter().filter_map(|signal| Followed::of(signal, settings)).collect();
    let mut summary = json!({
        "settings": settings,
        "followed": followed,
        "metadata": metadata.first().map(of),
        "samples": outcome.samples,
        "seconds": outcome.seconds,
        "cut_bytes": outcome.cut_bytes,
        "format_warning": outcome.format_warning,
        "acquired": names(&outcome.acquired),
        "used": names(&outcome.used),
        "fixes": outcome.fixes,
        "first_fix_s": outcome.first_fix_s,
        "losses": outcome.losses,
        "interference": outcome.interfered.as_ref().map(|seen| json!({
            "seconds": seen.spectra,
            "strongest": seen.strongest,
        })),
        "carrier_offset": outcome.parted,
        "sample_jumps": outcome.jumps,
        "conditioning": outcome.conditioning,
        "warnings": outcome.warnings,
        "diagnosis": outcome.diagnosis.as_ref().map(ToString::to_string),
    });
    if let Some(osnma) = &outcome.osnma {
        summary["osnma"] = json!(osnma);
    }
    if let Some(array) = &outcome.array {
        summary["array"] = json!(array);
    }
    if let Some(detection) = &outcome.detection {
        summary["detection"] = json!(detection);
    }
    if metadata.len() > 1 {
        let each = metadata.iter().zip(signals).map(|(metadata, signals)| {
            let mut front_end = of(metadata);
            front_end["signals"] = json!(signals);
            front_end
        });
        summary["front_ends"] = each.collect();
    }
    summary
}
