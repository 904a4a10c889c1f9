//! The list of worlds of a native module, and what each declares of itself.

use crate::error::argument_error;
use crate::json::to_python;
use pyo3::prelude::*;
use serde_json::{Value, json};
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

/// Returns the list with which this native module was filled.
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

/// Returns the facts that a world declares of itself, as a dict: `agent` (the noun for an agent), `default_order`,
/// `reward_terms`, `positions` and `group_sizes`. By these the package's own modules serve worlds that they do not know.
///
/// Raises InputError when there is no such world.
///
/// >>> from sidestep._native import world_facts
/// >>> world_facts("robots")["agent"]
/// 'robot'
#[pyfunction]
pub(crate) fn world_facts(py: Python<'_>, world: &str) -> PyResult<Py<PyAny>> {
    let Some(found) = list().find(world) else {
        let cause = format!("there is no world `{world}`");
        return Err(argument_error(
            "world",
            cause,
            format!("it is one of {}", list().names().join(", ")),
        ));
    };
    let mut facts = serde_json::to_value(found.facts()).unwrap_or_default();
    if let Value::Object(members) = &mut facts {
        members.insert("agent".into(), json!(found.agent()));
    }
    to_python(py, &facts)
}
