use super::floors::{Problem, problems, small_agents};
use crate::dependency_graph::{DependencyGraph, Permission};
use crate::{ActionModel, GridPose, Instance, PibtConfig, Plan, Seed, pibt, prioritized};
use proptest::prelude::*;
use sidestep_kernel::stream::{Purpose, Streams};

/// Carries out a plan with agents that are late at random: in each round each does its next action or not. Checks after
/// each single action that no bodies overlap. Returns the final poses, or none if nobody may go on.
fn execute(problem: &Problem, graph: &DependencyGraph, seed: u64) -> Option<Vec<GridPose>> {
    let streams = Streams::new(Seed(seed));
    let mut poses: Vec<GridPose> = problem.agents.iter().map(|agent| agent.start).collect();
    let mut progress = vec![0; poses.len()];
    for round in 0.. {
        let mut can_move = false;
        let mut is_finished = true;
        for agent in 0..poses.len() {
            let movers = match graph.permission(agent, &progress) {
                Permission::Complete => continue,
                Permission::Wait => vec![],
                Permission::Go => vec![agent as u32],
                Permission::GoTogether(circle) => circle.to_vec(),
            };
            is_finished = false;
            can_move |= !movers.is_empty();
            // Two of three agents are late.
            if !streams.block(agent as u32, round, Purpose(9), 0)[0].is_multiple_of(3) {
                continue;
            }
            for mover in movers.into_iter().map(|mover| mover as usize) {
                poses[mover] = graph.action(mover, progress[mover]).unwrap().1;
                progress[mover] += 1;
            }
            assert_apart(problem, &poses);
        }
        if is_finished {
            return Some(poses);
        }
        if !can_move {
            return None;
        }
    }
    None
}

fn assert_apart(problem: &Problem, poses: &[GridPose]) {
    let mut agents = problem.agents.clone();
    for (agent, pose) in agents.iter_mut().zip(poses) {
        agent.start = *pose;
    }
    Instance::new(&problem.free, problem.model, agents).expect("bodies are apart");
}

fn check(problem: &Problem, plan: &Plan, seed: u64) {
    let instance = problem.instance();
    let graph = DependencyGraph::new(&instance, plan).unwrap();
    assert!(graph.is_acyclic());
    let poses = execute(problem, &graph, seed).expect("somebody may always go on");
    for (agent, pose) in poses.iter().enumerate() {
        assert_eq!(*pose, plan.pose(agent, plan.steps()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn late_agents_meet_nobody_and_all_arrive(problem in problems(7, 2, 12), seed in any::<u64>()) {
        let instance = problem.instance();
        let config = PibtConfig { seed: Seed(seed), ..PibtConfig::default() };
        if let Some(plan) = pibt::plan(&instance, config, 60) {
            check(&problem, &plan, seed);
        }
        if let Ok(outcome) = prioritized::plan(&instance, 3) && let Some(plan) = outcome.plan {
            check(&problem, &plan, seed);
        }
    }
}

#[test]
fn a_follower_waits_until_the_box_is_left() {
    let ways = [[(0, 0), (1, 0)], [(1, 0), (2, 0)]];
    let instance = small_agents("...", ActionModel::Turns, &ways);
    let plan = pibt::plan(&instance, PibtConfig::default(), 5).unwrap();
    assert_eq!(plan.steps(), 1);
    let graph = DependencyGraph::new(&instance, &plan).unwrap();
    assert_eq!(graph.permission(0, &[0, 0]), Permission::Wait);
    assert_eq!(graph.permission(1, &[0, 0]), Permission::Go);
    assert_eq!(graph.permission(0, &[0, 1]), Permission::Go);
    assert_eq!(graph.permission(1, &[0, 1]), Permission::Complete);
    assert_eq!(graph.dependencies(0, 0).collect::<Vec<_>>(), [(1, 0)]);
}

#[test]
fn agents_of_a_circle_go_together_once_all_are_there() {
    let circle = [[(0, 0), (1, 0)], [(1, 0), (1, 1)], [(1, 1), (0, 1)], [(0, 1), (0, 0)]];
    let instance = small_agents("..\n..", ActionModel::Turns, &circle);
    let plan = pibt::plan(&instance, PibtConfig::default(), 20).unwrap();
    let graph = DependencyGraph::new(&instance, &plan).unwrap();
    assert!(graph.is_acyclic());
    let last: Vec<usize> = (0..4).map(|agent| graph.actions(agent) - 1).collect();
    assert_eq!(graph.permission(0, &last), Permission::GoTogether(&[0, 1, 2, 3]));
    let late = [last[0], last[1], last[2] - 1, last[3]];
    assert_eq!(graph.permission(0, &late), Permission::Wait);
}
