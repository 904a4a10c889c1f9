//! D1 for observers: frames change no result of any world, and show the true state.

use crate::chain::{SEVERAL, SWARM};
use crate::common::{CROWD, source};
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::MemoryRecorder;
use sidestep::kernel::view::{BodyId, FrameOptions, Shape};
use sidestep::scenario::Source;
use sidestep::worlds::airspace::airspace_run;
use sidestep::worlds::airspace::kinds::{AIRPLANE, ZONE};
use sidestep::worlds::chain::chain_run;
use sidestep::worlds::robots::kinds::{DOOR, ROBOT};
use sidestep::worlds::robots::robots_run;

const LOOK: FrameOptions = FrameOptions::with_first_scans(usize::MAX);

fn traffic() -> Source {
    let text = "format = 1\nworld = \"airspace\"\nseed = 7\n[airspace]\nmethod = \"none\"\n\
                shield = \"off\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";
    Source::new("traffic", text, "")
}

fn robots(workers: usize) -> Box<dyn Simulation> {
    Box::new(robots_run(&source(CROWD, &[]), workers).expect("a valid scenario"))
}

fn chains(text: &str, workers: usize) -> Box<dyn Simulation> {
    let text = format!("format = 1\nworld = \"chain\"\nseed = 9\n{text}");
    let source = Source::new("chains", text, "");
    chain_run(&source, workers).unwrap_or_else(|e| panic!("{e}"))
}

fn airplanes(workers: usize) -> Box<dyn Simulation> {
    Box::new(airspace_run(&traffic(), workers).expect("a valid scenario"))
}

pub(crate) fn worlds(workers: usize) -> Vec<Box<dyn Simulation>> {
    vec![robots(workers), chains(SEVERAL, workers), chains(SWARM, workers), airplanes(workers)]
}

#[test]
fn looking_changes_no_result_whoever_computes_it() {
    for (mut plain, mut watched) in worlds(1).into_iter().zip(worlds(2)) {
        watched.enable_events();
        let mut frames = Vec::new();
        for _ in 0..40 {
            frames.push(watched.frame(LOOK));
            watched.advance(3);
        }
        while plain.cycle() < watched.cycle() {
            plain.advance(watched.cycle() - plain.cycle());
        }
        assert_eq!(plain.digest(), watched.digest(), "{}", plain.world_name());
        assert_eq!(plain.checkpoint(), watched.checkpoint(), "{}", plain.world_name());
        let again = plain.frame(LOOK);
        let now = watched.frame(LOOK);
        assert_eq!((again.bodies, again.scans), (now.bodies, now.scans), "{}", plain.world_name());
        assert!(again.log.is_empty(), "nobody watched");
        let told: Vec<u64> = frames.iter().flat_map(|f| &f.log).map(|e| e.cycle).collect();
        assert!(told.is_sorted(), "{}", plain.world_name());
        assert!(frames.iter().all(|f| f.log.iter().all(|e| e.cycle < f.cycle)));
    }
}

#[test]
fn events_reach_the_log_and_the_table_alike() {
    let mut run = robots_run(&source(CROWD, &[]), 2).expect("a valid scenario");
    let mut plain = robots_run(&source(CROWD, &[]), 1).expect("a valid scenario");
    let (mut told, mut tables) = (0, Vec::new());
    for (run, watches) in [(&mut run, true), (&mut plain, false)] {
        run.start_recording();
        if watches {
            run.enable_events();
        }
        let mut recorder = MemoryRecorder::new(&run.schemas());
        for _ in 0..30 {
            run.advance(10);
            if watches {
                told += run.frame(FrameOptions::WITHOUT_SCANS).log.len();
            }
        }
        run.record(&mut recorder).expect("kept");
        tables.push(recorder);
    }
    assert!(told > 100);
    assert_eq!(told, tables[0].row_count("events"));
    assert_eq!(tables[0], tables[1], "watching changes no row");
}

