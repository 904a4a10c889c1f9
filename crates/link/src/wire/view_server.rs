//! Views of a fleet, which viewers fetch from its server by query and reply.
//!
//! Nothing is pushed, and each viewer has at most one query in flight: so a viewer that is slow, or has stopped, gets fewer
//! views and slows nobody. Views are made only while there are queries.

use super::endpoint::{WireSetupError, without_sources};
use super::zenoh::{ZenohWire, open_query_session};
use sidestep_session::fleet::Tls;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

/// The key of the unchanging part; no peer has that name.
const SCENE_KEY: &str = "sidestep/scene";

/// The key of the newest view.
const VIEW_KEY: &str = "sidestep/view";

/// Time after a query in which there counts as being a viewer: much longer than the time between two queries of one.
pub(crate) const VIEWER_TIMEOUT: Duration = Duration::from_secs(3);

/// Time between two checks whether the last view was fetched.
const FETCH_POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Time that a reply may take.
const QUERY_TIMEOUT: Duration = Duration::from_secs(1);

/// The newest view, and when it was fetched.
#[derive(Debug, Default)]
struct LatestView {
    text: String,
    number: u64,
    /// The largest number of a view that was fetched.
    fetched: u64,
    last_query: Option<Instant>,
}

impl LatestView {
    /// Returns the view if it is newer than the one that the viewer has, else an empty text.
    fn text_if_newer(&mut self, after: u64) -> String {
        self.last_query = Some(Instant::now());
        if self.number <= after {
            return String::new();
        }
        self.fetched = self.number;
        self.text.clone()
    }
}

/// The side of the fleet's server. It answers until it is dropped.
pub struct ViewServer {
    latest: Arc<Mutex<LatestView>>,
    _queryables: [Queryable<()>; 2],
    _session: Session,
}

impl fmt::Debug for ViewServer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ViewServer").finish_non_exhaustive()
    }
}

fn lock(latest: &Mutex<LatestView>) -> MutexGuard<'_, LatestView> {
    latest.lock().unwrap_or_else(PoisonError::into_inner)
}

impl ViewServer {
    /// Answers queries over a server's wire from now on; `scene` is the unchanging part.
    ///
    /// # Errors
    /// When the wire is closed.
    pub fn start(wire: &ZenohWire, scene: String) -> Result<Self, WireSetupError> {
        let session = wire.server_session().clone();
        let latest = Arc::new(Mutex::new(LatestView::default()));
        let scenes = session
            .declare_queryable(SCENE_KEY)
            .callback(move |query| reply(&query, scene.clone()))
            .wait()
            .map_err(|e| closed_wire_error(&e))?;
        let queried = latest.clone();
        let views = session
            .declare_queryable(VIEW_KEY)
            .callback(move |query| {
                let after = query.parameters().get("after").and_then(|number| number.parse().ok());
                let text = lock(&queried).text_if_newer(after.unwrap_or(0));
                reply(&query, text);
            })
            .wait()
            .map_err(|e| closed_wire_error(&e))?;
        Ok(Self { latest, _queryables: [scenes, views], _session: session })
    }

    /// Returns whether there was a query in the last seconds.
    pub fn is_watched(&self) -> bool {
        lock(&self.latest).last_query.is_some_and(|query| query.elapsed() < VIEWER_TIMEOUT)
    }

    /// Makes a view the newest one; its number is above all earlier ones.
    pub fn set_latest(&self, number: u64, text: String) {
        let mut latest = lock(&self.latest);
        latest.number = number;
        latest.text = text;
    }

    /// Waits at most the given time until the newest view has been fetched, if there is a viewer.
    pub fn wait_until_fetched(&self, within: Duration) {
        let until = Instant::now() + within;
        while self.is_watched() && !self.is_fetched() && Instant::now() < until {
            sleep(FETCH_POLL_INTERVAL);
        }
    }

    fn is_fetched(&self) -> bool {
        let latest = lock(&self.latest);
        latest.fetched == latest.number
    }
}

fn closed_wire_error(error: &zenoh::Error) -> WireSetupError {
    WireSetupError::Taken { endpoint: VIEW_KEY.into(), reason: without_sources(&error.to_string()) }
}

fn reply(query: &Query, text: String) {
    // An error means that the viewer has left meanwhile.
    let _ = query.reply(query.key_expr().clone(), text).wait();
}

/// The side of a viewer.
pub struct ViewClient(Session);

impl fmt::Debug for ViewClient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ViewClient").finish_non_exhaustive()
    }
}

impl ViewClient {
    /// Connects to a fleet's server, at one of some endpoints.
    ///
    /// # Errors
    /// When none of them answers within some time.
    pub fn new(
        connect: &[String],
        tls: Option<&Tls>,
        within: Duration,
    ) -> Result<Self, WireSetupError> {
        open_query_session(connect, tls, within).map(Self)
    }

    /// Queries the unchanging part; `None` when there is no reply.
    pub fn query_scene(&self) -> Option<String> {
        self.query(SCENE_KEY)
    }

    /// Queries a view newer than the one with a number: empty if there is none. `None` when there is no reply.
    pub fn query_view(&self, after: u64) -> Option<String> {
        self.query(&format!("{VIEW_KEY}?after={after}"))
    }

    fn query(&self, selector: &str) -> Option<String> {
        let query = self.0.get(selector).timeout(QUERY_TIMEOUT);
        // A reply that cannot be sent soon is dropped, and queried again: waiting for it would stop the server.
        let replies = query.congestion_control(CongestionControl::Drop).wait().ok()?;
        let reply = replies.recv().ok()?.into_result().ok()?;
        String::from_utf8(reply.payload().to_bytes().into_owned()).ok()
    }
}
