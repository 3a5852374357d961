//! A CSV table by named columns, and small ways to damage it.

use std::path::Path;

/// Header and rows.
#[derive(Clone)]
pub struct Table {
    header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn read(path: &Path) -> Self {
        let mut reader = csv::Reader::from_path(path).unwrap();
        let of = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
        let header = of(reader.headers().unwrap());
        Self { header, rows: reader.records().map(|row| of(&row.unwrap())).collect() }
    }

    pub fn write(&self, path: &Path) {
        let mut writer = csv::Writer::from_path(path).unwrap();
        writer.write_record(&self.header).unwrap();
        self.rows.iter().for_each(|row| writer.write_record(row).unwrap());
        writer.flush().unwrap();
    }

    pub fn column(&self, name: &str) -> usize {
        self.header.iter().position(|column| column == name).unwrap_or_else(|| panic!("no column {name}"))
    }

    pub fn get(&self, row: usize, name: &str) -> f64 {
        self.rows[row][self.column(name)].parse().unwrap()
    }

    pub fn text(&self, row: usize, name: &str) -> &str {
        &self.rows[row][self.column(name)]
    }

    pub fn put(&mut self, row: usize, name: &str, text: impl ToString) {
        let column = self.column(name);
        self.rows[row][column] = text.to_string();
    }

    /// Replaces a number of every row by a function of the row's index and its value.
    pub fn map(&mut self, name: &str, of: impl Fn(usize, f64) -> f64) {
        self.map_where(name, |_, _| true, of);
    }

    /// Replaces a number of the chosen rows by a function of the row's index and its value.
    pub fn map_where(&mut self, name: &str, chosen: impl Fn(&Self, usize) -> bool, of: impl Fn(usize, f64) -> f64) {
        for row in 0..self.rows.len() {
            if chosen(self, row) {
                let value = of(row, self.get(row, name));
                self.put(row, name, value);
            }
        }
    }

    /// Keeps the rows chosen.
    pub fn keep(&mut self, chosen: impl Fn(&Self, usize) -> bool) {
        let kept: Vec<bool> = (0..self.rows.len()).map(|row| chosen(self, row)).collect();
        let mut kept = kept.into_iter();
        self.rows.retain(|_| kept.next().unwrap());
    }

    /// Indices of a satellite's rows.
    pub fn of(&self, sv: &str) -> Vec<usize> {
        (0..self.rows.len()).filter(|row| self.text(*row, "sv") == sv).collect()
    }

    /// Exchanges two columns' values in the rows chosen.
    pub fn swap_columns(&mut self, a: &str, b: &str, chosen: impl Fn(usize) -> bool) {
        let (a, b) = (self.column(a), self.column(b));
        self.rows.iter_mut().enumerate().filter(|(row, _)| chosen(*row)).for_each(|(_, row)| row.swap(a, b));
    }

    /// Exchanges the values of two satellites at the samples that both have, as many of them as said.
    pub fn swap_satellites(&mut self, a: &str, b: &str, most: usize) {
        let (sv, sample) = (self.column("sv"), self.column("sample"));
        let of = |table: &Self, sv: &str| table.of(sv);
        let (of_a, of_b) = (of(self, a), of(self, b));
        let mut left = most;
        for row in of_a {
            let at = self.rows[row][sample].clone();
            let Some(other) = of_b.iter().copied().find(|other| self.rows[*other][sample] == at) else { continue };
            if left == 0 {
                return;
            }
            left -= 1;
            self.rows.swap(row, other);
            let name = self.rows[row][sv].clone();
            self.rows[row][sv] = std::mem::replace(&mut self.rows[other][sv], name);
        }
    }
}

/// Normal numbers: a congruential generator (Knuth's multiplier) and the sum of twelve uniforms.
pub fn normal(index: usize, stream: u64) -> f64 {
    let mut state = (index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03);
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}
