//! A camera learned from an MRCLAM folder.

use std::collections::BTreeMap;

use super::LearnedSensor;
use super::camera::{CameraCountTables, camera};
use super::detection::{Detection, views};
use super::options::{DistanceClasses, SensorOptions, THREE_EDGES_M};
use super::report::{ErrorMoments, SensorReport};
use super::sighting::{Sighting, SkipReason, associate_all};
use super::tables::{LANDMARK, ROBOT, SubjectLabels, beyond, distance};
use crate::holdout::{HoldoutTest, holdout_test, split, tests_by_parts};
use crate::{CountMatrix, CountTable, Estimate, LeftOut};
use sidestep_import::mrclam::Dataset;
use sidestep_kernel::InputError;
use sidestep_kernel::math::wrap_angle;
use sidestep_statistics::Moments;

/// Learns the camera; `classes` come from `options`.
pub(super) fn learn(
    source: &str,
    dataset: &Dataset,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<LearnedSensor, InputError> {
    let log = AssociatedLog::associate(source, dataset, classes)?;
    let report = log.report(source, options);
    let looks = CameraCountTables {
        kinds: &log.labels.kinds(&log.sightings),
        detection: &log.detection(),
        distance: &distance("distance", &log.sightings, classes),
        beyond: &beyond(&log.sightings, classes),
    };
    Ok(LearnedSensor { report, profile: camera(&looks, options, classes) })
}

/// A data set after every reading and every bin has been judged.
struct AssociatedLog<'a> {
    labels: SubjectLabels,
    classes: &'a DistanceClasses,
    sightings: Vec<Sighting>,
    skipped: BTreeMap<SkipReason, u64>,
    views: Vec<super::detection::SubjectView>,
    looks: u64,
}

impl<'a> AssociatedLog<'a> {
    fn associate(
        source: &str,
        dataset: &Dataset,
        classes: &'a DistanceClasses,
    ) -> Result<Self, InputError> {
        let (sightings, skipped) = associate_all(dataset);
        if sightings.is_empty() {
            let cause = "no barcode reading could be judged by ground truth";
            let remedy = "check that measurements and ground truth share one clock";
            return Err(InputError::new(source, cause, remedy));
        }
        let (views, looks) = views(dataset, classes);
        Ok(Self {
            labels: SubjectLabels::from_dataset(dataset),
            classes,
            sightings,
            skipped,
            views,
            looks,
        })
    }

    fn detection(&self) -> Detection {
        Detection::from_views(&self.views, self.looks, self.classes)
    }

    fn report(&self, source: &str, options: &SensorOptions) -> SensorReport {
        let skipped = self.skipped.values().sum();
        let sightings = &self.sightings;
        let confusion = self.labels.confusion(sightings);
        let kinds = self.labels.kinds(sightings);
        let detection = self.detection();
        let all_distances = distance("distance", sightings, self.classes);
        let [all, robots, landmarks] = detection.tables();
        let tables = [&kinds, &all_distances, all, robots, landmarks];
        SensorReport {
            source: source.to_owned(),
            measurements: sightings.len() as u64 + skipped,
            sightings: sightings.len() as u64,
            skipped,
            skipped_by_cause: self.skipped.iter().map(|(k, v)| (k.name().into(), *v)).collect(),
            correct: count(sightings, |s| s.correct_candidate().is_some()),
            nearest_agrees: Some(count(sightings, |s| {
                s.nearest.is_some() && s.nearest == s.decoded
            })),
            unknown_codes: self.unknown_codes(),
            left_out: LeftOut::default(),
            distance_edges_m: self.classes.edges_from_zero_m(),
            distance_classes: self.classes.names.clone(),
            distance_counts_robots: Some(self.distance_counts(ROBOT)),
            distance_counts_landmarks: Some(self.distance_counts(LANDMARK)),
            distance3_edges_m: THREE_EDGES_M,
            distance3_counts: Some(three_classes(sightings)),
            errors: errors(sightings, Some(self.classes)),
            per_observer: self.per_observer(),
            probabilities: nonzero_estimates(&confusion)
                .chain(tables.iter().flat_map(|t| t.estimates()))
                .collect(),
            thin: tables
                .iter()
                .flat_map(|t| t.low_count_rows(options.estimate.thin_below))
                .collect(),
            hold_out: self.holdout_tests(options),
            estimate: options.estimate,
            warnings: Vec::new(),
            distance_counts: CountMatrix(all_distances.clone()),
            detection: Some(detection.clone()),
            against_map: None,
            beam: None,
            kinds: Some(kinds.clone()),
            confusion,
        }
    }

