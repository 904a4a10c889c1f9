//! Robots that are driven and tell each other of themselves: plants in Python that share no code with them.

use crate::PEER;
use crate::drive::{BOX_M, DriveProcess, Plants, ScenarioFolder, is_at, job};
use serde_json::{Value, json};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::scenario::Compiled;
use sidestep_session::fleet::{DriveJob, DriveStatus};
use sidestep_testing::has_modules;
use std::path::Path;

const BEACON: &str = include_str!("../../../../docs/src/wire/RobotBeacon.msg");

/// Two rooms and a corridor of one box between them; rows from the north.
const ROOMS: [&str; 3] = ["......##......", "..............", "......##......"];

/// A column and a row of the corridor.
const CORRIDOR: [u32; 2] = [6, 1];

/// The start of each robot, a column, a row and degrees, and its goal.
const WAYS: [([u32; 3], [u32; 2]); 4] =
    [([0, 1, 0], [13, 0]), ([0, 2, 0], [12, 2]), ([13, 0, 180], [0, 1]), ([13, 2, 180], [1, 2])];

fn head(rows: &[&str]) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nseed = 4\ncycles = 400\nregime = \"reliable\"\n[map]\n\
         box_size_m = {BOX_M}\nascii = \"\"\"\n{}\n\"\"\"\n",
        rows.join("\n")
    )
}

