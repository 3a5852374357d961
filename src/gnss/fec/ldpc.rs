//! Binary low-density parity-check codes of rate one half: systematic encoder, decoder of soft symbols.
//!
//! Source: IS-GPS-800J, 3.2.3.4 and 6.2 (codes of CNAV-2); the decoder is the normalised min-sum form of
//! belief propagation, check after check (J. Chen and M. Fossorier, "Near optimum universal belief
//! propagation based decoding of LDPC codes", IEEE Trans. Comm. 50(3), 2002; D. Hocevar, "A reduced
//! complexity decoder architecture via layered decoding of LDPC codes", SiPS 2004). It needs no estimate of
//! the noise. A code word is the information followed by as many parity bits; these are solved for once, as
//! documents that print the checks alone have them. Limits: what does not fulfil all checks after some rounds
//! counts as not decoded.

/// Rounds over all checks before a word is given up.
const ROUNDS: u32 = 50;
/// Factor on the smallest reliability that a check passes on; it corrects the overestimate of min-sum.
const NORMALISATION: f32 = 0.78;

/// A code.
#[derive(Clone, Debug)]
pub struct Ldpc {
    /// Positions of the bits whose sum is even, check after check.
    checks: Vec<Vec<usize>>,
    /// Information bits, and as many parity bits.
    half: usize,
    /// Information bits whose sum is each parity bit, 64 bits to a word.
    generator: Vec<Vec<u64>>,
}

impl Ldpc {
    /// Creates the code of `half` information bits from packed checks. Each one in the matrix has two octets,
    /// row after row, the more significant first. They hold the column, plus 2¹⁵ where a row begins.
    pub fn packed(half: usize, packed: &[u8]) -> Self {
        let mut checks: Vec<Vec<usize>> = Vec::with_capacity(half);
        for pair in packed.chunks_exact(2) {
            let word = pair.iter().fold(0, |word, &octet| word << 8 | usize::from(octet));
            if word >> 15 == 1 {
                checks.push(Vec::new());
            }
            if let Some(row) = checks.last_mut() {
                row.push(word & 0x7FFF);
            }
        }
        Self { generator: generator(&checks, half), checks, half }
    }

    /// Positions of the bits whose sum is even, check after check.
    pub fn checks(&self) -> &[Vec<usize>] {
        &self.checks
    }

    /// Encodes information bits to a code word.
    pub fn encode(&self, information: &[bool]) -> Vec<bool> {
        let count = planted!("gnss.fec.ldpc", self.half, self.half - 1);
        let words = packed_bits(information.iter().copied().take(count), self.half);
        let parity = self.generator.iter().map(|row| {
            let sum = row.iter().zip(&words).fold(0, |sum, (a, b)| sum ^ a & b);
            sum.count_ones() % 2 == 1
        });
        information.iter().copied().chain(parity).collect()
    }

    /// Decodes soft symbols to information bits; `None` if no code word is found. Symbols are positive for a
    /// logical 0, and their size is their reliability.
    pub fn decode(&self, soft: &[f32]) -> Option<Vec<bool>> {
        if soft.len() != 2 * self.half {
            return None;
        }
        let mut sure = soft.to_vec();
        let mut said: Vec<Vec<f32>> = self.checks.iter().map(|row| vec![0.0; row.len()]).collect();
        for _ in 0..ROUNDS {
            for (row, said) in self.checks.iter().zip(&mut said) {
                update(row, said, &mut sure);
            }
            if self.holds(&sure) {
                sure.truncate(self.half);
                return Some(sure.iter().map(|value| *value < 0.0).collect());
            }
        }
        None
    }

    /// True if the signs of the symbols fulfil all checks.
    fn holds(&self, sure: &[f32]) -> bool {
        let is_one = |place: &&usize| sure.get(**place).is_some_and(|value| *value < 0.0);
        self.checks.iter().all(|row| row.iter().filter(is_one).count() % 2 == 0)
    }
}

