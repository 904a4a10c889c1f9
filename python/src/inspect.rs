//! Files and what becomes of them: the native part of `sidestep.inspect`.

use crate::error::session_error;
use crate::json::to_python;
use crate::{scenario, worlds};
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use std::path::PathBuf;

/// Returns the import report of a file as a dict: the native part of `sidestep.inspect`.
///
/// Raises InputError when the file cannot be read, or nothing in it is of use.
#[pyfunction]
#[pyo3(signature = (file, import_options=None))]
pub(crate) fn inspect(
    py: Python<'_>,
    file: PathBuf,
    import_options: Option<&Bound<'_, PyMapping>>,
) -> PyResult<Py<PyAny>> {
    let options = scenario::import_options(import_options)?;
    let inspected = py.detach(|| sidestep_session::inspect(worlds::list(), &file, &options));
    let inspected = inspected.map_err(|e| session_error(&e))?;
    let inspected = serde_json::to_value(&inspected).expect("a report is plain data");
    to_python(py, &inspected)
}

/// Writes what is kept of a file to `out`: the native part of `sidestep.inspect` with `clean`.
///
/// Raises InputError when the file is of a kind that is not written.
#[pyfunction]
#[pyo3(signature = (file, out, import_options=None))]
pub(crate) fn write_clean(
    py: Python<'_>,
    file: PathBuf,
    out: PathBuf,
    import_options: Option<&Bound<'_, PyMapping>>,
) -> PyResult<()> {
    let options = scenario::import_options(import_options)?;
    let written = py.detach(|| sidestep_session::write_clean(&file, &out, &options));
    written.map_err(|e| session_error(&e))?;
    Ok(())
}
