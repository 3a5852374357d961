//! Rows as columns: what pandas, polars and numpy take as a table.

use std::borrow::Cow;
use std::collections::HashMap;

use gnss::record::{
    AcquisitionRow, AttitudeRow, BodyRow, ClockRow, DetectionRow, Detector, ElementRow, Event, EventRow, Fix,
    Geographic, InertialRow, IntegrityRow, InterferenceRow, IonosphereModel, IonosphereRow, LineRow, NavigationRow,
    Observation, PassEnd, PassRow, RayRow, SightRow, SkyRow, TagRow, TrackingRow, TrajectoryRow,
};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

/// Texts that repeat: each once, and for every row which one it is.
#[derive(Default)]
pub struct Words {
    rows: Vec<u32>,
    words: Vec<String>,
    places: HashMap<String, u32>,
}

impl Words {
    fn push(&mut self, text: &str) {
        let next = self.words.len() as u32;
        let place = match self.places.get(text) {
            Some(place) => *place,
            None => {
                self.words.push(text.to_owned());
                self.places.insert(text.to_owned(), next);
                next
            }
        };
        self.rows.push(place);
    }
}

/// One column.
pub enum Column {
    Float(Vec<f64>),
    Signed(Vec<i64>),
    Unsigned(Vec<u64>),
    Truth(Vec<bool>),
    Text(Words),
}

impl Column {
    /// Column of fields as a file has them: numbers where all are, an empty one being none.
    pub fn of_texts<'t, I: Iterator<Item = &'t str>>(fields: impl Fn() -> I) -> Self {
        let number = |field: &str| if field.is_empty() { Some(f64::NAN) } else { field.parse().ok() };
        match fields().map(number).collect() {
            Some(numbers) => Self::Float(numbers),
            None => {
                let mut words = Words::default();
                fields().for_each(|field| words.push(field));
                Self::Text(words)
            }
        }
    }

    /// The column as an array; numbers are not copied.
    pub fn into_array(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        Ok(match self {
            Self::Float(values) => PyArray1::from_vec(py, values).into_any(),
            Self::Signed(values) => PyArray1::from_vec(py, values).into_any(),
            Self::Unsigned(values) => PyArray1::from_vec(py, values).into_any(),
            Self::Truth(values) => PyArray1::from_vec(py, values).into_any(),
            Self::Text(Words { rows, words, .. }) => {
                let words = py.import("numpy")?.call_method1("array", (words, "str"))?;
                words.get_item(PyArray1::from_vec(py, rows))?
            }
        })
    }
}

/// Field of a row, and the column that such fields make.
pub trait Cell {
    /// A column of such fields.
    fn column() -> Column;
    /// Appends it to such a column.
    fn push(&self, column: &mut Column);
}

macro_rules! cells {
    ($($field:ty: $kind:ident, $value:expr;)*) => {$(
        impl Cell for $field {
            fn column() -> Column {
                Column::$kind(Default::default())
            }

            fn push(&self, column: &mut Column) {
                if let Column::$kind(values) = column {
                    values.push(($value)(self));
                }
            }
        }
    )*};
}

// What is absent is not a number: arrays have no other word for it.
cells! {
    f64: Float, |x: &f64| *x;
    i64: Signed, |x: &i64| *x;
    u64: Unsigned, |x: &u64| *x;
    u8: Unsigned, |x: &u8| u64::from(*x);
    u16: Unsigned, |x: &u16| u64::from(*x);
    u32: Unsigned, |x: &u32| u64::from(*x);
    usize: Unsigned, |x: &usize| *x as u64;
    bool: Truth, |x: &bool| *x;
    Option<f64>: Float, |x: &Option<f64>| x.unwrap_or(f64::NAN);
    Option<u32>: Float, |x: &Option<u32>| x.map_or(f64::NAN, f64::from);
}

/// Fields that are words.
macro_rules! texts {
    ($($field:ty: $text:expr;)*) => {$(
        impl Cell for $field {
            fn column() -> Column {
                Column::Text(Words::default())
            }

            fn push(&self, column: &mut Column) {
                if let Column::Text(words) = column {
                    let text: for<'x> fn(&'x $field) -> Cow<'x, str> = $text;
                    words.push(&text(self));
                }
            }
        }
    )*};
}

texts! {
    String: |x| x.as_str().into();
    &'static Signal: |x| x.name.into();
    Sv: |x| x.to_string().into();
    Detector: |x| x.name().into();
    Event: |x| word(x).into();
    IonosphereModel: |x| word(x).into();
    PassEnd: |x| word(x).into();
}

/// The word that a file has for a value.
fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// A column with its name.
pub type Named = (&'static str, Column);

/// A row of a table.
pub trait Row {
    /// Columns of the row, empty.
    fn columns() -> Vec<Named>;
    /// Appends it to its columns, and returns those that are not its own.
    fn push<'c>(&self, columns: &'c mut [Named]) -> &'c mut [Named];
}

/// The column of a field that `_` takes from a row.
fn column_of<R, T: Cell>(_: fn(&R) -> &T) -> Column {
    T::column()
}

