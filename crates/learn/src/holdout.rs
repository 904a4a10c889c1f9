//! A test of how well a part of the events predicts the rest.

use std::collections::BTreeMap;

use serde::Serialize;

use super::counts::{CountTable, smooth};
use sidestep_kernel::math::ln;
use sidestep_statistics::chi_square_p_value;

/// Cells expected to hold fewer counts than this are pooled before a chi-square test, because the statistic follows
/// the chi-square distribution only where expected counts are not small; 5 is the customary bound (Cochran 1954).
const MIN_EXPECTED_COUNT: f64 = 5.0;

/// The way in which a log is cut into parts that are to follow one law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Every k-th event is held out.
    Alternate,
    /// Each quarter of the log is held out in turn: shows errors that change in time.
    Time,
    /// Each robot is held out in turn: shows robots that differ.
    Robot,
}

impl Split {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alternate => "alternate",
            Self::Time => "time",
            Self::Robot => "robot",
        }
    }
}

/// The agreement of held-out events with the table learned from the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HoldoutTest {
    /// Name of the table of counts.
    pub table: String,
    /// The way in which the log was cut into parts.
    pub split: Split,
    /// Number of parts that were compared.
    pub parts: usize,
    /// Robots that differ from the others far beyond chance (p < 0.0001 for each), the oddest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub odd_parts: Vec<String>,
    /// Number of events used for learning. Where each part is held out in turn, that of all events.
    pub trained_on: f64,
    /// Number of events held out, which the learned table is to predict.
    pub held_out: f64,
    /// Chi-square statistic of the hypothesis that both parts follow one law.
    pub chi_square: f64,
    /// Its degrees of freedom, after cells that expect fewer than 5 counts are pooled.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least this large under that hypothesis, if events are
    /// independent. Readings of one image are not independent: there a small value says nothing
    /// more. Where an event is spread over outcomes (phase averaging) the value is too high.
    pub p_value: f64,
    /// Mean of `-ln P(outcome)` over the events held out, in nat, with the smoothed learned
    /// probabilities; `None` when nothing was held out or a probability was 0.
    pub log_loss: Option<f64>,
    /// The same with the best possible probabilities, those of the held-out part itself.
    pub log_loss_floor: Option<f64>,
}

/// Splits events into those for learning and every `every`-th, which is held out.
pub fn split<T>(events: &[T], every: usize) -> (Vec<&T>, Vec<&T>) {
    let mut train = Vec::new();
    let mut held = Vec::new();
    for (index, event) in events.iter().enumerate() {
        if index % every == every - 1 {
            held.push(event);
        } else {
            train.push(event);
        }
    }
    (train, held)
}

/// Compares two tables of the same shape; `alpha` smooths the learned one for the log-loss.
pub fn holdout_test(trained: &CountTable, held: &CountTable, alpha: f64) -> HoldoutTest {
    let n_rows = trained.rows().len();
    let tests: Vec<(f64, usize)> =
        (0..n_rows).map(|row| homogeneity(&[trained.row(row), held.row(row)])).collect();
    let chi_square = tests.iter().map(|test| test.0).sum();
    let degrees_of_freedom = tests.iter().map(|test| test.1).sum();
    HoldoutTest {
        table: trained.name().to_owned(),
        split: Split::Alternate,
        parts: 2,
        odd_parts: Vec::new(),
        trained_on: (0..n_rows).map(|row| trained.total(row)).sum(),
        held_out: (0..n_rows).map(|row| held.total(row)).sum(),
        chi_square,
        degrees_of_freedom,
        p_value: chi_square_p_value(chi_square, degrees_of_freedom),
        log_loss: log_loss(trained, held, alpha),
        log_loss_floor: log_loss(held, held, 0.0),
    }
}

