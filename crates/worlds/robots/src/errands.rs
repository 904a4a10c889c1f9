//! Tasks of a team: its robots go where their errands are, one after the other, and get the next task when they are done.
//!
//! The planner of the team dispatches them in the phase *plan*, by the places that it knows in leading robots.

use super::decide::Errands;
use super::plan::place_in_team;
use super::state::RobotsState;
use super::team::{TaskMemory, Team, TeamState};
use super::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_planners::Courier;
use sidestep_planners::tasks::{TaskOfAgent, TaskState};

/// Words of a robot's task in a snapshot, after their number. Those of the first robot of a team are followed by the team's
/// own.
const ROBOT_WORDS: usize = 3;

/// Tasks that a team has finished, and those that are known to it and not finished.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct TaskCounts {
    pub(crate) finished: u64,
    pub(crate) open: u64,
}

impl RobotsWorld {
    /// Returns the goals of a team that carries out tasks, after it has got those that are due.
    pub(crate) fn errands(
        &self,
        state: &RobotsState,
        team: &Team,
        team_state: &TeamState,
        couriers: &[Courier],
    ) -> Option<Vec<Option<(u32, u32)>>> {
        let mut guard = team_state.tasks()?;
        let TaskMemory { dispatcher, state: tasks } = &mut *guard;
        let before: Vec<Option<u64>> =
            tasks.agents.iter().map(|own| own.map(|own| own.task)).collect();
        let mut dispatcher = dispatcher.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let finished = dispatcher.advance(tasks, couriers);
        for (robot, id) in team.robots.clone().enumerate() {
            let task = tasks.agents[robot].map(|own| own.task);
            let memory = &state.body(id).memory;
            Errands::set_task(memory, task.is_some());
            if finished.binary_search(&robot).is_ok() {
                Errands::mark_end(memory);
            } else if task.is_some() && task != before[robot] {
                Errands::mark_start(memory);
            }
        }
        Some((0..couriers.len()).map(|robot| dispatcher.goal(tasks, robot)).collect())
    }

    /// Returns the goals that [`Self::errands`] will return in the next cycle, and gives no task yet.
    pub(crate) fn errands_ahead(
        &self,
        team_state: &TeamState,
        couriers: &[Courier],
    ) -> Option<Vec<Option<(u32, u32)>>> {
        let TaskMemory { dispatcher, state: mut tasks } = team_state.tasks()?.clone();
        let mut dispatcher = dispatcher.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        dispatcher.advance(&mut tasks, couriers);
        Some((0..couriers.len()).map(|robot| dispatcher.goal(&tasks, robot)).collect())
    }
}

impl RobotsState {
    /// Returns the task of a robot in words, and for the first one of a team the team's open tasks; none for robots
    /// without tasks.
    pub(crate) fn task_words(&self, world: &RobotsWorld, id: EntityId) -> Vec<u32> {
        let Some((team, robot)) = place_in_team(world, id) else { return Vec::new() };
        let Some(memory) = self.planner_teams[team].tasks() else { return Vec::new() };
        let tasks = &memory.state;
        let own = tasks.agents[robot];
        let [low, high] = words_of(own.map_or(0, |own| own.task + 1));
        let mut words = vec![0, low, high, own.map_or(0, |own| own.visited)];
        if robot == 0 {
            words.extend([tasks.revealed, tasks.finished].into_iter().flat_map(words_of));
            words.extend(tasks.open.iter().copied().flat_map(words_of));
        }
        // The plan follows, whose length differs, too.
        words[0] = words.len() as u32 - 1;
        words
    }

    /// Takes over what [`Self::task_words`] returned, and returns the words that follow it.
    pub(crate) fn restore_task<'a>(
        &self,
        world: &RobotsWorld,
        id: EntityId,
        words: &'a [u32],
    ) -> &'a [u32] {
        let Some((team, robot)) = place_in_team(world, id) else { return words };
        let Some(mut memory) = self.planner_teams[team].tasks() else { return words };
        let Some((&len, words)) = words.split_first() else { return words };
        let split = words.split_at_checked(len as usize);
        let Some((words, rest_of_record)) = split else { return words };
        let Some((&[low, high, visited], of_team)) = words.split_first_chunk::<ROBOT_WORDS>()
        else {
            return rest_of_record;
        };
        let task = number_of([low, high]).checked_sub(1);
        let TaskState { revealed, open, agents, finished } = &mut memory.state;
        agents[robot] = task.map(|task| TaskOfAgent { task, visited });
        let numbers: Vec<u64> = of_team.as_chunks().0.iter().copied().map(number_of).collect();
        if let [all, done, rest @ ..] = &numbers[..] {
            *revealed = *all;
            *finished = *done;
            *open = rest.to_vec();
        }
        rest_of_record
    }

    /// Returns the tasks of all teams.
    pub(crate) fn task_counts(&self) -> TaskCounts {
        let mut counts = TaskCounts::default();
        for memory in self.planner_teams.iter().filter_map(TeamState::tasks) {
            counts.finished += memory.state.finished;
            counts.open += memory.state.revealed - memory.state.finished;
        }
        counts
    }
}

fn words_of(number: u64) -> [u32; 2] {
    [number as u32, (number >> 32) as u32]
}

fn number_of([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

#[cfg(test)]
mod tests;
