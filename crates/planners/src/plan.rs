//! Plans, their costs, and the check that they are right.

use crate::graph::NONE;
use crate::instance::{Bounds, Instance};
use crate::pose::GridPose;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The poses of each agent at each step, from step 0 on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    paths: Vec<Vec<GridPose>>,
}

/// The costs of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Costs {
    /// Steps until the last agent is at its goal to stay.
    pub makespan: u32,
    /// The sum over agents of the steps until it is at its goal to stay.
    pub sum_of_costs: u64,
    /// The sum over agents of the steps that do not both begin and end at its goal (Okumura 2023, "Improving
    /// LaCAM"): less than the sum of costs where an agent makes way at its goal.
    pub sum_of_loss: u64,
}

impl Bounds {
    /// Returns by which part the sum of costs is above this bound: 0.1 is 10 %. 0 where the bound is 0.
    pub fn gap(&self, costs: &Costs) -> f64 {
        if self.sum_of_costs == 0 {
            return 0.0;
        }
        costs.sum_of_costs as f64 / self.sum_of_costs as f64 - 1.0
    }
}

impl Plan {
    /// Creates a plan of one path per agent; a path that is shorter than others keeps its last pose.
    ///
    /// # Panics
    /// When a path has no pose.
    pub fn new(mut paths: Vec<Vec<GridPose>>) -> Self {
        let len = paths.iter().map(Vec::len).max().unwrap_or(1);
        for path in &mut paths {
            let last = *path.last().expect("a path has a pose at step 0");
            path.resize(len, last);
        }
        Self { paths }
    }

    /// Returns the number of agents.
    pub fn agents(&self) -> usize {
        self.paths.len()
    }

    /// Returns the number of steps.
    pub fn steps(&self) -> usize {
        self.paths.first().map_or(0, |path| path.len() - 1)
    }

    /// Returns the poses of an agent, one per step and the one at the end.
    ///
    /// # Panics
    /// When there is no such agent.
    pub fn path(&self, agent: usize) -> &[GridPose] {
        &self.paths[agent]
    }

    /// Returns the pose of an agent at a step; after the end it keeps its last one.
    ///
    /// # Panics
    /// When there is no such agent.
    pub fn pose(&self, agent: usize, step: usize) -> GridPose {
        self.paths[agent][step.min(self.steps())]
    }

    /// Returns what the plan costs.
    pub fn costs(&self, instance: &Instance) -> Costs {
        let mut costs = Costs { makespan: 0, sum_of_costs: 0, sum_of_loss: 0 };
        for (path, agent) in self.paths.iter().zip(instance.agents()) {
            let is_away = |pose: &GridPose| pose.position() != agent.goal;
            let steps = path.iter().rposition(is_away).map_or(0, |last| last as u32 + 1);
            costs.makespan = costs.makespan.max(steps);
            costs.sum_of_costs += u64::from(steps);
            let is_loss = |pair: &&[GridPose]| pair.iter().any(is_away);
            costs.sum_of_loss += path.windows(2).filter(is_loss).count() as u64;
        }
        costs
    }

    /// Checks that the plan leads all agents from their starts to their goals, by actions that they have, without a
    /// conflict.
    ///
    /// # Errors
    /// At the first step with a fault, of which that of the agent with the lowest number is reported.
    pub fn validate(&self, instance: &Instance) -> Result<(), PlanError> {
        if self.agents() != instance.agents().len() {
            let expected = instance.agents().len();
            return Err(PlanError::AgentCount { agents: self.agents(), expected });
        }
        let starts = self.paths.iter().zip(instance.agents());
        for (agent, (path, expected)) in starts.enumerate() {
            if path[0] != expected.start {
                return Err(PlanError::Start { agent, start: path[0], expected: expected.start });
            }
        }
        let mut before = Cover::new(instance);
        let mut after = Cover::new(instance);
        for step in 0..=self.steps() {
            self.check_motions(instance, step)?;
            after.fill(instance, self, step)?;
            if step > 0 {
                self.check_swaps(instance, step, [&before, &after])?;
            }
            std::mem::swap(&mut before, &mut after);
        }
        self.check_goals(instance)
    }

    /// Checks that each agent stands on free boxes at a step, and came there by an action.
    fn check_motions(&self, instance: &Instance, step: usize) -> Result<(), PlanError> {
        for (agent, path) in self.paths.iter().enumerate() {
            let to = path[step];
            if instance.graph(agent).node(to).is_none() {
                return Err(PlanError::Wall { agent, step, position: to.position() });
            }
            if step > 0 && instance.model().action_between(path[step - 1], to).is_none() {
                return Err(PlanError::Motion { agent, step, from: path[step - 1], to });
            }
        }
        Ok(())
    }

