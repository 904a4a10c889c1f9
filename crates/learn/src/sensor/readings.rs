//! Readings with known true values, from a CSV table.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::camera::NOTHING;
use super::options::{BEYOND, DistanceClasses};
use crate::columns::{BLOCK_ROWS, NumberColumn, RobotColumn};
use crate::left_out;
use crate::log_table::{Cell, CellValue, LogRow, LogTable};
use sidestep_kernel::InputError;

/// Largest number of observations; a column with more is taken for a column of numbers.
const MAX_OBSERVATIONS: usize = 250;

/// One reading, and what it should have been.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LabeledReading {
    /// Number of the robot; 0 where the log is of one.
    pub(super) robot: u32,
    /// Number of the scan, or of whatever was read at once; readings of one are not independent.
    pub(super) scan: u32,
    /// Index of the true observation; 0 is `nothing`.
    pub(super) truth: usize,
    /// Index of the reported one.
    pub(super) reported: usize,
    /// True distance, where there was something.
    pub(super) true_at: Option<Distance>,
    /// Reported distance, where something was reported.
    pub(super) reported_at: Option<Distance>,
}

impl LabeledReading {
    /// Returns true and reported distance of a correct report of something.
    pub(super) fn correct_distances(&self) -> Option<(Distance, Distance)> {
        (self.truth == self.reported).then_some((self.true_at?, self.reported_at?))
    }

    /// Returns true and reported range in meters of a correct report of something.
    pub(super) fn correct_ranges_m(&self) -> Option<(f64, f64)> {
        let (truth, reported) = self.correct_distances()?;
        Some((truth.range_m?, reported.range_m?))
    }

    /// Returns true and reported range in meters, where there was something.
    pub(super) fn ranges_m(&self) -> (Option<f64>, Option<f64>) {
        let true_m = self.true_at.and_then(|distance| distance.range_m);
        let reported_m = self.reported_at.and_then(|distance| distance.range_m);
        (true_m, reported_m)
    }
}

/// A distance as the file gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Distance {
    pub(super) class: usize,
    /// Range in meters; `None` where only the class is given.
    pub(super) range_m: Option<f64>,
}

/// Readings that are visited in the order of time, again for each figure: a table of millions of rows makes them anew
/// each time, which takes less than to keep them.
pub(super) trait Readings {
    /// Visits all readings.
    fn visit(&self, visit: &mut dyn FnMut(&LabeledReading));
}

impl Readings for Vec<LabeledReading> {
    fn visit(&self, visit: &mut dyn FnMut(&LabeledReading)) {
        self.iter().for_each(visit);
    }
}

/// In place of an observation: the row is left out.
const LEFT_OUT: u8 = u8::MAX;
/// In place of a distance class: there is no distance.
const NO_CLASS: u8 = u8::MAX;

/// The readings of a table, whose ranges stay in its columns as far as these have numbers.
pub(super) struct TableReadings<'t> {
    /// The true observation of each row; [`LEFT_OUT`] where the row is.
    truths: Vec<u8>,
    /// The reported one.
    reports: Vec<u8>,
    robots: RobotColumn,
    /// The scan of each row; empty where nobody asks for it.
    scans: Vec<u32>,
    /// The classes of true and reported distance; [`NO_CLASS`] where there is none.
    classes: [Vec<u8>; 2],
    /// True and reported range in meters; `None` where only classes are given.
    ranges: Option<[NumberColumn<'t>; 2]>,
}

impl Readings for TableReadings<'_> {
    fn visit(&self, visit: &mut dyn FnMut(&LabeledReading)) {
        let mut ranges_m = [(); 2].map(|()| vec![f64::NAN; BLOCK_ROWS]);
        for (index, truths) in self.truths.chunks(BLOCK_ROWS).enumerate() {
            let first_row = index * BLOCK_ROWS;
            for (column, into) in self.ranges.iter().flatten().zip(&mut ranges_m) {
                column.read(first_row, &mut into[..truths.len()]);
            }
            for (offset, &truth) in truths.iter().enumerate() {
                if truth == LEFT_OUT {
                    continue;
                }
                let row = first_row + offset;
                let at = |side: usize| self.distance(side, row, ranges_m[side][offset]);
                visit(&LabeledReading {
                    robot: self.robots.get(row),
                    scan: self.scans.get(row).copied().unwrap_or(0),
                    truth: usize::from(truth),
                    reported: usize::from(self.reports[row]),
                    true_at: at(0),
                    reported_at: at(1),
                });
            }
        }
    }
}

impl<'t> TableReadings<'t> {
    fn new(table: &'t dyn LogTable, columns: &ReadingColumns) -> Self {
        let row_count = table.row_count();
        let ranges =
            [columns.true_at, columns.reported_at].map(|column| NumberColumn::new(table, column));
        Self {
            truths: Vec::with_capacity(row_count),
            reports: Vec::with_capacity(row_count),
            robots: RobotColumn::new(row_count),
            scans: Vec::new(),
            classes: [(); 2].map(|()| Vec::with_capacity(row_count)),
            ranges: columns.in_meters.then_some(ranges),
        }
    }

