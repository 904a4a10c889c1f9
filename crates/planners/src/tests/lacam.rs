use super::floors::{problems, small_agents};
use super::joint_search::{Measure, optimal_cost};
use crate::lacam::{LacamConfig, Objective, plan};
use crate::{ActionModel, Seed};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn plans_are_valid_and_cost_at_least_the_bound(problem in problems(7, 2, 8), seed in any::<u64>()) {
        let instance = problem.instance();
        let config =
            LacamConfig { budget_expansions: 300, seed: Seed(seed), ..LacamConfig::default() };
        let Ok(outcome) = plan(&instance, config) else { return Ok(()) };
        prop_assert!(outcome.expansions <= 300);
        if let Some(plan) = outcome.plan {
            prop_assert_eq!(plan.validate(&instance), Ok(()));
            let bounds = instance.bounds().unwrap();
            let costs = plan.costs(&instance);
            prop_assert!(costs.sum_of_loss >= bounds.sum_of_costs);
            prop_assert!(costs.sum_of_costs >= costs.sum_of_loss);
            prop_assert!(costs.makespan >= bounds.makespan);
            prop_assert!(bounds.gap(&costs) >= 0.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn with_enough_budget_the_plan_is_the_best_one_and_without_a_plan_there_is_none(
        problem in problems(3, 2, 2), seed in any::<u64>(),
    ) {
        let instance = problem.instance();
        for (objective, measure) in
            [(Objective::SumOfLoss, Measure::SumOfLoss), (Objective::Makespan, Measure::Makespan)]
        {
            let config = LacamConfig {
                objective,
                budget_expansions: 200_000,
                seed: Seed(seed),
                ..LacamConfig::default()
            };
            let Ok(outcome) = plan(&instance, config) else { return Ok(()) };
            prop_assert!(outcome.is_exhaustive);
            let cost = outcome.plan.map(|plan| {
                let costs = plan.costs(&instance);
                match objective {
                    Objective::SumOfLoss => costs.sum_of_loss,
                    Objective::Makespan => u64::from(costs.makespan),
                }
            });
            prop_assert_eq!(cost, optimal_cost(&instance, measure));
        }
    }
}

#[test]
fn three_agents_exchange_the_ends_of_a_t_junction() {
    let art = "#####\n.....\n##.##\n##.##";
    let ways = [[(0, 2), (2, 0)], [(2, 0), (4, 2)], [(4, 2), (0, 2)]];
    for model in [ActionModel::Turns, ActionModel::Classical] {
        let instance = small_agents(art, model, &ways);
        let config = LacamConfig {
            budget_expansions: 100_000,
            is_first_enough: true,
            ..LacamConfig::default()
        };
        let plan = plan(&instance, config).unwrap().plan.expect("there is a plan");
        assert_eq!(plan.validate(&instance), Ok(()));
    }
}

#[test]
fn a_swap_in_a_corridor_without_a_pocket_has_no_plan() {
    let ends = [[(0, 0), (3, 0)], [(3, 0), (0, 0)]];
    for model in [ActionModel::Turns, ActionModel::Classical] {
        let instance = small_agents("....", model, &ends);
        let config = LacamConfig { budget_expansions: 100_000, ..LacamConfig::default() };
        let outcome = plan(&instance, config).unwrap();
        assert!(outcome.is_exhaustive && outcome.plan.is_none());
    }
}
