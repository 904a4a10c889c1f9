//! The recorded orders of a run that was decided from outside.

use sidestep::kernel::control::OrderReader;
use sidestep::kernel::{InputError, Simulation};
use sidestep_record::{for_each_block, tables};
use std::path::Path;

/// Lets a run follow the orders that its folder has, so that it comes out as it was recorded.
///
/// # Errors
/// When they cannot be read, or no longer be obeyed.
pub(crate) fn follow_recorded(run: &mut dyn Simulation, folder: &Path) -> Result<(), InputError> {
    if !tables(folder)?.iter().any(|name| name == OrderReader::TABLE) {
        return Ok(());
    }
    let place = || folder.join(OrderReader::TABLE).display().to_string();
    let mut reader = OrderReader::default();
    for_each_block(folder, OrderReader::TABLE, .., |block| {
        reader.read(&block.schema, &block.columns).ok_or_else(|| {
            let remedy = "copy the folder again from its source, or run the scenario again";
            InputError::new(place(), "the table has other columns than orders have", remedy)
        })
    })?;
    run.follow(reader.into_book()).map_err(|error| {
        let remedy = "the recording was changed, or another program made it: run it again";
        InputError::new(place(), error.to_string(), remedy)
    })
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

/// The reason why rows are read no further.
enum Stop {
    Found,
    Damaged(InputError),
}

impl From<InputError> for Stop {
    fn from(error: InputError) -> Self {
        Self::Damaged(error)
    }
}