/// Returns chi-square statistic and degrees of freedom of Pearson's test of homogeneity: "some samples, one law".
fn homogeneity(samples: &[&[f64]]) -> (f64, usize) {
    let sizes: Vec<f64> = samples.iter().map(|sample| sample.iter().sum()).collect();
    let total: f64 = sizes.iter().sum();
    let smallest = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    if samples.len() < 2 || smallest <= 0.0 {
        return (0.0, 0);
    }
    // A cell's expected count is least in the smallest sample, so that one decides what is pooled.
    let cells = pool_rare(samples, MIN_EXPECTED_COUNT * total / smallest);
    let statistic = cells.iter().map(|cell| {
        let share = cell.iter().sum::<f64>() / total;
        let parts = cell.iter().zip(&sizes);
        parts.map(|(&observed, size)| relative_deviation(observed, size * share)).sum::<f64>()
    });
    (statistic.sum(), (cells.len() - 1) * (samples.len() - 1))
}

/// Returns a cell's part of Pearson's statistic.
fn relative_deviation(observed: f64, expected: f64) -> f64 {
    (observed - expected) * (observed - expected) / expected
}

/// Returns the cells of some samples, each with its count in every sample, the rarest joined until each holds `least`
/// counts.
fn pool_rare(samples: &[&[f64]], least: f64) -> Vec<Vec<f64>> {
    let columns = samples.first().map_or(0, |sample| sample.len());
    let counts = |column: usize| samples.iter().map(|sample| sample[column]).collect::<Vec<f64>>();
    let mut cells: Vec<Vec<f64>> = (0..columns).map(counts).collect();
    let sum = |cell: &[f64]| cell.iter().sum::<f64>();
    cells.sort_by(|x, y| sum(x).total_cmp(&sum(y)));
    let mut pooled: Vec<Vec<f64>> = Vec::new();
    let mut open = vec![0.0; samples.len()];
    for cell in cells {
        add_counts(&mut open, &cell);
        if sum(&open) >= least {
            pooled.push(std::mem::replace(&mut open, vec![0.0; samples.len()]));
        }
    }
    // What is left over holds too few counts for a cell of its own, so it joins the last one.
    match pooled.last_mut() {
        Some(last) => add_counts(last, &open),
        None => pooled.push(open),
    }
    pooled
}

fn add_counts(to: &mut [f64], counts: &[f64]) {
    to.iter_mut().zip(counts).for_each(|(to, count)| *to += count);
}

/// Returns the tests that hold out each quarter of the time and, where there are several, each robot in turn, as far as
/// there are enough events to test anything. `events` are in the order of time; `count` makes their table.
pub(crate) fn tests_by_parts<T>(
    events: &[T],
    robot_of: impl Fn(&T) -> u32,
    count: impl Fn(&[&T]) -> CountTable,
    alpha: f64,
) -> Vec<HoldoutTest> {
    let robots: Vec<u32> = events.iter().map(robot_of).collect();
    let time: Vec<u32> = quarters(&robots).into_iter().map(|quarter| quarter as u32).collect();
    let tables_of = |part_of: Vec<u32>| {
        let mut parts: BTreeMap<u32, Vec<&T>> = BTreeMap::new();
        for (event, part) in events.iter().zip(part_of) {
            parts.entry(part).or_default().push(event);
        }
        let tables = parts.iter().map(|(part, events)| (part.to_string(), count(events)));
        tables.collect::<Vec<_>>()
    };
    let parts = PartTables { time: tables_of(time), robots: tables_of(robots) };
    tests_of_tables(&parts, alpha)
}

/// The tables of the parts of a log, with the names of the parts; parts without events are left out.
pub(crate) struct PartTables {
    /// Of each quarter of the time.
    pub(crate) time: Vec<(String, CountTable)>,
    /// Of each robot, by rising numbers.
    pub(crate) robots: Vec<(String, CountTable)>,
}

/// Returns the tests of [`tests_by_parts`] for tables that were counted already.
pub(crate) fn tests_of_tables(parts: &PartTables, alpha: f64) -> Vec<HoldoutTest> {
    let time = parts_test(&parts.time, Split::Time, alpha);
    let robots = parts_test(&parts.robots, Split::Robot, alpha);
    time.into_iter().chain(robots).filter(|test| test.degrees_of_freedom > 0).collect()
}

