//! Ctrl-C: between two slices of a run, Python is asked for signals.

use pyo3::prelude::*;
use sidestep_session::{Error, Watcher};
use std::sync::Mutex;

/// A watcher that stops a run between two cycles when Python has a signal to handle.
#[derive(Debug, Default)]
pub(crate) struct Signals(Mutex<Option<PyErr>>);

impl Signals {
    /// Returns the exception of the signal, if there was one.
    pub(crate) fn into_result(self) -> PyResult<()> {
        let raised = self.0.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        raised.map_or(Ok(()), Err)
    }
}

impl Watcher for Signals {
    fn go_on(&self) -> bool {
        let Err(raised) = Python::attach(|py| py.check_signals()) else { return true };
        *self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(raised);
        false
    }

    fn warn(&self, error: &Error) {
        Python::attach(|py| {
            let text = std::ffi::CString::new(error.to_string()).unwrap_or_default();
            let category = py.get_type::<pyo3::exceptions::PyRuntimeWarning>();
            // A warning that is turned into an exception stops nothing here.
            let _ = PyErr::warn(py, &category, &text, 1);
        });
    }
}
