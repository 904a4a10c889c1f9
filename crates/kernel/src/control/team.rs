//! Agents that are alike, and orders to them.

use super::error::OrderError;
use super::space::{BufferMut, ValueSpace};
use crate::units::EntityId;
use std::collections::{BTreeMap, BTreeSet};

/// Agents with the same observations and orders.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentTeam {
    /// Name, by which a caller selects it: the kind of its agents, and a number where several teams have the same.
    pub name: String,
    /// Its agents, rising; rows of arrays are in this order.
    pub agents: Vec<EntityId>,
    /// Spaces of their observations, in the order of the buffers of
    /// [`Simulation::observe`](crate::Simulation::observe).
    pub observation_spaces: Vec<ValueSpace>,
    /// Spaces of orders to them; empty for agents that decide for themselves.
    pub action_spaces: Vec<ValueSpace>,
}

/// One order to several agents: one row of values for each.
#[derive(Debug, Clone, Copy)]
pub struct MultiAgentOrder<'a> {
    /// Name of one of the receivers' action spaces.
    pub order: &'a str,
    /// Ids of the receivers, which may be of several teams that take this order.
    pub agents: &'a [EntityId],
    /// Their values, one agent after the other.
    pub values: &'a [f64],
}

/// One order to one agent, checked against its space.
#[derive(Debug, Clone, Copy)]
pub struct Order<'a> {
    /// Index of the receiver's team in [`AgentTeams::as_slice`].
    pub team: usize,
    /// Index of the space in [`AgentTeam::action_spaces`].
    pub space: usize,
    /// Id of the receiver.
    pub agent: EntityId,
    /// One per number of the space's shape, each within its bounds.
    pub values: &'a [f64],
}

/// The teams of a world, and their members.
#[derive(Debug, Clone, Default)]
pub struct AgentTeams {
    all: Vec<AgentTeam>,
    /// Number of each entity's team, by id; [`NONE`] for those in none.
    team_of: Vec<u32>,
    /// The world's noun for an agent, for errors.
    noun: &'static str,
    /// Names of all orders, each once: the labels of the table `orders`.
    order_names: Vec<String>,
}

const NONE: u32 = u32::MAX;

impl AgentTeams {
    /// Returns these teams; no agent is in two of them. `noun` is the noun for an agent. A repeated name
    /// gets a number: `robot`, `robot 2`.
    pub fn new(mut all: Vec<AgentTeam>, noun: &'static str) -> Self {
        number_duplicates(&mut all);
        let last_id = all.iter().flat_map(|team| &team.agents).max();
        let mut team_of = vec![NONE; last_id.map_or(0, |&id| id as usize + 1)];
        for (k, team) in (0..).zip(&all) {
            team.agents.iter().for_each(|&agent| team_of[agent as usize] = k);
        }
        let mut order_names: Vec<String> = Vec::new();
        for space in all.iter().flat_map(|team| &team.action_spaces) {
            if !order_names.contains(&space.name) {
                order_names.push(space.name.clone());
            }
        }
        Self { all, team_of, noun, order_names }
    }

    /// Returns the teams; the index is a team's number everywhere else.
    pub fn as_slice(&self) -> &[AgentTeam] {
        &self.all
    }

    pub(crate) fn has_action_spaces(&self) -> bool {
        self.all.iter().any(|team| !team.action_spaces.is_empty())
    }

    pub(crate) fn order_names(&self) -> &[String] {
        &self.order_names
    }

    /// Checks that orders have the shape and the bounds of their spaces.
    pub(crate) fn check(&self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.for_each_order(orders, |_| Ok(()))
    }

    /// Checks the orders against the shape and the bounds of their spaces, and passes each to `give`, agent by agent,
    /// up to the first that is wrong.
    ///
    /// # Errors
    /// The first one that is wrong, or the error of `give`.
    pub(crate) fn for_each_order<'a>(
        &self,
        orders: &MultiAgentOrder<'a>,
        mut give: impl FnMut(&Order<'a>) -> Result<(), OrderError>,
    ) -> Result<(), OrderError> {
        let &MultiAgentOrder { order, agents, values } = orders;
        let Some(&first) = agents.first() else { return check_order_without_agents(orders) };
        // Usually all agents are of one team, so its space is looked up once.
        let mut action = self.action_space(order, first)?;
        let width = action.space.value_count();
        if values.len() != agents.len() * width {
            let expected = format!("{} x {width}", agents.len());
            return Err(OrderError::Shape { order: order.into(), expected, found: values.len() });
        }
        for (k, &agent) in agents.iter().enumerate() {
            if self.team_of.get(agent as usize).is_none_or(|&team| team as usize != action.team) {
                action = self.action_space(order, agent)?;
            }
            let ActionSpace { team, index, space } = action;
            if space.value_count() != width {
                let expected = format!("{} values for {} {agent}", space.value_count(), self.noun);
                return Err(OrderError::Shape { order: order.into(), expected, found: width });
            }
            let values = &values[k * width..(k + 1) * width];
            if let Some(&value) = values.iter().find(|&&value| !space.contains(value)) {
                return Err(OrderError::Value {
                    order: order.into(),
                    agent: self.agent_name(agent),
                    value,
                    expected: space.describe(),
                });
            }
            give(&Order { team, space: index, agent, values })?;
        }
        Ok(())
    }

