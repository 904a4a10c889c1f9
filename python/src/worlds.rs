//! The list of worlds of a native module.

use pyo3::prelude::*;
use sidestep::scenario::Worlds;
use std::sync::OnceLock;

/// The list of this module. Classes and functions of Python have no place for it: Python makes a `Scenario` of a path
/// alone. One shared library is one module, so each module has its own.
static WORLDS: OnceLock<Worlds> = OnceLock::new();

/// Sets the list, when Python imports the module.
pub(crate) fn set(worlds: Worlds) {
    // A module that is imported again, after it was removed from `sys.modules`, has the list already.
    let _ = WORLDS.set(worlds);
}

/// Returns the list.
pub(crate) fn list() -> &'static Worlds {
    WORLDS.get().expect("a module without its list has no classes")
}

/// Returns the names of the worlds.
///
/// >>> import sidestep
/// >>> sorted(sidestep.worlds())
/// ['airspace', 'chain', 'robots']
#[pyfunction]
pub(crate) fn worlds() -> Vec<&'static str> {
    list().names()
}
