//! The cells of one column, of any type.

use super::cells::{Cells, TextCells};
use super::column_type::ColumnType;
use serde_json::Value;
use std::fmt::{self, Write};

/// The values of one column in one block; any of them may be missing.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// See [`ColumnType::U32`].
    U32(Cells<u32>),
    /// See [`ColumnType::U64`].
    U64(Cells<u64>),
    /// See [`ColumnType::I32`].
    I32(Cells<i32>),
    /// See [`ColumnType::I64`].
    I64(Cells<i64>),
    /// See [`ColumnType::F64`].
    F64(Cells<f64>),
    /// See [`ColumnType::Bool`].
    Bool(Cells<bool>),
    /// See [`ColumnType::Label`]; indices into the column's labels.
    Label(Cells<u32>),
    /// See [`ColumnType::Text`].
    Text(TextCells),
}

/// Runs the same code for the cells of any type.
macro_rules! with_cells {
    ($values:expr, $cells:ident => $work:expr) => {
        match $values {
            ColumnValues::U32($cells) | ColumnValues::Label($cells) => $work,
            ColumnValues::U64($cells) => $work,
            ColumnValues::I32($cells) => $work,
            ColumnValues::I64($cells) => $work,
            ColumnValues::F64($cells) => $work,
            ColumnValues::Bool($cells) => $work,
            ColumnValues::Text($cells) => $work,
        }
    };
}

impl ColumnValues {
    /// Creates a column of this type without values.
    pub fn empty(ty: ColumnType) -> Self {
        match ty {
            ColumnType::U32 => Self::U32(Cells::default()),
            ColumnType::U64 => Self::U64(Cells::default()),
            ColumnType::I32 => Self::I32(Cells::default()),
            ColumnType::I64 => Self::I64(Cells::default()),
            ColumnType::F64 => Self::F64(Cells::default()),
            ColumnType::Bool => Self::Bool(Cells::default()),
            ColumnType::Label => Self::Label(Cells::default()),
            ColumnType::Text => Self::Text(TextCells::default()),
        }
    }

    /// Returns the type of these values.
    pub fn column_type(&self) -> ColumnType {
        match self {
            Self::U32(_) => ColumnType::U32,
            Self::U64(_) => ColumnType::U64,
            Self::I32(_) => ColumnType::I32,
            Self::I64(_) => ColumnType::I64,
            Self::F64(_) => ColumnType::F64,
            Self::Bool(_) => ColumnType::Bool,
            Self::Label(_) => ColumnType::Label,
            Self::Text(_) => ColumnType::Text,
        }
    }

    /// Number of values, missing ones included.
    pub fn len(&self) -> usize {
        with_cells!(self, cells => cells.len())
    }

    /// Returns whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a mask of the rows that have a value; `None` where all have one.
    pub fn valid(&self) -> Option<&[bool]> {
        with_cells!(self, cells => cells.valid())
    }

    /// Returns whether the value in `row` is missing, or there is no such row.
    pub fn is_missing(&self, row: usize) -> bool {
        with_cells!(self, cells => cells.get(row).is_none())
    }

    /// Appends the values of `more`, which must be of the same type.
    ///
    /// # Panics
    /// When the types differ; [`check_block`](crate::ports::recorder::check_block) compares them
    /// for a whole block.
    pub fn append(&mut self, more: &Self) {
        match (self, more) {
            (Self::U32(a), Self::U32(b)) | (Self::Label(a), Self::Label(b)) => a.append(b),
            (Self::U64(a), Self::U64(b)) => a.append(b),
            (Self::I32(a), Self::I32(b)) => a.append(b),
            (Self::I64(a), Self::I64(b)) => a.append(b),
            (Self::F64(a), Self::F64(b)) => a.append(b),
            (Self::Bool(a), Self::Bool(b)) => a.append(b),
            (Self::Text(a), Self::Text(b)) => a.append(b),
            (a, b) => panic!("{:?} values appended to {:?} ones", b.column_type(), a.column_type()),
        }
    }

    /// Makes the column `rows` long; new values are missing.
    pub fn resize(&mut self, rows: usize) {
        with_cells!(self, cells => cells.resize(rows));
    }

    /// Keeps the values at which `keep` (of the same length) is true.
    pub fn retain_rows(&mut self, keep: &[bool]) {
        with_cells!(self, cells => cells.retain_rows(keep));
    }

