//! Optimal costs by a search in the joint space of all agents, which knows nothing of the planners.

use crate::{GridPose, Instance};
use std::collections::{BTreeMap, BTreeSet};

/// What a step costs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Measure {
    SumOfLoss,
    SumOfCosts,
    Makespan,
}

/// The poses of all agents, and whether each has declared that it stays at its goal for good.
type State = (Vec<GridPose>, Vec<bool>);

/// Returns the lowest cost of any plan; none if there is none.
pub(super) fn optimal_cost(instance: &Instance, measure: Measure) -> Option<u64> {
    let starts: Vec<GridPose> = instance.agents().iter().map(|agent| agent.start).collect();
    let first: State = (starts.clone(), vec![false; starts.len()]);
    let mut costs = BTreeMap::from([(first.clone(), 0)]);
    let mut queue = BTreeSet::from([(0, first)]);
    while let Some((cost, state)) = queue.pop_first() {
        if is_goal(instance, &state, measure) {
            return Some(cost);
        }
        for (step_cost, next) in successors(instance, &state, measure) {
            let cost = cost + step_cost;
            if costs.get(&next).is_none_or(|&known| cost < known) {
                costs.insert(next.clone(), cost);
                queue.insert((cost, next));
            }
        }
    }
    None
}

fn is_goal(instance: &Instance, (poses, stays): &State, measure: Measure) -> bool {
    match measure {
        Measure::SumOfCosts => stays.iter().all(|&stays| stays),
        _ => poses.iter().zip(instance.agents()).all(|(pose, agent)| pose.position() == agent.goal),
    }
}

fn successors(instance: &Instance, state: &State, measure: Measure) -> Vec<(u64, State)> {
    let mut partial: Vec<State> = vec![(Vec::new(), Vec::new())];
    for agent in 0..state.0.len() {
        let options = options(instance, state, agent, measure);
        partial = partial
            .iter()
            .flat_map(|before| {
                options.iter().filter_map(|option| extend(instance, state, before, option))
            })
            .collect();
    }
    partial.into_iter().map(|next| (step_cost(instance, state, &next, measure), next)).collect()
}

/// Returns what an agent can do; at its goal also to declare that it stays, which takes no time but blocks it.
fn options(
    instance: &Instance,
    (poses, stays): &State,
    agent: usize,
    measure: Measure,
) -> Vec<(GridPose, bool)> {
    let pose = poses[agent];
    if stays[agent] {
        return vec![(pose, true)];
    }
    let actions = instance.model().actions().iter();
    let after = actions.filter_map(|&action| pose.after(action));
    let fits = |pose: &GridPose| instance.graph(agent).node(*pose).is_some();
    let mut options: Vec<_> = after.filter(fits).map(|pose| (pose, false)).collect();
    if measure == Measure::SumOfCosts && pose.position() == instance.agents()[agent].goal {
        options.push((pose, true));
    }
    options
}

/// Adds the next agent to the poses after a step, if it has no conflict with those before it.
fn extend(
    instance: &Instance,
    (now, _): &State,
    before: &State,
    &(pose, stays): &(GridPose, bool),
) -> Option<State> {
    let agent = before.0.len();
    let overlaps = |a: GridPose, size_a: u32, b: GridPose, size_b: u32| {
        a.col < b.col + size_b
            && b.col < a.col + size_a
            && a.row < b.row + size_b
            && b.row < a.row + size_a
    };
    let size = |agent: usize| instance.agents()[agent].size;
    for (other, &other_pose) in before.0.iter().enumerate() {
        let is_swap = now[other].position() == pose.position()
            && now[agent].position() == other_pose.position();
        if is_swap || overlaps(pose, size(agent), other_pose, size(other)) {
            return None;
        }
    }
    let mut next = before.clone();
    next.0.push(pose);
    next.1.push(stays);
    Some(next)
}

fn step_cost(instance: &Instance, before: &State, after: &State, measure: Measure) -> u64 {
    let agents = 0..before.0.len();
    match measure {
        Measure::Makespan => 1,
        Measure::SumOfCosts => after.1.iter().filter(|&&stays| !stays).count() as u64,
        Measure::SumOfLoss => {
            let goal = |agent: usize| instance.agents()[agent].goal;
            let is_there = |pose: GridPose, agent| pose.position() == goal(agent);
            let is_loss = |&agent: &usize| {
                !is_there(before.0[agent], agent) || !is_there(after.0[agent], agent)
            };
            agents.filter(is_loss).count() as u64
        }
    }
}
