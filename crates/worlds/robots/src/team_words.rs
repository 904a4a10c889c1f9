//! What the planner of a team remembers, in words of a snapshot: a share for each robot.
//!
//! | words | of |
//! |---|---|
//! | steps without the goal, goal, planned place and heading, times off the plan | each robot |
//! | believed place, heading, place that it leaves, cycles of its action and its delay, order | each robot where these report |
//! | the first step of the next search, counts of plans | robot 0 of a team that carries plans out |
//! | actions of an order and 1, or 0 without; the actions by 16 | each robot of a team that carries plans out |
//! | steps of the plan so far, steps without progress | robot 0 where there is a plan |
//! | actions done, place and heading at its start, where it reports the most actions done, number of actions, the actions by 16 | each robot where there is a plan |

use crate::belief::Belief;
use crate::effector::ActionId;
use crate::team_memory::TeamMemory;
use sidestep_planners::{Action, Execution, GridPose, Plan, PlanCounts};

/// Actions by their numbers in a word, two bits each.
const ACTIONS: [Action; 4] = [Action::Wait, Action::Forward, Action::TurnLeft, Action::TurnRight];
/// Actions in a word.
const ACTIONS_PER_WORD: usize = 16;

/// Returns a robot's share.
pub(crate) fn words(memory: &TeamMemory, robot: usize, is_stepwise: bool) -> Vec<u32> {
    let planner = &memory.planner;
    let pose = memory.planned[robot];
    let heading = pose.map_or(0, |pose| u32::from(pose.heading));
    let mut words = vec![
        planner.pibt.ages[robot],
        packed(planner.pibt.goals[robot]),
        packed(pose.map(GridPose::position)),
        heading,
        memory.off_plan[robot],
    ];
    if let Some(belief) = memory.beliefs.robots.get(robot) {
        let Belief { pose, from, steps_left, delay_steps, order } = *belief;
        let places = [packed(Some(pose.position())), u32::from(pose.heading), packed(Some(from))];
        let order = order.map_or(0, |action| u32::from(action) + 1);
        words.extend(places.into_iter().chain([steps_left, delay_steps, order]));
    }
    if is_stepwise {
        return words;
    }
    if robot == 0 {
        let PlanCounts { plans, failures, expansions, costs, bounds } = planner.counts;
        for number in [planner.next_search, plans, failures, expansions, costs, bounds] {
            words.extend([number as u32, (number >> 32) as u32]);
        }
    }
    // An order that the next cycle begins with is there between cycles only.
    if let Some(ordered) = &planner.ordered {
        words.push(1 + ordered[robot].len() as u32);
        words.extend(packed_actions(&ordered[robot]));
    } else {
        words.push(0);
    }
    let Some(execution) = &planner.execution else { return words };
    if robot == 0 {
        words.extend([execution.step, execution.stall_steps]);
    }
    let path = execution.plan.path(robot);
    let start = packed(Some(path[0].position()));
    words.extend([execution.progress[robot], start, u32::from(path[0].heading)]);
    if !memory.beliefs.robots.is_empty() {
        words.push(execution.furthest[robot]);
    }
    let actions = actions_of(path);
    words.push(actions.len() as u32);
    words.extend(packed_actions(&actions));
    words
}

/// Takes over the shares of all robots. A plan that is not whole is left out, and made anew.
pub(crate) fn restore(memory: &mut TeamMemory, shares: &[&[u32]], is_stepwise: bool) {
    let mut readers: Vec<Reader<'_>> = shares.iter().map(|&words| Reader { words }).collect();
    for (robot, reader) in readers.iter_mut().enumerate() {
        let [age, goal, place, heading, off_plan] = [(); 5].map(|()| reader.next().unwrap_or(0));
        memory.planner.pibt.ages[robot] = age;
        memory.planner.pibt.goals[robot] = unpacked(goal);
        memory.planned[robot] =
            unpacked(place).map(|(col, row)| GridPose::new(col, row, heading as u8));
        memory.off_plan[robot] = off_plan;
        if let Some(belief) = memory.beliefs.robots.get_mut(robot) {
            let [place, heading, from, steps_left, delay_steps, order] =
                [(); 6].map(|()| reader.next().unwrap_or(0));
            let (col, row) = unpacked(place).unwrap_or_default();
            let pose = GridPose::new(col, row, heading as u8);
            let from = unpacked(from).unwrap_or_default();
            let order = order.checked_sub(1).map(|action| action as ActionId);
            *belief = Belief { pose, from, steps_left, delay_steps, order };
        }
    }
    let Some(first) = readers.first_mut().filter(|_| !is_stepwise) else { return };
    let [next_search, plans, failures, expansions, costs, bounds] =
        [(); 6].map(|()| first.next_number().unwrap_or(0));
    memory.planner.next_search = next_search;
    memory.planner.counts = PlanCounts { plans, failures, expansions, costs, bounds };
    memory.planner.ordered = ordered(&mut readers);
    let may_fall_back = !memory.beliefs.robots.is_empty();
    memory.planner.execution = execution(&mut readers, may_fall_back);
}

