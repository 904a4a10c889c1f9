//! Encounters of pairs: conflicts, losses of separation, violations of well clear and near mid-air collisions, each
//! counted once for as long as it lasts.
//!
//! After each cycle the legs that all have flown in it are swept once (`sweep.rs`): every pair that is near enough is
//! looked at in each step of `dtau`. Conflicts and well clear are those at the start of the step, from the velocities
//! there; losses and near mid-air collisions are those of the motion during the step. So no number depends on groups,
//! and thus on the method.

mod sweep;
#[cfg(test)]
mod tests;

use crate::flight::Proximity;
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeMap;
pub(crate) use sweep::SweepBuffers;

/// Numbers of what pairs had in common in a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EncounterCounts {
    /// Conflicts, by the times that they began.
    pub conflicts: u64,
    /// Conflicts in which separation was lost.
    pub intrusions: u64,
    /// Violations of well clear.
    pub well_clear_violations: u64,
    /// Near mid-air collisions.
    pub nmacs: u64,
    /// Sum of the severities of intrusions.
    pub severity_sum: f64,
    /// Largest severity.
    pub max_severity: f64,
}

impl EncounterCounts {
    fn add(&mut self, other: &Self) {
        self.conflicts += other.conflicts;
        self.intrusions += other.intrusions;
        self.well_clear_violations += other.well_clear_violations;
        self.nmacs += other.nmacs;
        self.severity_sum += other.severity_sum;
        self.max_severity = self.max_severity.max(other.max_severity);
    }

    /// Returns the fraction of conflicts in which no separation was lost; `None` without a conflict.
    ///
    /// Sunil et al., 2017: `(conflicts - intrusions) / conflicts`.
    pub fn intrusion_prevention_rate(&self) -> Option<f64> {
        let prevented = self.conflicts - self.intrusions;
        (self.conflicts > 0).then(|| prevented as f64 / self.conflicts as f64)
    }

    /// Returns the mean severity of intrusions; `None` without one.
    pub fn mean_severity(&self) -> Option<f64> {
        (self.intrusions > 0).then(|| self.severity_sum / self.intrusions as f64)
    }
}

/// What a pair does in one step of `dtau`.
#[derive(Debug, Clone, Copy)]
struct EncounterStep {
    from_s: f64,
    until_s: f64,
    /// Whether a loss is predicted within the look-ahead.
    is_conflict: bool,
    /// Whether the two are not well clear of each other.
    is_violation: bool,
    proximity: Proximity,
}

impl EncounterStep {
    fn is_loss(&self) -> bool {
        self.proximity.severity > 0.0
    }

    /// Returns whether there is anything to record.
    fn is_eventful(&self) -> bool {
        self.is_conflict || self.is_violation || self.is_loss() || self.proximity.is_nmac
    }
}

/// A pair, and a time in which it always was in a conflict, had lost separation, or was not well clear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Encounter {
    /// Its start, in seconds after the start of the run.
    pub(crate) from_s: f64,
    /// Its end.
    pub(crate) until_s: f64,
    /// Closest horizontal approach in meters.
    pub(crate) nearest_m: f64,
    /// Difference of altitude at that time.
    pub(crate) vertical_m: f64,
    /// What it had so far.
    pub(crate) counts: EncounterCounts,
    is_in_conflict: bool,
    /// Severity of the loss in the present conflict; 0 if separation was not lost in it.
    conflict_severity: f64,
    is_in_violation: bool,
    is_in_nmac: bool,
    /// The cycle in which it was last looked at.
    cycle: Cycle,
}

impl Encounter {
    fn new(from_s: f64, cycle: Cycle) -> Self {
        Self {
            from_s,
            until_s: from_s,
            nearest_m: f64::INFINITY,
            vertical_m: 0.0,
            counts: EncounterCounts::default(),
            is_in_conflict: false,
            conflict_severity: 0.0,
            is_in_violation: false,
            is_in_nmac: false,
            cycle,
        }
    }

    fn add_step(&mut self, step: &EncounterStep) {
        self.until_s = step.until_s;
        if step.proximity.nearest_m < self.nearest_m {
            self.nearest_m = step.proximity.nearest_m;
            self.vertical_m = step.proximity.vertical_m;
        }
        // A loss that nobody could predict at the start of its step is a conflict as well.
        let is_in_conflict = step.is_conflict || step.is_loss();
        self.counts.conflicts += u64::from(is_in_conflict && !self.is_in_conflict);
        if !is_in_conflict {
            self.end_conflict();
        }
        self.is_in_conflict = is_in_conflict;
        self.counts.intrusions += u64::from(step.is_loss() && self.conflict_severity == 0.0);
        self.conflict_severity = self.conflict_severity.max(step.proximity.severity);
        self.counts.well_clear_violations += u64::from(step.is_violation && !self.is_in_violation);
        self.is_in_violation = step.is_violation;
        self.counts.nmacs += u64::from(step.proximity.is_nmac && !self.is_in_nmac);
        self.is_in_nmac = step.proximity.is_nmac;
    }

