//! Agents that are alike, and orders to them.

use super::error::OrderError;
use super::space::{BufferMut, Space};
use crate::units::EntityId;
use std::collections::{BTreeMap, BTreeSet};

/// Agents with the same observations and orders.
#[derive(Debug, Clone, PartialEq)]
pub struct Team {
    /// Name, by which a caller knows it: the kind of its agents, and a number where there are several.
    pub name: String,
    /// Its agents, rising; rows of arrays are in this order.
    pub agents: Vec<EntityId>,
    /// Spaces of their observations.
    pub observation_spaces: Vec<Space>,
    /// Spaces of orders to them; empty for agents that decide for themselves.
    pub action_spaces: Vec<Space>,
}

/// One order to several agents: one row of values for each.
#[derive(Debug, Clone, Copy)]
pub struct Orders<'a> {
    /// Name of the space.
    pub order: &'a str,
    /// Receivers.
    pub agents: &'a [EntityId],
    /// Their values, one agent after the other.
    pub values: &'a [f64],
}

/// One order to one agent, checked against its space.
#[derive(Debug, Clone, Copy)]
pub struct Order<'a> {
    /// Number of the team.
    pub team: usize,
    /// Number of the space among those in which the team is ordered.
    pub space: usize,
    /// The receiver.
    pub agent: EntityId,
    /// The values.
    pub values: &'a [f64],
}

/// The teams of a world, and their members.
#[derive(Debug, Clone, Default)]
pub struct Teams {
    all: Vec<Team>,
    /// Number of each entity's team, by id; [`NONE`] for those in none.
    team_of: Vec<u32>,
    /// The noun for an agent.
    noun: &'static str,
    /// Names of all orders, each once.
    order_names: Vec<String>,
}

/// Stands for no team.
const NONE: u32 = u32::MAX;

impl Teams {
    /// Returns these teams; no agent is in two of them. `noun` is the noun for an agent. A repeated name
    /// gets a number: `robot`, `robot 2`.
    pub fn new(mut all: Vec<Team>, noun: &'static str) -> Self {
        number_duplicates(&mut all);
        let last = all.iter().flat_map(|team| &team.agents).max();
        let mut team_of = vec![NONE; last.map_or(0, |&last| last as usize + 1)];
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

    /// The teams.
    pub fn all(&self) -> &[Team] {
        &self.all
    }

    /// The noun for an agent.
    pub(crate) fn noun(&self) -> &'static str {
        self.noun
    }

    /// Returns whether any agent takes orders.
    pub(crate) fn accept_orders(&self) -> bool {
        self.all.iter().any(|team| !team.action_spaces.is_empty())
    }

    /// The names of all orders, each once.
    pub(crate) fn order_names(&self) -> &[String] {
        &self.order_names
    }

    /// Checks that orders have the shape and the bounds of their spaces.
    pub(crate) fn check(&self, orders: &Orders<'_>) -> Result<(), OrderError> {
        self.for_each_order(orders, |_| Ok(()))
    }

    /// Hands over the orders to single agents, one after the other, as far as they have the shape and the bounds
    /// of their spaces; orders checked this way do not have to be kept.
    ///
    /// # Errors
    /// The first one that is wrong, or that `take` returns.
    pub(crate) fn for_each_order<'a>(
        &self,
        orders: &Orders<'a>,
        mut take: impl FnMut(&Order<'a>) -> Result<(), OrderError>,
    ) -> Result<(), OrderError> {
        let &Orders { order, agents, values } = orders;
        let Some(&first) = agents.first() else { return check_empty(orders) };
        // Usually all are of one team, so its space is looked up once.
        let mut of_team = self.space(order, first)?;
        let width = of_team.2.width();
        if values.len() != agents.len() * width {
            let expected = format!("{} x {width}", agents.len());
            return Err(OrderError::Shape { order: order.into(), expected, found: values.len() });
        }
        for (k, &agent) in agents.iter().enumerate() {
            if self.team_of.get(agent as usize).is_none_or(|&team| team as usize != of_team.0) {
                of_team = self.space(order, agent)?;
            }
            let (team, number, space) = of_team;
            if space.width() != width {
                let expected = format!("{} values for {} {agent}", space.width(), self.noun);
                return Err(OrderError::Shape { order: order.into(), expected, found: width });
            }
            let values = &values[k * width..(k + 1) * width];
            if let Some(&value) = values.iter().find(|&&value| !space.contains(value)) {
                let who = format!("{} {agent}", self.noun);
                let (order, expected) = (order.into(), space.describe());
                return Err(OrderError::Value { order, who, value, expected });
            }
            take(&Order { team, space: number, agent, values })?;
        }
        Ok(())
    }

