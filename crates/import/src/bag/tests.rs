//! Bags that are written here, as ROS 2 and as damage would leave them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, WriteOptions};
use sidestep_kernel::view;
use std::f64::consts::{FRAC_PI_2, PI};

mod inspection;

use super::cdr::{Cdr, encode, encode_ros1};
use super::messages::{
    Header, LaserScan, Odometry, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped,
    TfMessage, Time, TransformStamped, TwistWithCovariance,
};
use super::{BagLog, PoseTopic, TopicSelection, inspect, read, write_clean};
use crate::report::Treatment;
use sidestep_kernel::InputError;

/// A topic, the type of its message, and the message.
type Entry = (&'static str, &'static str, Vec<u8>);

const ODOMETRY: &str = "nav_msgs/msg/Odometry";
const POSE: &str = "geometry_msgs/msg/PoseStamped";
const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";
const SCAN: &str = "sensor_msgs/msg/LaserScan";

fn header(t_ms: u64, frame: &str) -> Header {
    Header { stamp: Time::from_ns(t_ms * 1_000_000), frame_id: frame.into() }
}

fn at(x_m: f64, heading_rad: f64) -> Pose {
    let pose = view::Pose::from_heading([x_m, 0.0, 0.0], heading_rad);
    Pose { position: pose.at_m, orientation: pose.turn }
}

fn odometry(t_ms: u64, x_m: f64) -> Entry {
    let pose = PoseWithCovariance { pose: at(x_m, 0.0), covariance: [0.0; 36] };
    let twist = TwistWithCovariance {
        linear_mps: [0.0; 3],
        angular_radps: [0.0; 3],
        covariance: [0.0; 36],
    };
    let message =
        Odometry { header: header(t_ms, "odom"), child_frame_id: "base".into(), pose, twist };
    ("/odom", ODOMETRY, encode(&message))
}

fn truth(t_ms: u64, x_m: f64) -> Entry {
    posed("/truth", t_ms, at(x_m, 0.0))
}

fn posed(topic: &'static str, t_ms: u64, pose: Pose) -> Entry {
    (topic, POSE, encode(&PoseStamped { header: header(t_ms, "map"), pose }))
}

fn transforms(topic: &'static str, t_ms: u64, edges: &[(&str, &str, Pose)]) -> Entry {
    let transform = |(parent, child, pose): &(&str, &str, Pose)| TransformStamped {
        header: header(t_ms, parent),
        child_frame_id: (*child).into(),
        transform: pose.clone(),
    };
    let transforms = edges.iter().map(transform).collect();
    (topic, TRANSFORMS, encode(&TfMessage { transforms }))
}

fn scan(t_ms: u64, frame: &str, ranges_m: &[f32]) -> Entry {
    let message = LaserScan {
        header: header(t_ms, frame),
        angle_min_rad: -0.5,
        angle_max_rad: 0.5,
        angle_increment_rad: 0.5,
        time_increment_s: 0.0,
        scan_time_s: 0.1,
        range_min_m: 0.1,
        range_max_m: 8.0,
        ranges_m: ranges_m.to_vec(),
        intensities: Vec::new(),
    };
    ("/scan", SCAN, encode(&message))
}

