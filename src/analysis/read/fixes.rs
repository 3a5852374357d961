//! The receiver's fixes, spilled, with what is asked of all of them counted while they are read.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::JudgeError;
use crate::read::spill_store::{Cursor, Finder, SpillRow, Words};
use crate::read::table::Table;
use gnss::record::{Fix, IonosphereModel};

/// The fixes of a run in the order of their table.
#[derive(Debug)]
pub struct Fixes {
    table: Table<Row>,
    texts: Texts,
    /// Sample of the earliest one.
    earliest: Option<u64>,
    most_satellites: u32,
    models: Vec<IonosphereModel>,
}

/// The different texts of all fixes: few, as exclusions last.
#[derive(Debug, Default)]
struct Texts {
    all: Vec<String>,
    places: BTreeMap<String, u64>,
}

impl Texts {
    fn place(&mut self, text: &str) -> u64 {
        if let Some(place) = self.places.get(text) {
            return *place;
        }
        let place = self.all.len() as u64;
        self.all.push(text.to_owned());
        self.places.insert(text.to_owned(), place);
        place
    }

    fn at(&self, place: u64) -> String {
        usize::try_from(place).ok().and_then(|place| self.all.get(place)).cloned().unwrap_or_default()
    }
}

/// A fix without its texts, and their positions.
#[derive(Clone, Debug)]
struct Row {
    fix: Fix,
    excluded: u64,
    time_scale: u64,
}

const MODELS: [IonosphereModel; 7] = [
    IonosphereModel::None,
    IonosphereModel::Nominal,
    IonosphereModel::Broadcast,
    IonosphereModel::NequickG,
    IonosphereModel::Combined,
    IonosphereModel::Grid,
    IonosphereModel::Bdgim,
];

/// Index of a model in [`MODELS`]; a new model does not compile without an index.
fn place(model: IonosphereModel) -> u64 {
    match model {
        IonosphereModel::None => 0,
        IonosphereModel::Nominal => 1,
        IonosphereModel::Broadcast => 2,
        IonosphereModel::NequickG => 3,
        IonosphereModel::Combined => 4,
        IonosphereModel::Grid => 5,
        IonosphereModel::Bdgim => 6,
    }
}

/// A count that the file does not say.
const NOT_SAID: u64 = u64::MAX;

impl SpillRow<()> for Row {
    const WORDS: usize = 31;

    fn put(&self, words: &mut Vec<u64>) {
        let fix = &self.fix;
        words.extend([fix.sample, fix.gps_s.cast_unsigned(), fix.gps_fraction_s.to_bits()]);
        words.extend([fix.x_m, fix.y_m, fix.z_m, fix.vx_mps, fix.vy_mps, fix.vz_mps].map(f64::to_bits));
        words.extend([fix.clock_bias_s, fix.clock_drift].map(f64::to_bits));
        words.extend([fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m, fix.sigma_clock_m].map(f64::to_bits));
        words.extend([fix.correlation_en, fix.correlation_eu, fix.correlation_nu].map(f64::to_bits));
        words.extend([fix.gdop, fix.pdop, fix.hdop, fix.vdop, fix.tdop, fix.condition].map(f64::to_bits));
        words.extend([u64::from(fix.satellites), fix.chi_square.to_bits(), self.excluded, self.time_scale]);
        words.push(place(fix.ionosphere));
        words.extend([fix.ranges, fix.clocks].map(|count| count.map_or(NOT_SAID, u64::from)));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let count = |word: u64| u32::try_from(word).ok();
        let sample = words.word();
        let (gps_s, gps_fraction_s) = (words.word().cast_signed(), words.number());
        let [x_m, y_m, z_m, vx_mps, vy_mps, vz_mps] = std::array::from_fn(|_| words.number());
        let [clock_bias_s, clock_drift] = std::array::from_fn(|_| words.number());
        let [sigma_east_m, sigma_north_m, sigma_up_m, sigma_clock_m] = std::array::from_fn(|_| words.number());
        let [correlation_en, correlation_eu, correlation_nu] = std::array::from_fn(|_| words.number());
        let [gdop, pdop, hdop, vdop, tdop, condition] = std::array::from_fn(|_| words.number());
        let (satellites, chi_square) = (count(words.word()).unwrap_or(0), words.number());
        let (excluded, time_scale) = (words.word(), words.word());
        let model = usize::try_from(words.word()).ok().and_then(|place| MODELS.get(place).copied());
        let fix = Fix {
            sample,
            gps_s,
            gps_fraction_s,
            x_m,
            y_m,
            z_m,
            vx_mps,
            vy_mps,
            vz_mps,
            clock_bias_s,
            clock_drift,
            sigma_east_m,
            sigma_north_m,
            sigma_up_m,
            sigma_clock_m,
            correlation_en,
            correlation_eu,
            correlation_nu,
            gdop,
            pdop,
            hdop,
            vdop,
            tdop,
            condition,
            satellites,
            chi_square,
            excluded: String::new(),
            ionosphere: model.unwrap_or(IonosphereModel::None),
            ranges: count(words.word()),
            clocks: count(words.word()),
            time_scale: String::new(),
        };
        Self { fix, excluded, time_scale }
    }
}

