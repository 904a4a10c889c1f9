//! The rate at which a subject in view is read (rule L4).

use serde::Serialize;

use super::options::DistanceClasses;
use super::sighting::{other_subjects, position_of};
use crate::CountTable;
use crate::track::pose_at;
use sidestep_import::mrclam::{Dataset, RobotLog};

/// Half of the angle within which a subject is surely in view: 23 of the camera's 30 degrees to each side, so that
/// a subject that leaves the view within the bin does not count as missed.
const HALF_FIELD_OF_VIEW_RAD: f64 = 0.40;
/// Length of a bin in seconds; one cycle of a simulation stands for one bin.
const BIN_SECS: f64 = 1.0;
/// Largest number of bins; a longer log (eleven days) is taken for damaged time stamps.
const MAX_BINS: f64 = 1e6;

/// Detection by distance class: rows are classes, columns `seen` and `missed`.
///
/// Time is cut into bins of 1 s from the observer's first to its last common time stamp. A subject
/// is in view in a bin when its true bearing at mid-bin is within 0.40 rad, and seen when its code
/// was read in the bin. Occlusion is not known: a subject hidden behind another counts as missed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detection {
    /// Number of bins, over all observers, in which the observer's pose is known.
    pub looks: u64,
    /// Counts over all subjects.
    pub all: CountTable,
    /// Counts over robots only.
    pub robots: CountTable,
    /// Counts over landmarks only.
    pub landmarks: CountTable,
}

impl Detection {
    /// Returns the tables, most general first.
    pub fn tables(&self) -> [&CountTable; 3] {
        [&self.all, &self.robots, &self.landmarks]
    }

    pub(super) fn from_views<'a>(
        views: impl IntoIterator<Item = &'a SubjectView>,
        looks: u64,
        classes: &DistanceClasses,
    ) -> Self {
        let columns = ["seen", "missed"].map(String::from);
        let mut detection = Self {
            looks,
            all: CountTable::new("detection", &classes.names, &columns),
            robots: CountTable::new("detection_robot", &classes.names, &columns),
            landmarks: CountTable::new("detection_landmark", &classes.names, &columns),
        };
        for view in views {
            let by_kind =
                if view.is_robot { &mut detection.robots } else { &mut detection.landmarks };
            by_kind.add(view.class, usize::from(!view.seen), 1.0);
            detection.all.add(view.class, usize::from(!view.seen), 1.0);
        }
        detection
    }
}

/// One subject in view of one observer in one bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SubjectView {
    is_robot: bool,
    /// Distance class of the true range at mid-bin.
    class: usize,
    seen: bool,
}

/// Returns all subjects in view, over all bins of all observers, and the number of bins with a
/// pose.
pub(super) fn views(dataset: &Dataset, classes: &DistanceClasses) -> (Vec<SubjectView>, u64) {
    let mut views = Vec::new();
    let mut looks = 0;
    for (&observer, robot) in &dataset.robots {
        let Some((start_secs, n_bins)) = bins(robot) else { continue };
        let read = codes_by_bin(dataset, robot, start_secs, n_bins);
        for (bin, read) in read.iter().enumerate() {
            let middle_secs = start_secs + (bin as f64 + 0.5) * BIN_SECS;
            looks += u64::from(pose_at(&robot.truth, middle_secs).is_some());
            views.extend(subjects_in_view(dataset, observer, middle_secs, read, classes));
        }
    }
    (views, looks)
}

/// Returns the start of the first bin and the number of whole bins common to all three streams.
fn bins(robot: &RobotLog) -> Option<(f64, usize)> {
    let truth = robot.truth.iter().map(|sample| sample.t_secs);
    let commands = robot.commands.iter().map(|command| command.t_secs);
    let readings = robot.measurements.iter().map(|reading| reading.t_secs);
    let truth = first_and_last(truth)?;
    let commands = first_and_last(commands)?;
    let readings = first_and_last(readings)?;
    let start_secs = truth.0.max(commands.0).max(readings.0);
    let end_secs = truth.1.min(commands.1).min(readings.1);
    let n_bins = ((end_secs - start_secs) / BIN_SECS).floor();
    (1.0..=MAX_BINS).contains(&n_bins).then_some((start_secs, n_bins as usize))
}