/// The bytes of a bag, packed in chunks of a few messages.
fn bytes_of(entries: &[Entry], compression: Option<Compression>) -> Vec<u8> {
    let options =
        WriteOptions::new().profile("ros2").compression(compression).chunk_size(Some(999));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut channels: BTreeMap<&str, u16> = BTreeMap::new();
    for (k, (topic, schema, data)) in (0..).zip(entries) {
        let id = *channels.entry(topic).or_insert_with(|| {
            let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        let (log_time, publish_time) = (k, k);
        let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A bag in a folder of its own.
fn bag(entries: &[Entry]) -> (tempfile::TempDir, PathBuf) {
    stored(&bytes_of(entries, Some(Compression::Zstd)))
}

fn stored(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hall.mcap");
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn wanted(truth: &str, scans: Option<&str>) -> TopicSelection {
    TopicSelection {
        odometry: Some(PoseTopic::parse("/odom").unwrap()),
        truth: PoseTopic::parse(truth).unwrap(),
        scans: scans.map(String::from),
        ..TopicSelection::default()
    }
}

fn drive() -> Vec<Entry> {
    (0..20).flat_map(|k| [odometry(100 * k, k as f64), truth(100 * k, 2.0 * k as f64)]).collect()
}

fn read_all(entries: &[Entry], wanted: &TopicSelection) -> Result<BagLog, InputError> {
    let (_folder, path) = bag(entries);
    read(&path, wanted)
}

fn refused(entries: &[Entry], wanted: &TopicSelection) -> InputError {
    read_all(entries, wanted).unwrap_err()
}

#[test]
fn poses_are_read_by_their_own_stamps_whatever_packs_the_chunks() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let (_folder, path) = stored(&bytes_of(&drive(), compression));
        let log = read(&path, &wanted("/truth", None)).unwrap();
        assert_eq!((log.odometry.len(), log.truth.len()), (20, 20));
        assert_eq!((log.odometry[3].t_secs, log.odometry[3].position_m), (0.3, [3.0, 0.0]));
        assert_eq!(log.truth[3].position_m, [6.0, 0.0]);
        assert_eq!((log.scans.len(), log.mounts.len()), (0, 0));
    }
}

#[test]
fn every_kind_of_pose_is_a_truth() {
    let pose = at(1.5, FRAC_PI_2);
    let covariance = [0.0; 36];
    let localized = PoseWithCovarianceStamped {
        header: header(0, "map"),
        pose: PoseWithCovariance { pose: pose.clone(), covariance },
    };
    let captured = TransformStamped {
        header: header(0, "map"),
        child_frame_id: "base".into(),
        transform: pose.clone(),
    };
    let kinds = [
        ("/truth", "geometry_msgs/msg/PoseWithCovarianceStamped", encode(&localized)),
        ("/truth", "geometry_msgs/msg/TransformStamped", encode(&captured)),
        transforms("/truth", 0, &[("map", "base", pose.clone())]),
        posed("/truth", 0, pose),
    ];
    for kind in kinds {
        let log = read_all(&[kind, odometry(0, 0.0)], &wanted("/truth", None)).unwrap();
        assert_eq!(log.truth[0].position_m, [1.5, 0.0]);
        assert!((log.truth[0].heading_rad - FRAC_PI_2).abs() < 1e-12);
    }
}

#[test]
fn frames_are_joined_through_those_between_them() {
    let mut entries = vec![
        // Far from the end of the chain, and reported only once.
        transforms("/tf", 0, &[("map", "odom", at(10.0, FRAC_PI_2))]),
        odometry(0, 0.0),
    ];
    entries
        .extend((1..4).map(|k| transforms("/tf", 100 * k, &[("odom", "base", at(k as f64, 0.0))])));
    let log = read_all(&entries, &wanted("/tf:map:base", None)).unwrap_err();
    assert!(log.cause().contains("no time in common"), "{log}");
    entries.push(odometry(300, 3.0));
    let log = read_all(&entries, &wanted("/tf:map:base", None)).unwrap();
    assert_eq!(log.truth.len(), 3);
    assert!((log.truth[2].position_m[0] - 10.0).abs() < 1e-12);
    assert!((log.truth[2].position_m[1] - 3.0).abs() < 1e-12, "{:?}", log.truth[2]);
    let error = refused(&entries, &wanted("/tf", None));
    assert!(error.cause().contains("map > odom, odom > base"), "{error}");
    let error = refused(&entries, &wanted("/tf:map:laser", None));
    assert!(error.cause().contains("`laser`") && error.remedy().contains("odom > base"), "{error}");
}

#[test]
fn a_circle_of_frames_ends() {
    let entries = [transforms("/tf", 0, &[("a", "b", at(0.0, 0.0)), ("b", "a", at(0.0, 0.0))])];
    let wanted = TopicSelection { odometry: None, ..wanted("/tf:map:a", None) };
    assert!(refused(&entries, &wanted).cause().contains("no transforms lead"));
}

#[test]
fn the_scanner_sits_where_static_transforms_put_it() {
    let mount = |statics: &[(&str, &str, Pose)], frame: &str| {
        let mut entries = drive();
        entries.push(scan(50, frame, &[1.0, f32::INFINITY, 2.0]));
        entries.push(transforms("/tf_static", 0, statics));
        let log = read_all(&entries, &wanted("/truth", Some("/scan"))).unwrap();
        assert_eq!(log.scans[0].ranges_m, [1.0, f32::INFINITY, 2.0]);
        log.mounts.get(frame).copied()
    };
    let tree = [
        ("footprint", "base", at(7.0, 0.0)),
        ("base", "plate", at(1.0, FRAC_PI_2)),
        ("plate", "laser", at(2.0, FRAC_PI_2)),
    ];
    // The messages of odometry place `base`: frames below do not count.
    let found = mount(&tree, "laser").unwrap();
    assert!(
        (found.at_m[0] - 1.0).abs() < 1e-12 && (found.at_m[1] - 2.0).abs() < 1e-12,
        "{found:?}"
    );
    assert!((found.rotate([1.0, 0.0, 0.0])[0] + 1.0).abs() < 1e-12);
    assert_eq!(mount(&tree, "base"), Some(view::Pose::from_position([0.0; 3])));
    assert_eq!(mount(&tree, "eye"), None);
}

#[test]
fn a_missing_topic_and_one_of_another_type_name_those_that_are_there() {
    let error = refused(&drive(), &wanted("/nowhere", None));
    assert!(error.place().ends_with("hall.mcap") && error.cause().contains("/nowhere"), "{error}");
    assert!(error.remedy().contains("/odom (nav_msgs/msg/Odometry, 20 messages)"), "{error}");
    let mut entries = drive();
    entries.push(scan(0, "base", &[1.0]));
    let error = refused(&entries, &wanted("/scan", None));
    assert!(error.place().ends_with(": /scan") && error.cause().contains(SCAN), "{error}");
    assert!(error.remedy().contains(POSE), "{error}");
    let error = refused(&entries, &wanted("/truth", Some("/odom")));
    assert!(error.cause().contains(ODOMETRY), "{error}");
}

#[test]
fn of_a_bag_that_ends_in_the_middle_the_whole_chunks_are_read() {
    let bytes = bytes_of(&drive(), Some(Compression::Zstd));
    for end in [9, 100] {
        let (_folder, path) = stored(&bytes[..end]);
        let error = read(&path, &wanted("/truth", None)).unwrap_err();
        assert!(error.cause().contains("cut off"), "{end}: {error}");
    }
    let (_folder, path) = stored(&bytes[..bytes.len() / 2]);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    assert!((1..20).contains(&log.truth.len()), "{}", log.truth.len());
    assert_eq!(log.report.dropped(), 1);
    assert!(log.report.findings[0].rule.contains("cut off"), "{:?}", log.report);
}

#[test]
fn a_damaged_chunk_is_left_out_and_its_messages_are_counted() {
    let mut bytes = bytes_of(&drive(), None);
    let at = bytes.windows(4).position(|w| w == b"base").unwrap();
    bytes[at] = b'B';
    let (_folder, path) = stored(&bytes);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    assert!((10..20).contains(&log.truth.len()), "{}", log.truth.len());
    let found = &log.report.findings[0];
    assert_eq!((found.treatment, &*found.rule), (Treatment::Dropped, "chunks that are damaged"));
    assert!(found.places[0].contains("chunk 1 (its checksum is wrong)"), "{found}");
    assert!(log.report.facts.iter().any(|fact| fact.value.contains(" lost")), "{:?}", log.report);
}

#[test]
fn a_clock_that_is_set_back_starts_a_part_of_its_own_and_messages_that_overtake_are_sorted() {
    let stamps = |stamps: &[u64]| {
        let entries: Vec<Entry> =
            stamps.iter().map(|t_ms| truth(*t_ms, *t_ms as f64 / 1e4)).collect();
        let wanted = TopicSelection { odometry: None, ..wanted("/truth", None) };
        read_all(&entries, &wanted).unwrap()
    };
    let times = |log: &BagLog| log.truth.iter().map(|pose| pose.t_secs).collect::<Vec<_>>();
    let back = stamps(&[0, 1000, 400, 500]);
    assert_eq!(times(&back), [0.0, 1.0, 11.4, 11.5]);
    let late = stamps(&[0, 1000, 400, 1100]);
    assert_eq!((times(&late), late.report.findings.len()), (vec![0.0, 0.4, 1.0, 1.1], 0));
    let found = &back.report.findings[0];
    assert_eq!(found.treatment, Treatment::Repaired);
    assert!(found.places[0].contains("message 3 is stamped 0.600 s before"), "{found}");
    let ahead = stamps(&[100, 4_000_100]);
    assert!(
        ahead.report.findings[0].to_string().contains("4000.000 s after"),
        "{:?}",
        ahead.report
    );
    let sorted = stamps(&[0, 1000, 700, 2000]);
    assert_eq!(times(&sorted), [0.0, 0.7, 1.0, 2.0]);
    assert_eq!(sorted.report.findings, []);
}

#[test]
fn a_bag_that_was_played_in_a_loop_compares_each_round_with_itself() {
    // Two rounds of the same stamps; odometry and truth belong together in each.
    let round = |shift_m: f64| {
        (0..20).flat_map(move |k| {
            [odometry(100 * k, 0.1 * k as f64), truth(100 * k, shift_m + 0.1 * k as f64)]
        })
    };
    let entries: Vec<Entry> = round(0.0).chain(round(0.0)).collect();
    let log = read_all(&entries, &wanted("/truth", None)).unwrap();
    assert_eq!((log.odometry.len(), log.truth.len()), (40, 40));
    for (a, b) in log.odometry.iter().zip(log.truth.iter()) {
        assert_eq!((a.t_secs, a.position_m), (b.t_secs, b.position_m));
    }
    assert!(log.truth[20].t_secs - log.truth[19].t_secs >= 10.0);
}

#[test]
fn stamps_that_nobody_has_set_are_those_of_the_recording() {
    let entries: Vec<Entry> = (0..20).map(|k| truth(0, 0.001 * k as f64)).collect();
    let wanted = TopicSelection { odometry: None, ..wanted("/truth", None) };
    let log = read_all(&entries, &wanted).unwrap();
    assert_eq!(log.truth[3].t_secs, 3e-9);
    assert!(
        log.report.findings[0].to_string().starts_with("guessed: the stamps of /truth are all 0")
    );
}

#[test]
fn two_clocks_that_have_no_time_in_common_are_told() {
    let entries = [odometry(0, 0.0), odometry(5000, 0.0), truth(9000, 0.0)];
    let error = refused(&entries, &wanted("/truth", None));
    assert!(error.cause().contains("/odom (0.0 to 5.0 s) and /truth (9.0 to 9.0 s)"), "{error}");
    assert!(error.remedy().contains("use_sim_time"));
}

#[test]
fn a_message_that_is_none_is_left_out_and_counted() {
    let lost = |bad: Entry| {
        let mut entries = drive();
        entries.push(bad);
        let log = read_all(&entries, &wanted("/truth", None)).unwrap();
        assert_eq!((log.truth.len(), log.report.dropped()), (20, 1));
        log.report.findings[0].to_string()
    };
    let unturned = Pose { orientation: [0.0; 4], ..at(0.0, 0.0) };
    assert_eq!(
        lost(posed("/truth", 1, unturned)),
        "dropped: messages on /truth that cannot be read, message 21: its orientation is 0, 0, 0, 0, which is none"
    );
    assert!(lost(posed("/truth", 1, at(f64::NAN, 0.0))).contains("finite"));
    assert!(lost(("/truth", POSE, encode(&1_u32))).contains("ends before"));
    assert!(lost(("/truth", POSE, vec![0x28, 0xb5, 0x2f, 0xfd, 9])).contains("unpacked"));
}

#[test]
fn a_topic_of_which_more_than_half_is_bad_is_an_error() {
    let bad = || posed("/truth", 1, at(f64::NAN, 0.0));
    let mut entries = vec![odometry(0, 0.0), truth(0, 0.0), bad()];
    assert!(read_all(&entries, &wanted("/truth", None)).is_ok());
    entries.push(bad());
    let error = refused(&entries, &wanted("/truth", None));
    assert!(error.place().ends_with(": /truth"), "{error}");
    assert_eq!(
        error.cause(),
        "2 of 3 messages cannot be read, first message 2: its pose has a number that is not finite"
    );
}

#[test]
fn a_scan_without_beams_or_limits_is_left_out() {
    let mut entries = drive();
    entries.push(scan(0, "base", &[]));
    entries.extend((1..12).map(|k| scan(100 * k, "base", &[1.0, f32::INFINITY])));
    entries.push(scan(1200, "base", &[f32::NAN, 0.0]));
    let log = read_all(&entries, &wanted("/truth", Some("/scan"))).unwrap();
    assert_eq!((log.scans.len(), log.report.dropped()), (11, 2));
    let lines: Vec<String> = log.report.findings.iter().map(ToString::to_string).collect();
    assert!(lines[0].ends_with("message 1: its scan has 0 beams"), "{lines:?}");
    assert!(
        lines[1].contains("scans on /scan in which every range is NaN or 0, message 13"),
        "{lines:?}"
    );
}

#[test]
fn an_orientation_of_another_length_is_the_turn_that_it_points_to() {
    let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 1.999, 0.0] };
    let log =
        read_all(&[odometry(0, 0.0), posed("/truth", 0, pose)], &wanted("/truth", None)).unwrap();
    assert!((log.truth[0].heading_rad.abs() - PI).abs() < 1e-9);
    let said = log.report.findings.iter().map(ToString::to_string).collect::<Vec<_>>();
    let words = "repaired: orientations on /truth whose length is not 1, of which the direction counts, message 1";
    assert_eq!(said, [words]);
}

#[test]
fn files_of_other_kinds_are_refused() {
    for bytes in [&b"t,x,y\n0,1,2\n"[..], b"", b"#ROSBAG V1.2\n", b"SQLite format 3\0 and no more"]
    {
        let (_folder, path) = stored(bytes);
        assert!(read(&path, &wanted("/truth", None)).is_err(), "{bytes:?}");
    }
    let error = read(Path::new("nowhere.mcap"), &wanted("/truth", None)).unwrap_err();
    assert!(error.cause().contains("cannot be read"), "{error}");
}

/// What was read, without the report.
fn content(log: BagLog) -> BagLog {
    BagLog { report: crate::ImportReport::default(), ..log }
}

/// The bag that all others equal.
fn plain() -> BagLog {
    content(read_all(&drive(), &wanted("/truth", None)).unwrap())
}

#[test]
fn messages_files_and_both_that_are_packed_read_the_same() {
    let packed: Vec<Entry> = drive()
        .into_iter()
        .map(|(topic, schema, bytes)| (topic, schema, zstd::encode_all(&bytes[..], 3).unwrap()))
        .collect();
    let log = read_all(&packed, &wanted("/truth", None)).unwrap();
    assert!(
        log.report.facts.iter().any(|fact| fact.value == "zstd, message by message (40 messages)")
    );
    assert_eq!(content(log), plain());
    let bytes = bytes_of(&drive(), None);
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut gzip, &bytes).unwrap();
    for whole in [zstd::encode_all(&bytes[..], 3).unwrap(), gzip.finish().unwrap()] {
        let (_folder, path) = stored(&whole);
        assert_eq!(content(read(&path, &wanted("/truth", None)).unwrap()), plain());
    }
}

