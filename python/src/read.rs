//! Tables of folders: of runs, and of sweeps.

use crate::error::{self, argument_error};
use crate::table::Table;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sidestep::kernel::InputError;
use sidestep_record::{RunReader, read_table, tables as tables_of};
use sidestep_session::sweep::{self, Folder};
use std::path::{Path, PathBuf};

/// The tables of a sweep's folder.
const SWEEP_TABLES: [&str; 3] = ["results", "timings", "series"];

/// Returns the names of the tables of a run folder or a sweep's folder.
///
/// Raises InputError when there is no such folder.
#[pyfunction]
pub(crate) fn table_names(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<String>> {
    if Folder::is_at(&folder) {
        return Ok(SWEEP_TABLES.map(String::from).to_vec());
    }
    py.detach(|| tables_of(&folder)).map_err(|e| error::input_error(&e))
}

/// Returns the tables of a run folder or a sweep's folder by name, all of them or the named ones.
///
/// Raises InputError when there is no such folder or table, or a file is damaged.
#[pyfunction]
#[pyo3(signature = (folder, tables=None))]
pub(crate) fn read<'py>(
    py: Python<'py>,
    folder: PathBuf,
    tables: Option<Vec<String>>,
) -> PyResult<Bound<'py, PyDict>> {
    if Folder::is_at(&folder) {
        return read_sweep_folder(py, &folder, tables.as_ref());
    }
    let read: Result<Vec<_>, InputError> = py.detach(|| {
        let names = tables.map_or_else(|| tables_of(&folder), Ok)?;
        // A folder of tables alone has no list of them.
        if RunReader::is_at(&folder) {
            let reader = RunReader::open(&folder)?;
            let is_read = |file: &str| {
                file.split_once('/').is_some_and(|(table, _)| names.iter().any(|n| n == table))
            };
            reader.check_files(is_read)?;
        }
        names.into_iter().map(|name| read_table(&folder, &name, ..).map(|t| (name, t))).collect()
    });
    let dict = PyDict::new(py);
    for (name, table) in read.map_err(|e| error::input_error(&e))? {
        dict.set_item(name, Table::new(table.schema, table.columns)?)?;
    }
    Ok(dict)
}

/// Returns the tables of a sweep's folder, for the finished runs.
fn read_sweep_folder<'py>(
    py: Python<'py>,
    folder: &Path,
    names: Option<&Vec<String>>,
) -> PyResult<Bound<'py, PyDict>> {
    let finished = py.detach(|| {
        let folder = Folder::open(folder)?;
        let finished = sweep::read_finished(&folder)?;
        Ok((finished.table, finished.series, folder.plan().world.clone()))
    });
    let (table, series, world) = finished.map_err(|e: InputError| error::input_error(&e))?;
    let dict = PyDict::new(py);
    for (name, columns) in SWEEP_TABLES.into_iter().zip([
        table.results(),
        table.timings(),
        series.columns.iter().collect(),
    ]) {
        if names.is_none_or(|names| names.iter().any(|other| other == name)) {
            let columns = columns.into_iter().cloned().collect();
            dict.set_item(name, Table::from_runs(name, columns, &world)?)?;
        }
    }
    let unknown = names.into_iter().flatten().find(|name| !SWEEP_TABLES.contains(&name.as_str()));
    match unknown {
        Some(name) => {
            let cause = format!("there is no table `{name}`");
            Err(argument_error(
                &folder.display().to_string(),
                cause,
                "a sweep has results, timings and series",
            ))
        }
        None => Ok(dict),
    }
}
