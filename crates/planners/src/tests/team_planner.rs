use super::floors::{Problem, problems};
use crate::{
    Action, Executor, GridPose, Method, Plan, Seed, TeamPlanner, TeamPlannerConfig,
    TeamPlannerState, TeamStep,
};
use proptest::prelude::*;
use sidestep_kernel::stream::{Purpose, Streams};
use std::sync::Arc;

/// Draws of the agents that slip.
const SLIPS: Purpose = Purpose(9);

const REPLAN: Executor = Executor::Replan { every_steps: u32::MAX, max_deviation: 0 };

fn config(method: Method, executor: Executor) -> TeamPlannerConfig {
    TeamPlannerConfig {
        method,
        executor,
        window: None,
        may_fall_back: false,
        may_follow: true,
        action_steps: 1,
        seed: Seed(1),
    }
}

fn lacam() -> Method {
    Method::Lacam { budget_expansions: 300 }
}

/// A team on its way to one goal each.
struct Team {
    planner: TeamPlanner,
    state: TeamPlannerState,
    problem: Problem,
    poses: Vec<GridPose>,
    goals: Vec<Option<(u32, u32)>>,
}

impl Team {
    fn new(problem: &Problem, config: TeamPlannerConfig) -> Self {
        let problem = Problem { model: crate::ActionModel::Turns, ..problem.clone() };
        Self {
            planner: TeamPlanner::new(&problem.free, &problem.sizes(), config)
                .expect("right sizes"),
            state: TeamPlannerState::new(problem.agents.len()),
            poses: problem.agents.iter().map(|agent| agent.start).collect(),
            goals: problem.agents.iter().map(|agent| Some(agent.goal)).collect(),
            problem,
        }
    }

    /// Makes a step in which some agents do nothing; an agent that cannot enter a box where another one stays, or which
    /// another one enters, stays, too.
    fn step(&mut self, slips: impl Fn(usize) -> bool) {
        let now = TeamStep { poses: &self.poses, goals: &self.goals, others: &[], busy: &[] };
        let actions = self.planner.step(&mut self.state, now).expect("right goals");
        let mut after: Vec<GridPose> = self.poses.clone();
        for (agent, &action) in actions.iter().enumerate().filter(|&(agent, _)| !slips(agent)) {
            // Whoever goes by the clock alone may run into a wall, and stays.
            let fits = |pose: &GridPose| {
                let boxes = self.problem.agents[agent].size;
                self.problem.free.anchors(boxes).is_free(pose.col, pose.row)
            };
            let moved = self.poses[agent].after(action).filter(fits);
            after[agent] = moved.unwrap_or(self.poses[agent]);
        }
        while let Some(agent) = self.first_conflict(&after) {
            after[agent] = self.poses[agent];
        }
        self.poses = after;
    }

    /// Returns a mover whose body overlaps another one, or swaps with it.
    fn first_conflict(&self, after: &[GridPose]) -> Option<usize> {
        let sizes = self.problem.sizes();
        let is_mover = |agent: usize| after[agent].position() != self.poses[agent].position();
        let meets = |a: usize, b: usize| {
            let [first, second] = [after[a], after[b]];
            let is_near = |x: u32, y: u32, size: u32| y < x + size && x <= y;
            let overlaps = |x: u32, y: u32| is_near(x, y, sizes[a]) || is_near(y, x, sizes[b]);
            let swaps = first.position() == self.poses[b].position()
                && second.position() == self.poses[a].position();
            overlaps(first.col, second.col) && overlaps(first.row, second.row) || swaps
        };
        (0..after.len()).find(|&agent| {
            is_mover(agent) && (0..after.len()).any(|other| other != agent && meets(agent, other))
        })
    }

