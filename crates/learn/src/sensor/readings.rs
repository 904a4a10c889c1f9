//! Readings with known true values, from a CSV table.

use std::collections::BTreeSet;

use super::camera::NOTHING;
use super::options::{BEYOND, DistanceClasses};
use crate::left_out;
use sidestep_import::table::{CsvRow, CsvTable, Token};
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

/// The readings of a table as far as it can be read.
pub(super) struct ParsedReadings {
    /// `nothing` first and the others by name.
    pub(super) observations: Vec<String>,
    /// In the order of the table, which is that of time.
    pub(super) readings: Vec<LabeledReading>,
    /// Number of damaged rows, which are left out.
    pub(super) damaged: u64,
    /// The error of the first of them.
    pub(super) first_error: Option<InputError>,
}

/// Returns the readings of the sensor `wanted`.
pub(super) fn read(
    table: &CsvTable,
    wanted: Option<&str>,
    classes: &DistanceClasses,
) -> Result<ParsedReadings, InputError> {
    let columns = ReadingColumns::find(table)?;
    let rows = rows_of_sensor(table, wanted)?;
    let observations = observations(table.place(), &rows, &columns)?;
    let parser = RowParser { place: table.place(), columns, observations, classes };
    let mut readings = Vec::with_capacity(rows.len());
    let misfits = left_out::misfits_among(table, rows.len());
    let mut damaged = misfits;
    let mut first_error = table.misfits().first().map(|misfit| table.misfit_error(*misfit));
    let cycle = table.find("cycle");
    let mut scan = 0;
    let mut before = None;
    for row in &rows {
        // Rows of one robot and cycle are one scan; where no cycle is given, each row is one.
        let here =
            cycle.map(|column| (row.field(column).text, parser.robot(row).map(|word| word.text)));
        scan += u32::from(here.is_none() || here != before);
        before = here;
        match parser.reading(row) {
            Ok(reading) => readings.push(LabeledReading { scan, ..reading }),
            Err(error) => {
                damaged += 1;
                first_error.get_or_insert(error);
            }
        }
    }
    match first_error {
        Some(error) if 2 * damaged > rows.len() as u64 + misfits => Err(error),
        first_error => {
            Ok(ParsedReadings { observations: parser.observations, readings, damaged, first_error })
        }
    }
}

/// Returns the name of the only sensor of a table, if there is only one that has a name.
pub(super) fn only_sensor(table: &CsvTable) -> Option<String> {
    let column = sensor_column(table)?;
    let names: BTreeSet<&str> = table.rows().map(|row| row.field(column).text).collect();
    (names.len() == 1).then(|| names.into_iter().next().map(String::from))?
}

/// Returns the column that tells sensors apart: by name, else by any word. A number is one on its own robot, so that
/// the same number may be two sensors on two robots.
fn sensor_column(table: &CsvTable) -> Option<usize> {
    table.find("sensor_name").or_else(|| table.find("sensor"))
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
    fn find(table: &CsvTable) -> Result<Self, InputError> {
        let in_meters = table.find("true_class").is_none();
        let [true_at, reported_at] = if in_meters {
            ["true_distance_m", "reported_distance_m"]
        } else {
            ["true_class", "reported_class"]
        };
        let [truth, reported, true_at, reported_at] =
            table.columns(["true", "reported", true_at, reported_at])?;
        let robot = table.find("robot");
        Ok(Self { truth, reported, true_at, reported_at, robot, in_meters })
    }
}

/// Where `wanted` is not given, the file must be of a single sensor.
fn rows_of_sensor<'t>(
    table: &'t CsvTable,
    wanted: Option<&str>,
) -> Result<Vec<CsvRow<'t>>, InputError> {
    let column = sensor_column(table);
    let names: BTreeSet<&str> = table.rows().map(|row| sensor_name(&row, column)).collect();
    let listed = names.iter().copied().collect::<Vec<_>>().join(", ");
    if wanted.is_none() && names.len() > 1 {
        let cause = format!("the file has readings of several sensors: {listed}");
        let first = names.first().copied().unwrap_or_default();
        let remedy = format!("choose one of them, e.g. --sensor {first}");
        return Err(InputError::new(table.place(), cause, remedy));
    }
    let rows: Vec<CsvRow> = table
        .rows()
        .filter(|row| wanted.is_none_or(|wanted| sensor_name(row, column) == wanted))
        .collect();
    if rows.is_empty() {
        let cause = match wanted {
            Some(wanted) => format!("no readings of the sensor `{wanted}`"),
            None => "the file has no readings".to_string(),
        };
        let remedy = format!("sensors in the file: {listed}");
        return Err(InputError::new(table.place(), cause, remedy));
    }
    Ok(rows)
}

