//! Runs of chains that meet themselves, judged by recorded positions alone.

use super::*;
use crate::scenario::AnyChainScenario;
use sidestep_rods::geometry::{Point, between_segments, cross, dot, lerp, segments_cross, sub};

const TOLERANCE_M: f64 = 1.1e-9;

fn scenario(text: &str) -> Text {
    Text::new("s.toml", format!("format = 1\nworld = \"chain\"\n{text}"), root())
}

/// A free chain in space on its way to targets drawn at random, with parts thin or thick.
fn wanderings(seed: u64, rods: usize, radius_m: f64) -> String {
    let mut draws = crate::fixtures::TestRng::new(seed);
    let mut targets = Vec::new();
    for _ in 0..8 {
        targets.push(draws.point::<3>(0.2 * rods as f64));
    }
    format!(
        "seed = {seed}\ncycles = 2500\n[chain]\ndimensions = 3\n[[chains]]\nconnectors = {}\nrod_m = 0.3\n\
         radius_m = {radius_m}\nrod_radius_m = {radius_m}\n\
         tasks = [{{ kind = \"targets\", targets_m = {targets:?}, tolerance_m = 0.01, speed_m_s = 0.5 }}]\n",
        rods + 1
    )
}

/// Returns six times the signed volume of the tetrahedron of two rods.
fn volume([[a, b], [c, d]]: [[Point<3>; 2]; 2]) -> f64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a))
}

/// Returns whether two rods pass through each other on the straight way between two records.
fn passes(at: impl Fn(f64) -> [[Point<3>; 2]; 2]) -> bool {
    let sign = volume(at(0.0)).signum();
    if volume(at(1.0)).signum() == sign {
        return false;
    }
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if volume(at(middle)).signum() == sign {
            low = middle;
        } else {
            high = middle;
        }
    }
    let [one, other] = at(high);
    let normal = cross(sub(one[1], one[0]), sub(other[1], other[0]));
    let drop = (0..3).max_by(|i, j| normal[*i].abs().total_cmp(&normal[*j].abs())).unwrap();
    let flat = |p: Point<3>| [p[(drop + 1) % 3], p[(drop + 2) % 3]];
    segments_cross(one.map(flat), other.map(flat))
}

#[test]
fn no_chain_in_space_overlaps_or_passes_through_itself() {
    for (seed, rods, radius_m) in
        [(1, 6, 0.02), (2, 4, 0.06), (3, 6, 0.02), (4, 12, 0.01), (5, 25, 0.04), (6, 9, 0.002)]
    {
        let source = scenario(&wanderings(seed, rods, radius_m));
        let compiled = ChainScenario::<3>::new(&source).unwrap_or_else(|error| panic!("{error}"));
        let mut run = compiled.start(&source, 1);
        let mut before = run.state().body(0).chain.points().to_vec();
        while run.cycle() < 2500 && !run.is_over() {
            run.advance(1);
            let after = run.state().body(0).chain.points().to_vec();
            for i in 0..rods {
                for j in i + 2..rods {
                    let at = |time: f64| {
                        [i, j].map(|rod| [rod, rod + 1].map(|k| lerp(before[k], after[k], time)))
                    };
                    let [one, other] = at(1.0);
                    let apart_m = between_segments(one, other).distance_m;
                    let least_m = (2.0 * radius_m).min(0.3) - TOLERANCE_M;
                    let what = format!("seed {seed}, cycle {}, rods {i} and {j}", run.cycle());
                    assert!(apart_m >= least_m - 2e-6, "{what}: {apart_m} m");
                    assert!(!passes(at), "{what} pass through each other");
                }
            }
            before = after;
        }
        let tally = run.world().chain_metrics(run.state(), 0).tally;
        assert_eq!((tally.penetrations, tally.done > 0), (0, true), "seed {seed}");
    }
}

