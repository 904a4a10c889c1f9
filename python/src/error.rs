//! Conversion of the errors of Rust to the exceptions of `sidestep/_errors.py`.

use pyo3::prelude::*;
use sidestep::kernel;
use sidestep::kernel::control;
use sidestep::kernel::ports;
use sidestep_session::{Error, RestoreError};

pyo3::import_exception!(sidestep._errors, InputError);
pyo3::import_exception!(sidestep._errors, OrderError);
pyo3::import_exception!(sidestep._errors, RecordError);
pyo3::import_exception!(sidestep._errors, CheckpointError);
pyo3::import_exception!(sidestep._errors, ReplayError);
pyo3::import_exception!(sidestep._errors, ClosedError);

pub(crate) fn input_error(error: &kernel::InputError) -> PyErr {
    let (line, column) = error.line_and_column().unzip();
    InputError::new_err((
        error.to_string(),
        error.place().to_string(),
        line,
        column,
        error.key().map(str::to_string),
        error.cause().to_string(),
        error.remedy().to_string(),
    ))
}

/// Returns the exception of input that was given as a dict: its text was written from the dict, so the error has the key
/// and no line.
pub(crate) fn dict_input_error(error: &kernel::InputError) -> PyErr {
    let place = error.key().unwrap_or(error.place()).to_string();
    let message = format!("{place}: {}\n  help: {}", error.cause(), error.remedy());
    let line: Option<usize> = None;
    let column: Option<usize> = None;
    InputError::new_err((
        message,
        place,
        line,
        column,
        error.key().map(str::to_string),
        error.cause().to_string(),
        error.remedy().to_string(),
    ))
}

/// Returns the exception of wrong input that has no text: place, cause and remedy.
pub(crate) fn argument_error(
    place: &str,
    cause: impl Into<String>,
    remedy: impl Into<String>,
) -> PyErr {
    input_error(&kernel::InputError::new(place, cause, remedy))
}

pub(crate) fn order_error(error: &control::OrderError) -> PyErr {
    OrderError::new_err(error.to_string())
}

/// Returns the exception of rows that cannot be stored.
pub(crate) fn record_error(error: &ports::RecordError) -> PyErr {
    RecordError::new_err(error.to_string())
}

/// Returns the exception of a run that cannot continue from a checkpoint.
pub(crate) fn restore_error(error: &RestoreError) -> PyErr {
    match error {
        RestoreError::Record(error) => record_error(error),
        RestoreError::AlreadyStored { .. } => CheckpointError::new_err(format!(
            "{error}\n  help: restore it in a copy (`sim.copy()`), or in a new Simulation without a folder"
        )),
        RestoreError::UnknownHistory { .. } => CheckpointError::new_err(format!(
            "{error}\n  help: take these rows before (`sim.tables()`), or restore it in a copy (`sim.copy()`)"
        )),
        _ => CheckpointError::new_err(error.to_string()),
    }
}

pub(crate) fn session_error(error: &Error) -> PyErr {
    match error {
        Error::Input(error) => input_error(error),
        Error::Record(error) => record_error(error),
        Error::Draw(_) => RecordError::new_err(error.to_string()),
        Error::Interrupted | Error::InterruptedInCycle(_) | Error::Other { .. } => {
            ReplayError::new_err(error.to_string())
        }
    }
}
