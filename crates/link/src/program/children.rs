//! Processes of nodes on this machine: started, watched and ended.
//!
//! A node ends when its standard input does, so it cannot outlive the server, however that ends. One that does not end
//! when it is asked to is killed: a process that is stopped by a signal does not react to anything else.

use crate::wire::zenoh::ONE_THREAD;
use sidestep::kernel::EntityId;
use sidestep_session::Error;
use sidestep_session::fleet::{Job, JobError, LinkMessage, NodeJob};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
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
    job: NodeJob,
    child: Option<Child>,
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
    fn start(&mut self) -> Result<(), Error> {
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
        let mut line = serde_json::to_string(&Job::Node(self.job.clone())).expect("plain data");
        line.push('\n');
        if let Some(stdin) = &mut child.stdin {
            // An error means that the process has ended at once, which `poll_exit` finds.
            let _ = stdin.write_all(line.as_bytes());
        }
        self.child = Some(child);
        self.started = Instant::now();
        self.restart_at = None;
        Ok(())
    }

    /// Returns how the node has ended, once it has.
    fn poll_exit(&mut self) -> Option<String> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        let reason = last_error(child).unwrap_or_else(|| describe_exit(status));
        self.child = None;
        self.restart_delay = if self.started.elapsed() > MIN_STABLE_UPTIME {
            MIN_RESTART_DELAY
        } else {
            (2 * self.restart_delay).min(MAX_RESTART_DELAY)
        };
        Some(reason)
    }
}

fn start_error(error: std::io::Error) -> Error {
    Error::other(format!("cannot start a node: {error}"), "see whether there is memory left")
}

/// Returns the cause of the failure that a node has reported in its last line.
fn last_error(child: &mut Child) -> Option<String> {
    let out = BufReader::new(child.stdout.take()?);
    let last_line = out.lines().map_while(Result::ok).last()?;
    match serde_json::from_str(&last_line).ok()? {
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
    pub(super) fn start(jobs: BTreeMap<EntityId, NodeJob>, restarts: bool) -> Result<Self, Error> {
        let mut processes = Self { nodes: BTreeMap::new(), restarts };
        for (agent, job) in jobs {
            let mut node = NodeProcess {
                job,
                child: None,
                started: Instant::now(),
                restart_at: None,
                // It is doubled before its first use.
                restart_delay: MIN_RESTART_DELAY / 2,
            };
            node.start()?;
            processes.nodes.insert(agent, node);
        }
        Ok(processes)
    }

    /// Returns the nodes that have ended since the last call, with the reasons.
    pub(super) fn poll_exits(&mut self) -> Vec<(EntityId, String)> {
        let mut ended = Vec::new();
        for (&agent, node) in &mut self.nodes {
            if let Some(reason) = node.poll_exit() {
                ended.push((agent, reason));
                node.restart_at = self.restarts.then(|| Instant::now() + node.restart_delay);
            }
        }
        ended
    }

    /// Does the same, and starts nodes again that are due. One that is started again listens where it did before, as given by
    /// `listens`: the other nodes reconnect to these endpoints.
    ///
    /// # Errors
    /// When one cannot be started again.
    pub(super) fn poll_and_restart(
        &mut self,
        listens: impl Fn(EntityId) -> Option<Vec<String>>,
    ) -> Result<Vec<(EntityId, String)>, Error> {
        let ended = self.poll_exits();
        for (&agent, node) in &mut self.nodes {
            if node.restart_at.is_some_and(|at| at <= Instant::now()) {
                if let Some(listens) = listens(agent) {
                    node.job.listen = listens;
                }
                node.start()?;
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
