use crate::exact::single_robot;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::{RobotsRun, kinds, robots_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::view::{BodyId, FactValue};
use sidestep_scenario::Source;

/// One robot that goes ahead along a corridor, with wheels that have these delays.
fn corridor(delays: &str, more: &str) -> Source {
    let text = format!(
        "format = 1\nworld = \"robots\"\nrecord.calibration = true\n{more}[map]\nascii = \"{}\"\n\
         [robots]\nat = [[0, 0, 0]]\neffector = \"wheels\"\n\
         behaviour = {{ kind = \"replay\", actions = [\"forward\"], repeat = true }}\n\
         [effectors.wheels]\nforward = [{{ p = 1.0, path = \"F\" }}]\n[effectors.wheels.delays]\n{delays}\n",
        ".".repeat(40)
    );
    Source::new("s", text, "")
}

fn run_of(source: &Source, workers: usize) -> RobotsRun {
    robots_run(source, workers).unwrap_or_else(|e| panic!("{e}"))
}

fn advanced(source: &Source, cycles: u64) -> RobotsRun {
    let mut run = run_of(source, 1);
    run.advance(cycles);
    run
}

fn col(run: &RobotsRun) -> u32 {
    run.snapshot().bodies[0].at.0
}

/// Thirty robots in a small hall, with delays of both sorts.
fn crowd() -> Source {
    let map = format!("{}\n", ".".repeat(20)).repeat(20);
    let delays =
        "p = 0.1\nmin = 1\nmax = 9\ndistribution = \"gaussian\"\nmean_ratio = 0.5\nsd_ratio = 0.3";
    let text = format!(
        "format = 1\nworld = \"robots\"\n[map]\nascii = \"\"\"\n{map}\"\"\"\n\
         [[robots]]\ncount = 20\neffector = \"slow\"\nsensors = [\"sonar-8\"]\n\
         [[robots]]\ncount = 10\neffector = \"stuck\"\nperiod = 3\n\
         [effectors.slow]\nforward = [{{ p = 1.0, path = \"F\" }}]\n[effectors.slow.delays]\n{delays}\n\
         [effectors.stuck]\nforward = [{{ p = 1.0, path = \"F\" }}]\n\
         [effectors.stuck.delays]\np = 0.05\nper = \"cycle\"\ndurations = [{{ cycles = 2, p = 0.5 }}, {{ cycles = 7, p = 0.5 }}]\n"
    );
    Source::new("crowd", text, "")
}

#[test]
fn each_action_is_delayed_once_and_made_after_that() {
    let run = advanced(&corridor("p = 1.0\nmin = 3\nmax = 3", ""), 8);
    assert_eq!(col(&run), 2, "three cycles of delay before each action");
    let total = run.metrics().total;
    assert_eq!((total.actions, total.delayed_cycles), (2, 6));
}

#[test]
fn delays_that_any_cycle_starts_follow_on_each_other() {
    let run = advanced(&corridor("p = 1.0\nper = \"cycle\"\nmin = 3\nmax = 3", ""), 8);
    assert_eq!((col(&run), run.metrics().total.delayed_cycles), (0, 8));
}

#[test]
fn regimes_with_reliable_effectors_have_no_delays() {
    for (regime, cols) in [("reliable", 8), ("sensors", 8), ("effectors", 2), ("both", 2)] {
        let source = corridor("p = 1.0\nmin = 3\nmax = 3", &format!("regime = \"{regime}\"\n"));
        let run = advanced(&source, 8);
        assert_eq!(col(&run), cols, "{regime}");
        assert_eq!(run.world().has_delays, cols == 2, "{regime}");
    }
}

#[test]
fn the_log_has_the_delay_of_each_action_and_none_without_delays() {
    let recorded = |delays: &str| {
        let mut run = run_of(&corridor(delays, ""), 1);
        run.start_recording();
        let mut recorder = MemoryRecorder::new(&run.schemas());
        run.advance(8);
        run.record(&mut recorder).expect("memory suffices");
        recorder.finish().expect("memory suffices");
        recorder
    };
    let recorder = recorded("p = 1.0\nmin = 3\nmax = 3");
    assert_eq!(recorder.row_count("motions"), 2);
    let delays = recorder.column("motions", "delay_cycles").expect("a column");
    assert!(format!("{delays:?}").contains("[3, 3]"), "{delays:?}");
    assert!(recorded("p = 0.0\nmin = 3\nmax = 3").column("motions", "delay_cycles").is_none());
}

#[test]
fn a_run_that_is_resumed_within_a_delay_goes_on_with_the_same_bits() {
    let source = crowd();
    let mut whole = run_of(&source, 3);
    whole.force_parallel();
    whole.advance(200);
    assert!(whole.metrics().total.delayed_cycles > 500);
    for at in [0, 7, 100] {
        let mut first = run_of(&source, 1);
        first.advance(at);
        let mut second = run_of(&source, 2);
        second.restore(&first.checkpoint()).expect("the same scenario");
        assert_eq!(second.digest(), first.digest());
        second.advance(200 - at);
        assert_eq!(second.digest(), whole.digest(), "resumed at {at}");
        assert_eq!(second.metrics().total, whole.metrics().total);
    }
}

/// The state of two robots in the same place differs where only one is delayed.
#[test]
fn what_is_left_of_a_delay_is_part_of_the_state() {
    let [short, long] = [3, 4].map(|cycles| {
        advanced(&corridor(&format!("p = 1.0\nmin = {cycles}\nmax = {cycles}"), ""), 2)
    });
    assert_eq!(col(&short), col(&long));
    assert_ne!(short.digest(), long.digest());
    let left = |run: &RobotsRun| {
        let told = run.inspect(BodyId::new(kinds::ROBOT, 0, None)).expect("it is there");
        assert_eq!(told.fact_value("Decides", "action"), Some(&"none: it is delayed".into()));
        told.fact_value("Now", "delayed for").cloned()
    };
    assert_eq!(left(&short), Some(FactValue::number(1.0, "cycles")));
    assert_eq!(left(&long), Some(FactValue::number(2.0, "cycles")));
}

#[test]
fn an_exact_chain_refuses_delays_by_name() {
    let single = |source: &Source| {
        let compiled = Compiled::new(source, &Behaviours::new(), StorageOrder::ById);
        single_robot(&compiled.unwrap_or_else(|e| panic!("{e}"))).map(|_| ())
    };
    let delays = "p = 0.5\nmin = 1\nmax = 2";
    let error = single(&corridor(delays, "")).expect_err("it has delays");
    assert!(error.cause().contains("effector `wheels` has delays"), "{error}");
    assert!(error.remedy().contains("--regime sensors"), "{error}");
    single(&corridor(delays, "regime = \"sensors\"\n")).expect("the remedy works");
    single(&corridor("p = 0.0\nmin = 1\nmax = 2", "")).expect("the other remedy works, too");
}

#[test]
fn mistakes_in_delays_are_told_with_a_remedy() {
    for (delays, cause) in [
        ("p = 0.5", "do not say how long"),
        ("p = 0.5\nmin = 3\nmax = 2", "from 3 to 2"),
        ("p = 0.5\nmin = 1\nmax = 2\nmean_ratio = 0.5", "nothing uses"),
        ("p = 0.5\nmin = 1\nmax = 2\ndistribution = \"gaussian\"", "no mean or no deviation"),
        ("p = 0.5\nmin = 1\ndurations = [{ cycles = 1, p = 1.0 }]", "beside a distribution"),
        ("p = 0.5\ndurations = [{ cycles = 1, p = 0.4 }]", "the durations of the delays"),
    ] {
        let error = robots_run(&corridor(delays, ""), 1).expect_err("a mistake");
        assert!(error.cause().contains(cause), "{error}");
    }
}