/// `None` without any; stamps are taken to be in order.
fn first_and_last(mut stamps: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let first = stamps.next()?;
    Some((first, stamps.last().unwrap_or(first)))
}

/// A subject that is read several times in a bin is listed as often.
fn codes_by_bin(
    dataset: &Dataset,
    robot: &RobotLog,
    start_secs: f64,
    n_bins: usize,
) -> Vec<Vec<u32>> {
    let mut read = vec![Vec::new(); n_bins];
    for reading in &robot.measurements {
        let bin = ((reading.t_secs - start_secs) / BIN_SECS).floor();
        let is_in_bins = bin >= 0.0 && bin < n_bins as f64;
        if let Some(subject) = dataset.subject_of_barcode.get(&reading.barcode)
            && is_in_bins
        {
            read[bin as usize].push(*subject);
        }
    }
    read
}

fn subjects_in_view(
    dataset: &Dataset,
    observer: u32,
    t_secs: f64,
    read: &[u32],
    classes: &DistanceClasses,
) -> Vec<SubjectView> {
    let Some(pose) = pose_at(&dataset.robots[&observer].truth, t_secs) else { return Vec::new() };
    other_subjects(dataset, observer)
        .filter_map(|subject| {
            let (range_m, bearing_rad) =
                pose.range_and_bearing(position_of(dataset, subject, t_secs)?);
            (bearing_rad.abs() <= HALF_FIELD_OF_VIEW_RAD).then(|| SubjectView {
                is_robot: dataset.robots.contains_key(&subject),
                class: classes.class_of(range_m),
                seen: read.contains(&subject),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::sighting::tests::{reading, scene};
    use super::*;
    use sidestep_import::mrclam::VelocityCommand;

    #[test]
    fn a_subject_in_view_is_seen_in_the_bins_in_which_it_was_read() {
        let mut dataset = scene(vec![
            reading(0.0, 60, 2.06, 0.245),
            reading(1.2, 60, 2.06, 0.245),
            reading(1.3, 60, 2.06, 0.245),
            reading(4.0, 99, 2.06, 0.245),
        ]);
        let command = |t_secs| VelocityCommand { t_secs, forward_mps: 0.0, turn_radps: 0.0 };
        dataset.robots.get_mut(&1).unwrap().commands = vec![command(0.0), command(9.0)];
        let classes = DistanceClasses::new(&[2.5], &[]).unwrap();
        let (views, looks) = views(&dataset, &classes);
        let detection = Detection::from_views(&views, looks, &classes);
        assert_eq!(detection.looks, 4, "four whole bins; robot 2 logged no commands");
        assert_eq!(detection.landmarks.row(0), [2.0, 6.0]);
        assert_eq!(detection.robots.row(1), [0.0, 4.0]);
        assert_eq!(detection.all.row(0), [2.0, 6.0]);
    }

    #[test]
    fn a_log_with_absurd_time_stamps_has_no_bins() {
        let mut dataset = scene(vec![reading(0.0, 60, 2.0, 0.0), reading(1e12, 60, 2.0, 0.0)]);
        let robot = dataset.robots.get_mut(&1).unwrap();
        let command = |t_secs| VelocityCommand { t_secs, forward_mps: 0.0, turn_radps: 0.0 };
        robot.commands = vec![command(0.0), command(1e12)];
        let mut truth = robot.truth.to_vec();
        truth.last_mut().unwrap().t_secs = 1e12;
        robot.truth = truth.into();
        assert_eq!(bins(robot), None);
    }
}
