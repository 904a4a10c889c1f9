//! The endpoint of a stream: `sidestep/v1/fleet/state` and `events` are published, and answer queries as
//! `sidestep/v1/fleet/description` does.

use super::event_log::EventLog;
use super::messages::{FleetDescription, FleetState};
use crate::hosted_run::FrameObserver;
use crate::vehicle::WIRE_VERSION;
use crate::wire::endpoint::{WireSetupError, reserve_port};
use crate::wire::zenoh::open_vehicle_session;
use sidestep::import::bag::cdr;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::Frame;
use sidestep::worlds::WORLDS;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, spawn};
use zenoh::qos::CongestionControl;
use zenoh::query::Queryable;
use zenoh::{Session, Wait};

/// Most cycles that wait to be sent. A listener that has stopped holds each of them up for some milliseconds; those that find
/// no room are not sent, and can be asked for.
const MAX_WAITING: usize = 16;

/// What the run itself does not say of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StreamSource {
    /// Seconds of the scenario in a second of real time; none in lockstep.
    pub(crate) speed: Option<f64>,
    /// Whether agents have a server.
    pub(crate) has_server: bool,
}

/// What queries are answered from.
#[derive(Debug, Default)]
struct Newest {
    state: Vec<u8>,
    events: EventLog,
}

fn lock(newest: &Mutex<Newest>) -> MutexGuard<'_, Newest> {
    newest.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is published of a cycle.
struct Publication {
    state: Vec<u8>,
    /// None in a cycle without events.
    events: Option<Vec<u8>>,
}

/// The stream of a fleet, which is published until it is dropped.
pub(crate) struct FleetStream {
    /// The endpoint, with its port.
    endpoint: String,
    newest: Arc<Mutex<Newest>>,
    /// The last state, to be published again as the last one of all.
    last: Option<FleetState>,
    /// None after the end.
    sender: Option<SyncSender<Publication>>,
    thread: Option<JoinHandle<()>>,
    /// Cycles that were not sent, because those before wait.
    unsent: u64,
    _queryables: Vec<Queryable<()>>,
    session: Session,
}

impl FleetStream {
    /// Publishes a run at an endpoint from now on; port 0 stands for any free one.
    ///
    /// # Errors
    /// When the endpoint cannot be bound.
    pub(crate) fn start(
        endpoint: &str,
        run: &dyn Simulation,
        source: StreamSource,
    ) -> Result<Self, WireSetupError> {
        let reserved = reserve_port(endpoint)?;
        let endpoint = reserved.endpoint.clone();
        // Zenoh binds the port itself.
        drop(reserved);
        let session = open_vehicle_session(&endpoint)?;
        let failed = |error: zenoh::Error| WireSetupError::NoEndpoint {
            endpoint: endpoint.clone(),
            reason: error.to_string(),
        };
        let newest = Arc::new(Mutex::new(Newest::default()));
        let description = cdr::encode(&describe(run, source));
        let states = newest.clone();
        let events = newest.clone();
        let queryables = [
            answer(&session, "description", move |_| description.clone()),
            answer(&session, "state", move |_| lock(&states).state.clone()),
            answer(&session, "events", move |from| cdr::encode(&lock(&events).events.read(from))),
        ];
        let queryables: Result<Vec<_>, _> = queryables.into_iter().collect();
        let queryables = queryables.map_err(failed)?;
        let (sender, publications) = sync_channel(MAX_WAITING);
        let thread = spawn_sender(&session, publications).map_err(failed)?;
        Ok(Self {
            endpoint,
            newest,
            last: None,
            sender: Some(sender),
            thread: Some(thread),
            unsent: 0,
            _queryables: queryables,
            session,
        })
    }

    /// Returns the endpoint, with its port.
    pub(crate) fn endpoint(&self) -> &str {
        &self.endpoint
    }
}

impl FrameObserver for FleetStream {
    fn on_frame(&mut self, frame: &Frame) {
        let publication = {
            let mut newest = lock(&self.newest);
            let events = newest.events.push(&frame.log, frame.log_left_out);
            let state = FleetState::new(frame, events.next);
            newest.state = cdr::encode(&state);
            self.last = Some(state);
            let has_events = !events.events.is_empty();
            Publication {
                state: newest.state.clone(),
                events: has_events.then(|| cdr::encode(&events)),
            }
        };
        if let Some(sender) = &self.sender
            && sender.try_send(publication).is_err()
        {
            self.unsent += 1;
        }
    }

