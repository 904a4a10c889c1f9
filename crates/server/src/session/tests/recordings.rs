//! Recordings: computed again by the build that made them, otherwise shown from their own tables.

use super::*;
use sidestep_kernel::view::{BodyId as Body, Frame, FrameOptions, Vec3};
use sidestep_record::{McapFooter, McapProvenance, McapRecorder, Provenance, Status};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths, RecordedRun};
use std::path::PathBuf;

/// Records a scenario into the folder `r`.
pub(super) fn recorded(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let (run, source) = (folder.path().join("r"), Source::new("s.toml", text, ""));
    let compiled = WORLDS.compile(&source).expect("valid");
    let keep = OutputPaths { folder: Some(&run), ..OutputPaths::default() };
    let journey = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, keep).expect("started");
    journey.run_to_end(&NoWatcher).expect("recorded");
    folder
}

fn path(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("r")
}

/// Turns a recording into one of another version of the program.
pub(super) fn made_by_another(folder: &tempfile::TempDir) {
    let manifest = path(folder).join("run.json");
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    let mut value: Value = serde_json::from_str(&text).expect("JSON");
    (value["program_version"], value["build"]) = ("0.0.9".into(), "0.0.9+abc".into());
    let text = sidestep_record::seal_again(&value.to_string());
    std::fs::write(manifest, text).expect("written");
}

pub(super) fn opened(folder: tempfile::TempDir) -> (Page, Value) {
    let what = OpenTarget::Recording { path: path(&folder).display().to_string() };
    Page::open_target(deps(folder.path(), 2), what, folder)
}

fn banner(status: &Value) -> String {
    status["banner"].as_str().expect("text").to_string()
}

/// Places of agents, in micrometers: rows of tables are as exact as their columns.
fn places(frame: &Frame) -> Vec<(Body, [i64; 3])> {
    let rounded = |at_m: Vec3| at_m.map(|m| (m * 1e6).round() as i64);
    let agents = frame.bodies.iter().filter(|body| body.kind.is_agent());
    let mut places: Vec<_> = agents.map(|body| (body.id(), rounded(body.pose.at_m))).collect();
    places.sort_unstable();
    places
}

#[test]
fn a_recording_of_another_build_shows_everybody_where_they_were() {
    for (text, cycles) in [(ROBOTS, 600), (CHAINS, 150), (AIRPLANES, 40)] {
        let folder = recorded(text);
        let open = || RecordedRun::open(&WORLDS, &path(&folder)).expect("a recording");
        let mut again = open().start(1).expect("of this build");
        made_by_another(&folder);
        assert!(open().start(1).is_err(), "it is not computed again");
        let mut shown = open().start_for_viewing(1).expect("its tables are there");
        let way = [0, cycles / 10, cycles / 5, cycles / 2];
        for cycle in way {
            again.advance(cycle - again.cycle());
            shown.advance(cycle - shown.cycle());
            let (one, other) = (
                again.frame(FrameOptions::WITHOUT_SCANS),
                shown.frame(FrameOptions::WITHOUT_SCANS),
            );
            assert!(!places(&one).is_empty());
            assert_eq!(places(&one), places(&other), "{} at {cycle}", again.world_name());
            assert_eq!(one.time_s, other.time_s);
        }
        let back = shown.checkpoint();
        shown.advance(u64::MAX);
        assert!(shown.is_over() && !shown.frame(FrameOptions::WITHOUT_SCANS).bodies.is_empty());
        shown.restore(&back).expect("its own");
        assert_eq!(
            places(&shown.frame(FrameOptions::WITHOUT_SCANS)),
            places(&again.frame(FrameOptions::WITHOUT_SCANS))
        );
    }
}

/// Records some cycles of a scenario to an MCAP file, as a build of another version would.
fn filmed_by_another(text: &str, cycles: u64, path: &std::path::Path) {
    let source = Source::new("s.toml", text, "");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    run.enable_events();
    let origin = McapProvenance {
        world: run.world_name().into(),
        build: "0.0.9+abc".into(),
        origin: Provenance {
            program_version: "0.0.9".into(),
            scenario: text.into(),
            seed: run.config().seed,
        },
        files: Vec::new(),
        cycles_planned: run.config().cycles,
        every: 1,
    };
    let mut recorder = McapRecorder::create(path, origin, &run.scenery()).expect("a file");
    for _ in 0..cycles {
        recorder.write_frame(&run.frame(FrameOptions::WITHOUT_SCANS)).expect("written");
        run.advance(1);
    }
    recorder.write_frame(&run.frame(FrameOptions::WITHOUT_SCANS)).expect("written");
    let digest = run.digest().to_string();
    let end = McapFooter { status: Status::Complete, cycles_done: cycles, digest };
    recorder.finish(&end).expect("finished");
}

