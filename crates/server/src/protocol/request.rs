//! The requests of a page.

use super::{Edit, SessionId};
use serde::{Deserialize, Serialize};

/// A request; its reply has the same number.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct ClientRequest {
    /// Chosen by the page, from 1 on: a request that cannot be read is answered with number 0.
    pub id: u32,
    /// What is asked.
    pub call: Method,
}

/// A query or a command of a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Method {
    /// Lists a folder below those named at start (all of those if none is given).
    Files {
        /// Its path, as a listing gave it.
        folder: Option<String>,
    },
    /// Opens a scenario or a recording: a new session, which is paused at its start and belongs to the socket.
    Open {
        /// What to open.
        target: OpenTarget,
        /// Another seed than the scenario's.
        seed: Option<u64>,
    },
    /// Ends a session.
    Close {
        /// The session.
        session: SessionId,
    },
    /// Plays a session.
    Play {
        /// The session.
        session: SessionId,
        /// The speed.
        speed: Speed,
    },
    /// Pauses a session.
    Pause {
        /// The session.
        session: SessionId,
    },
    /// Advances by some cycles and stays paused; answered there. While a seek or a step is under way, counted from its
    /// end; the request for that one is then answered at once.
    Step {
        /// The session.
        session: SessionId,
        /// Number of cycles.
        cycles: u32,
    },
    /// Goes to a cycle, earlier or later, and stays paused; answered there. A problem means that another request has
    /// changed the destination meanwhile.
    Seek {
        /// The session.
        session: SessionId,
        /// The cycle; a run that is over before it stays at its end.
        cycle: u64,
    },
    /// Starts anew, with another seed and another text where given. Answered by
    /// [`Opened`](super::ReplyBody::Opened), with the session's own number; the run before stays if the text is wrong.
    Restart {
        /// The session.
        session: SessionId,
        /// Another seed.
        seed: Option<u64>,
        /// Another text for the scenario, which is not saved.
        text: Option<String>,
    },
    /// Selects the bodies whose scans the frames contain.
    SelectScans {
        /// The session.
        session: SessionId,
        /// The bodies.
        bodies: Vec<BodyId>,
    },
    /// Grants the server further frames; it sends none without credit.
    Credit {
        /// The session.
        session: SessionId,
        /// Number of frames.
        frames: u32,
    },
    /// Asks for the percepts, decisions and actions of a body.
    Inspect {
        /// The session.
        session: SessionId,
        /// The body.
        body: BodyId,
    },
    /// Asks for samples of all metrics, from the sample with this number on.
    Metrics {
        /// The session.
        session: SessionId,
        /// The number of the first sample wanted.
        from: u32,
    },
    /// Asks for the events so far between two cycles (`from` included, `until` excluded), at most `limit`, after the
    /// first `skip` ones.
    Events {
        /// The session.
        session: SessionId,
        /// The first cycle.
        from: u64,
        /// The cycle after the last one.
        until: u64,
        /// The number of first events to leave out; 0 without it.
        skip: Option<u32>,
        /// The largest number of events.
        limit: u32,
    },
    /// Asks for the scenario's text.
    Source {
        /// The session.
        session: SessionId,
    },
    /// Asks for the names of the tables of a recording, which can be exported.
    Tables {
        /// The session.
        session: SessionId,
    },
    /// Asks for the runs of a sweep.
    Runs {
        /// Its folder, as a listing gave it.
        folder: String,
    },
    /// Asks for the problems of a text that stands for the session's scenario.
    Check {
        /// The session.
        session: SessionId,
        /// The text.
        text: String,
    },
    /// Changes a text that stands for the session's scenario: all edits, one after the other, or none. The server
    /// keeps nothing of it.
    Edit {
        /// The session.
        session: SessionId,
        /// The text.
        text: String,
        /// The changes.
        edits: Vec<Edit>,
    },
    /// Asks for the values in a text that stands for the session's scenario.
    Model {
        /// The session.
        session: SessionId,
        /// The text.
        text: String,
    },
    /// Writes a text into a file, which is the session's place from then on.
    Save {
        /// The session.
        session: SessionId,
        /// The text.
        text: String,
        /// The path of the file; the session's own without it.
        to: Option<String>,
        /// The text that the file holds as far as the page knows; without it the one that this session has read or
        /// written, which another program may have changed before a page was connected again.
        base: Option<String>,
        /// Whether a file is replaced even if it holds something else.
        overwrite: bool,
    },
    /// Asks for the JSON Schema of a world's scenarios.
    Schema {
        /// The world's name.
        world: String,
    },
}

/// A thing that can be opened.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum OpenTarget {
    /// A scenario file, or a foreign file that stands for one.
    Scenario {
        /// Its path, as a listing gave it.
        path: String,
    },
    /// The scenario that `sidestep new WORLD` writes.
    New {
        /// The world's name.
        world: String,
    },
    /// A run folder or an MCAP file of Sidestep.
    Recording {
        /// Its path, as a listing gave it.
        path: String,
    },
    /// A fleet that flies elsewhere: it is watched, not controlled.
    Fleet {
        /// The endpoint that the command line named.
        path: String,
    },
}

/// The speed at which a run is played.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Speed {
    /// Simulated seconds per second, 0.1 to 100.
    Times(f64),
    /// The greatest speed that the machine allows.
    Fastest,
}

/// The identity of a body: kind, number, and, for things that have parts, the part.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct BodyId {
    /// Its kind, e.g. `robot`.
    pub kind: String,
    /// Its number among those of its kind.
    pub number: u32,
    /// Its part, where the thing has parts.
    pub part: Option<u32>,
}
