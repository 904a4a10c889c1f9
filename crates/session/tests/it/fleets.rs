//! The language between the command and `sidestep-link`, with agents of a world that neither knows.

use crate::support::TestFolder;
use sidestep_kernel::view::{BodyKind, FrameOptions, Kinds};
use sidestep_session::OutputPaths;
use sidestep_session::fleet::{
    AgentName, CommonSettings, FleetFrame, FleetScene, FleetStatus, Job, JobScenario, LinkMessage,
    NodeJob, NodeStatus,
};
use sidestep_testing_pond::kinds::FROG;

/// Returns a value as the other end of a pipe reads it: as a line of JSON.
fn sent<T: serde::Serialize + serde::de::DeserializeOwned>(value: &T) -> T {
    let line = serde_json::to_string(value).expect("JSON");
    assert!(!line.contains('\n'));
    let kinds = Kinds::new([FROG, BodyKind::OBSTACLE]);
    kinds.resolve_names_during(|| serde_json::from_str(&line)).expect("the same type")
}

#[test]
fn a_node_is_asked_for_by_the_noun_of_its_world() {
    let frog = AgentName::new("frog", 3, None);
    assert_eq!((frog.to_string(), frog.option()), ("3".into(), "--frog 3".into()));
    let leg = AgentName::new("leg", 3, Some(1));
    assert_eq!((leg.to_string(), leg.option()), ("3.1".into(), "--leg 3.1".into()));
    let scenario =
        JobScenario { file: "pond.toml".into(), overrides: Vec::new(), build: "b".into() };
    let common = CommonSettings {
        flown: scenario,
        tls: None,
        is_insecure: false,
        lease_s: 10.0,
        metrics: None,
        json_log: false,
        log: "info".into(),
    };
    let job = Job::Node(NodeJob {
        common,
        agent: frog,
        connect: vec!["tcp/127.0.0.1:9".into()],
        listen: Vec::new(),
        patience_s: 1.0,
    });
    assert_eq!(sent(&job), job);
}

#[test]
fn watchers_get_scene_and_frames_of_any_world() {
    let place = TestFolder::new();
    let mut run = place.start(1, OutputPaths::default()).expect("started");
    let simulation = run.simulation_mut();
    let scene = LinkMessage::Scene(Box::new(FleetScene {
        build: "b".into(),
        world: simulation.world_name().into(),
        agent: simulation.agent_noun().into(),
        seed: 1,
        scenery: simulation.scenery(),
    }));
    assert_eq!(sent(&scene), scene);
    simulation.advance(20);
    let frame = simulation.frame(FrameOptions::WITHOUT_SCANS);
    let nodes = frame.bodies.iter().map(|body| NodeStatus {
        agent: body.number,
        number: body.number,
        ..NodeStatus::default()
    });
    let fleet = FleetStatus {
        cycle: frame.cycle,
        noun: simulation.agent_noun().into(),
        nodes: nodes.collect(),
        ..FleetStatus::default()
    };
    assert_eq!(fleet.nodes.len(), 12);
    let seen = LinkMessage::Seen(Box::new(FleetFrame { number: 1, frame, fleet, is_over: false }));
    assert_eq!(sent(&seen), seen);
}