    /// Returns an agent's team, and the number of the space of this order in it, and the space.
    fn space(&self, order: &str, agent: EntityId) -> Result<(usize, usize, &Space), OrderError> {
        let who = || format!("{} {agent}", self.noun);
        let team = self.team_of.get(agent as usize).filter(|&&team| team != NONE);
        let Some(team) = team.map(|&team| team as usize) else {
            let last = self.team_of.len().checked_sub(1).map(|last| last as EntityId);
            return Err(OrderError::NoAgent { who: who(), noun: self.noun, last });
        };
        let ordered = &self.all[team].action_spaces;
        if ordered.is_empty() {
            return Err(OrderError::NotExternal { who: who() });
        }
        let number = ordered.iter().position(|space| space.name == order).ok_or_else(|| {
            let known = ordered.iter().map(|space| space.name.clone()).collect();
            OrderError::Unknown { order: order.into(), who: who(), known }
        })?;
        Ok((team, number, &ordered[number]))
    }

    /// Checks that there is exactly the room that a team's observations need.
    pub(crate) fn check_buffers(
        &self,
        team: usize,
        room: &[BufferMut<'_>],
    ) -> Result<(), OrderError> {
        let Some(Team { agents, observation_spaces: observed, .. }) = self.all.get(team) else {
            return Err(OrderError::NoTeam { team, teams: self.all.len() });
        };
        let fits = |(space, room): (&Space, &BufferMut<'_>)| {
            room.len() == agents.len() * space.width()
                && space.is_integer() == matches!(room, BufferMut::Integer(_))
        };
        if observed.len() == room.len() && observed.iter().zip(room).all(fits) {
            return Ok(());
        }
        let expected = observed.iter().map(|space| {
            let sort = if space.is_integer() { "whole" } else { "real" };
            format!("{} of {} x {} {sort} values", space.name, agents.len(), space.width())
        });
        Err(OrderError::BufferShape { expected: expected.collect::<Vec<_>>().join(", ") })
    }
}

/// Checks an order to no agents: it is right if it has no values.
fn check_empty(orders: &Orders<'_>) -> Result<(), OrderError> {
    match orders.values {
        [] => Ok(()),
        values => {
            let (order, expected) = (orders.order.into(), "0".into());
            Err(OrderError::Shape { order, expected, found: values.len() })
        }
    }
}

/// Gives a number to each repeated name.
fn number_duplicates(teams: &mut [Team]) {
    let mut taken = BTreeSet::new();
    // The next number to try for each name, because thousands of teams may share one.
    let mut next: BTreeMap<String, u32> = BTreeMap::new();
    for team in teams {
        let plain = team.name.clone();
        let number = next.entry(plain.clone()).or_insert(2);
        while !taken.insert(team.name.clone()) {
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
            Team {
                name: name.into(),
                agents: Vec::new(),
                observation_spaces: observed,
                action_spaces: ordered,
            }
        };
        let all = ["snake", "snake 2", "snake", "crane", "snake"].map(team).to_vec();
        let teams = Teams::new(all, "chain");
        let names: Vec<_> = teams.all().iter().map(|team| &team.name[..]).collect();
        assert_eq!(names, ["snake", "snake 2", "snake 3", "crane", "snake 4"]);
    }
}
