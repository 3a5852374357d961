//! Cost of a signal's samples in the kernels, as the bench `trade` measured it.

use std::sync::LazyLock;

use gnss::signal::Signal;

use super::{Arithmetic, CodeEdge};

/// Nanoseconds of one core for a sample of a satellite. `cargo bench --bench trade` writes it.
const TABLE: &str = include_str!("costs.csv");

/// Costs of a signal at a rate: of each edge, in single and in double precision.
struct Row {
    signal: &'static str,
    rate_hz: f64,
    ns: [[f64; 2]; 3],
}

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| TABLE.lines().skip(1).filter_map(row).collect());

fn row(line: &'static str) -> Option<Row> {
    let mut cells = line.split(',');
    let signal = cells.next()?;
    let mut number = || cells.next()?.parse::<f64>().ok();
    let rate_hz = 1e6 * number()?;
    let mut ns = [[0.0; 2]; 3];
    for cost in ns.iter_mut().flatten() {
        *cost = number()?;
    }
    Some(Row { signal, rate_hz, ns })
}

/// Time in ns on one core for a sample of a satellite, interpolated between the measured rates around
/// `rate_hz`. Beyond them the nearest rate counts. The processor is that of `reports/trade.md`; ratios are
/// similar on others.
pub fn kernel_ns(signal: &Signal, rate_hz: f64, edge: CodeEdge, arithmetic: Arithmetic) -> Option<f64> {
    let at = CodeEdge::NAMES.iter().position(|(_, one)| *one == edge)?;
    let double = usize::from(arithmetic == Arithmetic::F64);
    let of = |row: &Row| row.ns.get(at).and_then(|pair| pair.get(double)).copied();
    let own = || ROWS.iter().filter(|row| row.signal == signal.name);
    let below = own().rfind(|row| row.rate_hz <= rate_hz);
    let above = own().find(|row| row.rate_hz >= rate_hz);
    let (Some(below), Some(above)) = (below, above) else { return of(below.or(above)?) };
    let (from, to) = (of(below)?, of(above)?);
    if below.rate_hz == above.rate_hz {
        return Some(from);
    }
    let share = libm::log(rate_hz / below.rate_hz) / libm::log(above.rate_hz / below.rate_hz);
    Some(from * libm::pow(to / from, share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::signal::SIGNALS;

    #[test]
    fn every_signal_has_costs_of_every_edge() {
        for signal in SIGNALS {
            for (_, edge) in CodeEdge::NAMES {
                for (_, arithmetic) in Arithmetic::NAMES {
                    let ns =
                        |rate_hz| kernel_ns(signal, rate_hz, edge, arithmetic).unwrap_or_else(|| panic!("{signal}"));
                    // Measured at 25 and 65 Msps, between them, and beyond.
                    let [low, middle, high] = [25e6, 40e6, 65e6].map(ns);
                    let ordered = low.min(high) <= middle && middle <= low.max(high);
                    assert!(ordered && ns(80e6) == high && low > 0.0, "{signal} {edge:?} {arithmetic:?}");
                }
            }
        }
    }
}
