//! Runs as nodes of ROS 2, seen by a peer that shares no code with them: the Python packages `zenoh-ros2-sdk` and
//! `rosbags`.
//!
//! The interpreter is that of SIDESTEP_PYTHON, else `python3`; where it or a package is not here these tests are skipped,
//! unless SIDESTEP_REQUIRE names `python`.

mod closed_loop;
mod drive;
mod drive_soak;
mod process;
mod team;

use process::{Peer, RosProcess, job};
use serde_json::{Value, json};
use sidestep::kernel::view::{Frame, FrameOptions, Occupancy};
use sidestep::kernel::{Cycle, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{Ros2Job, RosDistribution};
use sidestep_testing::has_modules;

/// What the peer is made of.
const PEER: &str = "rosbags, zenoh_ros2_sdk";

/// One robot with eight beams in two rooms with a door.
const ROBOT: &str = "format = 1\nworld = \"robots\"\nseed = 3\ncycles = 1000000\nregime = \"both\"\n\
    [map]\nbox_size_m = 0.25\nascii = \"\"\"\n\
    ################\n#......#.......#\n#......#.......#\n#..............#\n################\n\"\"\"\n\
    [[robots]]\nat = [[2, 1, 1]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

/// A chain of three connectors in the plane.
const CHAIN: &str = "format = 1\nworld = \"chain\"\nseed = 3\ncycles = 1000\n[chain]\ndt_s = 0.05\n\
    [[chains]]\nconnectors = 3\nat_m = [0, 0]\nrod_m = [0.3, 0.4]\n\
    [[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-3, -3], [3, 3]]\n";

/// Three airplanes on a circle, each of which wants to get to the other side.
const AIRPLANES: &str = "format = 1\nworld = \"airspace\"\nseed = 5\ncycles = 50\n\
    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";

/// Returns a run of a scenario in this process, with its wheels watched from the start.
fn started(text: &str) -> Box<dyn Simulation> {
    let source = Source::new("s.toml", text, "");
    let mut run = WORLDS.compile(&source).expect("a scenario").start(&source, 1);
    run.enable_odometry();
    run
}

/// Returns the frame of a cycle, as a run in this process has it.
fn frame_at(text: &str, cycle: Cycle) -> Frame {
    let mut run = started(text);
    run.advance(cycle);
    run.frame(FrameOptions::with_first_scans(8))
}

fn is_close(a: &Value, b: f64) -> bool {
    a.as_f64().is_some_and(|a| (a - b).abs() < 1e-5)
}

/// Returns a vector that a message has as `x`, `y`, `z`.
fn xyz(value: &Value) -> [f64; 3] {
    ["x", "y", "z"].map(|axis| value[axis].as_f64().expect("a number"))
}

#[test]
fn a_peer_finds_node_topics_and_services_with_types_hashes_and_qualities_by_tokens() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ROBOT, |job| Ros2Job {
        domain: 7,
        namespace: "/hall".into(),
        starts_paused: true,
        ..job
    });
    let graph = Peer::new(&node, 7, "/hall").ask("graph");
    assert_eq!(graph["nodes"], json!([["%", "%hall", "sidestep"]]));
    let topics = graph["topics"].as_object().expect("topics");
    let expected = [
        ("/clock", "rosgraph_msgs/msg/Clock"),
        ("/hall/map", "nav_msgs/msg/OccupancyGrid"),
        ("/hall/markers", "visualization_msgs/msg/MarkerArray"),
        ("/hall/robot_0/bumper", "std_msgs/msg/Bool"),
        ("/hall/robot_0/ground_truth", "geometry_msgs/msg/PoseStamped"),
        ("/hall/robot_0/odom", "nav_msgs/msg/Odometry"),
        ("/hall/robot_0/sonar_8", "sensor_msgs/msg/LaserScan"),
        ("/tf", "tf2_msgs/msg/TFMessage"),
        ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ];
    let names: Vec<&str> = topics.keys().map(String::as_str).collect();
    assert_eq!(names, expected.map(|(name, _)| name));
    for (name, kind) in expected {
        let topic = &topics[name];
        assert_eq!(topic["types"], json!([kind]), "{name}");
        assert_eq!(topic["hash"], topic["expected_hash"], "{name}");
        assert_eq!([&topic["node"], &topic["namespace"]], ["sidestep", "/hall"]);
        assert_eq!(topic["reliability"], "RELIABLE");
        let is_latched = ["/hall/map", "/tf_static"].contains(&name);
        let quality = match name {
            _ if is_latched => json!(["TRANSIENT_LOCAL", 1]),
            "/tf" => json!(["VOLATILE", 100]),
            _ => json!(["VOLATILE", 10]),
        };
        assert_eq!(json!([topic["durability"], topic["depth"]]), quality, "{name}");
    }
    for name in ["pause", "resume", "step", "reset"] {
        let service = &graph["services"][name];
        assert_eq!(service["types"], json!(["std_srvs/srv/Trigger"]));
        assert_eq!(service["hash"], graph["service_hash"]);
    }
    let told = node.graph();
    assert_eq!(told.node, "/hall/sidestep");
    let told_names: Vec<&str> = told.topics.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(told_names, names, "the command says the same");
}

