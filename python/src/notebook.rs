//! Representations of objects in notebooks; the HTML is made by `sidestep/_notebook.py`.

use pyo3::prelude::*;

/// Returns an object as HTML, made by the function for its kind.
pub(crate) fn to_html<'py>(thing: &Bound<'py, PyAny>, sort: &str) -> PyResult<Bound<'py, PyAny>> {
    thing.py().import("sidestep._notebook")?.call_method1(sort, (thing,))
}
