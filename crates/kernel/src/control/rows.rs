//! Orders read back from the rows that record them.

use super::book::{ORDERS, OrderBook};
use super::team::Orders;
use crate::ports::{MemoryRecorder, TableSchema, Values};
use crate::units::{Cycle, EntityId};

/// Reads the orders of the table `orders`, block after block: each row has one value.
#[derive(Debug, Default)]
pub struct OrderReader {
    book: OrderBook,
    pending: Option<Pending>,
}

/// An order with values that are still being read.
#[derive(Debug)]
struct Pending {
    cycle: Cycle,
    agent: EntityId,
    order: String,
    values: Vec<f64>,
}

impl OrderReader {
    /// Name of the table that it reads.
    pub const TABLE: &'static str = ORDERS;

    /// Reads the next rows. `None` if the columns are not those of orders.
    pub fn read(&mut self, schema: &TableSchema, columns: &[Values]) -> Option<()> {
        let at = |name: &str| schema.columns.iter().position(|column| column.name == name);
        let column = |name: &str| columns.get(at(name)?);
        let (Values::U64(cycles), Values::U32(agents)) = (column("cycle")?, column("agent")?)
        else {
            return None;
        };
        let orders @ Values::Label(_) = column("order")? else { return None };
        let (Values::U32(parts), Values::F64(values)) = (column("part")?, column("value")?) else {
            return None;
        };
        let names = &schema.columns[at("order")?];
        for row in 0..orders.len() {
            if *parts.get(row)? == 0 {
                self.close();
                let (cycle, agent) = (*cycles.get(row)?, *agents.get(row)?);
                let order = names.text(orders, row);
                self.pending = Some(Pending { cycle, agent, order, values: Vec::new() });
            }
            if let Some(pending) = &mut self.pending {
                pending.values.push(*values.get(row)?);
            }
        }
        Some(())
    }

    /// Returns all orders that were read.
    pub fn into_book(mut self) -> OrderBook {
        self.close();
        self.book
    }

    /// Notes the order that has all of its values.
    fn close(&mut self) {
        if let Some(Pending { cycle, agent, order, values }) = self.pending.take() {
            self.book.note(cycle, &Orders { order: &order, agents: &[agent], values: &values });
        }
    }
}

impl OrderBook {
    /// Returns the orders that a run recorded; `None` if there is no table of them.
    pub fn recorded(recorder: &MemoryRecorder) -> Option<Self> {
        let (schema, columns) = recorder.table(ORDERS)?;
        let mut reader = OrderReader::default();
        reader.read(schema, columns)?;
        Some(reader.into_book())
    }
}

#[cfg(test)]
mod tests {
    use super::super::book::{OrderRow, table};
    use super::*;
    use crate::ports::Recorder;

    fn row(cycle: Cycle, agent: EntityId, order: u32, part: u32, value: f64) -> OrderRow {
        OrderRow { cycle, agent, order, part, value }
    }

    #[test]
    fn orders_are_read_back_also_where_a_block_ends_within_one() {
        let rows = [
            row(3, 1, 1, 0, 0.5),
            row(3, 1, 1, 1, 0.25),
            row(3, 2, 0, 0, 4.0),
            row(7, 1, 1, 0, 1.0),
            row(7, 1, 1, 1, 2.0),
        ];
        let mut book = OrderBook::default();
        book.note(3, &Orders { order: "to", agents: &[1], values: &[0.5, 0.25] });
        book.note(3, &Orders { order: "go", agents: &[2], values: &[4.0] });
        book.note(7, &Orders { order: "to", agents: &[1], values: &[1.0, 2.0] });
        let table = || table(vec!["go".into(), "to".into()]);
        for cut in 0..=rows.len() {
            let mut reader = OrderReader::default();
            for part in [&rows[..cut], &rows[cut..]] {
                let mut recorder = MemoryRecorder::new(&[table().schema()]);
                recorder.append(0, &table().block(part)).expect("it fits");
                let (schema, columns) = recorder.table("orders").expect("it is there");
                assert_eq!(reader.read(schema, columns), Some(()));
            }
            assert_eq!(reader.into_book(), book, "cut before row {cut}");
        }
    }

    #[test]
    fn another_table_is_none_of_orders() {
        let schema = TableSchema::new("orders", Vec::new());
        assert_eq!(OrderReader::default().read(&schema, &[]), None);
        assert_eq!(OrderBook::recorded(&MemoryRecorder::new(&[])), None);
    }
}
