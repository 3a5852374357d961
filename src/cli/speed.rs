//! Speed of a run: wall time, processor time and memory, for `speed.json` and never for a result.

use std::time::Duration;

use serde::Serialize;

/// Speed of the stages of a run; `None` where the system does not report it.
#[derive(Debug, Serialize)]
pub struct Speed {
    pub generate_x_real_time: f64,
    pub receive_x_real_time: f64,
    pub run_x_real_time: f64,
    pub cpu_s: Option<f64>,
    pub peak_memory_mib: Option<f64>,
}

impl Speed {
    /// Speed from the scene's duration, the time spent in each stage, and the whole. The stages share the
    /// cores. Work of one for the other meanwhile counts for both.
    pub fn new(scene_s: f64, generate: Duration, receive: Duration, whole: Duration) -> Self {
        let ratio = |busy: Duration| scene_s / busy.as_secs_f64().max(1e-9);
        Self {
            generate_x_real_time: ratio(generate),
            receive_x_real_time: ratio(receive),
            run_x_real_time: ratio(whole),
            cpu_s: cpu_s(),
            peak_memory_mib: peak_memory_mib(),
        }
    }
}

/// Processor time of this process, from /proc/self/stat (fields 14 and 15, in ticks of 10 ms).
fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field may hold blanks; it ends with the last parenthesis.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}
