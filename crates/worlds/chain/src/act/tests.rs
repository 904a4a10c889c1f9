//! Whole runs of small scenarios: what chains do to each other, and what is told of it.

use crate::ChainRun;
use crate::events::EventKind;
use crate::scenario::ChainScenario;
use sidestep_kernel::Simulation;
use sidestep_kernel::interrupt::Interrupt;
use sidestep_kernel::ports::{ColumnValues, MemoryRecorder, Recorder};
use sidestep_rods::geometry::distance;
use sidestep_rods::{
    Chain, Connector, MotionRequest, Obstacle, Obstacles, Propagator, RequestSource,
    RequestedMotion, Rod, VetoEffect,
};
use sidestep_scenario::Source as Text;
use sidestep_testing::root;
use std::panic::{AssertUnwindSafe, catch_unwind};

mod broken;
mod own_body;

/// Returns a run of a scenario in the plane.
fn run(text: &str) -> ChainRun<2> {
    let source = Text::new("s.toml", format!("format = 1\nworld = \"chain\"\n{text}"), root());
    ChainScenario::new(&source).unwrap_or_else(|error| panic!("{error}")).start(&source, 1)
}

/// Advances a run; returns the names and values of its events.
fn told(run: &mut ChainRun<2>, cycles: u64) -> Vec<(String, f64)> {
    run.start_recording();
    let mut rows = MemoryRecorder::new(&run.schemas());
    while run.cycle() < cycles && !run.is_over() {
        run.advance(1);
        run.record(&mut rows).expect("memory has room");
    }
    rows.finish().expect("memory has room");
    let Some(ColumnValues::Label(kinds)) = rows.column("events", "event") else { panic!("kinds") };
    let Some(ColumnValues::F64(values)) = rows.column("events", "value") else { panic!("values") };
    let name = |kind: &u32| EventKind::ALL[*kind as usize].name().to_owned();
    kinds.iter().map(name).zip(values.iter().copied()).collect()
}

fn count(told: &[(String, f64)], kind: &str) -> usize {
    told.iter().filter(|(of, _)| of == kind).count()
}

/// Two swarms, one of which cannot keep up with its connectors, cross at some angle.
fn crossing(heading_deg: u32) -> String {
    format!(
        "seed = 1\ncycles = 700\n[[chains]]\nconnectors = 2\nat_m = [0.0, 0.0]\nrod_m = [0.8, 1.0]\n\
         robots = {{ radius_m = 0.25, wheel_speed_m_s = 0.05 }}\n\
         tasks = [{{ kind = \"script\", script = \"forward 5\" }}]\n\
         [[chains]]\nconnectors = 2\nat_m = [0.0, -3.0]\nheading_deg = {heading_deg}\nrod_m = [0.8, 1.0]\n\
         robots = {{ radius_m = 0.25 }}\ntasks = [{{ kind = \"script\", script = \"wait 2 forward 6\" }}]\n"
    )
}

#[test]
fn robots_of_different_chains_never_overlap_however_far_they_lag() {
    for heading_deg in [80, 90, 100] {
        let mut run = run(&crossing(heading_deg));
        while run.cycle() < 700 && !run.is_over() {
            run.advance(1);
            let [a, b] = [0, 1].map(|slot| run.state().body(slot).robots.clone());
            let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
            let gap_m = pairs.map(|(a, b)| distance(a.pose.at, b.pose.at) - 0.5);
            let least_m = gap_m.fold(f64::INFINITY, f64::min);
            assert!(least_m > -1e-9, "{heading_deg} deg, cycle {}: {least_m} m", run.cycle());
        }
    }
}

/// A chain whose last connector is held, on its way to places that are too far for it, and maybe to one that is not. The
/// change has no effect; without one these places would be refused.
fn held(targets_m: &str) -> String {
    format!(
        "seed = 1\ncycles = 2000\n[[chains]]\nconnectors = 3\nrod_m = 0.5\n\
         limits = [{{ connector = 2, mobility = \"fixed\" }}]\n\
         changes = [{{ at_s = 0.02, connector = 2, mobility = \"fixed\" }}]\n\
         tasks = [{{ kind = \"targets\", targets_m = {targets_m}, planner = \"none\", patience_s = 1.0 }}]\n"
    )
}

#[test]
fn a_task_none_of_whose_targets_was_reached_is_given_up_and_not_done() {
    let mut none = run(&held("[[10.0, 0.0], [0.0, 10.0]]"));
    let events = told(&mut none, 2000);
    let given_up: Vec<_> = events.iter().filter(|(kind, _)| kind.ends_with("given-up")).collect();
    let expected = [("target-given-up", 0.0), ("target-given-up", 1.0), ("given-up", 0.0)];
    assert_eq!(given_up.len(), 3, "{events:?}");
    for (told, (kind, value)) in given_up.into_iter().zip(expected) {
        assert_eq!((told.0.as_str(), told.1), (kind, value), "{events:?}");
    }
    let tally = none.world().chain_metrics(none.state(), 0).tally;
    assert!(none.is_over() && tally.done == 0 && count(&events, "done") == 0, "{events:?}");

    let mut some = run(&held("[[10.0, 0.0], [-0.5, 0.5]]"));
    let events = told(&mut some, 2000);
    let tally = some.world().chain_metrics(some.state(), 0).tally;
    // The target and its task.
    assert!(some.is_over() && tally.done == 2 && count(&events, "done") == 1, "{events:?}");
}

