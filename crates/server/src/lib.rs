//! The studio's server: runs of any world, watched and steered by a page, over one WebSocket.
//!
//! ```text
//! listen.rs    the port              http.rs      routes and headers      access.rs        rules of access
//! serve.rs     connections           limits.rs    limits of these         state.rs         state of all sockets
//! page.rs      files of the page     compress.rs  gzip                    socket.rs        one page
//! protocol/    messages and frames   request.rs   text -> requests        outbox.rs        messages to be sent
//! session/     one thread per run    keyframes.rs checkpoints for seeking encode/          frames as bytes
//! metric_history.rs  metrics over time               agent_metrics.rs  metrics of each agent
//! event_store.rs, event_search.rs  events      fleet_feed.rs    views of fleets
//! files.rs     readable files        write.rs     writable files          file_choices.rs  files for a text
//! drops.rs     files that are dropped on the page                         file_search.rs   what a file is
//! gallery.rs   scenarios that the program carries                         usage.rs         memory, and its bounds
//! results/     reports, exports        replay_page/    recorded runs as one file that needs no server
//! sweep_gallery/  runs of a sweep as pages
//! ```
//! A session is a thread that owns a `Simulation`. Sockets pass requests to it by a channel, and take replies, states
//! and frames from an outbox; sessions put them there without waiting. So no action or omission of a page affects a
//! result, and a slow page loses frames, never the run. The program that starts the server passes in the worlds.

mod access;
mod agent_metrics;
mod compress;
mod drop_folder;
mod drops;
mod encode;
mod event_log;
mod event_search;
mod event_store;
mod file_choices;
mod file_search;
mod files;
mod fleet_feed;
mod gallery;
mod gallery_picture;
mod http;
mod keyframes;
mod limits;
mod listen;
mod metric_history;
mod outbox;
mod page;
pub mod protocol;
pub mod replay_page;
mod request;
mod results;
mod serve;
mod session;
mod socket;
mod state;
pub mod sweep_gallery;
mod trail_history;
mod usage;
mod usage_registry;
mod write;

pub use encode::FrameEncoder;
pub use fleet_feed::FleetFeed;
pub use gallery::ShippedScenario;
pub use request::{MAX_REQUEST_BYTES, decode};

use access::AccessPolicy;
use files::AllowedFiles;
use keyframes::MemoryBudget;
use protocol::{Problem, TargetRef};
use serve::Timeouts;
use session::{FoxgloveHost, SessionDeps};
use sidestep_kernel::InputError;
use sidestep_scenario::Worlds;
use sidestep_session::{Error, ViewerAddress};
use state::{AppState, MAX_BLOCKING_THREADS};
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;
use usage_registry::UsageRegistry;

/// Maximum number of frames of a session in a second: what the eye takes for motion.
pub const MAX_FRAMES_PER_S: u32 = 30;
/// Maximum memory for the keyframes of a session.
pub const MAX_KEYFRAME_BYTES: usize = 256 << 20;
/// Maximum memory for the keyframes of all sessions together, which share it evenly.
pub const MAX_TOTAL_KEYFRAME_BYTES: usize = 1 << 30;
/// Speeds at which a run can be played, in simulated seconds per second.
pub const SPEED_RANGE: RangeInclusive<f64> = 0.1..=100.0;

/// Options for the start of a server.
#[derive(Clone)]
pub struct ServerOptions {
    /// The worlds whose scenarios can be opened, with the build that runs them.
    pub worlds: Worlds,
    /// The program and its build, for people: the page shows it.
    pub program: String,
    /// Scenarios and recordings to open, and folders that may be read; the current folder if there are none.
    pub targets: Vec<PathBuf>,
    /// The address to listen at, as the user gave it: a name becomes one of the allowed hosts.
    pub host: String,
    /// The port; 0 for any free one, `None` for the first free one of a range.
    pub port: Option<u16>,
    /// Whether texts of pages are refused, and nothing is written.
    pub read_only: bool,
    /// The number of worker threads of each session; no result depends on it.
    pub workers: usize,
    /// The configured address at which viewers of Foxglove's protocol watch the session that was opened last.
    pub foxglove: Option<ViewerAddress>,
    /// Fleets in other processes, which are opened and only watched.
    pub fleets: Vec<Arc<FleetFeed>>,
    /// The scenarios that the program carries.
    pub gallery: &'static [ShippedScenario],
}