/// Number of parts of a log that are compared to find errors that change in time: also a change that is undone before
/// the end makes a quarter differ.
pub(crate) const TIME_PARTS: usize = 4;
/// A part with fewer events in a row is left out of its test: it would force all cells to be pooled.
const MIN_PART_EVENTS: f64 = 20.0;
/// Among more parts no odd ones are searched, because each is compared with all others again and again.
const MAX_SEARCHED_PARTS: usize = 256;
/// A part is odd when its own statistic against the others would be reached by chance in one of so many.
const ODD_P: f64 = 1e-4;

/// Returns the quarter of its robot's events in which each event lies; `robots` has the robot of each event, in the
/// order of time. Quarters of each robot by itself, so that robots that differ do not look like a change.
fn quarters(robots: &[u32]) -> Vec<usize> {
    let mut counter = PartCounter::default();
    robots.iter().for_each(|robot| counter.count(*robot));
    robots.iter().map(|robot| counter.next(*robot).quarter).collect()
}

/// The parts to which the events of a log belong, found in two passes over it: the first counts, the second asks.
#[derive(Debug, Clone, Default)]
pub(crate) struct PartCounter {
    /// The place of each robot in the lists below, by its number.
    places: BTreeMap<u32, usize>,
    /// Number of events of each robot.
    totals: Vec<usize>,
    /// Number of those that were asked for.
    seen: Vec<usize>,
    /// The robot of the last event and its place: most logs are of one robot, or have long runs of each.
    last: Option<(u32, usize)>,
}

/// The parts to which an event belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct EventParts {
    /// The quarter of the time of its robot, from 0.
    pub(crate) quarter: usize,
    /// The place of its robot among all robots.
    pub(crate) robot: usize,
}

impl PartCounter {
    /// Counts an event of this robot.
    pub(crate) fn count(&mut self, robot: u32) {
        let place = self.place(robot);
        self.totals[place] += 1;
    }

    /// Returns the parts of the next event, which is of this robot and was counted before.
    pub(crate) fn next(&mut self, robot: u32) -> EventParts {
        let place = self.place(robot);
        let before = self.seen[place];
        self.seen[place] += 1;
        // Numbers that another thread has changed between the passes must not end the program.
        let quarter = before * TIME_PARTS / self.totals[place].max(1);
        EventParts { quarter: quarter.min(TIME_PARTS - 1), robot: place }
    }

    /// Returns the numbers of all robots with their places, rising.
    pub(crate) fn robots(&self) -> impl Iterator<Item = (u32, usize)> {
        self.places.iter().map(|(number, place)| (*number, *place))
    }

    fn place(&mut self, robot: u32) -> usize {
        if let Some((last, place)) = self.last
            && last == robot
        {
            return place;
        }
        let place = *self.places.entry(robot).or_insert(self.totals.len());
        if place == self.totals.len() {
            self.totals.push(0);
            self.seen.push(0);
        }
        self.last = Some((robot, place));
        place
    }
}

/// Compares the parts of a log, each held out in turn; `parts` are tables of one shape with their names.
fn parts_test(parts: &[(String, CountTable)], split: Split, alpha: f64) -> Option<HoldoutTest> {
    let (_, first) = parts.first()?;
    let rows = 0..first.rows().len();
    let tests: Vec<(f64, usize)> = rows.map(|row| row_homogeneity(parts, row)).collect();
    let chi_square = tests.iter().map(|test| test.0).sum();
    let degrees_of_freedom = tests.iter().map(|test| test.1).sum();
    let all = sum_of(first, parts.iter().map(|(_, table)| table));
    let events = (0..first.rows().len()).map(|row| all.total(row)).sum();
    Some(HoldoutTest {
        table: first.name().to_owned(),
        split,
        parts: parts.len(),
        odd_parts: if split == Split::Robot { odd_parts(parts, &all) } else { Vec::new() },
        trained_on: events,
        held_out: events,
        chi_square,
        degrees_of_freedom,
        p_value: chi_square_p_value(chi_square, degrees_of_freedom),
        log_loss: mean_loss(parts, |table| log_loss(&difference(&all, table), table, alpha)),
        log_loss_floor: mean_loss(parts, |table| log_loss(table, table, 0.0)),
    })
}

