//! The watcher of a fleet: asks for its views, and passes them on.

use super::node::endpoint_error;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use crate::wire::view_server::ViewClient;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sidestep::kernel::InputError;
use sidestep_session::Error;
use sidestep_session::fleet::{FleetFrame, FleetScene, LinkMessage, WatchJob};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two questions.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Watches a fleet until it is over, or the parent process has seen enough.
///
/// # Errors
/// When no answer comes, the fleet is of another build, or it has fallen silent.
pub(super) fn watch(job: &WatchJob, lifeline: &ParentMonitor) -> Result<(), Error> {
    let patience = Duration::from_secs_f64(job.patience_s);
    let outlook =
        ViewClient::new(&job.connect, job.tls.as_ref(), patience).map_err(endpoint_error)?;
    let mut viewer = ViewPoller { job, lifeline, patience, heard: Instant::now() };
    let Some(scene) = viewer.poll_until_answered(|| outlook.scene())? else { return Ok(()) };
    check_build(&scene, job)?;
    print_message(&LinkMessage::Scene(Box::new(read::<FleetScene>(&scene, job)?)));
    let mut number = 0;
    while let Some(text) = viewer.poll_until_answered(|| outlook.view(number))? {
        if !text.is_empty() {
            let seen: FleetFrame = read(&text, job)?;
            let is_over = seen.is_over;
            number = seen.number;
            print_message(&LinkMessage::Seen(Box::new(seen)));
            if is_over {
                break;
            }
        }
        sleep(POLL_INTERVAL);
    }
    Ok(())
}

struct ViewPoller<'a> {
    job: &'a WatchJob,
    lifeline: &'a ParentMonitor,
    patience: Duration,
    heard: Instant,
}

impl ViewPoller<'_> {
    /// Asks until there is an answer; `None` when it is no longer wanted.
    fn poll_until_answered(
        &mut self,
        ask: impl Fn() -> Option<String>,
    ) -> Result<Option<String>, Error> {
        while !self.lifeline.has_ended() {
            if let Some(text) = ask() {
                self.heard = Instant::now();
                return Ok(Some(text));
            }
            if self.heard.elapsed() > self.patience {
                let (place, s) = (self.job.connect.join(", "), self.patience.as_secs_f64());
                let cause = format!("the fleet at {place} was not heard for {s} s");
                return Err(Error::other(cause, "see whether it flies, and watch it again"));
            }
            // Without a link, the lack of an answer may show at once.
            sleep(POLL_INTERVAL);
        }
        Ok(None)
    }
}

fn read<T: DeserializeOwned>(text: &str, job: &WatchJob) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|e| {
        let remedy = "see whether this is the address of a fleet's server";
        InputError::new(job.connect.join(", "), format!("its view cannot be read: {e}"), remedy)
            .into()
    })
}

/// Refuses a fleet of another build, because its views may have another form.
fn check_build(scene: &str, job: &WatchJob) -> Result<(), Error> {
    #[derive(Deserialize)]
    struct SceneBuild {
        build: String,
    }
    let SceneBuild { build } = read(scene, job)?;
    if build == job.build {
        return Ok(());
    }
    let cause = format!("the fleet is of sidestep {build}, and this is {}", job.build);
    let remedy = "watch it with the build that flies it";
    Err(InputError::new(job.connect.join(", "), cause, remedy).into())
}
