//! The true subject of a barcode reading (rule L2).

use std::collections::BTreeMap;

use crate::track::{Pose2, pose_at};
use sidestep_import::mrclam::{Dataset, Measurement};
use sidestep_kernel::math::wrap_angle;

// The tolerances and spreads of rule L2 (see the module `sensor`): tolerances are several spreads wide, so that a
// reading with an error of the usual size is never taken for a false one.

/// A subject is consistent with a reading when the bearing differs by no more than this ...
const BEARING_TOLERANCE_RAD: f64 = 0.15;
/// ... and the range by no more than the greater of this ...
const RANGE_TOLERANCE_M: f64 = 0.5;
/// ... and this share of the true range.
const RANGE_TOLERANCE_FRACTION: f64 = 0.25;
/// Spread of the bearing by which candidates are weighed.
const BEARING_SPREAD_RAD: f64 = 0.03;
/// Spread of the range by which candidates are weighed, as a share of the true range.
const RANGE_SPREAD_FRACTION: f64 = 0.1;

/// One reading, and the subjects that it may be of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sighting {
    /// Number of the observing robot.
    pub(super) observer: u32,
    pub(super) barcode: u32,
    /// The subject that has the barcode; `None` when no subject has it.
    pub(super) decoded: Option<u32>,
    /// The subject that was really there; `None` where none fits the reading.
    pub(super) truth: Option<Candidate>,
    /// The subject that geometry alone would choose.
    pub(super) nearest: Option<u32>,
    pub(super) range_m: f64,
    pub(super) bearing_rad: f64,
}

impl Sighting {
    /// `None` where nothing that was there fits the reading.
    pub(super) fn subject(&self) -> Option<u32> {
        self.truth.map(|candidate| candidate.subject)
    }

    /// Returns the true subject's geometry, where the reading named it.
    pub(super) fn correct_candidate(&self) -> Option<Candidate> {
        self.truth.filter(|candidate| self.decoded == Some(candidate.subject))
    }
}

/// A subject that is consistent with a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) subject: u32,
    /// True range in meters, center to center.
    pub(super) range_m: f64,
    /// True bearing in radians, + to the left.
    pub(super) bearing_rad: f64,
    /// Squared distance from the reading, in spreads.
    misfit: f64,
}

/// The reason why a reading cannot be judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum SkipReason {
    /// The observer's own pose is unknown at that time.
    ObserverLost,
    /// The pose of the decoded robot is unknown at that time.
    SubjectLost,
}

impl SkipReason {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::ObserverLost => "observer_without_ground_truth",
            Self::SubjectLost => "subject_without_ground_truth",
        }
    }
}

/// Judges all readings of all robots; the others are counted by cause.
pub(super) fn associate_all(dataset: &Dataset) -> (Vec<Sighting>, BTreeMap<SkipReason, u64>) {
    let mut sightings = Vec::new();
    let mut skipped = BTreeMap::new();
    for (&observer, robot) in &dataset.robots {
        for measurement in &robot.measurements {
            match associate(dataset, observer, measurement) {
                Ok(sighting) => sightings.push(sighting),
                Err(cause) => *skipped.entry(cause).or_insert(0) += 1,
            }
        }
    }
    (sightings, skipped)
}

fn associate(
    dataset: &Dataset,
    observer: u32,
    reading: &Measurement,
) -> Result<Sighting, SkipReason> {
    let own_track = &dataset.robots[&observer].truth;
    let pose = pose_at(own_track, reading.t_secs).ok_or(SkipReason::ObserverLost)?;
    let decoded = dataset.subject_of_barcode.get(&reading.barcode).copied();
    let candidates = consistent_candidates(dataset, observer, &pose, reading);
    let nearest = candidates.iter().min_by(|a, b| a.misfit.total_cmp(&b.misfit)).copied();
    let as_decoded = candidates.iter().find(|c| Some(c.subject) == decoded).copied();
    let is_decoded_lost =
        decoded.is_some_and(|subject| position_of(dataset, subject, reading.t_secs).is_none());
    // The decoded robot may well have stood there; counting a misreading would blame the sensor for motion capture.
    if as_decoded.is_none() && is_decoded_lost {
        return Err(SkipReason::SubjectLost);
    }
    Ok(Sighting {
        observer,
        barcode: reading.barcode,
        decoded,
        truth: as_decoded.or(nearest),
        nearest: nearest.map(|candidate| candidate.subject),
        range_m: reading.range_m,
        bearing_rad: reading.bearing_rad,
    })
}

/// Returns all other subjects that are consistent with the reading, by subject number.
fn consistent_candidates(
    dataset: &Dataset,
    observer: u32,
    pose: &Pose2,
    reading: &Measurement,
) -> Vec<Candidate> {
    other_subjects(dataset, observer)
        .filter_map(|subject| {
            let (range_m, bearing_rad) =
                pose.range_and_bearing(position_of(dataset, subject, reading.t_secs)?);
            weighted_candidate(subject, range_m, bearing_rad, reading)
        })
        .collect()
}

