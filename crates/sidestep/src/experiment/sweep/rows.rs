//! Outcomes -> a table of runs, the same for any order of arrival.

use super::cell::Outcome;
use super::plan::{Plan, Shard};
use super::seeds::Trials;
use super::table::{Role, RunColumn, RunTable};
use super::variant::Variant;
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnType, Values};
use std::collections::BTreeMap;

/// Name of the column of reasons why runs failed; it exists only if one did.
const FAILURE: &str = "failure";

/// A table that grows by outcomes. A number takes 8 or 9 bytes, so a million runs of 40 metrics fit
/// into less than half a gigabyte.
#[derive(Debug, Default)]
pub struct Rows {
    cells: Vec<u64>,
    columns: Vec<Growing>,
    /// Indices of the columns, by role and name.
    index: BTreeMap<(Role, String), usize>,
}

/// A column, filled up to some row.
#[derive(Debug)]
struct Growing {
    column: RunColumn,
    /// The first cell in which it has a value, and its place there: the order of columns,
    /// independent of the order of shares. Columns without any value come last.
    first: (u64, usize),
}

impl Rows {
    /// Returns the number of outcomes.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there are no outcomes.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Returns the cells that have an outcome, in the order of arrival.
    pub fn cells(&self) -> &[u64] {
        &self.cells
    }

    /// Adds an outcome.
    pub fn push(&mut self, outcome: Outcome) {
        let Outcome { cell, cycles, digest, failure, metrics, costs } = outcome;
        self.cells.push(cell);
        if let Some(why) = failure {
            self.set(Role::Metric, FAILURE, &Value::String(why), 0);
        } else {
            self.set(Role::Digest, "digest", &Value::String(digest), 0);
            self.set(Role::Metric, "cycles_run", &cycles.into(), 1);
        }
        for (role, fields) in [(Role::Metric, metrics), (Role::Cost, costs)] {
            for (place, (name, value)) in fields.iter().enumerate() {
                self.set(role, name, value, place + 2);
            }
        }
    }

    /// Sets a field of the last row.
    fn set(&mut self, role: Role, name: &str, value: &Value, place: usize) {
        let row = self.cells.len() - 1;
        let cell = self.cells[row];
        let key = (role, name.to_string());
        let k = *self.index.entry(key).or_insert_with(|| {
            let values = Values::empty(ColumnType::F64);
            let column = RunColumn { name: name.into(), role, values };
            self.columns.push(Growing { column, first: (u64::MAX, usize::MAX) });
            self.columns.len() - 1
        });
        let growing = &mut self.columns[k];
        let cell = if value.is_null() { u64::MAX } else { cell };
        growing.first = growing.first.min((cell, place));
        growing.column.values.resize(row);
        add(&mut growing.column.values, value);
    }

    /// Returns the table of all runs, sorted by cell: numbers of cell, variant and replicate, seed,
    /// parameters, metrics, digest, costs. Outcomes of cells that are not in the plan are left out.
    ///
    /// # Errors
    /// When a cell has two outcomes that differ, because they come from different programs or
    /// machines.
    pub fn table(mut self, plan: &Plan) -> Result<RunTable, InputError> {
        let rows = self.cells.len();
        self.columns.iter_mut().for_each(|c| c.column.values.resize(rows));
        let mut order: Vec<usize> = (0..rows).collect();
        order.retain(|&row| plan.cell_of(self.cells[row]).is_some());
        order.sort_by_key(|&row| (self.cells[row], row));
        self.check_twins(&order)?;
        order.dedup_by_key(|row| self.cells[*row]);
        self.leave_out_settled(plan, &mut order);
        self.columns.sort_by_key(|c| (c.column.role, c.first));
        let mut columns = identity(plan, order.iter().map(|&row| self.cells[row]));
        for Growing { column, .. } in self.columns {
            columns.push(RunColumn { values: column.values.pick(&order), ..column });
        }
        Ok(RunTable { columns })
    }

    /// Leaves out runs beyond the trials of settled variants, which a share cannot know of.
    fn leave_out_settled(&self, plan: &Plan, order: &mut Vec<usize>) {
        let digest = self.columns.iter().find(|c| c.column.role == Role::Digest);
        let mut trials = Trials::new(plan);
        for &row in order.iter() {
            let end = digest.map_or_else(String::new, |c| c.column.values.text(row));
            trials.end(Some(self.cells[row]), end);
        }
        order.retain(|&row| plan.cell_of(self.cells[row]).is_some_and(|c| trials.asks_for(&c)));
    }

    /// Checks that cells that were run twice have the same outcome.
    fn check_twins(&self, order: &[usize]) -> Result<(), InputError> {
        let digest = self.columns.iter().find(|c| c.column.role == Role::Digest);
        let Some(digest) = digest else { return Ok(()) };
        let text = |row: usize| digest.column.values.text(row);
        for pair in order.windows(2) {
            let cell = self.cells[pair[0]];
            if cell == self.cells[pair[1]] && text(pair[0]) != text(pair[1]) {
                let cause = format!("two runs of cell {cell} differ");
                let remedy = "run all shares with the same build of the program";
                return Err(InputError::new("the shares", cause, remedy));
            }
        }
        Ok(())
    }
}

