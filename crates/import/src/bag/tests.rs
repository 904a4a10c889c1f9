//! Bags that are written here, as ROS 2 and as damage would leave them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, WriteOptions};
use sidestep_kernel::view;
use std::f64::consts::{FRAC_PI_2, PI};

use super::cdr::{Cdr, encode};
use super::messages::{
    Header, LaserScan, Odometry, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped,
    TfMessage, Time, TransformStamped, TwistWithCovariance,
};
use super::{BagLog, PoseTopic, TopicSelection, read};
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
        assert_eq!((log.scans.len(), log.mount), (0, None));
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
        log.mount
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
fn a_bag_that_ends_in_the_middle_is_cut_off() {
    let bytes = bytes_of(&drive(), Some(Compression::Zstd));
    for end in [9, 100, bytes.len() / 2, bytes.len() - 1] {
        let (_folder, path) = stored(&bytes[..end]);
        let error = read(&path, &wanted("/truth", None)).unwrap_err();
        assert!(error.cause().contains("cut off"), "{end}: {error}");
        assert!(error.remedy().contains("mcap recover"), "{error}");
    }
}

#[test]
fn damage_within_a_chunk_is_found() {
    let mut bytes = bytes_of(&drive(), None);
    let at = bytes.windows(4).position(|w| w == b"base").unwrap();
    bytes[at] = b'B';
    let (_folder, path) = stored(&bytes);
    let error = read(&path, &wanted("/truth", None)).unwrap_err();
    assert!(error.cause().contains("damaged"), "{error}");
}

#[test]
fn a_clock_that_is_set_is_an_error_and_messages_that_overtake_are_sorted() {
    let stamps = |stamps: &[u64]| {
        let mut entries = vec![odometry(0, 0.0), odometry(9_000_000, 0.0)];
        entries.extend(stamps.iter().map(|t_ms| truth(*t_ms, *t_ms as f64)));
        let wanted = TopicSelection { odometry: None, ..wanted("/truth", None) };
        read_all(&entries, &wanted)
    };
    let error = stamps(&[0, 1000, 400]).unwrap_err();
    assert!(error.place().ends_with(": /truth"), "{error}");
    assert!(error.cause().contains("message 3 is stamped 0.600 s before"), "{error}");
    let error = stamps(&[0, 4_000_000]).unwrap_err();
    assert!(error.cause().contains("4000.000 s after"), "{error}");
    let sorted = stamps(&[0, 1000, 700, 2000]).unwrap().truth;
    assert_eq!(sorted.iter().map(|p| p.t_secs).collect::<Vec<_>>(), [0.0, 0.7, 1.0, 2.0]);
}

#[test]
fn two_clocks_that_have_no_time_in_common_are_told() {
    let entries = [odometry(0, 0.0), odometry(5000, 0.0), truth(9000, 0.0)];
    let error = refused(&entries, &wanted("/truth", None));
    assert!(error.cause().contains("/odom (0.0 to 5.0 s) and /truth (9.0 to 9.0 s)"), "{error}");
    assert!(error.remedy().contains("use_sim_time"));
}

#[test]
fn a_message_that_is_none_is_told_by_its_number() {
    let empty = |pose: Pose| {
        let error = refused(
            &[odometry(0, 0.0), truth(0, 0.0), posed("/truth", 1, pose)],
            &wanted("/truth", None),
        );
        assert!(error.place().ends_with("/truth, message 2"), "{error}");
        error.cause().to_owned()
    };
    assert!(empty(Pose { orientation: [0.0; 4], ..at(0.0, 0.0) }).contains("orientation"));
    assert!(empty(at(f64::NAN, 0.0)).contains("finite"));
    let cut = ("/truth", POSE, encode(&1_u32));
    let error = refused(&[odometry(0, 0.0), cut], &wanted("/truth", None));
    assert!(error.cause().contains("ends before"), "{error}");
    let mut entries = drive();
    entries.push(scan(0, "base", &[]));
    let error = refused(&entries, &wanted("/truth", Some("/scan")));
    assert!(error.cause().contains("0 beams"), "{error}");
}

#[test]
fn an_orientation_of_another_length_is_the_turn_that_it_points_to() {
    let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 1.999, 0.0] };
    let log =
        read_all(&[odometry(0, 0.0), posed("/truth", 0, pose)], &wanted("/truth", None)).unwrap();
    assert!((log.truth[0].heading_rad.abs() - PI).abs() < 1e-9);
}

#[test]
fn files_of_other_kinds_say_how_to_convert_them() {
    let cases: [(&[u8], &str); 4] = [
        (b"#ROSBAG V2.0\n", "rosbags-convert"),
        (b"SQLite format 3\0", "ros2 bag convert"),
        (&[0x28, 0xb5, 0x2f, 0xfd, 0, 0, 0, 0], "zstd -d"),
        (b"t,x,y\n0,1,2\n", "ros2 bag record"),
    ];
    for (bytes, remedy) in cases {
        let (_folder, path) = stored(bytes);
        let error = read(&path, &wanted("/truth", None)).unwrap_err();
        assert!(error.remedy().contains(remedy), "{error}");
    }
    let error = read(Path::new("nowhere.mcap"), &wanted("/truth", None)).unwrap_err();
    assert!(error.cause().contains("cannot be read"), "{error}");
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
    // In the wrong order the clock goes back.
    let turned = "  relative_file_paths:\n  - \"hall_10.mcap\"\n  - 'hall_9.mcap'\n";
    fs::write(&metadata, turned).unwrap();
    assert!(read_folder().unwrap_err().cause().contains("the clock jumps"));
    fs::write(&metadata, "a: b\n").unwrap();
    assert!(read_folder().unwrap_err().remedy().contains("reindex"));
    fs::remove_file(&metadata).unwrap();
    fs::remove_file(folder.path().join("hall_9.mcap")).unwrap();
    fs::remove_file(folder.path().join("hall_10.mcap")).unwrap();
    assert!(read_folder().unwrap_err().cause().contains("no .mcap file"));
}

#[test]
fn a_source_is_a_topic_or_a_topic_and_two_frames() {
    let source = PoseTopic::parse("/tf:map:robot/base").unwrap();
    assert_eq!(source.frames, Some(("map".into(), "robot/base".into())));
    assert_eq!(PoseTopic::parse("/odom").unwrap().frames, None);
    for wrong in ["", "/tf:map", "/tf::base", "/tf:a:b:c"] {
        assert!(PoseTopic::parse(wrong).unwrap_err().remedy().contains("/tf:map:base_link"));
    }
}

proptest::proptest! {
    #[test]
    fn any_bytes_after_the_beginning_are_a_bag_or_an_error(tail: Vec<u8>, cut in 0_usize..2000) {
        let mut bytes = bytes_of(&drive(), None);
        bytes.truncate(cut.max(8));
        bytes.extend(tail);
        let (_folder, path) = stored(&bytes);
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
