//! States and events of fleets, over the public wire: `examples/listener.py`, as its users run it.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{superconflict, two_chains};
use crate::vehicles::listens;
use crate::without_server::{recorder, ring};
use serde_json::Value;
use sidestep::kernel::view::FrameOptions;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, FlightRecorderJob, Job, LinkMessage, NodeJob, Topology,
};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
use sidestep_testing::{JsonProcess, has_modules, python, root};
use std::process::Command;
use std::time::Duration;

/// What a listener imports.
const MODULES: &str = "rosbags.typesys, zenoh";

/// Time longer than anything here takes.
const TEST_TIMEOUT: Duration = Duration::from_secs(300);

/// Robots close enough for contacts.
const ROBOTS: &str = "format = 1\nworld = \"robots\"\nname = \"floor\"\nseed = 6\ncycles = 60\n[map]\nascii = \"\"\"\n\
    ......\n..##..\n......\n\"\"\"\n\
    [[robots]]\ncount = 3\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

/// What a listener has printed.
#[derive(Debug, Default)]
struct Heard {
    states: Vec<Value>,
    events: Vec<Value>,
}

/// A listener that has subscribed.
struct Listener {
    process: JsonProcess<Value>,
    description: Value,
}

impl Listener {
    fn start(endpoint: &str) -> Self {
        let mut command = Command::new(python());
        command.arg(root().join("examples/listener.py")).args(["--connect", endpoint]);
        let process = JsonProcess::start(command);
        let description: Value = process.next("the description", TEST_TIMEOUT);
        Self { process, description }
    }

    /// Listens until the fleet is over.
    fn listen(mut self) -> Heard {
        let mut heard = Heard::default();
        loop {
            let line: Value = self.process.next("a line", TEST_TIMEOUT);
            assert!(line.get("lost").is_none(), "{line}");
            if line.get("event").is_some() {
                heard.events.push(line);
                continue;
            }
            let is_over = line["is_over"] == true;
            heard.states.push(line);
            if is_over {
                assert!(self.process.child.wait().expect("a process of this test").success());
                return heard;
            }
        }
    }
}

/// Returns the endpoint at which a program publishes.
fn publishes(program: &LinkProcess) -> String {
    program.until("it publishes", |message| match message {
        LinkMessage::Publishes(endpoint) => Some(endpoint),
        LinkMessage::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    })
}

/// Checks the numbers of all events: each is there once, and in its place.
fn check_numbers(heard: &Heard) {
    let numbers: Vec<u64> =
        heard.events.iter().map(|event| event["event"].as_u64().expect("a number")).collect();
    assert_eq!(numbers, (0..numbers.len() as u64).collect::<Vec<u64>>());
}

/// Checks what was heard of a fleet from its first cycle on by what one process computes; returns the number of events.
fn check_by_one_process(text: &str, heard: &Heard) -> usize {
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    let paths = OutputPaths::default();
    let mut run =
        ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths).expect("started");
    run.simulation_mut().enable_events();
    let mut states = heard.states.iter();
    let mut events = heard.events.iter();
    let mut event_count = 0;
    let mut agent_count = 0;
    loop {
        let frame = run.simulation_mut().frame(FrameOptions::WITHOUT_SCANS);
        for event in &frame.log {
            let told = events.next().expect("an event");
            assert_eq!(told["cycle"], event.cycle, "{told}");
            assert_eq!(told["kind"], event.kind.name(), "{told}");
            assert_eq!(told["body"], event.name(), "{told}");
            assert_eq!(told["text"], event.words, "{told}");
            event_count += 1;
        }
        // The state before the first cycle, and the last one, may come twice.
        let told = states.find(|told| told["cycle"] == frame.cycle).expect("each state has come");
        let places = told["at_m"].as_object().expect("bodies");
        for body in frame.bodies.iter().filter(|body| body.kind.is_agent()) {
            let place = &places[&body.name()];
            for axis in 0..3 {
                let x_m = place[axis].as_f64().expect("a coordinate");
                assert!((x_m - body.pose.at_m[axis]).abs() < 0.006, "{} {place}", body.name());
            }
            agent_count += 1;
        }
        if run.simulation().is_over() || frame.cycle >= run.simulation().config().cycles {
            break;
        }
        run.advance_to(frame.cycle + 1, &NoWatcher).expect("advanced");
    }
    assert_eq!(events.next(), None);
    assert!(agent_count > 0);
    event_count
}

