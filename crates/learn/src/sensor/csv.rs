//! A sensor learned from readings with known true values.

use std::collections::BTreeMap;

use super::LearnedSensor;
use super::camera::{NOTHING, NamedRow, SensorProfile, certain_row, distance_rows};
use super::options::{BEYOND, DistanceClasses, SensorOptions, THREE_EDGES_M};
use super::readings::{LabeledReading, ParsedReadings, read};
use super::report::{ErrorMoments, SensorReport};
use crate::holdout::{HoldoutTest, holdout_test, split, tests_by_parts};
use crate::left_out::damage_warning;
use crate::{CountMatrix, CountTable, LeftOut};
use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;
use sidestep_statistics::Moments;

/// Learns the sensor; `classes` come from `options`.
pub(super) fn learn(
    table: &CsvTable,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<LearnedSensor, InputError> {
    let ParsedReadings { observations, readings, damaged, first_error } =
        read(table, options.sensor.as_deref(), classes)?;
    let log = ReadingLog { observations, classes, readings, rule: RULE };
    let mut model = log.model(table.place(), options);
    model.report.warnings.extend(name_warnings(&log.observations));
    if let Some(error) = first_error {
        let report = &mut model.report;
        report.measurements += damaged;
        report.skipped = damaged;
        report.skipped_by_cause.insert("damaged_row".to_string(), damaged);
        report.warnings.push(damage_warning(damaged, &error));
    }
    if options.beam {
        refuse_kinds_of_things(table, &log)?;
        model.fit_beam(&log.readings, [0.0, options.range_m]);
    }
    Ok(model)
}

/// Names that people give to an observation of nothing.
const NAMES_OF_NOTHING: [&str; 6] = ["none", "empty", "null", "free", "no_echo", "-"];

/// Returns warnings on names of observations that hardly mean things of their own.
fn name_warnings(observations: &[String]) -> Vec<String> {
    let mut warnings = Vec::new();
    for (k, name) in observations.iter().enumerate() {
        let other = observations[..k].iter().find(|other| other.eq_ignore_ascii_case(name));
        if let Some(other) = other {
            warnings.push(format!(
                "the observations `{}` and `{}` are two kinds of things here: their names differ in case alone",
                other.escape_debug(),
                name.escape_debug()
            ));
        }
        if NAMES_OF_NOTHING.contains(&name.to_ascii_lowercase().as_str()) {
            warnings.push(format!(
                "`{}` is a kind of thing here: no observation is written `nothing`",
                name.escape_debug()
            ));
        }
    }
    warnings
}

/// Refuses a table to which no beam model can be fitted.
fn refuse_kinds_of_things(table: &CsvTable, log: &ReadingLog<'_>) -> Result<(), InputError> {
    let cause = if log.observations.len() > 2 {
        let listed = log.observations.join(", ");
        format!("a beam model knows ranges only, and the table has the observations {listed}")
    } else if log.readings.iter().all(|reading| reading.ranges_m() == (None, None)) {
        "a beam model needs ranges in meters".to_string()
    } else {
        return Ok(());
    };
    let remedy =
        "give true_distance_m and reported_distance_m, and one observation beside `nothing`";
    Err(InputError::new(table.place(), cause, remedy))
}

/// The rule by which counts become rows.
const RULE: &str = "counts of true against reported, every count plus alpha";

/// All readings of one sensor.
pub(super) struct ReadingLog<'a> {
    /// `nothing`, then the others by name.
    pub(super) observations: Vec<String>,
    pub(super) classes: &'a DistanceClasses,
    pub(super) readings: Vec<LabeledReading>,
    /// The rule in words, for the profile.
    pub(super) rule: &'static str,
}

