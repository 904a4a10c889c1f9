//! A broker, a hall with its plan, vehicles in Python, and the program.

use serde_json::{Value, json};
use sidestep::planners::Plan;
use sidestep::scenario::Source;
use sidestep::worlds::{WORLDS, robots};
use sidestep_link::vda5050::routes::{FloorFrame, Route, routes};
use sidestep_session::fleet::{
    DispatchJob, DispatchStatus, Job, JobError, JobScenario, LinkMessage, link_command,
};
use sidestep_testing::{python, require, skip};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Time longer than anything here takes, on a machine that has much else to do.
const TEST_TIMEOUT: Duration = Duration::from_secs(240);

const BOX_M: f64 = 0.5;

/// A broker of this machine, killed when it is dropped.
pub(crate) struct Mosquitto {
    child: Child,
    pub(crate) port: u16,
    _folder: TempDir,
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Starts a broker; none where there is no `mosquitto`.
pub(crate) fn broker() -> Option<Mosquitto> {
    // Debian installs it where only an administrator's path leads.
    let names = ["mosquitto", "/usr/sbin/mosquitto"];
    let is_there = |name: &&&str| {
        let tried =
            Command::new(name).arg("-h").stdout(Stdio::null()).stderr(Stdio::null()).status();
        tried.is_ok()
    };
    let Some(program) = names.iter().find(is_there) else {
        require("mosquitto", "mosquitto is not here");
        return None;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let free = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
    let port = free.local_addr().expect("an address").port();
    drop(free);
    let config = folder.path().join("mosquitto.conf");
    let text = format!("listener {port} 127.0.0.1\nallow_anonymous true\npersistence false\n");
    std::fs::write(&config, text).expect("written");
    let mut command = Command::new(program);
    command.arg("-c").arg(&config).stdout(Stdio::null()).stderr(Stdio::null());
    let child = command.spawn().expect("it starts");
    let mosquitto = Mosquitto { child, port, _folder: folder };
    let until = Instant::now() + TEST_TIMEOUT;
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(Instant::now() < until, "mosquitto does not listen");
        std::thread::sleep(Duration::from_millis(10));
    }
    Some(mosquitto)
}

/// A hall with robots and their plan.
pub(crate) struct Hall {
    folder: TempDir,
    routes: Vec<Route>,
    plan: Option<Plan>,
}

impl Hall {
    /// Creates a hall whose robots a planner leads for some cycles.
    pub(crate) fn new(robots: &str, cycles: u64) -> Self {
        let mut hall =
            Self::new_unplanned(&format!("{robots}planner = {{ method = \"lacam\" }}\n"));
        let overrides = ["regime=\"reliable\"".to_string(), format!("cycles={cycles}")];
        let text = std::fs::read_to_string(hall.file()).expect("read");
        let source = Source::new("s.toml", text, "").with_overrides(&overrides).expect("they fit");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        let compiled = compiled.as_any().downcast_ref::<robots::scenario::Compiled>();
        let found = compiled.expect("robots").run_plan(&source).expect("a plan");
        let graph = sidestep::planners::DependencyGraph::new(&found.instance, &found.plan);
        hall.routes =
            routes(&found.instance, &found.plan, &graph.expect("right")).expect("no ring");
        hall.plan = Some(found.plan);
        hall
    }

    /// Creates a hall whose robots have no plan, as far as the test knows.
    pub(crate) fn new_unplanned(robots: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let hall = Self { folder, routes: Vec::new(), plan: None };
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = 4\ncycles = 40\n[map]\nbox_size_m = {BOX_M}\n\
             ascii = \"\"\"\n.......\n.##.##.\n.......\n\"\"\"\n[[robots]]\n{robots}"
        );
        std::fs::write(hall.file(), text).expect("written");
        hall
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("s.toml")
    }

    /// Returns the job of this hall at a broker.
    pub(crate) fn job(&self, broker: &Mosquitto) -> DispatchJob {
        self.job_at(broker.port)
    }

    pub(crate) fn job_at(&self, port: u16) -> DispatchJob {
        DispatchJob {
            planned: JobScenario {
                file: self.file(),
                overrides: Vec::new(),
                build: WORLDS.build().into(),
            },
            broker: format!("mqtt://127.0.0.1:{port}"),
            is_insecure: false,
            interface: "uagv".into(),
            manufacturer: "acme".into(),
            serial_prefix: "agv-".into(),
            map_id: "hall".into(),
            horizon_nodes: 3,
            silence_s: 30.0,
            resend_s: 2.0,
            give_up_s: None,
            json_log: false,
            log: "info".into(),
        }
    }

    /// Checks that vehicles went along their routes, and through each box in the order of the plan.
    pub(crate) fn assert_carried_out(&self, result: &Value) {
        assert_eq!(result["conflicts"], json!([]));
        let vehicles = result["vehicles"].as_array().expect("vehicles");
        for (route, vehicle) in self.routes.iter().zip(vehicles) {
            let planned: Vec<String> = route.nodes.iter().map(|node| node.id()).collect();
            assert_eq!(vehicle["visited"], json!(planned), "{}", vehicle["serial"]);
        }
        assert_eq!(result["entries"], json!(self.entries()), "who comes after whom");
    }