#[test]
fn each_step_sends_what_the_run_has_in_that_cycle() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ROBOT, |job| Ros2Job { starts_paused: true, ..job });
    let seen = Peer::new(&node, 0, "/").ask("steps");
    for (k, answer) in (1..).zip(seen["answers"].as_array().expect("answers")) {
        assert_eq!(*answer, json!({ "success": true, "message": format!("at cycle {k}") }));
    }
    let topics = &seen["topics"];
    for k in 0..3 {
        let frame = frame_at(ROBOT, k as Cycle + 1);
        let before = frame_at(ROBOT, k as Cycle);
        let stamp = json!({ "sec": frame.time_s as u64, "nanosec": 0 });
        assert_eq!(topics["clock"][k]["clock"], stamp);
        let odom = &topics["odom"][k];
        assert_eq!(odom["header"], json!({ "stamp": stamp, "frame_id": "robot_0/odom" }));
        assert_eq!(odom["child_frame_id"], "robot_0/base_link");
        assert_eq!(xyz(&odom["pose"]["pose"]["position"]), frame.odometry[0].1.at_m);
        let ways = [&frame, &before].map(|frame| frame.odometry[0].1.at_m);
        let way_m = (ways[0][0] - ways[1][0]).abs() + (ways[0][1] - ways[1][1]).abs();
        let [vx, vy, _] = xyz(&odom["twist"]["twist"]["linear"]);
        let step_s = frame.time_s - before.time_s;
        assert!(((vx.abs() + vy.abs()) * step_s - way_m).abs() < 1e-9, "{odom}");
        let truth = &topics["truth"][k];
        let [x_m, y_m, _] = frame.bodies[0].pose.at_m;
        assert_eq!(xyz(&truth["pose"]["position"]), [x_m, y_m, 0.0]);
        assert_eq!(truth["header"]["frame_id"], "map");
        let scan = &topics["scan"][k];
        assert_eq!(scan["header"]["frame_id"], "robot_0/sonar_8");
        let ranges = scan["ranges"].as_array().expect("ranges");
        assert_eq!(ranges.len(), frame.scans[0].ranges_m.len());
        for (range, range_m) in ranges.iter().zip(&frame.scans[0].ranges_m) {
            let is_same =
                if range_m.is_finite() { is_close(range, *range_m) } else { *range == "inf" };
            assert!(is_same, "{range} and {range_m}");
        }
        let tf = &topics["tf"][k]["transforms"][0];
        assert_eq!(xyz(&tf["transform"]["translation"]), frame.odometry[0].1.at_m);
        let markers = topics["markers"][k]["markers"].as_array().expect("markers");
        assert_eq!(markers.len(), frame.bodies.len());
        assert!(topics["bumper"][k]["data"].is_boolean());
    }
}