#[test]
fn a_chain_that_overlaps_at_the_start_is_refused_with_the_parts_and_the_depth() {
    let crossed = |rules: &str| {
        format!(
            "[chain]\n{rules}\n[[chains]]\npoints_m = [[0, 0], [1, 0], [1, 1], [0.5, -0.5]]\n\
             rod_m = [0.5, 2.0]\nradius_m = 0.05\nrod_radius_m = 0.02\ntasks = [{{ kind = \"rest\" }}]\n"
        )
    };
    let error = ChainScenario::<2>::new(&scenario(&crossed(""))).expect_err("it overlaps");
    let error = error.to_string();
    assert!(error.contains("rod 0 4.000e-2 m deep in its rod 2"), "{error}");
    for remedy in ["self_collision = false", "may_start_inside = true"] {
        let source = scenario(&crossed(remedy));
        let compiled = AnyChainScenario::new(&source).unwrap_or_else(|error| panic!("{error}"));
        let AnyChainScenario::Plane(compiled) = compiled else { panic!("in the plane") };
        let remarks = crate::remarks::remarks(&compiled);
        let is_told = remarks.iter().any(|told| told.words.contains("4.000e-2 m deep"));
        assert_eq!(is_told, remedy == "may_start_inside = true", "{remarks:?}");
    }
}

/// Targets around a base in a box, to some of which the base has to lead.
#[test]
fn no_part_of_a_held_chain_is_faster_than_its_joints_may_be_whichever_leads() {
    for mobility in [
        "{ in_box = [[-1.0, -0.5], [1.0, 0.0]] }",
        "{ on_segment = [[-3.0, 0.0], [3.0, 0.0]] }",
        "\"fixed\"",
    ] {
        let mut run = run(&format!(
            "cycles = 6000\n[chain]\njoint_speed_m_s = 0.8\n[[chains]]\nconnectors = 6\nat_m = [0.0, 1.5]\n\
             along = [0.0, -1.0]\nrod_m = 0.3\nradius_m = 0.02\nrod_radius_m = 0.01\n\
             limits = [{{ connector = 5, mobility = {mobility} }}]\n\
             [[chains.tasks]]\nkind = \"targets\"\ntolerance_m = 0.005\n\
             targets_m = [[0.18, 0.34], [-1.2, 0.55], [-1.3, -0.07], [-0.38, 1.02], [0.3, 0.2], [1.0, 0.6]]\n"
        ));
        let mut before = run.state().body(0).chain.points().to_vec();
        while run.cycle() < 6000 && !run.is_over() {
            run.advance(1);
            let after = run.state().body(0).chain.points().to_vec();
            for (k, (from, to)) in before.iter().zip(&after).enumerate() {
                let speed_m_s = distance(*from, *to) / 0.02;
                assert!(speed_m_s <= 0.8 + 1e-6, "{mobility}, connector {k}: {speed_m_s} m/s");
            }
            before = after;
        }
        assert!(run.is_over(), "{mobility}");
        assert_eq!(run.world().chain_metrics(run.state(), 0).progress, 1.0, "{mobility}");
    }
}

/// Asserts that a run keeps all connectors within a speed, and returns its events.
fn events_within_speed(run: &mut ChainRun<2>, cycles: u64, most_m_s: f64) -> Vec<(String, f64)> {
    let mut events = Vec::new();
    let mut before = run.state().body(0).chain.points().to_vec();
    for cycle in 0..cycles {
        if run.is_over() {
            break;
        }
        events.extend(told(run, cycle + 1));
        let after = run.state().body(0).chain.points().to_vec();
        for (k, (from, to)) in before.iter().zip(&after).enumerate() {
            let speed_m_s = distance(*from, *to) / 0.02;
            assert!(speed_m_s <= most_m_s + 1e-6, "cycle {cycle}, connector {k}: {speed_m_s} m/s");
        }
        before = after;
    }
    events
}

/// A free chain that winds about itself among targets on all sides.
#[test]
fn no_part_of_a_free_chain_is_faster_than_it_may_be() {
    let mut draws = crate::fixtures::TestRng::new(3);
    let targets: Vec<_> = (0..10).map(|_| draws.point::<2>(1.5)).collect();
    let mut run = run(&format!(
        "cycles = 9000\n[chain]\njoint_speed_m_s = 0.7\n[[chains]]\nconnectors = 16\nrod_m = 0.3\n\
         radius_m = 0.04\nrod_radius_m = 0.02\n\
         tasks = [{{ kind = \"targets\", targets_m = {targets:?}, tolerance_m = 0.01, speed_m_s = 0.5 }}]\n"
    ));
    events_within_speed(&mut run, 9000, 0.7);
    assert!(run.is_over());
    assert_eq!(run.world().chain_metrics(run.state(), 0).progress, 1.0);
}