fn planned_scenario() -> String {
    let mut text = head(&ROOMS);
    // One planner leads all: those of a team of its own would take the others for walls.
    let mut leader = "name = \"all\"\nplanner = { method = \"lacam\" }";
    for ([column, row, degrees], goal) in WAYS {
        let heading = degrees / 90;
        text += &format!(
            "[[robots]]\nat = [[{column}, {row}, {heading}]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
             behaviour = {{ kind = \"goto\", goals = [{goal:?}] }}\n{leader}\n"
        );
        leader = "team = \"all\"";
    }
    text
}

/// Returns the robots in the order in which the plan leads them through the corridor.
fn order_of_plan(text: &str) -> Vec<usize> {
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    let building = compiled.as_any().downcast_ref::<Compiled>().expect("robots");
    let plan = building.run_plan(&source).expect("a plan").plan;
    let is_there =
        |robot: usize, step: usize| plan.pose(robot, step).position() == (CORRIDOR[0], CORRIDOR[1]);
    let first = |&robot: &usize| (0..=plan.steps()).find(|&step| is_there(robot, step));
    let mut order: Vec<usize> = (0..WAYS.len()).collect();
    order.sort_by_key(first);
    order
}

/// Returns the robots in the order in which they were first in the corridor, by their true poses.
fn order_of_tracks(tracks: &Value) -> Vec<usize> {
    let first = |&robot: &usize| {
        let steps = tracks[robot].as_array().expect("poses");
        let is_there = |pose: &Value| {
            (0..2).all(|k| {
                let at_m = pose[k + 1].as_f64().expect("meters");
                (at_m / BOX_M).floor() == f64::from(CORRIDOR[k])
            })
        };
        steps.iter().position(is_there).expect("it was there")
    };
    let mut order: Vec<usize> = (0..WAYS.len()).collect();
    order.sort_by_key(first);
    order
}

/// A job of a robot that ends with its plan.
fn planned_job(folder: &ScenarioFolder, robot: u32, plants: &Plants) -> DriveJob {
    DriveJob { trips: None, ..job(&folder.path("s.toml"), robot, plants.port) }
}

fn done(status: &DriveStatus) -> u32 {
    status.plan.as_ref().and_then(|plan| plan.done).unwrap_or(0)
}

#[test]
fn robots_with_a_plan_pass_a_corridor_in_its_order_and_wait_for_one_whose_program_is_killed() {
    if !has_modules(PEER) {
        return;
    }
    let text = planned_scenario();
    let folder = ScenarioFolder::new(&text);
    let order = order_of_plan(&text);
    let more = json!({ "map": ROOMS, "pace": 3.0, "beacon": BEACON, "stop_after": 2 });
    let mut plants = Plants::start_with(&WAYS.map(|(start, _)| start), more);
    let start = |robot: usize| DriveProcess::start(planned_job(&folder, robot as u32, &plants));
    let mut drives: Vec<DriveProcess> = (0..WAYS.len()).map(start).collect();
    let first = order[0];
    drives[first].wait_for(|status| done(status) >= 1);
    drives[first].kill();
    let first_id = first as u32;
    let waiting = drives[order[1]].wait_for(|status| {
        let is_waiting =
            status.plan.as_ref().is_some_and(|plan| plan.waits_for.contains(&first_id));
        is_waiting && status.silent.contains(&first_id)
    });
    let hold = waiting.plan.and_then(|plan| plan.hold).expect("words");
    assert!(hold.contains(&format!("silent: {first}")), "{hold}");
    drives[first] = start(first);
    let ends: Vec<DriveStatus> = drives.iter().map(DriveProcess::end).collect();
    let report = plants.ask("report");
    for (k, (_, goal)) in WAYS.iter().enumerate() {
        let plan = ends[k].plan.as_ref().expect("a plan");
        assert_eq!(plan.done, Some(plan.actions), "{:?}", ends[k]);
        let beacons = ends[k].beacons;
        assert!(beacons.heard > 0 && beacons.sent > 0, "{beacons:?}");
        assert_eq!((beacons.unreadable, beacons.foreign), (0, 0), "{beacons:?}");
        let robot = &report[k];
        assert!(is_at(robot, *goal), "robot {k}: {robot}");
        assert_eq!(robot["touches"], 0, "robot {k}: {robot}");
        // As another program reads it.
        assert_eq!(robot["beacon"]["robot"], k);
        assert_eq!(robot["beacon"]["done"], plan.actions);
        assert_eq!(robot["beacon"]["digest"], report[0]["beacon"]["digest"]);
        assert_eq!(ends[k].trips, 1, "{:?}", ends[k]);
    }
    assert_eq!(order_of_tracks(&plants.ask("track")), order);
}

#[test]
fn robots_hear_words_of_those_in_range_and_not_of_one_that_is_farther() {
    if !has_modules(PEER) {
        return;
    }
    // From one room to the other it is farther than the radio reaches.
    let rooms = ["....######....", "....######....", "....######...."];
    let starts = [[0, 0, 0], [3, 2, 180], [13, 1, 180]];
    let text = format!(
        "{}[radio]\nrange_m = 2.0\n[[robots]]\nat = [[0, 0, 0], [3, 2, 2], [13, 1, 2]]\nsensors = [\"sonar-8\"]\n\
         effector = \"nomad\"\nbehaviour = {{ kind = \"announce\" }}\n",
        head(&rooms)
    );
    let folder = ScenarioFolder::new(&text);
    let mut plants =
        Plants::start_with(&starts, json!({ "map": rooms, "pace": 3.0, "beacon": BEACON }));
    let start = |robot: u32| DriveProcess::start(planned_job(&folder, robot, &plants));
    let drives: Vec<DriveProcess> = (0..3).map(start).collect();
    drives[0].wait_for(|status| status.heard == [1]);
    drives[1].wait_for(|status| status.heard == [0]);
    // It takes their beacons, and hears no words of them.
    let alone = drives[2].wait_for(|status| {
        assert!(status.heard.is_empty(), "{status:?}");
        status.actions >= 3 && status.beacons.heard >= 10
    });
    assert_eq!(alone.beacons.foreign, 0);
    let report = plants.ask("report");
    for robot in 0..3 {
        assert_eq!(report[robot]["beacon"]["has_word"], true, "{report}");
        assert_eq!(report[robot]["touches"], 0, "{report}");
    }
}

#[test]
fn robots_that_could_not_hear_each_other_or_have_no_plan_are_refused_with_a_remedy() {
    let folder = ScenarioFolder::new(&planned_scenario());
    let file = folder.path("s.toml");
    let fail = |job: DriveJob| DriveProcess::start(job).failure();
    let trips = fail(job(&file, 0, 9));
    assert!(trips.is_input && trips.remedy.contains("leave it out"), "{trips:?}");
    let mut elsewhere = DriveJob { trips: None, ..job(&file, 0, 9) };
    elsewhere.network.namespace = "/kitchen".into();
    let elsewhere = fail(elsewhere);
    assert!(elsewhere.is_input && elsewhere.remedy.contains("--peers"), "{elsewhere:?}");
    let fail_with = |text: &str, cause: &str| {
        let folder = ScenarioFolder::new(text);
        let refused =
            fail(DriveJob { trips: None, ..job(Path::new(&folder.path("s.toml")), 0, 9) });
        assert!(refused.is_input && refused.cause.contains(cause), "{refused:?}");
        assert!(!refused.remedy.is_empty());
    };
    let text = planned_scenario();
    // A program leads the robots of one section only.
    let external = "planner = { method = \"external\" }";
    let ordered = text.replace("lacam", "external").replace("team = \"all\"", external);
    fail_with(&ordered, "a program orders");
    fail_with(&text.replace("regime = \"reliable\"", "regime = \"both\""), "actions that succeed");
}
