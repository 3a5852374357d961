//! Random numbers as pure functions of (seed, purpose, index).
//!
//! Each process has a stream of its own, named in words, so that adding a process changes no other. A word is
//! SplitMix64's finaliser (Steele, Lea, Flood 2014) of the stream's key and the index; normals are Box and
//! Muller's. Limits: a stream of 2^63 pairs; meant for thousands of numbers a second, not for every sample.

pub mod markov;

use gnss::satellite::{Sv, System};

/// SplitMix64's increment, the golden ratio in 64 bits.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's finaliser, a bijection of 64-bit words.
pub fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Seed of what is random about one receiver in a scene with `seed`: that of its station's name, or the
/// scene's without stations.
pub fn seed_of(station: Option<&str>, seed: u64) -> u64 {
    station.map_or(seed, |name| Stream::new(seed, "station").named(name).word(0))
}

/// Stream of the random numbers of one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stream {
    key: u64,
}

impl Stream {
    /// Creates the stream of `purpose` in a scene with `seed`.
    pub fn new(seed: u64, purpose: &str) -> Self {
        Self { key: mix(seed ^ GOLDEN) }.named(purpose)
    }

    /// Derives the stream of a part that has a name.
    pub fn named(self, name: &str) -> Self {
        Self { key: name.bytes().fold(self.key, |key, byte| mix(key ^ u64::from(byte)).wrapping_add(GOLDEN)) }
    }

    /// Derives the stream of a part that has a number.
    pub fn part(self, index: u64) -> Self {
        Self { key: mix(self.key ^ mix(index.wrapping_add(GOLDEN))) }
    }

    /// Derives the stream of a satellite.
    pub fn satellite(self, sv: Sv) -> Self {
        // Numbers of GPS satellites are their own; those of other systems follow in blocks of 256.
        let block = match sv.system {
            System::Gps => 0,
            System::Glonass => 1,
            System::Galileo => 2,
            System::BeiDou => 3,
            System::Qzss => 4,
            System::Navic => 5,
            System::Sbas => 6,
        };
        self.part(block << 8 | u64::from(sv.number))
    }

    /// Word number `index`.
    pub fn word(self, index: u64) -> u64 {
        mix(self.key.wrapping_add(index.wrapping_mul(GOLDEN)))
    }

    /// Returns two independent standard normals, pair number `index`.
    pub fn normals(self, index: u64) -> (f64, f64) {
        // Open at zero, so that the logarithm is finite: the largest normal is 8.6.
        let unit = |word: u64| ((word >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0;
        let radius = (-2.0 * libm::log(unit(self.word(2 * index)))).sqrt();
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * unit(self.word(2 * index + 1)));
        (radius * cos, radius * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_have_the_moments_of_normals_and_streams_are_not_correlated() {
        const N: u64 = 200_000;
        let (a, b) = (Stream::new(1, "clock"), Stream::new(1, "fading"));
        let mut sums = [0.0; 5];
        let mut cross = 0.0;
        for index in 0..N {
            let (x, y) = a.normals(index);
            for value in [x, y] {
                (1..=4).for_each(|power| sums[power as usize] += value.powi(power));
            }
            cross += x * b.normals(index).0 + x * y + x * a.normals(index + 1).0;
        }
        let n = 2.0 * N as f64;
        // Five sigma of each mean: variances of x, x², x³, x⁴ are 1, 2, 15, 96.
        for (power, (expected, variance)) in
            [(0.0, 1.0), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0_f64)].into_iter().enumerate()
        {
            assert!((sums[power + 1] / n - expected).abs() < 5.0 * (variance / n).sqrt(), "moment {}", power + 1);
        }
        // Three sums of N products of unit variance.
        assert!(cross.abs() < 5.0 * (3.0 * N as f64).sqrt(), "{cross}");
    }

    #[test]
    fn a_stream_depends_on_its_seed_its_name_and_its_part() {
        let word = |seed, name: &str, part| Stream::new(seed, name).part(part).word(0);
        let all = [word(1, "a", 0), word(2, "a", 0), word(1, "b", 0), word(1, "a", 1), word(1, "aa", 0)];
        assert!((0..all.len()).all(|i| (0..i).all(|j| all[i] != all[j])));
        assert_eq!(word(1, "a", 0), all[0]);
    }

    #[test]
    fn satellites_of_all_systems_have_streams_of_their_own() {
        let stream = Stream::new(1, "a");
        let mut words: Vec<u64> = System::LETTERS
            .into_iter()
            .flat_map(|(system, _)| (0..=u8::MAX).map(move |number| stream.satellite(Sv { system, number }).word(0)))
            .collect();
        assert_eq!(stream.satellite(Sv::gps(7)), stream.part(7));
        words.sort_unstable();
        assert!(words.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
