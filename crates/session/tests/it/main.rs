//! Tests of everything that a session does, with a world that only these tests know.

mod builds;
mod changed;
mod controls;
mod exports;
mod fleets;
#[cfg(unix)]
mod links;
mod orders;
mod places;
mod runs;
mod support;
mod sweeps;