#[test]
fn bodies_keep_their_names_and_are_where_the_world_has_them() {
    for mut run in worlds(1) {
        let first: Vec<String> = run.frame(LOOK).bodies.iter().map(|b| b.name()).collect();
        let mut unique = first.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), first.len(), "{}", run.world_name());
        run.advance(5);
        let later: Vec<String> = run.frame(LOOK).bodies.iter().map(|b| b.name()).collect();
        assert_eq!(first, later, "{}", run.world_name());
        let scenery = run.scenery();
        assert!(scenery.cycle_s > 0.0 && scenery.dimensions == 2);
        let frame = run.frame(LOOK);
        assert_eq!((frame.cycle, frame.time_s), (5, 5.0 * scenery.cycle_s));
    }
    let agents = robots(1).frame(LOOK).bodies.iter().filter(|b| b.kind == ROBOT).count();
    assert_eq!(agents, robots(1).agent_count());
}

#[test]
fn sensors_see_the_floor_around_them() {
    let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n[map]\nbox_size_m = 0.5\n\
                ascii = \"\"\"\n########\n#......#\n########\n\"\"\"\n[[robots]]\ncount = 1\n\
                size = 1\nsensors = [\"bumper-4\"]\neffector = \"nomad\"\nat = [[3, 1]]\n";
    let source = Source::new("narrow", text, "");
    let mut run = robots_run(&source, 1).unwrap_or_else(|e| panic!("{e}"));
    let frame = run.frame(LOOK);
    let [scan] = &frame.scans[..] else { panic!("one robot has one sensor") };
    assert_eq!(scan.name(), "robot/0/bumper-4");
    let heading =
        |k: usize| scan.pose.rotate([scan.bearings_rad[k].cos(), scan.bearings_rad[k].sin(), 0.0]);
    for k in 0..4 {
        let looks_along_the_corridor = heading(k)[0].abs() > 0.9;
        assert_eq!(scan.ranges_m[k].is_infinite(), looks_along_the_corridor, "beam {k}");
        assert!(looks_along_the_corridor || (0.25..=scan.range_m).contains(&scan.ranges_m[k]));
    }
    let leader = chains(SWARM, 1).frame(LOOK);
    let [laser] = &leader.scans[..] else { panic!("one leader has a laser") };
    assert!(laser.ranges_m.iter().any(|range_m| range_m.is_finite()));
    assert_eq!(laser.ranges_m.len(), laser.bearings_rad.len());
    assert!(robots(1).frame(FrameOptions::WITHOUT_SCANS).scans.is_empty());
}

#[test]
fn airplanes_that_are_too_near_are_marked_until_they_are_apart() {
    let mut run = airplanes(1);
    run.enable_events();
    let (mut marked, mut losses) = (0, 0);
    while !run.is_over() && run.cycle() < 400 {
        run.advance(1);
        let frame = run.frame(LOOK);
        let is_marked = |b: &&sidestep::kernel::view::Body| {
            b.kind == ZONE && b.state == sidestep::kernel::view::BodyCondition::Touching
        };
        marked += frame.bodies.iter().filter(is_marked).count();
        losses += frame.log.iter().filter(|e| e.words.contains("loses separation")).count();
        let zones = frame.bodies.iter().filter(|b| b.kind == ZONE);
        assert!(zones.clone().all(|b| matches!(b.shape, Shape::Cylinder { .. })));
        assert_eq!(frame.bodies.len(), 2 * zones.count(), "each airplane has its zone");
    }
    assert!(marked > 0 && losses > 0, "{marked} marked, {losses} losses");
}

#[test]
fn a_look_names_the_bodies_whose_scans_are_wanted_and_truth_stands_beside_every_report() {
    let mut run = robots(1);
    run.advance(10);
    let all = run.frame(LOOK).scans;
    let asked = [30, 3].map(|id| BodyId::new(ROBOT, id, None));
    let unknown = [BodyId::new(ROBOT, 9_999, None), BodyId::new(DOOR, 30, None)];
    let some = run.frame(FrameOptions::with_scans_of([&asked[..], &unknown].concat())).scans;
    let of = |who| all.iter().filter(move |scan| scan.of == who).cloned();
    let expected: Vec<_> = asked.into_iter().flat_map(of).collect();
    assert!(some.len() >= 2 && some == expected);
    let (mut beams, mut wrong) = (0, 0);
    for scan in &all {
        assert_eq!(scan.true_m.len(), scan.ranges_m.len());
        beams += scan.ranges_m.len();
        let pairs = scan.ranges_m.iter().zip(&scan.true_m);
        wrong += pairs.filter(|(said, truth)| said.is_finite() != truth.is_finite()).count();
    }
    assert!(wrong > 0 && wrong < beams / 4, "{wrong} of {beams}: sensors seldom err");
    let leader = chains(SWARM, 1).frame(FrameOptions::with_first_scans(1)).scans.swap_remove(0);
    assert_eq!(leader.true_m.len(), leader.ranges_m.len());
    let again = chains(SWARM, 1).frame(FrameOptions::with_scans_of(vec![leader.of])).scans;
    assert_eq!(again, [leader]);
}

