//! All topics of a run that is watched while it advances.

use super::map::occupancy_grid;
use super::robots::{RobotTopics, mounts, robots, starts, static_frames};
use super::{
    CLOCK_TOPIC, MAP_FRAME, RosMessage, TF_TOPIC, base_frame, header, namespace, to_ns,
    transform_from_map, true_pose,
};
use crate::frame_sink::FRAME_OPTIONS;
use sidestep_import::bag::messages::{
    Bool, Clock, ColorRgba, CompressedImage, JointState, Marker, MarkerArray, MeshFile, TfMessage,
    Time,
};
use sidestep_kernel::Simulation;
use sidestep_kernel::geometry::cross;
use sidestep_kernel::math::atan2;
use sidestep_kernel::view::{
    Body, BodyCondition, BodyRole, Frame, JointValues, OccupancyGrid, Pose, Shape, Vec3,
};

/// The topic of the floor.
const MAP_TOPIC: &str = "/map";

/// The topic of the shapes of all bodies.
const MARKERS_TOPIC: &str = "/markers";

/// Number of cycles for which a shape stays without a new message: one more than there are between two, so that shapes do
/// not flicker, and those of bodies that are gone vanish.
const MARKER_CYCLES: f64 = 2.0;

/// Values of joints one cycle before, by which their speeds are known.
#[derive(Debug, Default)]
struct JointHistory {
    time_s: f64,
    arms: Vec<JointValues>,
}

impl JointHistory {
    /// Returns the mean speeds of the joints of an arm since then; zeros where nothing is known.
    fn speeds(&self, time_s: f64, arm: &JointValues) -> Vec<f64> {
        let step_s = time_s - self.time_s;
        let known = self.arms.iter().find(|before| before.number == arm.number);
        let Some(before) = known.filter(|before| step_s > 0.0 && before.names == arm.names) else {
            return vec![0.0; arm.values.len()];
        };
        let pairs = arm.values.iter().zip(&before.values);
        pairs.map(|(now, before)| (now - before) / step_s).collect()
    }
}

/// The messages of a run, cycle by cycle.
#[derive(Debug)]
pub struct RunTopics {
    floor: Option<OccupancyGrid>,
    dimensions: u8,
    cycle_s: f64,
    robots: RobotTopics,
    joints: JointHistory,
    has_static_frames: bool,
}

impl RunTopics {
    /// Starts with a run at its present cycle; from now on wheels and joints are watched.
    pub fn start(run: &mut dyn Simulation) -> Self {
        run.enable_odometry();
        let scenery = run.scenery();
        Self {
            floor: scenery.floor,
            dimensions: scenery.dimensions,
            cycle_s: scenery.cycle_s,
            robots: RobotTopics::default(),
            joints: JointHistory::default(),
            has_static_frames: false,
        }
    }

    /// Returns the messages of the present cycle. The first call also gives those that are said only once: the map, and
    /// the frames that stay in their parents.
    pub fn messages(&mut self, run: &mut dyn Simulation) -> Vec<RosMessage> {
        let frame = run.frame(FRAME_OPTIONS);
        let mut messages = Vec::new();
        // The clock comes first: programs that follow it look for frames of its time.
        let clock = Clock { clock: Time::from_ns(to_ns(frame.time_s)) };
        messages.push(RosMessage::new(CLOCK_TOPIC, frame.time_s, &clock));
        if !self.has_static_frames {
            self.has_static_frames = true;
            messages.extend(self.lasting_messages(&frame));
        }
        if !frame.odometry.is_empty() {
            messages.extend(self.robots.messages(&frame));
            messages.extend(bumper_messages(&frame));
        }
        messages.extend(pose_messages(&frame));
        messages.extend(self.joint_messages(&frame));
        let markers = self.markers(&frame);
        messages.push(RosMessage::new(MARKERS_TOPIC, frame.time_s, &MarkerArray { markers }));
        self.joints = JointHistory { time_s: frame.time_s, arms: frame.joints };
        messages
    }

    /// Returns the joints of an arm as its last message told them.
    pub fn arm_joints(&self, chain: u32) -> Option<&JointValues> {
        self.joints.arms.iter().find(|arm| arm.number == chain)
    }

    fn lasting_messages(&self, frame: &Frame) -> Vec<RosMessage> {
        let mut messages = Vec::new();
        if let Some(floor) = &self.floor {
            let map = occupancy_grid(floor, frame.time_s);
            messages.push(RosMessage::new(MAP_TOPIC, frame.time_s, &map).latched());
        }
        // In one message, because late ones get only the last one of a topic.
        let mut transforms = starts(frame);
        transforms.extend(mounts(frame));
        if !transforms.is_empty() {
            messages.push(static_frames(frame.time_s, transforms));
        }
        messages
    }

