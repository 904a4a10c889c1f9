use super::floors::{problems, small_agents};
use super::joint_search::{Measure, optimal_cost};
use crate::ActionModel;
use crate::cbs::plan;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn two_agents_of_any_size_have_the_lowest_sum_of_costs(problem in problems(3, 2, 2)) {
        let instance = problem.instance();
        let Ok(outcome) = plan(&instance, 200) else { return Ok(()) };
        let optimum = optimal_cost(&instance, Measure::SumOfCosts);
        prop_assert!(optimum.is_none_or(|optimum| outcome.lower_bound <= optimum));
        if let Some(plan) = outcome.plan {
            prop_assert_eq!(plan.validate(&instance), Ok(()));
            prop_assert_eq!(Some(plan.costs(&instance).sum_of_costs), optimum);
            prop_assert_eq!(Some(outcome.lower_bound), optimum);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn three_agents_have_the_lowest_sum_of_costs(mut problem in problems(3, 1, 3)) {
        // With headings the joint space of three is too large to search in a test.
        problem.model = ActionModel::Classical;
        let instance = problem.instance();
        let Ok(outcome) = plan(&instance, 100) else { return Ok(()) };
        if let Some(plan) = outcome.plan {
            prop_assert_eq!(plan.validate(&instance), Ok(()));
            let optimum = optimal_cost(&instance, Measure::SumOfCosts);
            prop_assert_eq!(Some(plan.costs(&instance).sum_of_costs), optimum);
        }
    }
}

#[test]
fn a_swap_in_a_corridor_with_a_pocket_costs_what_the_joint_search_finds() {
    let ends = [[(0, 0), (4, 0)], [(4, 0), (0, 0)]];
    for model in [ActionModel::Turns, ActionModel::Classical] {
        let instance = small_agents("##.##\n.....", model, &ends);
        let plan = plan(&instance, 10_000).unwrap().plan.expect("there is a plan");
        let optimum = optimal_cost(&instance, Measure::SumOfCosts);
        assert_eq!(Some(plan.costs(&instance).sum_of_costs), optimum);
    }
}

#[test]
fn a_circle_of_four_rotates_in_one_step() {
    let circle = [[(0, 0), (1, 0)], [(1, 0), (1, 1)], [(1, 1), (0, 1)], [(0, 1), (0, 0)]];
    let instance = small_agents("..\n..", ActionModel::Classical, &circle);
    let outcome = plan(&instance, 0).unwrap();
    assert_eq!(outcome.plan.map(|plan| plan.steps()), Some(1));
}

#[test]
fn an_agent_enters_its_goal_after_the_one_that_still_has_to_pass_it() {
    let ways = [[(2, 1), (2, 0)], [(0, 0), (4, 0)]];
    let instance = small_agents("##.##\n.....", ActionModel::Classical, &ways);
    let plan = plan(&instance, 100).unwrap().plan.expect("there is a plan");
    assert_eq!(plan.validate(&instance), Ok(()));
    assert_eq!(plan.costs(&instance).sum_of_costs, 3 + 4);
}

#[test]
fn a_problem_without_a_solution_spends_its_budget() {
    let ends = [[(0, 0), (3, 0)], [(3, 0), (0, 0)]];
    let instance = small_agents("....", ActionModel::Classical, &ends);
    let outcome = plan(&instance, 50).unwrap();
    assert_eq!((outcome.plan, outcome.expansions), (None, 50));
    assert!(outcome.lower_bound > 6);
}
