//! Promises of planning robots, tried in whole runs.

use crate::robots_run;
use crate::world_impl::RobotsRun;
use sidestep_kernel::{Cycle, Digest, Simulation};
use sidestep_scenario::Source;
use std::collections::BTreeSet;

/// A ring of 16 sonars that never errs.
const PERFECT_SONAR: &str = r#"
[sensors.perfect]
bearings_deg = [0, 22.5, 45, 67.5, 90, 112.5, 135, 157.5, 180, 202.5, 225, 247.5, 270, 292.5, 315, 337.5]
range_m = 3.75
observations = ["nothing", "wall", "door", "person", "robot"]
distance_edges_m = [0.3, 1.5]
distance_classes = ["near", "medium", "far"]
[sensors.perfect.confusion]
nothing = [1, 0, 0, 0, 0]
wall = [0, 1, 0, 0, 0]
door = [0, 0, 1, 0, 0]
person = [0, 0, 0, 1, 0]
robot = [0, 0, 0, 0, 1]
"#;

fn start(text: &str, workers: usize) -> RobotsRun {
    let source = Source::new("s", text, "");
    robots_run(&source, workers).expect("a right scenario")
}

fn advance(run: &mut RobotsRun, cycles: Cycle) {
    let end = run.cycle() + cycles;
    while run.cycle() < end {
        run.advance(end - run.cycle());
    }
}

/// Returns a room of `width` x `height` free boxes with walls around it, as text.
fn room(width: usize, height: usize) -> String {
    let (wall, row) = ("#".repeat(width + 2), format!("#{}#\n", ".".repeat(width)));
    format!("{wall}\n{}{wall}\n", row.repeat(height))
}

/// Returns a corridor with a shuttle and, in the middle, a parked body that leaves a gap of one box.
fn past_a_parked_body(size: usize, sensors: &str) -> String {
    let map = room(32, size + 1);
    let height = size + 1;
    format!(
        "format = 1\nworld = \"robots\"\nregime = \"both\"\nmap.ascii = \"\"\"\n{map}\"\"\"\n\
         [[robots]]\nat = [[2, 1, 0]]\nsensors = [{sensors}]\n\
         behaviour = {{ kind = \"shuttle\", a = [1, 1, 2, {height}], b = [31, 1, 2, {height}] }}\n\
         [[robots]]\nat = [[{}, 1, 0]]\nsize = {size}\n\
         behaviour = {{ kind = \"replay\", actions = [\"stay\"] }}\n{PERFECT_SONAR}",
        17 - size / 2,
    )
}

#[test]
fn a_shuttle_gets_past_a_parked_body_through_a_gap_of_one_box() {
    for (size, sensors) in [(1, "\"perfect\""), (2, "\"perfect\""), (6, "\"perfect\""), (2, "")] {
        let mut run = start(&past_a_parked_body(size, sensors), 1);
        advance(&mut run, 10_000);
        let total = run.metrics().total;
        // Beside six boxes the lanes are six boxes apart, each way leads from one to the other, and the robot waits before
        // the body more than once until it goes around.
        let expected = if size == 6 { 60 } else { 100 };
        assert!(total.trips >= expected, "{size} {sensors}: {total:?}");
        assert!(total.contacts <= 100, "{size} {sensors}: {total:?}");
        assert!(sensors.is_empty() || total.contacts == 0, "{size}: {total:?}");
    }
}

/// Returns the contacts of robots with a sonar ring and wheels that err, on an open floor.
fn contacts_on_an_open_floor(size: u32, behaviour: &str) -> u64 {
    let map = room(48, 48);
    let mut run = start(
        &format!(
            "format = 1\nworld = \"robots\"\nmap.ascii = \"\"\"\n{map}\"\"\"\n[robots]\ncount = 50\n\
             size = {size}\nsensors = [\"sonar-ring\"]\neffector = \"nomad\"\nbehaviour = {behaviour}\n"
        ),
        1,
    );
    advance(&mut run, 2000);
    run.metrics().total.contacts
}

#[test]
fn on_an_open_floor_a_shuttle_has_at_most_three_times_the_contacts_of_who_wanders() {
    for size in [1, 2] {
        let wander = contacts_on_an_open_floor(size, "{ kind = \"wander\" }");
        let shuttle = "{ kind = \"shuttle\", a = [1, 1, 4, 48], b = [45, 1, 4, 48] }";
        let shuttle = contacts_on_an_open_floor(size, shuttle);
        assert!(shuttle <= 3 * wander, "{size}: {shuttle} against {wander}");
    }
}

/// Returns a scenario of 50 reliable robots of a MovingAI list.
fn listed(map: &std::path::Path, list: &str) -> String {
    let scen = map.with_file_name(list);
    format!(
        "format = 1\nworld = \"robots\"\nregime = \"reliable\"\nmap.file = {map:?}\n[robots]\n\
         scen = {scen:?}\ncount = 50\nsensors = [\"sonar-ring\"]\n"
    )
}

