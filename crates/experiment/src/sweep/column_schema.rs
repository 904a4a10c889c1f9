//! The columns of a table of runs, as all outcomes together make them.
//!
//! A table that is written block by block needs them before its first block: a metric may appear, or turn out to be
//! no whole number, in the last run.

use super::table::{CYCLES, Role};
use super::trial::Outcome;
use serde_json::Value;
use sidestep_kernel::ports::{ColumnType, ColumnValues};
use std::collections::BTreeMap;

/// Name of the column of reasons why runs failed; it exists only if one did.
pub(super) const FAILURE: &str = "failure";

/// The columns of a table of runs: results of runs and the times that they took, with the types that hold all values.
#[derive(Debug, Clone, Default)]
pub struct ColumnSchema(BTreeMap<(Role, String), ColumnStats>);

/// The type and the place of a column, by the outcomes so far.
#[derive(Debug, Clone, Copy)]
struct ColumnStats {
    /// Its type, once it has a value.
    ty: Option<ColumnType>,
    first: ColumnOrder,
}

/// The first trial in which a column has a value, and its place there: the order of columns, whoever ran what. Columns
/// without any value come last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ColumnOrder {
    pub(super) trial: u64,
    pub(super) place: usize,
}

impl ColumnSchema {
    /// Adds the columns of an outcome; the order of outcomes does not matter.
    pub fn add(&mut self, outcome: &Outcome) {
        for_each_field(outcome, |role, name, value, place| {
            let trial = if value.is_null() { u64::MAX } else { outcome.trial };
            self.add_column(role, name, type_of(value), ColumnOrder { trial, place });
        });
    }

    /// Adds a column, or a further value of it: the types are joined, and the earliest place
    /// counts.
    pub(super) fn add_column(
        &mut self,
        role: Role,
        name: &str,
        ty: Option<ColumnType>,
        first: ColumnOrder,
    ) {
        let stats = self.0.entry((role, name.to_string())).or_insert(ColumnStats { ty, first });
        stats.ty = common_type(stats.ty, ty);
        stats.first = stats.first.min(first);
    }

    /// Returns role, name and type of the columns, in the order of the table.
    pub(super) fn columns(&self) -> Vec<(Role, &str, ColumnType)> {
        let mut columns: Vec<_> = self.0.iter().collect();
        columns.sort_by_key(|((role, name), stats)| (*role, stats.first, name));
        let mut typed = Vec::with_capacity(columns.len());
        for ((role, name), stats) in columns {
            typed.push((*role, name.as_str(), stats.ty.unwrap_or(ColumnType::F64)));
        }
        typed
    }
}

/// Passes on the fields of an outcome: role, name, value, and place among those of the outcome.
pub(super) fn for_each_field(outcome: &Outcome, mut each: impl FnMut(Role, &str, &Value, usize)) {
    match &outcome.failure {
        Some(why) => each(Role::Metric, FAILURE, &why.as_str().into(), 0),
        None => {
            each(Role::Digest, "digest", &outcome.digest.as_str().into(), 0);
            each(Role::Metric, CYCLES, &outcome.cycles.into(), 1);
        }
    }
    let tables = [
        (Role::Metric, &outcome.metrics),
        (Role::Cost, &outcome.costs),
        (Role::Series, &outcome.series),
    ];
    for (role, fields) in tables {
        for (place, (name, value)) in fields.iter().enumerate() {
            each(role, name, value, place + 2);
        }
    }
}

/// Returns the type of column that holds a value; `None` for null, which all hold.
pub(super) fn type_of(value: &Value) -> Option<ColumnType> {
    match value {
        Value::Null => None,
        Value::Bool(_) => Some(ColumnType::Bool),
        Value::Number(number) if number.as_i64().is_some() => Some(ColumnType::I64),
        Value::Number(_) => Some(ColumnType::F64),
        _ => Some(ColumnType::Text),
    }
}

/// Returns the type that holds the values of two.
pub(super) fn common_type(a: Option<ColumnType>, b: Option<ColumnType>) -> Option<ColumnType> {
    use ColumnType::{F64, I64};
    match (a, b) {
        (None, other) | (other, None) => other,
        (Some(a), Some(b)) if a == b => Some(a),
        (Some(F64 | I64), Some(F64 | I64)) => Some(F64),
        _ => Some(ColumnType::Text),
    }
}

/// Returns the values of a column as those of a wider type.
pub(super) fn widened(values: ColumnValues, ty: ColumnType) -> ColumnValues {
    let n = values.len();
    match ty {
        _ if values.column_type() == ty => values,
        _ if (0..n).all(|row| values.is_missing(row)) => {
            let mut missing = ColumnValues::empty(ty);
            missing.resize(n);
            missing
        }
        ColumnType::F64 => ColumnValues::F64((0..n).map(|row| values.number(row)).collect()),
        _ => {
            let texts = (0..n).map(|row| {
                let is_missing = values.is_missing(row);
                (!is_missing).then(|| value_text(&values.json(row)))
            });
            ColumnValues::Text(texts.collect())
        }
    }
}

/// Strings without quotes, all else as JSON.
pub(super) fn value_text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}