macro_rules! rows {
    ($($row:ty { $($field:ident),* $(,)? })*) => {$(
        impl Row for $row {
            fn columns() -> Vec<Named> {
                vec![$((stringify!($field), column_of::<$row, _>(|row| &row.$field))),*]
            }

            fn push<'c>(&self, columns: &'c mut [Named]) -> &'c mut [Named] {
                $(let Some(((_, column), columns)) = columns.split_first_mut() else { return &mut [] };
                self.$field.push(column);)*
                columns
            }
        }
    )*};
}

/// Names and order are those of the files that the program writes.
#[rustfmt::skip]
mod fields {
    use super::*;

    rows! {
        Observation { sample, sv, signal, sent_s, sent_fraction_s, pseudorange_m, carrier_cycles, doppler_hz, cn0_dbhz,
            locked_s }
        SkyRow { sample, sv, signal, azimuth_deg, elevation_deg, range_m, satellite_clock_m, ionosphere_m,
            troposphere_m }
        PassRow { sv, sample, until_sample, begins_by, ends_by }
        RayRow { sample, sv, signal, ray, excess_m, amplitude_ratio, phase_cycles }
        TrajectoryRow { sample, gps_s, gps_fraction_s, x_m, y_m, z_m, vx_mps, vy_mps, vz_mps, clock_bias_s,
            clock_drift }
        Geographic { latitude_deg, longitude_deg, height_m, utc }
        InterferenceRow { sample, source, jn0_dbhz, frequency_hz }
        Fix { sample, gps_s, gps_fraction_s, x_m, y_m, z_m, vx_mps, vy_mps, vz_mps, clock_bias_s, clock_drift,
            sigma_east_m, sigma_north_m, sigma_up_m, sigma_clock_m, correlation_en, correlation_eu,
            correlation_nu, gdop, pdop, hdop, vdop, tdop, condition, satellites, chi_square, excluded, ionosphere,
            ranges, clocks, time_scale }
        SightRow { sample, sv, azimuth_deg, elevation_deg, used }
        ClockRow { sample, time_scale, clock_bias_s, sigma_clock_m }
        IonosphereRow { sample, sv, delay_m, sigma_m }
        IntegrityRow { sample, gps_s, gps_fraction_s, method, hpl_m, vpl_m, emt_m, sigma_v_acc_m, satellites,
            detected, excluded, available, reason }
        DetectionRow { sample, detector, sv, signal, statistic, threshold, alarm }
        InertialRow { gps_s, gps_fraction_s, rate_x_radps, rate_y_radps, rate_z_radps, force_x_mps2, force_y_mps2,
            force_z_mps2 }
        BodyRow { gps_s, gps_fraction_s, x_m, y_m, z_m, vx_mps, vy_mps, vz_mps, qw, qx, qy, qz }
        AttitudeRow { sample, yaw_deg, pitch_deg, roll_deg, sigma_east_deg, sigma_north_deg, sigma_up_deg, signals,
            chi_square, freedom }
        ElementRow { sample, signal, element, phase_deg, sigma_deg }
        AcquisitionRow { sample, sv, signal, acquired, statistic, threshold, doppler_hz, code_phase_chips, cn0_dbhz }
        LineRow { sample, frequency_hz, jn0_dbhz, js_db, statistic, threshold, lines, resolution_hz }
        TrackingRow { sample, sv, signal, prompt_i, prompt_q, dll_discriminator_chips, pll_discriminator_cycles,
            fll_discriminator_hz, cn0_dbhz, phase_lock, integration_s, early_i, early_q, late_i, late_q,
            tap_spacing_chips }
        NavigationRow { sample, sv, issue, parameter, raw, message }
        EventRow { sample, sv, signal, event }
        TagRow { gst_week, tow_s, sender, satellite, adkd, position, result, reason }
        FrontEnd { front_end }
        Spoofer { spoofer }
    }
}

/// The front end that a row is about, from 0 on.
pub struct FrontEnd {
    pub front_end: usize,
}

/// The spoofer that a row is about, from 1 on.
pub struct Spoofer {
    pub spoofer: usize,
}

/// Columns of both, one after the other.
impl<A: Row, B: Row> Row for (A, B) {
    fn columns() -> Vec<Named> {
        let mut columns = A::columns();
        columns.extend(B::columns());
        columns
    }

    fn push<'c>(&self, columns: &'c mut [Named]) -> &'c mut [Named] {
        self.1.push(self.0.push(columns))
    }
}

/// A table that grows.
pub struct Table<R> {
    columns: Vec<Named>,
    row: std::marker::PhantomData<fn(&R)>,
}

impl<R: Row> Default for Table<R> {
    fn default() -> Self {
        Self { columns: R::columns(), row: std::marker::PhantomData }
    }
}

impl<R: Row> Table<R> {
    /// Appends a row.
    pub fn push(&mut self, row: &R) {
        row.push(&mut self.columns);
    }

    /// The columns by their names; the table is empty after it.
    pub fn take<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, column) in std::mem::replace(&mut self.columns, R::columns()) {
            dict.set_item(name, column.into_array(py)?)?;
        }
        Ok(dict)
    }
}
