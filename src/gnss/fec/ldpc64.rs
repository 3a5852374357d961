//! Low-density parity-check codes of rate one half over GF(64): systematic encoder, decoder of soft symbols.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, 6.2.2 (codes of B-CNAV1; those of B2a and B2b are of the same kind): six bits
//! are an element, the most significant first; the field is that of x⁶ + x + 1. The decoder is belief
//! propagation over whole elements, whose checks are Walsh-Hadamard transforms (D. Declercq and M. Fossorier,
//! "Decoding algorithms for nonbinary LDPC codes over GF(q)", IEEE Trans. Comm. 55(4), 2007). It needs the
//! noise, which it takes from the second and fourth moments of the symbols. Limits: as those of
//! [`super::ldpc`].

use std::sync::OnceLock;

/// Elements of the field, and bits of one.
const ORDER: usize = 64;
const BITS: usize = 6;
/// The field's polynomial.
const POLYNOMIAL: usize = 0b100_0011;
/// Rounds before a word is given up.
const ROUNDS: u32 = 50;
/// Least probability, so that no element is ruled out by rounding.
const LEAST: f32 = 1e-9;
/// Largest logarithm of a ratio of likelihoods: that of symbols without noise.
const SUREST: f32 = 30.0;

/// Probabilities of the elements.
type Belief = [f32; ORDER];

/// A code.
#[derive(Clone, Debug)]
pub struct Ldpc64 {
    /// Position and factor of the elements whose sum is zero, check after check.
    checks: Vec<Vec<(usize, u8)>>,
    /// Checks of each element, each with the element's position in it.
    edges: Vec<Vec<(usize, usize)>>,
    /// Information elements, and as many of parity.
    half: usize,
    /// Factors of the information elements for each parity element.
    generator: Vec<Vec<u8>>,
}

/// Products of all pairs of elements.
fn products() -> &'static [[u8; ORDER]; ORDER] {
    static TABLE: OnceLock<[[u8; ORDER]; ORDER]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let polynomial = planted!("gnss.fec.field64", POLYNOMIAL, 0b110_0001);
        let product = |a: usize, b: usize| {
            (0..BITS).rev().fold(0, |sum, bit| {
                let doubled = sum << 1;
                let reduced = if doubled >= ORDER { doubled ^ polynomial } else { doubled };
                reduced ^ if b >> bit & 1 == 1 { a } else { 0 }
            })
        };
        std::array::from_fn(|a| std::array::from_fn(|b| product(a, b) as u8))
    })
}

/// Multiplies two elements of GF(64).
pub fn product(a: u8, b: u8) -> u8 {
    products()[usize::from(a) % ORDER][usize::from(b) % ORDER]
}

/// The element whose product with another is one; zero has none.
fn inverse(element: u8) -> u8 {
    (1..ORDER as u8).find(|other| product(element, *other) == 1).unwrap_or(0)
}

impl Ldpc64 {
    /// The code of `half` information elements, each of whose checks has four elements: packed as an octet of
    /// the position and one of the factor for each.
    pub fn packed(half: usize, packed: &[u8]) -> Self {
        let pairs: Vec<(usize, u8)> =
            packed.chunks_exact(2).filter_map(|pair| Some((usize::from(*pair.first()?), *pair.last()?))).collect();
        let checks: Vec<Vec<(usize, u8)>> = pairs.chunks_exact(4).map(<[_]>::to_vec).collect();
        let mut edges = vec![Vec::new(); 2 * half];
        for (check, row) in checks.iter().enumerate() {
            for (edge, (place, _)) in row.iter().enumerate() {
                edges.iter_mut().skip(*place).take(1).for_each(|own: &mut Vec<(usize, usize)>| own.push((check, edge)));
            }
        }
        Self { generator: generator(&checks, half), checks, edges, half }
    }

    /// Position and factor of the elements whose sum is zero, check after check.
    pub fn checks(&self) -> &[Vec<(usize, u8)>] {
        &self.checks
    }

    /// Encodes information bits to the bits of a code word.
    pub fn encode(&self, information: &[bool]) -> Vec<bool> {
        let own: Vec<u8> = elements(information).take(self.half).collect();
        let parity = self.generator.iter().map(|row| {
            let terms = row.iter().zip(&own).map(|(factor, element)| product(*factor, *element));
            terms.fold(0, |sum, term| sum ^ term)
        });
        let parity = parity.flat_map(|element| (0..BITS).rev().map(move |bit| element >> bit & 1 == 1));
        information.iter().copied().chain(parity).collect()
    }