#[test]
fn entries_of_the_log_say_what_happened_to_whom_with_whom_and_where() {
    let mut met = 0;
    for mut run in worlds(1) {
        run.enable_events();
        for _ in 0..60 {
            run.advance(1);
            let frame = run.frame(FrameOptions::WITHOUT_SCANS);
            for entry in &frame.log {
                let here = frame.bodies.iter().find(|body| body.id() == entry.who);
                let (Some(here), Some(at_m)) = (here, entry.at_m) else {
                    panic!("{} is nowhere: {entry:?}", entry.name())
                };
                let apart_m = (here.pose.at_m[0] - at_m[0]).hypot(here.pose.at_m[1] - at_m[1]);
                assert!(apart_m < 1.0, "{entry:?} is {apart_m} m from its body");
                met += usize::from(entry.with.is_some());
            }
        }
    }
    assert!(met > 10, "{met}");
}

/// Departures, arrivals and overflights that appear one after the other.
fn departures() -> Box<dyn Simulation> {
    let text = "format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\nmethod = \"mvp\"\nshield = \"off\"\n\
                dt_s = 10.0\ndtau_s = 5.0\nhorizon_s = 300.0\nvertical_m = 305.0\n\
                [airspace.generator]\nkind = \"terminal\"\nn = 30\narrivals = 10\noverflights = 8\n\
                radius_m = 70000.0\ndeparture_interval_s = 60.0\narrival_interval_s = 80.0\n\
                levels_m = [3050.0, 9150.0]\nspeeds_m_s = [110.0, 160.0]\nclimbs_m_s = [6.0, 15.0]\n\
                [airplane]\nv_m_s = 135.0\nomega_max_deg_s = 1.5\nseparation_m = 9260.0\n";
    let source = Source::new("departures", text, "");
    Box::new(airspace_run(&source, 1).unwrap_or_else(|e| panic!("{e}")))
}

#[test]
fn no_airplane_has_events_before_it_appears() {
    let mut run = departures();
    run.enable_events();
    let mut before = run.frame(FrameOptions::WITHOUT_SCANS);
    let first = before.bodies.len();
    let mut events = 0;
    while !run.is_over() && run.cycle() < 300 {
        run.advance(1);
        let frame = run.frame(FrameOptions::WITHOUT_SCANS);
        for event in &frame.log {
            let whose = [Some(event.who), event.with];
            for airplane in whose.into_iter().flatten() {
                let is_there = before.bodies.iter().any(|body| body.id() == airplane);
                assert!(is_there && event.cycle == before.cycle, "{event:?}");
            }
            events += 1;
        }
        before = frame;
    }
    assert!(events > 10, "{events}");
    assert!(before.bodies.len() != first, "airplanes come and go");
}

#[test]
fn airplanes_have_their_velocity_over_the_ground() {
    let mut run = departures();
    let before = run.frame(FrameOptions::WITHOUT_SCANS);
    run.advance(1);
    let after = run.frame(FrameOptions::WITHOUT_SCANS);
    let mut straight = 0;
    for body in before.bodies.iter().filter(|body| body.kind == AIRPLANE) {
        let Some(later) = after.bodies.iter().find(|later| later.id() == body.id()) else {
            continue;
        };
        assert!(body.velocity_m_s[0].hypot(body.velocity_m_s[1]) > 100.0, "{body:?}");
        let has_turned = (body.pose.turn[3] - later.pose.turn[3]).abs() > 1e-9;
        if has_turned {
            continue;
        }
        for k in 0..2 {
            let moved_m = later.pose.at_m[k] - body.pose.at_m[k];
            assert!((moved_m - 10.0 * body.velocity_m_s[k]).abs() < 1.0, "{body:?} {later:?}");
        }
        straight += 1;
    }
    assert!(straight > 0);
}
