//! The Python module `gnss_twin._native`: scenes, generator, receiver, runs, lock step and studies for numpy.
//!
//! What computes does so without Python's lock and answers to Ctrl-C; errors are exceptions with the
//! library's words ([`failure`]); records are columns ([`columns`], [`tables`]) and samples arrays
//! ([`arrays`]). Signatures and their meaning are in `gnss_twin/_native.pyi`.

mod arrays;
mod call;
mod columns;
mod failure;
mod generator;
mod live;
mod receiver;
mod run;
mod scene;
mod study;
mod tables;
mod text;

use std::ffi::OsString;

use pyo3::prelude::*;

/// The program, with arguments of which the first is its own name; returns its exit code.
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| gnss_twin::cli::main_of(arguments))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    failure::register(module)?;
    module.add_class::<scene::Metadata>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<generator::Generator>()?;
    module.add_class::<generator::Batch>()?;
    module.add_class::<receiver::Receiver>()?;
    module.add_class::<receiver::Outcome>()?;
    module.add_class::<run::Run>()?;
    module.add_class::<live::Live>()?;
    module.add_class::<live::Step>()?;
    module.add_function(wrap_pyfunction!(receiver::receive, module)?)?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(run::judge, module)?)?;
    module.add_function(wrap_pyfunction!(study::study, module)?)?;
    module.add_function(wrap_pyfunction!(program, module)?)
}