#[test]
fn a_film_of_another_build_shows_everybody_where_they_were_and_says_so() {
    for (text, cycles) in [(ROBOTS, 200), (CHAINS, 60), (AIRPLANES, 20)] {
        let folder = tempfile::tempdir().expect("a folder");
        let film = path(&folder);
        filmed_by_another(text, cycles, &film);
        let source = Source::new("s.toml", text, "");
        let mut again = WORLDS.compile(&source).expect("valid").start(&source, 1);
        let recorded = RecordedRun::open(&WORLDS, &film).expect("a film");
        assert!(recorded.start(1).is_err(), "it is not computed again");
        let mut shown = recorded.start_for_viewing(1).expect("its messages are there");
        for cycle in [0, cycles / 5, cycles / 2, cycles] {
            again.advance(cycle - again.cycle());
            shown.advance(cycle - shown.cycle());
            let (one, other) = (
                again.frame(FrameOptions::WITHOUT_SCANS),
                shown.frame(FrameOptions::WITHOUT_SCANS),
            );
            assert!(!places(&one).is_empty());
            assert_eq!(places(&one), places(&other), "{} at {cycle}", again.world_name());
            assert_eq!(one.bodies.len(), other.bodies.len());
        }
        let (_page, told) = opened(folder);
        let words = banner(&told["answer"]["status"]);
        assert!(words.contains("0.0.9+abc") && words.contains("its own messages"), "{words}");
    }
}

#[test]
fn a_film_of_another_build_has_its_events() {
    let folder = tempfile::tempdir().expect("a folder");
    filmed_by_another(ROBOTS, 200, &path(&folder));
    let source = Source::new("s.toml", ROBOTS, "");
    let mut again = WORLDS.compile(&source).expect("valid").start(&source, 1);
    again.enable_events();
    let told = |frame: Frame| -> Vec<_> {
        frame.log.into_iter().map(|e| (e.cycle, e.level, e.who, e.words)).collect()
    };
    let mut then = Vec::new();
    for _ in 0..200 {
        again.advance(1);
        then.extend(told(again.frame(FrameOptions::WITHOUT_SCANS)));
    }
    let recorded = RecordedRun::open(&WORLDS, &path(&folder)).expect("a film");
    let mut shown = recorded.start_for_viewing(1).expect("its messages are there");
    shown.advance(200);
    let shown = told(shown.frame(FrameOptions::WITHOUT_SCANS));
    assert!(!shown.is_empty());
    // The last event may come at the very end, after the last frame of the film.
    then.retain(|event| event.0 < 200);
    assert_eq!(shown, then);
}

#[test]
fn a_recording_of_another_build_says_so_and_has_its_events_but_no_inspection_and_no_digest() {
    let folder = recorded(ROBOTS);
    let (mut one, _) = opened(recorded(ROBOTS));
    made_by_another(&folder);
    let (mut page, told) = opened(folder);
    let words = banner(&told["answer"]["status"]);
    assert!(words.contains("0.0.9+abc") && words.contains("its own tables"), "{words}");
    page.ask(json!({ "do": "seek", "cycle": 600 }));
    let status = page.state("over");
    assert!(status["digest"].is_null() && banner(&status) == words, "{status}");
    let who = json!({ "kind": "robot", "number": 0, "part": null });
    let id = page.send(json!({ "do": "inspect", "body": who }));
    assert!(page.wait(id).get("problem").is_some());
    // A jump begins at a checkpoint: the events before it are known only when all is computed.
    wait_for_verdict(&mut one);
    let ask = json!({ "do": "events", "from": 0, "until": 600, "limit": 5000 });
    let happened = |page: &mut Page| -> Vec<Value> {
        let told = page.ask(ask.clone())["entries"].clone();
        let entries = told.as_array().expect("events").iter();
        entries.map(|e| json!([e["cycle"], e["kind"], e["body"]])).collect()
    };
    let (now, then) = (happened(&mut one), happened(&mut page));
    assert!(!now.is_empty());
    assert_eq!(now, then);
}

/// Waits until a recorded run is computed again. Even without being played, it is computed ahead: then all events are
/// known, and the digest is confirmed.
pub(super) fn wait_for_verdict(page: &mut Page) {
    page.until("the verdict", |page| {
        let told = page
            .notices
            .iter()
            .any(|n| n["notice"] == "status" && banner(n).contains("the recorded one"));
        told.then_some(())
    });
}

#[test]
fn a_recorded_run_is_computed_again_and_its_digest_confirmed() {
    let (mut page, opened) = opened(recorded(ROBOTS));
    assert_eq!(opened["answer"]["scene"]["is_recording"], true);
    assert!(banner(&opened["answer"]["status"]).contains("at the end"));
    wait_for_verdict(&mut page);
    let events = page.ask(json!({ "do": "events", "from": 0, "until": 601, "limit": 9999 }));
    assert_eq!(events["known_until"], 600.0);
    let (mut plain_page, _) = Page::open(ROBOTS, 1);
    plain_page.digest_at(600);
    assert_eq!(
        plain_page.ask(json!({ "do": "events", "from": 0, "until": 601, "limit": 9999 })),
        events
    );
    assert_eq!(page.digest_at(600), plain(ROBOTS, 600));
    assert!(banner(&page.state("over")).contains("the recorded one"));
    let id = page.send(json!({ "do": "restart", "seed": 3, "text": null }));
    assert!(page.wait(id).get("problem").is_some());
    page.ask(json!({ "do": "restart", "seed": null, "text": null }));
    assert_eq!(page.digest_at(100), plain(ROBOTS, 100));
}
