//! Robots as formats of multi-agent path finding show them: each in one box, with the action and the task that it has.

use super::plan::place_in_team;
use super::state::RobotsState;
use super::team::TeamState;
use super::world::RobotsWorld;
use sidestep_kernel::view::{GridAgent, GridPlace, GridTask, GridTeam};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_planners::GridPose;

impl RobotsWorld {
    /// Returns the robots in cycle `now`, with the errands of all tasks from the number `tasks_from` on.
    ///
    /// # Errors
    /// When these formats cannot show them: the cause, and a remedy.
    pub(super) fn grid_team(
        &self,
        state: &RobotsState,
        now: Cycle,
        tasks_from: u64,
    ) -> Result<GridTeam, [String; 2]> {
        let action_cycles = self.common_action_cycles()?;
        let mut team = GridTeam {
            action_cycles,
            agents: self.robots.iter().map(|&id| self.grid_agent(state, now, id)).collect(),
            new_tasks: Vec::new(),
            open_tasks: Vec::new(),
            finished_tasks: 0,
        };
        let mut with_tasks = state.planner_teams.iter().filter_map(TeamState::tasks);
        if let Some(memory) = with_tasks.next() {
            let dispatcher = memory.dispatcher.lock();
            let dispatcher = dispatcher.unwrap_or_else(std::sync::PoisonError::into_inner);
            let tasks = &memory.state;
            team.new_tasks = (tasks_from..tasks.revealed).map(|k| dispatcher.places(k)).collect();
            team.open_tasks = tasks.open.clone();
            team.finished_tasks = tasks.finished;
        }
        if with_tasks.next().is_some() {
            let cause = "several sections of robots have tasks, and the format has one list";
            return Err([cause.to_string(), "give one section all robots with tasks".to_string()]);
        }
        Ok(team)
    }

    /// Returns the number of cycles that an action of each robot takes.
    fn common_action_cycles(&self) -> Result<u32, [String; 2]> {
        let cycles_of = |id: EntityId| self.bodies[id as usize].action_cycles;
        let first = self.robots.first().map_or(1, |&id| cycles_of(id));
        for &id in &self.robots {
            let size = self.type_of(id).size;
            if size != (1, 1) {
                let cause = format!(
                    "robot {id} fills {} x {} boxes, and one of the format fills one",
                    size.0, size.1
                );
                let remedy = "record a run of robots with size = 1";
                return Err([cause, remedy.to_string()]);
            }
            if cycles_of(id) != first {
                let cause = format!(
                    "actions of robot {id} take {} cycles, and those of others {first}; the format has one number",
                    cycles_of(id)
                );
                let remedy = "record a run in which action_cycles of all robots is equal";
                return Err([cause, remedy.to_string()]);
            }
        }
        Ok(first)
    }

    fn grid_agent(&self, state: &RobotsState, now: Cycle, id: EntityId) -> GridAgent {
        let body = state.body(id);
        let position = self.map_position(body.position());
        let place = place_in_team(self, id);
        let has_planned = now > 0 && self.bodies[id as usize].is_due(now - 1);
        GridAgent {
            place: GridPlace {
                col: position.0,
                row: position.1,
                heading: body.facing.get().heading(),
            },
            cycles_left: state.action_progress.left(id),
            delayed_cycles: u64::from(state.delays.total(id)),
            planned: place
                .filter(|_| has_planned)
                .and_then(|(team, robot)| state.planner_teams[team].planned(robot))
                .map(grid_place),
            task: place.and_then(|(team, robot)| {
                let own = state.planner_teams[team].tasks()?.state.agents[robot]?;
                Some(GridTask { task: own.task, visited: own.visited })
            }),
        }
    }
}

fn grid_place(pose: GridPose) -> GridPlace {
    let (col, row) = pose.position();
    GridPlace { col, row, heading: pose.heading }
}
