//! Studies: planned, run and condensed, with their tables as columns.

use std::path::{Path, PathBuf};

use ::study::sweep::engine;
use ::study::sweep::plan::{Cut, Plan};
use ::study::sweep::result::{self, Results};
use ::study::sweep::{publish, sha256_of_file};
use analysis::show::document::Forms;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::call::long;
use crate::columns::Column;
use crate::failure::Failure;

/// Runs the study in a file; what is there already in `out` is not computed again. Returns its cells and its
/// cases.
#[pyfunction]
#[pyo3(signature = (study, *, out))]
pub fn study<'py>(py: Python<'py>, study: PathBuf, out: PathBuf) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let own: PathBuf = py.import("gnss_twin._native")?.getattr("__file__")?.extract()?;
    let (cells, cases) = long(py, |halt| {
        let plan = Plan::create(&study, &out, Cut::Default, &build(&own)?)?;
        let missing = engine::status(&plan)?.missing;
        engine::run_while(&plan, &missing, &|_| (), &|| !halt.is_set())?;
        let lines = result::merge(&plan)?;
        let results = Results::new(&plan, &lines)?;
        publish::write(&plan, &lines, &results, Forms::BOTH)?;
        Ok((results.table()?, result::table(&plan, &lines)))
    })?;
    Ok((columns(py, &cells)?, columns(py, &cases)?))
}

/// A hash of what computes.
fn build(own: &Path) -> Result<String, Failure> {
    let hash = sha256_of_file(own).map_err(|error| Failure::file(own, &error))?;
    Ok(hash.chars().take(16).collect())
}

/// A CSV table as columns: of numbers where all fields are, an empty one being none.
fn columns<'py>(py: Python<'py>, table: &[u8]) -> PyResult<Bound<'py, PyDict>> {
    let bug = |error: csv::Error| Failure::bug(&error.to_string());
    let mut reader = csv::Reader::from_reader(table);
    let header = reader.headers().map_err(bug)?.clone();
    let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().map_err(bug)?;
    let dict = PyDict::new(py);
    for (place, name) in header.iter().enumerate() {
        let fields = || rows.iter().map(|row| row.get(place).unwrap_or_default());
        dict.set_item(name, Column::of_texts(fields).into_array(py)?)?;
    }
    Ok(dict)
}
