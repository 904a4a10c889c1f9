//! The window of a fleet: views of it, which watchers fetch from its server by query and reply.
//!
//! Nothing is sent unasked, and each watcher has one question on the way: so a watcher that is slow, or has stopped,
//! sees less and slows none of the others. Views are made only while they are asked for.

use super::endpoint::WireError;
use super::zenoh::{ZenohWire, open_query_session};
use sidestep_session::fleet::Tls;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

/// The key of the unchanging part; no party has that name.
const SCENE_KEY: &str = "sidestep/scene";

/// The key of the newest view.
const VIEW_KEY: &str = "sidestep/view";

/// Time after a question in which its asker counts as a watcher.
const WATCHER_TIMEOUT: Duration = Duration::from_secs(3);

/// Time between two looks at whether the last view was fetched.
const FETCH_POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Time that an answer may take.
const QUERY_TIMEOUT: Duration = Duration::from_secs(1);

/// The newest view, and the record of who has it.
#[derive(Debug, Default)]
struct LatestView {
    text: String,
    number: u64,
    /// The largest number of a view that was fetched.
    fetched: u64,
    asked: Option<Instant>,
}

impl LatestView {
    /// Returns the view if it is newer than the one that the asker has, else nothing.
    fn fetch(&mut self, after: u64) -> String {
        self.asked = Some(Instant::now());
        if self.number <= after {
            return String::new();
        }
        self.fetched = self.number;
        self.text.clone()
    }
}

/// The server's side of the window. It stays open until it is dropped.
pub struct ViewServer {
    pane: Arc<Mutex<LatestView>>,
    _answers: [Queryable<()>; 2],
    _session: Session,
}

impl fmt::Debug for ViewServer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Window").finish_non_exhaustive()
    }
}

fn lock(pane: &Mutex<LatestView>) -> MutexGuard<'_, LatestView> {
    pane.lock().unwrap_or_else(PoisonError::into_inner)
}

impl ViewServer {
    /// Opens a window at a server's wire, with the unchanging part.
    ///
    /// # Errors
    /// When the wire is closed.
    pub fn open(wire: &ZenohWire, scene: String) -> Result<Self, WireError> {
        let (session, pane) = (wire.session().clone(), Arc::new(Mutex::new(LatestView::default())));
        let closed =
            |e: zenoh::Error| WireError::Taken { endpoint: VIEW_KEY.into(), reason: e.to_string() };
        let tell_scene = move |query: Query| reply(&query, scene.clone());
        let scenes = session.declare_queryable(SCENE_KEY).callback(tell_scene).wait();
        let asked = pane.clone();
        let tell_view = move |query: Query| {
            let after = query.parameters().get("after").and_then(|number| number.parse().ok());
            let text = lock(&asked).fetch(after.unwrap_or(0));
            reply(&query, text);
        };
        let views = session.declare_queryable(VIEW_KEY).callback(tell_view).wait();
        let answers = [scenes.map_err(closed)?, views.map_err(closed)?];
        Ok(Self { pane, _answers: answers, _session: session })
    }

    /// Returns whether a question came a short while ago.
    pub fn is_watched(&self) -> bool {
        lock(&self.pane).asked.is_some_and(|asked| asked.elapsed() < WATCHER_TIMEOUT)
    }

    /// Shows a view; its number is above all earlier ones.
    pub fn publish(&self, number: u64, text: String) {
        let mut pane = lock(&self.pane);
        (pane.number, pane.text) = (number, text);
    }

    /// Waits a little until the last view has been fetched, if there is a watcher.
    pub fn wait_until_fetched(&self, within: Duration) {
        let until = Instant::now() + within;
        let is_fetched = || {
            let pane = lock(&self.pane);
            pane.fetched == pane.number
        };
        while self.is_watched() && !is_fetched() && Instant::now() < until {
            sleep(FETCH_POLL_INTERVAL);
        }
    }
}

fn reply(query: &Query, text: String) {
    // A watcher that has gone meanwhile needs no answer.
    let _ = query.reply(query.key_expr().clone(), text).wait();
}

/// The viewer's side of the window.
pub struct ViewClient(Session);

impl fmt::Debug for ViewClient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outlook").finish_non_exhaustive()
    }
}

impl ViewClient {
    /// Connects to a fleet's server, at one of some endpoints.
    ///
    /// # Errors
    /// When none of them answers within some time.
    pub fn new(connect: &[String], tls: Option<&Tls>, within: Duration) -> Result<Self, WireError> {
        open_query_session(connect, tls, within).map(Self)
    }

    /// Asks for the unchanging part; `None` when there is no answer.
    pub fn scene(&self) -> Option<String> {
        self.query(SCENE_KEY)
    }

    /// Asks for a view newer than the one with a number: empty if there is none. `None` when there is no answer.
    pub fn view(&self, after: u64) -> Option<String> {
        self.query(&format!("{VIEW_KEY}?after={after}"))
    }

    fn query(&self, selector: &str) -> Option<String> {
        let asked = self.0.get(selector).timeout(QUERY_TIMEOUT);
        // An answer that cannot be sent soon is lost, and asked for again.
        let replies = asked.congestion_control(CongestionControl::Drop).wait().ok()?;
        let reply = replies.recv().ok()?.into_result().ok()?;
        String::from_utf8(reply.payload().to_bytes().into_owned()).ok()
    }
}