#[test]
fn those_who_join_late_get_the_map_and_the_frames_that_stay() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ROBOT, |job| Ros2Job { speed: 50.0, ..job });
    let peer = Peer::new(&node, 0, "/");
    // Time has passed: nobody listened when these were sent.
    peer.ask("services");
    let seen = peer.ask("late");
    let floor = started(ROBOT).scenery().floor.expect("a floor");
    let map = &seen["map"][0];
    let info = &map["info"];
    assert_eq!(
        [&info["width"], &info["height"]],
        [&json!(floor.width + 2), &json!(floor.height + 2)]
    );
    assert!(is_close(&info["resolution"], floor.box_m));
    assert!(is_close(&info["origin"]["position"]["x"], floor.plane.origin_m[0] - floor.box_m));
    let cells = map["data"].as_array().expect("cells");
    for row in 0..floor.height as usize {
        for column in 0..floor.width as usize {
            let cell = &cells[(row + 1) * (floor.width as usize + 2) + column + 1];
            let expected = match floor.boxes[row * floor.width as usize + column] {
                Occupancy::Free => 0,
                Occupancy::Wall => 100,
                Occupancy::Unknown => -1,
            };
            assert_eq!(*cell, expected);
        }
    }
    let frames = seen["tf_static"][0]["transforms"].as_array().expect("frames");
    let names: Vec<&Value> = frames.iter().map(|frame| &frame["child_frame_id"]).collect();
    assert_eq!(names, ["robot_0/odom", "robot_0/sonar_8"]);
    let [x_m, y_m, _] = frame_at(ROBOT, 0).bodies[0].pose.at_m;
    assert_eq!(xyz(&frames[0]["transform"]["translation"]), [x_m, y_m, 0.0]);
}

#[test]
fn services_pause_step_reset_and_resume_time() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ROBOT, |job| Ros2Job { speed: 20.0, ..job });
    let seen = Peer::new(&node, 0, "/").ask("services");
    let answers = &seen["answers"];
    assert_eq!(answers["step while time passes"]["success"], false);
    for name in ["pause", "step", "reset", "resume"] {
        assert_eq!(answers[name]["success"], true, "{answers}");
    }
    let times: Vec<f64> =
        seen["times"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
    let paused_at = seen["paused_at"].as_f64().expect("a cycle");
    let cycle_s = started(ROBOT).scenery().cycle_s;
    let is_one_by_one = times.windows(2).all(|pair| (pair[1] - pair[0] - cycle_s).abs() < 1e-6);
    assert!(is_one_by_one, "{times:?}");
    assert_eq!(times.last(), Some(&((paused_at + 1.0) * cycle_s)), "one step after the pause");
    assert_eq!(answers["reset"]["message"], "at cycle 0");
}

#[test]
fn a_run_with_a_folder_is_not_reset_and_its_folder_replays() {
    if !has_modules(PEER) {
        return;
    }
    let text = ROBOT.replace("cycles = 1000000", "cycles = 3");
    let node = RosProcess::start(&text, |job| Ros2Job {
        starts_paused: true,
        out: Some(job.common.flown.file.with_file_name("run")),
        ..job
    });
    let peer = Peer::new(&node, 0, "/");
    let refused = peer.ask("reset_between_steps");
    let reset = &refused["reset"];
    assert_eq!(reset["success"], false);
    assert!(reset["message"].as_str().is_some_and(|words| words.contains("one past")), "{reset}");
    let summary = node.complete();
    let mut alone = started(&text);
    alone.advance(3);
    assert_eq!(summary["digest"], alone.digest().to_string(), "watching changes nothing");
    let again = sidestep_session::RecordedRun::open(&WORLDS, &node.path("run")).expect("a run");
    let replayed = sidestep_session::replay_all(&again, 1, &sidestep_session::NoWatcher);
    assert!(replayed.is_ok(), "{:?}", replayed.err());
}

#[test]
fn velocities_from_outside_are_orders_that_are_recorded_and_replay() {
    if !has_modules(PEER) {
        return;
    }
    let obedient = "effector = \"nomad\"\nbehaviour = { kind = \"external\" }";
    let text = ROBOT.replace("cycles = 1000000", "cycles = 4").replace("both", "reliable");
    let text = text.replace("effector = \"nomad\"", obedient);
    let node = RosProcess::start(&text, |job| Ros2Job {
        starts_paused: true,
        out: Some(job.common.flown.file.with_file_name("run")),
        ..job
    });
    let obeys = ("/robot_0/cmd_vel".to_string(), "geometry_msgs/msg/Twist".to_string());
    assert!(node.graph().topics.contains(&obeys), "{:?}", node.graph());
    let seen = Peer::new(&node, 0, "/").ask("velocities");
    let poses: Vec<&Value> = (0..4).map(|k| &seen["odom"][k]["pose"]["pose"]).collect();
    let yaw_half = std::f64::consts::FRAC_PI_4.sin();
    for (k, pose) in poses.iter().enumerate() {
        assert_eq!(xyz(&pose["position"]), [0.25, 0.0, 0.0], "one box ahead, and no more");
        let turned = if k == 0 { 0.0 } else { yaw_half };
        assert!(is_close(&pose["orientation"]["z"], turned), "{k}: {pose}");
    }
    assert_replays(&node, &text);
}

