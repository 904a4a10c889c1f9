//! A sensor learned from readings whose truth is known.

use std::collections::{BTreeMap, BTreeSet};

use super::SensorModel;
use super::camera::{NOTHING, NamedRow, SensorProfile, distance_rows, truly};
use super::options::{BEYOND, DistanceClasses, SensorOptions, THREE_EDGES_M};
use super::report::{ErrorMoments, SensorReport};
use crate::import::table::{CsvRow, CsvTable, Word};
use crate::kernel::InputError;
use crate::learn::holdout::{Fit, fit, split};
use crate::learn::{CountMatrix, Counts};
use crate::statistics::Moments;

/// So many observations are taken for a column of numbers.
const OBSERVATIONS_MAX: usize = 250;

/// One row of the file.
#[derive(Debug, Clone, PartialEq)]
struct Reading {
    /// Index of the true observation; 0 is `nothing`.
    truth: usize,
    /// Index of the reported one.
    reported: usize,
    /// Where there was something.
    true_at: Option<Distance>,
    /// Where something was reported.
    reported_at: Option<Distance>,
}

impl Reading {
    /// True and reported distance of a right report of something.
    fn right_distances(&self) -> Option<(Distance, Distance)> {
        (self.truth == self.reported).then_some((self.true_at?, self.reported_at?))
    }
}

/// A distance as the file tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Distance {
    class: usize,
    /// In m; `None` where only the class is told.
    range_m: Option<f64>,
}

/// Learns the sensor; `classes` come from `options`.
pub(super) fn learn(
    table: &CsvTable,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<SensorModel, InputError> {
    let log = ReadingLog::parse(table, options, classes)?;
    let report = log.report(table.place(), options);
    Ok(SensorModel { report, profile: log.profile(options) })
}

/// All readings of one sensor.
struct ReadingLog<'a> {
    /// `nothing`, then the others by name.
    observations: Vec<String>,
    classes: &'a DistanceClasses,
    readings: Vec<Reading>,
}

impl<'a> ReadingLog<'a> {
    fn parse(
        table: &CsvTable,
        options: &SensorOptions,
        classes: &'a DistanceClasses,
    ) -> Result<Self, InputError> {
        let columns = Columns::find(table)?;
        let rows = rows_of_sensor(table, options.sensor.as_deref())?;
        let observations = observations(table.place(), &rows, &columns)?;
        let parser = RowParser { place: table.place(), columns, observations, classes };
        let readings = rows.iter().map(|row| parser.reading(row)).collect::<Result<_, _>>()?;
        Ok(Self { observations: parser.observations, classes, readings })
    }

