//! Fleets that the studio watches: `sidestep-link` receives their views, in a thread for each, and a feed hands them to the
//! studio.

use crate::exit::Failure;
use crate::interrupt;
use crate::link;
use crate::worlds;
use sidestep_server::FleetFeed;
use sidestep_session::fleet::{Job, JobError, LinkMessage, Tls, WatchJob};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::sleep;
use std::time::Duration;

/// Seconds that a fleet has to answer; after as long a silence it is taken to be lost. As long as the default of --lease.
const FLEET_TIMEOUT_S: f64 = 10.0;

/// Time between two attempts to reach a fleet at an endpoint where one has ended or was lost. It is longer than the second
/// for which a server that ends still publishes its last view, so that the same fleet is not taken for a new one.
const RECONNECT_DELAY: Duration = Duration::from_secs(2);

/// Returns whether an argument is a fleet's endpoint, e.g. `tcp/127.0.0.1:7600`, rather than a file.
pub(crate) fn is_endpoint(argument: &Path) -> bool {
    let has_form = argument.to_str().and_then(|text| {
        let address = ["tcp/", "tls/"].iter().find_map(|protocol| text.strip_prefix(protocol))?;
        let (host, port) = address.rsplit_once(':')?;
        Some(!host.is_empty() && !host.contains('/') && port.parse::<u16>().is_ok())
    });
    has_form == Some(true) && !argument.exists()
}

/// Divides arguments into files and endpoints of fleets.
pub(crate) fn split_endpoints(arguments: &[PathBuf]) -> (Vec<PathBuf>, Vec<String>) {
    let (fleets, files): (Vec<&PathBuf>, Vec<&PathBuf>) =
        arguments.iter().partition(|path| is_endpoint(path));
    let fleets = fleets.into_iter().map(|path| path.display().to_string()).collect();
    (files.into_iter().cloned().collect(), fleets)
}

/// Begins to watch a fleet; returns its feed once the fleet has answered.
///
/// # Errors
/// When the program that carries the network is not there, or the fleet does not answer.
pub(crate) fn start_watching(
    endpoint: &str,
    tls: Option<Tls>,
    is_insecure: bool,
) -> Result<Arc<FleetFeed>, Failure> {
    let job = Job::Watch(WatchJob {
        build: worlds().build().into(),
        connect: vec![endpoint.to_string()],
        tls,
        is_insecure,
        patience_s: FLEET_TIMEOUT_S,
    });
    let (first_sender, first) = channel();
    let endpoint = endpoint.to_string();
    std::thread::spawn(move || watch_fleets(&job, &endpoint, &first_sender));
    // The thread sends a feed or a failure, unless the command is interrupted before.
    first.recv().unwrap_or(Err(Failure::Interrupted))
}

/// Publishes the views of one fleet after the other at an endpoint, until the command is interrupted. The feed, or the reason
/// why there is none, is sent to `first`.
fn watch_fleets(job: &Job, endpoint: &str, first: &Sender<Result<Arc<FleetFeed>, Failure>>) {
    let mut feed = None;
    while !interrupt::is_requested() {
        match (watch_fleet(job, endpoint, first, &mut feed), &feed) {
            (Err(failure), Some(feed)) => {
                let JobError { cause, remedy, .. } = JobError::from(&failure);
                feed.mark_disconnected(&cause, &remedy);
            }
            (Err(failure), None) => return drop(first.send(Err(failure))),
            (Ok(()), _) => {}
        }
        sleep(RECONNECT_DELAY);
    }
}

/// Publishes the views of a fleet, until it has ended or is lost.
fn watch_fleet(
    job: &Job,
    endpoint: &str,
    first: &Sender<Result<Arc<FleetFeed>, Failure>>,
    feed: &mut Option<Arc<FleetFeed>>,
) -> Result<(), Failure> {
    link::run_job(job, |message| match (message, &*feed) {
        (LinkMessage::Scene(scene), None) => {
            let new = Arc::new(FleetFeed::new(endpoint.to_string(), *scene));
            // The receiver waits until it has this.
            let _ = first.send(Ok(new.clone()));
            *feed = Some(new);
        }
        (LinkMessage::Scene(scene), Some(feed)) => feed.restart(*scene),
        (LinkMessage::Seen(view), Some(feed)) => feed.replace_view(*view),
        // A view before its scene cannot be shown; the other messages belong to other jobs, or are handled by `run_job`.
        _ => {}
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_told_from_files() {
        let arguments =
            ["tcp/127.0.0.1:7600", "tls/host:1", "a.toml", "tcp/a", "tcp/a/b:1", "tcp/:1"];
        let (files, fleets) = split_endpoints(&arguments.map(PathBuf::from));
        assert_eq!(fleets, ["tcp/127.0.0.1:7600", "tls/host:1"]);
        assert_eq!(files.len(), 4);
    }
}
