//! Flown or simulated: how the cycles of a run came about.
//!
//! In a flight in real time the decisions were made by processes that had to keep deadlines; which of them came too
//! late is known to nobody but the recording. A simulation of the same scenario is another run.

use crate::manifest::Manifest;
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

impl Manifest {
    /// Returns whether any part of the run is a flight in real time.
    pub fn is_flight(&self) -> bool {
        self.origins.iter().any(|range| range.origin == CycleOrigin::Flown)
    }

    /// Returns whether the run is a flight that nothing has continued by simulation.
    pub fn ends_in_flight(&self) -> bool {
        self.origins.last().is_some_and(|last| last.origin == CycleOrigin::Flown)
    }

    /// Returns how each of the cycles done came about; a folder that does not say so was simulated.
    pub fn all_origins(&self) -> Vec<OriginRange> {
        if self.origins.is_empty() && self.cycles_done > 0 {
            let origin = CycleOrigin::Simulated;
            return vec![OriginRange { from: 0, until: self.cycles_done, origin }];
        }
        self.origins.clone()
    }

    /// Records that all cycles before `done` are done, those after the last recorded range by `origin`.
    pub(crate) fn record_progress(&mut self, done: u64, origin: CycleOrigin) {
        self.cycles_done = done;
        // A run that is continued at a checkpoint does the cycles after it again.
        self.origins.retain(|range| range.from < done || range.from == 0);
        match self.origins.last_mut() {
            Some(last) if last.origin == origin => last.until = done,
            Some(last) => {
                last.until = last.until.min(done);
                let from = last.until;
                self.origins.push(OriginRange { from, until: done, origin });
            }
            None => self.origins.push(OriginRange { from: 0, until: done, origin }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::new_manifest;

    #[test]
    fn a_flight_that_is_continued_by_simulation_says_so_of_every_cycle() {
        let mut manifest = new_manifest("airspace", 1, "0.1.0", 400);
        assert!(!manifest.is_flight() && manifest.all_origins().is_empty());
        manifest.record_progress(0, CycleOrigin::Flown);
        assert!(manifest.ends_in_flight(), "before its first cycle");
        manifest.record_progress(87, CycleOrigin::Flown);
        manifest.record_progress(87, CycleOrigin::Simulated);
        assert!(manifest.is_flight() && !manifest.ends_in_flight());
        manifest.record_progress(400, CycleOrigin::Simulated);
        let text = origins_text(&manifest.all_origins());
        assert_eq!(text, "cycles 0 to 86 flown, cycles 87 to 399 simulated");
    }

    #[test]
    fn an_early_folder_was_simulated() {
        let manifest = Manifest { cycles_done: 5, ..new_manifest("robots", 1, "0.1.0", 9) };
        assert_eq!(origins_text(&manifest.all_origins()), "cycles 0 to 4 simulated");
        assert!(!manifest.is_flight());
    }
}
