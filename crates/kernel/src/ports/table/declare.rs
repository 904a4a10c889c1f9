//! Columns with their getters: rows -> a block of values.

use super::cells::{Cells, TextCells};
use super::column_type::ColumnType;
use super::schema::{ColumnSpec, TableSchema};
use super::values::ColumnValues;
use std::fmt;

/// A table of rows `R`: each column is declared once, with the getter that reads it from a row.
///
/// ```
/// use sidestep_kernel::ports::{Table, ColumnValues};
///
/// struct Arrival { cycle: u64, delay_s: Option<f64> }
///
/// let table = Table::new("arrivals")
///     .u64("cycle", "cycle in which it happened", |a: &Arrival| a.cycle)
///     .f64("delay_s", "its delay, where there was a plan", |a| a.delay_s);
/// assert_eq!(table.schema().columns[1].unit(), Some("s"));
/// let block = table.block_from_rows(&[Arrival { cycle: 7, delay_s: None }]);
/// assert_eq!(block[0], ColumnValues::U64(vec![7].into()));
/// ```
pub struct Table<R> {
    name: String,
    columns: Vec<TableColumn<R>>,
    about: Vec<(String, String)>,
}

/// A function that reads all values of a column from a block of rows: one call per block, so that
/// the getter is inlined into its loop.
type ColumnGetter<R> = Box<dyn Fn(&[R]) -> ColumnValues + Send + Sync>;

struct TableColumn<R> {
    spec: ColumnSpec,
    values: ColumnGetter<R>,
}

/// The result of a getter of a column with the cells `C`: the value, or an `Option` of it where it
/// may be missing.
pub trait CellValue<C> {
    /// Whether it may be missing.
    const IS_NULLABLE: bool;
}

impl<T> CellValue<Cells<T>> for T {
    const IS_NULLABLE: bool = false;
}

impl<T> CellValue<Cells<T>> for Option<T> {
    const IS_NULLABLE: bool = true;
}

impl CellValue<TextCells> for String {
    const IS_NULLABLE: bool = false;
}

impl CellValue<TextCells> for Option<String> {
    const IS_NULLABLE: bool = true;
}

/// Generates methods that declare a column of one type.
macro_rules! typed {
    ($($name:ident, $variant:ident, $cells:ty, $what:literal;)*) => {$(
        #[doc = concat!("Adds a column of ", $what, "; `get` reads it from a row.")]
        #[must_use]
        pub fn $name<V: CellValue<$cells>>(
            self,
            name: &str,
            meaning: &str,
            get: impl Fn(&R) -> V + Send + Sync + 'static,
        ) -> Self
        where
            $cells: FromIterator<V>,
        {
            let spec = ColumnSpec::new(name, ColumnType::$variant, meaning);
            let spec = ColumnSpec { is_nullable: V::IS_NULLABLE, ..spec };
            self.column(spec, move |rows| ColumnValues::$variant(rows.iter().map(&get).collect()))
        }
    )*};
}

impl<R> Table<R> {
    /// Creates a table without columns.
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), columns: Vec::new(), about: Vec::new() }
    }

    typed! {
        u32, U32, Cells<u32>, "unsigned 32-bit integers";
        u64, U64, Cells<u64>, "unsigned 64-bit integers";
        i32, I32, Cells<i32>, "signed 32-bit integers";
        i64, I64, Cells<i64>, "signed 64-bit integers";
        f64, F64, Cells<f64>, "floats";
        bool, Bool, Cells<bool>, "truth values";
        text, Text, TextCells, "text";
    }

    /// Adds a column of labels; `get` reads the label's index from a row.
    #[must_use]
    pub fn label<V: CellValue<Cells<u32>>, L: Into<String>>(
        self,
        name: &str,
        meaning: &str,
        labels: impl IntoIterator<Item = L>,
        get: impl Fn(&R) -> V + Send + Sync + 'static,
    ) -> Self
    where
        Cells<u32>: FromIterator<V>,
    {
        let spec = ColumnSpec::label(name, meaning, labels);
        let spec = ColumnSpec { is_nullable: V::IS_NULLABLE, ..spec };
        self.column(spec, move |rows| ColumnValues::Label(rows.iter().map(&get).collect()))
    }

    fn column(
        mut self,
        spec: ColumnSpec,
        values: impl Fn(&[R]) -> ColumnValues + Send + Sync + 'static,
    ) -> Self {
        self.columns.push(TableColumn { spec, values: Box::new(values) });
        self
    }

    /// Sets facts about all rows, by name: see [`TableSchema::about`].
    #[must_use]
    pub fn with_about(self, about: Vec<(String, String)>) -> Self {
        Self { about, ..self }
    }

    /// Returns its name and columns, and the facts about all rows.
    pub fn schema(&self) -> TableSchema {
        let columns = self.columns.iter().map(|column| column.spec.clone()).collect();
        TableSchema { about: self.about.clone(), ..TableSchema::new(&self.name, columns) }
    }

    /// Returns the values of all columns in these rows.
    pub fn block_from_rows(&self, rows: &[R]) -> Vec<ColumnValues> {
        self.columns.iter().map(|column| (column.values)(rows)).collect()
    }
}

impl<R> fmt::Debug for Table<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.schema().fmt(f)
    }
}

/// Returns the index of a thing in the list of all, from which a column's labels are made.
///
/// # Panics
/// When the thing is not in the list.
pub fn label_index<T: PartialEq>(all: &[T], one: &T) -> u32 {
    all.iter().position(|other| other == one).expect("the list has all of them") as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::recorder::check_block;

    #[test]
    fn rows_become_a_block_that_fits_the_schema() {
        let table = Table::new("all")
            .u32("a", "", |k: &u32| *k)
            .u64("b", "", |k| u64::from(*k))
            .i32("c", "", |k| -(*k as i32))
            .i64("d_s", "only of even rows", |k| (k % 2 == 0).then_some(i64::from(*k)))
            .f64("e_m", "", |k| f64::from(*k))
            .bool("f", "", |k| *k > 1)
            .label("g", "", ["no", "yes"], |k| *k % 2)
            .text("h", "", |k| (*k > 0).then(|| k.to_string()));
        let block = table.block_from_rows(&[0, 1, 2]);
        check_block(&table.schema(), &block).unwrap();
        assert_eq!(block[3], ColumnValues::I64([Some(0), None, Some(2)].into_iter().collect()));
        assert_eq!(block[6], ColumnValues::Label(vec![0, 1, 0].into()));
        assert_eq!(block[7].text(2), "2");
        let nullable = table.schema().columns.iter().map(|c| c.is_nullable).collect::<Vec<_>>();
        assert_eq!(nullable, [false, false, false, true, false, false, false, true]);
        assert_eq!(label_index(&["a", "b"], &"b"), 1);
    }
}
