//! Damage to a text, drawn from a seed.

/// A counter-based generator (splitmix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    pub fn pick<'a>(&mut self, words: &[&'a str]) -> &'a str {
        words[self.below(words.len())]
    }
}

/// Kinds of damage, from a byte to a block.
pub const CLASSES: [&str; 16] = [
    "cut",
    "bit flipped",
    "byte replaced",
    "byte deleted",
    "byte inserted",
    "line deleted",
    "line doubled",
    "lines swapped",
    "digit changed",
    "field blanked",
    "field absurd",
    "exponent changed",
    "satellite changed",
    "epoch changed",
    "run of bytes overwritten",
    "header damaged",
];

/// A text with damage of one class.
pub fn damaged(base: &[u8], class: usize, seed: u64) -> Vec<u8> {
    let mut random = Random::new(seed.wrapping_mul(0x1_0001).wrapping_add(class as u64));
    let mut bytes = base.to_vec();
    let at = random.below(bytes.len());
    let head = find(base, b"END OF HEADER").unwrap_or(0);
    match class {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.below(8),
        2 => bytes[at] = b' ' + random.below(95) as u8,
        3 => drop(bytes.remove(at)),
        4 => bytes.insert(at, b' ' + random.below(95) as u8),
        5..=7 => bytes = lines(&bytes, class, &mut random),
        8 => {
            let digits: Vec<usize> = (head..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect();
            bytes[digits[random.below(digits.len())]] = b'0' + random.below(10) as u8;
        }
        9 | 10 => {
            let word =
                random.pick(&["NaN", "Inf", "-1.0D+999", "1e308", "**************", "0x1F", "1.2.3", "--1", "1D"]);
            let word = if class == 9 { "" } else { word };
            let fields = fields(base, head);
            let from = fields[random.below(fields.len())];
            bytes.splice(from..from + 19, format!("{word:>19}").into_bytes());
        }
        11 => {
            let letters: Vec<usize> = (head..bytes.len() - 3)
                .filter(|i| b"Dde".contains(&bytes[*i]) && b"+-".contains(&bytes[*i + 1]))
                .collect();
            let letter = letters[random.below(letters.len())];
            let word = random.pick(&["D+38", "D-99", "E+02", "+-+-", "DD02", "  02", "D 02"]);
            bytes.splice(letter..letter + 4, word.bytes());
        }
        12 | 13 => {
            let titles = titles(base, head);
            let title = titles[random.below(titles.len())];
            let numbered = usize::from(bytes[title].is_ascii_alphabetic());
            if class == 12 {
                let word = random.pick(&["00", "99", "33", "-1", "  ", "x7", "32"]);
                bytes.splice(title + numbered..title + numbered + 2, word.bytes());
            } else {
                let place = title + numbered + 3 + random.below(18);
                bytes[place] = b"0123456789-. x"[random.below(14)];
            }
        }
        14 => {
            let filler = [0, 0xff, b'\n', b'9', b' '][random.below(5)];
            let end = (at + 1 + random.below(200)).min(bytes.len());
            bytes[at..end].fill(filler);
        }
        _ => {
            let at = random.below(head + 13);
            let end = (at + 1 + random.below(20)).min(head + 13);
            let filler = b"x 9\n\0"[random.below(5)];
            bytes[at..end].fill(filler);
        }
    }
    bytes
}

fn lines(bytes: &[u8], class: usize, random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    let (one, other) = (random.below(lines.len()), random.below(lines.len()));
    match class {
        5 => drop(lines.remove(one)),
        6 => lines.insert(one, lines[one]),
        _ => lines.swap(one, other),
    }
    lines.concat()
}

pub fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|window| window == word)
}

/// Offsets of the numbers' fields of 19 columns.
fn fields(bytes: &[u8], head: usize) -> Vec<usize> {
    // A number of twelve digits ends four columns after its exponent's letter.
    let ends = (head..bytes.len() - 3).filter(|i| b"De".contains(&bytes[*i]) && b"+-".contains(&bytes[*i + 1]));
    ends.map(|letter| letter + 4 - 19).collect()
}

/// Offsets of the lines that name a satellite and an epoch.
fn titles(bytes: &[u8], head: usize) -> Vec<usize> {
    let starts = (head..bytes.len() - 4).filter(|i| bytes[*i] == b'\n').map(|i| i + 1);
    let named = |at: &usize| bytes[*at] == b'G' || (bytes[*at] != b'>' && bytes[at + 1].is_ascii_digit());
    starts.filter(named).collect()
}
