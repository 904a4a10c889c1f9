//! `sidestep studio`: the server of the page that watches, steers and replays runs.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::fleet_watch;
use crate::foxglove;
use crate::gallery::SHIPPED;
use crate::interrupt;
use crate::link::TlsArgs;
use crate::scenario_args::WorkersArg;
use crate::worlds;
use clap::Args;
use serde_json::json;
use sidestep_server::{ServerOptions, StudioServer};
use sidestep_session::ViewerAddress;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  sidestep studio                          choose from the current folder
  sidestep studio scenarios/robots/office.toml
  sidestep studio runs/office              replay a recorded run
  sidestep studio scenarios --port 8000 --no-open
  sidestep studio --addr 0.0.0.0           for others, who need its token
  sidestep studio office.toml --foxglove 127.0.0.1:8765
  sidestep studio tcp/127.0.0.1:7600       watch the fleet that flies there
  sidestep studio tcp/10.0.0.1:7600 --insecure
                                           one on another machine, on a network that you trust

The page may read what lies below the given folders, the folders of the given \
files, or else the current folder. It writes what you save there, and nothing else. Ctrl-C ends it.";

/// The time between two checks for an interrupt: a key press seems to act at once.
const STOP_POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Watch, steer, replay and edit in the browser.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct StudioArgs {
    /// Scenarios, folders of runs and sweeps and MCAP files to open, folders to choose from, and
    /// endpoints of fleets to watch
    #[arg(value_name = "SCENARIO|DIR|FILE|ENDPOINT")]
    targets: Vec<PathBuf>,

    /// Address to listen on; any but a loopback address requires a token
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    addr: String,

    /// Port; 0 for any free one [default: the first free one from 7800 on]
    #[arg(long, value_name = "N")]
    port: Option<u16>,

    /// Do not open the page in a browser
    #[arg(long)]
    no_open: bool,

    /// Read-only: refuse scenario texts that are changed in the page
    #[arg(long)]
    read_only: bool,

    /// Also show the scenario or recording opened last in Foxglove and Lichtblick, which may play,
    /// pause and seek
    #[arg(long, value_name = "ADDR", value_parser = clap::value_parser!(ViewerAddress))]
    foxglove: Option<ViewerAddress>,

    #[command(flatten)]
    workers: WorkersArg,

    /// Watch fleets on other machines without certificates: whoever is on the way can read and change what is shown
    #[arg(long, conflicts_with = "tls_ca", help_heading = "Encryption")]
    insecure: bool,

    #[command(flatten)]
    tls: TlsArgs,
}

/// Runs the command until it is interrupted.
///
/// # Errors
/// If a given file or folder does not exist, a fleet does not answer, or the port cannot be bound.
pub(crate) fn studio(args: &StudioArgs, console: Console) -> Result<ExitCode, Failure> {
    interrupt::listen()?;
    let foxglove = args.foxglove.as_ref().map(ViewerAddress::with_free_port).transpose()?;
    let (targets, fleets) = fleet_watch::split_endpoints(&args.targets);
    let mut watched = Vec::new();
    for endpoint in &fleets {
        watched.push(fleet_watch::start_watching(endpoint, args.tls.files(), args.insecure)?);
    }
    let studio = StudioServer::start(ServerOptions {
        worlds: worlds().clone(),
        program: format!("sidestep {}", worlds().build()),
        targets,
        host: args.addr.clone(),
        port: args.port,
        read_only: args.read_only,
        workers: args.workers.count(),
        foxglove: foxglove.clone(),
        fleets: watched,
        gallery: &SHIPPED,
    })?;
    if let Some(at) = &foxglove {
        foxglove::print_address(at, console);
    }
    announce(&studio, args.no_open, console)?;
    wait_for_end(&studio)?;
    drop(studio);
    Ok(ExitCode::Done)
}

/// Prints the address of the studio and whether others can reach it, and opens it in a browser where that is safe.
fn announce(studio: &StudioServer, no_open: bool, console: Console) -> Result<(), Failure> {
    let url = studio.url();
    if studio.is_open_to_others() {
        console.warn(
            "others can reach this studio: anyone with its address and token can run scenarios\n  \
             and read what it may read; what is sent is not encrypted",
        );
    }
    if studio.is_open_to_others() && studio.has_local_address() {
        console.note("From another machine, use this machine's host name or IP address instead.");
    }
    console.print_result_or_short(&json!({ "url": url }), &format!("{url}\n"), || {
        format!("The studio is at {url}\nCtrl-C ends it.\n")
    })?;
    if no_open {
        return Ok(());
    }
    if studio.is_open_to_others() {
        // All users of a machine can read the arguments of a process, so the token is not passed to a browser.
        console.note("Open the address yourself: it has the token in it.");
    } else {
        open_browser(&url, console);
    }
    Ok(())
}

/// Waits until the command is interrupted, or the server ends by itself.
fn wait_for_end(studio: &StudioServer) -> Result<(), Failure> {
    while !interrupt::is_requested() {
        if studio.has_ended() {
            let remedy = "please report it with the lines above";
            return Err(Failure::other("the server has ended by itself, which is a bug", remedy));
        }
        std::thread::sleep(STOP_POLL_INTERVAL);
    }
    Ok(())
}

/// Opens a page in the user's browser, if there is one.
fn open_browser(url: &str, console: Console) {
    let (program, args): (&str, &[&str]) = if cfg!(windows) {
        // `start` takes its first argument for a window's title if it is quoted.
        ("cmd", &["/c", "start", ""])
    } else if cfg!(target_os = "macos") {
        ("open", &[])
    } else {
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(args).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    match command.spawn() {
        // A thread waits for its end, so that no zombie process is left.
        Ok(mut child) => drop(std::thread::spawn(move || child.wait())),
        Err(_) => console.note("No browser could be started: open the address yourself."),
    }
}
