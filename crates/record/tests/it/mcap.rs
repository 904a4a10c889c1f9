//! Recordings for viewers: complete or absent, the same bytes for the same run, read back.

use sidestep_airspace::kinds::{AIRPLANE, ZONE};
use sidestep_chain::kinds::CONNECTOR;
use sidestep_robots::kinds::ROBOT;
use std::path::Path;

use foxglove::messages::LocationFix;
use sidestep_kernel::view::{
    Body, BodyCondition, BodyId, BodyKind, EarthChart, EarthProjection, EarthReference, Frame,
    Isometry2, Kinds, LogEvent, LogEventKind, Occupancy, OccupancyGrid, Pose, Scan, Scenery,
    Severity, Shape,
};
use sidestep_record::{
    IfExists, McapFooter, McapProvenance, McapRecorder, McapRunInfo, McapSceneReader, Status,
    check_mcap, is_mcap,
};

use crate::support::{names, origin};

fn about() -> McapProvenance {
    let files = vec![("maps/floor.pgm".to_string(), vec![7; 1000])];
    McapProvenance {
        world: "robots".into(),
        build: "0.1.0+a".into(),
        origin: origin(),
        files,
        cycles_planned: 100,
        every: 2,
    }
}

fn scenery() -> Scenery {
    let boxes = vec![Occupancy::Free, Occupancy::Wall, Occupancy::Unknown, Occupancy::Free];
    let floor = OccupancyGrid {
        width: 2,
        height: 2,
        box_m: 0.5,
        plane: Isometry2 { origin_m: [1.0, -1.0], yaw_rad: 0.0 },
        boxes,
    };
    let wall = Shape::Line { points_m: vec![[0.0; 3], [1.0, 0.0, 0.0]], thickness_m: 0.0 };
    Scenery {
        name: "small".into(),
        dimensions: 2,
        cycle_s: 0.1,
        floor: Some(floor),
        names: Vec::new(),
        groups: Vec::new(),
        earth: Default::default(),
        traffic: None,
        bodies: vec![Body::new(BodyKind::OBSTACLE, 0, Pose::from_position([0.0; 3]), wall)],
    }
}

/// Bodies of every kind; the airplane leaves after cycle 4.
fn frame(cycle: u64) -> Frame {
    let at_m = [0.1 * cycle as f64, 1.0, 0.0];
    let body = |kind, number, shape| Body::new(kind, number, Pose::from_heading(at_m, 0.3), shape);
    let mut bodies = vec![
        body(ROBOT, 0, Shape::Cuboid { size_m: [0.5, 0.5, 0.2] }),
        body(CONNECTOR, 0, Shape::Sphere { radius_m: 0.1 }).with_part(0),
        body(ZONE, 0, Shape::Cylinder { radius_m: 5.0, height_m: 0.1 })
            .with_condition_if(true, BodyCondition::Touching),
    ];
    if cycle <= 4 {
        bodies.push(body(AIRPLANE, 0, Shape::Dart { length_m: 2.0, width_m: 1.0 }));
    }
    let scan = Scan {
        of: BodyId::new(ROBOT, 0, None),
        sensor: "sonar".into(),
        pose: Pose::from_position(at_m),
        bearings_rad: vec![-0.5, 0.0, 0.5],
        ranges_m: vec![1.0, f64::INFINITY, 2.0],
        true_m: Vec::new(),
        range_m: 3.0,
    };
    let entry = |cycle| LogEvent {
        cycle,
        level: Severity::Warning,
        kind: LogEventKind::Contact,
        who: BodyId::new(ROBOT, 0, None),
        with: None,
        at_m: None,
        value: None,
        words: "touches a wall".into(),
    };
    let log = cycle.checked_sub(1).map(entry).into_iter().collect();
    Frame {
        cycle,
        time_s: cycle as f64 * 0.1,
        bodies,
        scans: vec![scan],
        log,
        log_left_out: 3,
        ..Frame::default()
    }
}

fn end(status: Status) -> McapFooter {
    McapFooter { status, cycles_done: 10, digest: "abc".into() }
}

fn started(path: &Path) -> McapRecorder {
    let mut recorder = McapRecorder::create(path, about(), &scenery()).unwrap();
    (0..=10).step_by(2).for_each(|cycle| recorder.write_frame(&frame(cycle)).unwrap());
    recorder
}

