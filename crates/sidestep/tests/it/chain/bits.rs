//! The same bits however a run is made, and on every machine.

use super::*;
use sidestep::kernel::control::ControlLog;

#[test]
fn chains_that_meet_have_the_same_bits_however_they_are_run() {
    assert_d1::<2>(SEVERAL, 120, &[0, 1, 37, 74, 119, 120]);
}

#[test]
fn a_chain_that_dodges_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(DODGING, 100, &[0, 1, 33, 99]);
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", "dt_s = 0.05\nescape = \"touch\""), 100, &[50]);
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", "dt_s = 0.05\nescape = \"off\""), 100, &[50]);
    let literal = "dt_s = 0.05\nescape_by = \"literal\"";
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", literal), 100, &[33]);
}

/// Discs close like tongs; the chain is on its way through one of them when the run is resumed.
#[test]
fn a_chain_that_is_caught_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(CAUGHT, 160, &[0, 80, 90, 100, 110, 120, 159]);
}

#[test]
fn a_swarm_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(SWARM, 250, &[0, 1, 100, 249]);
}

#[test]
fn a_snake_in_space_has_the_same_bits_however_it_is_run() {
    assert_d1::<3>(SNAKE, 100, &[0, 1, 50, 99]);
}

/// Before, in and after the cycles in which it breaks, is joined, and something fails.
#[test]
fn broken_chains_and_changes_have_the_same_bits_however_they_are_run() {
    assert_d1::<2>(BROKEN, 120, &[9, 10, 11, 19, 20, 21, 40, 80]);
    assert_d1::<2>(REPORTING, 400, &[0, 39, 40, 41, 60, 61, 200]);
}

/// Something is to be replayed before the cycle after the last, so that cycles are counted up to the end and no further.
#[test]
fn a_run_that_is_over_where_a_replay_is_due_ends_there() {
    for text in [BROKEN, PLANNED] {
        let mut alone = run::<2>(&source(3, text), 1);
        alone.advance(1000);
        assert!(alone.is_over() && alone.cycle() < 1000, "{text}");
        let mut replayed = run::<2>(&source(3, text), 1);
        let mut controls = ControlLog::default();
        controls.add(alone.cycle(), []);
        replayed.replay_controls(controls);
        assert_eq!(replayed.advance(1000), alone.cycle(), "{text}");
        assert_eq!(replayed.digest(), alone.digest(), "{text}");
    }
}

#[test]
fn a_chain_that_follows_several_motions_at_once_has_the_same_bits_however_it_is_run() {
    assert_d1::<3>(OPEN, 300, &[0, 1, 7, 79, 80, 95, 121, 200, 299]);
    assert_d1::<2>(COILED, 200, &[0, 1, 99]);
}

/// With a limit of sub-steps, though it has no effect, every motion is made by itself; with a pebble
/// far away every part is looked at, in sub-steps, which are the same with a limit of them. All results are the same.
#[test]
fn what_is_put_off_or_proven_is_what_single_motions_do() {
    let single = OPEN.replace("[chain]", "[chain]\nstep_m = 1.0");
    let coiled = COILED.replace("[chain]", "[chain]\nstep_m = 0.005");
    let pebble = format!("{coiled}\n[[obstacles]]\nat_m = [900.0, 900.0]\nradius_m = 0.1\n");
    for seed in 0..6 {
        assert_same_end::<3>(seed, OPEN, &single, 300);
        assert_same_end::<2>(seed, &coiled, &pebble, 200);
    }
}

/// Returns whether two scenarios lead the first chain to the same places with the same counts.
fn assert_same_end<const D: usize>(seed: u64, one: &str, other: &str, cycles: u64) {
    let [one, other] = [one, other].map(|text| {
        let mut run = run::<D>(&source(seed, text), 1);
        advance_to(&mut run, cycles);
        let points: Vec<_> = run.state().body(0).chain.points().to_vec();
        (points, run.world().chain_metrics(run.state(), 0))
    });
    assert_eq!(one.0, other.0, "{seed}");
    let counts =
        |m: &ChainMetrics| (m.tally.moved, m.tally.max_slave_step_m, m.tally.max_speed_m_s);
    assert_eq!(counts(&one.1), counts(&other.1), "{seed}");
    assert_eq!(one.1.tally.way_m, other.1.tally.way_m, "{seed}");
}

