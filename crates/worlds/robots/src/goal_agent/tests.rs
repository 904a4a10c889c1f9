use super::*;
use crate::{RobotsRun, robots_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::control::{MultiAgentOrder, OrderLog};
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_scenario::Source;

/// Two rooms with a door, a cell without one, and a robot under orders beside one that wanders.
const ROOMS: &str = "format = 1\nworld = \"robots\"\nseed = 3\ncycles = 400\n[map]\nbox_size_m = 0.5\n\
    ascii = \"\"\"\n....#...#.\n....#...#.\n........##\n....#.....\n\"\"\"\n\
    [[robots]]\nat = [[0, 0, 0]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\nbehaviour.kind = \"external\"\n\
    [[robots]]\nat = [[9, 0, 0]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

fn source() -> Source {
    Source::new("s.toml", ROOMS, "")
}

fn pose(col: f64, row: f64, yaw_rad: f64) -> Pose2 {
    Pose2 { at_m: [(col + 0.5) * 0.5, (row + 0.5) * 0.5], yaw_rad }
}

fn agent(run: &RobotsRun, id: EntityId) -> Option<GoalAgent> {
    GoalAgent::new(run.world().clone(), id)
}

fn place(run: &RobotsRun) -> GridPose {
    run.world().place(run.state(), 0).expect("a robot")
}

/// Orders what the agent decides in the next cycle, and returns the mark of its trip.
fn advance(run: &mut RobotsRun, agent: &mut GoalAgent) -> Option<TripEvent> {
    let mut mark = None;
    for percept in run.world().external_percepts(run.state(), run.cycle(), &[0, 1]) {
        assert_eq!(percept.id, 0, "the other one decides by itself");
        assert_eq!(percept.readings.len(), 8);
        let control = agent.decide(&percept).expect("its own percept");
        mark = control.trip;
        let value = mark.map_or(0.0, |trip| if trip == TripEvent::Started { 1.0 } else { 2.0 });
        for (order, value) in [("action", f64::from(control.action)), ("trip", value)] {
            let order = MultiAgentOrder { order, agents: &[0], values: &[value] };
            run.order(&order).expect("an order of its spaces");
        }
    }
    run.advance(1);
    mark
}

#[test]
fn a_robot_goes_through_the_door_turns_as_it_was_told_and_its_orders_alone_replay() {
    let mut run = robots_run(&source(), 1).expect("it compiles");
    run.start_recording();
    let mut agent = agent(&run, 0).expect("a robot under orders");
    let west = std::f64::consts::PI;
    let accepted = agent.set_goal(place(&run), &pose(6.0, 3.0, west));
    assert_eq!(accepted, Ok(GridPose::new(6, 3, 2)));
    let mut marks = Vec::new();
    while agent.goal().is_some() && run.cycle() < 400 {
        marks.extend(advance(&mut run, &mut agent));
    }
    assert_eq!(marks, [TripEvent::Started, TripEvent::Completed]);
    let at = place(&run);
    assert_eq!((at.col, at.row, at.heading), (6, 3, 2));
    let cycle = run.cycle();
    let mut tables = MemoryRecorder::new(&run.schemas());
    run.record(&mut tables).expect("memory suffices");
    tables.finish().expect("memory suffices");
    let log = OrderLog::from_recorder(&tables).expect("orders are recorded");
    let mut again = robots_run(&source(), 1).expect("it compiles");
    again.replay_orders(log).expect("orders of this run");
    again.advance(cycle);
    assert_eq!(again.digest(), run.digest());
}

#[test]
fn the_latest_goal_counts_and_a_refused_one_changes_nothing() {
    let run = robots_run(&source(), 1).expect("it compiles");
    let mut agent = agent(&run, 0).expect("a robot under orders");
    let from = place(&run);
    assert_eq!(agent.set_goal(from, &pose(2.0, 2.0, 0.0)), Ok(GridPose::new(2, 2, 0)));
    assert_eq!(agent.set_goal(from, &pose(3.0, 1.2, 1.4)), Ok(GridPose::new(3, 1, 1)));
    let wall = agent.set_goal(from, &pose(4.0, 0.0, 0.0));
    assert_eq!(wall, Err(GoalRefusal::NoRoom(GridPose::new(4, 0, 0))));
    assert_eq!(agent.set_goal(from, &pose(-3.0, 0.0, 0.0)), Err(GoalRefusal::OffMap));
    let cell = agent.set_goal(from, &pose(9.0, 3.0, 0.0));
    assert!(matches!(cell, Err(GoalRefusal::NoWay { .. })), "{cell:?}");
    assert_eq!(agent.goal(), Some(GridPose::new(3, 1, 1)));
}

#[test]
fn a_goal_that_is_reached_already_is_a_trip_and_without_one_it_stays() {
    let mut run = robots_run(&source(), 1).expect("it compiles");
    let mut robot = agent(&run, 0).expect("a robot under orders");
    assert_eq!(advance(&mut run, &mut robot), None);
    robot.set_goal(place(&run), &pose(0.0, 0.0, 0.0)).expect("it is there");
    assert_eq!(advance(&mut run, &mut robot), Some(TripEvent::Started));
    assert_eq!(advance(&mut run, &mut robot), Some(TripEvent::Completed));
    assert_eq!(place(&run), GridPose::new(0, 0, 0));
    assert!(agent(&run, 1).is_none(), "it has a program of its own");
}