#[test]
fn a_recording_says_what_the_run_was_and_what_is_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let recorder = started(&path);
    assert_eq!(names(folder.path()), ["run.mcap.partial"], "it grows under another name");
    assert_eq!(recorder.finish(&end(Status::Complete)).unwrap(), path);
    assert_eq!(names(folder.path()), ["run.mcap"]);
    let run = McapRunInfo::open(&path).unwrap();
    assert!(is_mcap(&path));
    assert_eq!((run.world.as_str(), run.seed, run.every), ("robots", u64::MAX, 2));
    assert_eq!((run.status, run.cycles_done, run.cycles_planned), (Status::Complete, 10, 100));
    assert_eq!((run.digest.as_str(), run.scenario), ("abc", origin().scenario));
    assert_eq!(run.files, about().files);
    let counts: Vec<_> = run.messages.iter().map(|(topic, n)| (topic.as_str(), *n)).collect();
    let expected = [
        // One per event, and one in each frame for those that were left out.
        ("/log", 5 + 6),
        ("/map", 1),
        ("/poses/airplane", 3),
        ("/poses/connector", 6),
        ("/poses/robot", 6),
        ("/scan/robot/0/sonar", 6),
        ("/scene", 6),
        ("/scenery", 1),
        ("/tf", 6),
    ];
    assert_eq!(counts, expected);
}

#[test]
fn equal_runs_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        started(&path).finish(&end(Status::Complete)).unwrap();
        std::fs::read(path).unwrap()
    };
    assert!(bytes("a.mcap") == bytes("b.mcap"));
}

#[test]
fn a_stopped_run_keeps_partial_and_a_failed_one_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let stopped = started(&path).stop(&end(Status::Incomplete)).unwrap();
    assert_eq!(names(folder.path()), ["run.mcap.partial"]);
    assert_eq!(McapRunInfo::open(&stopped).unwrap().status, Status::Incomplete);
    drop(started(&path));
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn an_existing_file_is_kept_unless_it_is_to_be_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    assert!(McapRecorder::check_vacant(&path, IfExists::Refuse).is_ok());
    std::fs::write(&path, "mine").unwrap();
    assert!(McapRecorder::check_vacant(&path, IfExists::Refuse).is_err());
    assert!(McapRecorder::check_vacant(&path, IfExists::Replace).is_err(), "it is of others");
    assert!(McapRecorder::check_vacant(folder.path(), IfExists::Replace).is_err());
    // Until the new one is whole, the old one stays.
    let recorder = started(&path);
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    recorder.finish(&end(Status::Complete)).unwrap();
    assert!(is_mcap(&path));
    assert!(McapRecorder::check_vacant(&path, IfExists::Refuse).is_err());
    assert!(McapRecorder::check_vacant(&path, IfExists::Replace).is_ok());
    let link = folder.path().join("link.mcap");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    assert!(McapRecorder::check_vacant(&link, IfExists::Replace).is_err());
}

#[test]
fn every_flipped_bit_of_a_recording_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    started(&path).finish(&end(Status::Complete)).unwrap();
    check_mcap(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    // All over the file, and each byte of its end, which has the checksums.
    let all_over = (0..100).map(|k| 8 * (k * whole.len() / 100) + k % 8);
    let at_end = (whole.len() - 60..whole.len()).map(|at| 8 * at + at % 8);
    for bit in all_over.chain(at_end) {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        std::fs::write(&path, &flipped).unwrap();
        assert!(check_mcap(&path).is_err(), "bit {bit} of {}", whole.len() * 8);
    }
    std::fs::write(&path, [&whole[..], b"more"].concat()).unwrap();
    assert!(check_mcap(&path).is_err(), "more bytes than were written");
}

#[test]
fn files_that_lead_out_of_their_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["../up.pgm", "/tmp/root.pgm", "a/../../b", ""] {
        let path = folder.path().join("run.mcap");
        let files = vec![(name.to_string(), vec![1])];
        let recorder = McapRecorder::create(&path, McapProvenance { files, ..about() }, &scenery());
        recorder.unwrap().finish(&end(Status::Complete)).unwrap();
        let error = McapRunInfo::open(&path).unwrap_err();
        assert!(error.cause().contains("a file named"), "{name}: {error}");
    }
}