impl RunTable {
    /// Returns the columns without the times that runs took: it is the same when runs are made again.
    pub fn results(&self) -> Vec<&RunColumn> {
        self.columns.iter().filter(|c| c.role != Role::Cost).collect()
    }

    /// Returns the times that each run took.
    pub fn timings(&self) -> Vec<&RunColumn> {
        self.columns.iter().filter(|c| matches!(c.role, Role::Cell | Role::Cost)).collect()
    }

    /// Passes on the outcomes that the rows of a share's table stand for.
    pub fn outcomes(&self, mut each: impl FnMut(Outcome)) {
        let number = |row: usize, column: Option<&RunColumn>| match column.map(|c| &c.values) {
            Some(Values::I64(values)) => values.get(row).and_then(|n| u64::try_from(*n).ok()),
            _ => None,
        };
        let cell = self.of_role(Role::Cell).next();
        let digest = self.of_role(Role::Digest).next();
        let failure = self.column(FAILURE);
        for row in 0..self.runs() {
            let Some(cell) = number(row, cell) else { continue };
            let fields = |role: Role| {
                let own = |c: &&RunColumn| !["cycles_run", FAILURE].contains(&c.name.as_str());
                let columns = self.of_role(role).filter(own);
                columns.map(|c| (c.name.clone(), c.values.json(row))).collect()
            };
            each(Outcome {
                cell,
                cycles: number(row, self.column("cycles_run")).unwrap_or(0),
                digest: digest.map_or_else(String::new, |c| c.values.text(row)),
                failure: failure.map(|c| c.values.text(row)).filter(|why| !why.is_empty()),
                metrics: fields(Role::Metric),
                costs: fields(Role::Cost),
            });
        }
    }
}

/// Returns the table of all cells of a plan: one row for each future run.
pub fn cells(plan: &Plan) -> RunTable {
    let mut cells: Vec<u64> = plan.share(Shard::ALL).map(|cell| cell.id).collect();
    cells.sort_unstable();
    RunTable { columns: identity(plan, cells.into_iter()) }
}

/// Returns the identity of runs: the columns that follow from their cells.
fn identity(plan: &Plan, cells: impl Iterator<Item = u64>) -> Vec<RunColumn> {
    let cells: Vec<_> = cells.filter_map(|id| plan.cell_of(id)).collect();
    let ints = |name: &str, role, value: fn(&super::Cell) -> u64| RunColumn {
        name: name.into(),
        role,
        values: Values::I64(cells.iter().map(|c| value(c) as i64).collect()),
    };
    let mut columns = vec![
        ints("cell", Role::Cell, |c| c.id),
        ints("variant", Role::Variant, |c| c.variant.into()),
        ints("replicate", Role::Replicate, |c| c.replicate.into()),
        ints("seed", Role::Seed, |c| c.seed),
    ];
    for name in &plan.parameters {
        let levels = levels(plan, name);
        let mut values = Values::empty(ColumnType::F64);
        cells.iter().for_each(|cell| add(&mut values, &levels[cell.variant as usize]));
        columns.push(RunColumn { name: name.clone(), role: Role::Parameter, values });
    }
    columns
}

/// Returns the parameter's value in every variant: if numbers and words mix, all are words.
fn levels(plan: &Plan, name: &str) -> Vec<Value> {
    let of = |variant: &Variant| variant.value(name).map_or(Value::Null, json);
    let levels: Vec<Value> = plan.variants.iter().map(of).collect();
    let has_words = levels.iter().any(Value::is_string);
    let level = |v: Value| if has_words && !v.is_null() { words(&v).into() } else { v };
    levels.into_iter().map(level).collect()
}

/// Returns numbers, truth values and text unchanged; anything else as TOML.
fn json(value: &toml::Value) -> Value {
    match value {
        toml::Value::Integer(n) => (*n).into(),
        toml::Value::Float(x) => (*x).into(),
        toml::Value::Boolean(b) => (*b).into(),
        toml::Value::String(s) => s.clone().into(),
        other => other.to_string().into(),
    }
}

/// Appends a value; the column gets a wider type if necessary.
fn add(values: &mut Values, value: &Value) {
    if value.is_null() {
        return values.resize(values.len() + 1);
    }
    widen(values, value);
    match values {
        Values::I64(v) => v.push(value.as_i64()),
        Values::F64(v) => v.push(value.as_f64()),
        Values::Bool(v) => v.push(value.as_bool()),
        Values::Text(v) => v.push(Some(&words(value))),
        _ => unreachable!("`widen` makes columns of these four types"),
    }
}