    fn report(&self, source: &str, options: &SensorOptions) -> SensorReport {
        let n = self.readings.len() as u64;
        let all: Vec<&Reading> = self.readings.iter().collect();
        let (confusion, distance) = (self.confusion(&all), self.distance(&all, self.classes));
        let by_class = self.by_class();
        let tables: Vec<&Counts> = [&confusion, &distance].into_iter().chain(&by_class).collect();
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
            distance_edges_m: self.classes.edges_from_zero_m(),
            distance_classes: self.classes.names.clone(),
            distance_counts_robots: None,
            distance_counts_landmarks: None,
            distance3_edges_m: THREE_EDGES_M,
            distance3_counts: self.three_classes(),
            errors: self.errors(),
            per_observer: BTreeMap::new(),
            detection: None,
            probabilities: tables.iter().flat_map(|table| table.estimates()).collect(),
            thin: tables.iter().flat_map(|t| t.thin(options.estimate.thin_below)).collect(),
            hold_out: self.hold_out(options),
            estimate: options.estimate,
            warnings: Vec::new(),
            distance_counts: CountMatrix(distance.clone()),
            confusion,
        }
    }

    fn confusion(&self, readings: &[&Reading]) -> Counts {
        let mut counts = Counts::new("confusion", &self.observations, &self.observations);
        readings.iter().for_each(|r| counts.add(r.truth, r.reported, 1.0));
        counts
    }

    /// The confusion of what stands in each class; of `nothing` there is none.
    fn by_class(&self) -> Vec<Counts> {
        let table = |class: &String| {
            Counts::new(&format!("confusion_{class}"), &self.observations[1..], &self.observations)
        };
        let mut tables: Vec<Counts> = self.classes.names.iter().map(table).collect();
        for reading in &self.readings {
            if let Some(distance) = reading.true_at {
                tables[distance.class].add(reading.truth - 1, reading.reported, 1.0);
            }
        }
        tables
    }

    fn distance(&self, readings: &[&Reading], classes: &DistanceClasses) -> Counts {
        let mut counts = Counts::new("distance", &classes.names, &classes.names);
        for (truth, reported) in readings.iter().filter_map(|r| r.right_distances()) {
            counts.add(truth.class, reported.class, 1.0);
        }
        counts
    }

    fn three_classes(&self) -> Option<CountMatrix> {
        let classes = DistanceClasses::very_near_near_far();
        let mut counts = Counts::new("distance3", &classes.names, &classes.names);
        for (truth_m, reported_m) in self.right_ranges_m() {
            counts.add(classes.of(truth_m), classes.of(reported_m), 1.0);
        }
        (counts.cells().iter().flatten().sum::<f64>() > 0.0).then_some(CountMatrix(counts))
    }

    fn right_ranges_m(&self) -> impl Iterator<Item = (f64, f64)> {
        let right = self.readings.iter().filter_map(Reading::right_distances);
        right.filter_map(|(truth, reported)| Some((truth.range_m?, reported.range_m?)))
    }

    fn errors(&self) -> ErrorMoments {
        let in_class = |class: usize| {
            let ranges = self.right_ranges_m().filter(move |r| self.classes.of(r.0) == class);
            Moments::of(ranges.map(|(truth_m, reported_m)| reported_m - truth_m))
        };
        ErrorMoments {
            range_error_m: Moments::of(self.right_ranges_m().map(|(t, r)| r - t)),
            range_error_by_true_class: (0..self.classes.len()).map(in_class).collect(),
            bearing_error_rad: None,
        }
    }

    /// Class of what was reported where nothing was.
    fn beyond(&self) -> Counts {
        let mut counts = Counts::new(BEYOND, &[BEYOND.to_string()], &self.classes.names);
        let spurious = self.readings.iter().filter(|r| r.truth == 0);
        spurious.filter_map(|r| r.reported_at).for_each(|at| counts.add(0, at.class, 1.0));
        counts
    }

    fn hold_out(&self, options: &SensorOptions) -> Vec<Fit> {
        let alpha = options.estimate.alpha;
        let (train, held) = split(&self.readings, options.estimate.hold_out_every);
        let distance = |part: &[&Reading]| self.distance(part, self.classes);
        vec![
            fit(&self.confusion(&train), &self.confusion(&held), alpha),
            fit(&distance(&train), &distance(&held), alpha),
        ]
    }

    fn profile(&self, options: &SensorOptions) -> SensorProfile {
        let alpha = options.estimate.alpha;
        let mut assumed = Vec::new();
        let all: Vec<&Reading> = self.readings.iter().collect();
        let confusion = self.confusion_rows(&self.confusion(&all), alpha, &mut assumed);
        let distance = self.distance(&all, self.classes);
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
            rule: "counts of true against reported, every count plus alpha".to_string(),
        }
    }

    /// The standard kinds that the sensor was never shown: it takes them for nothing.
    fn unseen_kinds(&self) -> Vec<(String, String)> {
        let known = |kind: &&str| self.observations.iter().any(|name| name == kind);
        let kinds = ["wall", "door", "person", "robot"].into_iter();
        let unseen = kinds.filter(|kind| !known(kind));
        unseen.map(|kind| (kind.to_string(), NOTHING.to_string())).collect()
    }

    fn confusion_rows(
        &self,
        counts: &Counts,
        alpha: f64,
        assumed: &mut Vec<String>,
    ) -> Vec<NamedRow> {
        let row = |(index, name): (usize, &String)| {
            let row = counts.smoothed(index, alpha).unwrap_or_else(|| {
                assumed.push(format!("confusion of {name}: reported truly"));
                truly(self.observations.len(), index)
            });
            NamedRow::new(name, &row)
        };
        self.observations.iter().enumerate().map(row).collect()
    }

    /// Rows for each class; without counts in a class, that of all classes. `pooled` has them
    /// in the order of the observations. Empty where the file tells no distances.
    fn rows_by_class(&self, pooled: &[NamedRow], alpha: f64) -> Vec<(String, Vec<NamedRow>)> {
        if self.readings.iter().all(|reading| reading.true_at.is_none()) {
            return Vec::new();
        }
        let rows = |counts: &Counts| {
            let row = |index: usize| match counts.smoothed(index, alpha) {
                Some(row) => NamedRow::new(&counts.rows()[index], &row),
                None => pooled[index + 1].clone(),
            };
            (0..counts.rows().len()).map(row).collect()
        };
        self.classes.names.iter().cloned().zip(self.by_class().iter().map(rows)).collect()
    }
}

/// Where the columns are.
struct Columns {
    truth: usize,
    reported: usize,
    true_at: usize,
    reported_at: usize,
    /// Whether distances are told in m, else by class.
    in_meters: bool,
}

impl Columns {
    fn find(table: &CsvTable) -> Result<Self, InputError> {
        let in_meters = table.find("true_class").is_none();
        let [true_at, reported_at] = if in_meters {
            ["true_distance_m", "reported_distance_m"]
        } else {
            ["true_class", "reported_class"]
        };
        Ok(Self {
            truth: table.column("true")?,
            reported: table.column("reported")?,
            true_at: table.column(true_at)?,
            reported_at: table.column(reported_at)?,
            in_meters,
        })
    }
}

