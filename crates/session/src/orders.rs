//! The recorded orders and controls of a run that was decided from outside.

use sidestep::kernel::control::{ControlReader, OrderReader};
use sidestep::kernel::ports::{TableSchema, Values};
use sidestep::kernel::{InputError, Simulation};
use sidestep_record::{for_each_block, tables};
use std::path::Path;

/// Lets a run follow the orders and the controls in its folder, so that it comes out as recorded.
///
/// # Errors
/// When they cannot be read, or can no longer be obeyed.
pub(crate) fn follow_recorded(run: &mut dyn Simulation, folder: &Path) -> Result<(), InputError> {
    let mut orders = OrderReader::default();
    if read(folder, OrderReader::TABLE, |schema, columns| orders.read(schema, columns))? {
        run.follow(orders.into_book()).map_err(|error| {
            let place = folder.join(OrderReader::TABLE).display().to_string();
            let remedy = "the recording was changed, or another program made it: run it again";
            InputError::new(place, error.to_string(), remedy)
        })?;
    }
    let mut controls = ControlReader::default();
    if read(folder, ControlReader::TABLE, |schema, columns| controls.read(schema, columns))? {
        run.retrace(controls.into_book());
    }
    Ok(())
}

/// Reads a table of a folder block by block. Returns whether the table exists.
fn read(
    folder: &Path,
    table: &str,
    mut take: impl FnMut(&TableSchema, &[Values]) -> Option<()>,
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
    if !tables(folder)?.iter().any(|name| name == OrderReader::TABLE) {
        return Ok(false);
    }
    let found = for_each_block(folder, OrderReader::TABLE, .., |block| {
        // The first row settles it.
        if block.rows() > 0 { Err(Stop::Found) } else { Ok(()) }
    });
    match found {
        Ok(()) => Ok(false),
        Err(Stop::Found) => Ok(true),
        Err(Stop::Damaged(error)) => Err(error),
    }
}

/// The reason to stop reading rows.
enum Stop {
    Found,
    Damaged(InputError),
}

impl From<InputError> for Stop {
    fn from(error: InputError) -> Self {
        Self::Damaged(error)
    }
}
