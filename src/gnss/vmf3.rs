//! Coefficients b and c of the VMF3 mapping functions, by position and season.
//!
//! Source: Landskron & Böhm 2018, "VMF3/GPT3: refined discrete and empirical troposphere mapping functions":
//! each is an expansion in spherical harmonics to degree and order 12, of a mean and of a year's and half a
//! year's cosine and sine. Legendre's functions are neither normalised nor do they have the phase (-1)^m.
//! Their numbers, as TU Wien gives them out, are in `data/vmf3.csv`. Limits: b and c fit coefficients a of
//! VMF3 grids or of GPT3, not VMF1's.

use crate::vienna::{Season, ViennaError, season_terms};

const DEGREE: usize = 12;
/// Pairs of degree and order.
const PAIRS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;
const QUANTITIES: [&str; 4] = ["bh", "ch", "bw", "cw"];
const COLUMNS: &str = "quantity,factor,n,m,mean,annual_cos,annual_sin,semiannual_cos,semiannual_sin";

/// Coefficients b and c of the continued fractions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MappingBc {
    /// Second coefficient of dry air.
    pub b_hydrostatic: f64,
    /// Third coefficient of dry air.
    pub c_hydrostatic: f64,
    /// Second coefficient of water vapour.
    pub b_wet: f64,
    /// Third coefficient of water vapour.
    pub c_wet: f64,
}

/// Contribution of one degree and order to each of [`QUANTITIES`], by cosine and sine of the order times
/// longitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Term {
    cosine: [Season; 4],
    sine: [Season; 4],
}

/// Spherical harmonic expansion, order by order, each from its lowest degree up.
#[derive(Clone, Debug, PartialEq)]
pub struct Vmf3(Vec<Term>);

impl Vmf3 {
    /// The published expansion, which comes with the program.
    ///
    /// # Errors
    /// Errors of [`Self::read`]; a test sees to it that there are none.
    pub fn embedded() -> Result<Self, ViennaError> {
        Self::read(include_str!("data/vmf3.csv"), "embedded vmf3.csv")
    }

    /// Reads an expansion; errors call it `name`. Sines of order zero, which add nothing, are absent.
    ///
    /// # Errors
    /// [`ViennaError`] with the line that is wrong, or the last one if numbers are missing.
    pub fn read(text: &str, name: &str) -> Result<Self, ViennaError> {
        let wrong = |line: usize, found: &str, expected: String| ViennaError::Line {
            name: name.to_owned(),
            line,
            found: format!("'{}'", found.chars().take(40).collect::<String>()),
            expected,
        };
        let mut terms = vec![Term::default(); PAIRS];
        let mut known = [[[false; 2]; QUANTITIES.len()]; PAIRS];
        let mut lines = text.lines().enumerate();
        match lines.next() {
            Some((_, COLUMNS)) => (),
            other => return Err(wrong(1, other.map_or("", |(_, line)| line), format!("the columns {COLUMNS}"))),
        }
        for (index, line) in lines {
            let (place, season) = row(line).map_err(|expected| wrong(index + 1, line, expected.to_owned()))?;
            let Place { pair, quantity, sine } = place;
            let (Some(term), Some(known)) = (terms.get_mut(pair), known.get_mut(pair)) else { continue };
            let half = if sine { &mut term.sine } else { &mut term.cosine };
            if std::mem::replace(&mut known[quantity][usize::from(sine)], true) {
                return Err(wrong(index + 1, line, "each term once".to_owned()));
            }
            half[quantity] = season;
        }
        // No sine belongs to order zero, whose pairs come first.
        let missing = known.iter().enumerate().flat_map(|(pair, halves)| {
            halves.iter().flatten().enumerate().filter(move |(k, known)| !**known && (pair > DEGREE || k % 2 == 0))
        });
        match missing.count() {
            0 => Ok(Self(terms)),
            count => {
                let last = text.lines().last().unwrap_or_default();
                Err(wrong(text.lines().count(), last, format!("{count} terms more behind it")))
            }
        }
    }

    /// Coefficients at a position on a day of the year that counts from 1.0.
    pub fn at(&self, latitude_rad: f64, longitude_rad: f64, day_of_year: f64) -> MappingBc {
        let season = season_terms(day_of_year);
        let now = |amplitudes: &Season| amplitudes.iter().zip(season).map(|(a, term)| a * term).sum::<f64>();
        let (sin, cos) = libm::sincos(latitude_rad);
        let (sin_east, cos_east) = libm::sincos(longitude_rad);
        let mut sums = [0.0; 4];
        let mut terms = self.0.iter();
        // P_mm of the latitude's sine, and cosine and sine of m times the longitude.
        let (mut sectoral, mut cosine, mut sine) = (1.0, 1.0, 0.0);
        for m in 0..=DEGREE {
            let (mut below, mut legendre) = (0.0, sectoral);
            for (n, term) in (m..=DEGREE).zip(&mut terms) {
                for ((sum, with_cosine), with_sine) in sums.iter_mut().zip(&term.cosine).zip(&term.sine) {
                    *sum += legendre * (cosine * now(with_cosine) + sine * now(with_sine));
                }
                let above = ((2 * n + 1) as f64 * sin * legendre - (n + m) as f64 * below) / (n + 1 - m) as f64;
                (below, legendre) = (legendre, above);
            }
            sectoral *= (2 * m + 1) as f64 * cos;
            (cosine, sine) = (cosine * cos_east - sine * sin_east, sine * cos_east + cosine * sin_east);
        }
        let [b_hydrostatic, c_hydrostatic, b_wet, c_wet] = sums;
        MappingBc { b_hydrostatic, c_hydrostatic, b_wet, c_wet }
    }
}

