//! Ticks of an axis: where they are and what is written at them.
//!
//! A tick is a whole number of `units` of a power of ten, and its label consists of the digits of that
//! number. No label is rounded, so position and label cannot differ. A step is 1, 2 or 5 times a power of
//! ten; a logarithmic axis has multiples of powers of ten. Labels longer than `MOST_CHARACTERS` are written
//! with an exponent or, where many digits are common to all, count from an offset that stands in the axis'
//! words.

/// Digits and point of a label; longer ones have an exponent or count from an offset.
const MOST_CHARACTERS: usize = 7;
/// Digits of a label with an exponent; labels with more of them count from an offset.
const MOST_DIGITS: usize = 3;
/// An axis shorter than this part of its larger end is widened to it: a double has no more digits for ticks.
pub const LEAST_SHARE: f64 = 1e-12;

/// One tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Position on the axis: a common logarithm where the axis is logarithmic.
    pub at: f64,
    /// Label of the tick.
    pub label: String,
}

/// All ticks of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ticks {
    /// Ticks from left to right.
    pub ticks: Vec<Tick>,
    /// Offset that a reader adds to each label.
    pub offset: Option<String>,
}

/// `units` times ten to the `exponent`.
#[derive(Clone, Copy, Debug)]
struct Decimal {
    units: i64,
    exponent: i32,
}

impl Decimal {
    /// The nearest double.
    fn value(self) -> f64 {
        format!("{}e{}", self.units, self.exponent).parse().unwrap_or(f64::NAN)
    }

    /// Text of the number without an exponent.
    fn plain(self) -> String {
        let sign = if self.units < 0 { "-" } else { "" };
        let digits = self.units.unsigned_abs().to_string();
        if self.units == 0 && self.exponent >= 0 {
            return "0".to_owned();
        }
        let Ok(decimals) = usize::try_from(-self.exponent) else {
            return format!("{sign}{digits}{}", "0".repeat(self.exponent.unsigned_abs() as usize));
        };
        if decimals == 0 {
            return format!("{sign}{digits}");
        }
        let digits = format!("{digits:0>width$}", width = decimals + 1);
        let (whole, rest) = digits.split_at(digits.len() - decimals);
        format!("{sign}{whole}.{rest}")
    }

    /// Characters of [`Self::plain`] but its sign, without writing it: exponents may be large.
    fn characters(self) -> usize {
        let digits = digits_of(self.units);
        let places = self.exponent.unsigned_abs() as usize;
        if self.exponent >= 0 { digits + places } else { digits.max(places + 1) + 1 }
    }

    /// Text of the number with an exponent, without zeros at the end of its digits.
    fn scientific(self) -> String {
        let sign = if self.units < 0 { "-" } else { "" };
        let digits = self.units.unsigned_abs().to_string();
        let exponent = self.exponent + digits.len() as i32 - 1;
        let (first, rest) = digits.split_at(1);
        match (self.units, rest.trim_end_matches('0')) {
            (0, _) => "0".to_owned(),
            (_, "") => format!("{sign}{first}e{exponent}"),
            (_, rest) => format!("{sign}{first}.{rest}e{exponent}"),
        }
    }
}

fn digits_of(units: i64) -> usize {
    units.unsigned_abs().checked_ilog10().unwrap_or(0) as usize + 1
}

/// Ticks between two values, `most` of them at most, and two at least.
pub fn linear(from: f64, to: f64, most: usize) -> Ticks {
    let span = to - from;
    let least = libm::floor(libm::log10(span / most.max(2) as f64)) as i32 - 1;
    let steps = (least..).flat_map(|exponent| [1_i64, 2, 5].map(|unit| Decimal { units: unit, exponent }));
    let mut best: Option<(Decimal, i64, i64)> = None;
    // From fine to coarse: the last with two ticks stands where the next has fewer.
    for step in steps.take(24) {
        let size = step.value();
        // The ends themselves are ticks where rounding alone puts them outside.
        let first = libm::ceil(from / size - 1e-6) as i64;
        let last = libm::floor(to / size + 1e-6) as i64;
        if last <= first {
            break;
        }
        best = Some((step, first, last));
        if (last - first + 1) as usize <= most {
            break;
        }
    }
    let Some((step, first, last)) = best else { return Ticks::default() };
    let decimal = |index: i64| Decimal { units: index.saturating_mul(step.units), exponent: step.exponent };
    labelled(&(first..=last).map(decimal).collect::<Vec<_>>())
}

/// Ticks of a common power of ten, with an offset where labels have many digits in common.
fn labelled(decimals: &[Decimal]) -> Ticks {
    let most = decimals.iter().map(|decimal| digits_of(decimal.units)).max().unwrap_or(1);
    let is_long = decimals.iter().any(|decimal| decimal.characters() > MOST_CHARACTERS);
    let with = |labels: Vec<String>, offset: Option<String>| Ticks {
        ticks: decimals.iter().zip(labels).map(|(decimal, label)| Tick { at: decimal.value(), label }).collect(),
        offset,
    };
    let (Some(first), Some(last)) = (decimals.first(), decimals.last()) else { return Ticks::default() };
    if !is_long || most <= MOST_DIGITS {
        return with(words(decimals), None);
    }
    // The roundest number below the first tick from which the others are few digits away.
    let span = last.units - first.units;
    let below = |round: i64| first.units.div_euclid(round).saturating_mul(round);
    let few = digits_of(span).max(2);
    let rounds = (0..18).map(|power| 10_i64.pow(power)).skip_while(|round| *round < span);
    let near = |round: &i64| digits_of(last.units.saturating_sub(below(*round))) <= few;
    let near_ones = rounds.clone().take_while(near);
    let round = near_ones.last().or_else(|| rounds.clone().next()).unwrap_or(1);
    let offset = Decimal { units: below(round), exponent: first.exponent };
    let rest = |decimal: &Decimal| Decimal { units: decimal.units - offset.units, exponent: decimal.exponent };
    let rest: Vec<Decimal> = decimals.iter().map(rest).collect();
    let offset = if offset.characters() <= 2 * MOST_CHARACTERS { shortened(offset) } else { offset.scientific() };
    with(words(&rest), Some(offset))
}