/// Writes a bag in SQLite as `ros2 bag record` does.
fn write_sqlite(path: &Path, entries: &[Entry]) {
    let database = rusqlite::Connection::open(path).unwrap();
    database.execute_batch("PRAGMA synchronous = OFF").unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL); \
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
             data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
        )
        .unwrap();
    let mut topics: BTreeMap<&str, i64> = BTreeMap::new();
    for (k, (topic, schema, data)) in (0_i64..).zip(entries) {
        let next = topics.len() as i64 + 1;
        let id = *topics.entry(topic).or_insert_with(|| {
            let row = rusqlite::params![next, topic, schema];
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", row).unwrap();
            next
        });
        let row = rusqlite::params![id, k, data];
        database
            .execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row)
            .unwrap();
    }
}

#[test]
fn a_bag_in_sqlite_reads_the_same_as_file_as_folder_by_metadata_and_packed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hall_0.db3");
    write_sqlite(&path, &drive());
    let read_at = |path: &Path| content(read(path, &wanted("/truth", None)).unwrap());
    assert_eq!(read_at(&path), plain());
    assert_eq!(read_at(folder.path()), plain());
    let metadata = folder.path().join("metadata.yaml");
    fs::write(&metadata, "rosbag2_bagfile_information: {relative_file_paths: [hall_0.db3]}\n")
        .unwrap();
    assert_eq!(read_at(&metadata), plain());
    let packed = folder.path().join("hall_0.db3.zstd");
    fs::write(&packed, zstd::encode_all(&fs::read(&path).unwrap()[..], 3).unwrap()).unwrap();
    fs::remove_file(&path).unwrap();
    assert_eq!(read_at(&packed), plain());
    assert_eq!(read_at(folder.path()), plain());
}

