//! Orders to agents: recorded as rows of a table, and kept in order to be replayed.

use super::team::MultiAgentOrder;
use crate::ports::Table;
use crate::units::{Cycle, EntityId};
use std::ops::Range;

pub(super) const ORDERS: &str = "orders";

/// One value of an order, as recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OrderRow {
    pub(crate) cycle: Cycle,
    pub(crate) agent: EntityId,
    /// Number of the order's name among all names.
    pub(crate) order: u32,
    pub(crate) part: u32,
    pub(crate) value: f64,
}

/// `names` are the labels of its column `order`: those of all orders of all teams.
pub(crate) fn orders_table(names: Vec<String>) -> Table<OrderRow> {
    Table::new(ORDERS)
        .u64("cycle", "cycle before which the order was given, counted from 0", |o: &OrderRow| {
            o.cycle
        })
        .u32("agent", "entity id of the agent that was ordered", |o| o.agent)
        .label("order", "the quantity that was ordered", names, |o| o.order)
        .u32("part", "place of the value in the order, from 0", |o| o.part)
        .f64("value", "the value, in the unit that the order's name ends in", |o| o.value)
}

/// Orders by the cycle before which each is given; those of one cycle stay in their order.
///
/// The agents and values of all entries lie in two long vectors, because a policy orders every agent before every
/// cycle: an entry of its own vectors each would be two allocations for a few numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OrderLog {
    /// In the order of their cycles.
    entries: Vec<OrderEntry>,
    agents: Vec<EntityId>,
    values: Vec<f64>,
}

/// One order to several agents.
#[derive(Debug, Clone, PartialEq)]
struct OrderEntry {
    cycle: Cycle,
    order: String,
    agents: Range<usize>,
    values: Range<usize>,
}

impl OrderLog {
    /// Adds orders that are given before a cycle, after those of the same cycle.
    pub fn add(&mut self, cycle: Cycle, orders: &MultiAgentOrder<'_>) {
        let agents = append(&mut self.agents, orders.agents);
        let values = append(&mut self.values, orders.values);
        // Recorded orders come back agent by agent: joining them restores the one order to all of them, which is
        // checked and given at once.
        if let Some(last) = self.entries.last_mut()
            && last.agents.end == agents.start
            && last.can_extend_with(cycle, orders)
        {
            last.agents.end = agents.end;
            last.values.end = values.end;
            return;
        }
        let index = self.entries.partition_point(|entry| entry.cycle <= cycle);
        let entry = OrderEntry { cycle, order: orders.order.into(), agents, values };
        self.entries.insert(index, entry);
    }

    /// Returns whether there are no orders.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Iterates over the orders, each with the cycle before which it is given.
    pub fn iter(&self) -> impl Iterator<Item = (Cycle, MultiAgentOrder<'_>)> {
        self.entries.iter().map(|entry| (entry.cycle, self.multi_agent_order(entry)))
    }

    fn multi_agent_order<'a>(&'a self, entry: &'a OrderEntry) -> MultiAgentOrder<'a> {
        MultiAgentOrder {
            order: &entry.order,
            agents: &self.agents[entry.agents.clone()],
            values: &self.values[entry.values.clone()],
        }
    }

    /// Iterates over the orders that are given before `cycle`.
    pub(crate) fn orders_due(&self, cycle: Cycle) -> impl Iterator<Item = MultiAgentOrder<'_>> {
        let due = self.count_before(cycle)..self.count_before(cycle.saturating_add(1));
        self.entries[due].iter().map(|entry| self.multi_agent_order(entry))
    }

    /// Returns the first cycle after `cycle` before which an order is given.
    pub(crate) fn next_after(&self, cycle: Cycle) -> Option<Cycle> {
        let next = self.count_before(cycle.saturating_add(1));
        self.entries.get(next).map(|entry| entry.cycle)
    }

    /// Index of the first entry of `cycle` or a later one.
    fn count_before(&self, cycle: Cycle) -> usize {
        self.entries.partition_point(|entry| entry.cycle < cycle)
    }
}

/// Appends a slice, and returns its range in the vector.
fn append<T: Copy>(all: &mut Vec<T>, more: &[T]) -> Range<usize> {
    let start = all.len();
    all.extend_from_slice(more);
    start..all.len()
}

impl OrderEntry {
    /// Returns whether further orders can be joined to the entry: the same order, with as many values per agent.
    fn can_extend_with(&self, cycle: Cycle, orders: &MultiAgentOrder<'_>) -> bool {
        let own_width = self.values.len().checked_div(self.agents.len());
        let other_width = orders.values.len().checked_div(orders.agents.len());
        self.cycle == cycle && self.order == orders.order && own_width == other_width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_due_by_cycle_and_stay_in_their_order() {
        let mut book = OrderLog::default();
        for (cycle, agent) in [(5, 2), (3, 1), (5, 0), (5, 7), (9, 4)] {
            book.add(
                cycle,
                &MultiAgentOrder { order: "a", agents: &[agent], values: &[f64::from(agent)] },
            );
        }
        let agents =
            |cycle| book.orders_due(cycle).flat_map(|o| o.agents.to_vec()).collect::<Vec<_>>();
        assert_eq!((agents(5), agents(3), agents(4)), (vec![2, 0, 7], vec![1], vec![]));
        let next = [0, 3, 4, 5, 9].map(|now| book.next_after(now));
        assert_eq!(next, [Some(3), Some(5), Some(5), Some(9), None]);
    }

    #[test]
    fn orders_of_one_cycle_are_joined_where_they_are_alike() {
        let mut book = OrderLog::default();
        let note = |book: &mut OrderLog, order, values: &[f64]| {
            book.add(1, &MultiAgentOrder { order, agents: &[0], values });
        };
        note(&mut book, "a", &[1.0]);
        note(&mut book, "a", &[2.0]);
        note(&mut book, "a", &[2.0, 3.0]);
        note(&mut book, "b", &[4.0]);
        let all: Vec<_> = book.iter().map(|(_, o)| (o.order, o.values.to_vec())).collect();
        assert_eq!(all, [("a", vec![1.0, 2.0]), ("a", vec![2.0, 3.0]), ("b", vec![4.0])]);
    }
}
