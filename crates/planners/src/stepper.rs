//! Who leads a team from step to step, without a plan that reaches further.

use crate::goal_fields::MAX_FIELD_BYTES;
use crate::pibt::{Obstructions, Pibt, PibtConfig, PibtState};
use crate::pose::{Action, GridPose};
use crate::tick_planner::{LifelongAgent, TickPlanner, TickSituation};
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::FreeSpace;

/// The agents of a team at the start of a step.
#[derive(Debug, Clone, Copy)]
pub struct TeamStep<'a> {
    /// The pose of each agent; of one in the midst of an action, the pose to which that leads.
    pub poses: &'a [GridPose],
    /// The goal of each agent; one without stays, but makes way.
    pub goals: &'a [Option<(u32, u32)>],
    /// Boxes (column, row) in which other bodies stand: no agent enters them.
    pub others: &'a [(u32, u32)],
    /// Agents that cannot act in this step.
    pub busy: &'a [BusyAgent],
}

/// An agent that cannot act, since it is late or in the midst of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusyAgent {
    /// Its number.
    pub agent: u32,
    /// The box that it leaves, which nobody can enter before its action ends; its own if it does not move.
    pub from: (u32, u32),
    /// Steps until its action ends; 0 between actions.
    pub steps_left: u32,
    /// Steps of delay left.
    pub delay_steps: u32,
}

/// The rules by which a team steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepRules {
    /// Steps that an action takes.
    pub(crate) action_steps: u32,
    /// Whether an agent can enter a box that another one leaves in the same step.
    pub(crate) may_follow: bool,
}

/// Priority inheritance, for agents in step with each other or not.
#[derive(Debug, Clone)]
pub(crate) enum Stepper {
    /// All agents act in the same steps.
    Together(Box<Pibt>),
    /// Each acts when its action has ended.
    Apart(Box<AsynchronousStepper>),
}

impl Stepper {
    pub(crate) fn new(
        free: &FreeSpace,
        sizes: &[u32],
        rules: StepRules,
        seed: Seed,
    ) -> Result<Self, InputError> {
        let StepRules { action_steps, may_follow } = rules;
        // Plans of common steps lead into boxes that others leave in the same step: where that fails, a full crowd would
        // stand still.
        let enters_free_boxes_only = action_steps > 1 || !may_follow;
        if enters_free_boxes_only && sizes.iter().all(|&size| size == 1) {
            let ticks = action_steps.max(1);
            let planner = TickPlanner::new(free, sizes.len(), ticks, seed, MAX_FIELD_BYTES);
            return Ok(Self::Apart(Box::new(AsynchronousStepper { planner, agents: Vec::new() })));
        }
        let config = PibtConfig { seed, action_steps, ..PibtConfig::default() };
        Ok(Self::Together(Box::new(Pibt::new(free, sizes, config)?)))
    }

    /// Returns the next action of each agent, and advances the state by one step.
    pub(crate) fn step(
        &mut self,
        state: &mut PibtState,
        now: TeamStep<'_>,
    ) -> Result<&[Action], InputError> {
        match self {
            Self::Together(pibt) => {
                let idle: Vec<u32> = now.busy.iter().map(|busy| busy.agent).collect();
                let obstructions = Obstructions { boxes: now.others, idle: &idle };
                pibt.step_among(state, now.poses, now.goals, obstructions)
            }
            Self::Apart(stepper) => Ok(stepper.step(state, now)),
        }
    }
}

/// A [`TickPlanner`], and a buffer.
#[derive(Debug, Clone)]
pub(crate) struct AsynchronousStepper {
    planner: TickPlanner,
    agents: Vec<LifelongAgent>,
}

impl AsynchronousStepper {
    fn step(&mut self, state: &mut PibtState, now: TeamStep<'_>) -> &[Action] {
        self.agents.clear();
        for (agent, pose) in now.poses.iter().enumerate() {
            let age = &mut state.ages[agent];
            let is_on_its_way = state.goals[agent] == now.goals[agent];
            *age = if is_on_its_way { age.saturating_add(1) } else { 0 };
            let to = self.planner.box_number(pose.position());
            self.agents.push(LifelongAgent {
                at: to,
                to,
                heading: pose.heading % 4,
                ticks_left: 0,
                delay: 0,
                age: *age,
            });
        }
        for busy in now.busy {
            let agent = &mut self.agents[busy.agent as usize];
            agent.at = self.planner.box_number(busy.from);
            agent.ticks_left = busy.steps_left;
            agent.delay = busy.delay_steps;
        }
        let tick = state.step;
        state.step += 1;
        state.goals.copy_from_slice(now.goals);
        let agents = &self.agents;
        self.planner.step(TickSituation { tick, agents, goals: now.goals, others: now.others })
    }
}
