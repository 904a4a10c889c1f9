//! L1: no two bodies in one box, no body in a wall; no door closes on a body.

use crate::common::{CROWD, simulation, source};
use proptest::prelude::*;
use sidestep::worlds::robots::RobotsRun;
use sidestep_kernel::Simulation;

fn run_audited(mut run: RobotsRun, cycles: u64) -> RobotsRun {
    for _ in 0..cycles {
        run.advance(1);
        run.world().audit(run.state()).unwrap_or_else(|e| panic!("cycle {}: {e}", run.cycle()));
    }
    run
}

/// 90 bodies, 12 doors and 12,000 cycles: over a million crowded body-cycles, each audited.
#[test]
fn a_million_crowded_body_cycles_share_no_box() {
    let mut body_cycles = 0;
    for law in ["cut", "stay", "renormalise"] {
        let source = source(CROWD, &[&format!("obstacle_rule='{law}'")]);
        let run = run_audited(simulation(&source, 2), 4_000);
        body_cycles += run.world().bodies.len() as u64 * run.cycle();
        assert!(run.metrics().largest_group > 8, "the crowd is a crowd");
    }
    assert!(body_cycles > 1_000_000);
}

/// Two robots in a corridor one box wide, head to head: they never get past each other.
#[test]
fn head_on_robots_never_swap() {
    let text = r#"
format = 1
world = "robots"
obstacle_rule = "cut"
[map]
ascii = "............"
[[robots]]
at = [[0, 0, 0]]
effector = "slips"
behaviour = { kind = "replay", actions = ["forward"], repeat = true }
[[robots]]
at = [[11, 0, 2]]
effector = "slips"
behaviour = { kind = "replay", actions = ["forward"], repeat = true }
[effectors.slips]
forward = [{ p = 0.5, path = "F" }, { p = 0.5, path = "FF" }]
"#;
    for seed in 0..50 {
        let source = source(text, &[&format!("seed={seed}")]);
        let run = run_audited(simulation(&source, 2), 40);
        let bodies = run.snapshot().bodies;
        assert_eq!(bodies[0].at.0 + 1, bodies[1].at.0, "they meet and stay");
        assert!(run.metrics().total.contacts > 0);
    }
}

/// Robots that cross diagonally through each other's paths (`FL` against `FR`, slips of two
/// boxes), from all relative places: the audit finds no shared box, whichever goes first.
#[test]
fn diagonal_crossings_and_two_box_slips_never_collide() {
    for (dx, dy) in (0..4).flat_map(|x| (0..4).map(move |y| (x, y))).filter(|p| *p != (0, 0)) {
        for seed in 0..6 {
            let text = format!(
                r#"
format = 1
world = "robots"
seed = {seed}
[map]
ascii = """
............
............
............
............
............
............
............
............
"""
[[robots]]
at = [[4, 2, 0], [{}, {}, 3]]
effector = "wild"
behaviour = {{ kind = "replay", actions = ["forward", "forward", "left"], repeat = true }}
[effectors.wild]
forward = [{{ p = 0.3, path = "FL" }}, {{ p = 0.3, path = "FR" }}, {{ p = 0.4, path = "FF" }}]
"#,
                4 + dx,
                2 + dy
            );
            run_audited(simulation(&source(&text, &[]), 2), 30);
        }
    }
}

#[test]
fn a_door_waits_for_whoever_stands_in_it() {
    let text = r#"
format = 1
world = "robots"
[map]
ascii = "....."
[robots]
at = [[0, 0, 0]]
behaviour = { kind = "replay", actions = ["forward", "forward"] }
[doors]
at = [[2, 0]]
periodic = { open = 5, closed = 5, phase = 0 }
"#;
    let run = run_audited(simulation(&source(text, &[]), 1), 40);
    let bodies = run.snapshot().bodies;
    assert_eq!(bodies[0].at, (2, 0), "the robot stopped in the doorway");
    assert!(bodies[1].facing.is_open(), "the door has been waiting since");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    /// Any crowd on any small map obeys the laws, and gives one digest for 1 and 3 workers.
    #[test]
    fn random_crowds_obey_the_laws(
        walls in prop::collection::vec(any::<bool>(), 12 * 12),
        seed in 0u64..1000,
        robots in 1u32..12,
        people in 0u32..8,
        size in 1u32..3,
        policy in prop::sample::select(vec!["random", "fixed", "right_of_way", "rounds", "simultaneous"]),
    ) {
        let rows: Vec<String> = walls
            .chunks(12)
            .map(|r| r.iter().map(|&w| if w && size == 1 { '#' } else { '.' }).collect())
            .collect();
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nconflict_policy = \"{policy}\"\n\
             [map]\nascii = \"\"\"\n{}\n\"\"\"\n\
             [robots]\ncount = {robots}\nsize = {size}\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
             [people]\ncount = {people}\n",
            rows.join("\n")
        );
        let source = source(&text, &[]);
        let compiled = sidestep::worlds::robots::scenario::Compiled::new(
            &source,
            &Default::default(),
            Default::default(),
        );
        prop_assume!(compiled.is_ok());
        let alone = run_audited(simulation(&source, 1), 25).digest();
        prop_assert_eq!(run_audited(simulation(&source, 3), 25).digest(), alone);
    }
}
