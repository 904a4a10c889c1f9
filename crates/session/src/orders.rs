//! The recorded orders of a run that was decided from outside.

use sidestep::kernel::InputError;
use sidestep::kernel::Simulation;
use sidestep::kernel::control::{OrderBook, Orders};
use sidestep::kernel::ports::Values;
use sidestep_record::{Table, for_each_block, read_table, tables};
use std::path::Path;

/// Name of the table of orders.
const ORDERS: &str = "orders";

/// Lets a run follow the orders that its folder has, so that it comes out as it was recorded.
///
/// # Errors
/// When they cannot be read, or no longer be obeyed.
pub(crate) fn follow_recorded(run: &mut dyn Simulation, folder: &Path) -> Result<(), InputError> {
    if !tables(folder)?.iter().any(|name| name == ORDERS) {
        return Ok(());
    }
    let mut reader = Reader { book: OrderBook::default(), pending: None };
    for_each_block(folder, ORDERS, .., |block| reader.read(&block, folder))?;
    reader.close();
    run.follow(reader.book).map_err(|error| {
        let remedy = "the recording was changed, or another program made it: run it again";
        InputError::new(folder.join(ORDERS).display(), error.to_string(), remedy)
    })
}

/// Returns whether a run folder has any orders.
///
/// # Errors
/// When they cannot be read.
pub(crate) fn has_orders(folder: &Path) -> Result<bool, InputError> {
    if !tables(folder)?.iter().any(|name| name == ORDERS) {
        return Ok(false);
    }
    Ok(read_table(folder, ORDERS, ..)?.rows() > 0)
}

/// Joins rows, each with one value, to orders.
struct Reader {
    book: OrderBook,
    /// The order whose values are being read: cycle, agent, name, values.
    pending: Option<(u64, u32, String, Vec<f64>)>,
}

impl Reader {
    fn read(&mut self, block: &Table, folder: &Path) -> Result<(), InputError> {
        let columns = ["cycle", "agent", "order", "part", "value"].map(|name| block.column(name));
        let [
            Some(Values::U64(cycles)),
            Some(Values::U32(agents)),
            Some(orders @ Values::Label(_)),
            Some(Values::U32(parts)),
            Some(Values::F64(values)),
        ] = columns
        else {
            let remedy = "copy the folder again from its source, or run the scenario again";
            let cause = "the table has other columns than orders have";
            return Err(InputError::new(folder.join(ORDERS).display(), cause, remedy));
        };
        let names = block.schema.columns.iter().find(|column| column.name == "order");
        for row in 0..block.rows() {
            if parts[row] == 0 {
                self.close();
                let name = names.map_or_else(String::new, |column| column.text(orders, row));
                self.pending = Some((cycles[row], agents[row], name, Vec::new()));
            }
            if let Some((.., all)) = &mut self.pending {
                all.push(values[row]);
            }
        }
        Ok(())
    }

    /// Notes the order that has all of its values.
    fn close(&mut self) {
        if let Some((cycle, agent, order, values)) = self.pending.take() {
            self.book.note(cycle, &Orders { order: &order, agents: &[agent], values: &values });
        }
    }
}