#[test]
fn an_arm_that_follows_a_plan_reaches_its_target_and_has_the_same_bits_however_it_is_run() {
    let mut run = run::<2>(&source(3, PLANNED), 1);
    advance_to(&mut run, 1000);
    let metrics = run.metrics();
    assert_eq!((metrics.progress, metrics.penetrations), (1.0, 0), "{metrics:?}");
    assert!(metrics.rungs.planned >= 1, "{metrics:?}");
    assert!(metrics.max_speed_m_s <= 1.0 + 1e-9, "no joint is faster than twice the tool");
    let end = run.cycle();
    assert_d1::<2>(PLANNED, 1000, &[0, end / 4, end / 2, end - 10]);
}

#[test]
fn another_seed_is_another_run_and_a_checkpoint_of_it_is_refused() {
    let [a, b] = [1, 2].map(|seed| {
        let mut run = run::<2>(&source(seed, SEVERAL), 1);
        run.advance(20);
        run
    });
    assert_ne!(a.digest(), b.digest());
    let refused = run::<2>(&source(2, SEVERAL), 1).restore(&a.checkpoint());
    assert!(refused.expect_err("another seed").to_string().contains("scenario"));
}

/// Wherever this is run, the bits must be these (D3); a change needs a line in the CHANGELOG
/// (D4), and the lines that this prints in the file.
#[test]
fn the_golden_digests_of_chains_are_what_every_machine_gets() {
    fn digest<const D: usize>(name: &str, text: &str) -> String {
        let mut run = run::<D>(&source(1, text), 2);
        advance_to(&mut run, 150);
        format!("{name} {}\n", run.digest())
    }
    let found = digest::<2>("several", SEVERAL)
        + &digest::<2>("dodging", DODGING)
        + &digest::<2>("swarm", SWARM)
        + &digest::<3>("snake", SNAKE)
        + &digest::<2>("broken", BROKEN)
        + &digest::<2>("told", REPORTING);
    assert_eq!(found, include_str!("../golden/serpentine.txt"), "found:\n{found}");
}

/// Two arms of one model with tools that pass each other; a plan is followed when the run is resumed.
#[test]
fn arms_of_joints_have_the_same_bits_however_they_are_run() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain/arm.urdf");
    let arm = |at: &str, target: &str| {
        format!(
            "[[chains]]\narm = {{ urdf = {file:?}, joints = [0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0] }}\nat_m = {at}\n\
             radius_m = 0.05\n[[chains.tasks]]\nkind = \"targets\"\nconnector = 3\nspeed_m_s = 0.4\n\
             targets_m = [{target}]\nplans_after_s = 0.1\n"
        )
    };
    let pillar = "[[obstacles]]\nends_m = [[0.45, 0.0, 0.0], [0.45, 0.0, 0.5]]\nradius_m = 0.06\n";
    let text = format!(
        "[chain]\ndimensions = 3\n{pillar}{}{}",
        arm("[0.0, 0.0, 0.0]", "[0.4, 0.35, 0.45], [0.4, -0.35, 0.45]"),
        arm("[0.9, 0.0, 0.0]", "[0.5, 0.35, 0.45]"),
    );
    assert_d1::<3>(&text, 300, &[0, 1, 60, 120, 180, 240, 299]);
    let mut run = run::<3>(&source(1, &text), 1);
    advance_to(&mut run, 300);
    let arms = [0, 1].map(|slot| run.world().chain_metrics(run.state(), slot));
    assert!(arms.iter().any(|arm| arm.tally.rungs.planned > 0), "one plans");
}
