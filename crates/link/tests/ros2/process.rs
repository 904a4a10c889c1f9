//! The program of the network as `sidestep run --ros2` starts it, and the peer in Python.

use serde_json::Value;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    CommonSettings, Job, JobError, JobScenario, LinkMessage, Ros2Job, RosDistribution, RosGraph,
    link_command,
};
use sidestep_testing::python;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Time longer than anything here takes, on a machine that has much else to do.
pub(crate) const TEST_TIMEOUT: Duration = Duration::from_secs(300);

/// Returns the settings of all jobs for a scenario.
pub(crate) fn common_settings(file: &Path) -> CommonSettings {
    let build = WORLDS.build().into();
    CommonSettings {
        flown: JobScenario { file: file.into(), overrides: Vec::new(), build },
        tls: None,
        is_insecure: false,
        lease_s: 10.0,
        metrics: None,
        json_log: false,
        log: "warn".into(),
    }
}

/// Returns the job of a scenario that listens at any free port of this machine.
pub(crate) fn job(file: &Path) -> Ros2Job {
    Ros2Job {
        common: common_settings(file),
        domain: 0,
        namespace: "/".into(),
        distribution: RosDistribution::Jazzy,
        listen: vec!["tcp/127.0.0.1:0".into()],
        connect: Vec::new(),
        speed: 1.0,
        starts_paused: false,
        workers: 1,
        out: None,
        replace: false,
    }
}

/// A run as a node. It is killed when it is dropped.
pub(crate) struct RosProcess {
    folder: tempfile::TempDir,
    child: Child,
    _stdin: ChildStdin,
    messages: Receiver<LinkMessage>,
    endpoints: Vec<String>,
    graph: Option<RosGraph>,
}

impl RosProcess {
    /// Starts the job of a scenario, with changes, and waits until its first messages are sent.
    pub(crate) fn start(text: &str, change: impl Fn(Ros2Job) -> Ros2Job) -> Self {
        let mut process = Self::spawn(text, change);
        loop {
            match process.next_message("the node") {
                LinkMessage::Listens(endpoints) => process.endpoints = endpoints,
                LinkMessage::Ros2(graph) => {
                    process.graph = Some(graph);
                    return process;
                }
                other => panic!("{other:?}"),
            }
        }
    }

    fn spawn(text: &str, change: impl Fn(Ros2Job) -> Ros2Job) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("s.toml");
        std::fs::write(&file, text).expect("written");
        let job = Job::Ros2(change(job(&file)));
        let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        writeln!(stdin, "{}", serde_json::to_string(&job).expect("plain data")).expect("read");
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let _ = sender.send(serde_json::from_str(&line).expect("a line that is known"));
            }
        });
        Self { folder, child, _stdin: stdin, messages, endpoints: Vec::new(), graph: None }
    }

    fn next_message(&self, what: &str) -> LinkMessage {
        let message = self.messages.recv_timeout(TEST_TIMEOUT);
        message.unwrap_or_else(|e| panic!("waited for {what}: {e}"))
    }

    /// Returns a path beside the scenario.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the endpoint at which it listens.
    pub(crate) fn endpoint(&self) -> &str {
        self.endpoints.first().expect("an endpoint")
    }

    /// Returns what it says about its topics and services.
    pub(crate) fn graph(&self) -> &RosGraph {
        self.graph.as_ref().expect("a graph")
    }

    /// Returns the summary of a run that passes to its end.
    pub(crate) fn complete(&self) -> Value {
        match self.next_message("the end") {
            LinkMessage::Ended { summary, .. } => summary,
            other => panic!("{other:?}"),
        }
    }
}

impl Drop for RosProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns why a job fails.
pub(crate) fn fail(text: &str, change: impl Fn(Ros2Job) -> Ros2Job) -> JobError {
    let process = RosProcess::spawn(text, change);
    match process.next_message("the failure") {
        LinkMessage::Failed(failed) => failed,
        other => panic!("{other:?}"),
    }
}

/// The peer, which connects to a node that listens.
pub(crate) struct Peer {
    port: String,
    domain: u32,
    namespace: &'static str,
}

impl Peer {
    pub(crate) fn new(router: &RosProcess, domain: u32, namespace: &'static str) -> Self {
        let port = router.endpoint().rsplit_once(':').expect("a port").1.to_string();
        Self { port, domain, namespace }
    }

    /// Lets the peer do something, and returns what it has seen.
    pub(crate) fn ask(&self, what: &str) -> Value {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/peer.py");
        let mut command = Command::new(python());
        command.arg(script).args([&self.port, &self.domain.to_string()]);
        command.args([self.namespace, what]);
        let output = command.output().expect("python starts");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{what}: {error}");
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{what}: {e}: {error}"))
    }
}
