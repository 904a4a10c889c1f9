//! Things as cells of notebooks show them; the HTML is made by `sidestep/_notebook.py`.

use pyo3::prelude::*;

/// Returns a thing as HTML, by the function for its sort.
pub(crate) fn shown<'py>(thing: &Bound<'py, PyAny>, sort: &str) -> PyResult<Bound<'py, PyAny>> {
    thing.py().import("sidestep._notebook")?.call_method1(sort, (thing,))
}
