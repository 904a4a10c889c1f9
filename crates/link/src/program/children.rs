//! The crew: processes of nodes on this machine, started, watched and ended.
//!
//! A node ends when its standard input does, so it cannot outlive the server, however that ends. Those that do not end
//! when they are asked to are killed: a stopped process hears nothing.

use sidestep::kernel::EntityId;
use sidestep_session::Error;
use sidestep_session::fleet::{Job, JobError, LinkMessage, NodeJob};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time that nodes have to end when they are asked to.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);

/// Time after which a node that has ended is started again; twice as long after each time that it has not lasted.
const MIN_RESTART_DELAY: Duration = Duration::from_millis(500);

/// Longest time before a node is started again.
const MAX_RESTART_DELAY: Duration = Duration::from_secs(16);

/// Time that a node must last to count as one that does.
const MIN_STABLE_UPTIME: Duration = Duration::from_secs(10);

/// Zenoh's threads: a node says little, and each thread costs memory.
const ZENOH_RUNTIME_CONFIG: &str = "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), \
                       net: (handover: rx), app: (handover: rx))";

/// A node of the crew.
struct NodeProcess {
    job: NodeJob,
    child: Option<Child>,
    began: Instant,
    /// Time at which it is started again, if it has ended.
    again_at: Option<Instant>,
    /// The wait until then.
    wait: Duration,
}

/// The nodes that this process has started.
pub(super) struct NodeProcesses {
    mates: BTreeMap<EntityId, NodeProcess>,
    /// Whether nodes that have ended are started again.
    restarts: bool,
}

impl NodeProcess {
    fn start(&mut self) -> Result<(), Error> {
        let cannot = |e: std::io::Error| {
            Error::other(format!("cannot start a node: {e}"), "see whether there is memory left")
        };
        let program = std::env::current_exe().map_err(cannot)?;
        let mut command = Command::new(program);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .env("ZENOH_RUNTIME", ZENOH_RUNTIME_CONFIG);
        // Ctrl-C in a terminal is for the program that started the fleet, which ends all in good order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(cannot)?;
        let mut line = serde_json::to_string(&Job::Node(self.job.clone())).expect("plain data");
        line.push('\n');
        if let Some(stdin) = &mut child.stdin {
            // One that has ended at once is found below.
            let _ = stdin.write_all(line.as_bytes());
        }
        (self.child, self.began, self.again_at) = (Some(child), Instant::now(), None);
        Ok(())
    }

    /// Returns how the node has ended, once it has.
    fn poll_exit(&mut self) -> Option<String> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        let reason = last_error(child).unwrap_or_else(|| describe_exit(status));
        self.child = None;
        self.wait = if self.began.elapsed() > MIN_STABLE_UPTIME {
            MIN_RESTART_DELAY
        } else {
            (2 * self.wait).min(MAX_RESTART_DELAY)
        };
        Some(reason)
    }
}

/// Returns the last message of a node: why it could not go on.
fn last_error(child: &mut Child) -> Option<String> {
    let out = BufReader::new(child.stdout.take()?);
    let told = out.lines().map_while(Result::ok).last()?;
    match serde_json::from_str(&told).ok()? {
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
        let mut crew = Self { mates: BTreeMap::new(), restarts };
        for (agent, job) in jobs {
            let began = Instant::now();
            let mut mate = NodeProcess {
                job,
                child: None,
                began,
                again_at: None,
                wait: MIN_RESTART_DELAY / 2,
            };
            mate.start()?;
            crew.mates.insert(agent, mate);
        }
        Ok(crew)
    }

    /// Looks after the processes. Returns the nodes that have ended since the last call, with the reasons. One that is
    /// started again is reached where it was before, as given by `reached`: there the others look for it.
    ///
    /// # Errors
    /// When one cannot be started again.
    pub(super) fn poll(
        &mut self,
        reached: impl Fn(EntityId) -> Option<Vec<String>>,
    ) -> Result<Vec<(EntityId, String)>, Error> {
        let mut gone = Vec::new();
        for (&agent, mate) in &mut self.mates {
            if let Some(reason) = mate.poll_exit() {
                gone.push((agent, reason));
                mate.again_at = self.restarts.then(|| Instant::now() + mate.wait);
            }
            if mate.again_at.is_some_and(|at| at <= Instant::now()) {
                mate.job.listen = reached(agent).unwrap_or_else(|| mate.job.listen.clone());
                mate.start()?;
            }
        }
        Ok(gone)
    }

    /// Ends all nodes, and waits until they have.
    pub(super) fn shut_down(&mut self) {
        let children = self.mates.values_mut().filter_map(|mate| mate.child.as_mut());
        let mut children: Vec<&mut Child> = children.collect();
        for child in &mut children {
            drop(child.stdin.take());
        }
        let until = Instant::now() + SHUTDOWN_TIMEOUT;
        let runs = |child: &mut &mut Child| child.try_wait().is_ok_and(|status| status.is_none());
        while children.iter_mut().any(runs) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
        for child in children {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for NodeProcesses {
    fn drop(&mut self) {
        self.shut_down();
    }
}
