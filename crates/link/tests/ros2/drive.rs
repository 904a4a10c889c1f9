//! Robots that the program drives: plants in Python that share no code with it.

use crate::PEER;
use crate::process::{TEST_TIMEOUT, common_settings};
use serde_json::{Value, json};
use sidestep_session::fleet::{
    DriveJob, DriveSettings, DriveStatus, DriveTopics, Job, JobError, LinkMessage, RosDistribution,
    RosGraph, RosNetwork, link_command,
};
use sidestep_testing::{has_modules, python};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// Rows from the north, as in the scenario.
const HALL: [&str; 8] = [
    "............",
    "............",
    "...##.......",
    "...##...##..",
    "........##..",
    "............",
    "............",
    "............",
];

pub(crate) const BOX_M: f64 = 0.5;
pub(crate) const RADIUS_M: f64 = 0.17;
pub(crate) const DOMAIN: u32 = 11;

/// Returns the scenario of robots with these starts and goals, each a column and a row.
fn scenario(robots: &[([u32; 3], [u32; 2])]) -> String {
    let ways: Vec<_> = robots.iter().map(|(start, goal)| (*start, vec![*goal])).collect();
    scenario_with(400, &ways)
}

/// Returns the same for so many cycles, with several goals for each.
pub(crate) fn scenario_with(cycles: u64, robots: &[([u32; 3], Vec<[u32; 2]>)]) -> String {
    let mut text = format!(
        "format = 1\nworld = \"robots\"\nseed = 4\ncycles = {cycles}\n[map]\nbox_size_m = {BOX_M}\n\
         ascii = \"\"\"\n{}\n\"\"\"\n",
        HALL.join("\n")
    );
    for ([column, row, degrees], goals) in robots {
        let heading = degrees / 90;
        text += &format!(
            "[[robots]]\nat = [[{column}, {row}, {heading}]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
             behaviour = {{ kind = \"goto\", goals = {goals:?}, avoidance = \"plan\" }}\n"
        );
    }
    text
}

/// The plants of a test, in Python. They end with it.
pub(crate) struct Plants {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<Value>,
    pub(crate) port: u16,
}

impl Plants {
    fn start(starts: &[[u32; 3]], walls: &[[u32; 2]]) -> Self {
        Self::start_with(starts, json!({ "walls": walls }))
    }

    pub(crate) fn start_with(starts: &[[u32; 3]], more: Value) -> Self {
        // Another process may take the port in between; then the plants say so and the test fails.
        let port = {
            let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
            listener.local_addr().expect("an address").port()
        };
        let mut config = json!({
            "port": port,
            "domain": DOMAIN,
            "map": HALL,
            "box_m": BOX_M,
            "radius_m": RADIUS_M,
            "starts": starts,
        });
        if let (Some(config), Value::Object(more)) = (config.as_object_mut(), more) {
            config.extend(more);
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/plant.py");
        let mut command = Command::new(python());
        command.arg(script).arg(config.to_string()).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("python starts");
        let stdin = child.stdin.take().expect("a pipe");
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let _ = sender.send(serde_json::from_str(&line).expect("a line of JSON"));
            }
        });
        let plants = Self { child, stdin, lines, port };
        assert_eq!(plants.next(), "ready");
        plants
    }

    fn next(&self) -> Value {
        self.lines.recv_timeout(TEST_TIMEOUT).expect("the plants answer")
    }

    pub(crate) fn ask(&mut self, word: &str) -> Value {
        writeln!(self.stdin, "{word}").expect("the plants listen");
        self.next()
    }
}

