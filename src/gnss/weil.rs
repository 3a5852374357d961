//! Weil codes: sums of a Legendre sequence and the same sequence some chips later.
//!
//! Source: IS-GPS-800J, 3.2.2.1.1 (L1C, length 10 223); BDS-SIS-ICD-B1C 1.0, 5.2 (10 243 and 3607). For a
//! prime p the Legendre sequence is one at the residues of squares, and zero at 0 and elsewhere.

/// The Legendre sequence of a prime.
#[derive(Clone, Debug)]
pub struct Legendre(Vec<bool>);

impl Legendre {
    /// Computes the Legendre sequence of `prime`.
    pub fn new(prime: u32) -> Self {
        let mut ones = vec![false; prime as usize];
        for root in 1..u64::from(prime) {
            let square = (root * root % u64::from(prime)) as usize;
            ones.iter_mut().skip(square).take(1).for_each(|one| *one = true);
        }
        Self(ones)
    }

    /// Weil code with a second sequence `later` chips later, from chip `first` on, repeated without end.
    pub fn weil(&self, later: u16, first: u16) -> impl Iterator<Item = bool> {
        let from = |skipped: usize| self.0.iter().cycle().skip(skipped);
        let first = usize::from(first);
        from(first).zip(from(first + usize::from(later))).map(|(one, other)| one ^ other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_one_is_as_counted_by_hand() {
        // Squares modulo 7 are 1, 4 and 2.
        let seven = Legendre::new(7);
        assert_eq!(seven.0, [false, true, true, false, true, false, false]);
        // Added to itself a chip later: 1, 0, 1, 1, 1, 0, 0.
        let expected = [true, false, true, true, true, false, false];
        assert_eq!(seven.weil(1, 0).take(7).collect::<Vec<_>>(), expected);
        assert_eq!(seven.weil(1, 5).take(3).collect::<Vec<_>>(), [false, false, true]);
    }
}