/// Updates one check: its previous message is subtracted from its bits, and its new message added.
fn update(row: &[usize], said: &mut [f32], sure: &mut [f32]) {
    let (mut least, mut next, mut at, mut odd) = (f32::INFINITY, f32::INFINITY, 0, false);
    for (edge, (&place, said)) in row.iter().zip(said.iter()).enumerate() {
        let Some(value) = sure.get_mut(place) else { continue };
        *value -= *said;
        odd ^= *value < 0.0;
        let size = value.abs();
        if size < least {
            (least, next, at) = (size, least, edge);
        } else {
            next = next.min(size);
        }
    }
    for (edge, (&place, said)) in row.iter().zip(said).enumerate() {
        let Some(value) = sure.get_mut(place) else { continue };
        let size = NORMALISATION * if edge == at { next } else { least };
        *said = if odd ^ (*value < 0.0) { -size } else { size };
        *value += *said;
    }
}

/// Bits in words of 64, the first the lowest.
fn packed_bits(bits: impl Iterator<Item = bool>, count: usize) -> Vec<u64> {
    let mut words = vec![0; count.div_ceil(64)];
    bits.enumerate().filter(|(_, bit)| *bit).for_each(|(place, _)| words[place / 64] |= 1 << (place % 64));
    words
}

/// The parity bits as sums of information bits: the checks, solved for them by elimination.
fn generator(checks: &[Vec<usize>], half: usize) -> Vec<Vec<u64>> {
    let words = half.div_ceil(64);
    // Each row: its parity bits, then its information bits.
    let mut rows: Vec<Vec<u64>> = checks
        .iter()
        .map(|row| {
            let mut bits = vec![0; 2 * words];
            for &place in row {
                let (first, at) = if place < half { (words, place) } else { (0, place - half) };
                bits[first + at / 64] ^= 1_u64 << (at % 64);
            }
            bits
        })
        .collect();
    for column in 0..half.min(rows.len()) {
        let is_one = |row: &[u64]| row[column / 64] >> (column % 64) & 1 == 1;
        // The parity half of every code here can be inverted, which a test holds.
        let Some(pivot) = (column..rows.len()).find(|&index| is_one(&rows[index])) else { continue };
        rows.swap(column, pivot);
        let own = rows[column].clone();
        for (index, row) in rows.iter_mut().enumerate() {
            if index != column && is_one(row) {
                row.iter_mut().zip(&own).for_each(|(word, own)| *word ^= own);
            }
        }
    }
    rows.into_iter().map(|row| row[words..].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The (7,4)-like toy of rate one half: three information bits, each parity bit the sum of two of them.
    fn toy() -> Ldpc {
        let rows: [&[u16]; 3] = [&[0, 1, 3], &[1, 2, 4], &[0, 2, 5]];
        let packed = rows.iter().flat_map(|row| {
            row.iter().enumerate().flat_map(|(at, place)| (place | if at == 0 { 1 << 15 } else { 0 }).to_be_bytes())
        });
        Ldpc::packed(3, &packed.collect::<Vec<u8>>())
    }

    #[test]
    fn parity_bits_are_the_sums_that_the_checks_ask_for() {
        let code = toy();
        assert_eq!(code.checks(), [vec![0, 1, 3], vec![1, 2, 4], vec![0, 2, 5]]);
        for word in 0..8_u8 {
            let [a, b, c] = [0, 1, 2].map(|place| word >> place & 1 == 1);
            assert_eq!(code.encode(&[a, b, c]), [a, b, c, a ^ b, b ^ c, a ^ c]);
        }
    }

    #[test]
    fn the_decoder_finds_the_most_likely_word_where_one_symbol_is_wrong() {
        let code = toy();
        for word in 0..8_u8 {
            let information = [0, 1, 2].map(|place| word >> place & 1 == 1);
            let sent: Vec<f32> = code.encode(&information).iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
            for wrong in 0..6 {
                let mut soft = sent.clone();
                soft[wrong] *= -0.4;
                // By trying all eight words.
                let likely = |candidate: u8| -> f32 {
                    let bits = code.encode(&[0, 1, 2].map(|place| candidate >> place & 1 == 1));
                    bits.iter().zip(&soft).map(|(&one, value)| if one { -value } else { *value }).sum()
                };
                let best = (0..8).max_by(|a, b| likely(*a).total_cmp(&likely(*b))).unwrap();
                assert_eq!(best, word);
                assert_eq!(code.decode(&soft).unwrap(), information, "{word} {wrong}");
            }
        }
        assert_eq!(code.decode(&[1.0; 5]), None);
    }
}