/// Reads the actions of each robot that a caller has ordered; none where there are none.
fn ordered(readers: &mut [Reader<'_>]) -> Option<Vec<Vec<Action>>> {
    let mut plan = Vec::with_capacity(readers.len());
    for reader in readers {
        let count = reader.next().and_then(|word| word.checked_sub(1));
        plan.push(count.and_then(|count| reader.actions(count as usize)));
    }
    plan.into_iter().collect()
}

fn execution(readers: &mut [Reader<'_>], may_fall_back: bool) -> Option<Execution> {
    let first = readers.first_mut()?;
    let step = first.next()?;
    let stall_steps = first.next()?;
    let mut progress = Vec::with_capacity(readers.len());
    let mut furthest = Vec::with_capacity(readers.len());
    let mut paths = Vec::with_capacity(readers.len());
    for reader in readers {
        let done = reader.next()?;
        progress.push(done);
        let start = reader.start()?;
        furthest.push(if may_fall_back { reader.next()? } else { done });
        paths.push(reader.path_from(start)?);
    }
    let is_even = paths.iter().all(|path| path.len() == paths[0].len());
    is_even.then(|| Execution { plan: Plan::new(paths), step, progress, furthest, stall_steps })
}

/// The rest of a share.
struct Reader<'a> {
    words: &'a [u32],
}

impl Reader<'_> {
    fn next(&mut self) -> Option<u32> {
        let (&word, rest) = self.words.split_first()?;
        self.words = rest;
        Some(word)
    }

    fn next_number(&mut self) -> Option<u64> {
        let low = self.next()?;
        let high = self.next()?;
        Some(u64::from(high) << 32 | u64::from(low))
    }

    fn actions(&mut self, count: usize) -> Option<Vec<Action>> {
        let mut actions = Vec::new();
        let mut word = 0;
        for index in 0..count {
            if index.is_multiple_of(ACTIONS_PER_WORD) {
                word = self.next()?;
            }
            actions.push(ACTIONS[(word & 3) as usize]);
            word >>= 2;
        }
        Some(actions)
    }

    fn start(&mut self) -> Option<GridPose> {
        let (col, row) = unpacked(self.next()?)?;
        Some(GridPose::new(col, row, self.next()? as u8))
    }

    fn path_from(&mut self, mut pose: GridPose) -> Option<Vec<GridPose>> {
        let count = self.next()? as usize;
        let mut path = vec![pose];
        for action in self.actions(count)? {
            pose = pose.after(action)?;
            path.push(pose);
        }
        Some(path)
    }
}

/// Returns the actions of a path.
fn actions_of(path: &[GridPose]) -> Vec<Action> {
    let mut actions = Vec::with_capacity(path.len() - 1);
    for pair in path.windows(2) {
        let leads = |&action: &Action| pair[0].after(action) == Some(pair[1]);
        actions.push(ACTIONS.into_iter().find(leads).expect("a plan is made of actions"));
    }
    actions
}

/// Returns actions by their numbers, two bits each.
fn packed_actions(actions: &[Action]) -> Vec<u32> {
    let mut words = Vec::with_capacity(actions.len().div_ceil(ACTIONS_PER_WORD));
    for chunk in actions.chunks(ACTIONS_PER_WORD) {
        let mut word = 0;
        for (place, action) in chunk.iter().enumerate() {
            let number = ACTIONS.iter().position(|one| one == action).expect("one of those");
            word |= (number as u32) << (2 * place);
        }
        words.push(word);
    }
    words
}

/// Returns a place in one word, 0 for none. A map has less than 65,535 columns and rows, as positions in a state have
/// 16 bits each.
fn packed(place: Option<(u32, u32)>) -> u32 {
    place.map_or(0, |(col, row)| (col + 1) << 16 | row)
}

fn unpacked(word: u32) -> Option<(u32, u32)> {
    (word != 0).then(|| ((word >> 16) - 1, word & 0xffff))
}
