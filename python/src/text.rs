//! Scenarios and settings as Python has them: a text of TOML, a file, or a dictionary with the same keys.

use std::path::PathBuf;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::Value;

/// Source of keys and values.
pub enum Source {
    Text(String),
    File(PathBuf),
    Table(toml::Table),
}

/// A text, a path or a dictionary; `what` names it in errors.
pub fn source(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Source> {
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Source::Text(text.to_string()));
    }
    if let Ok(dict) = object.cast::<PyDict>() {
        return Ok(Source::Table(table(dict, "")?));
    }
    if object.hasattr("__fspath__")? {
        return Ok(Source::File(object.extract()?));
    }
    let kind = object.get_type().name()?;
    Err(PyTypeError::new_err(format!("{what} is a {kind}: expected a text of TOML, a dict or a path")))
}

/// A table of TOML; `above` are the keys that lead to it.
pub fn table(dict: &Bound<'_, PyDict>, above: &str) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for (key, item) in dict {
        let name: String =
            key.extract().map_err(|_| PyTypeError::new_err(format!("{above}{key}: a key is expected to be a str")))?;
        let path = format!("{above}{name}");
        // A key that has nothing is one that is not there.
        if !item.is_none() {
            table.insert(name, value(&item, &path)?);
        }
    }
    Ok(table)
}

fn value(item: &Bound<'_, PyAny>, path: &str) -> PyResult<Value> {
    if item.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(item.extract()?));
    }
    if item.is_instance_of::<PyInt>() {
        let beyond = |_| PyTypeError::new_err(format!("{path} = {item}: expected an integer of 64 bits"));
        return item.extract().map(Value::Integer).map_err(beyond);
    }
    if item.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(item.extract()?));
    }
    if let Ok(text) = item.cast::<PyString>() {
        return Ok(Value::String(text.to_string()));
    }
    if let Ok(dict) = item.cast::<PyDict>() {
        return Ok(Value::Table(table(dict, &format!("{path}."))?));
    }
    if item.is_instance_of::<PyList>() || item.is_instance_of::<PyTuple>() {
        let items = item.try_iter()?.enumerate();
        let all: PyResult<Vec<Value>> = items.map(|(n, item)| value(&item?, &format!("{path}[{n}]"))).collect();
        return Ok(Value::Array(all?));
    }
    // Times, paths, and arrays and numbers of numpy.
    if item.hasattr("isoformat")? {
        return Ok(Value::String(item.call_method0("isoformat")?.extract()?));
    }
    if item.hasattr("__fspath__")? {
        return Ok(Value::String(item.call_method0("__fspath__")?.extract()?));
    }
    if item.hasattr("tolist")? {
        return value(&item.call_method0("tolist")?, path);
    }
    let kind = item.get_type().name()?;
    Err(PyTypeError::new_err(format!("{path} is a {kind}: expected bool, int, float, str, datetime, list or dict")))
}