#[test]
fn a_robot_goes_to_the_last_goal_that_can_be_and_its_run_replays() {
    if !has_modules(PEER) {
        return;
    }
    let obedient = "effector = \"nomad\"\nbehaviour = { kind = \"external\" }";
    let text = ROBOT.replace("cycles = 1000000", "cycles = 40").replace("both", "reliable");
    let text = text.replace("effector = \"nomad\"", obedient);
    let node = RosProcess::start(&text, |job| Ros2Job {
        starts_paused: true,
        out: Some(job.common.flown.file.with_file_name("run")),
        ..job
    });
    let obeys = ("/robot_0/goal_pose".to_string(), "geometry_msgs/msg/PoseStamped".to_string());
    assert!(node.graph().topics.contains(&obeys), "{:?}", node.graph());
    let seen = Peer::new(&node, 0, "/").ask("goals");
    let last = &seen["truth"][39]["pose"];
    assert_eq!(xyz(&last["position"]), [3.125, 0.625, 0.0], "through the door");
    assert!(last["orientation"]["z"].as_f64().is_some_and(|z| z.abs() > 0.999), "{last}");
    let summary = assert_replays(&node, &text);
    assert_eq!(summary["metrics"]["trips"], 1, "{summary}");
}

/// An arm of two joints about vertical axes.
const ARM: &str = "format = 1\nworld = \"chain\"\nseed = 3\ncycles = 30\n[chain]\ndimensions = 3\ndt_s = 0.1\n\
    [[chains]]\narm = { joints = [0.0, 0.5], urdf_text = \"\"\"<robot name='r'><link name='a'/><link name='b'/>\
    <link name='c'/><link name='d'/><joint name='turn' type='revolute'><parent link='a'/><child link='b'/>\
    <origin xyz='0 0 0.2'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>\
    <joint name='bend' type='revolute'><parent link='b'/><child link='c'/><origin xyz='0.4 0 0'/><axis xyz='0 0 1'/>\
    <limit lower='-2' upper='2' effort='1' velocity='1'/></joint>\
    <joint name='tool' type='fixed'><parent link='c'/><child link='d'/><origin xyz='0.4 0 0'/></joint></robot>\"\"\" }\n\
    radius_m = 0.03\n[[chains.tasks]]\nkind = \"external\"\nconnector = 2\nspeed_m_s = 2.0\n";

#[test]
fn an_arm_follows_the_trajectory_that_can_be_and_its_run_replays() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ARM, |job| Ros2Job {
        starts_paused: true,
        out: Some(job.common.flown.file.with_file_name("run")),
        ..job
    });
    let obeys = (
        "/chain_0/joint_trajectory".to_string(),
        "trajectory_msgs/msg/JointTrajectory".to_string(),
    );
    assert!(node.graph().topics.contains(&obeys), "{:?}", node.graph());
    let seen = Peer::new(&node, 0, "/").ask("trajectory");
    for (k, state) in (1..).zip(seen["joints"].as_array().expect("states")) {
        assert_eq!(state["name"], json!(["turn", "bend"]));
        // The trajectory takes two seconds; then the arm rests.
        let share = (0.1 * f64::from(k) / 2.0).min(1.0);
        let wanted = [-0.5 * share, 0.5 + 0.5 * share];
        for joint in 0..2 {
            let value = state["position"][joint].as_f64().expect("a value");
            // Joints with limits of acceleration and jerk follow a little later.
            let tolerance = if k == 30 { 1e-6 } else { 0.1 };
            assert!((value - wanted[joint]).abs() < tolerance, "step {k}: {state}");
        }
    }
    assert_replays(&node, ARM);
}

/// Asserts that the folder of a run replays to its digest, and that the scenario alone has another one; returns its summary.
fn assert_replays(node: &RosProcess, text: &str) -> Value {
    let summary = node.complete();
    let again = sidestep_session::RecordedRun::open(&WORLDS, &node.path("run")).expect("a run");
    let replayed = sidestep_session::replay_all(&again, 1, &sidestep_session::NoWatcher);
    assert!(replayed.is_ok(), "{:?}", replayed.err());
    let mut alone = started(text);
    alone.advance(alone.config().cycles);
    assert_ne!(summary["digest"], alone.digest().to_string(), "without orders it is another run");
    summary
}