impl Drop for Plants {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A robot that is driven. It is killed when it is dropped.
pub(crate) struct DriveProcess {
    child: Child,
    stdin: Option<ChildStdin>,
    messages: Receiver<LinkMessage>,
}

impl DriveProcess {
    pub(crate) fn start(job: DriveJob) -> Self {
        let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        let line = serde_json::to_string(&Job::Drive(Box::new(job))).expect("plain data");
        writeln!(stdin, "{line}").expect("it reads");
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let _ = sender.send(serde_json::from_str(&line).expect("a line that is known"));
            }
        });
        Self { child, stdin: Some(stdin), messages }
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    fn next(&self) -> LinkMessage {
        self.messages.recv_timeout(TEST_TIMEOUT).expect("the drive tells something")
    }

    /// Returns the last state of those that have come since it was asked last.
    pub(crate) fn news(&self) -> Option<DriveStatus> {
        let messages = self.messages.try_iter();
        let states = messages.filter_map(|message| match message {
            LinkMessage::Drives(status) => Some(status),
            LinkMessage::Ros2(_) | LinkMessage::Listens(_) => None,
            other => panic!("{other:?}"),
        });
        states.last()
    }

    /// Waits for the topics that it has.
    fn graph(&self) -> RosGraph {
        loop {
            match self.next() {
                LinkMessage::Ros2(graph) => return graph,
                LinkMessage::Listens(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    /// Waits until a state holds.
    pub(crate) fn wait_for(&self, holds: impl Fn(&DriveStatus) -> bool) -> DriveStatus {
        loop {
            match self.next() {
                LinkMessage::Drives(status) if holds(&status) => return status,
                LinkMessage::Drives(_) | LinkMessage::Ros2(_) | LinkMessage::Listens(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    pub(crate) fn end(&self) -> DriveStatus {
        loop {
            match self.next() {
                LinkMessage::Driven(status) => return status,
                LinkMessage::Failed(error) => panic!("{error:?}"),
                _ => {}
            }
        }
    }

    pub(crate) fn failure(&self) -> JobError {
        match self.next() {
            LinkMessage::Failed(error) => error,
            other => panic!("{other:?}"),
        }
    }

    /// Ends it without a chance to say anything.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it ends");
    }

    /// Asks it to end, as Ctrl-C does, and returns how it was.
    pub(crate) fn interrupt(&mut self) -> DriveStatus {
        drop(self.stdin.take());
        self.end()
    }
}

impl Drop for DriveProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn job(file: &Path, robot: u32, port: u16) -> DriveJob {
    DriveJob {
        common: common_settings(file),
        robot,
        network: RosNetwork {
            domain: DOMAIN,
            namespace: format!("/robot_{robot}"),
            distribution: RosDistribution::Jazzy,
            listen: Vec::new(),
            connect: vec![format!("tcp/127.0.0.1:{port}")],
        },
        topics: DriveTopics {
            odom: "odom".into(),
            scan: "scan".into(),
            bumper: "bumper".into(),
            cmd_vel: "cmd_vel".into(),
            goal: "goal_pose".into(),
            beacon: "beacon".into(),
            peers: None,
            is_stamped: false,
            map_frame: "map".into(),
            base_frame: None,
        },
        settings: DriveSettings {
            speed_mps: 0.4,
            turn_radps: 1.2,
            acceleration_mps2: 0.8,
            radius_m: Some(RADIUS_M),
            clearance_m: 0.03,
            cycle_s: 0.5,
            patience_s: 1.0,
            beacon_patience_s: 5.0,
            timeout_s: 60.0,
        },
        trips: Some(1),
        out: None,
        bag: None,
        replace: false,
    }
}

/// A folder with a scenario.
pub(crate) struct ScenarioFolder(tempfile::TempDir);

impl ScenarioFolder {
    pub(crate) fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("s.toml"), text).expect("written");
        Self(folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

pub(crate) fn is_at(robot: &Value, [column, row]: [u32; 2]) -> bool {
    let at = [column, row].map(|boxes| (f64::from(boxes) + 0.5) * BOX_M);
    let off = [0, 1].map(|k| robot["at_m"][k].as_f64().expect("meters") - at[k]);
    off.iter().all(|off| off.abs() < 0.3 * BOX_M)
}

#[test]
fn four_robots_arrive_among_each_other_touch_nothing_and_leave_tables_of_their_motions() {
    if !has_modules(PEER) {
        return;
    }
    let robots = [
        ([0, 0, 0], [10, 6]),
        ([11, 7, 180], [1, 1]),
        ([0, 7, 270], [10, 1]),
        ([11, 0, 90], [1, 6]),
    ];
    let folder = ScenarioFolder::new(&scenario(&robots));
    let starts = robots.map(|(start, _)| start);
    let mut plants = Plants::start(&starts, &[]);
    let drives: Vec<DriveProcess> = (0..4)
        .map(|robot| {
            let out = Some(folder.path(&format!("motions-{robot}.csv")));
            let job = job(&folder.path("s.toml"), robot, plants.port);
            DriveProcess::start(DriveJob { out, ..job })
        })
        .collect();
    let ends: Vec<DriveStatus> = drives.iter().map(DriveProcess::end).collect();
    // It waits for the last command of each, which may be on its way when the program has ended.
    let silence = plants.ask("silence");
    assert_eq!(
        silence["velocities"],
        json!(vec![[0.0, 0.0]; 4]),
        "all are told to stand at the end"
    );
    let report = plants.ask("report");
    for (k, (_, goal)) in robots.iter().enumerate() {
        let robot = &report[k];
        assert_eq!(ends[k].trips, 1, "{:?}", ends[k]);
        assert_eq!((ends[k].unreadable, ends[k].off_map), (0, 0), "{:?}", ends[k]);
        assert!(is_at(robot, *goal), "robot {k}: {robot}");
        assert_eq!(robot["touches"], 0, "robot {k}: {robot}");
        let fastest = [0, 1].map(|axis| robot["fastest"][axis].as_f64().expect("a speed"));
        assert!(fastest[0] <= 0.4 + 1e-9 && fastest[1] <= 1.2 + 1e-9, "{robot}");
        let table = std::fs::read_to_string(folder.path(&format!("motions-{k}.csv")));
        let table = table.expect("a table");
        assert_eq!(table.lines().count() as u64, 1 + ends[k].actions, "{table}");
        assert!(table.contains(",forward,1,0,0,no,nomad,0.5,"), "{table}");
    }
}

#[test]
fn a_robot_whose_measurements_stop_is_told_to_stand_and_goes_on_when_they_are_back() {
    if !has_modules(PEER) {
        return;
    }
    let folder = ScenarioFolder::new(&scenario(&[([0, 0, 0], [11, 0])]));
    let mut plants = Plants::start(&[[0, 0, 0]], &[]);
    let drive = DriveProcess::start(job(&folder.path("s.toml"), 0, plants.port));
    drive.wait_for(|status| status.actions >= 2);
    let silence = plants.ask("silence");
    assert_eq!(silence["velocities"], json!([[0.0, 0.0]]));
    let before = plants.ask("report")[0].clone();
    let stopped = drive.wait_for(|status| status.guarded_by.is_some() && status.old_states >= 2);
    assert!(stopped.guarded_by.as_deref().is_some_and(|words| words.contains("too old")));
    let after = plants.ask("report")[0].clone();
    assert_eq!(before["at_m"], after["at_m"], "it stands");
    assert_eq!(plants.ask("speak"), "speaks");
    let end = drive.end();
    // Before the first measurement, and in the silence.
    assert!(end.trips == 1 && end.old_states >= 2, "{end:?}");
}

#[test]
fn a_robot_that_is_interrupted_on_its_way_is_told_to_stand() {
    if !has_modules(PEER) {
        return;
    }
    let folder = ScenarioFolder::new(&scenario(&[([0, 0, 0], [11, 0])]));
    // Commands with a time, as newer drivers of bases want them.
    let mut plants = Plants::start_with(&[[0, 0, 0]], json!({ "stamped": true }));
    let mut job = job(&folder.path("s.toml"), 0, plants.port);
    job.topics.is_stamped = true;
    let mut drive = DriveProcess::start(job);
    let graph = drive.graph();
    assert_eq!(graph.node, "/robot_0/sidestep_drive_0");
    let commands = ("/robot_0/cmd_vel".to_string(), "geometry_msgs/msg/TwistStamped".to_string());
    assert!(graph.topics.contains(&commands), "{graph:?}");
    drive.wait_for(|status| status.actions >= 2);
    let end = drive.interrupt();
    assert_eq!(end.trips, 0);
    assert!(matches!(drive.next(), LinkMessage::Failed(error) if error.is_interrupted));
    let silence = plants.ask("silence");
    assert_eq!(silence["velocities"], json!([[0.0, 0.0]]), "by its last command");
}

#[test]
fn a_thing_that_the_map_does_not_have_is_a_contact_and_is_not_touched() {
    if !has_modules(PEER) {
        return;
    }
    // A corridor that the thing closes but for the way around.
    let text = scenario(&[([0, 0, 0], [11, 0])]);
    let folder =
        ScenarioFolder::new(&text.replace("avoidance = \"plan\"", "avoidance = \"touch\""));
    let mut plants = Plants::start(&[[0, 0, 0]], &[[4, 0]]);
    let drive = DriveProcess::start(job(&folder.path("s.toml"), 0, plants.port));
    let end = drive.end();
    assert!(end.trips == 1 && end.contacts > 0 && end.obstacles > 0, "{end:?}");
    assert_eq!(plants.ask("report")[0]["touches"], 0);
}

#[test]
fn jobs_that_cannot_be_are_refused_with_a_remedy_and_leave_no_table() {
    let folder = ScenarioFolder::new(&scenario(&[([0, 0, 0], [11, 0])]));
    let file = folder.path("s.toml");
    let fail = |job: DriveJob| DriveProcess::start(job).failure();
    let nobody = fail(DriveJob { out: Some(folder.path("m.csv")), ..job(&file, 0, 9) });
    assert!(nobody.remedy.contains("rmw_zenohd"), "{nobody:?}");
    assert!(!folder.path("m.csv").exists());
    let other = fail(job(&file, 5, 9));
    assert!(other.is_input && other.remedy.contains("0 to 0"), "{other:?}");
    let mut outside = job(&file, 0, 9);
    outside.network.connect = vec!["tcp/192.0.2.1:7447".into()];
    let outside = fail(outside);
    assert!(outside.is_input && outside.remedy.contains("--insecure"), "{outside:?}");
}

#[test]
fn a_robot_without_a_program_goes_where_it_is_told_and_its_bag_is_read_by_others() {
    if !has_modules(PEER) {
        return;
    }
    let text = scenario(&[([0, 0, 0], [11, 0])]);
    let own = text.find("behaviour").expect("a behavior");
    let folder =
        ScenarioFolder::new(&format!("{}behaviour = {{ kind = \"external\" }}\n", &text[..own]));
    let mut plants = Plants::start_with(&[[0, 0, 0]], json!({ "goals": true }));
    let bag = folder.path("bag");
    let job = job(&folder.path("s.toml"), 0, plants.port);
    let drive = DriveProcess::start(DriveJob { bag: Some(bag.clone()), ..job });
    let graph = drive.graph();
    let goals = ("/robot_0/goal_pose".to_string(), "geometry_msgs/msg/PoseStamped".to_string());
    assert!(graph.topics.contains(&goals), "{graph:?}");
    // It is measured and stands: nothing guards it anymore.
    drive.wait_for(|status| status.guarded_by.is_some());
    drive.wait_for(|status| status.guarded_by.is_none());
    plants.ask("goal 0 robot_0/odom 2.25 1.25 90");
    drive.wait_for(|status| status.refused_goals == 1);
    // In a wall.
    plants.ask("goal 0 map 1.75 2.25 90");
    drive.wait_for(|status| status.refused_goals == 2);
    plants.ask("goal 0 map 2.25 1.25 90");
    let end = drive.end();
    assert_eq!((end.trips, end.goals, end.refused_goals), (1, 1, 2), "{end:?}");
    assert_eq!(end.goal, Some((4, 2)));
    let report = plants.ask("report");
    assert!(is_at(&report[0], [4, 2]) && report[0]["touches"] == 0, "{report}");
    let topics = read_bag(&bag);
    for (topic, kind) in [
        ("/robot_0/odom", "nav_msgs/msg/Odometry"),
        ("/robot_0/scan", "sensor_msgs/msg/LaserScan"),
        ("/robot_0/bumper", "std_msgs/msg/Bool"),
        ("/robot_0/cmd_vel", "geometry_msgs/msg/Twist"),
        ("/robot_0/goal_pose", "geometry_msgs/msg/PoseStamped"),
        ("/robot_0/sidestep_drive_0/pose", "geometry_msgs/msg/PoseStamped"),
        ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ] {
        assert_eq!(topics[topic]["type"], kind, "{topics}");
    }
    assert_eq!(topics["/robot_0/goal_pose"]["count"], 3);
    assert_eq!(topics["/robot_0/cmd_vel"]["last"]["linear"]["x"], 0.0);
    let pose = &topics["/robot_0/sidestep_drive_0/pose"]["last"];
    assert_eq!(pose["header"]["frame_id"], "map");
    let x_m = pose["pose"]["position"]["x"].as_f64().expect("meters");
    assert!((x_m - 2.25).abs() < 0.1, "{pose}");
}

/// Returns what `rosbags` reads from a bag.
fn read_bag(folder: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/bag.py");
    let output = Command::new(python()).arg(script).arg(folder).output().expect("python starts");
    let error = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {error}"))
}
