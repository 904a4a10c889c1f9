//! Floors and problems for tests.

use crate::{Action, ActionModel, Agent, GridPose, Instance, Plan};
use proptest::prelude::*;
use sidestep_map::planning::FreeSpace;

/// Returns the free boxes of a drawing with the north edge as its first line; `#` is a wall.
pub(super) fn draw(art: &str) -> FreeSpace {
    let rows: Vec<&[u8]> = art.lines().rev().map(str::as_bytes).collect();
    FreeSpace::new(rows[0].len() as u32, rows.len() as u32, |col, row| {
        rows[row as usize][col as usize] != b'#'
    })
}

/// Returns an agent of `size` x `size` boxes that faces east.
pub(super) fn agent(size: u32, start: (u32, u32), goal: (u32, u32)) -> Agent {
    Agent { size, start: GridPose::new(start.0, start.1, 0), goal }
}

/// Returns the problem of agents of one box.
pub(super) fn small_agents(art: &str, model: ActionModel, places: &[[(u32, u32); 2]]) -> Instance {
    let agents = places.iter().map(|&[start, goal]| agent(1, start, goal)).collect();
    Instance::new(&draw(art), model, agents).expect("a right problem")
}

/// A random problem: the walls, and where agents may be.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    pub(super) free: FreeSpace,
    pub(super) model: ActionModel,
    pub(super) agents: Vec<Agent>,
}

impl Problem {
    pub(super) fn instance(&self) -> Instance {
        Instance::new(&self.free, self.model, self.agents.clone()).expect("a right problem")
    }

    pub(super) fn sizes(&self) -> Vec<u32> {
        self.agents.iter().map(|agent| agent.size).collect()
    }
}

/// Returns random problems on floors of at most `side` x `side` boxes with agents of 1 to `max_size` boxes; as many of
/// them as fit, and at most `max_agents`.
pub(super) fn problems(
    side: u32,
    max_size: u32,
    max_agents: usize,
) -> impl Strategy<Value = Problem> {
    let size = (2..=side, 2..=side);
    let places =
        proptest::collection::vec((1..=max_size, 0u32..400, 0u32..400, 0u8..4), 1..=max_agents);
    let model = prop_oneof![Just(ActionModel::Turns), Just(ActionModel::Classical)];
    (size, any::<[u128; 3]>(), places, model).prop_map(|((width, height), walls, places, model)| {
        let is_wall = |index: u32| walls.iter().all(|w| w.rotate_right(index) & 1 == 1);
        let free = FreeSpace::new(width, height, |col, row| !is_wall(row * 11 + col));
        let agents = fit(&free, &places);
        Problem { free, model, agents }
    })
}

/// Returns agents at the first free places from random ones on; those that find none are left out.
fn fit(free: &FreeSpace, places: &[(u32, u32, u32, u8)]) -> Vec<Agent> {
    let mut starts = vec![false; (free.width() * free.height()) as usize];
    let mut goals = starts.clone();
    let mut agents = Vec::new();
    for &(size, from, to, heading) in places {
        let Some(start) = find(free, size, from, &starts) else { continue };
        let Some(goal) = find(free, size, to, &goals) else { continue };
        cover(free, size, start, &mut starts);
        cover(free, size, goal, &mut goals);
        agents.push(Agent { size, start: GridPose::new(start.0, start.1, heading), goal });
    }
    agents
}

fn body(free: &FreeSpace, size: u32, (col, row): (u32, u32)) -> impl Iterator<Item = usize> {
    let width = free.width();
    (row..row + size)
        .flat_map(move |row| (col..col + size).map(move |col| (row * width + col) as usize))
}

fn find(free: &FreeSpace, size: u32, first: u32, taken: &[bool]) -> Option<(u32, u32)> {
    let anchors = free.anchors(size);
    let boxes = free.width() * free.height();
    (0..boxes)
        .map(|offset| (first + offset) % boxes)
        .map(|index| (index % free.width(), index / free.width()))
        .filter(|&(col, row)| anchors.is_free(col, row))
        .find(|&at| body(free, size, at).all(|covered| !taken[covered]))
}

fn cover(free: &FreeSpace, size: u32, at: (u32, u32), taken: &mut [bool]) {
    for covered in body(free, size, at) {
        taken[covered] = true;
    }
}

/// Checks one step of agents that have no goals to reach.
pub(super) fn check_step(
    problem: &Problem,
    poses: &[GridPose],
    actions: &[Action],
) -> Vec<GridPose> {
    let after: Vec<GridPose> =
        poses.iter().zip(actions).map(|(pose, &action)| pose.after(action).unwrap()).collect();
    let mut agents = problem.agents.clone();
    for ((agent, start), end) in agents.iter_mut().zip(poses).zip(&after) {
        agent.start = *start;
        agent.goal = end.position();
    }
    let step = Problem { agents, ..problem.clone() };
    let paths = poses.iter().zip(&after).map(|(&from, &to)| vec![from, to]).collect();
    let instance = Instance::new(&step.free, step.model, step.agents).expect("bodies are apart");
    assert_eq!(Plan::new(paths).validate(&instance), Ok(()));
    after
}
