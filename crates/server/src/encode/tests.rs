//! The layout of frames, byte by byte, and the beginnings of casts.

use super::*;
use crate::protocol::Scan;
use sidestep::worlds::chain::kinds::RODS;
use sidestep::worlds::robots::kinds::{DOOR, ROBOT};
use sidestep_kernel::view::{BODY_COLORS, Pose, TrafficPlan};

fn scenery(dimensions: u8) -> Scenery {
    Scenery {
        name: "s".into(),
        dimensions,
        cycle_s: 0.5,
        floor: None,
        bodies: Vec::new(),
        names: vec![(ROBOT, 1, "Anna".into())],
        groups: Vec::new(),
        earth: Default::default(),
        traffic: None,
    }
}

fn robot(number: u32, at_m: [f64; 3], heading_rad: f64) -> Body {
    let shape = Shape::Cylinder { radius_m: 0.25, height_m: 1.0 };
    Body::new(ROBOT, number, Pose::from_heading(at_m, heading_rad), shape)
}

fn line(points_m: Vec<[f64; 3]>) -> Body {
    let shape = Shape::Line { points_m, thickness_m: 0.1 };
    Body::new(RODS, 0, Pose::from_position([0.0; 3]), shape)
}

fn frame(bodies: Vec<Body>) -> Frame {
    Frame { cycle: 7, time_s: 3.5, bodies, ..Frame::default() }
}

const NOTHING: FrameText = FrameText { scans: Vec::new(), events: Vec::new(), events_left_out: 0 };

/// Reads a frame from its first byte to its last.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_first_chunk().expect("enough bytes");
        self.0 = rest;
        *taken
    }

    fn u32s<const N: usize>(&mut self) -> [u32; N] {
        std::array::from_fn(|_| u32::from_le_bytes(self.take()))
    }

    fn f32s<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| f32::from_le_bytes(self.take()))
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}

#[test]
fn a_frame_of_a_plane_has_the_documented_layout() {
    let touching = robot(1, [3.0, 4.0, 0.5], 1.0).with_condition_if(true, BodyCondition::Touching);
    let bodies = vec![robot(0, [1.0, 2.0, 0.5], -2.0), touching];
    let mut encoder = FrameEncoder::new(9, &scenery(2));
    let (table, bytes) = encoder.encode(&frame(bodies), &NOTHING, 5);
    let mut read = Reader(&bytes);
    assert_eq!(read.take(), *b"SSTF");
    assert_eq!(read.take(), [3, 0, 2, 0], "version, dimensions, no velocities");
    assert_eq!(read.u32s(), [9, 1], "session, table");
    assert_eq!((read.f64(), read.f64()), (7.0, 3.5));
    let text = br#"{"scans":[],"events":[],"events_left_out":0}"#;
    assert_eq!(read.u32s(), [2, 0, 0, text.len() as u32, 5, 0]);
    assert_eq!(bytes.len() - read.0.len(), 56);
    assert_eq!(read.f32s(), [1.0, 2.0, 3.0, 4.0]);
    let [a, b] = read.f32s();
    assert!((a + 2.0).abs() < 1e-5 && (b - 1.0).abs() < 1e-5, "{a} {b}");
    assert_eq!(read.u32s(), [0], "no line");
    assert_eq!(read.take(), [0, 3, 0, 0], "conditions, padded");
    assert_eq!(read.0, text);
    let table = table.expect("the first frame begins a table");
    assert_eq!((table.session, table.id), (9, 1));
    assert_eq!((table.kinds, table.kind), (vec!["robot".to_string()], vec![0, 0]));
    assert_eq!((table.number, table.part, table.shape), (vec![0, 1], vec![-1, -1], vec![0, 0]));
    assert_eq!(table.appearances[usize::from(table.appearance[1])][0].color, BODY_COLORS[1]);
    assert_eq!((table.names, table.is_agent), (vec![(1, "Anna".to_string())], vec![true, true]));
}

