//! Fleets that the studio watches: `sidestep-link` hears them, in a thread for each, and a screen shows them.

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

/// Seconds that a fleet has to answer; after as long a silence it is taken to be gone.
const FLEET_TIMEOUT_S: f64 = 10.0;

/// Time after which it looks again whether a fleet flies where one has ended or was lost. A server that is about to
/// end shows its last view for a second.
const RECONNECT_DELAY: Duration = Duration::from_secs(2);

/// Returns whether the command line names a fleet's endpoint here, e.g. `tcp/127.0.0.1:7600`, rather than a file.
pub(crate) fn is_endpoint(named: &Path) -> bool {
    let is_one = named.to_str().and_then(|text| {
        let address = ["tcp/", "tls/"].iter().find_map(|protocol| text.strip_prefix(protocol))?;
        let (host, port) = address.rsplit_once(':')?;
        Some(!host.is_empty() && !host.contains('/') && port.parse::<u16>().is_ok())
    });
    is_one == Some(true) && !named.exists()
}

/// Divides the named things into files and endpoints of fleets.
pub(crate) fn split_endpoints(named: &[PathBuf]) -> (Vec<PathBuf>, Vec<String>) {
    let (fleets, files): (Vec<&PathBuf>, Vec<&PathBuf>) =
        named.iter().partition(|path| is_endpoint(path));
    let fleets = fleets.into_iter().map(|path| path.display().to_string()).collect();
    (files.into_iter().cloned().collect(), fleets)
}

/// Begins to watch a fleet; returns its screen once it has answered.
///
/// # Errors
/// When the program that carries the network is not there, or the fleet does not answer.
pub(crate) fn start_watching(endpoint: &str, tls: Option<Tls>) -> Result<Arc<FleetFeed>, Failure> {
    let job = Job::Watch(WatchJob {
        build: worlds().build().into(),
        connect: vec![endpoint.to_string()],
        tls,
        patience_s: FLEET_TIMEOUT_S,
    });
    let (began, begins) = channel();
    let endpoint = endpoint.to_string();
    std::thread::spawn(move || watch_fleets(&job, &endpoint, &began));
    // It says how it began, or why it did not, in any case.
    begins.recv().unwrap_or(Err(Failure::Interrupted))
}

/// Puts the news of one fleet after the other that flies there on a screen, until the command is interrupted.
fn watch_fleets(job: &Job, endpoint: &str, began: &Sender<Result<Arc<FleetFeed>, Failure>>) {
    let mut screen = None;
    while !interrupt::is_requested() {
        match (watch_fleet(job, endpoint, began, &mut screen), &screen) {
            (Err(failure), Some(screen)) => {
                let JobError { cause, remedy, .. } = JobError::from(&failure);
                screen.mark_lost(&cause, &remedy);
            }
            (Err(failure), None) => return drop(began.send(Err(failure))),
            (Ok(()), _) => {}
        }
        sleep(RECONNECT_DELAY);
    }
}

/// Puts the news of a fleet on a screen, until it is over or gone.
fn watch_fleet(
    job: &Job,
    endpoint: &str,
    began: &Sender<Result<Arc<FleetFeed>, Failure>>,
    screen: &mut Option<Arc<FleetFeed>>,
) -> Result<(), Failure> {
    link::run_job(job, |told| match (told, &*screen) {
        (LinkMessage::Scene(staged), None) => {
            let made = Arc::new(FleetFeed::new(endpoint.to_string(), *staged));
            // The waiting thread is there until it has an answer.
            let _ = began.send(Ok(made.clone()));
            *screen = Some(made);
        }
        (LinkMessage::Scene(staged), Some(screen)) => screen.restart(*staged),
        (LinkMessage::Seen(seen), Some(screen)) => screen.publish(*seen),
        // Said of other jobs, or by the end of this one.
        _ => {}
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_told_from_files() {
        let named = ["tcp/127.0.0.1:7600", "tls/host:1", "a.toml", "tcp/a", "tcp/a/b:1", "tcp/:1"];
        let (files, fleets) = split_endpoints(&named.map(PathBuf::from));
        assert_eq!(fleets, ["tcp/127.0.0.1:7600", "tls/host:1"]);
        assert_eq!(files.len(), 4);
    }
}
