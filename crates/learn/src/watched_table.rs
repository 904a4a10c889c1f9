//! A table whose reader tells how far it is.

use super::log_table::{LogTable, Numbers, RowVisitor};
use sidestep_import::ImportReport;
use sidestep_kernel::InputError;

/// Rows between two reports: some milliseconds, so that a report costs nothing beside the rows, and a person who interrupts
/// does not wait.
const REPORT_ROWS: usize = 1 << 16;

/// Called with the rows that a pass over the table has visited; false ends the visit.
pub type RowWatcher<'w> = dyn Fn(usize) -> bool + Sync + 'w;

/// Another table, whose visits are reported, and can be ended.
///
/// Some tables are visited more than once: the number of rows begins at 0 again then.
pub struct WatchedTable<'t> {
    table: &'t dyn LogTable,
    watch: &'t RowWatcher<'t>,
}

impl<'t> WatchedTable<'t> {
    /// Creates one.
    pub fn new(table: &'t dyn LogTable, watch: &'t RowWatcher<'t>) -> Self {
        Self { table, watch }
    }

    fn report(&self, rows: usize) -> Result<(), InputError> {
        if (self.watch)(rows) {
            return Ok(());
        }
        let cause = format!("reading was interrupted after {rows} rows");
        Err(InputError::new(self.place(), cause, "begin again"))
    }
}

impl LogTable for WatchedTable<'_> {
    fn place(&self) -> &str {
        self.table.place()
    }

    fn header(&self) -> &[String] {
        self.table.header()
    }

    fn row_count(&self) -> usize {
        self.table.row_count()
    }

    fn require(&self, names: [&str; 4]) -> Result<[usize; 4], InputError> {
        self.table.require(names)
    }

    fn visit_rows(&self, columns: &[usize], visit: &mut RowVisitor<'_>) -> Result<(), InputError> {
        self.table.visit_rows(columns, &mut |number, row| {
            if number.is_multiple_of(REPORT_ROWS) {
                self.report(number)?;
            }
            visit(number, row)
        })?;
        self.report(self.row_count())
    }

    fn numbers(&self, column: usize) -> Option<&dyn Numbers> {
        self.table.numbers(column)
    }

    fn misfits(&self) -> (usize, Option<InputError>) {
        self.table.misfits()
    }

    fn record_separators(&self, report: &mut ImportReport) {
        self.table.record_separators(report);
    }

    fn option(&self, flag: &str, keyword: &str, value: &str) -> String {
        self.table.option(flag, keyword, value)
    }

    fn option_name<'n>(&self, flag: &'n str, keyword: &'n str) -> &'n str {
        self.table.option_name(flag, keyword)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{ColumnCells, ColumnTable};
    use crate::log_table::LogRow;
    use std::sync::Mutex;

    fn table(rows: usize) -> ColumnTable {
        let numbers = ColumnCells::Reals(Box::new(vec![1.0; rows]));
        ColumnTable::new("moves", vec![("ahead_boxes".to_string(), numbers)]).expect("a table")
    }

    #[test]
    fn a_pass_reports_its_rows_up_to_the_last() {
        let table = table(REPORT_ROWS + 5);
        let reports = Mutex::new(Vec::new());
        let watch = |rows| {
            reports.lock().expect("no panic").push(rows);
            true
        };
        let mut visited = 0;
        let count = &mut |_: usize, _: &dyn LogRow| {
            visited += 1;
            Ok(())
        };
        WatchedTable::new(&table, &watch).visit_rows(&[0], count).expect("no error");
        assert_eq!(visited, REPORT_ROWS + 5);
        assert_eq!(*reports.lock().expect("no panic"), [0, REPORT_ROWS, REPORT_ROWS + 5]);
    }

    #[test]
    fn a_watcher_ends_a_pass() {
        let table = table(3 * REPORT_ROWS);
        let watch = |rows| rows < REPORT_ROWS;
        let mut visited = 0;
        let count = &mut |_: usize, _: &dyn LogRow| {
            visited += 1;
            Ok(())
        };
        let error = WatchedTable::new(&table, &watch).visit_rows(&[0], count).unwrap_err();
        assert_eq!(visited, REPORT_ROWS);
        assert!(error.to_string().contains("interrupted after 65536 rows"), "{error}");
    }
}
