//! What the program of the network has to know of this module, for `sidestep.Fleet`.

use crate::worlds;
use pyo3::prelude::*;
use sidestep_session::fleet::check_loopback_multicast;

/// Returns the build of this module: a fleet's server and nodes are of the same one.
///
/// >>> from sidestep._native import build
/// >>> build().count("+")
/// 1
#[pyfunction]
pub(crate) fn build() -> &'static str {
    worlds::list().build()
}

/// Returns whether nodes of this machine reach each other by multicast.
///
/// >>> from sidestep._native import has_loopback_multicast
/// >>> has_loopback_multicast() in (True, False)
/// True
#[pyfunction]
pub(crate) fn has_loopback_multicast(py: Python<'_>) -> bool {
    // It waits for a datagram to come back.
    py.detach(|| check_loopback_multicast().is_ok())
}
