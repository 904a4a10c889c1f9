//! The viewer of a fleet: queries its views, and passes them on to the parent process.

use super::node::endpoint_error;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use crate::wire::view_server::ViewClient;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sidestep::kernel::InputError;
use sidestep::worlds::WORLDS;
use sidestep_session::Error;
use sidestep_session::fleet::{FleetFrame, FleetScene, LinkMessage, WatchJob};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two queries: up to 20 views a second.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Watches a fleet until it is over, or the parent process ends the watching.
///
/// # Errors
/// When there is no reply, the fleet is of another build, or it has fallen silent.
pub(super) fn watch_fleet(job: &WatchJob, parent: &ParentMonitor) -> Result<(), Error> {
    let timeout = Duration::from_secs_f64(job.patience_s);
    let client =
        ViewClient::new(&job.connect, job.tls.as_ref(), timeout).map_err(endpoint_error)?;
    let mut poller = ViewPoller { job, parent, timeout, last_reply: Instant::now() };
    let Some(scene) = poller.poll_until_answered(|| client.query_scene())? else { return Ok(()) };
    // Before the rest is read: the scene of another build may have another form.
    check_build(&scene, job)?;
    print_message(&LinkMessage::Scene(Box::new(parse_reply::<FleetScene>(&scene, job)?)));
    let mut number = 0;
    while let Some(text) = poller.poll_until_answered(|| client.query_view(number))? {
        if !text.is_empty() {
            let view: FleetFrame = parse_reply(&text, job)?;
            let is_over = view.is_over;
            number = view.number;
            print_message(&LinkMessage::Seen(Box::new(view)));
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
    parent: &'a ParentMonitor,
    timeout: Duration,
    last_reply: Instant,
}

impl ViewPoller<'_> {
    /// Repeats a query until there is a reply; `None` when the parent process ends the watching.
    fn poll_until_answered(
        &mut self,
        query: impl Fn() -> Option<String>,
    ) -> Result<Option<String>, Error> {
        while !self.parent.has_ended() {
            if let Some(text) = query() {
                self.last_reply = Instant::now();
                return Ok(Some(text));
            }
            if self.last_reply.elapsed() > self.timeout {
                let place = self.job.connect.join(", ");
                let timeout_s = self.timeout.as_secs_f64();
                let cause = format!("the fleet at {place} was not heard for {timeout_s} s");
                return Err(Error::other(cause, "see whether it flies, and watch it again"));
            }
            // Without a link a query fails at once, and would be repeated in a busy loop.
            sleep(POLL_INTERVAL);
        }
        Ok(None)
    }
}

fn parse_reply<T: DeserializeOwned>(text: &str, job: &WatchJob) -> Result<T, Error> {
    WORLDS.kinds().resolve_names_during(|| serde_json::from_str(text)).map_err(|e| {
        let remedy = "see whether this is the address of a fleet's server";
        InputError::new(job.connect.join(", "), format!("its view cannot be read: {e}"), remedy)
            .into()
    })
}

/// Refuses a fleet of another build.
fn check_build(scene: &str, job: &WatchJob) -> Result<(), Error> {
    #[derive(Deserialize)]
    struct SceneBuildVersion {
        build: String,
    }
    let SceneBuildVersion { build } = parse_reply(scene, job)?;
    if build == job.build {
        return Ok(());
    }
    let cause = format!("the fleet is of sidestep {build}, and this is {}", job.build);
    let remedy = "watch it with the build that flies it";
    Err(InputError::new(job.connect.join(", "), cause, remedy).into())
}