    /// Decodes soft symbols to information bits; `None` if no code word is found. Symbols are positive for a
    /// logical 0, and their size is their reliability.
    pub fn decode(&self, soft: &[f32]) -> Option<Vec<bool>> {
        if soft.len() != 2 * self.half * BITS {
            return None;
        }
        let ratios = likelihood_ratios(soft);
        let priors: Vec<Belief> = ratios.chunks_exact(BITS).map(prior).collect();
        let mut said: Vec<Vec<Belief>> = self.checks.iter().map(|row| vec![[1.0; ORDER]; row.len()]).collect();
        for _ in 0..=ROUNDS {
            let word: Vec<u8> =
                (0..).zip(&priors).map(|(at, prior)| likeliest(&self.belief(at, prior, &said, None))).collect();
            if self.holds(&word) {
                let own = word.iter().take(self.half);
                let bits = own.flat_map(|element| (0..BITS).rev().map(move |bit| element >> bit & 1 == 1));
                return Some(bits.collect());
            }
            for (check, row) in self.checks.iter().enumerate() {
                let others = row.iter().map(|(place, factor)| {
                    let prior = priors.get(*place).unwrap_or(&[1.0; ORDER]);
                    (self.belief(*place, prior, &said, Some(check)), *factor)
                });
                let now = answers(&others.collect::<Vec<_>>());
                said.iter_mut().skip(check).take(1).for_each(|said| said.clone_from(&now));
            }
        }
        None
    }

    /// Belief about an element from its symbols and the messages of its checks, with one check left out.
    fn belief(&self, place: usize, prior: &Belief, said: &[Vec<Belief>], without: Option<usize>) -> Belief {
        let mut belief = *prior;
        let edges = self.edges.get(place).into_iter().flatten().filter(|(check, _)| Some(*check) != without);
        for said in edges.filter_map(|(check, edge)| said.get(*check)?.get(*edge)) {
            belief.iter_mut().zip(said).for_each(|(value, factor)| *value *= factor);
        }
        normalise(&mut belief);
        belief
    }

    /// True if the elements fulfil all checks.
    fn holds(&self, word: &[u8]) -> bool {
        let term = |(place, factor): &(usize, u8)| word.get(*place).map_or(0, |element| product(*factor, *element));
        self.checks.iter().all(|row| row.iter().map(term).fold(0, |sum, term| sum ^ term) == 0)
    }
}

/// The elements of bits, six each.
fn elements(bits: &[bool]) -> impl Iterator<Item = u8> {
    bits.chunks_exact(BITS).map(|six| six.iter().fold(0, |all, &bit| all << 1 | u8::from(bit)))
}

/// Logarithms of how much likelier a logical 0 is, of symbols of one amplitude in noise, both unknown: for an
/// amplitude a and a variance n the mean square is a² + n, the mean fourth power a⁴ + 6 a² n + 3 n².
fn likelihood_ratios(soft: &[f32]) -> Vec<f32> {
    let count = soft.len().max(1) as f64;
    let mean = |power: i32| soft.iter().map(|value| f64::from(*value).powi(power)).sum::<f64>() / count;
    let (square, fourth) = (mean(2), mean(4));
    // Of noise alone the difference is nothing but scatter; then any small amplitude does.
    let signal = (0.5 * (3.0 * square * square - fourth)).max(0.01 * square * square).sqrt().min(square);
    let noise = (square - signal).max(1e-3 * square).max(f64::MIN_POSITIVE);
    let gain = (2.0 * signal.sqrt() / noise) as f32;
    soft.iter().map(|value| (gain * value).clamp(-SUREST, SUREST)).collect()
}

/// Probabilities of an element by the ratios of its bits.
fn prior(ratios: &[f32]) -> Belief {
    let mut belief = std::array::from_fn(|element| {
        let bits = ratios.iter().rev().enumerate();
        let sum: f32 = bits.map(|(bit, ratio)| if element >> bit & 1 == 1 { -0.5 * ratio } else { 0.5 * ratio }).sum();
        let most: f32 = ratios.iter().map(|ratio| 0.5 * ratio.abs()).sum();
        libm::expf(sum - most)
    });
    normalise(&mut belief);
    belief
}

/// Brings the sum to one, and no element below the least.
fn normalise(belief: &mut Belief) {
    let sum: f32 = belief.iter().sum();
    belief.iter_mut().for_each(|value| *value = (*value / sum.max(f32::MIN_POSITIVE)).max(LEAST));
}

fn likeliest(belief: &Belief) -> u8 {
    let best = belief.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    best.map_or(0, |(element, _)| element as u8)
}