#[test]
fn a_bag_in_sqlite_is_read_where_it_may_not_be_written_and_runs_nothing_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a b?#%.db3");
    write_sqlite(&path, &drive());
    let database = rusqlite::Connection::open(&path).unwrap();
    database.pragma_update(None, "journal_mode", "WAL").unwrap();
    drop(database);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    assert_eq!(content(log), plain());
    let database = rusqlite::Connection::open(&path).unwrap();
    let endless = "ALTER TABLE messages RENAME TO m; CREATE VIEW messages AS WITH RECURSIVE n(x) AS \
                   (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x AS id, 1 AS topic_id, x AS timestamp, \
                   zeroblob(9) AS data FROM n;";
    database.execute_batch(endless).unwrap();
    drop(database);
    assert!(read(&path, &wanted("/truth", None)).is_err());
}

/// A record of a bag of ROS 1.
fn ros1_record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let length = |bytes: &[u8]| u32::try_from(bytes.len()).unwrap().to_le_bytes();
    let mut header = Vec::new();
    for (name, value) in fields {
        let field = [name.as_bytes(), b"=", value].concat();
        header.extend(length(&field));
        header.extend(field);
    }
    [&length(&header)[..], &header, &length(data), data].concat()
}

/// A bag of ROS 1 with one chunk, packed by a program of the given name.
fn ros1_bytes(entries: &[(&str, &str, Vec<u8>)], compression: &str) -> Vec<u8> {
    let mut chunk = Vec::new();
    let mut topics: BTreeMap<&str, u32> = BTreeMap::new();
    for (k, (topic, kind, data)) in (0_u32..).zip(entries) {
        let next = u32::try_from(topics.len()).unwrap();
        let id = *topics.entry(topic).or_insert_with(|| {
            let publisher =
                ros1_record(&[("topic", topic.as_bytes()), ("type", kind.as_bytes())], b"");
            let fields: [(&str, &[u8]); 3] =
                [("op", &[7]), ("conn", &next.to_le_bytes()), ("topic", topic.as_bytes())];
            // The data of a connection are a header of their own.
            let length = u32::from_le_bytes(publisher[..4].try_into().unwrap()) as usize;
            chunk.extend(ros1_record(&fields, &publisher[4..4 + length]));
            next
        });
        let time = [0_u32.to_le_bytes(), k.to_le_bytes()].concat();
        let fields: [(&str, &[u8]); 3] =
            [("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time)];
        chunk.extend(ros1_record(&fields, data));
    }
    let packed = match compression {
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            std::io::Write::write_all(&mut encoder, &chunk).unwrap();
            encoder.finish().unwrap()
        }
        "lz4" => {
            let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
            std::io::Write::write_all(&mut encoder, &chunk).unwrap();
            encoder.finish().0
        }
        _ => chunk.clone(),
    };
    let size = u32::try_from(chunk.len()).unwrap().to_le_bytes();
    let chunk_fields: [(&str, &[u8]); 3] =
        [("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)];
    [
        b"#ROSBAG V2.0\n".to_vec(),
        ros1_record(&[("op", &[3]), ("index_pos", &[0; 8])], &[b' '; 99]),
        ros1_record(&chunk_fields, &packed),
    ]
    .concat()
}

/// The drive as ROS 1 writes it.
fn ros1_drive() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    drive()
        .into_iter()
        .map(|(topic, schema, bytes)| match schema {
            ODOMETRY => {
                let message: Odometry = super::cdr::decode(&bytes).unwrap();
                (topic, "nav_msgs/Odometry", encode_ros1(&message))
            }
            _ => {
                let message: PoseStamped = super::cdr::decode(&bytes).unwrap();
                (topic, "geometry_msgs/PoseStamped", encode_ros1(&message))
            }
        })
        .collect()
}

#[test]
fn a_bag_of_ros_1_reads_the_same_whatever_packs_its_chunks() {
    for compression in ["none", "bz2", "lz4"] {
        let (_folder, path) = stored(&ros1_bytes(&ros1_drive(), compression));
        let log = read(&path, &wanted("/truth", None)).unwrap();
        assert_eq!(log.report.format, "bag of ROS 1");
        assert_eq!(content(log), plain(), "{compression}");
    }
}

#[test]
fn a_bag_of_ros_1_that_is_cut_or_damaged_is_read_as_far_as_it_goes() {
    let mut bytes = ros1_bytes(&ros1_drive(), "bz2");
    let chunk = ros1_bytes(&ros1_drive(), "none").split_off(13);
    bytes.extend(&chunk[..chunk.len() - 5]);
    let (_folder, path) = stored(&bytes);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    assert_eq!((log.truth.len(), log.report.dropped()), (20, 1));
    let middle = bytes.len() / 4;
    bytes[middle] ^= 0x55;
    let (_folder, path) = stored(&bytes);
    let _ = read(&path, &wanted("/truth", None));
}

#[test]
fn transforms_that_ros_1_repeats_place_the_scanner_too() {
    let repeated = |k: u64| transforms("/tf", 100 * k, &[("/base", "/laser", at(0.5, 0.0))]);
    let mut entries = drive();
    entries.extend((0..5).map(repeated));
    entries.extend((0..5).map(|k| scan(100 * k, "/laser", &[1.0, 2.0])));
    let log = read_all(&entries, &wanted("/truth", Some("/scan"))).unwrap();
    assert_eq!(log.mounts["laser"].at_m, [0.5, 0.0, 0.0]);
    entries.push(transforms("/tf", 600, &[("base", "laser", at(0.7, 0.0))]));
    let log = read_all(&entries, &wanted("/truth", Some("/scan"))).unwrap();
    assert_eq!(log.mounts.get("laser"), None, "it moves");
}

#[test]
fn the_clean_bag_has_the_messages_that_can_be_read() {
    let mut entries = drive();
    entries.insert(7, posed("/truth", 1, at(f64::NAN, 0.0)));
    entries.push(("/note", "std_msgs/msg/String", encode(&String::from("kept as it is"))));
    for packed in [false, true] {
        let entries: Vec<Entry> = entries
            .iter()
            .map(|(topic, schema, bytes)| match packed {
                true => (*topic, *schema, zstd::encode_all(&bytes[..], 3).unwrap()),
                false => (*topic, *schema, bytes.clone()),
            })
            .collect();
        let (folder, path) = bag(&entries);
        let out = folder.path().join("clean.mcap");
        let report = write_clean(&path, &out).unwrap();
        assert_eq!(report.dropped(), 1, "{report:?}");
        let clean = inspect(&out).unwrap();
        assert_eq!((clean.dropped(), clean.kept[1].count), (0, 41));
        assert_eq!(content(read(&out, &wanted("/truth", None)).unwrap()), plain());
    }
    let (folder, path) = stored(&ros1_bytes(&ros1_drive(), "bz2"));
    let out = folder.path().join("clean.mcap");
    write_clean(&path, &out).unwrap();
    assert_eq!(content(read(&out, &wanted("/truth", None)).unwrap()), plain());
}

#[test]
fn a_folder_is_read_in_the_order_that_its_metadata_list_or_else_of_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for (k, name) in [(0_u64, "hall_9.mcap"), (1, "hall_10.mcap")] {
        let entries = [odometry(1000 * k, k as f64), truth(1000 * k, k as f64)];
        fs::write(folder.path().join(name), bytes_of(&entries, None)).unwrap();
    }
    let read_folder = || read(folder.path(), &wanted("/truth", None));
    assert_eq!(read_folder().unwrap().truth.len(), 2);
    let metadata = folder.path().join("metadata.yaml");
    let listing =
        "rosbag2_bagfile_information:\n  relative_file_paths:\n    - hall_9.mcap\n  files:\n";
    fs::write(&metadata, listing).unwrap();
    assert_eq!(read_folder().unwrap().truth.len(), 1);
    // In the wrong order one message is late.
    let turned = "  relative_file_paths:\n  - \"hall_10.mcap\"\n  - 'hall_9.mcap'\n";
    fs::write(&metadata, turned).unwrap();
    let late = read_folder().unwrap();
    assert_eq!(late.truth.iter().map(|pose| pose.t_secs).collect::<Vec<_>>(), [0.0, 1.0]);
    fs::write(&metadata, "a: b\n").unwrap();
    assert!(read_folder().unwrap_err().remedy().contains("delete metadata.yaml"));
    fs::remove_file(&metadata).unwrap();
    assert_eq!(read_folder().unwrap().truth.len(), 2);
    fs::remove_file(folder.path().join("hall_9.mcap")).unwrap();
    fs::remove_file(folder.path().join("hall_10.mcap")).unwrap();
    assert!(read_folder().unwrap_err().cause().contains("no .mcap, .db3 or .bag file"));
}

#[test]
fn a_source_is_a_topic_alone_or_with_one_frame_or_two() {
    let source = PoseTopic::parse("/tf:map:robot/base").unwrap();
    assert_eq!(source.frames, Some(("map".into(), "robot/base".into())));
    assert_eq!(PoseTopic::parse("/odom").unwrap().frames, None);
    assert_eq!(PoseTopic::parse("/truth:map").unwrap().frames, Some(("map".into(), String::new())));
    for wrong in ["", "/tf:", "/tf::base", "/tf:a:b:c"] {
        assert!(PoseTopic::parse(wrong).unwrap_err().remedy().contains("/tf:map:base_link"));
    }
}

/// The messages of a bag with the times of their recording, in ms.
fn timed_bag(entries: &[(u64, Entry)]) -> (tempfile::TempDir, PathBuf) {
    let mut writer = WriteOptions::new().profile("ros2").create(Cursor::new(Vec::new())).unwrap();
    let mut channels: BTreeMap<&str, u16> = BTreeMap::new();
    for (log_ms, (topic, schema, data)) in entries {
        let channel_id = *channels.entry(topic).or_insert_with(|| {
            let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        let log_time = log_ms * 1_000_000;
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    stored(&writer.into_inner().into_inner())
}

/// A drive of 30 s whose truth is stamped by a clock of its own; returns the truth, and what is said.
fn read_with_clock(stamp_ms: impl Fn(u64) -> u64) -> (Vec<(f64, f64)>, Vec<String>) {
    let mut entries = Vec::new();
    for k in 0..300 {
        let t_ms = 7_000_000 + 100 * k;
        // It stands in every third second, so that its motion tells the time.
        let x_m = 0.1 * (k - 10 * (k / 30)).min(20 * (k / 30) + 20) as f64;
        entries.push((t_ms + 5, odometry(t_ms, x_m)));
        entries.push((t_ms + 6, truth(stamp_ms(t_ms), x_m)));
    }
    let (_folder, path) = timed_bag(&entries);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    let truth = log.truth.iter().map(|pose| (pose.t_secs, pose.position_m[0])).collect();
    (truth, log.report.findings.iter().map(ToString::to_string).collect())
}

#[test]
fn topics_whose_clocks_differ_are_moved_where_stamps_cannot_be_and_named_elsewhere() {
    let (truth, said) = read_with_clock(|t_ms| t_ms);
    assert_eq!((truth[100].0, said), (7010.0, Vec::new()));
    let (ahead, said) = read_with_clock(|t_ms| t_ms + 1000);
    assert!((ahead[100].0 - 7010.0).abs() < 0.01, "{:?}", ahead[100]);
    assert!(
        said[0].starts_with("guessed: the stamps of /truth lie 0.994 s after the recording"),
        "{said:?}"
    );
    let (behind, said) = read_with_clock(|t_ms| t_ms - 1000);
    assert_eq!(behind[100].0, 7009.0);
    assert!(
        said[0].starts_with("suspicious: the stamps of /truth are 1.001 s behind those of /odom"),
        "{said:?}"
    );
}

#[test]
fn a_bag_that_was_played_three_times_as_fast_keeps_its_stamps() {
    let mut entries = Vec::new();
    for k in 0..100 {
        let t_ms = 7_000_000 + 1000 * k;
        let recorded_ms = 9_000_000 + 1000 * k / 3;
        entries.push((recorded_ms + 5, odometry(t_ms, 0.1 * k as f64)));
        entries.push((recorded_ms + 6, truth(t_ms, 0.1 * k as f64)));
    }
    let (_folder, path) = timed_bag(&entries);
    let log = read(&path, &wanted("/truth", None)).unwrap();
    assert_eq!((log.truth.len(), log.truth[99].t_secs), (100, 7099.0));
    let said: Vec<String> = log.report.findings.iter().map(ToString::to_string).collect();
    assert!(
        said.len() == 1
            && said[0]
                .starts_with("note: the stamps of /odom (odom > base) and 1 more run 3.00 times"),
        "{said:?}"
    );
}

#[test]
fn a_clock_that_is_set_a_thousand_times_is_refused() {
    let wanted = TopicSelection { odometry: None, ..wanted("/truth", None) };
    let back: Vec<Entry> = (0..4012).map(|k| truth(1000 * (1 - k / 2 % 2) + 1, 0.0)).collect();
    let error = refused(&back, &wanted);
    assert!(error.cause().starts_with("the clock of its stamps is set "), "{error}");
}

#[test]
fn the_clock_of_one_topic_that_is_set_is_set_back_by_the_times_of_the_recording() {
    for step_ms in [2000_i64, -2000] {
        let (truth, said) = read_with_clock(|t_ms| {
            if t_ms < 7_015_000 { t_ms } else { t_ms.checked_add_signed(step_ms).unwrap() }
        });
        // Parts are ten seconds apart; what lies after the step is as long after its start as it was.
        let (start, end) = (truth[150], truth[299]);
        assert!((end.0 - start.0 - 14.9).abs() < 0.01, "{start:?} {end:?}");
        let undone = said
            .iter()
            .find(|line| line.contains("was set and that of /odom (odom > base) was not"));
        assert!(undone.is_some_and(|line| line.contains("from message 151 on by")), "{said:?}");
        assert!(!said.iter().any(|line| line.contains("is that by /odom")), "{said:?}");
    }
}

#[test]
fn stamps_of_one_message_that_are_none_are_left_out() {
    let (truth, said) = read_with_clock(|t_ms| match t_ms {
        7_010_000 => 0,
        7_011_000 => 9_000_000,
        _ => t_ms,
    });
    assert_eq!(truth.len(), 298, "{said:?}");
    let dropped: Vec<&String> = said.iter().filter(|line| line.starts_with("dropped")).collect();
    assert!(dropped[0].contains("whose stamp is 0, message 101"), "{said:?}");
    assert!(
        dropped[1].contains("whose stamp is ahead of those before and after it, message 111"),
        "{said:?}"
    );
}

#[test]
fn frames_with_two_parents_are_joined_by_the_pair_that_is_asked_for() {
    let edges = |k: u64| {
        let x_m = k as f64;
        transforms(
            "/tf",
            100 * k,
            &[("map", "base", at(2.0 * x_m, 0.0)), ("odom", "base", at(x_m, 0.0))],
        )
    };
    let entries: Vec<Entry> = (0..20).map(edges).collect();
    let selection = |odometry: &str, truth: &str| TopicSelection {
        odometry: Some(PoseTopic::parse(odometry).unwrap()),
        ..wanted(truth, None)
    };
    let log = read_all(&entries, &selection("/tf:odom:base", "/tf:map:base")).unwrap();
    assert_eq!((log.odometry[3].position_m[0], log.truth[3].position_m[0]), (3.0, 6.0));
}

/// As many comparisons as pairs of links would not end.
#[test]
fn a_frame_with_a_hundred_thousand_parents_is_found() {
    let mut edges: Vec<(String, String)> =
        (0..100_000).map(|k| (format!("p{k}"), "base".to_owned())).collect();
    edges.push(("map".into(), "p99999".into()));
    let edges: Vec<(&str, &str, Pose)> =
        edges.iter().map(|(outer, inner)| (&**outer, &**inner, at(1.0, 0.0))).collect();
    let entries = [transforms("/tf", 0, &edges), transforms("/tf", 100, &edges)];
    let selection = TopicSelection { odometry: None, ..wanted("/tf:map:base", None) };
    let log = read_all(&entries, &selection).unwrap();
    assert_eq!(log.truth[0].position_m, [2.0, 0.0]);
    let selection = TopicSelection { odometry: None, ..wanted("/tf:no:base", None) };
    assert!(refused(&entries, &selection).cause().contains("no transforms lead"));
}

#[test]
fn static_transforms_lead_on_where_those_that_change_do_not() {
    let mut entries: Vec<Entry> = (0..20)
        .map(|k| transforms("/tf", 100 * k, &[("map", "foot", at(k as f64, FRAC_PI_2))]))
        .collect();
    entries.push(transforms("/tf_static", 0, &[("foot", "base", at(0.5, 0.0))]));
    let selection = TopicSelection { odometry: None, ..wanted("/tf:map:base", None) };
    let log = read_all(&entries, &selection).unwrap();
    let [x_m, y_m] = log.truth[3].position_m;
    assert!((x_m - 3.0).abs() < 1e-12 && (y_m - 0.5).abs() < 1e-12, "{:?}", log.truth[3]);
}

#[test]
fn the_remedy_for_several_frames_is_one_that_works() {
    let mut entries = drive();
    entries.extend((0..20).map(|k| {
        let header = header(100 * k, "world");
        ("/truth", POSE, encode(&PoseStamped { header, pose: at(5.0, 0.0) }))
    }));
    let error = refused(&entries, &wanted("/truth", None));
    let advised = error.remedy().strip_prefix("give one of them: ").unwrap();
    assert_eq!(advised, "/truth:map");
    let log = read_all(&entries, &wanted(advised, None)).unwrap();
    assert_eq!((log.truth.len(), log.truth[3].position_m[0]), (20, 6.0));
}

#[test]
fn rows_on_a_damaged_page_of_sqlite_are_lost_and_those_behind_it_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hall_0.db3");
    let entries: Vec<Entry> = (0..400).map(|k| truth(100 * k, 0.01 * k as f64)).collect();
    write_sqlite(&path, &entries);
    let whole = fs::read(&path).unwrap();
    let selection = TopicSelection { odometry: None, ..wanted("/truth", None) };
    assert_eq!(read(&path, &selection).unwrap().truth.len(), 400);
    // A page in the middle of the table becomes zeros.
    let mut damaged = whole.clone();
    let page = damaged.len() / 2 / 4096 * 4096;
    damaged[page..page + 4096].fill(0);
    fs::write(&path, &damaged).unwrap();
    let log = read(&path, &selection).unwrap();
    assert!((320..400).contains(&log.truth.len()), "{}", log.truth.len());
    assert!(log.truth.last().unwrap().t_secs > 39.0, "rows behind the page");
    assert_eq!(log.report.findings[0].rule, "rows on damaged pages of a file");
    // A copy that was interrupted.
    fs::write(&path, &whole[..whole.len() * 7 / 10]).unwrap();
    let log = read(&path, &selection).unwrap();
    assert!((200..380).contains(&log.truth.len()), "{}", log.truth.len());
    assert_eq!(log.report.findings[0].rule, "the end of a file that is cut off");
}

#[test]
fn a_file_that_is_missing_between_others_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (name, part) in [("hall_0.mcap", &drive()[..20]), ("hall_2.mcap", &drive()[20..])] {
        fs::write(folder.path().join(name), bytes_of(part, None)).unwrap();
    }
    let log = read(folder.path(), &wanted("/truth", None)).unwrap();
    let said = log.report.findings[0].to_string();
    assert!(
        said.starts_with("dropped: files of the bag that are not there, hall_1.mcap"),
        "{said}"
    );
}

proptest::proptest! {
    #[test]
    fn any_bytes_after_the_beginning_are_a_bag_or_an_error(tail: Vec<u8>, cut in 0_usize..2000) {
        for mut bytes in [bytes_of(&drive(), None), ros1_bytes(&ros1_drive(), "none")] {
            bytes.truncate(cut.max(13));
            bytes.extend(&tail);
            let (_folder, path) = stored(&bytes);
            let _ = read(&path, &wanted("/truth", None));
        }
    }

    #[test]
    fn any_damage_to_a_bag_in_sqlite_is_skipped_or_an_error(
        damage in proptest::collection::vec((0_usize..20_000, proptest::num::u8::ANY), 1..9),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        write_sqlite(&path, &drive()[..6]);
        let mut bytes = fs::read(&path).unwrap();
        for (at, value) in damage {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        fs::write(&path, bytes).unwrap();
        let _ = read(&path, &wanted("/truth", None));
    }
}

/// Only types with bytes are messages: a list of them would claim memory without any.
#[test]
fn every_message_takes_some_bytes() {
    fn least<T: Cdr>() -> usize {
        T::MIN_BYTES
    }
    assert_eq!(
        [least::<TransformStamped>(), least::<Odometry>(), least::<LaserScan>()],
        [72, 696, 48]
    );
}
