//! Promise L1: a blocked path has the outcome that the law of the scenario gives, in the
//! simulator and in the exact computation, for every shape of obstacle.
//!
//! Every table below was computed by hand. The effector `nomad` goes ahead with 0.88, stays
//! with 0.04, slips two boxes with 0.02, and drifts to the left or the right of the box ahead
//! with 0.03 each.

use super::tiles::{PERSON, Tiles, WALL, assert_fits, law, repeating};
use proptest::prelude::*;
use sidestep::error_models::effector::ObstacleRule::{self, Cut, Renormalise, Stay};
use sidestep::error_models::effector::Side::{self, Front, Left, Right};
use sidestep::error_models::effector::Transition;
use sidestep::exact::{ActionOutcome, GridPose, outcome_distribution};
use sidestep::kernel::Simulation;
use sidestep::worlds::robots::exact::markov_model;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use std::collections::BTreeMap;

/// Tiles per side: 6400 robots.
const ACROSS: u32 = 80;

/// Effectors of these tests.
const EFFECTORS: &str = r#"
[effectors.drifting]
forward = [{ p = 1.0, path = "F" }]
left = [{ p = 0.7, turn = 90 }, { p = 0.2, path = "L", turn = 90 }, { p = 0.1, path = "F" }]
[effectors.weaving]
forward = [{ p = 0.5, path = "FL" }, { p = 0.3, path = "LF" }, { p = 0.2, path = "F" }]
[effectors.slipping]
forward = [{ p = 0.5, path = "FF" }, { p = 0.5, path = "FL" }]
[effectors.sidling]
forward = [{ p = 0.4, path = "L" }, { p = 0.6, path = "F" }]
[effectors.rocking]
forward = [{ p = 0.6, path = "FB" }, { p = 0.4, path = "F" }]
"#;

/// Columns east, rows north, quarter turns to the left, contact, probability.
type Row = (i32, i32, u8, Option<(u8, Side)>, f64);

const fn free(east: i32, north: i32, p: f64) -> Row {
    (east, north, 0, None, p)
}

const fn wall(east: i32, north: i32, side: Side, p: f64) -> Row {
    (east, north, 0, Some((WALL, side)), p)
}

fn tiles(art: &str, size: u32, effector: &str, action: &str, rule: ObstacleRule) -> Tiles {
    let robots = format!("size = {size}\neffector = \"{effector}\"\n{}", repeating(action));
    Tiles::new(art, ACROSS).keys(&law(rule)).sections(EFFECTORS).robots(&robots)
}

/// Holds the table against the exact computation, to the last digit, and against 6400 robots
/// of the simulator.
fn check(tiles: &Tiles, rows: &[Row]) {
    let start = tiles.start();
    let outcome = |&(east, north, turn, contact, p): &Row| {
        let heading = (start.heading + turn) % 4;
        let pose = GridPose { col: start.col + east, row: start.row + north, heading };
        (ActionOutcome { pose, contact }, p)
    };
    let by_hand: BTreeMap<ActionOutcome, f64> = rows.iter().map(outcome).collect();
    assert!((by_hand.values().sum::<f64>() - 1.0).abs() < 1e-12, "the table sums to 1");
    check_exact(tiles, &by_hand);
    let mut simulation = tiles.simulation();
    simulation.advance(1);
    assert_fits(&format!("{tiles:?}"), &tiles.outcomes(&simulation), &by_hand);
}

fn check_exact(tiles: &Tiles, by_hand: &BTreeMap<ActionOutcome, f64>) {
    let (transitions, size, rule) = action_of(tiles);
    let kind_at = |col, row| tiles.kind_at(col, row);
    let exact: BTreeMap<ActionOutcome, f64> =
        outcome_distribution(&transitions, size, tiles.start(), rule, kind_at)
            .into_iter()
            .collect();
    assert_eq!(
        exact.keys().collect::<Vec<_>>(),
        by_hand.keys().collect::<Vec<_>>(),
        "outcomes of {tiles:?}"
    );
    let largest = exact.iter().map(|(o, p)| (p - by_hand[o]).abs()).fold(0.0, f64::max);
    assert!(largest < 1e-12, "{tiles:?}: off by {largest}: {exact:?}");
}