    /// Adds the reading of the next row; `None` where the row is left out.
    fn push(&mut self, reading: Option<&LabeledReading>) {
        self.truths.push(reading.map_or(LEFT_OUT, |one| one.truth as u8));
        self.reports.push(reading.map_or(LEFT_OUT, |one| one.reported as u8));
        self.robots.push(reading.map_or(0, |one| one.robot));
        let distances = reading.map_or([None; 2], |one| [one.true_at, one.reported_at]);
        for (classes, distance) in self.classes.iter_mut().zip(distances) {
            classes.push(distance.map_or(NO_CLASS, |distance| distance.class as u8));
        }
        for (column, distance) in self.ranges.iter_mut().flatten().zip(distances) {
            column.push(distance.and_then(|distance| distance.range_m).unwrap_or(f64::NAN));
        }
    }

    fn distance(&self, side: usize, row: usize, range_m: f64) -> Option<Distance> {
        let class = self.classes[side][row];
        let range_m = self.ranges.is_some().then_some(range_m);
        (class != NO_CLASS).then(|| Distance { class: usize::from(class), range_m })
    }
}

/// The readings of a table as far as it can be read.
pub(super) struct ParsedReadings<'t> {
    /// `nothing` first and the others by name.
    pub(super) observations: Vec<String>,
    /// In the order of the table, which is that of time.
    pub(super) readings: TableReadings<'t>,
    /// Number of damaged rows, which are left out.
    pub(super) damaged: u64,
    /// The error of the first of them.
    pub(super) first_error: Option<InputError>,
}

/// How the readings of a table are read.
#[derive(Clone, Copy)]
pub(super) struct ReadingRule<'a> {
    /// The sensor to learn, for a table with several.
    pub(super) sensor: Option<&'a str>,
    pub(super) classes: &'a DistanceClasses,
    /// Whether somebody asks which readings are of one scan.
    pub(super) needs_scans: bool,
}

/// Returns the readings of the wanted sensor.
pub(super) fn read<'t>(
    table: &'t dyn LogTable,
    rule: &ReadingRule<'_>,
) -> Result<ParsedReadings<'t>, InputError> {
    let columns = ReadingColumns::find(table)?;
    let chosen = ChosenSensor::find(table, rule.sensor)?;
    let observations = observations(table, &chosen, &columns)?;
    let mut readings = TableReadings::new(table, &columns);
    let parser = RowParser { columns, observations, classes: rule.classes };
    let (misfit_count, mut first_error) = table.misfits();
    let misfits = left_out::misfits_among(table.row_count(), misfit_count, chosen.count);
    let mut damaged = misfits;
    let mut scans = ScanNumbers { cycle: table.find("cycle"), ..ScanNumbers::default() };
    let cycle = scans.cycle.filter(|_| rule.needs_scans);
    let all: Vec<usize> = parser.columns.all().chain(chosen.column).chain(cycle).collect();
    table.visit_rows(&all, &mut |_, row| {
        let is_chosen = chosen.has(row);
        if rule.needs_scans {
            readings.scans.push(if is_chosen { scans.next(&parser, row) } else { 0 });
        }
        let read = if is_chosen { parser.reading(row).map(Some) } else { Ok(None) };
        let reading = read.unwrap_or_else(|error| {
            damaged += 1;
            first_error.get_or_insert(error);
            None
        });
        readings.push(reading.as_ref());
        Ok(())
    })?;
    match first_error {
        Some(error) if 2 * damaged > chosen.count as u64 + misfits => Err(error),
        first_error => {
            Ok(ParsedReadings { observations: parser.observations, readings, damaged, first_error })
        }
    }
}

/// Numbers of scans: rows of one robot and cycle are one scan; where no cycle is given, each row is one.
#[derive(Default)]
struct ScanNumbers {
    cycle: Option<usize>,
    scan: u32,
    /// Cycle and robot of the row before.
    before: Option<[ScanKey; 2]>,
}

/// A cell by which scans are told apart.
#[derive(PartialEq)]
enum ScanKey {
    Text(String),
    Number(f64),
}

impl ScanKey {
    fn is_of(&self, value: CellValue<'_>) -> bool {
        match (self, value) {
            (Self::Text(text), CellValue::Word(word)) => text == word,
            (Self::Text(text), CellValue::Missing) => text.is_empty(),
            (Self::Number(number), CellValue::Real(other) | CellValue::Whole(other)) => {
                *number == other
            }
            _ => false,
        }
    }