/// Returns the test of one row over the parts that have enough events in it.
fn row_homogeneity(parts: &[(String, CountTable)], row: usize) -> (f64, usize) {
    let enough = parts.iter().filter(|(_, table)| table.total(row) >= MIN_PART_EVENTS);
    let samples: Vec<&[f64]> = enough.map(|(_, table)| table.row(row)).collect();
    homogeneity(&samples)
}

/// Returns the names of the parts that differ from all others together far beyond chance: the oddest first, which then
/// counts no longer among the others, and so on up to half of the parts.
fn odd_parts(parts: &[(String, CountTable)], all: &CountTable) -> Vec<String> {
    if parts.len() > MAX_SEARCHED_PARTS {
        return Vec::new();
    }
    let mut rest: Vec<&(String, CountTable)> = parts.iter().collect();
    let mut of_rest = all.clone();
    let mut odd = Vec::new();
    while odd.len() < parts.len() / 2 {
        let deviations = rest.iter().map(|(_, table)| deviation(table, &of_rest)).enumerate();
        let oddest = deviations.max_by(|a, b| (a.1).0.total_cmp(&(b.1).0));
        let Some((index, (chi_square, df))) = oddest else { break };
        if chi_square_p_value(chi_square, df) >= ODD_P {
            break;
        }
        let (name, table) = rest.remove(index);
        of_rest = difference(&of_rest, table);
        odd.push(name.clone());
    }
    odd
}

/// Returns chi-square statistic and degrees of freedom of a part against all others.
fn deviation(part: &CountTable, all: &CountTable) -> (f64, usize) {
    let others = difference(all, part);
    let mut sum = (0.0, 0);
    for row in 0..part.rows().len() {
        if part.total(row) >= MIN_PART_EVENTS {
            let (chi_square, df) = homogeneity(&[part.row(row), others.row(row)]);
            sum = (sum.0 + chi_square, sum.1 + df);
        }
    }
    sum
}

fn sum_of<'t>(shape: &CountTable, tables: impl Iterator<Item = &'t CountTable>) -> CountTable {
    let mut sum = CountTable::new(shape.name(), shape.rows(), shape.columns());
    tables.for_each(|table| sum.add_table(table, 1.0));
    sum
}

fn difference(all: &CountTable, part: &CountTable) -> CountTable {
    let mut rest = all.clone();
    rest.add_table(part, -1.0);
    rest
}

/// Returns the mean over the events of all parts of a loss per event of each; `None` where one has none.
fn mean_loss(
    parts: &[(String, CountTable)],
    loss: impl Fn(&CountTable) -> Option<f64>,
) -> Option<f64> {
    let mut sum = 0.0;
    let mut events = 0.0;
    for (_, table) in parts {
        let n: f64 = (0..table.rows().len()).map(|row| table.total(row)).sum();
        if n > 0.0 {
            sum += n * loss(table)?;
            events += n;
        }
    }
    (events > 0.0).then(|| sum / events)
}