#[test]
fn a_frame_of_space_has_quaternions_and_points_of_lines() {
    let rods = line(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    let bodies = vec![rods.clone(), robot(0, [7.0, 8.0, 9.0], 0.0), rods];
    let (table, bytes) = FrameEncoder::new(1, &scenery(3)).encode(&frame(bodies), &NOTHING, 0);
    let mut read = Reader(&bytes[32..]);
    assert_eq!(read.u32s::<3>(), [3, 2, 4], "bodies, lines, points");
    read.0 = &bytes[56..];
    assert_eq!(read.f32s(), [0.0, 0.0, 0.0, 7.0, 8.0, 9.0, 0.0, 0.0, 0.0]);
    assert_eq!(read.f32s::<12>()[4..8], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(read.u32s(), [0, 2, 4]);
    assert_eq!(read.f32s(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(read.take(), [0; 4]);
    let table = table.expect("a table");
    assert_eq!(table.shape, [0, 1, 0]);
    let without = crate::protocol::Shape::Line { points_m: vec![], thickness_m: 0.1 };
    assert_eq!(table.shapes[0], without);
}

#[test]
fn frames_of_traffic_have_velocities_after_the_points() {
    let traffic = Some(TrafficPlan::default());
    let bodies = vec![robot(0, [1.0, 2.0, 0.5], 0.0).with_velocity([3.0, 4.0, 5.0])];
    let (_, bytes) = FrameEncoder::new(1, &Scenery { traffic, ..scenery(2) }).encode(
        &frame(bodies),
        &NOTHING,
        0,
    );
    assert_eq!(bytes[7], 1);
    let mut read = Reader(&bytes[56..]);
    assert_eq!(read.f32s(), [1.0, 2.0, 0.0]);
    assert_eq!(read.u32s(), [0], "no line");
    assert_eq!(read.f32s(), [3.0, 4.0, 5.0]);
    assert_eq!(read.take(), [0; 4], "conditions, padded");
    assert_eq!(FrameColumns::from_frame(&bytes).velocities, [3.0, 4.0, 5.0]);
}

#[test]
fn every_column_starts_at_a_multiple_of_four_bytes() {
    for n in 0..9 {
        let bodies = (0..n).map(|k| robot(k, [0.0; 3], 0.0)).collect();
        let (_, bytes) = FrameEncoder::new(1, &scenery(2)).encode(&frame(bodies), &NOTHING, 0);
        let text = serde_json::to_vec(&NOTHING).expect("text").len();
        assert_eq!((bytes.len() - text) % 4, 0, "{n} bodies");
    }
}

#[test]
fn a_cast_stays_while_bodies_move_and_changes_with_who_they_are() {
    let mut encoder = FrameEncoder::new(1, &scenery(2));
    let mut begins = |bodies| encoder.encode(&frame(bodies), &NOTHING, 0).0.map(|table| table.id);
    let two = || vec![robot(0, [0.0; 3], 0.0), line(vec![[0.0; 3]; 2])];
    assert_eq!(begins(two()), Some(1));
    assert_eq!(begins(vec![robot(0, [9.0; 3], 1.0), line(vec![[1.0; 3]; 5])]), None);
    assert_eq!(begins(two().into_iter().rev().collect()), Some(2), "another order");
    assert_eq!(begins(two()), Some(3));
    let wider = Shape::Cylinder { radius_m: 0.5, height_m: 1.0 };
    assert_eq!(begins(vec![Body { shape: wider, ..robot(0, [0.0; 3], 0.0) }]), Some(4));
    let ball = |east_m_s: f64| Body {
        kind: BodyKind::OBSTACLE,
        velocity_m_s: [east_m_s, 0.0, 0.0],
        ..robot(0, [0.0; 3], 0.0)
    };
    assert_eq!(begins(vec![ball(0.0)]), Some(5));
    assert_eq!(begins(vec![ball(1.0)]), Some(6), "obstacles that move look different");
    let pushed = |east_m_s: f64| robot(0, [0.0; 3], 0.0).with_velocity([east_m_s, 0.0, 0.0]);
    assert_eq!(begins(vec![pushed(0.0)]), Some(7));
    assert_eq!(begins(vec![pushed(1.0)]), None, "the velocity of traffic is in its frames");
}

#[test]
fn a_height_begins_a_cast_in_space_and_none_in_a_plane() {
    let door = |height_m: f64| {
        let shape = Shape::Cuboid { size_m: [1.0, 0.2, height_m] };
        frame(vec![Body::new(DOOR, 0, Pose::from_position([0.0; 3]), shape)])
    };
    for (dimensions, begins) in [(2, false), (3, true)] {
        let mut encoder = FrameEncoder::new(1, &scenery(dimensions));
        encoder.encode(&door(2.0), &NOTHING, 0);
        assert_eq!(encoder.encode(&door(0.1), &NOTHING, 0).0.is_some(), begins);
    }
}

#[test]
fn scans_and_events_are_the_text_of_a_frame_and_nothing_in_range_is_null() {
    let seen = sidestep_kernel::view::Scan {
        of: sidestep_kernel::view::BodyId::new(ROBOT, 1, None),
        sensor: "eye".into(),
        pose: Pose::from_position([0.0; 3]),
        bearings_rad: vec![0.0, 1.0],
        ranges_m: vec![2.0, f64::INFINITY],
        true_m: vec![f64::INFINITY, 3.0],
        range_m: 4.0,
    };
    let scans: Vec<Scan> = vec![scan(&seen)];
    let text = FrameText { scans, events: Vec::new(), events_left_out: 3 };
    let (_, bytes) = FrameEncoder::new(1, &scenery(2)).encode(&frame(vec![]), &text, 0);
    let read: serde_json::Value = serde_json::from_slice(&bytes[60..]).expect("JSON");
    assert_eq!(read["scans"][0]["ranges_m"], serde_json::json!([2.0, null]));
    assert_eq!(read["scans"][0]["true_m"], serde_json::json!([null, 3.0]));
    assert_eq!(read["events_left_out"], 3);
}