impl ReadingLog<'_> {
    /// Returns the sensor that the readings describe.
    pub(super) fn model(&self, source: &str, options: &SensorOptions) -> LearnedSensor {
        LearnedSensor { report: self.report(source, options), profile: self.profile(options) }
    }

    fn report(&self, source: &str, options: &SensorOptions) -> SensorReport {
        let n = self.readings.len() as u64;
        let all: Vec<&LabeledReading> = self.readings.iter().collect();
        let confusion = self.confusion(&all);
        let distance = self.distance(&all);
        let by_class = self.by_class();
        let tables: Vec<&CountTable> =
            [&confusion, &distance].into_iter().chain(&by_class).collect();
        SensorReport {
            source: source.to_owned(),
            measurements: n,
            sightings: n,
            skipped: 0,
            skipped_by_cause: BTreeMap::new(),
            correct: all.iter().filter(|r| r.truth == r.reported).count() as u64,
            nearest_agrees: None,
            unknown_codes: BTreeMap::new(),
            kinds: None,
            left_out: LeftOut::default(),
            distance_edges_m: self.classes.edges_from_zero_m(),
            distance_classes: self.classes.names.clone(),
            distance_counts_robots: None,
            distance_counts_landmarks: None,
            distance3_edges_m: THREE_EDGES_M,
            distance3_counts: self.three_classes(),
            errors: self.errors(),
            per_observer: BTreeMap::new(),
            detection: None,
            against_map: None,
            beam: None,
            probabilities: tables.iter().flat_map(|table| table.estimates()).collect(),
            thin: tables
                .iter()
                .flat_map(|t| t.low_count_rows(options.estimate.thin_below))
                .collect(),
            hold_out: self.holdout_tests(options),
            estimate: options.estimate,
            warnings: Vec::new(),
            distance_counts: CountMatrix(distance.clone()),
            confusion,
        }
    }

    fn confusion(&self, readings: &[&LabeledReading]) -> CountTable {
        let mut counts = CountTable::new("confusion", &self.observations, &self.observations);
        readings.iter().for_each(|r| counts.add(r.truth, r.reported, 1.0));
        counts
    }

    /// Counts the confusion of objects in each distance class; `nothing` has none.
    fn by_class(&self) -> Vec<CountTable> {
        let mut tables = Vec::new();
        for class in &self.classes.names {
            let name = format!("confusion_{class}");
            tables.push(CountTable::new(&name, &self.observations[1..], &self.observations));
        }
        for reading in &self.readings {
            if let Some(distance) = reading.true_at {
                tables[distance.class].add(reading.truth - 1, reading.reported, 1.0);
            }
        }
        tables
    }

    fn distance(&self, readings: &[&LabeledReading]) -> CountTable {
        let names = &self.classes.names;
        let mut counts = CountTable::new("distance", names, names);
        for (truth, reported) in readings.iter().filter_map(|r| r.correct_distances()) {
            counts.add(truth.class, reported.class, 1.0);
        }
        counts
    }

    fn three_classes(&self) -> Option<CountMatrix> {
        let classes = DistanceClasses::three_classes();
        let mut counts = CountTable::new("distance3", &classes.names, &classes.names);
        for (truth_m, reported_m) in self.correct_ranges_m() {
            counts.add(classes.class_of(truth_m), classes.class_of(reported_m), 1.0);
        }
        (counts.cells().iter().flatten().sum::<f64>() > 0.0).then_some(CountMatrix(counts))
    }

    fn correct_ranges_m(&self) -> impl Iterator<Item = (f64, f64)> {
        let right = self.readings.iter().filter_map(LabeledReading::correct_distances);
        right.filter_map(|(truth, reported)| Some((truth.range_m?, reported.range_m?)))
    }

    fn errors(&self) -> ErrorMoments {
        let errors_m = self.correct_ranges_m().map(|(truth_m, reported_m)| reported_m - truth_m);
        let classes = 0..self.classes.len();
        ErrorMoments {
            range_error_m: Moments::from_values(errors_m),
            range_error_by_true_class: classes.map(|class| self.errors_in_class(class)).collect(),
            bearing_error_rad: None,
        }
    }

    /// Returns the errors of ranges whose true value is in a class.
    fn errors_in_class(&self, class: usize) -> Option<Moments> {
        let ranges = self.correct_ranges_m();
        let in_class = ranges.filter(|(truth_m, _)| self.classes.class_of(*truth_m) == class);
        Moments::from_values(in_class.map(|(truth_m, reported_m)| reported_m - truth_m))
    }

    /// Counts the classes of reports where nothing was.
    fn beyond(&self) -> CountTable {
        let mut counts = CountTable::new(BEYOND, &[BEYOND.to_string()], &self.classes.names);
        let spurious = self.readings.iter().filter(|r| r.truth == 0);
        spurious.filter_map(|r| r.reported_at).for_each(|at| counts.add(0, at.class, 1.0));
        counts
    }

    fn holdout_tests(&self, options: &SensorOptions) -> Vec<HoldoutTest> {
        let alpha = options.estimate.alpha;
        let (train, held) = split(&self.readings, options.estimate.hold_out_every);
        let mut tests = vec![
            holdout_test(&self.confusion(&train), &self.confusion(&held), alpha),
            holdout_test(&self.distance(&train), &self.distance(&held), alpha),
        ];
        let confusion = |readings: &[&LabeledReading]| self.confusion(readings);
        tests.extend(tests_by_parts(&self.readings, |r| r.robot, confusion, alpha));
        let distance = |readings: &[&LabeledReading]| self.distance(readings);
        tests.extend(tests_by_parts(&self.readings, |r| r.robot, distance, alpha));
        tests
    }

    fn profile(&self, options: &SensorOptions) -> SensorProfile {
        let alpha = options.estimate.alpha;
        let mut assumed = Vec::new();
        let all: Vec<&LabeledReading> = self.readings.iter().collect();
        let confusion = self.confusion_rows(&self.confusion(&all), alpha, &mut assumed);
        let distance = self.distance(&all);
        SensorProfile {
            bearings_deg: options.bearings_deg.clone(),
            range_m: options.range_m,
            observations: self.observations.clone(),
            designates: self.unseen_kinds(),
            distance_edges_m: self.classes.edges_m.clone(),
            distance_classes: self.classes.names.clone(),
            confusion_by_class: self.rows_by_class(&confusion, alpha),
            confusion,
            distance_confusion: distance_rows(&distance, &self.beyond(), alpha, &mut assumed),
            assumed,
            rule: self.rule.to_string(),
        }
    }

    /// Returns the standard kinds that the sensor was never shown: it takes them for nothing.
    fn unseen_kinds(&self) -> Vec<(String, String)> {
        let mut unseen = Vec::new();
        for kind in ["wall", "door", "person", "robot"] {
            if !self.observations.iter().any(|name| name == kind) {
                unseen.push((kind.to_string(), NOTHING.to_string()));
            }
        }
        unseen
    }

    fn confusion_rows(
        &self,
        counts: &CountTable,
        alpha: f64,
        assumed: &mut Vec<String>,
    ) -> Vec<NamedRow> {
        let mut rows = Vec::new();
        for (index, name) in self.observations.iter().enumerate() {
            let row = counts.smoothed(index, alpha).unwrap_or_else(|| {
                assumed.push(format!("confusion of {name}: reported truly"));
                certain_row(self.observations.len(), index)
            });
            rows.push(NamedRow::new(name, &row));
        }
        rows
    }

    /// Returns the rows for each class; without counts in a class, that of all classes. `pooled`
    /// has them in the order of the observations. Empty where the file gives no distances.
    fn rows_by_class(&self, pooled: &[NamedRow], alpha: f64) -> Vec<(String, Vec<NamedRow>)> {
        if self.readings.iter().all(|reading| reading.true_at.is_none()) {
            return Vec::new();
        }
        let mut by_class = Vec::new();
        for (class, counts) in self.classes.names.iter().zip(self.by_class()) {
            let mut rows = Vec::new();
            for (index, name) in counts.rows().iter().enumerate() {
                rows.push(match counts.smoothed(index, alpha) {
                    Some(row) => NamedRow::new(name, &row),
                    // The table has no row for `nothing`, the first of `pooled`.
                    None => pooled[index + 1].clone(),
                });
            }
            by_class.push((class.clone(), rows));
        }
        by_class
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learned(text: &str, options: &SensorOptions) -> Result<LearnedSensor, InputError> {
        learn(&CsvTable::parse(&"f.csv", text)?, options, &options.check()?)
    }

    const METERS: &str = "true,reported,true_distance_m,reported_distance_m\n\
        robot,robot,1.0,1.2\nrobot,nothing,2.0,\nrobot,robot,1.4,1.6\n\
        nothing,robot,,1.0\nnothing,nothing,,\nnothing,nothing,beyond,beyond\n";

    #[test]
    fn names_that_hardly_mean_things_of_their_own_are_warned_of() {
        let text = METERS.replace("nothing", "none").replacen("robot,robot", "robot,Robot", 1);
        let warnings = learned(&text, &SensorOptions::default()).unwrap().report.warnings;
        assert!(
            warnings.iter().any(|w| w.contains("`Robot` and `robot` are two kinds")),
            "{warnings:?}"
        );
        assert!(
            warnings.iter().any(|w| w.starts_with("`none` is a kind of thing here")),
            "{warnings:?}"
        );
        assert_eq!(name_warnings(&["nothing".into(), "robot".into()]), Vec::<String>::new());
    }

    #[test]
    fn readings_in_meters_become_rows_by_class() {
        let options = SensorOptions {
            estimate: crate::EstimateOptions { alpha: 0.0, ..Default::default() },
            distance_edges_m: vec![1.5],
            ..Default::default()
        };
        let model = learned(METERS, &options).unwrap();
        assert_eq!(model.report.correct, 4);
        assert_eq!(model.report.distance_counts.0.cells(), [[1.0, 1.0], [0.0, 0.0]]);
        let profile = model.profile;
        assert_eq!(profile.observations, ["nothing", "robot"]);
        assert_eq!(profile.confusion[1].probabilities, [0.333_333_333, 0.666_666_667]);
        let (name, rows) = &profile.confusion_by_class[1];
        assert_eq!((name.as_str(), rows[0].probabilities.as_slice()), ("d1", &[1.0, 0.0][..]));
        let beyond = profile.distance_confusion.last().unwrap();
        assert_eq!((beyond.name.as_str(), beyond.probabilities[0]), ("beyond", 1.0));
        assert_eq!(profile.assumed, ["distance d1: reported truly"]);
    }

    #[test]
    fn readings_by_class_need_the_names_of_the_classes() {
        let text = "true,reported,true_class,reported_class\nrobot,robot,near,far\n";
        let options = SensorOptions {
            distance_edges_m: vec![2.0],
            distance_classes: ["near", "far"].map(String::from).to_vec(),
            ..Default::default()
        };
        let model = learned(text, &options).unwrap();
        assert_eq!(model.report.distance_counts.0.row(0), [0.0, 1.0]);
        assert_eq!(model.report.distance3_counts, None);
        let error = learned(text, &SensorOptions::default()).unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 13)));
        assert!(error.remedy().contains("d0, d1"));
    }

    #[test]
    fn one_of_several_sensors_must_be_chosen() {
        let text = "sensor,true,reported,true_distance_m,reported_distance_m\n\
            a,robot,robot,1,1\nb,wall,wall,1,1\n";
        let chosen = |sensor: Option<&str>| SensorOptions {
            sensor: sensor.map(String::from),
            ..Default::default()
        };
        assert!(learned(text, &chosen(None)).unwrap_err().cause().contains("a, b"));
        assert!(learned(text, &chosen(Some("c"))).unwrap_err().remedy().contains("a, b"));
        let model = learned(text, &chosen(Some("b"))).unwrap();
        assert_eq!(model.profile.observations, ["nothing", "wall"]);
    }

    #[test]
    fn damaged_rows_name_line_and_column() {
        let head = "true,reported,true_distance_m,reported_distance_m\n";
        let cases = [
            ("robot,robot,-1,1\n", (2, 13)),
            ("robot,robot,1,x\n", (2, 15)),
            ("robot,,1,1\n", (2, 7)),
            ("robot,robot,1\n", (2, 1)),
        ];
        for (row, position) in cases {
            let error = learned(&format!("{head}{row}"), &SensorOptions::default()).unwrap_err();
            assert_eq!(error.line_and_column(), Some(position), "{row}");
        }
        assert!(learned(head, &SensorOptions::default()).is_err(), "no readings");
        assert!(learned("true,reported\na,a\n", &SensorOptions::default()).is_err());
    }

    proptest::proptest! {
        #[test]
        fn any_rows_are_learned_or_refused(
            rows in "((nothing|wall|robot),(nothing|wall|robot),[0-9]{0,2},(beyond|[0-9]{0,2}|x)\n){0,9}",
            alpha in 0.0..2.0_f64,
        ) {
            let estimate = crate::EstimateOptions { alpha, ..Default::default() };
            let options = SensorOptions { estimate, ..Default::default() };
            let head = "true,reported,true_distance_m,reported_distance_m\n";
            if let Ok(model) = learned(&format!("{head}{rows}"), &options) {
                let by_class = model.profile.confusion_by_class.iter().flat_map(|(_, rows)| rows);
                let rows = model.profile.confusion.iter().chain(&model.profile.distance_confusion);
                for row in rows.chain(by_class) {
                    let sum: f64 = row.probabilities.iter().sum();
                    proptest::prop_assert!((sum - 1.0).abs() < 1e-9, "{:?}", row);
                }
            }
        }
    }
}
