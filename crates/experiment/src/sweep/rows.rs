//! Outcomes -> a table of runs, the same for any order of arrival.

use super::column_schema::{
    ColumnOrder, ColumnSchema, FAILURE, common_type, for_each_field, type_of, value_text, widened,
};
use super::plan::{Plan, Shard, Trial};
use super::seeds::PilotRuns;
use super::table::{CYCLES, Role, RunColumn, RunTable};
use super::trial::Outcome;
use serde_json::{Map, Value};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnType, ColumnValues};
use std::collections::BTreeMap;

/// A table that grows by outcomes. A number takes 8 or 9 bytes, so a million runs of 40 metrics fit
/// into less than half a gigabyte.
#[derive(Debug, Default)]
pub struct RunTableBuilder {
    trials: Vec<u64>,
    columns: Vec<ColumnBuilder>,
    /// Indices of the columns, by role and name.
    index: BTreeMap<(Role, String), usize>,
}

/// A column, filled up to some row.
#[derive(Debug)]
struct ColumnBuilder {
    column: RunColumn,
    first: ColumnOrder,
}

impl RunTableBuilder {
    /// Returns the number of outcomes.
    pub fn len(&self) -> usize {
        self.trials.len()
    }

    /// Returns whether there are no outcomes.
    pub fn is_empty(&self) -> bool {
        self.trials.is_empty()
    }

    /// Adds an outcome; they may come in any order, because [`Self::build`] sorts them.
    pub fn push(&mut self, outcome: &Outcome) {
        self.trials.push(outcome.trial);
        for_each_field(outcome, |role, name, value, place| self.set(role, name, value, place));
    }

    /// Sets a field of the last row; its column is made when it first appears.
    fn set(&mut self, role: Role, name: &str, value: &Value, place: usize) {
        let row = self.trials.len() - 1;
        let trial = self.trials[row];
        let key = (role, name.to_string());
        let k = *self.index.entry(key).or_insert_with(|| {
            let values = ColumnValues::empty(ColumnType::F64);
            let column = RunColumn { name: name.into(), role, values };
            let first = ColumnOrder { trial: u64::MAX, place: usize::MAX };
            self.columns.push(ColumnBuilder { column, first });
            self.columns.len() - 1
        });
        let builder = &mut self.columns[k];
        // A missing value says nothing about the place of its column, see [`ColumnOrder`].
        let trial = if value.is_null() { u64::MAX } else { trial };
        builder.first = builder.first.min(ColumnOrder { trial, place });
        builder.column.values.resize(row);
        push_value(&mut builder.column.values, value);
    }

    /// Returns the table of all runs, sorted by trial: numbers of trial, variant and replicate, seed,
    /// parameters, metrics, digest, costs. Outcomes of trials that are not in the plan are left out.
    ///
    /// # Errors
    /// When a trial has two outcomes that differ, because they come from different programs or
    /// machines.
    pub fn build(self, plan: &Plan) -> Result<RunTable, InputError> {
        let schema = self.schema();
        let mut pilots = PilotRuns::new(plan);
        let digest = self.columns.iter().find(|c| c.column.role == Role::Digest);
        for (row, trial) in self.trials.iter().enumerate() {
            let end = digest.map_or_else(String::new, |c| c.column.values.text(row));
            pilots.add_digest(Some(*trial), end);
        }
        self.build_block(plan, &schema, &pilots)
    }

    /// Returns the columns of these outcomes alone.
    fn schema(&self) -> ColumnSchema {
        let mut schema = ColumnSchema::default();
        for ColumnBuilder { column, first } in &self.columns {
            let values = &column.values;
            let has_values = (0..values.len()).any(|row| !values.is_missing(row));
            schema.add_column(
                column.role,
                &column.name,
                has_values.then(|| values.column_type()),
                *first,
            );
        }
        schema
    }