    /// Returns the values of these rows, in this order; a row may occur several times.
    #[must_use]
    pub fn gather_rows(&self, order: &[usize]) -> Self {
        match self {
            Self::U32(cells) => Self::U32(cells.gather_rows(order)),
            Self::U64(cells) => Self::U64(cells.gather_rows(order)),
            Self::I32(cells) => Self::I32(cells.gather_rows(order)),
            Self::I64(cells) => Self::I64(cells.gather_rows(order)),
            Self::F64(cells) => Self::F64(cells.gather_rows(order)),
            Self::Bool(cells) => Self::Bool(cells.gather_rows(order)),
            Self::Label(cells) => Self::Label(cells.gather_rows(order)),
            Self::Text(cells) => Self::Text(cells.gather_rows(order)),
        }
    }

    /// Returns whether the values are numbers.
    pub fn is_numeric(&self) -> bool {
        !matches!(self, Self::Bool(_) | Self::Label(_) | Self::Text(_))
    }

    /// Returns the value in `row` as a number; true is 1, false 0, a label its index, and text
    /// `None`.
    pub fn number(&self, row: usize) -> Option<f64> {
        match self {
            Self::U32(cells) | Self::Label(cells) => cells.get(row).map(|&v| f64::from(v)),
            Self::U64(cells) => cells.get(row).map(|&v| v as f64),
            Self::I32(cells) => cells.get(row).map(|&v| f64::from(v)),
            Self::I64(cells) => cells.get(row).map(|&v| v as f64),
            Self::F64(cells) => cells.get(row).copied(),
            Self::Bool(cells) => cells.get(row).map(|&v| f64::from(v)),
            Self::Text(_) => None,
        }
    }

    /// Returns the value in `row` as JSON; a missing one is null, a label its index.
    pub fn json(&self, row: usize) -> Value {
        match self {
            Self::U32(cells) | Self::Label(cells) => cells.get(row).copied().into(),
            Self::U64(cells) => cells.get(row).copied().into(),
            Self::I32(cells) => cells.get(row).copied().into(),
            Self::I64(cells) => cells.get(row).copied().into(),
            Self::F64(cells) => cells.get(row).copied().into(),
            Self::Bool(cells) => cells.get(row).copied().into(),
            Self::Text(cells) => cells.get(row).into(),
        }
    }

    /// Writes the value in `row` as text, or nothing where it is missing. Floats have as many
    /// digits as an exact round trip needs; a label is its text in `labels`, or its index.
    ///
    /// # Errors
    /// When nothing can be written to `to`.
    pub fn write(&self, row: usize, labels: &[String], to: &mut impl Write) -> fmt::Result {
        if let Self::Label(cells) = self
            && let Some(label) = cells.get(row).and_then(|&label| labels.get(label as usize))
        {
            return to.write_str(label);
        }
        with_cells!(self, cells => cells.get(row).map_or(Ok(()), |value| write!(to, "{value}")))
    }

    /// Returns the value in `row` as [`write`](Self::write) writes it, a label as its index; see
    /// [`ColumnSpec::text`](super::ColumnSpec::text) for its text.
    pub fn text(&self, row: usize) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(row, &[], &mut text);
        text
    }
}

/// A column of a table that is whole in memory, with its role in the table, e.g. a parameter or a
/// metric of runs.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnWithRole<R> {
    /// Its name, with its unit where the quantity has one.
    pub name: String,
    /// Its role, by which readers select, e.g. only parameters.
    pub role: R,
    /// Its values, one per row.
    pub values: ColumnValues,
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_numbers_words_and_json() {
        let values = ColumnValues::Bool([Some(true), None].into_iter().collect());
        assert_eq!((values.number(0), values.number(1), values.number(9)), (Some(1.0), None, None));
        assert_eq!((values.text(0).as_str(), values.text(1).as_str()), ("true", ""));
        assert_eq!((values.json(0), values.json(1)), (json!(true), Value::Null));
        assert_eq!(ColumnValues::F64(vec![0.5].into()).text(0), "0.5");
        assert_eq!(ColumnValues::I64(vec![-3].into()).json(0), json!(-3));
        assert_eq!(ColumnValues::Text([Some("a")].into_iter().collect()).json(0), json!("a"));
        let labels = ["low".to_string(), "high".to_string()];
        let mut text = String::new();
        ColumnValues::Label(vec![1].into()).write(0, &labels, &mut text).unwrap();
        assert_eq!(text, "high");
    }

    #[test]
    fn every_type_grows_and_is_picked_from() {
        for ty in ColumnType::ALL {
            let mut values = ColumnValues::empty(ty);
            assert_eq!((values.column_type(), values.is_empty(), values.valid()), (ty, true, None));
            values.resize(2);
            values.append(&values.clone());
            assert_eq!((values.len(), values.is_missing(3)), (4, true));
            assert_eq!(values.gather_rows(&[0, 3]).len(), 2);
            values.retain_rows(&[true, false, false, false]);
            assert_eq!(values.len(), 1);
        }
    }
}
