//! Orders read back from the rows that record them.

use super::orders::{ORDERS, OrderLog};
use super::team::MultiAgentOrder;
use crate::ports::{ColumnValues, MemoryRecorder, TableSchema};
use crate::units::{Cycle, EntityId};

/// Reads the orders of the table `orders`, block after block: each row has one value.
#[derive(Debug, Default)]
pub struct OrderTableReader {
    log: OrderLog,
    pending: Option<OrderBuilder>,
}

/// An order with values that are still being read.
#[derive(Debug)]
struct OrderBuilder {
    cycle: Cycle,
    agent: EntityId,
    order: String,
    values: Vec<f64>,
}

impl OrderTableReader {
    /// Name of the table in a recording.
    pub const TABLE: &'static str = ORDERS;

    /// Reads the next rows. `None` if the columns are not those of orders.
    pub fn read_block(&mut self, schema: &TableSchema, columns: &[ColumnValues]) -> Option<()> {
        let index = |name: &str| schema.columns.iter().position(|column| column.name == name);
        let column = |name: &str| columns.get(index(name)?);
        let (ColumnValues::U64(cycles), ColumnValues::U32(agents)) =
            (column("cycle")?, column("agent")?)
        else {
            return None;
        };
        let orders @ ColumnValues::Label(_) = column("order")? else { return None };
        let (ColumnValues::U32(parts), ColumnValues::F64(values)) =
            (column("part")?, column("value")?)
        else {
            return None;
        };
        let order_column = &schema.columns[index("order")?];
        for row in 0..orders.len() {
            // A block may end within an order, so an order is complete only when the next one begins.
            if *parts.get(row)? == 0 {
                self.finish_order();
                self.pending = Some(OrderBuilder {
                    cycle: *cycles.get(row)?,
                    agent: *agents.get(row)?,
                    order: order_column.text(orders, row),
                    values: Vec::new(),
                });
            }
            if let Some(pending) = &mut self.pending {
                pending.values.push(*values.get(row)?);
            }
        }
        Some(())
    }

    /// Returns the orders of all blocks so far; the last one counts as complete.
    pub fn into_log(mut self) -> OrderLog {
        self.finish_order();
        self.log
    }

    /// Adds the order that has all of its values to the log.
    fn finish_order(&mut self) {
        if let Some(OrderBuilder { cycle, agent, order, values }) = self.pending.take() {
            self.log
                .add(cycle, &MultiAgentOrder { order: &order, agents: &[agent], values: &values });
        }
    }
}

impl OrderLog {
    /// Returns the orders that a run recorded; `None` if there is no table of them.
    pub fn from_recorder(recorder: &MemoryRecorder) -> Option<Self> {
        let (schema, columns) = recorder.table(ORDERS)?;
        let mut reader = OrderTableReader::default();
        reader.read_block(schema, columns)?;
        Some(reader.into_log())
    }
}

#[cfg(test)]
mod tests {
    use super::super::orders::{OrderRow, orders_table};
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
        let mut book = OrderLog::default();
        book.add(3, &MultiAgentOrder { order: "to", agents: &[1], values: &[0.5, 0.25] });
        book.add(3, &MultiAgentOrder { order: "go", agents: &[2], values: &[4.0] });
        book.add(7, &MultiAgentOrder { order: "to", agents: &[1], values: &[1.0, 2.0] });
        let table = || orders_table(vec!["go".into(), "to".into()]);
        for cut in 0..=rows.len() {
            let mut reader = OrderTableReader::default();
            for part in [&rows[..cut], &rows[cut..]] {
                let mut recorder = MemoryRecorder::new(&[table().schema()]);
                recorder.append(0, &table().block_from_rows(part)).expect("it fits");
                let (schema, columns) = recorder.table("orders").expect("it is there");
                assert_eq!(reader.read_block(schema, columns), Some(()));
            }
            assert_eq!(reader.into_log(), book, "cut before row {cut}");
        }
    }

    #[test]
    fn another_table_is_none_of_orders() {
        let schema = TableSchema::new("orders", Vec::new());
        assert_eq!(OrderTableReader::default().read_block(&schema, &[]), None);
        assert_eq!(OrderLog::from_recorder(&MemoryRecorder::new(&[])), None);
    }
}