#[test]
fn a_path_is_planned_at_once_where_the_straight_way_leads_through_the_chain() {
    // A hook whose tip is on one side of its shaft.
    let hook = |target: &str, planner: &str| {
        run(&format!(
            "cycles = 2000\n[[chains]]\npoints_m = [[0.6, 0.5], [0.9, 0.5], [0.9, 0.2], [0.6, 0.2], [0.3, 0.2], [0, 0.2]]\n\
             rod_m = [0.29, 0.31]\nradius_m = 0.02\nrod_radius_m = 0.01\n\
             limits = [{{ connector = 5, mobility = \"fixed\" }}]\n\
             tasks = [{{ kind = \"targets\", targets_m = [{target}], tolerance_m = 0.01, {planner} }}]\n"
        ))
    };
    let first_plan = |target: &str| {
        let mut run = hook(target, "planner = \"rrt-connect\"");
        count(&told(&mut run, 1), "planned")
    };
    assert_eq!(first_plan("[0.6, -0.3]"), 1, "its shaft is in between");
    assert_eq!(first_plan("[0.6, 0.7]"), 0, "nothing is");
    assert_eq!(count(&told(&mut hook("[0.6, -0.3]", "planner = \"none\""), 1), "planned"), 0);
    let mut run = hook("[0.6, -0.3]", "planner = \"rrt-connect\"");
    events_within_speed(&mut run, 2000, 1.0);
    assert_eq!(run.world().chain_metrics(run.state(), 0).progress, 1.0);
}

#[test]
fn nothing_is_planned_for_a_chain_of_short_rods_that_is_in_nobodys_way() {
    let text = "seed = 1\ncycles = 300\n[[chains]]\nconnectors = 8\nat_m = [0.0, 0.0]\nrod_m = 0.1\nradius_m = 0.08\n\
                rod_radius_m = 0.04\ntasks = [{ kind = \"targets\", targets_m = [[1.0, 0.0]], speed_m_s = 0.5 }]\n";
    let mut run = super::run(text);
    run.advance(300);
    let metrics = run.metrics();
    assert_eq!((metrics.progress, metrics.rungs.planned), (1.0, 0));
}

/// The rest of a long chain follows its start later; that must not show, whenever the chain is read.
#[test]
fn a_long_chain_that_is_read_in_each_cycle_is_as_one_that_is_read_at_the_end() {
    let text = "seed = 1\ncycles = 900\n[chain]\ndimensions = 3\ndt_s = 0.02\n[[chains]]\nconnectors = 400\n\
                rod_m = 0.1\nradius_m = 0.02\nrod_radius_m = 0.008\n\
                tasks = [{ kind = \"targets\", speed_m_s = 0.5, \
                targets_m = [[2.0, 0.5, 0.0], [1.0, 3.0, 1.0], [-4.0, 3.0, 0.5], [-4.0, -0.3, 0.0]] }]\n";
    let source = scenario(text);
    let start = || match AnyChainScenario::new(&source).expect("a scenario") {
        AnyChainScenario::Space(scenario) => scenario.start(&source, 1),
        AnyChainScenario::Plane(_) => panic!("it is in space"),
    };
    let mut at_the_end = start();
    at_the_end.advance(900);
    let mut in_each_cycle = start();
    let mut followed_later = 0;
    for _ in 0..900 {
        in_each_cycle.advance(1);
        let state = in_each_cycle.state();
        followed_later += u32::from(!state.body_before_deferred_motions(0).deferred.is_empty());
        state.apply_deferred_motions();
    }
    assert!(followed_later > 600, "{followed_later}");
    assert_eq!(at_the_end.digest(), in_each_cycle.digest());
    let moved = |run: &ChainRun<3>| {
        let body = run.state().body(0);
        let tally = &body.tally;
        (tally.moved, tally.max_slave_step_m.to_bits(), tally.max_rod_violation_m.to_bits())
    };
    assert_eq!(moved(&at_the_end), moved(&in_each_cycle));
}