/// A running server, until it is ended or dropped.
pub struct StudioServer {
    address: SocketAddr,
    token: Option<String>,
    shutdown: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl StudioServer {
    /// Starts a server in its own thread.
    ///
    /// # Errors
    /// When something that was named does not exist, or the port cannot be bound.
    pub fn start(options: ServerOptions) -> Result<Self, Error> {
        let (folders, mut open) = classify_target_paths(&options.targets);
        for fleet in &options.fleets {
            open.push(TargetRef { kind: "fleet".into(), path: fleet.endpoint.clone() });
        }
        let scenarios = open.iter().filter(|target| target.kind == "scenario");
        let files = AllowedFiles::from_roots(&folders).map_err(|p| problem_to_input_error(&p))?;
        let files = files.with_files_referenced_by(scenarios.map(|target| Path::new(&target.path)));
        let listener = listen::bind(&options.host, options.port)?;
        listener.set_nonblocking(true).map_err(server_start_error)?;
        let address = listener.local_addr().map_err(server_start_error)?;
        let access = AccessPolicy::new(address, &options.host).map_err(server_start_error)?;
        let token = access.token().map(String::from);
        let deps = SessionDeps {
            worlds: options.worlds,
            files,
            workers: options.workers,
            read_only: options.read_only,
            budget: Arc::new(MemoryBudget::new(MAX_TOTAL_KEYFRAME_BYTES, MAX_KEYFRAME_BYTES)),
            foxglove: options.foxglove.map(|address| Arc::new(FoxgloveHost::new(address))),
            fleets: options.fleets,
            gallery: options.gallery,
            usage: UsageRegistry::default(),
        };
        let (shutdown, shutdown_signal) = watch::channel(false);
        let state = Arc::new(AppState::new(deps, access, options.program, open, shutdown_signal));
        // One thread for all sockets: they only pass messages on. Sessions have threads of their own.
        let runtime = Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(MAX_BLOCKING_THREADS)
            .build()
            .map_err(server_start_error)?;
        let thread = std::thread::Builder::new()
            .name("studio".into())
            .spawn(move || run(runtime, listener, &state))
            .map_err(server_start_error)?;
        Ok(Self { address, token, shutdown, thread: Some(thread) })
    }

    /// Returns the page's address, with the token in it where one is needed: one that others can open, too, if they
    /// can reach it and this machine's address is known.
    pub fn url(&self) -> String {
        let host = match self.reachable_ip() {
            None => "localhost".to_string(),
            Some(ip) if ip.is_ipv6() => format!("[{ip}]"),
            Some(ip) => ip.to_string(),
        };
        let token = self.token.as_ref().map(|token| format!("#token={token}")).unwrap_or_default();
        format!("http://{host}:{}/{token}", self.address.port())
    }

    /// Returns the IP address by which it is reached; `None` where it listens at all of them and none is known.
    fn reachable_ip(&self) -> Option<IpAddr> {
        let ip = self.address.ip();
        if ip.is_unspecified() { listen::outbound_address(ip) } else { Some(ip) }
    }

    /// Returns whether its address names this machine in a way that other machines cannot use.
    pub fn has_local_address(&self) -> bool {
        self.reachable_ip().is_none_or(|ip| ip.is_loopback())
    }

    /// Returns whether other machines can reach it.
    pub fn is_open_to_others(&self) -> bool {
        self.token.is_some()
    }

    /// Returns whether it has ended by itself, which is a bug.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for StudioServer {
    /// Ends all sessions, and waits for them, some seconds at most.
    fn drop(&mut self) {
        self.shutdown.send_replace(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Answers requests until the server is ended.
fn run(runtime: Runtime, listener: TcpListener, state: &Arc<AppState>) {
    runtime.block_on(async {
        // A bound, nonblocking listener is never refused.
        let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
        let routes = http::routes(state.clone());
        serve::serve(listener, routes, state.shutdown_receiver(), Timeouts::default()).await;
        state.wait_for_sessions().await;
    });
    // A report or an export in progress is not waited for.
    runtime.shutdown_timeout(Duration::from_millis(100));
}

/// Returns the folders that may be read, and the things to open.
fn classify_target_paths(targets: &[PathBuf]) -> (Vec<PathBuf>, Vec<TargetRef>) {
    let mut folders: Vec<PathBuf> = Vec::new();
    let mut open = Vec::new();
    for path in targets {
        let is_run = path.join("run.json").is_file();
        let is_mcap = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
        let is_sweep = path.join("sweep.json").is_file();
        if !path.is_dir() || is_run || is_sweep {
            let kind = if is_sweep {
                "sweep"
            } else if is_run || is_mcap {
                "recording"
            } else {
                "scenario"
            };
            open.push(TargetRef { kind: kind.into(), path: path.display().to_string() });
        }
        let folder = if path.is_dir() || !path.exists() {
            // A path that does not exist is reported as it was given.
            path.clone()
        } else {
            // Maps and other files of a scenario lie beside it.
            match path.parent() {
                Some(parent) if parent != Path::new("") => parent.to_path_buf(),
                _ => ".".into(),
            }
        };
        if !folders.contains(&folder) {
            folders.push(folder);
        }
    }
    if folders.is_empty() {
        folders.push(".".into());
    }
    (folders, open)
}

fn server_start_error(error: std::io::Error) -> Error {
    Error::other(
        format!("the server cannot be started: {error}"),
        "end other programs, and try again",
    )
}

fn problem_to_input_error(problem: &Problem) -> InputError {
    InputError::new(&problem.place, &*problem.cause, &*problem.remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_named_is_opened_and_its_folder_may_be_read() {
        let place = tempfile::tempdir().expect("a folder");
        let path = |name: &str| place.path().join(name);
        std::fs::create_dir_all(path("run")).expect("made");
        std::fs::write(path("run/run.json"), "{}").expect("written");
        std::fs::create_dir_all(path("sweep")).expect("made");
        std::fs::write(path("sweep/sweep.json"), "{}").expect("written");
        std::fs::write(path("a.toml"), "").expect("written");
        std::fs::write(path("b.mcap"), "").expect("written");
        let targets = ["run", "a.toml", "b.mcap", "sweep"].map(path);
        let (folders, open) = classify_target_paths(&targets);
        assert_eq!(folders, [path("run"), place.path().to_path_buf(), path("sweep")]);
        let kinds: Vec<&str> = open.iter().map(|target| target.kind.as_str()).collect();
        assert_eq!(kinds, ["recording", "scenario", "recording", "sweep"]);
        assert_eq!(classify_target_paths(&[]), (vec![".".into()], vec![]));
        assert_eq!(
            classify_target_paths(&["a.toml".into()]).0,
            [PathBuf::from("a.toml")],
            "it does not exist"
        );
    }
}
