//! PIBT: the next action of thousands of agents, cycle by cycle, also where goals never end.
//!
//! See [`Pibt`]. The source is Okumura, Machida, Défago and Tamura 2022, "Priority inheritance with backtracking for
//! iterative multi-agent path finding" (algorithm 1), with the swap operation of Okumura 2023 ("Improving LaCAM for
//! scalable eventually optimal multi-agent pathfinding"). Agents with headings first turn and hold their box meanwhile,
//! as in the default planner of the League of Robot Runners (Chan et al. 2024).

use crate::graph::{Graphs, NONE};
use crate::inheritance::{Inheritance, Member};
use crate::instance::{Instance, check_sizes};
use crate::plan::Plan;
use crate::pose::{Action, ActionModel, GridPose};
use serde::{Deserialize, Serialize};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::FreeSpace;

/// Draws that decide between equal boxes.
const TIES: Purpose = Purpose(1);
/// Draws that decide between agents of one age.
const RANKS: Purpose = Purpose(2);

/// Steps for which an agent with a heading keeps its lot among equal boxes. If each step had its own, an agent could
/// turn to and fro; two half turns and two steps are time enough.
const STEPS_PER_LOT: u64 = 8;

/// Age at which agents first do without swaps: most swaps are over by then.
const AGE_WITHOUT_SWAPS: u32 = 64;

/// The planner: what it knows of the floor, and buffers. Its results depend on its arguments and on the [`PibtState`].
#[derive(Debug, Clone)]
pub struct Pibt {
    engine: Inheritance,
    model: ActionModel,
    action_steps: u32,
    streams: Streams,
    /// Decides between agents of one age.
    ranks: Vec<u32>,
    order: Vec<(u64, u32)>,
    actions: Vec<Action>,
    misplaced: Vec<u32>,
}

/// All that changes from step to step: to continue elsewhere, keep it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PibtState {
    /// The number of steps so far.
    pub step: u64,
    /// The number of steps since each agent was last at its goal or got another one. The oldest agent has the highest
    /// priority.
    pub ages: Vec<u32>,
    /// The goals of the last step.
    pub goals: Vec<Option<(u32, u32)>>,
}

impl PibtState {
    /// Creates the state before the first step.
    pub fn new(agents: usize) -> Self {
        Self { step: 0, ages: vec![0; agents], goals: vec![None; agents] }
    }
}

/// The settings of [`Pibt`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PibtConfig {
    /// The actions that agents have.
    pub model: ActionModel,
    /// The seed of the draws between equal boxes and agents of one age.
    pub seed: Seed,
    /// Most bytes kept for the directions to goals: half a byte per box and goal. It changes no result, but where it is
    /// less than all present goals need, some are computed anew at each step.
    pub max_cache_bytes: usize,
    /// Steps that an action takes. Above 1, a box that an agent leaves is not free before its action has ended, so agents
    /// do not go in circles, and one that is to go forward into a box of another one has to wait for it: the caller sees
    /// to that.
    pub action_steps: u32,
}

/// What keeps agents from acting in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Obstructions<'a> {
    /// Boxes (column, row) in which other bodies stand: no agent enters them.
    pub boxes: &'a [(u32, u32)],
    /// Agents that cannot act, by their number: each stays, and nobody enters its boxes.
    pub idle: &'a [u32],
}

impl Default for PibtConfig {
    fn default() -> Self {
        Self {
            model: ActionModel::Turns,
            seed: Seed(0),
            max_cache_bytes: 512 << 20,
            action_steps: 1,
        }
    }
}

impl Pibt {
    /// Creates the planner of agents with bodies of these sizes on the free boxes of a floor.
    ///
    /// # Errors
    /// When a size is 0.
    pub fn new(free: &FreeSpace, sizes: &[u32], config: PibtConfig) -> Result<Self, InputError> {
        check_sizes(sizes.iter().copied())?;
        Ok(Self::from_graphs(Graphs::new(free, sizes.iter().copied()), config))
    }

    fn from_graphs(graphs: Graphs, config: PibtConfig) -> Self {
        let agents = graphs.agents();
        let streams = Streams::new(config.seed);
        Self {
            engine: Inheritance::new(graphs, config.model, config.max_cache_bytes)
                .with_circles(config.action_steps <= 1),
            model: config.model,
            action_steps: config.action_steps.max(1),
            streams,
            ranks: (0..agents as u32).map(|id| streams.block(id, 0, RANKS, 0)[0]).collect(),
            order: Vec::with_capacity(agents),
            actions: Vec::with_capacity(agents),
            misplaced: Vec::new(),
        }
    }

    /// Returns the next action of each agent, and advances the state by one step.
    ///
    /// Poses are where the agents are, or believe to be: they need not be those that the actions before led to. If all
    /// agents carry out their actions, no two bodies overlap and no two agents swap. An agent whose body is in a wall,
    /// outside the map or overlaps that of an agent with a lower number waits, and nobody enters its boxes
    /// ([`Pibt::misplaced_agents`]). An agent without a goal, or without a path to it, stays, but makes way.
    ///
    /// Where all bodies have one box and each two neighboring boxes lie on a circle, as on floors without dead ends,
    /// each agent comes to its goal in the end, however many there are: theorem 1 of the paper for the classical model,
    /// with headings it is only tested.
    ///
    /// # Errors
    /// When there are not as many poses, goals and ages as agents, or a goal is not free for the agent's body.
    pub fn step(
        &mut self,
        state: &mut PibtState,
        poses: &[GridPose],
        goals: &[Option<(u32, u32)>],
    ) -> Result<&[Action], InputError> {
        self.step_among(state, poses, goals, Obstructions::default())
    }

