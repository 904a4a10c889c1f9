//! Flown or simulated: how the cycles of a run came about.
//!
//! In a flight in real time the decisions were made by processes that had to keep deadlines; which of them came too
//! late is known to nobody but the recording. A simulation of the same scenario is another run.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How a cycle came about.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CycleOrigin {
    /// In real time, with agents that had deadlines.
    Flown,
    /// Computed, as in one process: its rows can be computed again from the scenario.
    #[default]
    Simulated,
}

impl CycleOrigin {
    /// Returns the word for it: `flown` or `simulated`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flown => "flown",
            Self::Simulated => "simulated",
        }
    }
}

/// Cycles in a row that came about alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct OriginRange {
    /// The first of them.
    pub from: u64,
    /// The first one after them.
    pub until: u64,
    /// How they came about.
    pub origin: CycleOrigin,
}

impl fmt::Display for OriginRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from, until, origin } = self;
        let origin = origin.name();
        match until.saturating_sub(*from) {
            0 => write!(f, "no cycle {origin}"),
            1 => write!(f, "cycle {from} {origin}"),
            _ => write!(f, "cycles {from} to {} {origin}", until - 1),
        }
    }
}

/// Returns the ranges as text, e.g. `cycles 0 to 86 flown, cycles 87 to 399 simulated`.
pub fn origins_text(origins: &[OriginRange]) -> String {
    origins.iter().map(OriginRange::to_string).collect::<Vec<_>>().join(", ")
}
