//! Tables of text with a header.

use super::columns::Layout;
use super::rows::{MISFIT_RULE, RowCollector, RowValues};
use super::value::Value;
use crate::table::{CsvRow, CsvTable};
use sidestep_kernel::InputError;

impl RowValues for CsvRow<'_> {
    fn value(&self, column: usize) -> Value<'_> {
        Value::from_text(self.text(column))
    }
}

/// Reads the rows of a table.
///
/// # Errors
/// When a column is missing that a track cannot be without.
pub(super) fn collect(collector: &mut RowCollector, text: &str) -> Result<(), InputError> {
    let table = CsvTable::parse_recording(&collector.place(), text)?;
    let layout = Layout::find(table.place(), table.header())
        .map_err(|error| error.with_position(table.header_line(), 1))?;
    collector.describe_source(&layout, "CSV");
    table.record_separators(&mut collector.report);
    for row in table.rows() {
        collector.push(row.line(), &layout, &row);
    }
    for misfit in table.misfits() {
        collector.leave_out(misfit.line, misfit.line_count, MISFIT_RULE);
    }
    Ok(())
}