/// One target is given up after a second; the time of the task ends before another one could be.
#[test]
fn a_task_whose_time_ends_before_it_reached_a_target_is_given_up_and_not_done() {
    let cases = [
        ("[[10.0, 0.0]]", 0.5, 0, "given-up"),
        ("[[10.0, 0.0], [0.0, 10.0]]", 1.5, 0, "given-up"),
        ("[[-0.5, 0.5], [10.0, 0.0]]", 2.3, 1, "done"),
        ("[[10.0, 0.0], [-0.5, 0.5], [0.0, 10.0]]", 3.3, 1, "done"),
    ];
    for (targets_m, lasts_s, reached, ends) in cases {
        let text =
            held(targets_m).replace("patience_s", &format!("lasts_s = {lasts_s}, patience_s"));
        let mut run = run(&text);
        let events = told(&mut run, 2000);
        assert_eq!(count(&events, "target"), reached, "{targets_m}: {events:?}");
        assert_eq!(events.last(), Some(&(ends.to_owned(), 0.0)), "{targets_m}: {events:?}");
        let tally = run.world().chain_metrics(run.state(), 0).tally;
        let is_done = usize::from(ends == "done");
        assert_eq!(tally.done as usize, reached + is_done, "{targets_m}: {events:?}");
    }
}

/// The first task leads out of reach, and its time ends in the cycle in which it is given up.
#[test]
fn a_task_that_is_given_up_as_its_time_ends_leaves_the_next_one_its_own_time() {
    let text = |lasts: &str| {
        let script = "script = \"\"\"forward 10\"\"\"";
        held("[[0.0, 0.0]]").replace(
            "tasks = [",
            &format!(
                "tasks = [{{ kind = \"script\", {script}, patience_s = 1.0{lasts} }}, {{ kind = \"rest\", lasts_s = 1.0 }},"
            ),
        )
    };
    let given_up = |lasts: &str| {
        let mut run = run(&text(lasts));
        while run.state().body(0).driving.task == 0 {
            run.advance(1);
        }
        let cycles = run.cycle();
        while run.state().body(0).driving.task == 1 {
            run.advance(1);
        }
        (cycles, run.cycle() - cycles)
    };
    let (cycles, rests) = given_up("");
    assert!(cycles > 50 && rests == 50, "{cycles}, {rests}");
    let lasts = format!(", lasts_s = {}", 0.02 * (cycles as f64 - 0.5));
    assert_eq!(given_up(&lasts), (cycles, 50));
}

/// A corridor that ends where it begins.
#[test]
fn a_navigator_goes_round_a_corridor_that_comes_back_to_its_start() {
    let legs = "{ straight_m = 10 }, { radius_m = 3, turn_deg = 180 }";
    let mut run = run(&format!(
        "seed = 1\ncycles = 500\n[ground]\ncorridor = {{ width_m = 2.0, legs = [{legs}, {legs}] }}\n\
         [[chains]]\nconnectors = 1\nat_m = [-0.2, 0.0]\nrod_m = 0.5\ntasks = [{{ kind = \"navigate\" }}]\n"
    ));
    let events = told(&mut run, 500);
    assert!(!run.is_over() && count(&events, "done") == 0, "{events:?}");
    let (progress, at) = (run.metrics().progress, run.state().body(0).chain.points()[0]);
    assert!(at[0] > 1.0 && (0.02..0.5).contains(&progress), "{progress} at {at:?}");
}

/// A lift whose joint can bring its ends together, and a hinge on it.
const LIFT: &str = "<robot name='lift'><link name='base'/><link name='c'/><link name='a'/><link name='b'/>\
    <link name='tool'/>\
    <joint name='lift' type='prismatic'><parent link='base'/><child link='c'/><axis xyz='0 0 1'/>\
    <limit lower='0' upper='0.6' velocity='0.5'/></joint>\
    <joint name='j1' type='revolute'><parent link='c'/><child link='a'/><axis xyz='0 0 1'/>\
    <limit lower='-2.5' upper='2.5' velocity='3'/></joint>\
    <joint name='j2' type='revolute'><parent link='a'/><child link='b'/><origin xyz='0.4 0 0'/><axis xyz='0 0 1'/>\
    <limit lower='-2.5' upper='2.5' velocity='3'/></joint>\
    <joint name='tip' type='fixed'><parent link='b'/><child link='tool'/><origin xyz='0.3 0 0'/></joint></robot>";