    fn on_end(&mut self) {
        let Some(sender) = self.sender.take() else { return };
        if let Some(state) = self.last.take() {
            let state = cdr::encode(&FleetState { is_over: true, ..state });
            lock(&self.newest).state.clone_from(&state);
            // All wait for this one: it tells listeners that there is no other. The thread ends by itself, if it ever did.
            let _ = sender.send(Publication { state, events: None });
        }
        drop(sender);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        if self.unsent > 0 {
            let cycles = self.unsent;
            tracing::warn!(cycles, "listeners were slow: some states were not sent to them");
        }
        // What is still to be sent goes before the end of each link.
        let _ = self.session.close().wait();
    }
}

/// Returns a key of the stream.
fn key(part: &str) -> String {
    format!("sidestep/v{WIRE_VERSION}/fleet/{part}")
}

/// Answers queries by a key; a query may have a number, as in `events?from=12`.
fn answer(
    session: &Session,
    part: &str,
    bytes: impl Fn(u64) -> Vec<u8> + Send + Sync + 'static,
) -> zenoh::Result<Queryable<()>> {
    let own_key = key(part);
    session
        .declare_queryable(own_key.clone())
        .callback(move |query| {
            let from = query.parameters().get("from").and_then(|number| number.parse().ok());
            // Who has asked may be gone.
            let _ = query.reply(own_key.clone(), bytes(from.unwrap_or(0))).wait();
        })
        .wait()
}

/// Starts the thread that publishes. Sending waits a little for a link that is full, and drops then: a run does not wait.
fn spawn_sender(
    session: &Session,
    publications: Receiver<Publication>,
) -> zenoh::Result<JoinHandle<()>> {
    let publisher = |part: &str| {
        let publisher = session.declare_publisher(key(part));
        publisher.congestion_control(CongestionControl::Drop).wait()
    };
    let states = publisher("state")?;
    let events = publisher("events")?;
    Ok(spawn(move || {
        for Publication { state, events: happened } in publications {
            // Events before the state that shows what they have led to. A link that is down loses both.
            if let Some(happened) = happened {
                let _ = events.put(happened).wait();
            }
            let _ = states.put(state).wait();
        }
    }))
}

/// Returns the description of a run.
fn describe(run: &dyn Simulation, source: StreamSource) -> FleetDescription {
    let config = run.config();
    let clock = if source.speed.is_some() { "realtime" } else { "lockstep" };
    let description = FleetDescription {
        build: WORLDS.build().into(),
        world: run.world_name().into(),
        seed: config.seed,
        cycles: config.cycles,
        clock: clock.into(),
        speed: source.speed.unwrap_or(0.0),
        has_server: source.has_server,
        agent: run.agent_noun().into(),
        ..FleetDescription::default()
    };
    description.with_scenery(&run.scenery())
}

#[cfg(test)]
mod tests {
    use super::super::messages::FleetEvents;
    use super::*;
    use crate::wire::zenoh::open_ros2_session;
    use serde_json::Value;
    use sidestep::kernel::view::{BodyId, FrameOptions, LogEvent, LogEventKind, Severity};
    use sidestep::scenario::Source;
    use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
    use sidestep_testing::{JsonProcess, has_modules, python, root, try_signal};
    use std::process::Command;
    use std::sync::mpsc::RecvTimeoutError;
    use std::time::Duration;

    const FLOOR: &str = "format = 1\nworld = \"robots\"\nname = \"floor\"\nseed = 6\ncycles = 5\n[map]\nascii = \"\"\"\n\
        ....\n....\n\"\"\"\n[[robots]]\ncount = 2\n";

    /// Time longer than anything here takes.
    const TEST_TIMEOUT: Duration = Duration::from_secs(60);

