//! Agents that a scenario describes together, and agents by their numbers.

use super::Scenery;
use super::body::{Body, BodyId};
use super::kind::{BodyKind, BodyRole};
use crate::InputError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Agents that a scenario describes together, such as couriers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AgentGroup {
    /// The name that the scenario gives them; never empty.
    pub name: String,
    /// Their kind.
    pub kind: BodyKind,
    /// Their numbers.
    pub numbers: Range<u32>,
}

impl AgentGroup {
    /// Returns whether a body is one of them.
    pub fn contains(&self, id: BodyId) -> bool {
        self.kind == id.kind && self.numbers.contains(&id.number)
    }
}

/// An agent by its number, and by that of a part where only one is meant: `8`, `8/17`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AgentNumber {
    /// The number among the agents.
    pub number: u32,
    /// The part; none stands for all of the agent.
    pub part: Option<u32>,
}

impl AgentNumber {
    /// Returns whether a body is this agent, or a part that is meant.
    pub fn matches(self, id: BodyId) -> bool {
        id.number == self.number && (self.part.is_none() || id.part == self.part)
    }

    /// Refuses numbers that are certainly those of no agent.
    ///
    /// # Errors
    /// When a number is beyond all of `bodies` and all that have a start in the scenery, or an agent there has no such
    /// part. Others may come later, or be gone, as airplanes are.
    pub fn check_all(
        agents: &[Self],
        scenery: &Scenery,
        bodies: &[Body],
    ) -> Result<(), InputError> {
        let here: Vec<&Body> = bodies.iter().filter(|body| body.kind.is_agent()).collect();
        let starts = scenery.bodies.iter();
        let starts = starts.filter(|body| matches!(body.kind.role(), BodyRole::StartOf(_)));
        let starts: Vec<u32> = starts.map(|body| body.number).collect();
        let numbers = here.iter().map(|body| body.number).chain(starts.iter().copied());
        let highest = numbers.max().unwrap_or(0);
        for agent in agents {
            if here.iter().any(|body| agent.matches(body.id())) {
                continue;
            }
            let cause = if agent.number > highest {
                format!("there is no such agent: their numbers are 0 to {highest}")
            } else if here.iter().any(|body| body.number == agent.number) {
                "there is such an agent, but it has no such part".to_string()
            } else {
                continue;
            };
            let remedy = "give numbers as the list of agents of the studio has them";
            return Err(InputError::new(format!("--agents {agent}"), cause, remedy));
        }
        Ok(())
    }
}

impl FromStr for AgentNumber {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, part) = match text.split_once('/') {
            Some((number, part)) => (number.parse(), Some(part.parse())),
            None => (text.parse(), None),
        };
        let wrong = || format!("`{text}` is no number of an agent, like 8, or 8/17 with a part");
        let number = number.map_err(|_| wrong())?;
        let part = part.transpose().map_err(|_| wrong())?;
        Ok(Self { number, part })
    }
}

impl fmt::Display for AgentNumber {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.part {
            Some(part) => write!(out, "{}/{part}", self.number),
            None => write!(out, "{}", self.number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind::samples::{AIRPLANE, AIRPLANE_START, ROBOT};
    use super::super::{Pose, Shape};
    use super::*;

    #[test]
    fn a_group_has_the_agents_of_its_kind_with_its_numbers() {
        let group = AgentGroup { name: "couriers".into(), kind: ROBOT, numbers: 2..4 };
        let has = |kind, number| group.contains(BodyId::new(kind, number, None));
        assert!(has(ROBOT, 2) && has(ROBOT, 3));
        assert!(!has(ROBOT, 4) && !has(AIRPLANE, 2));
    }

    fn scenery_with(bodies: Vec<Body>) -> Scenery {
        Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies,
            names: Vec::new(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        }
    }

    #[test]
    fn agents_that_come_later_or_are_gone_have_the_numbers_of_their_starts() {
        let start = |number| {
            let shape = Shape::Sphere { radius_m: 0.1 };
            Body::new(AIRPLANE_START, number, Pose::from_position([0.0; 3]), shape)
        };
        let scenery = scenery_with((0..3).map(start).collect());
        let check = |number| {
            let agent = AgentNumber { number, part: None };
            AgentNumber::check_all(&[agent], &scenery, &[]).map_err(|error| error.to_string())
        };
        assert_eq!((check(0), check(2)), (Ok(()), Ok(())));
        assert!(check(3).expect_err("refused").contains("their numbers are 0 to 2"));
    }

    #[test]
    fn numbers_that_no_agent_has_are_refused_in_words() {
        let robot = |number| {
            let shape = Shape::Sphere { radius_m: 0.1 };
            Body::new(ROBOT, number, Pose::from_position([0.0; 3]), shape)
        };
        let bodies: Vec<Body> = [0, 1, 3].map(robot).to_vec();
        let scenery = scenery_with(Vec::new());
        let check = |text: &str| {
            let agent: AgentNumber = text.parse().expect("a number");
            AgentNumber::check_all(&[agent], &scenery, &bodies).map_err(|error| error.to_string())
        };
        assert!(check("4").expect_err("refused").contains("their numbers are 0 to 3"));
        assert!(check("3/5").expect_err("refused").contains("has no such part"));
        assert_eq!((check("3"), check("2")), (Ok(()), Ok(())), "one that may come later");
        assert!("-1".parse::<AgentNumber>().is_err() && "1/".parse::<AgentNumber>().is_err());
    }
}
