//! The motions of arms, exported for controllers of arms: read back by another program, and within the limits of the
//! joints.

use crate::readers::script;
use crate::support::TestFolder;
use serde_json::{Value, json};
use sidestep_testing::has_modules;

const ARM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain/arm.urdf");

/// Two of the shipped arms beside each other, of which one has no name.
fn two_arms() -> TestFolder {
    let place = TestFolder::new();
    let arm = |name: &str, x: f64| {
        format!(
            "[[chains]]\n{name}at_m = [{x}, 0.0, 0.0]\narm = {{ urdf = {ARM:?}, joints = [0, 0.5, 0, 1, 0, 0.5, 0], \
             max_acceleration = 4, max_jerk = 60 }}\nradius_m = 0.02\n[[chains.tasks]]\nkind = \"targets\"\n\
             connector = 3\ntargets_m = [[{}, 0.2, 0.6]]\nspeed_m_s = 0.4\n",
            x + 0.4
        )
    };
    let text = format!(
        "format = 1\nworld = \"chain\"\ncycles = 2000\n[chain]\ndimensions = 3\ndt_s = 0.01\n{}{}",
        arm("name = \"left arm\"\n", 0.0),
        arm("", 3.0)
    );
    place.write("two.toml", text);
    place.json(&["run", "two.toml", "--out", "r"]);
    place
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).expect("rows of numbers")
}

#[test]
fn a_trajectory_is_what_the_joints_did_and_keeps_to_their_limits() {
    let place = two_arms();
    let written = place.json(&["export", "r", "--to", "trajectory", "--out", "t"]);
    assert_eq!(written["written"], json!(["t"]));
    let trajectory: Value = serde_json::from_str(&place.read("t/left_arm.json")).expect("JSON");
    assert_eq!(trajectory["joint_names"].as_array().map(Vec::len), Some(7));
    let points = trajectory["points"].as_array().expect("points");
    for quantity in ["velocities", "accelerations"] {
        let of = |point: &Value| -> Vec<f64> {
            serde_json::from_value(point[quantity].clone()).expect("numbers")
        };
        // Controllers of arms want a trajectory to start and to end at rest.
        assert_eq!(of(&points[0]), [0.0; 7], "{quantity}");
        assert_eq!(of(&points[points.len() - 1]), [0.0; 7], "{quantity}");
        let most = if quantity == "velocities" { 1.5 } else { 4.0 };
        let fastest = points.iter().flat_map(of).fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(fastest <= most && fastest > 0.1 * most, "{quantity}: {fastest}");
    }
    let csv = place.read("t/left_arm.csv");
    let heading = csv.lines().next().expect("a heading");
    assert!(heading.starts_with("time_s,turn_1.position,turn_1.velocity,turn_1.acceleration,"));
    assert_eq!(csv.lines().count(), points.len() + 1);
    assert!(place.path("t/chain_1.csv").is_file());
    // A part of it, thinned out.
    let part = ["export", "r", "--to", "trajectory", "--out", "p", "--from", "10", "--every", "5"];
    place.json(&part);
    let part: Value = serde_json::from_str(&place.read("p/left_arm.json")).expect("JSON");
    let first = &part["points"][1];
    assert_eq!(first["time_from_start"], json!({ "sec": 0, "nanosec": 50_000_000 }));
    assert_eq!(first["positions"], points[15]["positions"]);
}

#[test]
fn another_program_reads_trajectories_by_the_definitions_of_ros() {
    if !has_modules("rosbags") {
        return;
    }
    let place = two_arms();
    place.json(&["export", "r", "--to", "trajectory", "--out", "t"]);
    let said = script("read_trajectory.py", &[&place.path("t")]);
    let topics = json!({
        "/left_arm/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
        "/left_arm/joint_states": "sensor_msgs/msg/JointState",
        "/chain_1/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
        "/chain_1/joint_states": "sensor_msgs/msg/JointState",
    });
    assert_eq!(said["topics"], topics);
    let written: Value = serde_json::from_str(&place.read("t/left_arm.json")).expect("JSON");
    let trajectory = &said["trajectories"]["/left_arm/joint_trajectory"];
    let states = &said["states"]["/left_arm/joint_states"];
    assert_eq!(trajectory["joints"], written["joint_names"]);
    assert_eq!(states["joints"], written["joint_names"]);
    for quantity in ["positions", "velocities", "accelerations"] {
        let points = written["points"].as_array().expect("points");
        let expected: Vec<&Value> = points.iter().map(|point| &point[quantity]).collect();
        assert_eq!(trajectory[quantity], json!(expected), "{quantity}");
    }
    assert_eq!(rows(&states["positions"]), rows(&trajectory["positions"]));
    assert_eq!(states["times"], trajectory["times"]);
}