fn lift(target_m: &str, more: &str) -> ChainScenario<3> {
    let text = format!(
        "format = 1\nworld = \"chain\"\nseed = 1\ncycles = 250\n[chain]\ndimensions = 3\n{more}\n[[chains]]\n\
         arm = {{ urdf_text = \"{LIFT}\", joints = [0.3, 0.5, 0.5] }}\nradius_m = 0.03\n[[chains.tasks]]\n\
         kind = \"targets\"\nconnector = 3\ntargets_m = [{target_m}]\nspeed_m_s = 0.3\n"
    );
    ChainScenario::new(&Text::new("s.toml", text, "")).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_joint_that_can_close_its_rod_does_not_shorten_the_steps_of_an_arm() {
    let step_m = lift("[0.4, 0.3, 0.45]", "").world.chains[0].start.step_m();
    assert!(step_m >= 0.005, "{step_m}");
}

/// A pole is in the way, so the arm has to plan.
#[test]
fn an_arm_whose_rod_can_close_plans_like_any_other() {
    let pole = "[[obstacles]]\nends_m = [[0.5, -0.1, -1.0], [0.5, -0.1, 2.0]]\nradius_m = 0.08";
    let compiled = lift("[0.35, -0.45, 0.3]", pole);
    let mut run = compiled.start(&Text::new("s.toml", "", ""), 1);
    run.advance(250);
    let tally = run.world().chain_metrics(run.state(), 0).tally;
    assert!(tally.rungs.planned + tally.rungs.not_planned > 0, "{tally:?}");
}

/// A ball from which a chain flees at a speed of very many sub-steps.
#[test]
fn a_literal_escape_of_very_many_steps_is_refused() {
    let text = |speed: &str, by: &str| {
        format!(
            "format = 1\nworld = \"chain\"\n[chain]\nstep_m = 0.001\nescape_speed_m_s = {speed}\nescape_by = \"{by}\"\n\
             [[obstacles]]\nat_m = [9.0, 0.0]\nradius_m = 0.5\nvelocity_m_s = [-1.0, 0.0]\n\
             [[chains]]\nconnectors = 3\nrod_m = 0.5\ntasks = [{{ kind = \"rest\" }}]\n"
        )
    };
    let compiled = |text: String| ChainScenario::<2>::new(&Text::new("s.toml", text, ""));
    let error = compiled(text("1e5", "literal")).expect_err("too many steps");
    assert!(error.cause().contains("flee 2e3 m in a cycle"), "{error}");
    assert!(
        error.line_and_column().is_some() && error.remedy().contains("chain.escape_speed_m_s"),
        "{error}"
    );
    compiled(text("1e5", "simultaneous")).expect("solved at once");
    compiled(text("10.0", "literal")).expect("few steps");
}

#[test]
fn a_motion_of_many_sub_steps_heeds_an_interrupt() {
    let rod = Rod::with_fixed_length(0.5, 0.01);
    let mut chain =
        Chain::straight([0.0; 2], [-1.0, 0.0], 3, rod, Connector::free(0.05)).expect("a chain");
    let ball = Obstacles::new(vec![Obstacle::ball(0, [0.0, 99.0], 0.1)], 1.0).expect("a ball");
    let motion = RequestedMotion::Connector { k: 0, to: [2.0, 0.0] };
    let request =
        MotionRequest { motion, source: RequestSource::Autonomous, mode: VetoEffect::Exact };
    let interrupt = Interrupt::default();
    interrupt.raise();
    let moved = || {
        let _heeded = interrupt.attach();
        Propagator::default().propagate(&mut chain, &ball, &request)
    };
    let payload = catch_unwind(AssertUnwindSafe(moved)).expect_err("it unwinds");
    assert!(interrupt.has_caused_unwind(payload.as_ref()));
}

/// Chains side by side, so many that they are sorted, which wander into each other.
const MANY: &str = "seed = 1\ncycles = 200\n[[chains]]\nconnectors = 3\ncount = 50\napart_m = [0.0, 0.35]\nrod_m = 0.3\n\
    tasks = [{ kind = \"wander\", turn_deg = 60 }]\n";

#[test]
fn many_chains_join_the_same_groups_on_any_number_of_workers_and_never_overlap() {
    let digest = |workers: usize| {
        let source = Text::new("s.toml", format!("format = 1\nworld = \"chain\"\n{MANY}"), "");
        let compiled = ChainScenario::<2>::new(&source).expect("valid");
        let mut run = compiled.start(&source, workers);
        run.force_parallel();
        run.advance(200);
        assert_eq!(run.metrics().penetrations, 0, "{workers} workers");
        run.digest()
    };
    assert_eq!(digest(1), digest(3));
}