/// The rows of the sensor that is to be learned.
fn rows_of_sensor<'t>(
    table: &'t CsvTable,
    wanted: Option<&str>,
) -> Result<Vec<CsvRow<'t>>, InputError> {
    let column = table.find("sensor");
    let name = |row: &CsvRow<'t>| column.map_or("", |column| row.field(column).text);
    let names: BTreeSet<&str> = table.rows().map(|row| name(&row)).collect();
    let listed = names.iter().copied().collect::<Vec<_>>().join(", ");
    if wanted.is_none() && names.len() > 1 {
        let cause = format!("the file has readings of several sensors: {listed}");
        return Err(InputError::new(table.place(), cause, "choose one of them"));
    }
    let rows: Vec<CsvRow> =
        table.rows().filter(|row| wanted.is_none_or(|wanted| name(row) == wanted)).collect();
    if rows.is_empty() {
        let cause = wanted.map_or("the file has no readings".to_string(), |wanted| {
            format!("no readings of the sensor `{wanted}`")
        });
        let remedy = format!("sensors in the file: {listed}");
        return Err(InputError::new(table.place(), cause, remedy));
    }
    Ok(rows)
}

/// `nothing`, then every other observation of the file by name.
fn observations(
    place: &str,
    rows: &[CsvRow<'_>],
    columns: &Columns,
) -> Result<Vec<String>, InputError> {
    let words = rows.iter().flat_map(|row| [row.field(columns.truth), row.field(columns.reported)]);
    let mut names = BTreeSet::new();
    for word in words {
        if word.text.is_empty() {
            let remedy = "name an observation; `nothing` where there is none";
            return Err(word.error(&place, "the observation is empty".to_string(), remedy));
        }
        names.insert(word.text);
        if names.len() >= OBSERVATIONS_MAX {
            let cause = format!("{OBSERVATIONS_MAX} different observations or more");
            return Err(word.error(&place, cause, "name kinds of things, not measurements"));
        }
    }
    let others = names.into_iter().filter(|name| *name != NOTHING);
    Ok(std::iter::once(NOTHING).chain(others).map(String::from).collect())
}

/// Turns rows into readings.
struct RowParser<'a> {
    place: &'a str,
    columns: Columns,
    observations: Vec<String>,
    classes: &'a DistanceClasses,
}

impl RowParser<'_> {
    fn reading(&self, row: &CsvRow<'_>) -> Result<Reading, InputError> {
        let truth = self.observation(row.field(self.columns.truth));
        let reported = self.observation(row.field(self.columns.reported));
        // A distance beside `nothing` means nothing, but must not be garbage.
        let true_at = self.distance(row.field(self.columns.true_at))?;
        let reported_at = self.distance(row.field(self.columns.reported_at))?;
        Ok(Reading {
            truth,
            reported,
            true_at: true_at.filter(|_| truth != 0),
            reported_at: reported_at.filter(|_| reported != 0),
        })
    }

    fn observation(&self, word: Word<'_>) -> usize {
        let found = self.observations.iter().position(|name| name == word.text);
        found.expect("every observation of the file was collected")
    }

    fn distance(&self, word: Word<'_>) -> Result<Option<Distance>, InputError> {
        match word.text {
            "" | BEYOND => Ok(None),
            _ if self.columns.in_meters => self.range(word).map(Some),
            _ => self.class(word).map(Some),
        }
    }

    fn range(&self, word: Word<'_>) -> Result<Distance, InputError> {
        let range_m = word.number(&self.place)?;
        if range_m < 0.0 {
            let cause = format!("a distance of {range_m} m");
            return Err(word.error(&self.place, cause, "give a distance of at least 0 m"));
        }
        Ok(Distance { class: self.classes.of(range_m), range_m: Some(range_m) })
    }

    fn class(&self, word: Word<'_>) -> Result<Distance, InputError> {
        let names = &self.classes.names;
        let class = names.iter().position(|name| name == word.text).ok_or_else(|| {
            let cause = format!("`{}` is not a distance class", word.text);
            word.error(&self.place, cause, &format!("use one of {}", names.join(", ")))
        })?;
        Ok(Distance { class, range_m: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learned(text: &str, options: &SensorOptions) -> Result<SensorModel, InputError> {
        learn(&CsvTable::parse(&"f.csv", text)?, options, &options.check()?)
    }

    const METERS: &str = "true,reported,true_distance_m,reported_distance_m\n\
        robot,robot,1.0,1.2\nrobot,nothing,2.0,\nrobot,robot,1.4,1.6\n\
        nothing,robot,,1.0\nnothing,nothing,,\nnothing,nothing,beyond,beyond\n";

    #[test]
    fn readings_in_meters_become_rows_by_class() {
        let options = SensorOptions {
            estimate: crate::learn::EstimateOptions { alpha: 0.0, ..Default::default() },
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
        assert_eq!(error.position(), Some((2, 13)));
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
            assert_eq!(error.position(), Some(position), "{row}");
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
            let estimate = crate::learn::EstimateOptions { alpha, ..Default::default() };
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