    /// Checks that all have arrived and met nobody. One that has started again before it has told how far it has come goes
    /// some of its way twice, where that passes a place twice.
    pub(crate) fn assert_arrived(&self, result: &Value, context: &str) {
        assert_eq!(result["conflicts"], json!([]), "{context}: {result}");
        let vehicles = result["vehicles"].as_array().expect("vehicles");
        for (route, vehicle) in self.routes.iter().zip(vehicles) {
            let goal = route.nodes.last().map(|node| node.id());
            let last = vehicle["visited"].as_array().and_then(|visited| visited.last());
            assert_eq!(last, goal.map(Value::from).as_ref(), "{context}: {vehicle}");
        }
    }

    /// Returns the vehicles that enter each box by the plan, in its order.
    fn entries(&self) -> BTreeMap<String, Vec<String>> {
        let plan = self.plan.as_ref().expect("a plan");
        let mut entries: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for step in 0..=plan.steps() {
            for agent in 0..plan.agents() {
                let now = plan.pose(agent, step).position();
                let is_new = step == 0 || plan.pose(agent, step - 1).position() != now;
                if is_new {
                    let name = format!("{}-{}", now.0, now.1);
                    entries.entry(name).or_default().push(format!("agv-{agent}"));
                }
            }
        }
        entries
    }
}

/// What vehicles are to do.
#[derive(Debug)]
pub(crate) struct PlantTask {
    /// Share of states that are lost.
    pub(crate) lost: f64,
    /// Shortest and longest time in seconds for an edge.
    pub(crate) edge_s: [f64; 2],
    /// Faults by the number of the vehicle.
    pub(crate) faults: Value,
    /// Whether somebody sends forged states.
    pub(crate) forges: bool,
}

/// Vehicles in Python.
pub(crate) struct Plant {
    child: Child,
    stdin: ChildStdin,
    out: BufReader<ChildStdout>,
}

impl Plant {
    pub(crate) fn start(broker: &Mosquitto, hall: &Hall, task: &PlantTask) -> Self {
        let frame = FloorFrame { box_m: BOX_M, plane: Default::default() };
        let vehicles = hall.routes.iter().enumerate().map(|(number, route)| {
            let at_m = frame.center_m(route.nodes[0].position, route.size);
            let faults = task.faults.get(number.to_string()).cloned().unwrap_or(json!({}));
            json!({ "serial": format!("agv-{number}"), "x": at_m[0], "y": at_m[1], "faults": faults })
        });
        let line = json!({
            "port": broker.port, "seed": 7, "interface": "uagv", "manufacturer": "acme", "map_id": "hall",
            "box_m": BOX_M, "edge_s": task.edge_s, "lost": task.lost, "forges": task.forges,
            "vehicles": vehicles.collect::<Vec<_>>()
        });
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/vda5050/vehicles.py");
        let mut command = Command::new(python());
        command.arg(script).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("python starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        writeln!(stdin, "{line}").expect("it reads its task");
        let mut out = BufReader::new(child.stdout.take().expect("a pipe"));
        let mut ready = String::new();
        out.read_line(&mut ready).expect("it answers");
        assert_eq!(ready, "ready\n");
        Self { child, stdin, out }
    }

    /// Ends the vehicles, and returns what has happened.
    pub(crate) fn stop(mut self) -> Value {
        drop(self.stdin);
        let mut line = String::new();
        self.out.read_line(&mut line).expect("it answers");
        let _ = self.child.wait();
        let result: Value = serde_json::from_str(&line).expect("a result");
        if let Some(why) = result["skipped"].as_str().filter(|why| !why.is_empty()) {
            skip(format!("messages of VDA 5050 are checked by its tables alone: {why}"));
        }
        result
    }
}

/// How the program has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: i32,
    pub(crate) status: Option<DispatchStatus>,
    pub(crate) error: Option<JobError>,
    pub(crate) logged: Vec<String>,
}

/// Runs the program to its end.
pub(crate) fn run(job: DispatchJob) -> Ended {
    run_until(job, |_| false)
}

/// Runs the program, and asks it to end once something holds.
pub(crate) fn run_until(job: DispatchJob, is_enough: impl Fn(&DispatchStatus) -> bool) -> Ended {
    let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let mut stdin = child.stdin.take();
    let line = serde_json::to_string(&Job::Dispatch(job)).expect("plain data");
    writeln!(stdin.as_mut().expect("a pipe"), "{line}").expect("it reads its job");
    let errors = BufReader::new(child.stderr.take().expect("a pipe"));
    let log = std::thread::spawn(move || errors.lines().map_while(Result::ok).collect());
    let out = BufReader::new(child.stdout.take().expect("a pipe"));
    let until = Instant::now() + TEST_TIMEOUT;
    let mut ended = Ended { code: -1, status: None, error: None, logged: Vec::new() };
    for line in out.lines().map_while(Result::ok) {
        match serde_json::from_str(&line).expect("a line that is known") {
            LinkMessage::Dispatch(now) => {
                // It reports twice a second, so this is looked at as often.
                if is_enough(&now) || Instant::now() > until {
                    drop(stdin.take());
                }
                ended.status = Some(now);
            }
            LinkMessage::Failed(error) => ended.error = Some(error),
            other => panic!("{other:?}"),
        }
    }
    ended.code = child.wait().expect("it ends").code().unwrap_or(-1);
    ended.logged = log.join().expect("no panic");
    ended
}

/// Returns all drops by reason.
pub(crate) fn all_drops(status: &DispatchStatus) -> BTreeMap<String, u64> {
    let mut all = status.dropped.clone();
    for vehicle in &status.vehicles {
        for (reason, count) in &vehicle.dropped {
            *all.entry(reason.clone()).or_default() += count;
        }
    }
    all
}