    /// Returns a stream, and its first frame.
    fn stream() -> (FleetStream, Frame) {
        let source = Source::new("s.toml", FLOOR, "");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        let paths = OutputPaths::default();
        let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths);
        let mut run = run.expect("started");
        let source = StreamSource { speed: Some(2.0), has_server: true };
        let stream = FleetStream::start("tcp/127.0.0.1:0", run.simulation(), source);
        let frame = run.simulation_mut().frame(FrameOptions::WITHOUT_SCANS);
        let _ = run.finish(&NoWatcher);
        (stream.expect("a free port"), frame)
    }

    /// Returns the session of a listener.
    fn listener(stream: &FleetStream) -> Session {
        let endpoint = [stream.endpoint().to_string()];
        open_ros2_session(&[], &endpoint, TEST_TIMEOUT).expect("it answers")
    }

    fn query<M: cdr::Cdr>(session: &Session, what: &str) -> M {
        let replies = session.get(key(what)).timeout(TEST_TIMEOUT).wait().expect("it can be asked");
        let reply = replies.recv().expect("an answer").into_result().expect("no error");
        cdr::decode(&reply.payload().to_bytes()).expect("a message")
    }

    /// Returns a frame of many bodies, with one event.
    fn large(frame: &Frame, cycle: u64) -> Frame {
        let event = LogEvent {
            cycle,
            level: Severity::Info,
            kind: LogEventKind::Arrival,
            who: BodyId::new(frame.bodies[0].kind, 0, None),
            with: None,
            at_m: None,
            value: None,
            words: "it is there".into(),
        };
        let bodies = frame.bodies.iter().cycle().take(2_000).cloned().collect();
        Frame { cycle, bodies, log: vec![event], ..frame.clone() }
    }

    #[test]
    fn who_asks_is_told_what_is_flown_and_the_newest_state() {
        let (mut stream, frame) = stream();
        let listener = listener(&stream);
        let description: FleetDescription = query(&listener, "description");
        assert_eq!((&*description.world, &*description.scenario), ("robots", "floor"));
        assert_eq!((&*description.clock, description.speed), ("realtime", 2.0));
        assert_eq!((description.seed, description.cycles, description.cycle_s), (6, 5, 1.0));
        for cycle in 0..3 {
            stream.on_frame(&Frame { cycle, ..frame.clone() });
        }
        let state: FleetState = query(&listener, "state");
        assert_eq!((state.cycle, state.next_event, state.is_over), (2, 0, false));
        let names: Vec<&str> = state.bodies.iter().map(|body| &*body.name).collect();
        assert_eq!(names, ["robot/0", "robot/1"]);
        let events: FleetEvents = query(&listener, "events?from=0");
        assert_eq!((events.oldest, events.next, events.events.len()), (0, 0, 0));
        stream.on_end();
    }

    #[test]
    fn a_listener_that_has_stopped_holds_nothing_up_and_nobody_misses_an_event() {
        if !has_modules("rosbags.typesys, zenoh") {
            return;
        }
        // More than the buffers of a link hold: of each state 200 kB.
        const CYCLES: u64 = 200;
        let (mut stream, frame) = stream();
        stream.on_frame(&frame);
        let mut command = Command::new(python());
        command.arg(root().join("examples/listener.py")).args(["--connect", stream.endpoint()]);
        let stopped: JsonProcess<Value> = JsonProcess::start(command);
        stopped.next("it has subscribed", TEST_TIMEOUT);
        assert!(try_signal(stopped.child.id(), "STOP"));
        for cycle in 1..=CYCLES {
            stream.on_frame(&large(&frame, cycle));
        }
        let other = listener(&stream);
        let events: FleetEvents = query(&other, "events?from=0");
        let numbers: Vec<u64> = events.events.iter().map(|event| event.number).collect();
        assert_eq!(numbers, (0..CYCLES).collect::<Vec<u64>>());
        let state: FleetState = query(&other, "state");
        assert_eq!((state.cycle, state.next_event), (CYCLES, CYCLES));
        assert!(try_signal(stopped.child.id(), "CONT"));
        // The next event comes when its link has room again: then it asks for all that it has missed.
        let mut cycle = CYCLES;
        let mut numbers = Vec::new();
        let mut states = 0;
        while numbers.last().is_none_or(|number| *number < CYCLES) {
            match stopped.lines.recv_timeout(Duration::from_millis(50)) {
                Ok(line) if line.get("event").is_some() => numbers.extend(line["event"].as_u64()),
                Ok(_) => states += 1,
                Err(RecvTimeoutError::Timeout) => {
                    cycle += 1;
                    assert!(cycle < 10 * CYCLES, "it hears nothing any more");
                    stream.on_frame(&Frame { bodies: Vec::new(), ..large(&frame, cycle) });
                }
                Err(RecvTimeoutError::Disconnected) => panic!("it has ended"),
            }
        }
        assert!(numbers.iter().copied().eq(0..numbers.len() as u64), "{numbers:?}");
        assert!(states < CYCLES, "nothing was in its way: {states}");
        stream.on_end();
    }
}
