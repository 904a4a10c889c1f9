//! Results: classes of the package that are written in Python, filled by the names of their fields.
//!
//! They are named tuples and frozen dataclasses of Python, because users unpack, compare, print and pickle them; a
//! class of Rust would have to imitate each of these. So the names and the documentation of the fields stand in Python
//! only, and a wrong name raises TypeError in the tests.

use crate::json::to_python;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sidestep::statistics::Interval;

/// A class of results: the module of the package that defines it, and its name.
#[derive(Clone, Copy)]
pub(crate) struct ResultClass(pub(crate) &'static str, pub(crate) &'static str);

/// The fields of a result, by the names that its class in Python has.
pub(crate) struct Fields<'py>(Bound<'py, PyDict>);

impl<'py> Fields<'py> {
    /// Returns no fields.
    pub(crate) fn new(py: Python<'py>) -> Self {
        Self(PyDict::new(py))
    }

    /// Returns the fields of a JSON object; anything else is an error.
    pub(crate) fn from_json(py: Python<'py>, object: &serde_json::Value) -> PyResult<Self> {
        let object = to_python(py, object)?.into_bound(py);
        Ok(Self(object.cast_into::<PyDict>()?))
    }

    /// Returns these fields and another one.
    pub(crate) fn with(self, name: &str, value: impl IntoPyObject<'py>) -> PyResult<Self> {
        self.0.set_item(name, value.into_bound_py_any(self.0.py())?)?;
        Ok(self)
    }

    /// Returns these fields and an interval, None where there is none.
    pub(crate) fn with_interval(self, name: &str, ends: Option<Interval>) -> PyResult<Self> {
        let interval = ends.map(|ends| to_interval(self.0.py(), ends)).transpose()?;
        self.with(name, interval)
    }

    /// Returns the result as an object of its class.
    pub(crate) fn build(
        self,
        ResultClass(module, name): ResultClass,
    ) -> PyResult<Bound<'py, PyAny>> {
        let class = self.0.py().import(module)?.getattr(name)?;
        class.call((), Some(&self.0))
    }
}

fn to_interval(py: Python<'_>, ends: Interval) -> PyResult<Bound<'_, PyAny>> {
    let fields = Fields::new(py).with("low", ends.low)?.with("high", ends.high)?;
    fields.build(ResultClass("sidestep.stats", "Interval"))
}