impl Fixes {
    /// An empty list, which spills to a file in that directory.
    pub fn new(directory: &Path) -> Self {
        Self {
            table: Table::new(directory),
            texts: Texts::default(),
            earliest: None,
            most_satellites: 0,
            models: Vec::new(),
        }
    }

    /// Adds one.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn push(&mut self, fix: Fix) -> Result<(), JudgeError> {
        self.earliest = Some(self.earliest.map_or(fix.sample, |earliest| earliest.min(fix.sample)));
        self.most_satellites = self.most_satellites.max(fix.satellites);
        if !self.uses(fix.ionosphere) {
            self.models.push(fix.ionosphere);
        }
        let (excluded, time_scale) = (self.texts.place(&fix.excluded), self.texts.place(&fix.time_scale));
        let fix = Fix { excluded: String::new(), time_scale: String::new(), ..fix };
        self.table.push(Row { fix, excluded, time_scale })
    }

    fn whole(&self, row: Row) -> Fix {
        Fix { excluded: self.texts.at(row.excluded), time_scale: self.texts.at(row.time_scale), ..row.fix }
    }

    /// Number of fixes.
    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// Sample of the first one in the table.
    pub fn first_sample(&self) -> Option<u64> {
        self.table.first().map(|row| row.fix.sample)
    }

    /// Sample of the earliest one.
    pub fn earliest_sample(&self) -> Option<u64> {
        self.earliest
    }

    /// Largest number of satellites in a fix.
    pub fn most_satellites(&self) -> usize {
        self.most_satellites as usize
    }

    /// True if a fix was corrected by that model of the ionosphere.
    pub fn uses(&self, model: IonosphereModel) -> bool {
        self.models.contains(&model)
    }

    /// Shows each fix to `see`.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn each(&self, mut see: impl FnMut(Fix)) -> Result<(), JudgeError> {
        self.table.each(|row| see(self.whole(row)))
    }

    /// Values of `of` for each fix.
    ///
    /// # Errors
    ///
    /// Same as [`Self::each`].
    pub fn map<U>(&self, mut of: impl FnMut(Fix) -> U) -> Result<Vec<U>, JudgeError> {
        self.table.map(|row| of(self.whole(row)))
    }

    /// The fixes one after the other.
    pub fn cursor(&self) -> impl Iterator<Item = Result<Fix, JudgeError>> + '_ {
        self.table.cursor().map(|row| Ok(self.whole(row?)))
    }

    /// Fixes by their samples.
    ///
    /// # Errors
    /// Errors of [`Table::finder`].
    pub fn finder(&self) -> Result<FixFinder<'_>, JudgeError> {
        Ok(FixFinder { fixes: self, found: self.table.finder()? })
    }

    /// The fixes in the order of their samples, of several of a sample the last.
    ///
    /// # Errors
    /// Errors of [`Self::each`], of a table whose samples do not ascend: it is read here.
    pub fn in_order(&self) -> Result<InOrder<'_>, JudgeError> {
        if self.table.ascends() {
            return Ok(InOrder { fixes: self, cursor: Some(self.table.cursor()), sorted: Vec::new().into_iter() });
        }
        let mut sorted: BTreeMap<u64, Fix> = BTreeMap::new();
        self.each(|fix| {
            sorted.insert(fix.sample, fix);
        })?;
        Ok(InOrder { fixes: self, cursor: None, sorted: sorted.into_values().collect::<Vec<_>>().into_iter() })
    }

    /// Checks that all rows could be read, like [`Table::sound`].
    ///
    /// # Errors
    ///
    /// Same as there.
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.table.sound()
    }

    /// Changes the list of the fixes.
    #[cfg(test)]
    pub(crate) fn change(&mut self, change: impl FnOnce(&mut Vec<Fix>)) {
        let mut all = self.map(|fix| fix).unwrap();
        change(&mut all);
        *self = Self::new(self.table.directory());
        all.into_iter().for_each(|fix| self.push(fix).unwrap());
    }
}

