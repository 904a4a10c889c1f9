//! A value that many ranges have, and the directions in which they do.

use super::beams::BeamSet;

/// Nothing answers in several directions; a wall or a part of the robot is seen in one, by beams side by side.
const MIN_RUNS: u64 = 2;

/// Ranges of one value.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct RepeatedRange {
    pub(super) value_m: f32,
    pub(super) count: u64,
    beams: BeamSet,
    /// The greatest number of runs of beams side by side in a scan, that of the present scan, and its last beam.
    most_runs: u64,
    runs: u64,
    last_beam: Option<usize>,
}

impl RepeatedRange {
    /// Forgets all that was added, for another value.
    pub(super) fn restart(&mut self, value_m: f32) {
        *self = Self { value_m, ..Self::default() };
    }

    pub(super) fn begin_scan(&mut self) {
        (self.runs, self.last_beam) = (0, None);
    }

    /// Adds a range of this value that a beam of the present scan has; beams come in their order.
    pub(super) fn add(&mut self, beam: usize) {
        self.count += 1;
        self.beams.insert(beam);
        let is_beside_last = self.last_beam.is_some_and(|last| last + 1 == beam);
        self.runs += u64::from(!is_beside_last);
        self.most_runs = self.most_runs.max(self.runs);
        self.last_beam = Some(beam);
    }

    /// Returns the number of beams that have had the value.
    pub(super) fn beams(&self) -> u64 {
        self.beams.len()
    }

    /// Returns whether beams that are apart have the value: of one scan, or of all. Beams that are apart in each scan may
    /// be side by side in all of them together.
    pub(super) fn is_in_several_directions(&self) -> bool {
        self.most_runs >= MIN_RUNS || self.beams.runs() >= MIN_RUNS
    }

    /// Returns whether most of the beams have had the value: what a wall is nearest to is seen by fewer.
    pub(super) fn is_all_around(&self, beams_of_scan: u64) -> bool {
        2 * self.beams.len() > beams_of_scan
    }
}
