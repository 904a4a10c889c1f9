use super::floors::{agent, draw, problems, small_agents};
use super::joint_search::{Measure, optimal_cost};
use crate::prioritized::plan;
use crate::{ActionModel, Instance};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn plans_are_valid_whatever_the_bodies_and_cost_at_least_the_bound(problem in problems(9, 3, 10)) {
        let instance = problem.instance();
        let Ok(outcome) = plan(&instance, 10) else { return Ok(()) };
        prop_assert_eq!(outcome.plan.is_none(), outcome.blocked_agent.is_some());
        if let Some(plan) = outcome.plan {
            prop_assert_eq!(plan.validate(&instance), Ok(()));
            let bounds = instance.bounds().unwrap();
            let costs = plan.costs(&instance);
            prop_assert!(costs.sum_of_costs >= bounds.sum_of_costs);
            prop_assert!(costs.makespan >= bounds.makespan);
        }
    }

    #[test]
    fn an_agent_alone_takes_a_shortest_path(problem in problems(6, 2, 1)) {
        let instance = problem.instance();
        let Ok(outcome) = plan(&instance, 1) else { return Ok(()) };
        let cost = outcome.plan.map(|plan| plan.costs(&instance).sum_of_costs);
        prop_assert_eq!(cost, optimal_cost(&instance, Measure::SumOfCosts));
        prop_assert_eq!(cost, Some(instance.bounds().unwrap().sum_of_costs));
    }

    #[test]
    fn the_second_of_two_agents_arrives_as_early_as_the_first_one_lets_it(
        problem in problems(4, 2, 2),
    ) {
        let instance = problem.instance();
        let Ok(outcome) = plan(&instance, 1) else { return Ok(()) };
        if let Some(plan) = outcome.plan {
            let optimum = optimal_cost(&instance, Measure::SumOfCosts).unwrap();
            prop_assert!(plan.costs(&instance).sum_of_costs >= optimum);
        }
    }
}

#[test]
fn bodies_of_two_boxes_make_way_in_a_wide_niche() {
    let art = "##..##\n##..##\n......\n......";
    for model in [ActionModel::Turns, ActionModel::Classical] {
        let agents = vec![agent(2, (0, 0), (2, 2)), agent(2, (4, 0), (0, 0))];
        let instance = Instance::new(&draw(art), model, agents).unwrap();
        let plan = plan(&instance, 5).unwrap().plan.expect("one goes first");
        assert_eq!(plan.validate(&instance), Ok(()));
    }
}

#[test]
fn an_agent_that_finds_no_path_is_planned_first() {
    // The agent with the longer path would sweep the corridor, and the other one could not reach the exit before.
    let ways = [[(6, 0), (0, 0)], [(1, 0), (4, 2)]];
    let instance = small_agents("####.##\n####.##\n.......", ActionModel::Classical, &ways);
    let outcome = plan(&instance, 1).unwrap();
    assert_eq!((outcome.plan, outcome.blocked_agent), (None, Some(1)));
    let outcome = plan(&instance, 2).unwrap();
    assert_eq!(outcome.order, [1, 0]);
    assert_eq!(outcome.plan.expect("the other one waits").validate(&instance), Ok(()));
}

#[test]
fn an_agent_leaves_its_box_in_the_step_in_which_another_one_enters_it() {
    let ways = [[(0, 0), (4, 0)], [(1, 0), (1, 1)]];
    let instance = small_agents("#.###\n.....", ActionModel::Classical, &ways);
    let outcome = plan(&instance, 1).unwrap();
    assert_eq!(outcome.order, [0, 1]);
    assert_eq!(outcome.plan.map(|plan| plan.costs(&instance).sum_of_costs), Some(5));
}

#[test]
fn no_order_is_tried_twice() {
    let ends = [[(0, 0), (3, 0)], [(3, 0), (0, 0)]];
    let instance = small_agents("....", ActionModel::Classical, &ends);
    let outcome = plan(&instance, 9).unwrap();
    assert_eq!((outcome.plan, outcome.orders), (None, 2));
}

#[test]
fn overlapping_goals_and_blocked_starts_are_refused_with_their_place() {
    let refuse = |agents| Instance::new(&draw("...\n..#"), ActionModel::Turns, agents).unwrap_err();
    let error = refuse(vec![agent(1, (0, 0), (2, 1)), agent(1, (1, 0), (2, 1))]);
    assert_eq!(error.place(), "agents[1].goal");
    assert_eq!(refuse(vec![agent(2, (1, 0), (0, 0))]).place(), "agents[0].start");
    assert_eq!(refuse(vec![agent(0, (1, 0), (0, 0))]).place(), "agents[0].size");
    let mut wrong = agent(1, (0, 0), (1, 0));
    wrong.start.heading = 4;
    assert_eq!(refuse(vec![wrong]).place(), "agents[0].start.heading");
}