/// The actions that the scenario's robots try, as data.
fn action_of(tiles: &Tiles) -> (Vec<Transition>, u32, ObstacleRule) {
    use sidestep::worlds::robots::world::Role;
    let compiled = compile(&tiles.single());
    let world = &compiled.world;
    let ty = world.type_of(world.robots()[0]);
    let Role::Robot(model) = &ty.role else { panic!("robots are robots") };
    let action = u8::from(tiles.source().text.contains("actions = [\"left\"]"));
    let transitions = model.body.effector.transitions_of(action, false);
    (transitions, ty.size.0, world.obstacle_rule)
}

fn compile(tiles: &Tiles) -> Compiled {
    Compiled::new(&tiles.source(), &Behaviours::new(), StorageOrder::ById)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// A case under the three laws.
fn check_laws(art: &str, size: u32, effector: &str, action: &str, tables: [&[Row]; 3]) {
    for (rule, rows) in [Cut, Stay, Renormalise].into_iter().zip(tables) {
        check(&tiles(art, size, effector, action, rule), rows);
    }
}

#[test]
fn in_a_free_place_every_law_leaves_the_transitions_as_they_are() {
    let rows =
        [free(0, 1, 0.88), free(0, 0, 0.04), free(0, 2, 0.02), free(-1, 1, 0.03), free(1, 1, 0.03)];
    check_laws("..... ..... ..... ..^..", 1, "nomad", "forward", [&rows; 3]);
}

#[test]
fn a_wall_ahead_blocks_all_that_goes_ahead() {
    let in_place = [wall(0, 0, Front, 0.96), free(0, 0, 0.04)];
    let tables: [&[Row]; 3] = [&in_place, &in_place, &[free(0, 0, 1.0)]];
    check_laws("..... ..#.. ..^..", 1, "nomad", "forward", tables);
}

#[test]
fn a_person_ahead_is_touched_as_a_person() {
    let in_place = [(0, 0, 0, Some((PERSON, Front)), 0.96), free(0, 0, 0.04)];
    let tables: [&[Row]; 3] = [&in_place, &in_place, &[free(0, 0, 1.0)]];
    check_laws("..... ..P.. ..^..", 1, "nomad", "forward", tables);
}

#[test]
fn a_wall_two_ahead_stops_only_the_slip() {
    let others = |share: f64| {
        [
            free(0, 1, 0.88 / share),
            free(0, 0, 0.04 / share),
            free(-1, 1, 0.03 / share),
            free(1, 1, 0.03 / share),
        ]
    };
    let cut = [&others(1.0)[..], &[wall(0, 1, Front, 0.02)]].concat();
    let stay = [&others(1.0)[..], &[wall(0, 0, Front, 0.02)]].concat();
    let art = "..#.. ..... ..^..";
    check_laws(art, 1, "nomad", "forward", [&cut, &stay, &others(0.98)]);
}

#[test]
fn a_wall_left_of_the_box_ahead_stops_only_the_drift() {
    let others = |share: f64| {
        [
            free(0, 1, 0.88 / share),
            free(0, 0, 0.04 / share),
            free(0, 2, 0.02 / share),
            free(1, 1, 0.03 / share),
        ]
    };
    let cut = [&others(1.0)[..], &[wall(0, 1, Left, 0.03)]].concat();
    let stay = [&others(1.0)[..], &[wall(0, 0, Left, 0.03)]].concat();
    let art = "..... .#... ..^..";
    check_laws(art, 1, "nomad", "forward", [&cut, &stay, &others(0.97)]);
}

#[test]
fn in_a_corner_slip_and_one_drift_end_at_different_sides() {
    let others = |share: f64| {
        [free(0, 1, 0.88 / share), free(0, 0, 0.04 / share), free(-1, 1, 0.03 / share)]
    };
    let cut = [&others(1.0)[..], &[wall(0, 1, Front, 0.02), wall(0, 1, Right, 0.03)]].concat();
    let stay = [&others(1.0)[..], &[wall(0, 0, Front, 0.02), wall(0, 0, Right, 0.03)]].concat();
    let art = "..### ...#. ..^..";
    check_laws(art, 1, "nomad", "forward", [&cut, &stay, &others(0.95)]);
}

#[test]
fn in_a_dead_end_every_drift_and_slip_is_a_contact() {
    let others = |share: f64| [free(0, 1, 0.88 / share), free(0, 0, 0.04 / share)];
    let contacts = |north| {
        [wall(0, north, Front, 0.02), wall(0, north, Left, 0.03), wall(0, north, Right, 0.03)]
    };
    let cut = [&others(1.0)[..], &contacts(1)].concat();
    let stay = [&others(1.0)[..], &contacts(0)].concat();
    let art = "..###.. ..#.#.. ..#^#..";
    check_laws(art, 1, "nomad", "forward", [&cut, &stay, &others(0.92)]);
}

#[test]
fn with_nothing_left_the_first_transition_is_the_contact() {
    let certain = [wall(0, 0, Front, 1.0)];
    check_laws("### #^# ###", 1, "slipping", "forward", [&certain; 3]);
    check_laws("### #^# ###", 1, "perfect", "forward", [&certain; 3]);
    let both = [wall(0, 0, Left, 0.4), wall(0, 0, Front, 0.6)];
    let first = [wall(0, 0, Left, 1.0)];
    check_laws("### #^# ###", 1, "sidling", "forward", [&both, &both, &first]);
}

#[test]
fn equal_outcomes_of_different_paths_are_merged() {
    let art = "..... ..... ..^..";
    check_laws(art, 1, "weaving", "forward", [&[free(-1, 1, 0.8), free(0, 1, 0.2)]; 3]);
    let walled = [wall(0, 0, Front, 0.7), free(-1, 1, 0.3)];
    let tables: [&[Row]; 3] = [&walled, &walled, &[free(-1, 1, 1.0)]];
    check_laws("..... ..#.. ..^..", 1, "weaving", "forward", tables);
}

#[test]
fn a_turn_that_drifts_is_not_made_when_the_drift_is_blocked() {
    let turned = (0, 0, 1, None, 0.7);
    let rows = [turned, (-1, 0, 1, None, 0.2), free(0, 1, 0.1)];
    check_laws("..... ..... ..^..", 1, "drifting", "left", [&rows; 3]);
    let blocked = [turned, wall(0, 0, Left, 0.2), free(0, 1, 0.1)];
    let left = [(0, 0, 1, None, 0.7 / 0.8), free(0, 1, 0.1 / 0.8)];
    check_laws("..... ..... .#^..", 1, "drifting", "left", [&blocked, &blocked, &left]);
}

#[test]
fn turns_of_the_nomad_need_no_room() {
    let rows = [(0, 0, 1, None, 0.95), free(0, 0, 0.04), (0, 0, 2, None, 0.01)];
    check_laws("### #>#  ###", 1, "nomad", "left", [&rows; 3]);
}

#[test]
fn one_occupied_box_before_a_wide_body_is_enough() {
    // Heading east; the body covers the box drawn and those north and east of it.
    let in_place = [wall(0, 0, Front, 0.96), free(0, 0, 0.04)];
    let tables: [&[Row]; 3] = [&in_place, &in_place, &[free(0, 0, 1.0)]];
    check_laws("...... ...... ...... .>.#.. ......", 2, "nomad", "forward", tables);
    check_laws("...... ...... ...#.. .>.... ......", 2, "nomad", "forward", tables);
}

#[test]
fn a_wide_body_touches_what_is_leftmost() {
    let cases = [
        ("..... ...#. .>.P.", WALL),
        ("..... ...P. .>.#.", PERSON),
        ("..... .P... .#<..", WALL),
        ("..... .#... .P<..", PERSON),
    ];
    for (art, kind) in cases {
        let rows = [(0, 0, 0, Some((kind, Front)), 0.96), free(0, 0, 0.04)];
        let tables: [&[Row]; 3] = [&rows, &rows, &[free(0, 0, 1.0)]];
        check_laws(art, 2, "nomad", "forward", tables);
    }
}

#[test]
fn a_wide_body_drifts_along_its_whole_side() {
    // After one box ahead (east) the drift to the left enters the two boxes north of it.
    let others = |share: f64| {
        [
            free(1, 0, 0.88 / share),
            free(0, 0, 0.04 / share),
            free(2, 0, 0.02 / share),
            free(1, -1, 0.03 / share),
        ]
    };
    let cut = [&others(1.0)[..], &[wall(1, 0, Left, 0.03)]].concat();
    let stay = [&others(1.0)[..], &[wall(0, 0, Left, 0.03)]].concat();
    let art = "...#... ....... .>..... ....... .......";
    check_laws(art, 2, "nomad", "forward", [&cut, &stay, &others(0.97)]);
}

#[test]
fn a_body_of_three_boxes_heading_west_slips_drifts_and_is_cut() {
    // Walls: two ahead of the middle row, and northwest where only the drift ends.
    let others = |share: f64| {
        [free(-1, 0, 0.88 / share), free(0, 0, 0.04 / share), free(-1, -1, 0.03 / share)]
    };
    let cut = [&others(1.0)[..], &[wall(-1, 0, Front, 0.02), wall(-1, 0, Right, 0.03)]].concat();
    let stay = [&others(1.0)[..], &[wall(0, 0, Front, 0.02), wall(0, 0, Right, 0.03)]].concat();
    let art = "....... ..#.... ....... .#..... ...<... .......";
    check_laws(art, 3, "nomad", "forward", [&cut, &stay, &others(0.95)]);
}

#[test]
fn a_path_that_turns_back_enters_the_boxes_it_has_left() {
    let rows = [free(0, 0, 0.6), free(0, 1, 0.4)];
    check_laws("..... ..... ..... .^...", 2, "rocking", "forward", [&rows; 3]);
}

/// The longest path a scenario may give, on a map that is shorter, at every edge.
#[test]
fn a_path_longer_than_the_map_is_stopped_at_its_edge() {
    let far = format!("[effectors.far]\nforward = [{{ p = 1.0, path = \"{}\" }}]", "F".repeat(16));
    for (start, east, north) in [(">", 2, 0), ("^", 0, 2), ("<", -2, 0), ("v", 0, -2)] {
        let middle = format!("..... ..... ..{start}.. ..... .....");
        let tiles = Tiles::new(&middle, 1)
            .keys(&law(Cut))
            .sections(&far)
            .robots(&format!("effector = \"far\"\n{}", repeating("forward")));
        let mut simulation = tiles.simulation();
        simulation.advance(1);
        let at = tiles.start();
        let pose = GridPose { col: at.col + east, row: at.row + north, ..at };
        let outcome = ActionOutcome { pose, contact: Some((WALL, Front)) };
        assert_eq!(tiles.outcomes(&simulation), BTreeMap::from([(outcome, 1)]));
    }
}

/// Out and back again is a way of two boxes, over a box that was visited.
#[test]
fn a_path_that_ends_where_it_began_counts_as_way_and_visit() {
    let tiles = Tiles::new(".. .. ^.", 1)
        .sections(EFFECTORS)
        .robots(&format!("effector = \"rocking\"\n{}", repeating("forward")))
        .keys("regime = \"reliable\"");
    let mut simulation = tiles.simulation();
    simulation.advance(1);
    let total = simulation.metrics().total;
    assert_eq!((total.distance_m, total.first_visits), (0.5, 1));
}

/// Any effector of up to four transitions, in quarters and eighths.
fn transitions() -> impl Strategy<Value = Vec<Transition>> {
    let side = prop::sample::select(Side::ALL.to_vec());
    let one = (prop::collection::vec(side, 0..4), 0u8..4, 1u32..9);
    prop::collection::vec(one, 1..5).prop_map(|list| {
        let sum: u32 = list.iter().map(|t| t.2).sum();
        let share = |weight| f64::from(weight) / f64::from(sum);
        list.into_iter().map(|(path, turn, w)| Transition { p: share(w), path, turn }).collect()
    })
}

/// Any 9 x 9 place with a free square of `size` boxes in its middle.
fn place(size: u32) -> impl Strategy<Value = Vec<bool>> {
    prop::collection::vec(prop::bool::weighted(0.25), 81).prop_map(move |mut walls| {
        for row in 3..3 + size as usize {
            walls[9 * row + 3..9 * row + 3 + size as usize].fill(false);
        }
        walls
    })
}

fn kind_in(walls: &[bool], col: i32, row: i32) -> u8 {
    let inside = (0..9).contains(&col) && (0..9).contains(&row);
    u8::from(!inside || walls[(9 * row + col) as usize])
}

proptest! {
    #[test]
    fn outcomes_are_a_distribution_over_free_poses(
        (size, walls) in (1u32..4).prop_flat_map(|size| (Just(size), place(size))),
        transitions in transitions(),
        heading in 0u8..4,
        rule in prop::sample::select(ObstacleRule::ALL.to_vec()),
    ) {
        let from = GridPose { col: 3, row: 3, heading };
        let outcomes = outcome_distribution(&transitions, size, from, rule, |c, r| kind_in(&walls, c, r));
        prop_assert!((outcomes.iter().map(|o| o.1).sum::<f64>() - 1.0).abs() < 1e-12);
        for (ActionOutcome { pose, contact }, p) in &outcomes {
            prop_assert!(*p > 0.0);
            let covered = (0..size as i32).flat_map(|y| (0..size as i32).map(move |x| (x, y)));
            for (x, y) in covered {
                prop_assert_eq!(kind_in(&walls, pose.col + x, pose.row + y), 0);
            }
            prop_assert!(contact.is_none() || pose.heading == heading, "a contact is no turn");
            let in_place = (pose.col, pose.row) == (3, 3);
            prop_assert!(contact.is_none() || rule == Cut || in_place);
        }
        if rule == Renormalise {
            let contacts = outcomes.iter().filter(|o| o.0.contact.is_some()).count();
            prop_assert!(contacts == 0 || outcomes.len() == 1);
        }
        prop_assert!(transitions.len() > 1 || outcomes.len() == 1, "what is certain stays certain");
    }

    /// One cycle of the simulator ends in an outcome that the exact model knows.
    #[test]
    fn the_simulator_ends_in_no_other_outcome(
        walls in place(2),
        heading in 0usize..4,
        action in prop::sample::select(vec!["forward", "left", "right", "stay"]),
        rule in prop::sample::select(ObstacleRule::ALL.to_vec()),
        seed in 0u32..1000,
    ) {
        let mut art: Vec<Vec<char>> = walls
            .chunks(9)
            .rev()
            .map(|row| row.iter().map(|&w| if w { '#' } else { '.' }).collect())
            .collect();
        art[5][3] = ['>', '^', '<', 'v'][heading];
        let lines: Vec<String> = art.into_iter().map(|line| line.into_iter().collect()).collect();
        let tiles = tiles(&lines.join("\n"), 2, "nomad", action, rule).single();
        let tiles = tiles.keys(&format!("seed = {seed}"));
        let mut simulation = tiles.simulation();
        let model = markov_model(&compile(&tiles)).expect("one robot");
        simulation.advance(1);
        let ended = tiles.outcomes(&simulation);
        let id = ["forward", "left", "right", "stay"].iter().position(|a| *a == action);
        let possible = model.outcome_distribution(tiles.start(), id.expect("standard") as u8);
        prop_assert!(ended.keys().all(|ended| possible.iter().any(|(o, _)| o == ended)));
    }
}
