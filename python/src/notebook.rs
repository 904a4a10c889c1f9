//! Representations of objects in notebooks; the HTML is made by `sidestep/_notebook.py`.

use pyo3::prelude::*;

/// Returns an object as HTML; `function` of `sidestep/_notebook.py` makes it.
pub(crate) fn to_html<'py>(
    object: &Bound<'py, PyAny>,
    function: &str,
) -> PyResult<Bound<'py, PyAny>> {
    object.py().import("sidestep._notebook")?.call_method1(function, (object,))
}