    fn new(value: CellValue<'_>) -> Self {
        match value {
            CellValue::Word(word) => Self::Text(word.to_owned()),
            CellValue::Missing => Self::Text(String::new()),
            CellValue::Real(number) | CellValue::Whole(number) => Self::Number(number),
        }
    }
}

impl ScanNumbers {
    /// Returns the number of the scan of the next row.
    fn next(&mut self, parser: &RowParser<'_>, row: &dyn LogRow) -> u32 {
        let here = self.cycle.map(|cycle| {
            let robot = parser.robot(row).map_or(CellValue::Missing, |cell| cell.value());
            [row.value(cycle), robot]
        });
        let is_same = match (&self.before, here) {
            (Some(before), Some(here)) => {
                before.iter().zip(here).all(|(key, value)| key.is_of(value))
            }
            _ => false,
        };
        if !is_same {
            self.scan += 1;
            self.before = here.map(|values| values.map(ScanKey::new));
        }
        self.scan
    }
}

/// Returns the name of the only sensor of a table, if there is only one that has a name.
pub(super) fn only_sensor(table: &dyn LogTable) -> Option<String> {
    let column = sensor_column(table)?;
    let counts = sensor_counts(table, Some(column)).ok()?;
    (counts.len() == 1).then(|| counts.into_keys().next())?
}

/// Returns the column that tells sensors apart: by name, else by any word. A number is one on its own robot, so that
/// the same number may be two sensors on two robots.
fn sensor_column(table: &dyn LogTable) -> Option<usize> {
    table.find("sensor_name").or_else(|| table.find("sensor"))
}

/// Returns the number of rows by the name of their sensor; all are of one without a name where no column tells.
fn sensor_counts(
    table: &dyn LogTable,
    column: Option<usize>,
) -> Result<BTreeMap<String, usize>, InputError> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let Some(column) = column else {
        if table.row_count() > 0 {
            counts.insert(String::new(), table.row_count());
        }
        return Ok(counts);
    };
    table.visit_rows(&[column], &mut |_, row| {
        let name = Cell::new(row, column).text();
        match counts.get_mut(name.as_ref()) {
            Some(count) => *count += 1,
            None => drop(counts.insert(name.into_owned(), 1)),
        }
        Ok(())
    })?;
    Ok(counts)
}

struct ReadingColumns {
    truth: usize,
    reported: usize,
    true_at: usize,
    reported_at: usize,
    robot: Option<usize>,
    /// Whether distances are given in meters, else by class.
    in_meters: bool,
}

impl ReadingColumns {
    fn find(table: &dyn LogTable) -> Result<Self, InputError> {
        let in_meters = table.find("true_class").is_none();
        let [true_at, reported_at] = if in_meters {
            ["true_distance_m", "reported_distance_m"]
        } else {
            ["true_class", "reported_class"]
        };
        let [truth, reported, true_at, reported_at] =
            table.require(["true", "reported", true_at, reported_at])?;
        let robot = table.find("robot");
        Ok(Self { truth, reported, true_at, reported_at, robot, in_meters })
    }

    /// Returns all columns that a row is read by.
    fn all(&self) -> impl Iterator<Item = usize> {
        let needed = [self.truth, self.reported, self.true_at, self.reported_at];
        needed.into_iter().chain(self.robot)
    }
}

/// The rows of one sensor.
struct ChosenSensor<'a> {
    /// The sensor that was asked for, with the column that names it; where none was, all rows are of one.
    wanted: Option<&'a str>,
    column: Option<usize>,
    /// Number of rows.
    count: usize,
}

impl<'a> ChosenSensor<'a> {
    /// Where `wanted` is not given, the table must be of a single sensor.
    fn find(table: &dyn LogTable, wanted: Option<&'a str>) -> Result<Self, InputError> {
        let column = sensor_column(table);
        let counts = sensor_counts(table, column)?;
        let listed = counts.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        if wanted.is_none() && counts.len() > 1 {
            let cause = format!("the table has readings of several sensors: {listed}");
            let first = counts.keys().next().map_or("", String::as_str);
            let option = table.option("--sensor", "name", first);
            let remedy = format!("choose one of them, e.g. {option}");
            return Err(InputError::new(table.place(), cause, remedy));
        }
        let count = match wanted {
            Some(wanted) => counts.get(wanted).copied().unwrap_or(0),
            None => counts.values().sum(),
        };
        if count == 0 {
            let cause = match wanted {
                Some(wanted) => format!("no readings of the sensor `{wanted}`"),
                None => "the table has no readings".to_string(),
            };
            let remedy = format!("sensors in the table: {listed}");
            return Err(InputError::new(table.place(), cause, remedy));
        }
        Ok(Self { wanted, column, count })
    }

    fn has(&self, row: &dyn LogRow) -> bool {
        let Some(wanted) = self.wanted else { return true };
        let name = self.column.map_or(Cow::Borrowed(""), |column| Cell::new(row, column).text());
        name == wanted
    }
}