    /// Returns a part of the table of all runs: the rows of these outcomes, sorted by trial, in the columns of all
    /// outcomes. Outcomes of trials that are not in the plan are left out, and runs beyond pilots that settle their
    /// variant.
    ///
    /// # Errors
    /// See [`RunTableBuilder::build`].
    pub fn build_block(
        mut self,
        plan: &Plan,
        schema: &ColumnSchema,
        pilots: &PilotRuns<'_>,
    ) -> Result<RunTable, InputError> {
        let rows = self.trials.len();
        for builder in &mut self.columns {
            builder.column.values.resize(rows);
        }
        let mut order: Vec<usize> = (0..rows).collect();
        order.retain(|&row| plan.trial_of(self.trials[row]).is_some());
        order.sort_by_key(|&row| (self.trials[row], row));
        // Shares that overlap may have run a trial twice.
        self.check_duplicates(&order)?;
        order.dedup_by_key(|row| self.trials[*row]);
        order.retain(|&row| {
            plan.trial_of(self.trials[row]).is_some_and(|trial| pilots.needs(&trial))
        });
        let mut columns = identity_columns(plan, order.iter().map(|&row| self.trials[row]));
        for (role, name, ty) in schema.columns() {
            let mut values = match self.index.get(&(role, name.to_string())) {
                Some(k) => {
                    // Moved out, so that no value stands in the memory twice.
                    let builder = &mut self.columns[*k];
                    let empty = ColumnValues::empty(ColumnType::F64);
                    let unsorted = std::mem::replace(&mut builder.column.values, empty);
                    unsorted.gather_rows(&order)
                }
                None => ColumnValues::empty(ty),
            };
            values.resize(order.len());
            columns.push(RunColumn { name: name.into(), role, values: widened(values, ty) });
        }
        Ok(RunTable { columns })
    }

    /// Checks that trials that were run twice have the same outcome.
    fn check_duplicates(&self, order: &[usize]) -> Result<(), InputError> {
        let digest = self.columns.iter().find(|c| c.column.role == Role::Digest);
        let Some(digest) = digest else { return Ok(()) };
        let digests = &digest.column.values;
        for pair in order.windows(2) {
            let [first, second] = [pair[0], pair[1]];
            let trial = self.trials[first];
            if trial == self.trials[second] && digests.text(first) != digests.text(second) {
                let cause = format!("two runs of trial {trial} differ");
                let remedy = "run all shares with the same build of the program";
                return Err(InputError::new("the shares", cause, remedy));
            }
        }
        Ok(())
    }
}

impl RunTable {
    /// Returns the columns without metrics over time and the times that runs took: it is the same when runs are made again.
    pub fn results(&self) -> Vec<&RunColumn> {
        let is_elsewhere = |role| matches!(role, Role::Cost | Role::Series);
        self.columns.iter().filter(|c| !is_elsewhere(c.role)).collect()
    }

    /// Returns the times that each run took.
    pub fn timings(&self) -> Vec<&RunColumn> {
        self.columns.iter().filter(|c| matches!(c.role, Role::Trial | Role::Cost)).collect()
    }

    /// Passes on the outcomes that the rows of a share's table stand for.
    pub fn for_each_outcome(&self, mut each: impl FnMut(Outcome)) {
        let trials = self.columns_with_role(Role::Trial).next();
        let digests = self.columns_with_role(Role::Digest).next();
        let failures = self.column(FAILURE);
        let cycles = self.column(CYCLES);
        for row in 0..self.runs() {
            let Some(trial) = whole_number(trials, row) else { continue };
            each(Outcome {
                trial,
                cycles: whole_number(cycles, row).unwrap_or(0),
                digest: digests.map_or_else(String::new, |c| c.values.text(row)),
                failure: failures.map(|c| c.values.text(row)).filter(|why| !why.is_empty()),
                metrics: self.fields(Role::Metric, row),
                costs: self.fields(Role::Cost, row),
                series: self.fields(Role::Series, row),
            });
        }
    }

    /// Without those that are fields of their own in an [`Outcome`].
    fn fields(&self, role: Role, row: usize) -> Map<String, Value> {
        let mut fields = Map::new();
        for column in self.columns_with_role(role) {
            if ![CYCLES, FAILURE].contains(&column.name.as_str()) {
                fields.insert(column.name.clone(), column.values.json(row));
            }
        }
        fields
    }
}

fn whole_number(column: Option<&RunColumn>, row: usize) -> Option<u64> {
    let ColumnValues::I64(values) = &column?.values else { return None };
    u64::try_from(*values.get(row)?).ok()
}