    /// Returns the states of the joints of arms, and of chains that are no arms.
    fn joint_messages(&self, frame: &Frame) -> Vec<RosMessage> {
        let mut arms = frame.joints.clone();
        arms.extend(chain_joints(frame));
        let mut messages = Vec::new();
        for arm in arms {
            let state = JointState {
                header: header(frame.time_s, String::new()),
                velocity: self.joints.speeds(frame.time_s, &arm),
                name: arm.names,
                position: arm.values,
                effort: Vec::new(),
            };
            let topic = format!("/chain_{}/joint_states", arm.number);
            messages.push(RosMessage::new(topic, frame.time_s, &state));
        }
        messages
    }

    fn markers(&self, frame: &Frame) -> Vec<Marker> {
        let mut markers = Vec::with_capacity(frame.bodies.len());
        for body in &frame.bodies {
            let mut marker = marker(frame, body);
            let appearance = body.appearance(self.dimensions);
            let [red, green, blue] = appearance.color.map(|part| f32::from(part) / 255.0);
            marker.color = ColorRgba { red, green, blue, opacity: appearance.opacity as f32 };
            marker.lifetime = Time::from_secs(MARKER_CYCLES * self.cycle_s);
            markers.push(marker);
        }
        markers
    }
}

/// Returns whether each robot touches something.
fn bumper_messages(frame: &Frame) -> Vec<RosMessage> {
    let mut messages = Vec::new();
    for (who, body) in robots(frame) {
        let data = body.state == BodyCondition::Touching;
        let topic = format!("/{}/bumper", namespace(who));
        messages.push(RosMessage::new(topic, frame.time_s, &Bool { data }));
    }
    messages
}

/// Returns the true poses of agents without odometry, such as airplanes, and the frames that are fixed to them and to the
/// parts of chains.
fn pose_messages(frame: &Frame) -> Vec<RosMessage> {
    let mut messages = Vec::new();
    let mut transforms = Vec::new();
    for body in &frame.bodies {
        let who = body.id();
        let has_odometry = frame.odometry.iter().any(|(other, _)| *other == who);
        match body.kind.spec().role {
            BodyRole::Agent(_) if !has_odometry => {
                let topic = format!("/{}/pose", namespace(who));
                let pose = true_pose(frame.time_s, &body.pose);
                messages.push(RosMessage::new(topic, frame.time_s, &pose));
            }
            BodyRole::PartOfBody => {}
            _ => continue,
        }
        transforms.push(transform_from_map(frame.time_s, base_frame(who), &body.pose));
    }
    if !transforms.is_empty() {
        messages.push(RosMessage::new(TF_TOPIC, frame.time_s, &TfMessage { transforms }));
    }
    messages
}

/// Returns the joints of chains that are no arms: the lengths of the rods, and the bends between two of them, by what is
/// seen of the connectors.
fn chain_joints(frame: &Frame) -> Vec<JointValues> {
    let mut chains: Vec<(u32, Vec<Vec3>)> = Vec::new();
    for body in &frame.bodies {
        let is_arm = frame.joints.iter().any(|arm| arm.number == body.number);
        if body.kind.spec().role != BodyRole::PartOfBody || is_arm {
            continue;
        }
        match chains.last_mut() {
            // Bodies of one chain follow each other.
            Some((number, points_m)) if *number == body.number => points_m.push(body.pose.at_m),
            _ => chains.push((body.number, vec![body.pose.at_m])),
        }
    }
    chains.into_iter().map(|(number, points_m)| joints_of_points(number, &points_m)).collect()
}

fn joints_of_points(number: u32, points_m: &[Vec3]) -> JointValues {
    let mut joints = JointValues { number, names: Vec::new(), values: Vec::new() };
    let rods: Vec<Vec3> = points_m.windows(2).map(|ends| difference(ends[1], ends[0])).collect();
    for (k, rod) in rods.iter().enumerate() {
        joints.names.push(format!("rod_{k}"));
        joints.values.push(norm(*rod));
    }
    for (k, pair) in rods.windows(2).enumerate() {
        // Connector 0 is the end of the chain, at which nothing bends.
        joints.names.push(format!("connector_{}", k + 1));
        joints.values.push(bend_rad(pair[0], pair[1]));
    }
    joints
}