/// Messages of a check to each of its elements, computed from the beliefs about the others. Each belief has
/// its factor.
fn answers(row: &[(Belief, u8)]) -> Vec<Belief> {
    let transformed: Vec<Belief> = row
        .iter()
        .map(|(belief, factor)| {
            // Of the term, which is the element times its factor.
            let mut term = [0.0; ORDER];
            for (element, value) in (0..).zip(belief) {
                term[usize::from(product(*factor, element))] = *value;
            }
            transform(&mut term);
            term
        })
        .collect();
    let of = |(edge, (_, factor)): (usize, &(Belief, u8))| {
        let mut sum = [1.0; ORDER];
        for (_, other) in transformed.iter().enumerate().filter(|(other, _)| *other != edge) {
            sum.iter_mut().zip(other).for_each(|(value, other)| *value *= other);
        }
        transform(&mut sum);
        let mut own = std::array::from_fn(|element| sum[usize::from(product(*factor, element as u8))].max(0.0));
        normalise(&mut own);
        own
    };
    row.iter().enumerate().map(of).collect()
}

/// Walsh and Hadamard's transform, its own inverse but for a factor.
fn transform(values: &mut Belief) {
    let mut half = 1;
    while half < ORDER {
        for block in values.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for (low, high) in low.iter_mut().zip(high) {
                (*low, *high) = (*low + *high, *low - *high);
            }
        }
        half *= 2;
    }
}

/// The parity elements as sums of information elements: the checks, solved for them by elimination.
fn generator(checks: &[Vec<(usize, u8)>], half: usize) -> Vec<Vec<u8>> {
    // Each row: its parity elements, then its information elements.
    let mut rows: Vec<Vec<u8>> = checks
        .iter()
        .map(|row| {
            let mut own = vec![0; 2 * half];
            for &(place, factor) in row {
                let to = if place < half { half + place } else { place - half };
                own.iter_mut().skip(to).take(1).for_each(|slot| *slot ^= factor);
            }
            own
        })
        .collect();
    for column in 0..half.min(rows.len()) {
        // The parity half of every code here can be inverted, which a test holds.
        let Some(pivot) = (column..rows.len()).find(|&index| rows[index][column] != 0) else { continue };
        rows.swap(column, pivot);
        let scale = inverse(rows[column][column]);
        rows[column].iter_mut().for_each(|element| *element = product(scale, *element));
        let own = rows[column].clone();
        for (index, row) in rows.iter_mut().enumerate() {
            let factor = row[column];
            if index != column && factor != 0 {
                row.iter_mut().zip(&own).for_each(|(element, own)| *element ^= product(factor, *own));
            }
        }
    }
    rows.into_iter().map(|row| row[half..].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_is_one_and_two_generates_it() {
        for a in 1..64_u8 {
            assert_eq!(product(a, inverse(a)), 1);
            for b in 0..64 {
                assert_eq!(product(a, b), product(b, a));
                assert_eq!(product(a, b ^ 5), product(a, b) ^ product(a, 5));
            }
        }
        let mut power = 1_u8;
        let powers: std::collections::BTreeSet<u8> = (0..63)
            .map(|_| {
                power = product(power, 2);
                power
            })
            .collect();
        // x⁶ = x + 1.
        assert_eq!((powers.len(), product(32, 2)), (63, 3));
    }

    #[test]
    fn the_transform_of_a_product_is_that_of_the_sum_of_two_elements() {
        let (one, other): (Belief, Belief) =
            (std::array::from_fn(|k| (k * k % 7) as f32), std::array::from_fn(|k| (k * 3 % 11) as f32));
        let mut both = [one, other];
        both.iter_mut().for_each(transform);
        let mut sum: Belief = std::array::from_fn(|k| both[0][k] * both[1][k]);
        transform(&mut sum);
        for element in 0..ORDER {
            let direct: f32 = (0..ORDER).map(|k| one[k] * other[k ^ element]).sum();
            // Sums of small whole numbers are exact.
            assert_eq!(sum[element] / ORDER as f32, direct);
        }
    }

    #[test]
    fn amplitude_and_noise_are_those_of_the_moments() {
        // Symbols of 3 ± 1 and −3 ± 1 in turn: 9 + 1; fourth powers 256 and 16, so that 3·10² − 136 =
        // 2·9.06².
        let soft = [4.0, 2.0, -4.0, -2.0];
        let ratios = likelihood_ratios(&soft);
        let signal = (0.5_f64 * (300.0 - 136.0)).sqrt();
        let gain = 2.0 * signal.sqrt() / (10.0 - signal);
        assert!((f64::from(ratios[0]) - 4.0 * gain).abs() < 1e-4, "{ratios:?}");
        assert!(likelihood_ratios(&[0.0; 8]).iter().all(|ratio| *ratio == 0.0));
    }
}