    /// Adds the severity of the present conflict to the sums.
    fn end_conflict(&mut self) {
        let severity = std::mem::take(&mut self.conflict_severity);
        self.counts.severity_sum += severity;
        self.counts.max_severity = self.counts.max_severity.max(severity);
        self.is_in_conflict = false;
    }

    /// Returns it as if it ended now.
    fn ended(mut self) -> Self {
        self.end_conflict();
        self
    }
}

/// An encounter that has ended, or lasts at the end of a recording, for the table `pairs`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EncounterRecord {
    /// Cycle in which its end was found, or the one that comes next.
    pub(crate) cycle: Cycle,
    /// Ids of the two, the smaller one first.
    pub(crate) airplanes: [EntityId; 2],
    pub(crate) encounter: Encounter,
    /// Whether the shield had reported the pair by then.
    pub(crate) is_reported: bool,
    /// Whether it lasts.
    pub(crate) is_open: bool,
}

impl EncounterRecord {
    /// Returns the sort key of the table's rows. Two encounters of a pair in one cycle have different starts.
    pub(crate) fn sort_key(&self) -> (Cycle, [EntityId; 2], u64) {
        // Times are not negative, so that their bits are in their order.
        (self.cycle, self.airplanes, self.encounter.from_s.to_bits())
    }
}

/// The encounters of a run: those that last, and the sums of those that have ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Encounters {
    /// Sums of those that have ended.
    ended: EncounterCounts,
    /// Those that last, by ids.
    open: BTreeMap<(EntityId, EntityId), Encounter>,
}

impl Encounters {
    /// Returns the numbers of all encounters up to now, those among them that last.
    pub fn counts(&self) -> EncounterCounts {
        let mut counts = self.ended;
        for encounter in self.open.values() {
            counts.add(&encounter.ended().counts);
        }
        counts
    }

    /// Returns those that last after `now` cycles, as they are, by ids.
    pub(crate) fn open_records(&self, now: Cycle) -> impl Iterator<Item = EncounterRecord> {
        self.open.iter().map(move |(&(a, b), encounter)| EncounterRecord {
            cycle: now,
            airplanes: [a, b],
            encounter: encounter.ended(),
            is_reported: false,
            is_open: true,
        })
    }

    /// Ends those that have not been looked at in a cycle: the two are far apart, or one is gone.
    fn end_unseen(&mut self, cycle: Cycle, ended: &mut Vec<EncounterRecord>) {
        let unseen: Vec<_> = self
            .open
            .iter()
            .filter(|(_, encounter)| encounter.cycle != cycle)
            .map(|(&pair, &encounter)| (pair, encounter))
            .collect();
        for (pair, encounter) in unseen {
            self.open.remove(&pair);
            self.end(cycle, pair, encounter, ended);
        }
    }

    /// Adds an encounter that has ended to the sums.
    fn end(
        &mut self,
        cycle: Cycle,
        (a, b): (EntityId, EntityId),
        encounter: Encounter,
        ended: &mut Vec<EncounterRecord>,
    ) {
        let encounter = encounter.ended();
        self.ended.add(&encounter.counts);
        ended.push(EncounterRecord {
            cycle,
            airplanes: [a, b],
            encounter,
            is_reported: false,
            is_open: false,
        });
    }
}

#[cfg(test)]
mod count_tests {
    use super::*;

    fn step(k: u32, is_conflict: bool, is_violation: bool, severity: f64) -> EncounterStep {
        let proximity = Proximity {
            nearest_m: 900.0 - 100.0 * f64::from(k),
            vertical_m: f64::from(k),
            severity,
            is_nmac: severity > 0.8,
        };
        let from_s = f64::from(k);
        EncounterStep { from_s, until_s: from_s + 1.0, is_conflict, is_violation, proximity }
    }

    #[test]
    fn each_condition_is_counted_once_for_as_long_as_it_lasts() {
        let mut encounter = Encounter::new(0.0, 0);
        for one in [
            step(0, true, false, 0.0),
            step(1, true, true, 0.0),
            // The conflict is solved, and well clear is still violated.
            step(2, false, true, 0.0),
            step(3, true, false, 0.3),
            // Lost without having been predicted at the start of the step.
            step(4, false, false, 0.9),
            step(5, true, true, 0.0),
        ] {
            encounter.add_step(&one);
        }
        let counts = encounter.ended().counts;
        assert_eq!((counts.conflicts, counts.intrusions), (2, 1));
        assert_eq!((counts.well_clear_violations, counts.nmacs), (2, 1));
        assert_eq!((counts.severity_sum, counts.max_severity), (0.9, 0.9));
        assert_eq!(counts.intrusion_prevention_rate(), Some(0.5));
        assert_eq!((encounter.nearest_m, encounter.vertical_m), (400.0, 5.0));
        assert_eq!((encounter.from_s, encounter.until_s), (0.0, 6.0));
    }

    #[test]
    fn without_a_conflict_there_is_no_rate() {
        assert_eq!(EncounterCounts::default().intrusion_prevention_rate(), None);
        assert_eq!(EncounterCounts::default().mean_severity(), None);
    }
}
