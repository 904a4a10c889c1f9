//! Tables of samples, whatever they are made of: a CSV file, or columns of numbers and words.

use std::borrow::Cow;

use sidestep_import::ImportReport;
use sidestep_import::table::{CsvRow, CsvTable, Token};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_quote;

/// The value of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CellValue<'t> {
    /// A word, or a number as text.
    Word(&'t str),
    /// A number of a column of reals.
    Real(f64),
    /// A number of a column of integers.
    Whole(f64),
    /// Nothing: a column of numbers or words has none in this row.
    Missing,
}

/// One row of a [`LogTable`].
pub trait LogRow {
    /// Returns the value in a column, which the visit of the row has asked for.
    fn value(&self, column: usize) -> CellValue<'_>;

    /// Returns the error of the cell in a column.
    fn error(&self, column: usize, cause: String, remedy: &str) -> InputError;
}

/// What is done with each row of a table, by its number from 0; an error ends the visit.
pub type RowVisitor<'v> = dyn FnMut(usize, &dyn LogRow) -> Result<(), InputError> + 'v;

/// Numbers of a column that can be read again and again, so that no pass over a table needs a copy of all of them.
pub trait Numbers: Send + Sync {
    /// Returns the number of rows.
    fn row_count(&self) -> usize;

    /// Reads the numbers of the rows from `first_row` on, as many as `into` takes; NaN where one is missing.
    fn read(&self, first_row: usize, into: &mut [f64]);
}

/// A table with a sample per row, in the order of time.
pub trait LogTable: Sync {
    /// Returns the name of the table in errors.
    fn place(&self) -> &str;

    /// Returns the names of the columns.
    fn header(&self) -> &[String];

    /// Returns the number of rows.
    fn row_count(&self) -> usize;

    /// Returns the indices of the columns called `names`.
    ///
    /// # Errors
    /// When some of them are missing, or one is there twice.
    fn require(&self, names: [&str; 4]) -> Result<[usize; 4], InputError>;

    /// Visits all rows in order; `columns` are those that are looked at.
    ///
    /// # Errors
    /// The first error of `visit`.
    fn visit_rows(&self, columns: &[usize], visit: &mut RowVisitor<'_>) -> Result<(), InputError>;

    /// Returns the numbers of a column that has numbers only; `None` where it has words.
    fn numbers(&self, column: usize) -> Option<&dyn Numbers> {
        let _ = column;
        None
    }

    /// Returns the number of rows that could not even be cut into cells, and the error of the first of them.
    fn misfits(&self) -> (usize, Option<InputError>) {
        (0, None)
    }

    /// Records how cells and numbers are separated, where that was guessed.
    fn record_separators(&self, report: &mut ImportReport) {
        let _ = report;
    }

    /// Returns an option with its value as the caller of the table gives it: on a command line, or in a program.
    fn option(&self, flag: &str, keyword: &str, value: &str) -> String {
        let _ = keyword;
        format!("{flag} {}", shell_quote(value))
    }

    /// Returns the name of an option as the caller of the table gives it.
    fn option_name<'n>(&self, flag: &'n str, keyword: &'n str) -> &'n str {
        let _ = keyword;
        flag
    }

    /// Returns the index of the column called `name`, where there is one.
    fn find(&self, name: &str) -> Option<usize> {
        self.header().iter().position(|column| column == name)
    }
}

impl LogTable for CsvTable {
    fn place(&self) -> &str {
        self.place()
    }

    fn header(&self) -> &[String] {
        self.header()
    }

    fn row_count(&self) -> usize {
        self.rows().count()
    }

    fn require(&self, names: [&str; 4]) -> Result<[usize; 4], InputError> {
        self.columns(names)
    }

    fn visit_rows(&self, _columns: &[usize], visit: &mut RowVisitor<'_>) -> Result<(), InputError> {
        self.rows().enumerate().try_for_each(|(number, row)| visit(number, &row))
    }

    fn misfits(&self) -> (usize, Option<InputError>) {
        let first = self.misfits().first().map(|misfit| self.misfit_error(*misfit));
        (self.misfits().len(), first)
    }

    fn record_separators(&self, report: &mut ImportReport) {
        self.record_separators(report);
    }
}

impl LogRow for CsvRow<'_> {
    fn value(&self, column: usize) -> CellValue<'_> {
        CellValue::Word(self.text(column))
    }

    fn error(&self, column: usize, cause: String, remedy: &str) -> InputError {
        self.field(column).error(&self.place(), cause, remedy)
    }
}

/// A cell of a row.
#[derive(Clone, Copy)]
pub(crate) struct Cell<'r> {
    row: &'r dyn LogRow,
    column: usize,
}

impl<'r> Cell<'r> {
    pub(crate) fn new(row: &'r dyn LogRow, column: usize) -> Self {
        Self { row, column }
    }

    pub(crate) fn value(&self) -> CellValue<'r> {
        self.row.value(self.column)
    }

    /// Returns the text of the cell, as a table of text has it; empty where it is missing.
    pub(crate) fn text(&self) -> Cow<'r, str> {
        match self.value() {
            CellValue::Word(word) => Cow::Borrowed(word),
            CellValue::Real(number) => Cow::Owned(format!("{number:?}")),
            CellValue::Whole(number) => Cow::Owned(format!("{number}")),
            CellValue::Missing => Cow::Borrowed(""),
        }
    }

    pub(crate) fn error(&self, cause: String, remedy: &str) -> InputError {
        self.row.error(self.column, cause, remedy)
    }

    /// Reads the cell as a finite number.
    pub(crate) fn number(&self) -> Result<f64, InputError> {
        match self.value() {
            CellValue::Real(number) | CellValue::Whole(number) if number.is_finite() => Ok(number),
            CellValue::Missing => Err(self.missing("give a number in each row")),
            _ => self.token(|token| token.number(&"")),
        }
    }

    /// Reads the cell as a whole number from 0.
    pub(crate) fn integer(&self) -> Result<u32, InputError> {
        match self.value() {
            CellValue::Whole(number) if (0.0..=f64::from(u32::MAX)).contains(&number) => {
                Ok(number as u32)
            }
            CellValue::Missing => Err(self.missing("give a whole number in each row")),
            CellValue::Real(number) => {
                let cause = format!("`{number:?}` is not a whole number from 0");
                Err(self.error(cause, "give a column of integers, such as 14"))
            }
            _ => self.token(|token| token.integer(&"")),
        }
    }

    fn missing(&self, remedy: &str) -> InputError {
        self.error("the value is missing (None or NaN)".to_string(), remedy)
    }

    /// Reads the text of the cell; the error of its parser gets the place of the cell.
    fn token<T>(
        &self,
        parse: impl FnOnce(&Token<'_>) -> Result<T, InputError>,
    ) -> Result<T, InputError> {
        let text = self.text();
        let token = Token { text: &text, line: 1, column: 1 };
        parse(&token).map_err(|error| self.error(error.cause().to_string(), error.remedy()))
    }
}