/// Runs a list to the end or to `limit`; returns the cycle in which the last robot arrived.
///
/// # Panics
/// When two robots are in one box, or have changed places in one cycle.
fn last_arrival(run: &mut RobotsRun, limit: Cycle) -> Option<Cycle> {
    let places =
        |run: &RobotsRun| (0..50).map(|id| run.state().body(id).position()).collect::<Vec<_>>();
    let mut before = places(run);
    while run.cycle() < limit {
        run.advance(1);
        let now = places(run);
        assert_eq!(now.iter().map(|at| at.word()).collect::<BTreeSet<_>>().len(), 50);
        for (a, at) in now.iter().enumerate().filter(|(a, at)| before[*a] != **at) {
            let other = before.iter().position(|was| was == at);
            assert!(other.is_none_or(|b| now[b] != before[a]), "{a} changes places");
        }
        before = now;
        if (0..50).all(|id| run.state().body(id).trips.get() == 1) {
            return Some(run.cycle());
        }
    }
    None
}

/// Returns the most cycles that one of the robots takes alone: its steps, and a quarter turn for
/// each change of direction.
fn longest_alone(run: &RobotsRun) -> Cycle {
    let alone = |id: u32| {
        let world = run.world();
        let crate::world::Role::Robot(model) = &world.type_of(id).role else { return 0 };
        let way = &model.behaviour.flow_fields()[0];
        let (mut at, mut cycles) = (world.map_position(run.state().body(id).position()), 0);
        let mut heading = run.state().body(id).facing.get().heading();
        while let Some(direction) = way.direction(at.0, at.1) {
            let turn = (4 + direction - heading) % 4;
            let (east, north) = crate::effector::HEADINGS[usize::from(direction)];
            at = (at.0.wrapping_add_signed(east), at.1.wrapping_add_signed(north));
            cycles += 1 + Cycle::from(turn.min(4 - turn));
            heading = direction;
        }
        cycles
    };
    (0..50).map(alone).max().unwrap_or(0)
}

#[test]
fn all_robots_of_a_list_arrive_within_three_times_the_longest_way_alone() {
    let lists = [
        ("Berlin_1_256", "random"),
        ("den312d", "random"),
        ("maze-32-32-2", "random"),
        ("maze-32-32-2", "even"),
        ("random-32-32-20", "random"),
        ("room-64-64-8", "random"),
        ("warehouse-10-20-10-2-1", "random"),
    ];
    for (map, kind) in lists {
        let Some(path) = sidestep_testing::shared_data(&format!("mapf/{map}.map")) else { return };
        let mut run = start(&listed(&path, &format!("{map}-{kind}-1.scen")), 1);
        let limit = 3 * longest_alone(&run);
        let last = last_arrival(&mut run, limit);
        println!("{map} {kind}: {last:?} of {limit}");
        assert!(last.is_some(), "{map} {kind}: not all within {limit}");
    }
}

/// A robot at its goal in a passage of one box, and one that has to pass it. The bay is in the
/// middle.
const PASSAGE: &str = "format = 1\nworld = \"robots\"\nmap.ascii = \"\"\"\n#####.#####\n...........\n###########\n\
                       \"\"\"\n[[robots]]\nat = [[4, 1, 0]]\nbehaviour = { kind = \"goto\", goals = [[4, 1]] }\n\
                       [[robots]]\nat = [[0, 1, 0]]\nbehaviour = { kind = \"goto\", goals = [[10, 1]] }\n";

#[test]
fn who_stands_at_its_goal_makes_room_when_asked_and_returns() {
    let mut run = start(PASSAGE, 1);
    advance(&mut run, 200);
    let place = |id| run.world().map_position(run.state().body(id).position());
    assert_eq!([place(0), place(1)], [(4, 1), (10, 1)]);
}

#[test]
fn requests_and_ranks_are_the_same_for_any_number_of_workers() {
    let map = room(14, 14);
    let text = format!(
        "format = 1\nworld = \"robots\"\nmap.ascii = \"\"\"\n{map}\"\"\"\n[robots]\ncount = 60\n\
         sensors = [\"sonar-ring\"]\neffector = \"nomad\"\n\
         behaviour = {{ kind = \"shuttle\", a = [1, 1, 2, 14], b = [13, 1, 2, 14] }}\n"
    );
    let digest = |workers| -> Digest {
        let mut run = start(&text, workers);
        run.force_parallel();
        advance(&mut run, 300);
        run.digest()
    };
    let alone = digest(1);
    assert_eq!([digest(2), digest(3)], [alone, alone]);
}

#[test]
fn where_contacts_are_impossible_robots_that_wait_for_one_find_a_way_on() {
    let map = room(20, 5);
    for behaviour in [
        "{ kind = \"wander\" }",
        "{ kind = \"shuttle\", a = [1, 1, 2, 5], b = [19, 1, 2, 5], avoidance = \"touch\" }",
    ] {
        let mut run = start(
            &format!(
                "format = 1\nworld = \"robots\"\nobstacle_rule = \"renormalise\"\nmap.ascii = \"\"\"\n\
                 {map}\"\"\"\n[[robots]]\nat = [[2, 3, 0]]\neffector = \"nomad\"\nbehaviour = {behaviour}\n\
                 [[robots]]\nat = [[10, 3, 0]]\n\
                 behaviour = {{ kind = \"replay\", actions = [\"stay\"] }}\n"
            ),
            1,
        );
        advance(&mut run, 2000);
        // Without a way on it stands before the first obstacle after 20 boxes at most.
        let moves = run.state().body(0).moves.get();
        assert!(moves > 500, "{behaviour}: {moves} moves");
    }
}