/// Runs a fleet in lockstep whose last agent joins once a listener is there; returns what that has heard.
fn listen_to_lockstep(text: &str, last: AgentName, agents: usize) -> (Value, Heard) {
    let folder = folder(text);
    let job = FleetJob {
        nodes: Some(agents - 1),
        publish: Some("tcp/127.0.0.1:0".into()),
        ..job(folder.path(), Topology::Star, ClockMode::Lockstep)
    };
    let fleet = LinkProcess::start(&Job::Fleet(job.clone()));
    let server = listens(&fleet);
    let listener = Listener::start(&publishes(&fleet));
    let node = LinkProcess::start(&Job::Node(NodeJob {
        common: job.common.clone(),
        agent: last,
        connect: vec![server],
        listen: Vec::new(),
        patience_s: 60.0,
    }));
    fleet.complete();
    let description = listener.description.clone();
    let heard = listener.listen();
    assert_eq!(fleet.end(), (Some(0), None));
    assert_eq!(node.end(), (Some(0), None));
    (description, heard)
}

#[test]
fn a_listener_in_python_hears_every_state_and_event_of_fleets_of_all_worlds() {
    if !has_modules(MODULES) {
        return;
    }
    let ring = superconflict(3, "team", 60, "");
    let chains = two_chains(3, 60, "");
    let fleets = [
        (ROBOTS.to_string(), AgentName::new("robot", 2, None), 3, ("robots", "robot")),
        (ring, AgentName::new("airplane", 2, None), 3, ("airspace", "airplane")),
        (chains, AgentName::new("connector", 1, Some(2)), 6, ("chain", "connector")),
    ];
    let mut events = Vec::new();
    for (text, last, agents, (world, noun)) in fleets {
        let (description, heard) = listen_to_lockstep(&text, last, agents);
        assert_eq!(description["world"], world);
        assert_eq!(description["clock"], "lockstep");
        assert_eq!(description["agent"], noun);
        check_numbers(&heard);
        events.push(check_by_one_process(&text, &heard));
    }
    assert!(events[0] > 0 && events[1] > 0, "without events this would show little: {events:?}");
}

#[test]
fn a_listener_that_comes_late_to_a_flight_without_a_server_asks_for_the_events_before() {
    if !has_modules(MODULES) {
        return;
    }
    let folder = folder(&ring(3, 30, ""));
    let job =
        FlightRecorderJob { publish: Some("tcp/127.0.0.1:0".into()), ..recorder(folder.path()) };
    let program = LinkProcess::start(&Job::FlightRecorder(Box::new(job)));
    let endpoint = publishes(&program);
    program.fleet("some cycles", |now| now.cycle >= 8);
    let listener = Listener::start(&endpoint);
    let (summary, _) = program.complete();
    assert_eq!(listener.description["clock"], "realtime");
    let heard = listener.listen();
    check_numbers(&heard);
    let first = heard.states[0]["cycle"].as_u64().expect("a number");
    assert!((8..30).contains(&first), "{first}");
    let last = &heard.states[heard.states.len() - 1];
    assert_eq!(last["cycle"], summary["cycles"]);
    // What was recorded is what was heard of.
    let recorded = sidestep_record::row_count(&folder.path().join("run"), "events");
    assert_eq!(recorded.expect("a table"), heard.events.len() as u64);
}

#[test]
fn an_endpoint_for_listeners_that_others_reach_needs_insecure() {
    let folder = folder(&superconflict(3, "team", 5, ""));
    let open = FleetJob {
        publish: Some("tcp/0.0.0.0:7700".into()),
        ..job(folder.path(), Topology::Star, ClockMode::Lockstep)
    };
    let said = crate::input::refused(&Job::Fleet(open.clone()));
    assert!(said.contains("--insecure"), "{said}");
    let wrong = FleetJob { publish: Some("127.0.0.1:7700".into()), ..open };
    let said = crate::input::refused(&Job::Fleet(wrong));
    assert!(said.contains("the protocol is missing"), "{said}");
}
