//! Block interleavers: written column by column, sent row by row.

/// A rectangle of symbols.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interleaver {
    /// Symbols of a row.
    pub columns: usize,
    /// Symbols of a column.
    pub rows: usize,
}

impl Interleaver {
    /// Symbols of a block.
    pub const fn symbols(self) -> usize {
        self.columns * self.rows
    }

    /// Reorders coded symbols for transmission. Symbols beyond a whole block are dropped.
    pub fn interleave<T: Copy>(self, coded: &[T]) -> Vec<T> {
        let places = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| column * self.rows + row));
        let places = places.map(|place| planted!("gnss.fec.interleaver", place, place ^ 1));
        places.filter_map(|place| coded.get(place).copied()).collect()
    }

    /// Restores the coded order of received symbols.
    pub fn deinterleave<T: Copy>(self, sent: &[T]) -> Vec<T> {
        let places = (0..self.columns).flat_map(|column| (0..self.rows).map(move |row| row * self.columns + column));
        places.filter_map(|place| sent.get(place).copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_sent_of_what_was_written_in_columns_and_come_back() {
        let small = Interleaver { columns: 3, rows: 2 };
        assert_eq!(small.interleave(&[0, 1, 2, 3, 4, 5]), [0, 2, 4, 1, 3, 5]);
        let page = Interleaver { columns: 30, rows: 8 };
        let coded: Vec<usize> = (0..page.symbols()).collect();
        assert_eq!(page.deinterleave(&page.interleave(&coded)), coded);
    }
}