fn log_loss(trained: &CountTable, held: &CountTable, alpha: f64) -> Option<f64> {
    let mut loss = 0.0;
    let mut events = 0.0;
    for row in 0..held.rows().len() {
        let probabilities = smooth(trained.row(row), alpha);
        for (count, p) in held.row(row).iter().zip(probabilities) {
            // 0 * ln 0 is 0: an outcome that did not occur costs nothing.
            if *count > 0.0 {
                loss -= count * ln(p);
                events += count;
            }
        }
    }
    (events > 0.0 && loss.is_finite()).then(|| loss / events)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(cells: &[f64]) -> CountTable {
        let columns: Vec<String> = (0..cells.len()).map(|i| i.to_string()).collect();
        let mut counts = CountTable::new("t", &["row".to_string()], &columns);
        for (column, count) in cells.iter().enumerate() {
            counts.add(0, column, *count);
        }
        counts
    }

    #[test]
    fn every_kth_event_is_held_out() {
        let (train, held) = split(&[0, 1, 2, 3, 4, 5, 6], 3);
        assert_eq!(train, [&0, &1, &3, &4, &6]);
        assert_eq!(held, [&2, &5]);
    }

    #[test]
    fn the_test_is_pearsons_for_a_two_by_two_table() {
        // 30/20 against 20/30: chi-square 4, one degree of freedom, p = 0.0455.
        let fit = holdout_test(&table(&[30.0, 20.0]), &table(&[20.0, 30.0]), 0.0);
        assert!((fit.chi_square - 4.0).abs() < 1e-12);
        assert_eq!(fit.degrees_of_freedom, 1);
        assert!((fit.p_value - 0.045_500).abs() < 1e-6);
        assert!((fit.log_loss_floor.unwrap() - 0.673_012).abs() < 1e-6);
        assert!(fit.log_loss.unwrap() > fit.log_loss_floor.unwrap());
    }

    fn named(parts: &[&[f64]]) -> Vec<(String, CountTable)> {
        parts.iter().enumerate().map(|(k, cells)| (k.to_string(), table(cells))).collect()
    }

    #[test]
    fn robots_that_differ_are_found_and_the_odd_ones_named() {
        let mut parts: Vec<&[f64]> = vec![&[600.0, 400.0]; 10];
        parts.extend([&[880.0, 120.0][..]; 3]);
        let test = parts_test(&named(&parts), Split::Robot, 0.5).unwrap();
        assert_eq!((test.parts, test.degrees_of_freedom), (13, 12));
        assert!(test.p_value < 1e-9 && test.log_loss > test.log_loss_floor);
        let mut odd = test.odd_parts.clone();
        odd.sort();
        assert_eq!(odd, ["10", "11", "12"]);
        let alike = parts_test(&named(&parts[..10]), Split::Robot, 0.5).unwrap();
        assert_eq!((alike.chi_square, alike.odd_parts.len()), (0.0, 0));
        assert_eq!(parts_test(&[], Split::Robot, 0.5), None);
    }

    #[test]
    fn a_part_with_few_events_does_not_hide_the_others() {
        let parts: [&[f64]; 3] = [&[300.0, 100.0], &[100.0, 300.0], &[3.0, 1.0]];
        let test = parts_test(&named(&parts), Split::Time, 0.5).unwrap();
        assert_eq!(test.degrees_of_freedom, 1);
        assert!(test.p_value < 1e-9);
    }

    #[test]
    fn quarters_are_of_each_robot_by_itself() {
        assert_eq!(quarters(&[7, 7, 3, 7, 7, 3]), [0, 1, 0, 2, 3, 2]);
        assert_eq!(quarters(&[1; 8]), [0, 0, 1, 1, 2, 2, 3, 3]);
    }

    #[test]
    fn rare_cells_are_pooled_and_an_empty_part_tests_nothing() {
        let fit_rare = holdout_test(&table(&[96.0, 3.0, 1.0]), &table(&[95.0, 2.0, 3.0]), 0.5);
        assert_eq!(fit_rare.degrees_of_freedom, 0);
        assert_eq!(fit_rare.p_value, 1.0);
        let empty = holdout_test(&table(&[5.0, 5.0]), &table(&[0.0, 0.0]), 0.5);
        assert_eq!((empty.degrees_of_freedom, empty.log_loss), (0, None));
    }

    #[test]
    fn an_outcome_held_impossible_has_no_finite_loss_unless_smoothed() {
        let (trained, held) = (table(&[10.0, 0.0]), table(&[9.0, 1.0]));
        assert_eq!(holdout_test(&trained, &held, 0.0).log_loss, None);
        assert!(holdout_test(&trained, &held, 0.5).log_loss.unwrap() > 0.3);
    }
}