    /// As [`Pibt::step`], among bodies that are no agents, and where some agents cannot act in this step. Directions to
    /// goals know neither: agents wait or step aside at them, and find no way around.
    ///
    /// # Errors
    /// As [`Pibt::step`].
    pub fn step_among(
        &mut self,
        state: &mut PibtState,
        poses: &[GridPose],
        goals: &[Option<(u32, u32)>],
        obstructions: Obstructions<'_>,
    ) -> Result<&[Action], InputError> {
        self.check_lengths(&[
            ("ages", state.ages.len()),
            ("last goals", state.goals.len()),
            ("poses", poses.len()),
            ("goals", goals.len()),
        ])?;
        self.engine.begin();
        self.misplaced.clear();
        for (agent, (&pose, &goal)) in poses.iter().zip(goals).enumerate() {
            let mut member = self.member(agent, state.step, pose, goal)?;
            let age = &mut state.ages[agent];
            // Whoever gets a new goal on arrival is never seen at the old one.
            let is_served = member.now == member.goal || state.goals[agent] != goal;
            *age = if is_served { 0 } else { age.saturating_add(1) };
            member.may_swap = may_swap(*age / self.action_steps);
            if !self.engine.place(member, pose.position()) {
                self.misplaced.push(agent as u32);
            }
        }
        for &position in obstructions.boxes {
            self.engine.block(position);
        }
        for &agent in obstructions.idle {
            self.engine.stay(agent as usize);
        }
        self.sort(&state.ages);
        self.engine.run(self.order.iter().map(|&(_, agent)| agent));
        self.engine.hold();
        self.actions.clear();
        self.actions.extend((0..poses.len()).map(|agent| self.engine.action(agent)));
        for &agent in &self.misplaced {
            self.actions[agent as usize] = Action::Wait;
        }
        state.step += 1;
        state.goals.copy_from_slice(goals);
        Ok(&self.actions)
    }

    /// Returns the agents that waited in the last step because their body was in a wall, outside the map or overlapped
    /// that of an agent with a lower number.
    pub fn misplaced_agents(&self) -> &[u32] {
        &self.misplaced
    }

    fn check_lengths(&self, lengths: &[(&str, usize)]) -> Result<(), InputError> {
        let agents = self.ranks.len();
        match lengths.iter().find(|(_, len)| *len != agents) {
            None => Ok(()),
            Some((name, len)) => {
                let cause = format!("has {len} entries for {agents} agents");
                Err(InputError::new(*name, cause, "give one entry for each agent"))
            }
        }
    }

    fn member(
        &self,
        agent: usize,
        step: u64,
        pose: GridPose,
        goal: Option<(u32, u32)>,
    ) -> Result<Member, InputError> {
        let graph = self.engine.graphs.of(agent);
        let goal = match goal {
            None => NONE,
            Some(position) => graph.anchor(position).ok_or_else(|| {
                let size = graph.size();
                let cause = format!("a body of {size} x {size} boxes does not fit at {position:?}");
                let remedy = "give a box (column, row) where the whole body is on free boxes";
                InputError::new(format!("goals[{agent}]"), cause, remedy)
            })?,
        };
        let lot = match self.model {
            ActionModel::Turns => step / (STEPS_PER_LOT * u64::from(self.action_steps)),
            ActionModel::Classical => step / u64::from(self.action_steps),
        };
        Ok(Member {
            now: graph.node(pose).map_or(NONE, |node| node / 4),
            heading: pose.heading % 4,
            goal,
            ties: self.streams.block(agent as u32, lot, TIES, 0),
            may_swap: true,
        })
    }

    /// Sorts the agents by age, the oldest first.
    fn sort(&mut self, ages: &[u32]) {
        self.order.clear();
        for (agent, (&age, &rank)) in ages.iter().zip(&self.ranks).enumerate() {
            self.order.push((u64::from(u32::MAX - age) << 32 | u64::from(rank), agent as u32));
        }
        self.order.sort_unstable();
    }
}

/// Returns whether an agent of an age may swap. Swaps are needed where two meet in a dead end, but an agent that always
/// makes way for others may never arrive. So phases without and with swaps take turns, each twice as long as the one
/// before: in the end one is long enough, and where each box lies on a circle, all agents arrive.
fn may_swap(age: u32) -> bool {
    age < AGE_WITHOUT_SWAPS || (age / AGE_WITHOUT_SWAPS).ilog2() % 2 == 1
}

/// Plans step by step until all agents are at their goals at once. Returns none if they are not after so many steps:
/// PIBT is fast, but not complete.
///
/// The model is that of the problem.
pub fn plan(instance: &Instance, config: PibtConfig, max_steps: usize) -> Option<Plan> {
    let config = PibtConfig { model: instance.model(), ..config };
    let mut pibt = Pibt::from_graphs(instance.graphs().clone(), config);
    let mut poses: Vec<GridPose> = instance.agents().iter().map(|agent| agent.start).collect();
    let goals: Vec<_> = instance.agents().iter().map(|agent| Some(agent.goal)).collect();
    let mut state = PibtState::new(poses.len());
    let mut paths: Vec<Vec<GridPose>> = poses.iter().map(|&pose| vec![pose]).collect();
    let is_done = |poses: &[GridPose]| {
        poses.iter().zip(&goals).all(|(pose, goal)| Some(pose.position()) == *goal)
    };
    while !is_done(&poses) {
        if paths.first().is_none_or(|path| path.len() > max_steps) {
            return None;
        }
        let actions = pibt.step(&mut state, &poses, &goals).ok()?;
        for (agent, &action) in actions.iter().enumerate() {
            poses[agent] = poses[agent].after(action)?;
            paths[agent].push(poses[agent]);
        }
    }
    Some(Plan::new(paths))
}