/// Position in the grid of a row's numbers.
struct Place {
    pair: usize,
    quantity: usize,
    sine: bool,
}

/// Parses one row of the table. The error states the expected form.
fn row(line: &str) -> Result<(Place, Season), &'static str> {
    let fields: Vec<&str> = line.split(',').collect();
    let [quantity, factor, n, m, rest @ ..] = fields.as_slice() else { return Err("nine fields") };
    let quantity = QUANTITIES.iter().position(|q| q == quantity).ok_or("bh, ch, bw or cw in the first field")?;
    let sine = match *factor {
        "cos" => false,
        "sin" => true,
        _ => return Err("cos or sin in the second field"),
    };
    let (Ok(n), Ok(m)) = (n.parse::<usize>(), m.parse::<usize>()) else { return Err("degree and order") };
    if n > DEGREE || m > n || (sine && m == 0) {
        return Err("a degree up to 12 and an order up to the degree, which is above zero for sines");
    }
    let numbers: Vec<f64> = rest.iter().map_while(|x| x.parse().ok()).filter(|x: &f64| x.is_finite()).collect();
    let season = Season::try_from(numbers).map_err(|_| "five numbers behind degree and order")?;
    if rest.len() != season.len() {
        return Err("five numbers behind degree and order");
    }
    // Orders below m have 13, 12, ... pairs.
    let pair = m * (2 * DEGREE + 3 - m) / 2 + n - m;
    Ok((Place { pair, quantity, sine }, season))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_expansion_is_whole_and_stays_where_atmospheres_are() {
        let vmf3 = Vmf3::embedded().unwrap();
        let zeros = vmf3.0.iter().flat_map(|t| t.cosine.iter().chain(&t.sine)).flatten().filter(|x| **x == 0.0).count();
        assert_eq!(zeros, 13 * 4 * 5);
        // b and c of VMF1 are 0.0029 and 0.062 to 0.071, 0.00146 and 0.04391; the globe's spread is a fifth
        // or so of each.
        for latitude in [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0] {
            for longitude in [-180.0, -90.0, 0.0, 45.0, 180.0] {
                for day in [1.0, 91.0, 182.0, 274.0] {
                    let found = vmf3.at(f64::to_radians(latitude), f64::to_radians(longitude), day);
                    assert!((0.0024..0.0029).contains(&found.b_hydrostatic), "{found:?}");
                    assert!((0.054..0.062).contains(&found.c_hydrostatic), "{found:?}");
                    assert!((0.0011..0.0015).contains(&found.b_wet), "{found:?}");
                    assert!((0.034..0.050).contains(&found.c_wet), "{found:?}");
                }
            }
        }
    }

    #[test]
    fn places_that_are_one_have_one_value() {
        let vmf3 = Vmf3::embedded().unwrap();
        let near = |a: MappingBc, b: MappingBc| {
            // Sums of a hundred terms below 0.06: rounding leaves 1e-16 of each.
            let off = [a.b_hydrostatic - b.b_hydrostatic, a.c_hydrostatic - b.c_hydrostatic, a.c_wet - b.c_wet];
            assert!(off.iter().all(|x| x.abs() < 1e-14), "{a:?} {b:?}");
        };
        let degrees = |latitude: f64, longitude: f64| vmf3.at(latitude.to_radians(), longitude.to_radians(), 77.5);
        near(degrees(51.0, 190.0), degrees(51.0, -170.0));
        near(degrees(90.0, 0.0), degrees(90.0, 123.0));
        near(vmf3.at(0.3, 0.4, 12.0), vmf3.at(0.3, 0.4, 12.0 + 365.25));
    }

    #[test]
    fn a_damaged_table_is_refused_with_its_line() {
        let text = include_str!("data/vmf3.csv");
        let error = |text: &str| Vmf3::read(text, "t").unwrap_err().to_string();
        assert!(error("").starts_with("t:1") && error("quantity\n").contains("the columns quantity,factor"));
        let short: Vec<&str> = text.lines().take(676).collect();
        let found = error(&short.join("\n"));
        assert!(found.starts_with("t:676") && found.contains("1 terms more"), "{found}");
        let twice = format!("{text}{}\n", text.lines().last().unwrap());
        assert!(error(&twice).starts_with("t:678") && error(&twice).contains("once"));
        for (row, expected) in [
            ("bx,cos,0,0,1,2,3,4,5", "bh, ch, bw or cw"),
            ("bh,tan,0,0,1,2,3,4,5", "cos or sin"),
            ("bh,cos,0,1,1,2,3,4,5", "an order up to the degree"),
            ("bh,sin,13,1,1,2,3,4,5", "a degree up to 12"),
            ("bh,cos,0,0,1,2,3,4", "five numbers"),
            ("bh,cos,0,0,1,2,3,4,x", "five numbers"),
            ("bh,cos,0,0,1,2,3,4,5,6", "five numbers"),
            ("bh,cos,0,0,1,2,3,4,inf", "five numbers"),
            ("bh", "nine fields"),
        ] {
            let found = error(&format!("{COLUMNS}\n{row}\n"));
            assert!(found.starts_with("t:2") && found.contains(expected), "{found}");
        }
    }
}