    fn unknown_codes(&self) -> BTreeMap<u32, u64> {
        let mut codes = BTreeMap::new();
        for sighting in self.sightings.iter().filter(|s| s.decoded.is_none()) {
            *codes.entry(sighting.barcode).or_insert(0) += 1;
        }
        codes
    }

    fn distance_counts(&self, kind: usize) -> CountMatrix {
        let of_kind = self.sightings.iter().filter(|s| self.labels.is_of_kind(s, kind));
        CountMatrix(distance("distance", of_kind, self.classes))
    }

    fn per_observer(&self) -> BTreeMap<u32, ErrorMoments> {
        let mut by_observer: BTreeMap<u32, Vec<&Sighting>> = BTreeMap::new();
        for sighting in &self.sightings {
            by_observer.entry(sighting.observer).or_default().push(sighting);
        }
        by_observer.into_iter().map(|(observer, seen)| (observer, errors(seen, None))).collect()
    }

    fn holdout_tests(&self, options: &SensorOptions) -> Vec<HoldoutTest> {
        let every = options.estimate.hold_out_every;
        let alpha = options.estimate.alpha;
        let (train, held) = split(&self.sightings, every);
        let train_kinds = self.labels.kinds(train.iter().copied());
        let held_kinds = self.labels.kinds(held.iter().copied());
        let train_distances = distance("distance", train, self.classes);
        let held_distances = distance("distance", held, self.classes);
        let (train_views, held_views) = split(&self.views, every);
        let train_detection = Detection::from_views(train_views, 0, self.classes);
        let held_detection = Detection::from_views(held_views, 0, self.classes);
        let mut tests = vec![
            holdout_test(&train_kinds, &held_kinds, alpha),
            holdout_test(&train_distances, &held_distances, alpha),
            holdout_test(&train_detection.all, &held_detection.all, alpha),
        ];
        let kinds = |seen: &[&Sighting]| self.labels.kinds(seen.iter().copied());
        tests.extend(tests_by_parts(&self.sightings, |s| s.observer, kinds, alpha));
        let distances =
            |seen: &[&Sighting]| distance("distance", seen.iter().copied(), self.classes);
        tests.extend(tests_by_parts(&self.sightings, |s| s.observer, distances, alpha));
        tests
    }
}

fn count(sightings: &[Sighting], is_counted: impl Fn(&Sighting) -> bool) -> u64 {
    sightings.iter().filter(|sighting| is_counted(sighting)).count() as u64
}

/// For the confusion of subjects, a large table with mostly empty cells.
pub(super) fn nonzero_estimates(table: &CountTable) -> impl Iterator<Item = Estimate> {
    table.estimates().into_iter().filter(|estimate| estimate.count > 0.0)
}

fn three_classes(sightings: &[Sighting]) -> CountMatrix {
    CountMatrix(distance("distance3", sightings, &DistanceClasses::three_classes()))
}

/// Returns errors over the correct readings; by class of the true range where `classes` are given.
fn errors<'s>(
    sightings: impl IntoIterator<Item = &'s Sighting>,
    classes: Option<&DistanceClasses>,
) -> ErrorMoments {
    let correct: Vec<MeasurementError> =
        sightings.into_iter().filter_map(MeasurementError::of_correct).collect();
    let mut by_class = Vec::new();
    if let Some(classes) = classes {
        for class in 0..classes.len() {
            let in_class = correct.iter().filter(|e| classes.class_of(e.true_range_m) == class);
            by_class.push(Moments::from_values(in_class.map(|e| e.range_m)));
        }
    }
    ErrorMoments {
        range_error_m: Moments::from_values(correct.iter().map(|e| e.range_m)),
        range_error_by_true_class: by_class,
        bearing_error_rad: Moments::from_values(correct.iter().map(|e| e.bearing_rad)),
    }
}

/// The errors of one correct reading, measured minus true.
struct MeasurementError {
    true_range_m: f64,
    range_m: f64,
    bearing_rad: f64,
}

impl MeasurementError {
    /// Returns the errors; `None` where the reading is not correct.
    fn of_correct(sighting: &Sighting) -> Option<Self> {
        let truth = sighting.correct_candidate()?;
        Some(Self {
            true_range_m: truth.range_m,
            range_m: sighting.range_m - truth.range_m,
            bearing_rad: wrap_angle(sighting.bearing_rad - truth.bearing_rad),
        })
    }
}
