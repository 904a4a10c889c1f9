//! A problem of multi-agent path finding: a floor, agents and their goals.

use crate::distances::GoalDistances;
use crate::graph::{AnchorGraph, Graphs, NONE};
use crate::pose::{ActionModel, GridPose};
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_map::planning::FreeSpace;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// An agent of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Agent {
    /// Side of its square body in boxes; all agents of a team have the same.
    pub size: u32,
    /// Pose at step 0.
    pub start: GridPose,
    /// Goal (column, row) of its lower-left box; any heading is right there.
    pub goal: (u32, u32),
}

/// A problem: each agent has to go from its start to its goal, and to stay there.
///
/// Bodies never overlap. A box that is left in a step can be entered in the same step, so that agents can follow each
/// other and rotate in a circle, but two agents cannot swap their boxes (Stern et al. 2019, types of conflicts: vertex
/// and swapping conflicts).
#[derive(Debug, Clone)]
pub struct Instance {
    graphs: Graphs,
    model: ActionModel,
    agents: Vec<Agent>,
    /// Computed once: the bounds of a problem and its planner both need them.
    distances: OnceLock<Vec<Arc<GoalDistances>>>,
}

impl Instance {
    /// Creates the problem of some agents on the free boxes of a floor.
    ///
    /// # Errors
    /// Where a start or a goal is not free as a whole, a heading is above 3, a size is 0, or two starts or two goals
    /// overlap.
    pub fn new(
        free: &FreeSpace,
        model: ActionModel,
        agents: Vec<Agent>,
    ) -> Result<Self, InputError> {
        check_sizes(agents.iter().map(|agent| agent.size))?;
        let graphs = Graphs::new(free, agents.iter().map(|agent| agent.size));
        let instance = Self { graphs, model, agents, distances: OnceLock::new() };
        instance.check_places("start", |agent| agent.start.position())?;
        instance.check_places("goal", |agent| agent.goal)?;
        for (index, agent) in instance.agents.iter().enumerate() {
            check_heading(index, agent.start.heading)?;
        }
        Ok(instance)
    }

    /// Returns the actions that its agents have.
    pub fn model(&self) -> ActionModel {
        self.model
    }

    /// Returns its agents.
    pub fn agents(&self) -> &[Agent] {
        &self.agents
    }

    /// Returns the lowest costs that any plan can have: each agent takes a shortest path, turns included, as if it were
    /// alone.
    ///
    /// # Errors
    /// Where no path leads from a start to its goal.
    pub fn bounds(&self) -> Result<Bounds, InputError> {
        let mut bounds = Bounds { makespan: 0, sum_of_costs: 0 };
        for (agent, distances) in self.distances()?.iter().enumerate() {
            let steps = distances.steps(self.start_node(agent));
            bounds.makespan = bounds.makespan.max(steps);
            bounds.sum_of_costs += u64::from(steps);
        }
        Ok(bounds)
    }

    pub(crate) fn graphs(&self) -> &Graphs {
        &self.graphs
    }

    pub(crate) fn graph(&self, agent: usize) -> &AnchorGraph {
        self.graphs.of(agent)
    }

    pub(crate) fn start_node(&self, agent: usize) -> u32 {
        self.graph(agent).node(self.agents[agent].start).unwrap_or(NONE)
    }

    pub(crate) fn goal_box(&self, agent: usize) -> u32 {
        self.graph(agent).anchor(self.agents[agent].goal).unwrap_or(NONE)
    }

    /// Returns the distances of each agent to its goal; agents with one goal and one size share them.
    pub(crate) fn distances(&self) -> Result<&[Arc<GoalDistances>], InputError> {
        if let Some(known) = self.distances.get() {
            return Ok(known);
        }
        let distances = self.new_distances()?;
        Ok(self.distances.get_or_init(|| distances))
    }

    fn new_distances(&self) -> Result<Vec<Arc<GoalDistances>>, InputError> {
        let mut known: BTreeMap<(usize, u32), Arc<GoalDistances>> = BTreeMap::new();
        let mut all = Vec::new();
        for agent in 0..self.agents.len() {
            let goal = self.goal_box(agent);
            let distances = known
                .entry((self.graphs.index_of(agent), goal))
                .or_insert_with(|| {
                    Arc::new(GoalDistances::new(self.graph(agent), self.model, goal))
                })
                .clone();
            if distances.steps(self.start_node(agent)) == GoalDistances::UNREACHABLE {
                return Err(self.unreachable_goal(agent));
            }
            all.push(distances);
        }
        Ok(all)
    }

    fn unreachable_goal(&self, agent: usize) -> InputError {
        let Agent { size, start, goal } = self.agents[agent];
        let cause = format!(
            "no path for a body of {size} x {size} boxes leads from box {:?} to box {goal:?}",
            start.position()
        );
        let remedy = "give a goal in the same part of the floor, or open a wall between them";
        InputError::new(format!("agents[{agent}].goal"), cause, remedy)
    }

    /// Checks that bodies at one place of each agent are on free boxes, and do not overlap.
    fn check_places(
        &self,
        name: &str,
        position: impl Fn(&Agent) -> (u32, u32),
    ) -> Result<(), InputError> {
        let Some(first) = self.graphs.all().first() else { return Ok(()) };
        let mut covered = vec![NONE; first.len()];
        for (index, agent) in self.agents.iter().enumerate() {
            let place = format!("agents[{index}].{name}");
            let at = position(agent);
            let graph = self.graph(index);
            let Some(anchor) = graph.anchor(at) else {
                return Err(blocked_place(place, agent.size, at));
            };
            for covered_box in graph.body(anchor) {
                let other = covered[covered_box];
                if other != NONE {
                    let both = graph.position(covered_box as u32);
                    let cause = format!("covers box {both:?}, as the {name} of agent {other} does");
                    let remedy = format!("give each agent a {name} whose boxes no other covers");
                    return Err(InputError::new(place, cause, remedy));
                }
                covered[covered_box] = index as u32;
            }
        }
        Ok(())
    }
}

fn blocked_place(place: String, size: u32, at: (u32, u32)) -> InputError {
    let cause =
        format!("a body of {size} x {size} boxes at box {at:?} is in a wall or outside the map");
    InputError::new(place, cause, "give a box (column, row) where the whole body is on free boxes")
}

pub(crate) fn check_sizes(sizes: impl Iterator<Item = u32>) -> Result<(), InputError> {
    for (index, size) in sizes.enumerate() {
        if size == 0 {
            let cause = "is 0, and a body covers at least one box";
            let remedy = "give the side of the body in boxes, 1 or more";
            return Err(InputError::new(format!("agents[{index}].size"), cause, remedy));
        }
    }
    Ok(())
}

fn check_heading(agent: usize, heading: u8) -> Result<(), InputError> {
    if heading < 4 {
        return Ok(());
    }
    let place = format!("agents[{agent}].start.heading");
    let remedy = "give 0 for east, 1 for north, 2 for west or 3 for south";
    Err(InputError::new(place, format!("is {heading}"), remedy))
}

/// Lower bounds of the costs of a problem's plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounds {
    /// The longest of the shortest paths, in steps.
    pub makespan: u32,
    /// The sum of all shortest paths, in steps.
    pub sum_of_costs: u64,
}
