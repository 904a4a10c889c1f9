//! The module `sidestep_pond`: that of the package, and the world of ponds that no package has. `test_pond.py` puts it
//! in the place of `sidestep._native`, so that all of the package is seen with a world that its code cannot know.

use pyo3::prelude::*;
use sidestep::worlds::WORLDS;
use sidestep_testing_pond::Pond;

/// The native part of `sidestep`, with ponds.
#[pymodule(gil_used = false)]
fn sidestep_pond(module: &Bound<'_, PyModule>) -> PyResult<()> {
    sidestep_python::fill(module, WORLDS.clone().with(Pond))
}