/// Returns the angle from one rod to the next: counterclockwise in the plane, and without a sign in space.
fn bend_rad(from: Vec3, to: Vec3) -> f64 {
    let normal = cross(from, to);
    let cosine = from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
    let is_plane = from[2] == 0.0 && to[2] == 0.0;
    let sine = if is_plane { normal[2] } else { norm(normal) };
    atan2(sine, cosine)
}

fn difference(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[i] - b[i])
}

fn norm(v: Vec3) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Returns the shape of a body as viewers of ROS show it, without its color.
fn marker(frame: &Frame, body: &Body) -> Marker {
    /// Kinds of shapes, as `visualization_msgs/msg/Marker` numbers them.
    const ARROW: i32 = 0;
    const CUBE: i32 = 1;
    const SPHERE: i32 = 2;
    const CYLINDER: i32 = 3;
    const LINE_STRIP: i32 = 4;
    // A thickness of 0 stands for the thinnest line that can be drawn, of which markers know none.
    const THIN_LINE_M: f64 = 0.01;
    let mut pose = body.pose;
    let mut line_m = Vec::new();
    let shape: i32;
    let scale: [f64; 3];
    match &body.shape {
        Shape::Cuboid { size_m } => {
            shape = CUBE;
            scale = *size_m;
        }
        Shape::Cylinder { radius_m, height_m } => {
            shape = CYLINDER;
            scale = [2.0 * radius_m, 2.0 * radius_m, *height_m];
        }
        Shape::Sphere { radius_m } => {
            shape = SPHERE;
            scale = [2.0 * radius_m; 3];
        }
        Shape::Line { points_m, thickness_m } => {
            shape = LINE_STRIP;
            scale = [thickness_m.max(THIN_LINE_M), 0.0, 0.0];
            // Points of a line are in the frame of the world, those of a marker relative to its pose.
            pose = Pose::from_position([0.0; 3]);
            line_m.clone_from(points_m);
        }
        Shape::Dart { length_m, width_m } => {
            shape = ARROW;
            scale = [*length_m, *width_m, *width_m];
        }
    }
    Marker {
        header: header(frame.time_s, MAP_FRAME.into()),
        namespace: marker_namespace(body),
        id: body.part.unwrap_or(body.number) as i32,
        shape,
        action: 0,
        pose: super::ros_pose(&pose),
        scale,
        color: ColorRgba { red: 0.0, green: 0.0, blue: 0.0, opacity: 1.0 },
        lifetime: Time::from_ns(0),
        is_frame_locked: false,
        points: line_m,
        colors: Vec::new(),
        texture_resource: String::new(),
        texture: CompressedImage {
            header: header(0.0, String::new()),
            format: String::new(),
            data: Vec::new(),
        },
        uv_coordinates: Vec::new(),
        text: String::new(),
        mesh_resource: String::new(),
        mesh_file: MeshFile { filename: String::new(), data: Vec::new() },
        mesh_use_embedded_materials: false,
    }
}

/// Returns the namespace in which the number of a body, or of a part of it, is unique.
fn marker_namespace(body: &Body) -> String {
    match body.part {
        None => body.kind.name().into(),
        Some(_) => format!("{}/{}", body.kind.name(), body.number),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_chain_has_a_length_for_each_rod_and_a_bend_between_two() {
        let points_m = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, -1.0, 0.0]];
        let joints = joints_of_points(4, &points_m);
        assert_eq!(joints.names, ["rod_0", "rod_1", "connector_1"]);
        assert_eq!(joints.values, [2.0, 1.0, -FRAC_PI_2]);
        let in_space = joints_of_points(0, &[[0.0; 3], [0.0, 0.0, 1.0], [0.0, -1.0, 1.0]]);
        assert_eq!(in_space.values, [1.0, 1.0, FRAC_PI_2]);
    }

    #[test]
    fn joints_have_the_mean_speed_since_the_cycle_before() {
        let arm = |values: &[f64]| JointValues {
            number: 1,
            names: vec!["a".into(), "b".into()],
            values: values.to_vec(),
        };
        let history = JointHistory { time_s: 1.0, arms: vec![arm(&[0.0, 1.0])] };
        assert_eq!(history.speeds(1.5, &arm(&[1.0, 0.5])), [2.0, -1.0]);
        assert_eq!(history.speeds(1.0, &arm(&[1.0, 0.5])), [0.0, 0.0]);
        let other = JointValues { number: 2, ..arm(&[1.0, 0.5]) };
        assert_eq!(history.speeds(1.5, &other), [0.0, 0.0]);
    }
}