/// Returns `nothing`, then every other observation of the table by name.
fn observations(
    table: &dyn LogTable,
    chosen: &ChosenSensor<'_>,
    columns: &ReadingColumns,
) -> Result<Vec<String>, InputError> {
    let mut names: BTreeSet<String> = BTreeSet::new();
    let pair = [columns.truth, columns.reported];
    let all: Vec<usize> = pair.into_iter().chain(chosen.column).collect();
    table.visit_rows(&all, &mut |_, row| {
        if !chosen.has(row) {
            return Ok(());
        }
        for column in pair {
            let cell = Cell::new(row, column);
            let word = cell.text();
            if word.is_empty() || names.contains(word.as_ref()) {
                continue;
            }
            names.insert(word.into_owned());
            if names.len() >= MAX_OBSERVATIONS {
                let cause = format!("{MAX_OBSERVATIONS} different observations or more");
                return Err(cell.error(cause, "name kinds of things, not measurements"));
            }
        }
        Ok(())
    })?;
    names.remove(NOTHING);
    Ok(std::iter::once(NOTHING.to_owned()).chain(names).collect())
}

/// Properties of a table with which each of its rows is read.
struct RowParser<'a> {
    columns: ReadingColumns,
    observations: Vec<String>,
    classes: &'a DistanceClasses,
}

impl RowParser<'_> {
    fn reading(&self, row: &dyn LogRow) -> Result<LabeledReading, InputError> {
        let truth = self.observation(Cell::new(row, self.columns.truth))?;
        let reported = self.observation(Cell::new(row, self.columns.reported))?;
        let robot = self.robot(row).map_or(Ok(0), |cell| cell.integer())?;
        // A distance beside `nothing` is ignored, but it must still be a valid distance.
        let true_at = self.distance(Cell::new(row, self.columns.true_at))?;
        let reported_at = self.distance(Cell::new(row, self.columns.reported_at))?;
        Ok(LabeledReading {
            robot,
            scan: 0,
            truth,
            reported,
            true_at: true_at.filter(|_| truth != 0),
            reported_at: reported_at.filter(|_| reported != 0),
        })
    }

    fn robot<'r>(&self, row: &'r dyn LogRow) -> Option<Cell<'r>> {
        self.columns.robot.map(|column| Cell::new(row, column))
    }

    fn observation(&self, cell: Cell<'_>) -> Result<usize, InputError> {
        let word = cell.text();
        self.observations.iter().position(|name| *name == word).ok_or_else(|| {
            let remedy = "give an observation; `nothing` where there is none";
            cell.error("the observation is empty".to_string(), remedy)
        })
    }

    fn distance(&self, cell: Cell<'_>) -> Result<Option<Distance>, InputError> {
        match cell.value() {
            CellValue::Missing | CellValue::Word("" | BEYOND) => Ok(None),
            _ if self.columns.in_meters => self.range(cell).map(Some),
            _ => self.class(cell).map(Some),
        }
    }

    fn range(&self, cell: Cell<'_>) -> Result<Distance, InputError> {
        let range_m = cell.number()?;
        if range_m < 0.0 {
            let cause = format!("a distance of {range_m} m");
            return Err(cell.error(cause, "give a distance of at least 0 m"));
        }
        Ok(Distance { class: self.classes.class_of(range_m), range_m: Some(range_m) })
    }

    fn class(&self, cell: Cell<'_>) -> Result<Distance, InputError> {
        let names = &self.classes.names;
        let text = cell.text();
        let class = names.iter().position(|name| *name == text).ok_or_else(|| {
            let cause = format!("`{text}` is not a distance class");
            cell.error(cause, &format!("use one of {}", names.join(", ")))
        })?;
        Ok(Distance { class, range_m: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::table::CsvTable;

    #[test]
    fn a_sensor_has_its_share_of_the_rows_whose_own_is_not_known() {
        let text = format!(
            "sensor_name,true,reported,true_class,reported_class\n{}{}{}",
            "left,nothing,nothing,beyond,beyond\n".repeat(90),
            "right,nothing,nothing,beyond,beyond\n".repeat(10),
            "left\n".repeat(20)
        );
        let table = CsvTable::parse_recording(&"f.csv", &text).unwrap();
        let chosen = ChosenSensor::find(&table, Some("right")).unwrap();
        assert_eq!((chosen.count, left_out::misfits_among(100, 20, chosen.count)), (10, 2));
        let classes = DistanceClasses::new(&[1.0], &["near".to_owned(), "far".to_owned()]).unwrap();
        let rule = ReadingRule { sensor: Some("right"), classes: &classes, needs_scans: false };
        let parsed = read(&table, &rule).unwrap();
        assert_eq!(parsed.damaged, 2);
    }
}