    /// Checks that no two agents of one box exchange them. Larger bodies that did would overlap before or after.
    fn check_swaps(
        &self,
        instance: &Instance,
        step: usize,
        [before, after]: [&Cover; 2],
    ) -> Result<(), PlanError> {
        for (agent, path) in self.paths.iter().enumerate() {
            let graph = instance.graph(agent);
            if graph.size() != 1 || path[step - 1].position() == path[step].position() {
                continue;
            }
            let from = graph.index(path[step - 1].position()).expect("checked as free") as usize;
            let to = graph.index(path[step].position()).expect("checked as free") as usize;
            let other = before.agents[to];
            let has_one_box = other != NONE && instance.graph(other as usize).size() == 1;
            if has_one_box && after.agents[from] == other {
                let positions = [path[step - 1].position(), path[step].position()];
                return Err(PlanError::Swap { agents: [agent, other as usize], step, positions });
            }
        }
        Ok(())
    }

    fn check_goals(&self, instance: &Instance) -> Result<(), PlanError> {
        for (agent, (path, expected)) in self.paths.iter().zip(instance.agents()).enumerate() {
            let end = path[self.steps()].position();
            if end != expected.goal {
                return Err(PlanError::Goal { agent, end, goal: expected.goal });
            }
        }
        Ok(())
    }
}

/// The agent that covers each box at one step.
struct Cover {
    agents: Vec<u32>,
}

impl Cover {
    fn new(instance: &Instance) -> Self {
        let boxes = instance.graphs().all().first().map_or(0, |graph| graph.len());
        Self { agents: vec![NONE; boxes] }
    }

    fn fill(&mut self, instance: &Instance, plan: &Plan, step: usize) -> Result<(), PlanError> {
        self.agents.fill(NONE);
        for (agent, path) in plan.paths.iter().enumerate() {
            let graph = instance.graph(agent);
            let anchor = graph.anchor(path[step].position()).expect("checked as free");
            for covered in graph.body(anchor) {
                let other = self.agents[covered];
                if other != NONE {
                    return Err(PlanError::Overlap {
                        agents: [other as usize, agent],
                        step,
                        position: graph.position(covered as u32),
                    });
                }
                self.agents[covered] = agent as u32;
            }
        }
        Ok(())
    }
}

/// Why a plan is wrong. Steps count from 0; an agent makes step `n` between its poses `n - 1` and `n`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanError {
    /// The plan has another number of agents than the problem.
    AgentCount {
        /// Number of agents of the plan.
        agents: usize,
        /// Number of agents of the problem.
        expected: usize,
    },
    /// A path begins elsewhere.
    Start {
        /// The agent.
        agent: usize,
        /// Where its path begins.
        start: GridPose,
        /// Its start in the problem.
        expected: GridPose,
    },
    /// A body is in a wall or outside the map, or its heading is above 3.
    Wall {
        /// The agent.
        agent: usize,
        /// The step.
        step: usize,
        /// Its lower-left box.
        position: (u32, u32),
    },
    /// No action leads from one pose to the next.
    Motion {
        /// The agent.
        agent: usize,
        /// The step.
        step: usize,
        /// The pose before.
        from: GridPose,
        /// The pose after.
        to: GridPose,
    },
    /// Two bodies overlap.
    Overlap {
        /// Both agents.
        agents: [usize; 2],
        /// The step after which they do.
        step: usize,
        /// A box that both cover.
        position: (u32, u32),
    },
    /// Two agents exchange their boxes.
    Swap {
        /// Both agents.
        agents: [usize; 2],
        /// The step in which they do.
        step: usize,
        /// Their boxes before the step.
        positions: [(u32, u32); 2],
    },
    /// A path ends elsewhere than at the goal.
    Goal {
        /// The agent.
        agent: usize,
        /// Its last box.
        end: (u32, u32),
        /// Its goal.
        goal: (u32, u32),
    },
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AgentCount { agents, expected } => {
                write!(
                    f,
                    "the plan has {agents} agents, the problem {expected}: give one path each"
                )
            }
            Self::Start { agent, start, expected } => {
                write!(f, "agent {agent} begins at {start:?} instead of its start {expected:?}")
            }
            Self::Wall { agent, step, position } => {
                write!(
                    f,
                    "agent {agent} is in a wall or outside the map at step {step}, box {position:?}"
                )
            }
            Self::Motion { agent, step, from, to } => {
                write!(f, "no action leads agent {agent} in step {step} from {from:?} to {to:?}")
            }
            Self::Overlap { agents: [a, b], step, position } => {
                write!(f, "agents {a} and {b} both cover box {position:?} at step {step}")
            }
            Self::Swap { agents: [a, b], step, positions: [from, to] } => {
                write!(f, "agents {a} and {b} swap boxes {from:?} and {to:?} in step {step}")
            }
            Self::Goal { agent, end, goal } => {
                write!(f, "agent {agent} ends at box {end:?} instead of its goal {goal:?}")
            }
        }
    }
}

impl std::error::Error for PlanError {}