/// Returns the sensor of a row; without a column of sensors, all rows are of one that has no name.
fn sensor_name<'t>(row: &CsvRow<'t>, column: Option<usize>) -> &'t str {
    column.map_or("", |column| row.field(column).text)
}

/// Returns `nothing`, then every other observation of the file by name.
fn observations(
    place: &str,
    rows: &[CsvRow<'_>],
    columns: &ReadingColumns,
) -> Result<Vec<String>, InputError> {
    let words = rows.iter().flat_map(|row| [row.field(columns.truth), row.field(columns.reported)]);
    let mut names = BTreeSet::new();
    for word in words {
        if word.text.is_empty() {
            continue;
        }
        names.insert(word.text);
        if names.len() >= MAX_OBSERVATIONS {
            let cause = format!("{MAX_OBSERVATIONS} different observations or more");
            return Err(word.error(&place, cause, "name kinds of things, not measurements"));
        }
    }
    let others = names.into_iter().filter(|name| *name != NOTHING);
    Ok(std::iter::once(NOTHING).chain(others).map(String::from).collect())
}

/// Properties of a file with which each of its rows is read.
struct RowParser<'a> {
    place: &'a str,
    columns: ReadingColumns,
    observations: Vec<String>,
    classes: &'a DistanceClasses,
}

impl RowParser<'_> {
    fn reading(&self, row: &CsvRow<'_>) -> Result<LabeledReading, InputError> {
        let truth = self.observation(row.field(self.columns.truth))?;
        let reported = self.observation(row.field(self.columns.reported))?;
        let robot = self.robot(row).map_or(Ok(0), |word| word.integer(&self.place))?;
        // A distance beside `nothing` is ignored, but it must still be a valid distance.
        let true_at = self.distance(row.field(self.columns.true_at))?;
        let reported_at = self.distance(row.field(self.columns.reported_at))?;
        Ok(LabeledReading {
            robot,
            scan: 0,
            truth,
            reported,
            true_at: true_at.filter(|_| truth != 0),
            reported_at: reported_at.filter(|_| reported != 0),
        })
    }

    fn robot<'t>(&self, row: &CsvRow<'t>) -> Option<Token<'t>> {
        self.columns.robot.map(|column| row.field(column))
    }

    fn observation(&self, word: Token<'_>) -> Result<usize, InputError> {
        self.observations.iter().position(|name| name == word.text).ok_or_else(|| {
            let remedy = "give an observation; `nothing` where there is none";
            word.error(&self.place, "the observation is empty".to_string(), remedy)
        })
    }

    fn distance(&self, word: Token<'_>) -> Result<Option<Distance>, InputError> {
        match word.text {
            "" | BEYOND => Ok(None),
            _ if self.columns.in_meters => self.range(word).map(Some),
            _ => self.class(word).map(Some),
        }
    }

    fn range(&self, word: Token<'_>) -> Result<Distance, InputError> {
        let range_m = word.number(&self.place)?;
        if range_m < 0.0 {
            let cause = format!("a distance of {range_m} m");
            return Err(word.error(&self.place, cause, "give a distance of at least 0 m"));
        }
        Ok(Distance { class: self.classes.class_of(range_m), range_m: Some(range_m) })
    }

    fn class(&self, word: Token<'_>) -> Result<Distance, InputError> {
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

    #[test]
    fn a_sensor_has_its_share_of_the_rows_whose_own_is_not_known() {
        let text = format!(
            "sensor_name,true,reported,true_class,reported_class\n{}{}{}",
            "left,nothing,nothing,beyond,beyond\n".repeat(90),
            "right,nothing,nothing,beyond,beyond\n".repeat(10),
            "left\n".repeat(20)
        );
        let table = CsvTable::parse_recording(&"f.csv", &text).unwrap();
        let rows = rows_of_sensor(&table, Some("right")).unwrap();
        assert_eq!((rows.len(), left_out::misfits_among(&table, rows.len())), (10, 2));
        let classes = DistanceClasses::new(&[1.0], &["near".to_owned(), "far".to_owned()]).unwrap();
        let parsed = read(&table, Some("right"), &classes).unwrap();
        assert_eq!(parsed.damaged, 2);
    }
}
