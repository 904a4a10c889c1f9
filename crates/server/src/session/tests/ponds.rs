//! A world that neither server nor page knows: its scene, frames, edits and tools come all the same.

use super::*;
use crate::fleet_feed::FleetFeed;
use crate::protocol::ReplyBody;
use sidestep_kernel::view::FrameOptions;
use sidestep_scenario::{WorldType, Worlds};
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus, NodeStatus};
use sidestep_testing_pond::Pond;

const AT: &str = "tcp/127.0.0.1:7600";

fn worlds() -> Worlds {
    WORLDS.clone().with(Pond)
}

/// Opens the default scenario of the world.
fn open() -> (Page, Value) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pond.toml");
    std::fs::write(&path, Pond.default_scenario()).expect("written");
    let target = OpenTarget::Scenario { path: path.display().to_string() };
    let deps = SessionDeps { worlds: worlds(), ..deps(folder.path(), 2) };
    Page::open_target(deps, target, folder)
}

#[test]
fn its_scene_and_its_frames_come() {
    let (mut page, opened) = open();
    let scene = &opened["answer"]["scene"];
    assert_eq!((&scene["world"], &scene["agent"]), (&"pond".into(), &"frog".into()));
    page.ask(json!({ "do": "credit", "frames": 10 }));
    page.until("a frame", |page| (!page.frames.is_empty()).then_some(()));
    let bodies = page.notices.iter().find(|notice| notice["notice"] == "bodies");
    let numbers = bodies.expect("the table of bodies")["number"].as_array().map(Vec::len);
    assert_eq!(numbers, Some(12));
    let source = Source::new("pond.toml", Pond.default_scenario(), "");
    let mut plain = worlds().compile(&source).expect("valid").start(&source, 1);
    plain.advance(50);
    assert_eq!(page.digest_at(50), plain.digest().to_string());
}

#[test]
fn its_tools_edit_its_text() {
    let Ok(ReplyBody::Schema { editing, .. }) = crate::socket::schema_reply(&worlds(), "pond")
    else {
        panic!("a schema");
    };
    let tool = json!(editing.tools[1]);
    assert_eq!(tool["action"], json!({ "do": "add-point", "section": "reeds" }));
    // The edit that the page makes of it.
    let folder = tempfile::tempdir().expect("a folder");
    let deps = SessionDeps { worlds: worlds(), ..deps(folder.path(), 2) };
    let insert =
        json!({ "op": "insert", "key": "reeds", "at": null, "value": { "at_m": [7.5, 5.5] } });
    let edit = serde_json::from_value(insert).expect("an edit");
    let source = Source::new("pond.toml", Pond.default_scenario(), folder.path());
    let edited = apply_edits(&deps, &source, source.text.clone(), vec![edit]);
    let Ok(ReplyBody::Edited { text }) = edited else {
        panic!("an edited text: {edited:?}");
    };
    let source = Source::new("pond.toml", &text, "");
    let run = worlds().compile(&source).expect("valid").start(&source, 1);
    assert_eq!(run.scenery().bodies.len(), 1);
}

#[test]
fn its_fleet_is_watched() {
    let source = Source::new("pond.toml", Pond.default_scenario(), "");
    let mut run = worlds().compile(&source).expect("valid").start(&source, 1);
    let scene = FleetScene {
        build: "b".into(),
        world: run.world_name().into(),
        agent: run.agent_noun().into(),
        seed: 1,
        scenery: run.scenery(),
    };
    let feed = Arc::new(FleetFeed::new(AT.into(), scene));
    run.advance(9);
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let node = |agent| NodeStatus { agent, number: agent, ..NodeStatus::default() };
    let fleet = FleetStatus {
        cycle: 9,
        noun: run.agent_noun().into(),
        nodes: (0..12).map(node).collect(),
        ..FleetStatus::default()
    };
    feed.replace_view(FleetFrame { number: 1, frame, fleet, is_over: false });
    let folder = tempfile::tempdir().expect("a folder");
    let deps = SessionDeps { fleets: vec![feed], ..deps(folder.path(), 1) };
    let (mut page, opened) = Page::open_target(deps, OpenTarget::Fleet { path: AT.into() }, folder);
    assert_eq!(opened["answer"]["scene"]["agent"], "frog");
    let status = page.until("a status", |page| {
        let is_it = |notice: &&Value| notice["notice"] == "status" && notice["cycle"] == 9.0;
        page.notices.iter().rfind(is_it).cloned()
    });
    assert_eq!(status["fleet"]["nodes"].as_array().map(Vec::len), Some(12));
}