/// Returns the table of all trials of a plan: one row for each future run.
pub fn trial_table(plan: &Plan) -> RunTable {
    let mut trials: Vec<u64> = plan.shard_trials(Shard::ALL).map(|trial| trial.id).collect();
    trials.sort_unstable();
    RunTable { columns: identity_columns(plan, trials.into_iter()) }
}

/// Returns the identity of runs: the columns that follow from their trials.
fn identity_columns(plan: &Plan, trials: impl Iterator<Item = u64>) -> Vec<RunColumn> {
    let trials: Vec<Trial> = trials.filter_map(|id| plan.trial_of(id)).collect();
    let mut columns = vec![
        integer_column("cell", Role::Trial, trials.iter().map(|trial| trial.id)),
        integer_column("variant", Role::Variant, trials.iter().map(|trial| trial.variant.into())),
        integer_column(
            "replicate",
            Role::Replicate,
            trials.iter().map(|trial| trial.replicate.into()),
        ),
        integer_column("seed", Role::Seed, trials.iter().map(|trial| trial.seed)),
    ];
    for name in &plan.parameters {
        let levels = levels(plan, name);
        // The type of all variants of the plan, also of those without a row here: all blocks of a table have it.
        let ty = levels.iter().map(type_of).fold(None, common_type).unwrap_or(ColumnType::F64);
        let mut values = ColumnValues::empty(ColumnType::F64);
        for trial in &trials {
            push_value(&mut values, &levels[trial.variant as usize]);
        }
        let values = widened(values, ty);
        columns.push(RunColumn { name: name.clone(), role: Role::Parameter, values });
    }
    columns
}

fn integer_column(name: &str, role: Role, values: impl Iterator<Item = u64>) -> RunColumn {
    let values = ColumnValues::I64(values.map(|value| value as i64).collect());
    RunColumn { name: name.into(), role, values }
}