/// Fixes by their samples, as [`Finder`] has rows.
pub struct FixFinder<'f> {
    fixes: &'f Fixes,
    found: Finder<'f, (), Row>,
}

impl FixFinder<'_> {
    /// The fix at a sample.
    pub fn get(&mut self, sample: u64) -> Option<Fix> {
        self.found.get(sample).map(|row| self.fixes.whole(row))
    }
}

/// Fixes in the order of their samples.
pub struct InOrder<'f> {
    fixes: &'f Fixes,
    /// Cursor of the table; `None` where the table is not in order.
    cursor: Option<Cursor<'f, (), Row>>,
    sorted: std::vec::IntoIter<Fix>,
}

impl Iterator for InOrder<'_> {
    type Item = Result<Fix, JudgeError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.cursor {
            Some(cursor) => Some(cursor.next()?.map(|row| self.fixes.whole(row))),
            None => self.sorted.next().map(Ok),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::planted;

    fn text(fixes: impl IntoIterator<Item = Fix>) -> String {
        fixes.into_iter().map(|fix| format!("{fix:?}\n")).collect()
    }

    #[test]
    fn every_model_is_at_its_place() {
        assert!(MODELS.iter().zip(0..).all(|(model, number)| place(*model) == number));
    }

    #[test]
    fn fixes_come_back_as_they_were_in_the_order_of_their_samples() {
        let run = planted();
        let path = run.path().join("rx/fixes.csv");
        let mut all: Vec<Fix> = csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect();
        all[3].excluded = "G05 G07".to_owned();
        all[4].time_scale = "GST".to_owned();
        (all[5].ranges, all[5].clocks, all[5].ionosphere) = (Some(12), Some(2), IonosphereModel::Grid);
        let read = |all: &[Fix]| {
            let mut fixes = Fixes::new(run.path());
            all.iter().for_each(|fix| fixes.push(fix.clone()).unwrap());
            fixes
        };
        let fixes = read(&all);
        assert_eq!(text(fixes.map(|fix| fix).unwrap()), text(all.clone()));
        assert_eq!((fixes.len(), fixes.first_sample()), (all.len(), Some(all[0].sample)));
        assert!(fixes.uses(IonosphereModel::Grid) && !fixes.uses(IonosphereModel::Nominal));
        assert_eq!(text(fixes.in_order().unwrap().map(Result::unwrap)), text(all.clone()));
        let mut turned: Vec<Fix> = all.iter().rev().cloned().collect();
        turned.push(all[7].clone());
        let fixes = read(&turned);
        assert_eq!((fixes.earliest_sample(), fixes.first_sample()), (Some(all[0].sample), Some(turned[0].sample)));
        assert_eq!(text(fixes.in_order().unwrap().map(Result::unwrap)), text(all.clone()));
        assert_eq!(text(fixes.finder().unwrap().get(all[3].sample)), text([all[3].clone()]));
    }
}