/// Text of a number without zeros behind the decimals.
fn shortened(decimal: Decimal) -> String {
    let text = decimal.plain();
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Labels, all with an exponent if one is too long without.
fn words(decimals: &[Decimal]) -> Vec<String> {
    let is_long = decimals.iter().any(|decimal| decimal.characters() > MOST_CHARACTERS);
    decimals.iter().map(|decimal| if is_long { decimal.scientific() } else { decimal.plain() }).collect()
}

/// Ticks between two common logarithms, `most` of them at most, and two at least: multiples of powers of ten
/// or, on a short axis, those of a linear one.
pub fn logarithmic(from: f64, to: f64, most: usize) -> Ticks {
    const MULTIPLES: [&[i64]; 4] = [&[1, 2, 3, 4, 5, 6, 7, 8, 9], &[1, 2, 5], &[1, 3], &[1]];
    const DECADES: [i32; 10] = [2, 3, 5, 10, 20, 30, 50, 100, 200, 300];
    let placed = |decimal: Decimal| (libm::log10(decimal.units as f64) + f64::from(decimal.exponent), decimal);
    // Rounding alone puts no end outside.
    let rounding = 1e-9 * (to - from);
    let inside = |(at, _): &(f64, Decimal)| (from - rounding..=to + rounding).contains(at);
    let decades = || libm::floor(from) as i32..=libm::ceil(to) as i32;
    let of_multiples = |multiples: &&[i64]| -> Vec<(f64, Decimal)> {
        let all = decades().flat_map(|exponent| multiples.iter().map(move |units| Decimal { units: *units, exponent }));
        all.map(placed).filter(inside).collect()
    };
    let of_decades = |every: &i32| -> Vec<(f64, Decimal)> {
        let round = decades().filter(|exponent| exponent % every == 0);
        round.map(|exponent| placed(Decimal { units: 1, exponent })).filter(inside).collect()
    };
    let sets = MULTIPLES.iter().map(of_multiples).chain(DECADES.iter().map(of_decades));
    let mut best: Option<Vec<(f64, Decimal)>> = None;
    for set in sets.take_while(|set| set.len() >= 2) {
        let enough = set.len() <= most;
        best = Some(set);
        if enough {
            break;
        }
    }
    let Some(best) = best else {
        let mut ticks = linear(libm::pow(10.0, from), libm::pow(10.0, to), most);
        ticks.ticks.iter_mut().for_each(|tick| tick.at = libm::log10(tick.at));
        return ticks;
    };
    let (places, decimals): (Vec<f64>, Vec<Decimal>) = best.into_iter().unzip();
    let ticks = places.into_iter().zip(words(&decimals)).map(|(at, label)| Tick { at, label });
    Ticks { ticks: ticks.collect(), offset: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn labels_have_the_digits_of_the_step_that_is_drawn() {
        // Once written "-0.1 0.0 0.1" for ticks at ±0.05.
        assert_eq!(labels(&linear(-0.0958, 0.0958, 3)), ["-0.05", "0.00", "0.05"]);
        assert_eq!(labels(&linear(0.0, 60.0, 7)), ["0", "10", "20", "30", "40", "50", "60"]);
        assert_eq!(labels(&linear(-0.1, 4.4, 5)), ["0", "1", "2", "3", "4"]);
        assert_eq!(labels(&linear(0.0, 3e-8, 4)), ["0", "1e-8", "2e-8", "3e-8"]);
        assert_eq!(labels(&linear(0.0, 2.5e9, 6)), ["0", "5e8", "1e9", "1.5e9", "2e9", "2.5e9"]);
    }

    #[test]
    fn a_short_axis_far_from_zero_counts_from_an_offset() {
        let ticks = linear(345_600.021, 345_600.038, 5);
        assert_eq!((labels(&ticks), ticks.offset.as_deref()), (vec!["0.025", "0.030", "0.035"], Some("345600")));
        let ticks = linear(-6_378_137.4, -6_378_136.6, 5);
        assert_eq!(ticks.offset.as_deref(), Some("-6378140"));
        assert_eq!(labels(&ticks), ["2.6", "2.8", "3.0", "3.2", "3.4"]);
    }

    #[test]
    fn a_logarithmic_axis_has_multiples_of_powers_of_ten_or_on_a_short_axis_those_of_a_linear_one() {
        assert_eq!(labels(&logarithmic(0.0, 2.0, 7)), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(labels(&logarithmic(-12.0, -9.0, 5)), ["1e-12", "1e-11", "1e-10", "1e-9"]);
        assert_eq!(labels(&logarithmic(0.02, 0.09, 5)), ["1.05", "1.10", "1.15", "1.20"]);
        assert_eq!(labels(&logarithmic(-8.0, 2.0, 3)).len(), 3);
    }
}
