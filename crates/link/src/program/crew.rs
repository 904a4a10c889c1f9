//! The crew: processes of nodes on this machine, started, watched and ended.
//!
//! A node ends when its standard input does, so it cannot outlive the server, however that ends. Those that do not end
//! when they are asked to are killed: a stopped process hears nothing.

use sidestep::kernel::EntityId;
use sidestep_session::Error;
use sidestep_session::fleet::{Failed, Job, NodeJob, Told};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time that nodes have to end when they are asked to.
const PATIENCE: Duration = Duration::from_secs(2);

/// Time after which a node that has ended is started again; twice as long after each time that it has not lasted.
const AGAIN: Duration = Duration::from_millis(500);

/// Longest time before a node is started again.
const LONGEST: Duration = Duration::from_secs(16);

/// Time that a node must last to count as one that does.
const LASTS: Duration = Duration::from_secs(10);

/// Zenoh's threads: a node says little, and each thread costs memory.
const RUNTIME: &str = "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), \
                       net: (handover: rx), app: (handover: rx))";

/// A node of the crew.
struct Mate {
    job: NodeJob,
    child: Option<Child>,
    began: Instant,
    /// Time at which it is started again, if it has ended.
    again_at: Option<Instant>,
    /// The wait until then.
    wait: Duration,
}

/// The nodes that this process has started.
pub(super) struct Crew {
    mates: BTreeMap<EntityId, Mate>,
    /// Whether nodes that have ended are started again.
    restarts: bool,
}

impl Mate {
    fn start(&mut self) -> Result<(), Error> {
        let cannot = |e: std::io::Error| {
            Error::stopped(format!("cannot start a node: {e}"), "see whether there is memory left")
        };
        let program = std::env::current_exe().map_err(cannot)?;
        let mut command = Command::new(program);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).env("ZENOH_RUNTIME", RUNTIME);
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
    fn ended(&mut self) -> Option<String> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        let reason = last_words(child).unwrap_or_else(|| words_of(status));
        self.child = None;
        self.wait = if self.began.elapsed() > LASTS { AGAIN } else { (2 * self.wait).min(LONGEST) };
        Some(reason)
    }
}

/// Returns the last message of a node: why it could not go on.
fn last_words(child: &mut Child) -> Option<String> {
    let out = BufReader::new(child.stdout.take()?);
    let told = out.lines().map_while(Result::ok).last()?;
    match serde_json::from_str(&told).ok()? {
        Told::Failed(Failed { cause, .. }) => Some(cause),
        _ => None,
    }
}

fn words_of(status: ExitStatus) -> String {
    format!("its process has ended ({status})")
}

impl Crew {
    /// Starts a node for each job; with `restarts`, one that ends is started again.
    ///
    /// # Errors
    /// When a process cannot be started.
    pub(super) fn start(jobs: BTreeMap<EntityId, NodeJob>, restarts: bool) -> Result<Self, Error> {
        let mut crew = Self { mates: BTreeMap::new(), restarts };
        for (agent, job) in jobs {
            let began = Instant::now();
            let mut mate = Mate { job, child: None, began, again_at: None, wait: AGAIN / 2 };
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
    pub(super) fn look(
        &mut self,
        reached: impl Fn(EntityId) -> Option<Vec<String>>,
    ) -> Result<Vec<(EntityId, String)>, Error> {
        let mut gone = Vec::new();
        for (&agent, mate) in &mut self.mates {
            if let Some(reason) = mate.ended() {
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
    pub(super) fn end(&mut self) {
        let children = self.mates.values_mut().filter_map(|mate| mate.child.as_mut());
        let mut children: Vec<&mut Child> = children.collect();
        for child in &mut children {
            drop(child.stdin.take());
        }
        let until = Instant::now() + PATIENCE;
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

impl Drop for Crew {
    fn drop(&mut self) {
        self.end();
    }
}