#[test]
fn runs_without_arms_have_no_trajectories() {
    let place = TestFolder::new();
    let text = "format = 1\nworld = \"chain\"\ncycles = 5\n[[chains]]\nconnectors = 3\nrod_m = 0.5\n\
                [[chains.tasks]]\nkind = \"rest\"\n";
    place.write("c.toml", text);
    place.json(&["run", "c.toml", "--out", "r"]);
    let refused = place.run(&["export", "r", "--to", "trajectory"]);
    assert!(
        refused.code() == 2 && refused.err().contains("no joints of arms"),
        "{}",
        refused.err()
    );
    assert!(!place.path("r-trajectory").exists());
}

/// Robots on wheels in a chain: each has odometry, a true pose and a frame, as robots of buildings have.
#[test]
fn a_bag_of_a_chain_of_robots_has_each_of_them() {
    let place = TestFolder::new();
    let text = "format = 1\nworld = \"chain\"\ncycles = 40\n[chain]\ndt_s = 0.05\n[ground]\ncorridor = { width_m = 2.0 }\n\
                [[chains]]\nconnectors = 3\nat_m = [3.0, 0.0]\nheading_deg = 0\nrod_m = [0.6, 0.8]\nrod_radius_m = 0.05\n\
                robots = { radius_m = 0.25, margin_m = 0.08 }\n[[chains.tasks]]\nkind = \"navigate\"\nspeed_m_s = 0.5\n\
                navigator = { noise_m = 0.01 }\n";
    place.write("c.toml", text);
    place.json(&["run", "c.toml", "--out", "r"]);
    place.json(&["export", "r", "--to", "rosbag", "--out", "bag"]);
    if !has_modules("rosbags") {
        return;
    }
    let said = script("read_bag.py", &[&place.path("bag")]);
    for robot in 0..3 {
        for (topic, kind) in
            [("odom", "nav_msgs/msg/Odometry"), ("ground_truth", "geometry_msgs/msg/PoseStamped")]
        {
            let found = &said["topics"][format!("/robot_0_{robot}/{topic}")];
            assert_eq!(found, &json!({ "type": kind, "messages": 41 }), "{robot} {topic}");
        }
    }
    let frames = said["frames"].as_array().expect("frames");
    for robot in 0..3 {
        let frame = json!([format!("robot_0_{robot}/odom"), format!("robot_0_{robot}/base_link")]);
        assert!(frames.contains(&frame), "{frame}: {frames:?}");
    }
    assert!(frames.contains(&json!(["robot_0_0/base_link", "robot_0_0/laser"])), "{frames:?}");
}

/// The links of this arm are meshes, which a recorded run keeps as it read them.
#[test]
fn an_arm_of_meshes_is_computed_again_without_them() {
    let place = TestFolder::new();
    let corners = [[0.0, -0.05, -0.05], [0.4, 0.0, -0.05], [0.0, 0.05, -0.05], [0.2, 0.0, 0.05]];
    let faces = [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let facet = |face: [usize; 3]| {
        let vertices = face.map(|k| {
            let [x, y, z] = corners[k];
            format!("vertex {x} {y} {z}\n")
        });
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", vertices.concat())
    };
    let facets = faces.map(facet).concat();
    std::fs::create_dir_all(place.path("arm/meshes")).expect("a folder");
    std::fs::create_dir_all(place.path("arm/urdf")).expect("a folder");
    place.write("arm/meshes/link.stl", format!("solid link\n{facets}endsolid link\n"));
    let link = |k: usize| {
        format!(
            "<link name='l{k}'><collision><geometry><mesh filename='../meshes/link.stl'/></geometry></collision></link>\
             <joint name='j{k}' type='revolute'><parent link='l{}'/><child link='l{k}'/><origin xyz='{} 0 0'/>\
             <axis xyz='0 0 1'/><limit lower='-2.5' upper='2.5' velocity='1.5'/></joint>",
            k - 1,
            if k == 1 { 0.0 } else { 0.4 }
        )
    };
    let urdf = format!(
        "<robot name='m'><link name='l0'/>{}{}{}<link name='tool'/><joint name='t' type='fixed'><parent link='l3'/>\
         <child link='tool'/><origin xyz='0.4 0 0'/></joint></robot>",
        link(1),
        link(2),
        link(3)
    );
    place.write("arm/urdf/arm.urdf", urdf);
    let text = "format = 1\nworld = \"chain\"\ncycles = 60\n[chain]\ndimensions = 3\n[[obstacles]]\nat_m = [0.5, 0.9, 0.0]\n\
                radius_m = 0.1\n[[chains]]\narm = { urdf = \"arm/urdf/arm.urdf\", joints = [0.2, 0.5, 0.5], \
                body = \"shapes\" }\nradius_m = 0.02\n[[chains.tasks]]\nkind = \"targets\"\nconnector = 3\n\
                targets_m = [[0.9, 0.3, 0.0]]\n";
    place.write("m.toml", text);
    place.json(&["run", "m.toml", "--out", "r"]);
    std::fs::remove_dir_all(place.path("arm")).expect("removed");
    let again = place.run(&["replay", "r"]);
    assert_eq!(again.code(), 0, "{}", again.err());
}
