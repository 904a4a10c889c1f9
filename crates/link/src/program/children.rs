//! Processes of nodes on this machine: started, watched and ended.
//!
//! A node ends when its standard input does, so it cannot outlive the server, however that ends. One that does not end
//! when it is asked to is killed: a process that is stopped by a signal does not react to anything else.

use crate::wire::zenoh::ONE_THREAD;
use sidestep::kernel::EntityId;
use sidestep_session::Error;
use sidestep_session::fleet::{Job, JobError, LinkMessage};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time that nodes have to end when they are asked to.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);

/// Time after which a node that has ended is started again, doubled each time that it has not lasted: a node that cannot
/// run must not take a whole processor for being started.
const MIN_RESTART_DELAY: Duration = Duration::from_millis(500);

/// Maximum time before a node is started again.
const MAX_RESTART_DELAY: Duration = Duration::from_secs(16);

/// Time after which a node counts as one that has lasted: it has joined, and done some cycles.
const MIN_STABLE_UPTIME: Duration = Duration::from_secs(10);

/// A node that is started here, and perhaps started again.
struct NodeProcess {
    job: Job,
    child: Option<Child>,
    /// Reads what the process prints, so that it never waits for that, and returns its last line.
    output: Option<JoinHandle<Option<String>>>,
    started: Instant,
    /// Time at which it is started again, if it has ended.
    restart_at: Option<Instant>,
    restart_delay: Duration,
}

/// The nodes that this process has started; they end when this is dropped.
pub(super) struct NodeProcesses {
    nodes: BTreeMap<EntityId, NodeProcess>,
    /// Whether nodes that have ended are started again.
    restarts: bool,
}

impl NodeProcess {
    fn start(&mut self, agent: EntityId) -> Result<(), Error> {
        let program = std::env::current_exe().map_err(start_error)?;
        let mut command = Command::new(program);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        // With or without certificates: a node sends little, and each thread costs memory.
        let (variable, one_thread) = ONE_THREAD;
        command.env(variable, one_thread);
        // In a process group of its own it gets no Ctrl-C from a terminal: that is for the command that started the fleet,
        // which ends all processes in good order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(start_error)?;
        let mut line = serde_json::to_string(&self.job).expect("plain data");
        line.push('\n');
        if let Some(stdin) = &mut child.stdin {
            // An error means that the process has ended at once, which `poll_exit` finds.
            let _ = stdin.write_all(line.as_bytes());
        }
        let out = child.stdout.take();
        self.output = out.map(|out| std::thread::spawn(move || read_output(agent, out)));
        self.child = Some(child);
        self.started = Instant::now();
        self.restart_at = None;
        Ok(())
    }

    /// Returns how the node has ended, once it has.
    fn poll_exit(&mut self) -> Option<NodeExit> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        let last_line = self.output.take().and_then(|output| output.join().ok().flatten());
        let reason = last_error(last_line).unwrap_or_else(|| describe_exit(status));
        self.child = None;
        self.restart_delay = if self.started.elapsed() > MIN_STABLE_UPTIME {
            MIN_RESTART_DELAY
        } else {
            (2 * self.restart_delay).min(MAX_RESTART_DELAY)
        };
        Some(NodeExit { reason, is_done: status.success() })
    }
}

/// The end of a node's process.
struct NodeExit {
    reason: String,
    /// Whether it has done its job.
    is_done: bool,
}

/// Reads all lines of a node, tells what its guard does, and returns the last one.
fn read_output(agent: EntityId, out: ChildStdout) -> Option<String> {
    let mut last_line = None;
    for line in BufReader::new(out).lines().map_while(Result::ok) {
        if let Ok(LinkMessage::Flight(status)) = serde_json::from_str(&line) {
            for event in status.events {
                tracing::warn!(agent, cycle = status.cycle, "{event}");
            }
        }
        last_line = Some(line);
    }
    last_line
}

fn start_error(error: std::io::Error) -> Error {
    Error::other(format!("cannot start a node: {error}"), "see whether there is memory left")
}

/// Returns the cause of the failure that a node has reported in its last line.
fn last_error(last_line: Option<String>) -> Option<String> {
    match serde_json::from_str(&last_line?).ok()? {
        LinkMessage::Failed(JobError { cause, .. }) => Some(cause),
        _ => None,
    }
}

fn describe_exit(status: ExitStatus) -> String {
    format!("its process has ended ({status})")
}

impl NodeProcesses {
    /// Starts a node for each job; with `restarts`, one that ends is started again.
    ///
    /// # Errors
    /// When a process cannot be started.
    pub(super) fn start(jobs: BTreeMap<EntityId, Job>, restarts: bool) -> Result<Self, Error> {
        let mut processes = Self { nodes: BTreeMap::new(), restarts };
        for (agent, job) in jobs {
            let mut node = NodeProcess {
                job,
                child: None,
                output: None,
                started: Instant::now(),
                restart_at: None,
                // It is doubled before its first use.
                restart_delay: MIN_RESTART_DELAY / 2,
            };
            node.start(agent)?;
            processes.nodes.insert(agent, node);
        }
        Ok(processes)
    }

    /// Returns the nodes that have ended since the last call, with the reasons.
    pub(super) fn poll_exits(&mut self) -> Vec<(EntityId, String)> {
        let mut ended = Vec::new();
        for (&agent, node) in &mut self.nodes {
            if let Some(exit) = node.poll_exit() {
                ended.push((agent, exit.reason));
                let restarts = self.restarts && !exit.is_done;
                node.restart_at = restarts.then(|| Instant::now() + node.restart_delay);
            }
        }
        ended
    }

    /// Does the same, and starts nodes again that are due, with jobs that `renew` has changed: one that listens where it did
    /// before is reached again by the others.
    ///
    /// # Errors
    /// When one cannot be started again.
    pub(super) fn poll_and_restart(
        &mut self,
        renew: impl Fn(EntityId, &mut Job),
    ) -> Result<Vec<(EntityId, String)>, Error> {
        let ended = self.poll_exits();
        for (&agent, node) in &mut self.nodes {
            if node.restart_at.is_some_and(|at| at <= Instant::now()) {
                renew(agent, &mut node.job);
                node.start(agent)?;
            }
        }
        Ok(ended)
    }

    /// Ends all nodes, and waits until they have.
    pub(super) fn shut_down(&mut self) {
        let children = self.nodes.values_mut().filter_map(|node| node.child.as_mut());
        let mut children: Vec<&mut Child> = children.collect();
        for child in &mut children {
            drop(child.stdin.take());
        }
        let until = Instant::now() + SHUTDOWN_TIMEOUT;
        while children.iter_mut().any(|child| is_running(child)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
        for child in children {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn is_running(child: &mut Child) -> bool {
    child.try_wait().is_ok_and(|status| status.is_none())
}

impl Drop for NodeProcesses {
    fn drop(&mut self) {
        self.shut_down();
    }
}