/// Returns whether a measured range may be that of something at a true range.
pub(super) fn is_consistent(true_m: f64, measured_m: f64) -> bool {
    let tolerance_m = RANGE_TOLERANCE_M.max(RANGE_TOLERANCE_FRACTION * true_m);
    (measured_m - true_m).abs() <= tolerance_m
}

fn weighted_candidate(
    subject: u32,
    range_m: f64,
    bearing_rad: f64,
    reading: &Measurement,
) -> Option<Candidate> {
    let off_rad = wrap_angle(reading.bearing_rad - bearing_rad).abs();
    let off_m = (reading.range_m - range_m).abs();
    let u = off_rad / BEARING_SPREAD_RAD;
    let v = off_m / (RANGE_SPREAD_FRACTION * range_m);
    let is_near = off_rad <= BEARING_TOLERANCE_RAD && is_consistent(range_m, reading.range_m);
    is_near.then_some(Candidate { subject, range_m, bearing_rad, misfit: u * u + v * v })
}

/// Returns all subjects but `observer`: robots, then landmarks.
pub(super) fn other_subjects(dataset: &Dataset, observer: u32) -> impl Iterator<Item = u32> {
    let subjects = dataset.robots.keys().chain(dataset.landmarks.keys());
    subjects.copied().filter(move |subject| *subject != observer)
}

/// Returns the position of a subject at a time; `None` for a robot without ground truth then.
pub(super) fn position_of(dataset: &Dataset, subject: u32, t_secs: f64) -> Option<[f64; 2]> {
    if let Some(position_m) = dataset.landmarks.get(&subject) {
        return Some(*position_m);
    }
    let pose = pose_at(&dataset.robots.get(&subject)?.truth, t_secs)?;
    Some([pose.x_m, pose.y_m])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use sidestep_import::ImportReport;
    use sidestep_import::mrclam::{RobotLog, StampedPose2};

    /// Robot 1 stands at the origin and looks along x from t = 0 to 10 s; robot 2 stands at
    /// (3, 0) until t = 5 s; landmarks 6 and 7 at (2, 0.5) and (2, -0.5). Barcodes are ten
    /// times the subject.
    pub(in crate::sensor) fn scene(measurements: Vec<Measurement>) -> Dataset {
        let still = |x: f64, until: u32| {
            let at = |i| StampedPose2 {
                t_secs: f64::from(i) * 0.25,
                position_m: [x, 0.0],
                heading_rad: 0.0,
            };
            (0..=until * 4).map(at).collect()
        };
        let first = RobotLog { truth: still(0.0, 10), measurements, ..Default::default() };
        let second = RobotLog { truth: still(3.0, 5), ..Default::default() };
        Dataset {
            subject_of_barcode: [1, 2, 6, 7].map(|s| (s * 10, s)).into(),
            landmarks: [(6, [2.0, 0.5]), (7, [2.0, -0.5])].into(),
            robots: [(1, first), (2, second)].into(),
            report: ImportReport::default(),
        }
    }

    pub(in crate::sensor) fn reading(
        t_secs: f64,
        barcode: u32,
        range_m: f64,
        bearing_rad: f64,
    ) -> Measurement {
        Measurement { t_secs, barcode, range_m, bearing_rad }
    }

    fn judged(reading: Measurement) -> Result<Option<u32>, SkipReason> {
        associate(&scene(Vec::new()), 1, &reading).map(|sighting| sighting.subject())
    }

    #[test]
    fn a_consistent_decoded_subject_is_the_true_one_though_another_is_nearer() {
        // Between robot 2 and landmark 6, both within the tolerance, the robot closer.
        let sighting = associate(&scene(Vec::new()), 1, &reading(1.0, 60, 2.5, 0.11)).unwrap();
        assert_eq!((sighting.nearest, sighting.subject()), (Some(2), Some(6)));
        let misread = associate(&scene(Vec::new()), 1, &reading(1.0, 70, 2.06, 0.245)).unwrap();
        assert_eq!((misread.subject(), misread.decoded), (Some(6), Some(7)));
        assert_eq!(misread.correct_candidate(), None);
    }

    #[test]
    fn a_reading_of_nothing_or_of_an_unknown_code_is_counted_as_such() {
        assert_eq!(judged(reading(1.0, 60, 2.0, -1.5)), Ok(None));
        assert_eq!(judged(reading(1.0, 99, 3.0, 0.0)), Ok(Some(2)));
    }

    #[test]
    fn a_lost_observer_or_decoded_robot_skips_the_reading() {
        assert_eq!(judged(reading(11.0, 60, 2.0, 0.0)), Err(SkipReason::ObserverLost));
        assert_eq!(judged(reading(6.0, 20, 3.0, 0.0)), Err(SkipReason::SubjectLost));
        assert_eq!(judged(reading(6.0, 10, 2.06, 0.245)), Ok(Some(6)), "one's own code");
    }

    #[test]
    fn tolerances_are_met_on_the_edge() {
        assert_eq!(judged(reading(1.0, 20, 3.75, 0.0)), Ok(Some(2)), "25 % of 3 m");
        assert_eq!(judged(reading(1.0, 20, 3.76, 0.0)), Ok(None));
        assert_eq!(judged(reading(1.0, 20, 3.0, 0.151)), Ok(None));
    }
}