#[test]
fn damage_is_an_error_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    started(&path).finish(&end(Status::Complete)).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(McapRunInfo::open(&path).is_err(), "{length} bytes of {}", whole.len());
    }
    // A changed byte may lie where nothing is read from; then the result is as it was.
    let sound = {
        std::fs::write(&path, &whole).unwrap();
        McapRunInfo::open(&path).unwrap()
    };
    for at in (0..whole.len()).step_by(31) {
        let mut changed = whole.clone();
        changed[at] ^= 0x55;
        std::fs::write(&path, &changed).unwrap();
        if let Ok(run) = McapRunInfo::open(&path) {
            assert_eq!((run.scenario, run.files), (sound.scenario.clone(), sound.files.clone()));
        }
    }
}

/// Read as part of a summary, a chunk whose size is wrong would overflow the reader's count of what is left of it.
#[test]
fn a_recording_whose_summary_begins_at_a_damaged_chunk_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let whole = {
        started(&path).finish(&end(Status::Complete)).unwrap();
        std::fs::read(&path).unwrap()
    };
    let le = |at: usize| u64::from_le_bytes(whole[at..at + 8].try_into().unwrap()) as usize;
    let summary_start = whole.len() - 8 - 20;
    // A chunk that holds one record, which says to be longer than the chunk.
    let record = [&[0x03][..], &1_000_u64.to_le_bytes(), &[0; 16]].concat();
    let head = [&[0; 16][..], &(record.len() as u64).to_le_bytes(), &[0; 4], &[0; 4]].concat();
    let body = [&head[..], &(record.len() as u64).to_le_bytes(), &record].concat();
    let chunk = [&[0x06][..], &(body.len() as u64).to_le_bytes(), &body].concat();
    let mut changed = [&whole[..le(summary_start)], &chunk, &whole[le(summary_start)..]].concat();
    // What is read after the chunk fills the record.
    changed.splice(le(summary_start) + chunk.len()..le(summary_start) + chunk.len(), [0; 2_000]);
    std::fs::write(&path, &changed).unwrap();
    let error = McapRunInfo::open(&path).unwrap_err().to_string();
    assert!(error.contains("its summary begins among its messages"), "{error}");
}

#[test]
fn a_run_with_a_date_is_recorded_in_utc_with_the_places_of_its_airplanes_on_earth() {
    const START_NS: u64 = 1_533_114_900_000_000_000;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flight.mcap");
    let projection = EarthProjection::AzimuthalEquidistant;
    let earth = EarthReference {
        chart: Some(EarthChart { origin_deg: [10.0, 179.99], projection }),
        start_utc_s: Some(1_533_114_900.0),
    };
    let names = vec![(AIRPLANE, 0, "DAT1".to_string())];
    let scenery = Scenery { earth, names, ..scenery() };
    let mut recorder = McapRecorder::create(&path, about(), &scenery).unwrap();
    (0..=10).step_by(2).for_each(|cycle| recorder.write_frame(&frame(cycle)).unwrap());
    recorder.finish(&end(Status::Complete)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let mut fixes = Vec::new();
    for message in ::mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!((START_NS..=START_NS + 1_000_000_000).contains(&message.log_time));
        if message.channel.topic == "/fix/DAT1" {
            assert_eq!(message.channel.schema.as_ref().unwrap().name, "foxglove.LocationFix");
            let fix = <LocationFix as foxglove::Decode>::decode(&*message.data).unwrap();
            fixes.push((message.log_time - START_NS, fix));
        }
    }
    assert_eq!(fixes.len(), 3, "it is there in cycles 0, 2 and 4");
    let (after_ns, fix) = &fixes[2];
    assert_eq!(*after_ns, 400_000_000);
    // 0.4 m east and 1 m north of the origin.
    assert!((fix.latitude - 10.0 - 1.0 / 110_600.0).abs() < 1e-7, "{}", fix.latitude);
    assert!((fix.longitude - 179.99 - 0.4 / 109_640.0).abs() < 1e-7, "{}", fix.longitude);
    let mut reader = McapSceneReader::open(&path, Kinds::new([AIRPLANE, ROBOT])).unwrap();
    assert!(reader.bodies(4).unwrap().iter().any(|body| body.kind == AIRPLANE));
    assert!(reader.bodies(6).unwrap().iter().all(|body| body.kind != AIRPLANE));
    assert_eq!(reader.events().unwrap()[0].cycle, 1);
}
