//! Values of other kinds as values of Python.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PySequence, PyString};
use serde_json::Value;

use crate::error::argument_error;

/// Returns a JSON value as dicts, lists, numbers and text.
pub(crate) fn to_python(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    match value {
        Value::Null => Ok(py.None()),
        Value::Bool(value) => value.into_py_any(py),
        Value::Number(number) => match (number.as_i64(), number.as_u64(), number.as_f64()) {
            (Some(value), ..) => value.into_py_any(py),
            (_, Some(value), _) => value.into_py_any(py),
            (.., value) => value.into_py_any(py),
        },
        Value::String(text) => text.into_py_any(py),
        Value::Array(items) => {
            let items: PyResult<Vec<_>> = items.iter().map(|item| to_python(py, item)).collect();
            items?.into_py_any(py)
        }
        Value::Object(entries) => {
            let dict = PyDict::new(py);
            for (key, value) in entries {
                dict.set_item(key, to_python(py, value)?)?;
            }
            dict.into_py_any(py)
        }
    }
}

/// Returns a value of Python as TOML; `key` is its place, for errors.
pub(crate) fn to_toml(value: &Bound<'_, PyAny>, key: &str) -> PyResult<toml::Value> {
    // Truth values are whole numbers in Python, so they come first.
    if value.is_instance_of::<PyBool>() {
        return Ok(toml::Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(toml::Value::String(value.extract()?));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(toml::Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let number = value.extract().map_err(|_| {
            argument_error(key, format!("{value} is too large"), "give at most 2^63 - 1")
        })?;
        return Ok(toml::Value::Integer(number));
    }
    if let Ok(mapping) = value.cast::<PyMapping>() {
        return to_toml_table(mapping, key).map(toml::Value::Table);
    }
    if let Ok(list) = value.cast::<PySequence>() {
        let items = (0..list.len()?).map(|k| to_toml(&list.get_item(k)?, &format!("{key}.{k}")));
        return Ok(toml::Value::Array(items.collect::<PyResult<_>>()?));
    }
    // Numbers and arrays of NumPy, and paths.
    if let Ok(plain) = value.call_method0("tolist") {
        return to_toml(&plain, key);
    }
    if let Ok(path) = value.call_method0("__fspath__") {
        return to_toml(&path, key);
    }
    let ty = value.get_type();
    let cause = format!("a value of the type {} does not fit into a scenario", ty.name()?);
    Err(argument_error(
        key,
        cause,
        "give numbers, text, lists and dicts; leave a key out in place of None",
    ))
}

/// Returns a dict as a TOML table; `key` is its place, for errors.
pub(crate) fn to_toml_table(mapping: &Bound<'_, PyMapping>, key: &str) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for entry in mapping.items()?.iter() {
        let (name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = entry.extract()?;
        let name: String = name.extract().map_err(|_| {
            let place = if key.is_empty() { "scenario" } else { key };
            argument_error(place, format!("the key {name} is no text"), "give text as keys")
        })?;
        let path = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
        table.insert(name, to_toml(&value, &path)?);
    }
    Ok(table)
}

pub(crate) fn to_list<'py, T>(
    py: Python<'py>,
    items: impl IntoIterator<Item = T>,
) -> PyResult<Bound<'py, PyList>>
where
    T: IntoPyObject<'py>,
{
    let list = PyList::empty(py);
    items.into_iter().try_for_each(|item| list.append(item))?;
    Ok(list)
}
