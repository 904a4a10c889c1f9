//! What became of tasks in each tick: who had them, and which errands were done.

use serde_json::{Value, json};
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{GridPlace, GridTask, GridTeam};
use std::collections::BTreeSet;

/// The tasks of a run so far.
#[derive(Debug)]
pub(super) struct TaskHistory {
    /// When each task was revealed, and its errands (column, row).
    revealed: Vec<(Cycle, Vec<(u32, u32)>)>,
    /// Errands that were done: tick, robot, task and number of errands.
    events: Vec<[u64; 4]>,
    /// The task of each robot in words, whenever it got another one.
    schedules: Vec<Vec<String>>,
    /// Sum of the ticks in which robots had a task.
    pub(super) busy_ticks: u64,
}

impl TaskHistory {
    /// Returns the history before the first tick: no robot has a task.
    pub(super) fn new(robots: usize) -> Self {
        let schedules = vec![Vec::new(); robots];
        Self { revealed: Vec::new(), events: Vec::new(), schedules, busy_ticks: 0 }
    }

    /// Returns the number of tasks that are known.
    pub(super) fn revealed(&self) -> u64 {
        self.revealed.len() as u64
    }

    /// Adds a tick, from the states before and after it. Errands are noticed when it begins.
    pub(super) fn push(&mut self, tick: Cycle, before: &GridTeam, after: &GridTeam) {
        self.revealed.extend(after.new_tasks.iter().map(|errands| (tick, errands.clone())));
        let held = after.agents.iter().filter_map(|agent| agent.task.map(|own| own.task));
        let unfinished: BTreeSet<u64> = held.chain(after.open_tasks.iter().copied()).collect();
        for (robot, (old, new)) in before.agents.iter().zip(&after.agents).enumerate() {
            if let Some(visited) = old.task.and_then(|own| errand_done(own, new.task, &unfinished))
            {
                let task = old.task.map_or(0, |own| own.task);
                self.events.push([tick, robot as u64, task, u64::from(visited)]);
            }
            let [had, has] = [old.task, new.task].map(|own| own.map(|own| own.task));
            if tick == 0 || had != has {
                let task = has.map_or("-1".to_string(), |task| task.to_string());
                self.schedules[robot].push(format!("{tick}:{task}"));
            }
            self.busy_ticks += u64::from(new.task.is_some());
        }
    }

    pub(super) fn events(&self) -> &[[u64; 4]] {
        &self.events
    }

    /// Returns the tasks of each robot in the words of the League.
    pub(super) fn schedules(&self) -> Vec<String> {
        let in_words = |tasks: &Vec<String>| {
            // The viewer reads no empty text.
            if tasks.is_empty() { "0:-1".to_string() } else { tasks.join(",") }
        };
        self.schedules.iter().map(in_words).collect()
    }

    /// Returns all tasks. The viewer opens no file without one: robots without tasks get one that nobody does, where
    /// robot 0 starts.
    pub(super) fn list(&self, rows: u32, start: GridPlace) -> Vec<Value> {
        let no_task = [(0, vec![(start.col, start.row)])];
        let tasks = if self.revealed.is_empty() { &no_task[..] } else { &self.revealed };
        let in_league_order = |&(col, row): &(u32, u32)| [rows - 1 - row, col];
        let list = tasks.iter().enumerate().map(|(task, (tick, errands))| {
            json!([task, tick, errands.iter().flat_map(in_league_order).collect::<Vec<u32>>()])
        });
        list.collect()
    }
}

/// Returns how many errands of a robot's task were done, if one of them was done in this tick.
fn errand_done(own: GridTask, next: Option<GridTask>, unfinished: &BTreeSet<u64>) -> Option<u32> {
    match next.filter(|next| next.task == own.task) {
        Some(next) => (next.visited > own.visited).then_some(next.visited),
        // A task without a robot was taken back, or given to another one.
        None => (!unfinished.contains(&own.task)).then_some(own.visited + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::view::GridAgent;

    fn team(tasks: [Option<(u64, u32)>; 2], open: &[u64]) -> GridTeam {
        let agents = tasks.map(|own| GridAgent {
            place: GridPlace { col: 0, row: 0, heading: 0 },
            cycles_left: 0,
            delayed_cycles: 0,
            planned: None,
            task: own.map(|(task, visited)| GridTask { task, visited }),
        });
        GridTeam {
            action_cycles: 1,
            agents: agents.to_vec(),
            new_tasks: Vec::new(),
            open_tasks: open.to_vec(),
            finished_tasks: 0,
        }
    }

    #[test]
    fn a_task_that_is_taken_back_is_no_event_and_one_that_is_finished_is() {
        let mut history = TaskHistory::new(2);
        let states = [
            team([None, None], &[]),
            team([Some((0, 0)), Some((1, 0))], &[2]),
            team([Some((1, 0)), Some((0, 0))], &[2]),
            team([Some((1, 1)), Some((2, 0))], &[3]),
        ];
        for (tick, pair) in (0..).zip(states.windows(2)) {
            history.push(tick, &pair[0], &pair[1]);
        }
        assert_eq!(history.events(), [[2, 0, 1, 1], [2, 1, 0, 1]]);
        assert_eq!(history.schedules(), ["0:0,1:1", "0:1,1:0,2:2"]);
        assert_eq!(history.busy_ticks, 6);
    }
}
