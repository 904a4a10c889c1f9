//! Prioritized planning: one agent after the other, each around those before it.
//!
//! Each takes the path that arrives earliest, by safe intervals (Silver 2005, "Cooperative pathfinding"; Phillips and
//! Likhachev 2011, "SIPP"). It is fast and knows bodies of any size, but it is not complete: an agent that finds no
//! path is put first, and all is planned again, until an order comes up a second time.

use crate::distances::GoalDistances;
use crate::instance::Instance;
use crate::plan::Plan;
use crate::safe_intervals::{Query, Reservations, search};
use sidestep_kernel::InputError;
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::sync::Arc;

/// What came of the attempts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PrioritizedOutcome {
    /// The plan, if any order gave one.
    pub plan: Option<Plan>,
    /// The last order in which agents were planned, the first one with the highest priority.
    pub order: Vec<usize>,
    /// The agent that found no path in the last order; none if there is a plan.
    pub blocked_agent: Option<usize>,
    /// The number of orders that were tried.
    pub orders: u32,
}

/// Plans in at most so many orders; the first one is by the length of the shortest paths, the longest first.
///
/// # Errors
/// Where no path leads from a start to its goal, even for an agent alone.
pub fn plan(instance: &Instance, max_orders: u32) -> Result<PrioritizedOutcome, InputError> {
    let distances = instance.distances()?;
    let mut order: Vec<usize> = (0..instance.agents().len()).collect();
    order.sort_by_key(|&agent| Reverse(distances[agent].steps(instance.start_node(agent))));
    let mut outcome = PrioritizedOutcome { plan: None, order, blocked_agent: None, orders: 0 };
    let mut tried = BTreeSet::new();
    while outcome.orders < max_orders {
        let mut next = outcome.order.clone();
        if let Some(agent) = outcome.blocked_agent {
            put_first(&mut next, agent);
        }
        // What failed once fails again.
        if !tried.insert(next.clone()) {
            break;
        }
        outcome.order = next;
        outcome.orders += 1;
        match plan_in_order(instance, distances, &outcome.order) {
            Ok(plan) => {
                outcome.plan = Some(plan);
                outcome.blocked_agent = None;
                break;
            }
            Err(agent) => outcome.blocked_agent = Some(agent),
        }
    }
    Ok(outcome)
}

/// Puts an agent first.
fn put_first(order: &mut [usize], agent: usize) {
    let position = order.iter().position(|&other| other == agent).unwrap_or(0);
    order[..=position].rotate_right(1);
}

/// Plans all agents in an order, or returns the first one that finds no path.
fn plan_in_order(
    instance: &Instance,
    distances: &[Arc<GoalDistances>],
    order: &[usize],
) -> Result<Plan, usize> {
    let boxes = instance.graphs().all().first().map_or(0, |graph| graph.len());
    let mut reservations = Reservations::new(boxes);
    let mut paths = vec![Vec::new(); order.len()];
    for &agent in order {
        let graph = instance.graph(agent);
        let query = Query {
            graph,
            model: instance.model(),
            distances: &distances[agent],
            start: instance.start_node(agent),
            goal: instance.goal_box(agent),
        };
        let path = search(query, &reservations).ok_or(agent)?;
        reservations.insert(graph, &path);
        paths[agent] = path.iter().map(|&node| graph.pose(node)).collect();
    }
    Ok(Plan::new(paths))
}