#[test]
fn chains_have_joints_and_frames() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(CHAIN, |job| Ros2Job { starts_paused: true, ..job });
    let seen = Peer::new(&node, 0, "/").ask("joints");
    let joints = &seen["joints"][0];
    assert_eq!(joints["name"], json!(["rod_0", "rod_1", "connector_1"]));
    let mut run = started(CHAIN);
    run.advance(1);
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let connectors = frame.bodies.iter().filter(|body| body.kind.name() == "connector");
    let points: Vec<[f64; 3]> = connectors.map(|body| body.pose.at_m).collect();
    let length_m = |k: usize| {
        let [dx, dy] = [0, 1].map(|axis| points[k + 1][axis] - points[k][axis]);
        (dx * dx + dy * dy).sqrt()
    };
    assert!(is_close(&joints["position"][0], length_m(0)), "{joints}");
    assert!(is_close(&joints["position"][1], length_m(1)), "{joints}");
    let transforms = seen["tf"][0]["transforms"].as_array().expect("frames");
    assert_eq!(transforms.len(), 3);
    assert_eq!(transforms[2]["child_frame_id"], "chain_0/connector_2");
    assert_eq!(xyz(&transforms[2]["transform"]["translation"]), points[2]);
}

#[test]
fn airplanes_have_poses_and_shapes() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(AIRPLANES, |job| Ros2Job { starts_paused: true, ..job });
    let seen = Peer::new(&node, 0, "/").ask("airplanes");
    let mut run = started(AIRPLANES);
    run.advance(1);
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let airplane = frame.bodies.iter().find(|body| body.kind.name() == "airplane");
    let airplane = airplane.expect("an airplane");
    assert_eq!(xyz(&seen["pose"][0]["pose"]["position"]), airplane.pose.at_m);
    let markers = seen["markers"][0]["markers"].as_array().expect("markers");
    assert_eq!(markers.len(), frame.bodies.len());
    assert!(markers.iter().any(|marker| marker["ns"] == "airplane" && marker["id"] == 0));
}

#[test]
fn a_humble_peer_gets_keys_without_hashes() {
    if !has_modules(PEER) {
        return;
    }
    let node = RosProcess::start(ROBOT, |job| Ros2Job {
        starts_paused: true,
        distribution: RosDistribution::Humble,
        ..job
    });
    let graph = Peer::new(&node, 0, "/").ask("graph");
    for topic in graph["topics"].as_object().expect("topics").values() {
        assert_eq!(topic["hash"], "TypeHashNotSupported");
    }
}

#[test]
fn a_node_joins_a_router_that_runs_already_and_a_taken_port_is_said() {
    if !has_modules(PEER) {
        return;
    }
    let router = RosProcess::start(ROBOT, |job| Ros2Job { starts_paused: true, ..job });
    let at = router.endpoint().to_string();
    let client = RosProcess::start(AIRPLANES, |job| Ros2Job {
        domain: 5,
        starts_paused: true,
        listen: Vec::new(),
        connect: vec![at.clone()],
        ..job
    });
    // By the router, which is another run in another domain.
    let seen = Peer::new(&router, 5, "/").ask("airplanes");
    assert_eq!(seen["answer"]["message"], "at cycle 1");
    drop(client);
    let failed = process::fail(AIRPLANES, |job| Ros2Job { listen: vec![at.clone()], ..job });
    assert!(failed.is_input && failed.remedy.contains("--connect"), "{failed:?}");
}

#[test]
fn no_router_is_an_error_that_says_how_to_start_one() {
    let nobody = "tcp/127.0.0.1:9".to_string();
    let failed = process::fail(ROBOT, |job| Ros2Job {
        listen: Vec::new(),
        connect: vec![nobody.clone()],
        ..job
    });
    assert!(failed.remedy.contains("rmw_zenohd"), "{failed:?}");
    let outside =
        process::fail(ROBOT, |job| Ros2Job { listen: vec!["tcp/0.0.0.0:0".into()], ..job });
    assert!(outside.is_input && outside.remedy.contains("--insecure"), "{outside:?}");
}

#[test]
fn jobs_are_kept_as_text() {
    let job = sidestep_session::fleet::Job::Ros2(job(std::path::Path::new("s.toml")));
    let text = serde_json::to_string(&job).expect("plain data");
    assert_eq!(serde_json::from_str::<sidestep_session::fleet::Job>(&text).ok(), Some(job));
}
