//! Files and what becomes of them: the native part of `sidestep.inspect`.

use crate::error::session_error;
use crate::json::to_python;
use crate::worlds;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Returns the import report of a file as a dict: the native part of `sidestep.inspect`.
///
/// Raises InputError when the file cannot be read, or nothing in it is of use.
#[pyfunction]
pub(crate) fn inspect(py: Python<'_>, file: PathBuf) -> PyResult<Py<PyAny>> {
    let inspected = py.detach(|| sidestep_session::inspect(worlds::list(), &file));
    let inspected = inspected.map_err(|e| session_error(&e))?;
    let inspected = serde_json::to_value(&inspected).expect("a report is plain data");
    to_python(py, &inspected)
}

/// Writes what is kept of a file to `out`: the native part of `sidestep.inspect` with `clean`.
///
/// Raises InputError when the file is of a kind that is not written.
#[pyfunction]
pub(crate) fn write_clean(py: Python<'_>, file: PathBuf, out: PathBuf) -> PyResult<()> {
    let written = py.detach(|| sidestep_session::write_clean(&file, &out));
    written.map_err(|e| session_error(&e))?;
    Ok(())
}