fn words(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

/// Widens the column's type so that it can hold the value.
fn widen(values: &mut Values, value: &Value) {
    let fits = match values {
        Values::I64(_) => value.as_i64().is_some(),
        Values::F64(_) => value.is_f64(),
        Values::Bool(_) => value.is_boolean(),
        _ => true,
    };
    if fits {
        return;
    }
    let n = values.len();
    let is_new = (0..n).all(|row| values.is_missing(row));
    let empty = |ty| {
        let mut values = Values::empty(ty);
        values.resize(n);
        values
    };
    *values = match value {
        Value::Number(number) if is_new && number.as_i64().is_some() => empty(ColumnType::I64),
        Value::Bool(_) if is_new => empty(ColumnType::Bool),
        Value::Number(_) if is_new || values.is_numeric() => {
            Values::F64((0..n).map(|row| values.number(row)).collect())
        }
        _ => {
            let text = |row| (!values.is_missing(row)).then(|| words(&values.json(row)));
            Values::Text((0..n).map(text).collect())
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::sweep::{Base, Factor, Sweep};
    use crate::scenario::Source;
    use proptest::prelude::*;
    use serde_json::json;

    fn plan() -> Plan {
        let mut sweep = Sweep::of_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse("n=1,2.5,word").expect("valid")];
        sweep.replicates = 4;
        let variants = sweep.design.variants("test").expect("valid");
        let source = Source::new("s.toml", "", "");
        let base = Base { world: "robots", seed: 7, source: &source };
        Plan::new(&sweep, variants, base).expect("valid")
    }

    /// Outcomes whose fields differ in number and type from cell to cell.
    fn outcome(cell: u64) -> Outcome {
        let mut metrics = serde_json::Map::new();
        metrics.insert("always".into(), json!(cell));
        metrics.insert("wider".into(), if cell == 5 { json!(0.5) } else { json!(cell) });
        if cell % 2 == 1 {
            metrics.insert("sometimes".into(), json!(cell > 4));
        }
        metrics.insert("none".into(), Value::Null);
        let costs = [("run_wall_s".to_string(), json!(0.25))].into_iter().collect();
        let digest = format!("digest {cell}");
        Outcome { cell, cycles: 10, digest, failure: None, metrics, costs }
    }

    fn table(cells: impl IntoIterator<Item = u64>) -> RunTable {
        let mut rows = Rows::default();
        cells.into_iter().for_each(|cell| rows.push(outcome(cell)));
        rows.table(&plan()).expect("no twins that differ")
    }

    #[test]
    fn rows_have_identity_parameters_metrics_and_costs() {
        let table = table(0..12);
        let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
        let expected = [
            "cell",
            "variant",
            "replicate",
            "seed",
            "n",
            "cycles_run",
            "always",
            "wider",
            "sometimes",
            "none",
            "digest",
            "run_wall_s",
        ];
        assert_eq!(names, expected);
        let text = |name: &str, row| table.column(name).expect(name).values.text(row);
        assert_eq!([text("n", 0), text("n", 4), text("n", 8)], ["1", "2.5", "word"]);
        assert_eq!((text("seed", 3), text("seed", 5)), ("10".into(), "8".into()));
        assert!(matches!(table.column("wider").expect("there").values, Values::F64(_)));
        assert!(matches!(table.column("sometimes").expect("there").values, Values::Bool(_)));
        assert!(table.results().iter().all(|c| c.name != "run_wall_s"));
        assert_eq!(table.timings().len(), 2);
        assert_eq!(table.check(), Ok(()));
    }

    proptest! {
        #[test]
        fn the_order_in_which_outcomes_come_does_not_matter(
            cells in proptest::sample::subsequence((0..12u64).collect::<Vec<_>>(), 0..12).prop_shuffle(),
        ) {
            let mut sorted = cells.clone();
            sorted.sort_unstable();
            prop_assert_eq!(table(cells), table(sorted));
        }
    }

    #[test]
    fn outcomes_survive_the_table_of_their_share() {
        let whole = table(0..12);
        let mut rows = Rows::default();
        whole.outcomes(|outcome| rows.push(outcome));
        assert_eq!(rows.table(&plan()), Ok(whole));
    }

    proptest! {
        #[test]
        fn shares_join_to_the_table_of_one_process(count in 1u64..7) {
            let mut rows = Rows::default();
            for index in (0..count).rev() {
                let share = table((0..12).filter(|cell| cell % count == index));
                share.outcomes(|outcome| rows.push(outcome));
            }
            prop_assert_eq!(rows.table(&plan()), Ok(table(0..12)));
        }
    }

    #[test]
    fn a_cell_that_was_run_twice_counts_once_and_must_agree() {
        assert_eq!(table([3, 1, 3]), table([1, 3]));
        let mut rows = Rows::default();
        rows.push(outcome(3));
        rows.push(Outcome { digest: "another".into(), ..outcome(3) });
        assert!(rows.table(&plan()).expect_err("they differ").cause().contains("cell 3"));
    }

    #[test]
    fn a_failed_run_has_a_row_that_says_why() {
        let mut rows = Rows::default();
        rows.push(outcome(0));
        rows.push(Outcome::failed(plan().cell(0, 1), "index out of bounds"));
        let table = rows.table(&plan()).expect("no twins");
        let text = |name: &str, row| table.column(name).expect(name).values.text(row);
        assert_eq!(
            (text("failure", 0), text("failure", 1)),
            ("".into(), "index out of bounds".into())
        );
        assert_eq!(text("always", 1), "");
    }
}