    /// Returns an agent's name in errors: `robot 3`.
    pub(crate) fn agent_name(&self, agent: EntityId) -> String {
        format!("{} {agent}", self.noun)
    }

    /// Finds the space in which an agent's team takes an order.
    fn action_space(&self, order: &str, agent: EntityId) -> Result<ActionSpace<'_>, OrderError> {
        let team = self.team_of.get(agent as usize).filter(|&&team| team != NONE);
        let Some(team) = team.map(|&team| team as usize) else {
            let last = self.team_of.len().checked_sub(1).map(|last| last as EntityId);
            let agent = self.agent_name(agent);
            return Err(OrderError::NoAgent { agent, noun: self.noun, last });
        };
        let spaces = &self.all[team].action_spaces;
        if spaces.is_empty() {
            return Err(OrderError::NotExternal { agent: self.agent_name(agent) });
        }
        let index = spaces.iter().position(|space| space.name == order).ok_or_else(|| {
            let known = spaces.iter().map(|space| space.name.clone()).collect();
            OrderError::Unknown { order: order.into(), agent: self.agent_name(agent), known }
        })?;
        Ok(ActionSpace { team, index, space: &spaces[index] })
    }

    /// Checks that the buffers have exactly the size that a team's observations need.
    pub(crate) fn check_buffers(
        &self,
        team: usize,
        buffers: &[BufferMut<'_>],
    ) -> Result<(), OrderError> {
        let Some(AgentTeam { agents, observation_spaces: spaces, .. }) = self.all.get(team) else {
            return Err(OrderError::NoTeam { team, teams: self.all.len() });
        };
        let fits = spaces.len() == buffers.len()
            && spaces.iter().zip(buffers).all(|(space, buffer)| {
                buffer.len() == agents.len() * space.value_count()
                    && space.is_integer() == matches!(buffer, BufferMut::Integer(_))
            });
        if fits {
            return Ok(());
        }
        let expected = spaces.iter().map(|space| {
            let number_type = if space.is_integer() { "whole" } else { "real" };
            format!(
                "{} of {} x {} {number_type} values",
                space.name,
                agents.len(),
                space.value_count()
            )
        });
        Err(OrderError::BufferShape { expected: expected.collect::<Vec<_>>().join(", ") })
    }
}

/// The space in which a team takes an order.
#[derive(Clone, Copy)]
struct ActionSpace<'a> {
    team: usize,
    /// Number of the space among the team's action spaces.
    index: usize,
    space: &'a ValueSpace,
}

/// Checks an order to no agents: it is right if it has no values.
fn check_order_without_agents(orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
    if orders.values.is_empty() {
        return Ok(());
    }
    Err(OrderError::Shape {
        order: orders.order.into(),
        expected: "0".into(),
        found: orders.values.len(),
    })
}

/// Gives a number to each repeated name.
fn number_duplicates(teams: &mut [AgentTeam]) {
    let mut used = BTreeSet::new();
    // The next number to try for each name, because thousands of teams may share one.
    let mut next: BTreeMap<String, u32> = BTreeMap::new();
    for team in teams {
        let plain = team.name.clone();
        let number = next.entry(plain.clone()).or_insert(2);
        while !used.insert(team.name.clone()) {
            team.name = format!("{plain} {number}");
            *number += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_teams_have_one_name() {
        let team = |name: &str| {
            let (observed, ordered) = (Vec::new(), Vec::new());
            AgentTeam {
                name: name.into(),
                agents: Vec::new(),
                observation_spaces: observed,
                action_spaces: ordered,
            }
        };
        let all = ["snake", "snake 2", "snake", "crane", "snake"].map(team).to_vec();
        let teams = AgentTeams::new(all, "chain");
        let names: Vec<_> = teams.as_slice().iter().map(|team| &team.name[..]).collect();
        assert_eq!(names, ["snake", "snake 2", "snake 3", "crane", "snake 4"]);
    }
}
