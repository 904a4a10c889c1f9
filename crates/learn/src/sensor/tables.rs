//! Counts over barcode readings.

use super::options::{BEYOND, DistanceClasses};
use super::sighting::{Candidate, Sighting};
use crate::CountTable;
use sidestep_import::mrclam::Dataset;

/// Row of a table of kinds, and column: a robot.
pub(super) const ROBOT: usize = 0;
/// Row of a table of kinds, and column: a landmark.
pub(super) const LANDMARK: usize = 1;
/// Row of a table of kinds: no subject. The column is a code that no subject has.
pub(super) const NO_SUBJECT: usize = 2;

/// The names of a data set's subjects in tables.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SubjectLabels {
    /// Subject numbers, in increasing order.
    subjects: Vec<u32>,
    /// Those that are robots; all others are landmarks.
    robots: Vec<u32>,
}

impl SubjectLabels {
    pub(super) fn from_dataset(dataset: &Dataset) -> Self {
        let robots: Vec<u32> = dataset.robots.keys().copied().collect();
        let mut subjects: Vec<u32> = robots.clone();
        subjects.extend(dataset.landmarks.keys());
        subjects.extend(dataset.subject_of_barcode.values());
        subjects.sort_unstable();
        subjects.dedup();
        Self { subjects, robots }
    }

    /// Returns the position of a subject among rows and columns; `None` comes last.
    fn index(&self, subject: Option<u32>) -> usize {
        let known = subject.and_then(|subject| self.subjects.binary_search(&subject).ok());
        known.unwrap_or(self.subjects.len())
    }

    fn kind(&self, subject: Option<u32>) -> usize {
        match subject {
            None => NO_SUBJECT,
            Some(subject) if self.robots.contains(&subject) => ROBOT,
            Some(_) => LANDMARK,
        }
    }

    /// Counts the true subject against the decoded subject.
    pub(super) fn confusion(&self, sightings: &[Sighting]) -> CountTable {
        let mut rows: Vec<String> = self.subjects.iter().map(|s| format!("S{s}")).collect();
        let mut columns = rows.clone();
        rows.push("NONE".to_string());
        columns.push("UNKNOWN".to_string());
        let mut counts = CountTable::new("confusion", &rows, &columns);
        for sighting in sightings {
            counts.add(self.index(sighting.subject()), self.index(sighting.decoded), 1.0);
        }
        counts
    }

    /// Counts the same by kind.
    pub(super) fn kinds<'a>(
        &self,
        sightings: impl IntoIterator<Item = &'a Sighting>,
    ) -> CountTable {
        let rows = ["ROBOT", "LANDMARK", "NONE"].map(String::from);
        let columns = ["ROBOT", "LANDMARK", "UNKNOWN"].map(String::from);
        let mut counts = CountTable::new("kinds", &rows, &columns);
        for sighting in sightings {
            counts.add(self.kind(sighting.subject()), self.kind(sighting.decoded), 1.0);
        }
        counts
    }

    /// Returns whether the true subject is of `kind`.
    pub(super) fn is_of_kind(&self, sighting: &Sighting, kind: usize) -> bool {
        self.kind(sighting.subject()) == kind
    }
}

/// Counts the class of the true range against that of the measured range, over correct readings.
pub(super) fn distance<'a>(
    name: &str,
    sightings: impl IntoIterator<Item = &'a Sighting>,
    classes: &DistanceClasses,
) -> CountTable {
    let mut counts = CountTable::new(name, &classes.names, &classes.names);
    for sighting in sightings {
        if let Some(Candidate { range_m, .. }) = sighting.correct_candidate() {
            counts.add(classes.class_of(range_m), classes.class_of(sighting.range_m), 1.0);
        }
    }
    counts
}

/// Counts the class of the measured range where there was no subject.
pub(super) fn beyond(sightings: &[Sighting], classes: &DistanceClasses) -> CountTable {
    let mut counts = CountTable::new(BEYOND, &[BEYOND.to_string()], &classes.names);
    for sighting in sightings.iter().filter(|sighting| sighting.truth.is_none()) {
        counts.add(0, classes.class_of(sighting.range_m), 1.0);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::super::sighting::associate_all;
    use super::super::sighting::tests::{reading, scene};
    use super::*;

    #[test]
    fn readings_are_counted_by_subject_by_kind_and_by_distance() {
        let dataset = scene(vec![
            reading(1.0, 20, 3.2, 0.0),
            reading(1.0, 60, 3.0, 0.0),
            reading(1.0, 99, 3.0, 0.0),
            reading(1.0, 60, 1.0, -1.5),
        ]);
        let (sightings, _) = associate_all(&dataset);
        let labels = SubjectLabels::from_dataset(&dataset);
        let confusion = serde_json::to_value(labels.confusion(&sightings)).unwrap();
        let expected = serde_json::json!({
            "S2": {"S2": 1, "S6": 1, "UNKNOWN": 1}, "NONE": {"S6": 1}
        });
        assert_eq!(confusion, expected);
        assert_eq!(labels.kinds(&sightings).row(ROBOT), [1.0, 1.0, 1.0]);
        assert_eq!(labels.kinds(&sightings).row(NO_SUBJECT), [0.0, 1.0, 0.0]);
        let classes = DistanceClasses::new(&[2.0, 3.1], &[]).unwrap();
        assert_eq!(distance("d", &sightings, &classes).row(1), [0.0, 0.0, 1.0]);
        assert_eq!(beyond(&sightings, &classes).row(0), [1.0, 0.0, 0.0]);
    }
}
