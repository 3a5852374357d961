//! Samples as arrays: packed bytes get the shape that their format has, without a copy.

use gnss::samples::Format;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyMemoryView};

/// Type of an array's elements, and whether a sample is a pair of them.
fn shape(format: Format) -> (&'static str, bool) {
    match format {
        Format::Ci8 => ("int8", true),
        Format::Cu8 => ("uint8", true),
        Format::Ci16Le => ("<i2", true),
        Format::Cf32Le => ("<c8", false),
        Format::Ri8 => ("int8", false),
        Format::Ri16Le => ("<i2", false),
    }
}

/// Packed samples as an array of one sample a row; the bytes are handed over.
pub fn array(py: Python<'_>, format: Format, bytes: Vec<u8>) -> PyResult<Bound<'_, PyAny>> {
    let (kind, pairs) = shape(format);
    let array = PyArray1::from_vec(py, bytes).call_method1("view", (kind,))?;
    if pairs { array.call_method1("reshape", ((-1, 2),)) } else { Ok(array) }
}

/// The bytes of an array, or of what holds bytes; copied only where they do not lie one after the other.
pub fn bytes<'py>(samples: &Bound<'py, PyAny>, format: Format) -> PyResult<PyReadonlyArray1<'py, u8>> {
    let numpy = samples.py().import("numpy")?;
    let raw = samples.is_instance_of::<PyBytes>()
        || samples.is_instance_of::<PyByteArray>()
        || samples.is_instance_of::<PyMemoryView>();
    let flat = if raw {
        numpy.call_method1("frombuffer", (samples, "uint8"))?
    } else {
        let (kind, pairs) = shape(format);
        let expected = numpy.call_method1("dtype", (kind,))?;
        let array = numpy.call_method1("asanyarray", (samples,))?;
        let found = array.getattr("dtype")?;
        if !found.eq(&expected)? {
            let text = format!("samples are an array of {found}: expected {expected} or bytes, as {format} has them");
            return Err(PyTypeError::new_err(text));
        }
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        let fits = match *shape {
            [_] => true,
            [_, 2] => pairs,
            _ => false,
        };
        if !fits {
            let pair = if pairs { " or (n, 2)" } else { "" };
            return Err(PyValueError::new_err(format!("samples have the shape {shape:?}: expected (n,){pair}")));
        }
        numpy
            .call_method1("ascontiguousarray", (array,))?
            .call_method1("reshape", (-1,))?
            .call_method1("view", ("uint8",))?
    };
    Ok(flat.cast_into::<PyArray1<u8>>()?.readonly())
}
