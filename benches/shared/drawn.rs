//! Random numbers of a bench, and times and positions that it draws with them.

/// Random numbers (Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014).
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number between two others.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// One of these, which is taken away.
    pub fn take<T>(&mut self, all: &mut Vec<T>) -> Option<T> {
        let at = (self.unit() * all.len() as f64) as usize;
        (at < all.len()).then(|| all.remove(at))
    }
}

/// A time and a position.
#[derive(Clone, Debug)]
pub struct Start {
    /// GPS time as a scene has it.
    pub time: String,
    /// Latitude and longitude.
    pub place_deg: [f64; 2],
}

impl Start {
    /// A time of 2010-07-01 and a position up to 75 degrees from the equator, evenly over the surface.
    pub fn anywhere(random: &mut Random) -> Self {
        let time = time("2010-07-01", random.between(2.0 * 3600.0, 21.0 * 3600.0));
        let sine = random.between(-0.966, 0.966);
        let place_deg = [libm::asin(sine).to_degrees(), random.between(-180.0, 180.0)].map(hundredths);
        Self { time, place_deg }
    }

    /// A time of 2020-11-29 and a position in the Western Mediterranean, for which the embedded messages of
    /// GPS and Galileo were recorded.
    pub fn near_cartagena(random: &mut Random) -> Self {
        let time = time("2020-11-29", random.between(11.5 * 3600.0, 15.0 * 3600.0));
        let place_deg = [random.between(33.0, 42.0), random.between(-6.0, 4.0)].map(hundredths);
        Self { time, place_deg }
    }
}

fn time(day: &str, second: f64) -> String {
    let second = second as u64;
    format!("{day}T{:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60)
}

fn hundredths(deg: f64) -> f64 {
    (100.0 * deg).round() / 100.0
}