    fn is_done(&self) -> bool {
        self.poses.iter().zip(&self.goals).all(|(pose, &goal)| Some(pose.position()) == goal)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn reliable_agents_carry_a_plan_out_to_the_step_by_the_clock_and_not_later_in_order(
        problem in problems(8, 2, 8),
    ) {
        for method in [lacam(), Method::Prioritized { max_orders: 10 }, Method::Cbs { budget_expansions: 50 }] {
            for executor in [Executor::Blind, Executor::Adg, REPLAN] {
                let mut team = Team::new(&problem, config(method.clone(), executor));
                team.step(|_| false);
                // A problem without a plan is another test's.
                let Some(execution) = team.state.execution.clone() else { continue };
                let plan = execution.plan;
                for step in 2..=plan.steps() {
                    team.step(|_| false);
                    let planned = (0..plan.agents()).map(|agent| plan.pose(agent, step));
                    prop_assert!(executor == Executor::Adg || planned.eq(team.poses.iter().copied()));
                }
                prop_assert!(team.is_done());
                prop_assert_eq!(team.state.counts.plans, 1);
            }
        }
    }

    #[test]
    fn agents_that_have_slipped_arrive_by_each_executor_and_a_kept_state_goes_on_alike(
        problem in problems(7, 2, 5), seed in any::<u64>(),
    ) {
        let streams = Streams::new(Seed(seed));
        let every_ten = Executor::Replan { every_steps: 10, max_deviation: 2 };
        for executor in [Executor::Blind, Executor::Adg, REPLAN, every_ten] {
            let mut team = Team::new(&problem, config(lacam(), executor));
            team.step(|_| false);
            if team.state.execution.is_none() {
                continue;
            }
            let mut kept = None;
            for step in 0..600u64 {
                if step == 7 {
                    let saved = serde_json::to_string(&team.state).expect("is serialized");
                    let mut other = Team::new(&problem, config(lacam(), executor));
                    other.state = serde_json::from_str(&saved).expect("was saved");
                    other.poses.clone_from(&team.poses);
                    kept = Some(other);
                }
                // By the clock alone whoever slips may never arrive: no slips, and the next plan must lead there.
                let may_slip = step < 300;
                let slips = |agent: usize| {
                    may_slip && streams.block(agent as u32, step, SLIPS, 0)[0].is_multiple_of(5)
                };
                team.step(slips);
                if let Some(other) = &mut kept {
                    other.step(slips);
                    prop_assert_eq!(&other.state, &team.state);
                }
            }
            prop_assert!(team.is_done(), "{:?}", executor);
        }
    }
}

fn corridor_problem() -> Problem {
    let free = super::floors::draw(".....\n##.##");
    let agents =
        vec![super::floors::agent(1, (0, 1), (4, 1)), super::floors::agent(1, (4, 1), (0, 1))];
    Problem { free, model: crate::ActionModel::Turns, agents }
}

#[test]
fn a_plan_from_elsewhere_is_carried_out_and_where_it_ends_the_team_goes_on_to_its_goals() {
    let problem = corridor_problem();
    let instance = problem.instance();
    let outcome = crate::lacam::plan(&instance, crate::lacam::LacamConfig::default());
    let plan = outcome.expect("is reachable").plan.expect("they pass at the niche");
    let cut: Vec<Vec<GridPose>> = (0..2).map(|agent| plan.path(agent)[..4].to_vec()).collect();
    for (given, is_whole) in [(plan.clone(), true), (Plan::new(cut), false)] {
        let steps = given.steps();
        let method = Method::Given(Arc::new(given.clone()));
        let mut team = Team::new(&problem, config(method, Executor::Blind));
        for _ in 0..steps {
            team.step(|_| false);
        }
        let ends: Vec<GridPose> = (0..2).map(|agent| given.pose(agent, steps)).collect();
        assert_eq!(team.poses, ends);
        assert_eq!(team.is_done(), is_whole);
        for _ in 0..60 {
            team.step(|_| false);
        }
        assert!(team.is_done());
    }
}

#[test]
fn agents_with_one_goal_or_none_are_led_to_places_apart() {
    let mut team = Team::new(&corridor_problem(), config(lacam(), Executor::Adg));
    team.goals = vec![Some((4, 1)), None];
    for _ in 0..30 {
        team.step(|_| false);
    }
    assert_eq!(team.poses[0].position(), (4, 1));
    team.goals = vec![Some((2, 0)), Some((2, 0))];
    for _ in 0..30 {
        team.step(|_| false);
    }
    let at: Vec<(u32, u32)> = team.poses.iter().map(|pose| pose.position()).collect();
    assert!(at.contains(&(2, 0)) && team.state.counts.failures == 0, "{at:?}");
}

#[test]
fn a_search_that_spends_its_budget_is_counted_and_priority_inheritance_leads() {
    let mut team =
        Team::new(&corridor_problem(), config(Method::Cbs { budget_expansions: 0 }, Executor::Adg));
    for _ in 0..60 {
        team.step(|_| false);
    }
    assert!(team.is_done());
    assert!(team.state.counts.failures > 0, "{:?}", team.state.counts);
}

/// Two agents of one box in a lane of eight boxes, one behind the other, both to the east.
fn lane() -> Problem {
    let free = crate::FreeSpace::new(8, 1, |_, _| true);
    let agent =
        |col, goal| crate::Agent { size: 1, start: GridPose::new(col, 0, 0), goal: (goal, 0) };
    Problem { free, model: crate::ActionModel::Turns, agents: vec![agent(1, 6), agent(0, 5)] }
}

#[test]
fn a_plan_that_a_caller_orders_is_carried_out_and_then_all_wait_for_the_next() {
    for executor in [Executor::Adg, Executor::Blind] {
        let mut team = Team::new(&lane(), config(Method::Ordered, executor));
        team.step(|_| false);
        assert_eq!(team.poses[0].col, 1, "without a plan all wait");
        team.state.ordered = Some(vec![vec![Action::Forward; 3], vec![Action::Forward; 2]]);
        team.step(|_| false);
        let left = team.planner.actions_left(&team.state, &team.poses);
        assert_eq!(left, if executor == Executor::Adg { [2, 1] } else { [2, 2] }, "{executor:?}");
        for _ in 0..5 {
            team.step(|_| false);
        }
        assert_eq!([team.poses[0].col, team.poses[1].col], [4, 2], "{executor:?}");
        assert_eq!(team.planner.actions_left(&team.state, &team.poses), [0, 0]);
        assert_eq!((team.state.counts.plans, team.state.counts.failures), (1, 0));
    }
}

#[test]
fn an_ordered_plan_that_collides_or_leaves_the_map_is_a_failure_and_all_wait() {
    for wrong in [
        vec![vec![Action::Wait], vec![Action::Forward]],
        vec![vec![Action::Forward; 9], vec![]],
        vec![vec![Action::TurnLeft, Action::TurnLeft, Action::Forward, Action::Forward], vec![]],
        vec![vec![Action::Forward]],
    ] {
        let mut team = Team::new(&lane(), config(Method::Ordered, Executor::Adg));
        team.state.ordered = Some(wrong.clone());
        team.step(|_| false);
        assert_eq!([team.poses[0].col, team.poses[1].col], [1, 0], "{wrong:?}");
        assert_eq!((team.state.counts.plans, team.state.counts.failures), (1, 1), "{wrong:?}");
    }
}

#[test]
fn an_agent_that_turns_out_to_be_behind_does_again_what_it_has_not_done_where_poses_are_beliefs() {
    for may_fall_back in [true, false] {
        let config = TeamPlannerConfig { may_fall_back, ..config(Method::Ordered, Executor::Adg) };
        let mut team = Team::new(&lane(), config);
        team.state.ordered = Some(vec![vec![Action::Forward; 4], vec![]]);
        team.step(|_| false);
        team.step(|_| false);
        // It was taken to be at column 3, and reports that it is still at 1.
        team.poses[0].col = 1;
        let left = team.planner.actions_left(&team.state, &team.poses);
        assert_eq!(left, if may_fall_back { [4, 0] } else { [0, 0] });
        for _ in 0..6 {
            team.step(|_| false);
        }
        assert_eq!(team.poses[0].col, if may_fall_back { 5 } else { 1 });
    }
}
