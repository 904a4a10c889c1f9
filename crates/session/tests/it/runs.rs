//! One run: started, recorded, stopped, resumed, replayed, reported.

use crate::support::{InterruptAt, StopAt, TestFolder, WORLDS};
use sidestep_kernel::Interrupt;
use sidestep_kernel::ports::ColumnValues;
use sidestep_record::read_table;
use sidestep_session::report::document;
use sidestep_session::{
    Error, ManagedRun, NoWatcher, OutputPaths, RecordedRun, RowSelection, RunStatus, replay_all,
    replay_to,
};

#[test]
fn the_number_of_workers_changes_nothing() {
    let place = TestFolder::new();
    let run = |workers| {
        let journey = place.start(workers, OutputPaths::default()).expect("started");
        journey.run_to_end(&NoWatcher).expect("no bug")
    };
    let one = run(1);
    assert_eq!((one.world, one.agents, one.cycles), ("pond", 12, 6000));
    let hops = one.metrics["hops"].as_u64();
    assert!(hops > Some(1000), "frogs hop: {hops:?}");
    for workers in [2, 3] {
        let more = run(workers);
        assert_eq!((&more.digest, &more.metrics), (&one.digest, &one.metrics));
    }
}

#[test]
fn a_run_that_was_stopped_comes_to_the_same_end_with_the_same_rows() {
    let place = TestFolder::new();
    let (whole, in_one_go) = place.record("whole");
    let parts = place.path("parts");
    let keep = OutputPaths { folder: Some(&parts), ..OutputPaths::default() };
    let stopped = place.start(1, keep).expect("started").run_to_end(&StopAt::new(1700));
    let stopped = stopped.expect("stopped in good order");
    assert_eq!(stopped.status, RunStatus::Incomplete);
    assert!((1700..6000).contains(&stopped.cycles), "{}", stopped.cycles);
    let resume = |until| ManagedRun::resume(&WORLDS, &parts, 3, until);
    let early = resume(Some(100)).map(drop).expect_err("the run is past cycle 100");
    assert!(early.to_string().contains("--cycles 100"), "{early}");
    let half = resume(Some(5001)).expect("resumed").run_to_end(&NoWatcher).expect("no bug");
    assert_eq!((half.cycles, half.status), (5001, RunStatus::Incomplete));
    let resumed = resume(None).expect("resumed").run_to_end(&NoWatcher).expect("no bug");
    assert_eq!((&resumed.digest, &resumed.metrics), (&in_one_go.digest, &in_one_go.metrics));
    for table in ["trajectories", "events", "series"] {
        let rows = |folder| read_table(folder, table, ..).expect("whole").columns;
        assert!(rows(&whole) == rows(&parts), "{table}");
    }
}

#[test]
fn a_run_that_was_interrupted_within_a_cycle_comes_to_the_same_end_with_the_same_rows() {
    let place = TestFolder::new();
    let (whole, in_one_go) = place.record("whole");
    for workers in [1, 3] {
        let parts = place.path(&format!("parts-{workers}"));
        let keep = OutputPaths { folder: Some(&parts), ..OutputPaths::default() };
        let watcher = InterruptAt { cycle: 1700, interrupt: Interrupt::default() };
        let ended = place.start(workers, keep).expect("started").run_to_end(&watcher);
        let Err(Error::InterruptedInCycle(cycle)) = ended else { panic!("{ended:?}") };
        assert!((1700..6000).contains(&cycle), "{cycle}");
        let resumed = ManagedRun::resume(&WORLDS, &parts, 2, None).expect("as after a kill");
        let resumed = resumed.run_to_end(&NoWatcher).expect("no bug");
        assert_eq!((&resumed.digest, &resumed.metrics), (&in_one_go.digest, &in_one_go.metrics));
        for table in ["trajectories", "events", "series"] {
            let rows = |folder| read_table(folder, table, ..).expect("whole").columns;
            assert!(rows(&whole) == rows(&parts), "{table}");
        }
    }
}

#[test]
fn a_run_leaves_a_picture_and_is_replayed_to_any_cycle() {
    let place = TestFolder::new();
    let (folder, _) = place.record("run");
    let svg = std::fs::read_to_string(folder.join("trajectories.svg")).expect("drawn");
    assert!(svg.starts_with("<svg") && svg.contains("evening"));
    let recorded = RecordedRun::open(&WORLDS, &folder).expect("recorded");
    let whole = replay_all(&recorded, 3, &NoWatcher).expect("the same digest");
    assert_eq!(whole.run.cycle(), 6000);
    let mut moment = replay_to(&recorded, 1234, 1, &NoWatcher).expect("the same poses");
    assert_eq!((moment.run.cycle(), moment.compared_poses), (1234, 12));
    moment.draw(&recorded, &place.path("moment.png")).expect("drawn");
    let stopped = replay_all(&recorded, 1, &StopAt::new(10));
    assert!(matches!(stopped, Err(Error::Interrupted)));
}

#[test]
fn a_run_is_reported() {
    let place = TestFolder::new();
    let (folder, summary) = place.record("run");
    let document = document(&WORLDS, &folder, &NoWatcher).expect("a document");
    let pages = sidestep_report::render(&document, "pictures").expect("pages");
    for words in ["evening, seed 1", "hops_per_frog", "bump", &summary.digest, "x_m"] {
        assert!(pages.markdown.contains(words), "no {words} in the report");
    }
    assert!(!pages.pictures.is_empty());
}

#[test]
fn rows_are_kept_of_the_tables_that_are_wanted_and_frames_at_multiples() {
    let place = TestFolder::new();
    let mut journey = place.start(1, OutputPaths::default()).expect("started");
    let unknown = RowSelection { tables: Some(vec!["toads".into()]), frames: None };
    let told = journey.keep_rows(&unknown).expect_err("no such table").to_string();
    assert!(told.contains("there is no table `toads`"), "{told}");
    let wanted = RowSelection { tables: Some(Vec::new()), frames: Some(50) };
    journey.keep_rows(&wanted).expect("kept");
    assert!(journey.keep_rows(&wanted).is_err(), "twice");
    for until in [20, 70, 120] {
        journey.advance_to(until, &NoWatcher).expect("advanced");
    }
    let rows = journey.take_rows().expect("rows");
    let [(schema, columns)] = &rows[..] else { panic!("{} tables", rows.len()) };
    let ColumnValues::U64(cycles) = &columns[0] else { panic!("cycles come first") };
    let mut cycles = cycles.to_vec();
    cycles.dedup();
    assert_eq!((schema.name.as_str(), cycles), ("frames", vec![0, 50, 100]));
    let (_, now) = journey.frame_rows();
    assert_eq!(now[0], ColumnValues::U64(vec![120; now[0].len()].into()));
}
