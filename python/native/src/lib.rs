//! The module `sidestep._native`, with the worlds that are shipped.
//!
//! It is a crate of its own because maturin builds a module with `--crate-type cdylib` alone: a crate that is a library
//! as well would be compiled twice, once for its modules of tests.

use pyo3::prelude::*;
use sidestep::worlds::WORLDS;

/// The native part of `sidestep`.
#[pymodule(gil_used = false)]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    sidestep_python::fill(module, WORLDS.clone())
}
