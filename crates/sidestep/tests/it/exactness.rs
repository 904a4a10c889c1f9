//! Promise: in the long run the simulator does as the exact Markov chain says, and the
//! exported POMDP is that chain.

use super::tiles::{Tiles, assert_fits, law};
use sidestep::error_models::RandomPolicy;
use sidestep::error_models::effector::{FORWARD, ObstacleRule, Side};
use sidestep::exact::{
    self, Comparison, GridPose, MarkovChain, MarkovModel, sampling_limit, total_variation,
};
use sidestep::kernel::{InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::exact::{compare, markov_model};
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use std::collections::BTreeMap;

/// A room with two pillars and a niche.
const ROOM: &str = "......## ...#.... ......#. .#...... .....>..";

/// A behavior in the scenario, and the policy that it is in the chain.
type Policy = (&'static str, fn() -> RandomPolicy);

const UNIFORM: Policy = ("{ kind = \"random\" }", RandomPolicy::uniform);
const AHEAD: Policy = ("{ kind = \"replay\", actions = [\"forward\"], repeat = true }", || {
    RandomPolicy::always(FORWARD)
});
/// The paper's basic behavior without sensors and voluntary turns.
const BOUNCE: Policy = (
    "{ kind = \"random\", weights = { forward = 1 }, \
     weights_after_contact = { left = 1, right = 1 } }",
    RandomPolicy::bounce,
);
/// Minds contacts, and mixes under every law: a robot that only bounces stands before a wall
/// forever where blocked transitions are struck out and so never become contacts.
const EXPLORE: Policy = (
    "{ kind = \"random\", weights = { forward = 6, left = 1, right = 1 }, \
     weights_after_contact = { forward = 2, left = 3, right = 3 } }",
    || {
        let (usual, after_contact) = (vec![0.75, 0.125, 0.125], vec![0.25, 0.375, 0.375]);
        RandomPolicy::new(usual, after_contact).expect("two distributions")
    },
);

/// A small room with a pillar, in which a robot soon forgets where it was.
const CELL: &str = ".... .#.. ...#  >...";

/// 400 times the same room with a robot of this size in each.
fn rooms(art: &str, size: u32, behaviour: &str, rule: ObstacleRule) -> Tiles {
    let robots = format!("size = {size}\neffector = \"nomad\"\nbehaviour = {behaviour}");
    Tiles::new(art, 20).keys(&law(rule)).robots(&robots)
}

fn compile(source: &Source) -> Compiled {
    Compiled::new(source, &Behaviours::new(), StorageOrder::ById).unwrap_or_else(|e| panic!("{e}"))
}

fn model(tiles: &Tiles) -> MarkovModel {
    markov_model(&compile(&tiles.single().source())).unwrap_or_else(|e| panic!("{e}"))
}

/// Last poses of all rooms, contacts left out.
fn poses(tiles: &Tiles, simulation: &RobotsRun) -> BTreeMap<GridPose, u64> {
    let mut poses = BTreeMap::new();
    for (outcome, n) in tiles.outcomes(simulation) {
        *poses.entry(outcome.pose).or_insert(0) += n;
    }
    poses
}

#[test]
fn after_n_cycles_the_poses_are_distributed_as_the_chain_says() {
    for rule in ObstacleRule::ALL {
        for (behaviour, policy) in [UNIFORM, AHEAD, BOUNCE, EXPLORE] {
            for size in [1, 2] {
                let tiles = rooms(ROOM, size, behaviour, rule);
                let chain = model(&tiles).chain(&policy()).unwrap();
                let mut simulation = tiles.simulation();
                for cycles in [1, 2, 7, 40] {
                    simulation.advance(cycles - simulation.cycle());
                    let exact = chain.pose_distribution(&chain.distribution_after(cycles));
                    let what = format!("{behaviour}, {}, size {size}, {cycles}", rule.name());
                    assert_fits(&what, &poses(&tiles, &simulation), &exact);
                }
            }
        }
    }
}

/// Cycles after which the chain has forgotten where it was: from every state the distribution
/// is within `distance` of the stationary one.
fn mixing_time(chain: &MarkovChain, stationary: &[f64], distance: f64) -> u64 {
    let n = chain.states().len();
    let certain = |at: usize| (0..n).map(|k| f64::from(u8::from(k == at))).collect::<Vec<f64>>();
    let mut rows: Vec<Vec<f64>> = (0..n).map(certain).collect();
    for cycles in 1..20_000 {
        rows.iter_mut().for_each(|row| *row = chain.step(row));
        if rows.iter().all(|row| total_variation(row, stationary) < distance) {
            return cycles;
        }
    }
    panic!("the chain does not mix");
}

/// Every room is looked at often enough apart that looks are as good as independent: the
/// chance that the mixing left any trace in them is below samples times 1e-9. Then the bound
/// of `sampling_limit` holds at 1e-4.
#[test]
fn in_the_long_run_robots_are_where_the_chain_is() {
    for rule in ObstacleRule::ALL {
        for (behaviour, policy) in [UNIFORM, EXPLORE] {
            let tiles = rooms(CELL, 1, behaviour, rule);
            let chain = model(&tiles).chain(&policy()).unwrap();
            let stationary = chain.stationary();
            assert!(stationary.residual < 1e-12);
            let apart = mixing_time(&chain, &stationary.distribution, 1e-9);
            let expected = chain.pose_distribution(&stationary.distribution);
            let (observed, samples) = long_run(&tiles, apart, 12);
            let share = |pose| observed.get(pose).copied().unwrap_or(0) as f64 / samples;
            let shares: Vec<f64> = expected.keys().map(share).collect();
            let exact: Vec<f64> = expected.values().copied().collect();
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9, "only poses of the chain");
            let (found, limit) =
                (total_variation(&exact, &shares), sampling_limit(&exact, samples, 1e-4));
            assert!(limit < 0.09, "a limit of {limit} would say little");
            assert!(found < limit, "{behaviour}, {}: {found} above {limit}", rule.name());
        }
    }
}

/// Looks at all rooms `times` times, `apart` cycles apart.
fn long_run(tiles: &Tiles, apart: u64, times: u64) -> (BTreeMap<GridPose, u64>, f64) {
    let mut simulation = tiles.simulation();
    let mut counts = BTreeMap::new();
    for _ in 0..times {
        simulation.advance(apart);
        for (pose, n) in poses(tiles, &simulation) {
            *counts.entry(pose).or_insert(0) += n;
        }
    }
    let samples = counts.values().sum::<u64>() as f64;
    (counts, samples)
}

fn compared(simulated: ObstacleRule, name: &str, cycles: u64) -> Comparison {
    let source = rooms(ROOM, 1, "{ kind = \"external\" }", simulated).single().source();
    compare(&compile(&source), &source, &exact::policy(name).unwrap(), cycles, 1500).unwrap()
}

#[test]
fn the_comparison_of_the_command_agrees_for_every_law_and_policy() {
    for rule in ObstacleRule::ALL {
        for name in exact::POLICIES {
            let comparison = compared(rule, name, 60);
            assert!(comparison.agrees == Some(true), "{name}, {}: {comparison:?}", rule.name());
        }
    }
}

/// The limit is not so wide that it would let a wrong law pass.
#[test]
fn the_chain_of_another_law_does_not_fit() {
    let tiles = rooms(ROOM, 1, BOUNCE.0, ObstacleRule::Renormalise);
    let cut = rooms(ROOM, 1, BOUNCE.0, ObstacleRule::Cut);
    let chain = model(&cut).chain(&RandomPolicy::bounce()).unwrap();
    let expected = chain.pose_distribution(&chain.stationary().distribution);
    let (observed, samples) = long_run(&tiles, 100, 10);
    let share = |pose| observed.get(pose).copied().unwrap_or(0) as f64 / samples;
    let shares: Vec<f64> = expected.keys().map(share).collect();
    let exact: Vec<f64> = expected.values().copied().collect();
    assert!(total_variation(&exact, &shares) > 3.0 * sampling_limit(&exact, samples, 1e-4));
}

#[test]
fn slow_robots_act_as_seldom_as_their_period_says() {
    let behaviour = "{ kind = \"random\" }\nperiod = 3\nphase = 1";
    let tiles = rooms(ROOM, 1, behaviour, ObstacleRule::Cut);
    let model = model(&tiles);
    // Due in cycles 2, 5, 8 ...
    assert_eq!([0, 2, 3, 5, 6, 9].map(|n| model.actions_in(n)), [0, 0, 1, 1, 2, 3]);
    let chain = model.chain(&RandomPolicy::uniform()).unwrap();
    let mut simulation = tiles.simulation();
    simulation.advance(20);
    let exact = chain.pose_distribution(&chain.distribution_after(model.actions_in(20)));
    assert_fits("period 3", &poses(&tiles, &simulation), &exact);
}

/// A corridor of three boxes by hand: a perfect robot that goes ahead ends at its east wall.
#[test]
fn a_robot_that_always_goes_ahead_ends_at_the_wall() {
    let robots = "effector = \"perfect\"";
    let model = model(&Tiles::new(">..", 1).robots(robots));
    assert_eq!(model.poses().len(), 12);
    let chain = model.chain(&RandomPolicy::always(FORWARD)).unwrap();
    assert_eq!(chain.states().len(), 3);
    let end = GridPose { col: 2, row: 0, heading: 0 };
    let stationary = chain.pose_distribution(&chain.stationary().distribution);
    assert!((stationary[&end] - 1.0).abs() < 1e-9);
    assert_eq!(chain.pose_distribution(&chain.distribution_after(2))[&end], 1.0);
    let summary = model.summary("forward", &RandomPolicy::always(FORWARD), 1).unwrap();
    assert_eq!((summary.most_visited[0].col, summary.chain_states), (2, 3));
    let contact = model.outcome_distribution(end, FORWARD)[0].0.contact;
    assert_eq!(contact, Some((1, Side::Front)));
}

fn refused(text: &str) -> InputError {
    let source = Source::new("s.toml", format!("format = 1\nworld = \"robots\"\n{text}"), "");
    markov_model(&compile(&source)).expect_err(text)
}

#[test]
fn what_is_no_chain_over_one_robot_is_refused_with_what_to_change() {
    let map = "[map]\nascii = \"\"\"\n.....\n.....\n\"\"\"\n";
    let error = refused(&format!("name = \"two\"\n{map}[robots]\ncount = 2\n"));
    assert_eq!((error.place(), error.cause()), ("scenario `two`", "2 robots"));
    assert!(error.remedy().contains("robots.count=1"));
    let error = refused(&format!("{map}[robots]\ncount = 1\n[people]\ncount = 1\n"));
    assert_eq!(error.cause(), "body 1 (kind `person`) moves by itself");
    let door = "[robots]\nat = [[0, 0]]\n[doors]\nat = [[2, 0]]\n";
    let error = refused(&format!("{map}{door}random = {{ p_open = 0.1, p_close = 0.1 }}\n"));
    assert_eq!(error.cause(), "door 1 opens");
    let large = format!(
        "[map]\nascii = \"\"\"\n{}\"\"\"\n[robots]\ncount = 1\n",
        (".".repeat(300) + "\n").repeat(300)
    );
    assert!(refused(&large).cause().contains("more than 200000 poses"));
}

#[test]
fn a_closed_door_is_a_wall_of_its_kind() {
    let text = "format = 1\nworld = \"robots\"\n[map]\nascii = \"\"\"\n.....\n\"\"\"\n[robots]\n\
                at = [[0, 0, 0]]\n[doors]\nat = [[2, 0]]\nperiodic = { open = 0, closed = 1 }\n";
    let model = markov_model(&compile(&Source::new("s.toml", text, ""))).unwrap();
    assert_eq!(model.poses().len(), 8);
    let at_the_door = GridPose { col: 1, row: 0, heading: 0 };
    let door = 2;
    assert_eq!(
        model.outcome_distribution(at_the_door, FORWARD)[0].0.contact,
        Some((door, Side::Front))
    );
}
