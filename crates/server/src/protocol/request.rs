//! The requests of a page.

use super::{Edit, SessionId};
use serde::{Deserialize, Serialize};

/// A request. Its reply has the same number, which the page chooses from 1 on: 0 is that of the reply to a request
/// whose number cannot be read.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(untagged))]
pub enum ClientRequest {
    /// A request to the server itself.
    Server {
        /// The number of the request.
        id: u32,
        /// The method and its arguments.
        call: ServerMethod,
    },
    /// A request to a session of the page.
    Session {
        /// The number of the request.
        id: u32,
        /// The session.
        session: SessionId,
        /// The method and its arguments.
        call: SessionMethod,
    },
}

/// A query or a command for the server itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ServerMethod {
    /// Lists a folder below those given at start; without one, those given at start.
    Files {
        /// Its path, as a listing gave it.
        folder: Option<String>,
    },
    /// Lists everything below the folders given at start whose path or description contains a text.
    Find {
        /// The text; all things contain an empty one.
        text: String,
    },
    /// Asks what a file or a folder is that a person wants to open.
    Identify {
        /// Its path, as a listing or the answer to a dropped file gave it.
        path: String,
    },
    /// Lists the scenarios that the program carries.
    Gallery {},
    /// Asks for the memory that the server uses.
    Usage {},
    /// Reads a file and says what becomes of it, as `sidestep inspect` does.
    ImportReport {
        /// Its path, as a listing gave it.
        path: String,
    },
    /// Opens a scenario or a recording: a new session, which is paused at its start and belongs to the socket.
    Open {
        /// What to open.
        target: OpenTarget,
        /// Another seed than the scenario's.
        seed: Option<u64>,
    },
    /// Asks for the runs of a sweep.
    Runs {
        /// Its folder, as a listing gave it.
        folder: String,
    },
    /// Asks for the JSON Schema of a world's scenarios.
    Schema {
        /// The world's name.
        world: String,
    },
}

impl ServerMethod {
    /// The names of all methods.
    pub const NAMES: [&str; 9] = [
        "files",
        "find",
        "identify",
        "gallery",
        "usage",
        "import-report",
        "open",
        "runs",
        "schema",
    ];
}

/// A query or a command for a session.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SessionMethod {
    /// Ends a session.
    Close {},
    /// Asks for the problems of a text that stands for the session's scenario.
    Check {
        /// The text.
        text: String,
    },
    /// Changes a text that stands for the session's scenario: all edits, one after the other, or none. The server
    /// keeps nothing of it.
    Edit {
        /// The text.
        text: String,
        /// The changes.
        edits: Vec<Edit>,
    },
    /// Asks for the values in a text that stands for the session's scenario.
    Model {
        /// The text.
        text: String,
    },
    /// A method of the run, which the session's thread answers. The methods above are answered by other threads, so that
    /// none waits for a cycle that the run is computing.
    // An untagged variant would be read by trial, and a mistake in it reported as "data did not match any variant".
    #[serde(skip_deserializing)]
    #[cfg_attr(test, ts(untagged))]
    Run(RunMethod),
}

impl SessionMethod {
    /// The names of the methods that are not the run's.
    pub const NAMES: [&str; 4] = ["close", "check", "edit", "model"];
}

/// A query or a command for the run of a session.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RunMethod {
    /// Plays a session.
    Play {
        /// The speed.
        speed: Speed,
    },
    /// Pauses a session.
    Pause {},
    /// Advances by some cycles and stays paused; answered on arrival. During a seek or a step it counts from the end of
    /// that one, whose request is then answered at once.
    Step {
        /// Number of cycles.
        cycles: u32,
    },
    /// Seeks to a cycle, earlier or later, and stays paused; answered on arrival. A problem means that another request
    /// has changed the destination meanwhile.
    Seek {
        /// The cycle; a run that is over before it stays at its end.
        cycle: u64,
    },
    /// Restarts the run, with another seed and another text where given. Answered by
    /// [`Opened`](super::ReplyBody::Opened), with the session's own number; the run before stays if the text is wrong.
    Restart {
        /// Another seed.
        seed: Option<u64>,
        /// Another text for the scenario, which is not saved.
        text: Option<String>,
    },
    /// Selects the bodies whose scans the frames contain.
    SelectScans {
        /// The bodies.
        bodies: Vec<BodyId>,
    },
    /// Grants the server further frames; it sends none without credit.
    Credit {
        /// Number of frames.
        frames: u32,
    },
    /// Asks for the percepts, decisions and actions of a body.
    Inspect {
        /// The body.
        body: BodyId,
    },
    /// Asks for the rows of all metrics, from the row with this number on, and for those of the present cycle.
    Metrics {
        /// The number of the first row wanted.
        from: u32,
    },
    /// Asks for the metrics of each agent at the present cycle: without a name for their names, with one for its values.
    /// They are computed for this request alone.
    AgentMetrics {
        /// The name of a metric.
        metric: Option<String>,
    },
    /// Searches all events so far, the oldest first: at most `limit`, after the first `skip` ones.
    FindEvents {
        /// Words that all occur in the sentence, the kind or the names of the bodies of an event, whatever their case.
        text: String,
        /// The kinds of the events wanted; all without it.
        kinds: Option<Vec<String>>,
        /// The number of first events to leave out.
        skip: u32,
        /// The largest number of events.
        limit: u32,
    },
    /// Asks for the events so far between two cycles (`from` included, `until` excluded), at most `limit`, after the
    /// first `skip` ones.
    Events {
        /// The first cycle.
        from: u64,
        /// The cycle after the last one.
        until: u64,
        /// The number of first events to leave out; 0 without it.
        skip: Option<u32>,
        /// The largest number of events.
        limit: u32,
    },
    /// Asks for the trails of bodies up to a cycle, as far as the cycles before it have been computed.
    Trails {
        /// The cycle at which they end.
        until: u64,
        /// The bodies; none for all agents.
        bodies: Vec<BodyId>,
    },
    /// Asks for the scenario's text.
    Source {},
    /// Asks for the names of the tables of a recording, which can be exported.
    Tables {},
    /// Writes a text into a file, which is the session's place from then on.
    Save {
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
}

impl RunMethod {
    /// The names of all methods.
    pub const NAMES: [&str; 16] = [
        "play",
        "pause",
        "step",
        "seek",
        "restart",
        "select-scans",
        "credit",
        "inspect",
        "metrics",
        "agent-metrics",
        "find-events",
        "events",
        "trails",
        "source",
        "tables",
        "save",
    ];
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
    /// A scenario that the program carries.
    Shipped {
        /// Its name, as the gallery gave it.
        name: String,
    },
    /// A run folder or an MCAP file of Sidestep.
    Recording {
        /// Its path, as a listing gave it.
        path: String,
    },
    /// A fleet that runs in other processes: it is watched, not controlled.
    Fleet {
        /// The endpoint, as given on the command line.
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
