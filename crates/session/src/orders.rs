//! The recorded orders and controls of a run that was decided from outside.

use sidestep_kernel::control::{ControlTableReader, OrderTableReader};
use sidestep_kernel::ports::{ColumnValues, TableSchema};
use sidestep_kernel::{InputError, Simulation};
use sidestep_record::{for_each_block, tables};
use std::path::Path;

/// Lets a run follow the orders and the controls in its folder, so that it comes out as recorded.
///
/// # Errors
/// When they cannot be read, or can no longer be obeyed.
pub(crate) fn replay_recorded(run: &mut dyn Simulation, folder: &Path) -> Result<(), InputError> {
    let mut orders = OrderTableReader::default();
    if read_blocks(folder, OrderTableReader::TABLE, |schema, columns| {
        orders.read_block(schema, columns)
    })? {
        run.replay_orders(orders.into_log()).map_err(|error| {
            let place = folder.join(OrderTableReader::TABLE).display().to_string();
            let remedy = "the recording was changed, or another program made it: run it again";
            InputError::new(place, error.to_string(), remedy)
        })?;
    }
    let mut controls = ControlTableReader::default();
    if read_blocks(folder, ControlTableReader::TABLE, |schema, columns| {
        controls.read_block(schema, columns)
    })? {
        run.replay_controls(controls.into_log());
    }
    Ok(())
}

/// Reads a table of a folder block by block. Returns whether the table exists.
fn read_blocks(
    folder: &Path,
    table: &str,
    mut take: impl FnMut(&TableSchema, &[ColumnValues]) -> Option<()>,
) -> Result<bool, InputError> {
    if !tables(folder)?.iter().any(|name| name == table) {
        return Ok(false);
    }
    for_each_block(folder, table, .., |block| {
        take(&block.schema, &block.columns).ok_or_else(|| {
            let remedy = "copy the folder again from its source, or run the scenario again";
            let cause = format!("the table has other columns or rows than {table} have");
            InputError::new(folder.join(table).display(), cause, remedy)
        })
    })?;
    Ok(true)
}

/// Returns whether a run folder has any orders.
///
/// # Errors
/// When they cannot be read.
pub(crate) fn has_orders(folder: &Path) -> Result<bool, InputError> {
    if !tables(folder)?.iter().any(|name| name == OrderTableReader::TABLE) {
        return Ok(false);
    }
    // An error is the only way to stop reading at the first row; the rest may be gigabytes.
    let found = for_each_block(folder, OrderTableReader::TABLE, .., |block| {
        if block.rows() > 0 { Err(ReadStop::Found) } else { Ok(()) }
    });
    match found {
        Ok(()) => Ok(false),
        Err(ReadStop::Found) => Ok(true),
        Err(ReadStop::Damaged(error)) => Err(error),
    }
}

/// The reason to stop reading rows.
enum ReadStop {
    Found,
    Damaged(InputError),
}

impl From<InputError> for ReadStop {
    fn from(error: InputError) -> Self {
        Self::Damaged(error)
    }
}
