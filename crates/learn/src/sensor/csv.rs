//! A sensor learned from readings with known true values.

use std::collections::BTreeMap;

use super::LearnedSensor;
use super::camera::{NOTHING, NamedRow, SensorProfile, certain_row, distance_rows};
use super::options::{BEYOND, DistanceClasses, SensorOptions, THREE_EDGES_M};
use super::readings::{LabeledReading, ParsedReadings, ReadingRule, Readings, read};
use super::report::{ErrorMoments, SensorReport};
use crate::holdout::{
    HoldoutTest, PartCounter, PartTables, TIME_PARTS, holdout_test, tests_of_tables,
};
use crate::left_out::damage_warning;
use crate::log_table::LogTable;
use crate::{CountMatrix, CountTable, LeftOut};
use sidestep_kernel::InputError;
use sidestep_statistics::Moments;

/// Learns the sensor; `classes` come from `options`.
pub(super) fn learn(
    table: &dyn LogTable,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<LearnedSensor, InputError> {
    let sensor = options.sensor.as_deref();
    let rule = ReadingRule { sensor, classes, needs_scans: options.beam };
    let ParsedReadings { observations, readings, damaged, first_error } = read(table, &rule)?;
    let log = ReadingLog { observations, classes, readings: &readings, rule: RULE };
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
        model.fit_beam(&readings, [0.0, options.range_m]);
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
fn refuse_kinds_of_things(table: &dyn LogTable, log: &ReadingLog<'_>) -> Result<(), InputError> {
    let cause = if log.observations.len() > 2 {
        let listed = log.observations.join(", ");
        format!("a beam model knows ranges only, and the table has the observations {listed}")
    } else if !log.has_ranges() {
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
    pub(super) readings: &'a dyn Readings,
    /// The rule in words, for the profile.
    pub(super) rule: &'static str,
}

/// Counts of some readings, row by row.
#[derive(Debug, Clone)]
struct PairCounts {
    n: usize,
    /// True against reported observations.
    confusion: Vec<f64>,
    /// True against reported classes of distance, of correct reports.
    distance: Vec<f64>,
}

impl PairCounts {
    fn new(log: &ReadingLog<'_>) -> Self {
        let [observations, classes] = log.sizes();
        Self {
            n: 0,
            confusion: vec![0.0; observations * observations],
            distance: vec![0.0; classes * classes],
        }
    }

    /// Adds a reading to tables of this many observations and classes.
    fn add(&mut self, [observations, classes]: [usize; 2], reading: &LabeledReading) {
        self.n += 1;
        self.confusion[reading.truth * observations + reading.reported] += 1.0;
        if let Some((truth, reported)) = reading.correct_distances() {
            self.distance[truth.class * classes + reported.class] += 1.0;
        }
    }

    /// Returns the counts of both; sums of whole numbers are exact in any order.
    fn plus(&self, other: &Self) -> Self {
        let sums = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self {
            n: self.n + other.n,
            confusion: sums(&self.confusion, &other.confusion),
            distance: sums(&self.distance, &other.distance),
        }
    }
}

/// All counts of readings.
struct ReadingCounts {
    all: PairCounts,
    learned: PairCounts,
    held_out: PairCounts,
    /// Of each quarter of the time.
    quarters: Vec<PairCounts>,
    /// Of each robot, by rising numbers.
    robots: Vec<(u32, PairCounts)>,
    /// The confusion of objects in each distance class; `nothing` has none.
    by_class: Vec<CountTable>,
    /// True against reported distance in three classes.
    three_classes: CountTable,
    /// The classes of reports where nothing was.
    beyond: CountTable,
    /// Number of readings with a true distance.
    with_distance: usize,
    /// Number of correct reports with both ranges in meters, by class of the true one.
    ranges_by_class: Vec<usize>,
}

impl ReadingCounts {
    fn new(log: &ReadingLog<'_>, hold_out_every: usize) -> Self {
        let mut parts = PartCounter::default();
        log.readings.visit(&mut |reading| parts.count(reading.robot));
        let mut counts = Self::empty(log);
        let sizes = log.sizes();
        let three = DistanceClasses::three_classes();
        let mut robots = vec![PairCounts::new(log); parts.robots().count()];
        let mut n = 0;
        log.readings.visit(&mut |reading| {
            let is_held_out = n % hold_out_every == hold_out_every - 1;
            n += 1;
            let sample = if is_held_out { &mut counts.held_out } else { &mut counts.learned };
            sample.add(sizes, reading);
            let places = parts.next(reading.robot);
            counts.quarters[places.quarter].add(sizes, reading);
            robots[places.robot].add(sizes, reading);
            counts.add_distances(log, &three, reading);
        });
        counts.robots =
            parts.robots().map(|(number, place)| (number, robots[place].clone())).collect();
        counts.all = counts.learned.plus(&counts.held_out);
        counts
    }

    fn empty(log: &ReadingLog<'_>) -> Self {
        let names = &log.classes.names;
        let table_of_class = |class: &String| {
            let name = format!("confusion_{class}");
            CountTable::new(&name, &log.observations[1..], &log.observations)
        };
        let three = DistanceClasses::three_classes().names;
        Self {
            all: PairCounts::new(log),
            learned: PairCounts::new(log),
            held_out: PairCounts::new(log),
            quarters: vec![PairCounts::new(log); TIME_PARTS],
            robots: Vec::new(),
            by_class: names.iter().map(table_of_class).collect(),
            three_classes: CountTable::new("distance3", &three, &three),
            beyond: CountTable::new(BEYOND, &[BEYOND.to_string()], names),
            with_distance: 0,
            ranges_by_class: vec![0; names.len()],
        }
    }

    fn add_distances(
        &mut self,
        log: &ReadingLog<'_>,
        three: &DistanceClasses,
        reading: &LabeledReading,
    ) {
        if let Some(distance) = reading.true_at {
            self.with_distance += 1;
            self.by_class[distance.class].add(reading.truth - 1, reading.reported, 1.0);
        }
        if let Some(distance) = reading.reported_at
            && reading.truth == 0
        {
            self.beyond.add(0, distance.class, 1.0);
        }
        if let Some((true_m, reported_m)) = reading.correct_ranges_m() {
            self.three_classes.add(three.class_of(true_m), three.class_of(reported_m), 1.0);
            self.ranges_by_class[log.classes.class_of(true_m)] += 1;
        }
    }
}

impl ReadingLog<'_> {
    /// Returns the sensor that the readings describe.
    pub(super) fn model(&self, source: &str, options: &SensorOptions) -> LearnedSensor {
        let counts = ReadingCounts::new(self, options.estimate.hold_out_every);
        LearnedSensor {
            report: self.report(source, &counts, options),
            profile: self.profile(&counts, options),
        }
    }

    /// Returns the numbers of observations and of distance classes.
    fn sizes(&self) -> [usize; 2] {
        [self.observations.len(), self.classes.len()]
    }

    /// Returns whether any reading has a range in meters.
    fn has_ranges(&self) -> bool {
        let mut has_any = false;
        self.readings.visit(&mut |reading| has_any |= reading.ranges_m() != (None, None));
        has_any
    }

    fn report(
        &self,
        source: &str,
        counts: &ReadingCounts,
        options: &SensorOptions,
    ) -> SensorReport {
        let n = counts.all.n as u64;
        let confusion = self.confusion(&counts.all);
        let distance = self.distance(&counts.all);
        let tables: Vec<&CountTable> =
            [&confusion, &distance].into_iter().chain(&counts.by_class).collect();
        let correct: f64 = (0..self.observations.len()).map(|k| confusion.row(k)[k]).sum();
        SensorReport {
            source: source.to_owned(),
            measurements: n,
            sightings: n,
            skipped: 0,
            skipped_by_cause: BTreeMap::new(),
            correct: correct as u64,
            nearest_agrees: None,
            unknown_codes: BTreeMap::new(),
            kinds: None,
            left_out: LeftOut::default(),
            distance_edges_m: self.classes.edges_from_zero_m(),
            distance_classes: self.classes.names.clone(),
            distance_counts_robots: None,
            distance_counts_landmarks: None,
            distance3_edges_m: THREE_EDGES_M,
            distance3_counts: three_classes(&counts.three_classes),
            errors: self.errors(counts),
            per_observer: BTreeMap::new(),
            detection: None,
            against_map: None,
            beam: None,
            probabilities: tables.iter().flat_map(|table| table.estimates()).collect(),
            thin: tables
                .iter()
                .flat_map(|t| t.low_count_rows(options.estimate.thin_below))
                .collect(),
            hold_out: self.holdout_tests(counts, options),
            estimate: options.estimate,
            warnings: Vec::new(),
            distance_counts: CountMatrix(distance.clone()),
            confusion,
        }
    }

    fn confusion(&self, counts: &PairCounts) -> CountTable {
        square_table("confusion", &self.observations, &counts.confusion)
    }

    fn distance(&self, counts: &PairCounts) -> CountTable {
        square_table("distance", &self.classes.names, &counts.distance)
    }

    fn errors(&self, counts: &ReadingCounts) -> ErrorMoments {
        // One list after the other, because each is sorted and may have millions of values.
        let mut all_m = Vec::with_capacity(counts.ranges_by_class.iter().sum());
        self.visit_ranges(&mut |true_m, reported_m| all_m.push(reported_m - true_m));
        let range_error_m = Moments::from_values(all_m);
        let mut by_class_m: Vec<Vec<f64>> =
            counts.ranges_by_class.iter().map(|n| Vec::with_capacity(*n)).collect();
        self.visit_ranges(&mut |true_m, reported_m| {
            by_class_m[self.classes.class_of(true_m)].push(reported_m - true_m);
        });
        ErrorMoments {
            range_error_m,
            range_error_by_true_class: by_class_m.into_iter().map(Moments::from_values).collect(),
            bearing_error_rad: None,
        }
    }

    /// Visits true and reported range of all correct reports that have both in meters.
    fn visit_ranges(&self, visit: &mut dyn FnMut(f64, f64)) {
        self.readings.visit(&mut |reading| {
            if let Some((true_m, reported_m)) = reading.correct_ranges_m() {
                visit(true_m, reported_m);
            }
        });
    }

    fn holdout_tests(&self, counts: &ReadingCounts, options: &SensorOptions) -> Vec<HoldoutTest> {
        let alpha = options.estimate.alpha;
        let ReadingCounts { learned, held_out, .. } = counts;
        let mut tests = vec![
            holdout_test(&self.confusion(learned), &self.confusion(held_out), alpha),
            holdout_test(&self.distance(learned), &self.distance(held_out), alpha),
        ];
        let confusions = part_tables(counts, |counts| self.confusion(counts));
        tests.extend(tests_of_tables(&confusions, alpha));
        let distances = part_tables(counts, |counts| self.distance(counts));
        tests.extend(tests_of_tables(&distances, alpha));
        tests
    }

    fn profile(&self, counts: &ReadingCounts, options: &SensorOptions) -> SensorProfile {
        let alpha = options.estimate.alpha;
        let mut assumed = Vec::new();
        let confusion = self.confusion_rows(&self.confusion(&counts.all), alpha, &mut assumed);
        let distance = self.distance(&counts.all);
        SensorProfile {
            bearings_deg: options.bearings_deg.clone(),
            range_m: options.range_m,
            observations: self.observations.clone(),
            designates: self.unseen_kinds(),
            distance_edges_m: self.classes.edges_m.clone(),
            distance_classes: self.classes.names.clone(),
            confusion_by_class: self.rows_by_class(counts, &confusion, alpha),
            confusion,
            distance_confusion: distance_rows(&distance, &counts.beyond, alpha, &mut assumed),
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
    fn rows_by_class(
        &self,
        counts: &ReadingCounts,
        pooled: &[NamedRow],
        alpha: f64,
    ) -> Vec<(String, Vec<NamedRow>)> {
        if counts.with_distance == 0 {
            return Vec::new();
        }
        let mut by_class = Vec::new();
        for (class, counts) in self.classes.names.iter().zip(&counts.by_class) {
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

/// Returns a table with the same rows as columns from its cells, row by row.
fn square_table(name: &str, rows: &[String], cells: &[f64]) -> CountTable {
    let mut table = CountTable::new(name, rows, rows);
    for (index, count) in cells.iter().enumerate() {
        table.add(index / rows.len(), index % rows.len(), *count);
    }
    table
}

fn three_classes(counts: &CountTable) -> Option<CountMatrix> {
    let total: f64 = counts.cells().iter().flatten().sum();
    (total > 0.0).then(|| CountMatrix(counts.clone()))
}

/// Returns the tables of all parts that have readings.
fn part_tables(counts: &ReadingCounts, table_of: impl Fn(&PairCounts) -> CountTable) -> PartTables {
    let quarters = counts.quarters.iter().enumerate().filter(|(_, counts)| counts.n > 0);
    let robots = counts.robots.iter();
    PartTables {
        time: quarters.map(|(k, counts)| (k.to_string(), table_of(counts))).collect(),
        robots: robots.map(|(number, counts)| (number.to_string(), table_of(counts))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::table::CsvTable;

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