/// Returns the parameter's value in every variant: if numbers and words mix, all are words.
fn levels(plan: &Plan, name: &str) -> Vec<Value> {
    let values = plan.variants.iter().map(|variant| variant.value(name));
    let mut levels: Vec<Value> = values.map(|value| value.map_or(Value::Null, json)).collect();
    if levels.iter().any(Value::is_string) {
        for level in levels.iter_mut().filter(|level| !level.is_null()) {
            *level = value_text(level).into();
        }
    }
    levels
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
fn push_value(values: &mut ColumnValues, value: &Value) {
    if value.is_null() {
        return values.resize(values.len() + 1);
    }
    widen(values, value);
    match values {
        ColumnValues::I64(v) => v.push(value.as_i64()),
        ColumnValues::F64(v) => v.push(value.as_f64()),
        ColumnValues::Bool(v) => v.push(value.as_bool()),
        ColumnValues::Text(v) => v.push(Some(&value_text(value))),
        _ => unreachable!("`widen` makes columns of these four types"),
    }
}

/// Widens the column's type so that it can hold the value.
fn widen(values: &mut ColumnValues, value: &Value) {
    if type_of(value) == Some(values.column_type()) {
        return;
    }
    let has_values = (0..values.len()).any(|row| !values.is_missing(row));
    let own = has_values.then(|| values.column_type());
    let ty = common_type(own, type_of(value)).unwrap_or(ColumnType::F64);
    if ty != values.column_type() {
        *values = widened(std::mem::replace(values, ColumnValues::empty(ty)), ty);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{BaseScenario, Factor, Sweep};
    use proptest::prelude::*;
    use serde_json::json;
    use sidestep_scenario::Source;

    fn plan() -> Plan {
        let mut sweep = Sweep::from_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse("n=1,2.5,word").expect("valid")];
        sweep.replicates = 4;
        let variants = sweep.design.variants("test").expect("valid");
        let source = Source::new("s.toml", "", "");
        let base = BaseScenario { world: "robots", seed: 7, source: &source };
        Plan::new(&sweep, variants, base).expect("valid")
    }

    /// Outcomes with fields that differ in number and type from trial to trial.
    fn outcome(trial: u64) -> Outcome {
        let mut metrics = serde_json::Map::new();
        metrics.insert("always".into(), json!(trial));
        metrics.insert("wider".into(), if trial == 5 { json!(0.5) } else { json!(trial) });
        if trial % 2 == 1 {
            metrics.insert("sometimes".into(), json!(trial > 4));
        }
        metrics.insert("none".into(), Value::Null);
        let costs = [("run_wall_s".to_string(), json!(0.25))].into_iter().collect();
        let digest = format!("digest {trial}");
        Outcome { trial, cycles: 10, digest, failure: None, metrics, costs, series: Map::new() }
    }

    fn table(trials: impl IntoIterator<Item = u64>) -> RunTable {
        let mut rows = RunTableBuilder::default();
        trials.into_iter().for_each(|trial| rows.push(&outcome(trial)));
        rows.build(&plan()).expect("no twins that differ")
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
        assert!(matches!(table.column("wider").expect("there").values, ColumnValues::F64(_)));
        assert!(matches!(table.column("sometimes").expect("there").values, ColumnValues::Bool(_)));
        assert!(table.results().iter().all(|c| c.name != "run_wall_s"));
        assert_eq!(table.timings().len(), 2);
        assert_eq!(table.check(), Ok(()));
    }

    proptest! {
        #[test]
        fn the_order_in_which_outcomes_come_does_not_matter(
            trials in proptest::sample::subsequence((0..12u64).collect::<Vec<_>>(), 0..12).prop_shuffle(),
        ) {
            let mut sorted = trials.clone();
            sorted.sort_unstable();
            prop_assert_eq!(table(trials), table(sorted));
        }
    }

    #[test]
    fn outcomes_survive_the_table_of_their_share() {
        let whole = table(0..12);
        let mut rows = RunTableBuilder::default();
        whole.for_each_outcome(|outcome| rows.push(&outcome));
        assert_eq!(rows.build(&plan()), Ok(whole));
    }

    proptest! {
        #[test]
        fn shares_join_to_the_table_of_one_process(count in 1u64..7) {
            let mut rows = RunTableBuilder::default();
            for index in (0..count).rev() {
                let share = table((0..12).filter(|trial| trial % count == index));
                share.for_each_outcome(|outcome| rows.push(&outcome));
            }
            prop_assert_eq!(rows.build(&plan()), Ok(table(0..12)));
        }
    }

    proptest! {
        #[test]
        fn blocks_one_below_the_other_are_the_table(size in 1u64..9, step in 1u64..12) {
            let (plan, mut shape) = (plan(), ColumnSchema::default());
            let arrived: Vec<Outcome> = (0..12).map(|k| outcome((k * step + k / 3) % 12)).collect();
            let mut pilots = PilotRuns::new(&plan);
            for outcome in &arrived {
                shape.add(outcome);
                pilots.add(outcome);
            }
            let mut joined: Option<RunTable> = None;
            for first in (0..12).step_by(size as usize) {
                let mut rows = RunTableBuilder::default();
                arrived.iter().filter(|o| (first..first + size).contains(&o.trial)).for_each(|o| rows.push(o));
                let block = rows.build_block(&plan, &shape, &pilots).expect("no twins that differ");
                match &mut joined {
                    None => joined = Some(block),
                    Some(table) => for (column, more) in table.columns.iter_mut().zip(&block.columns) {
                        prop_assert_eq!((&column.name, column.role), (&more.name, more.role));
                        column.values.append(&more.values);
                    }
                }
            }
            prop_assert_eq!(joined, Some(table(arrived.iter().map(|o| o.trial))));
        }
    }

    #[test]
    fn a_trial_that_was_run_twice_counts_once_and_must_agree() {
        assert_eq!(table([3, 1, 3]), table([1, 3]));
        let mut rows = RunTableBuilder::default();
        rows.push(&outcome(3));
        rows.push(&Outcome { digest: "another".into(), ..outcome(3) });
        assert!(rows.build(&plan()).expect_err("they differ").cause().contains("trial 3"));
    }

    #[test]
    fn a_failed_run_has_a_row_that_says_why() {
        let mut rows = RunTableBuilder::default();
        rows.push(&outcome(0));
        rows.push(&Outcome::from_failure(plan().trial(0, 1), "index out of bounds"));
        let table = rows.build(&plan()).expect("no twins");
        let text = |name: &str, row| table.column(name).expect(name).values.text(row);
        assert_eq!(
            (text("failure", 0), text("failure", 1)),
            ("".into(), "index out of bounds".into())
        );
        assert_eq!(text("always", 1), "");
    }
}
