//! D1 for the studio: whether a page acts or not, the result is that of a plain run.

use super::*;
use crate::files::AllowedFiles;
use crate::keyframes::MemoryBudget;
use crate::outbox::OutboxItem;
use crate::protocol::{BodyId, RunMethod, Speed};
use crate::usage_registry::UsageRegistry;
use serde_json::{Value, json};
use sidestep::worlds::WORLDS;
use std::time::Instant;

mod agents;
mod fleets;
mod memory;
mod metrics;
mod ponds;
mod recordings;
mod saving;
mod seeks;

const ROBOTS: &str = "format = 1\nworld = \"robots\"\nseed = 5\ncycles = 600\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\n\
    ..............\n..............\n....##........\n....##........\n..............\n..............\n\"\"\"\n\
    [robots]\ncount = 6\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n[people]\ncount = 2\n";
const CHAINS: &str = "format = 1\nworld = \"chain\"\nseed = 9\ncycles = 150\n[chain]\ndt_s = 0.05\n[[chains]]\ncount = 2\n\
    apart_m = [0.0, 1.0]\nconnectors = 6\nat_m = [0.0, 0.0]\nrod_m = [0.25, 0.35]\nradius_m = 0.08\n[[chains.tasks]]\n\
    kind = \"wander\"\nspeed_m_s = 1.0\nturn_deg = 60\nwithin_m = [[-2.5, -2.5], [2.5, 2.5]]\npatience_s = 1000.0\n";
const AIRPLANES: &str = "format = 1\nworld = \"airspace\"\nseed = 7\ncycles = 40\n[airspace]\nmethod = \"none\"\n\
    shield = \"off\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

/// A page that opens one session.
struct Page {
    outbox: Arc<Outbox>,
    session: Session,
    id: u32,
    frames: Vec<Vec<u8>>,
    notices: Vec<Value>,
    replies: Vec<Value>,
    _folder: tempfile::TempDir,
}

fn deps(folder: &std::path::Path, workers: usize) -> SessionDeps {
    let files = AllowedFiles::from_roots(&[folder.to_path_buf()]).expect("a folder");
    let (budget, fleets) = (Arc::new(MemoryBudget::new(1 << 28, 1 << 28)), Vec::new());
    SessionDeps {
        worlds: WORLDS.clone(),
        files,
        workers,
        read_only: false,
        budget,
        foxglove: None,
        fleets,
        gallery: &[],
        usage: UsageRegistry::default(),
    }
}

impl Page {
    /// Opens a scenario; returns the reply as well.
    fn open(text: &str, workers: usize) -> (Self, Value) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.toml");
        std::fs::write(&path, text).expect("written");
        let what = OpenTarget::Scenario { path: path.display().to_string() };
        Self::open_target(deps(folder.path(), workers), what, folder)
    }

    fn open_target(
        deps: SessionDeps,
        target: OpenTarget,
        folder: tempfile::TempDir,
    ) -> (Self, Value) {
        let outbox = Arc::new(Outbox::default());
        let request = OpenRequest { session: 1, id: 1, target, seed: None };
        let session = Session::start(deps, request, outbox.clone(), ()).expect("a thread");
        let (frames, notices, replies) = Default::default();
        let mut page = Self { outbox, session, id: 1, frames, notices, replies, _folder: folder };
        let opened = page.wait(1);
        (page, opened)
    }

    /// Takes the messages that have come.
    fn read(&mut self) {
        while let Some(mail) = self.outbox.pop() {
            match mail {
                OutboxItem::Frame(bytes) => self.frames.push(bytes),
                OutboxItem::Text(text) => {
                    let value: Value = serde_json::from_str(&text).expect("JSON");
                    let is_reply = value.get("notice").is_none();
                    if is_reply { self.replies.push(value) } else { self.notices.push(value) }
                }
            }
        }
    }

    fn wait(&mut self, id: u32) -> Value {
        let found = |page: &mut Self| {
            let at = page.replies.iter().position(|reply| reply["id"] == id)?;
            Some(page.replies.remove(at))
        };
        self.until(&format!("reply {id}"), found)
    }

    fn until<T>(&mut self, what: &str, found: impl Fn(&mut Self) -> Option<T>) -> T {
        let started = Instant::now();
        loop {
            self.read();
            if let Some(found) = found(self) {
                return found;
            }
            assert!(started.elapsed() < Duration::from_secs(60), "waited too long for {what}");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn send(&mut self, call: Value) -> u32 {
        self.id += 1;
        let call = serde_json::from_value(call).expect("a call");
        self.session.send_request(self.id, call).expect("it takes requests");
        self.id
    }

    /// Asks, waits for the reply and returns the answer.
    fn ask(&mut self, call: Value) -> Value {
        let id = self.send(call.clone());
        let reply = self.wait(id);
        assert!(reply.get("problem").is_none(), "{call}: {reply}");
        reply["answer"].clone()
    }

    /// Waits for a state; returns the status.
    fn state(&mut self, state: &str) -> Value {
        self.until(state, |page| {
            let last = page.notices.iter().rfind(|notice| notice["notice"] == "status")?;
            (last["state"] == state).then(|| last.clone())
        })
    }

    /// Seeks to a cycle; returns the digest there.
    fn digest_at(&mut self, cycle: u64) -> String {
        self.ask(json!({ "do": "seek", "cycle": cycle }));
        let status = self.until("the cycle", |page| {
            let last = page.notices.iter().rfind(|notice| notice["notice"] == "status")?;
            (last["cycle"] == cycle as f64 && !last["digest"].is_null()).then(|| last.clone())
        });
        status["digest"].as_str().expect("text").to_string()
    }
}

fn plain(text: &str, cycle: u64) -> String {
    let source = Source::new("s.toml", text, "");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    while run.cycle() < cycle && run.advance(cycle - run.cycle()) > 0 {}
    assert_eq!(run.cycle(), cycle);
    run.digest().to_string()
}

#[test]
fn the_digest_is_that_of_a_plain_run_played_stepped_and_sought_to_and_fro() {
    for (text, end) in [(ROBOTS, 600), (CHAINS, 150), (AIRPLANES, 40)] {
        let at = [end / 3, end / 2, end].map(|cycle| (cycle, plain(text, cycle)));
        for workers in 1..=3 {
            let (mut page, _) = Page::open(text, workers);
            page.send(json!({ "do": "credit", "frames": 100 }));
            page.ask(json!({ "do": "play", "speed": "fastest" }));
            let over = page.state("over");
            assert_eq!(over["digest"], at[2].1.as_str(), "{workers} workers");
            for k in [0, 2, 1, 0, 1, 2] {
                let (cycle, digest) = &at[k];
                assert_eq!(&page.digest_at(*cycle), digest, "cycle {cycle}, {workers} workers");
            }
            page.digest_at(end / 3);
            page.ask(json!({ "do": "step", "cycles": end / 2 - end / 3 }));
            assert_eq!(page.digest_at(end / 2), at[1].1);
        }
    }
}

#[test]
fn a_run_that_is_paused_now_and_then_and_looked_at_is_the_same() {
    let (mut page, _) = Page::open(ROBOTS, 2);
    let who = json!({ "kind": "robot", "number": 2, "part": null });
    page.ask(json!({ "do": "select-scans", "bodies": [who] }));
    for _ in 0..5 {
        page.send(json!({ "do": "credit", "frames": 10 }));
        page.ask(json!({ "do": "play", "speed": { "times": 100.0 } }));
        std::thread::sleep(Duration::from_millis(40));
        page.ask(json!({ "do": "pause" }));
        page.ask(json!({ "do": "metrics", "from": 0 }));
        page.ask(json!({ "do": "events", "from": 0, "until": 9999, "limit": 9 }));
    }
    assert_eq!(page.digest_at(600), plain(ROBOTS, 600));
    assert!(page.frames.len() > 3);
    let scans = page.frames.iter().filter(|frame| {
        let text = String::from_utf8_lossy(frame);
        text.contains("\"sensor\":") && text.contains("\"number\":2")
    });
    assert!(scans.count() > 0, "scans were asked for");
}

#[test]
fn a_body_is_inspected_as_by_the_library_and_the_digest_stays() {
    for (text, kind, part) in
        [(ROBOTS, "robot", None), (CHAINS, "connector", Some(0)), (AIRPLANES, "airplane", None)]
    {
        let source = Source::new("s.toml", text, "");
        let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
        run.advance(20);
        let who = BodyId { kind: kind.into(), number: 1, part };
        let by_library = inspect::inspection(run.as_ref(), &who, &WORLDS.kinds());
        let (mut page, _) = Page::open(text, 2);
        let digest = page.digest_at(20);
        let id = page.send(json!({ "do": "inspect", "body": who }));
        let told = page.wait(id);
        match by_library {
            Ok(inspection) => {
                let sections = serde_json::to_value(&inspection.sections).expect("JSON");
                assert!(
                    told["answer"]["sections"] == sections && told["answer"]["cycle"] == 20.0,
                    "{told}"
                );
            }
            Err(problem) => assert_eq!(told["problem"]["cause"], *problem.cause),
        }
        assert_eq!((page.digest_at(20), page.digest_at(40)), (digest, plain(text, 40)));
        let who = json!({ "kind": "no such kind", "number": 1, "part": null });
        let id = page.send(json!({ "do": "inspect", "body": who }));
        assert!(page.wait(id).get("problem").is_some());
    }
}

#[test]
fn a_page_that_grants_no_credit_loses_frames_and_is_told_and_the_run_goes_on() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 1000000"), 1);
    page.ask(json!({ "do": "credit", "frames": 3 }));
    page.ask(json!({ "do": "play", "speed": "fastest" }));
    page.until("the frames", |page| (page.frames.len() == 3).then_some(()));
    std::thread::sleep(Duration::from_millis(300));
    page.read();
    assert_eq!(page.frames.len(), 3, "no more than was granted");
    let cycle = |frame: &[u8]| f64::from_le_bytes(*frame[16..].first_chunk().expect("a cycle"));
    let left_out = |frame: &[u8]| u32::from_le_bytes(*frame[48..].first_chunk().expect("a number"));
    let last = cycle(&page.frames[2]);
    page.ask(json!({ "do": "credit", "frames": 1 }));
    page.until("another", |page| (page.frames.len() == 4).then_some(()));
    let frame = &page.frames[3];
    assert!(cycle(frame) > last + 1.0);
    assert!((3..=20).contains(&left_out(frame)), "{}", left_out(frame));
}

#[test]
fn a_socket_that_takes_nothing_keeps_the_newest_frame_alone() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 1000000"), 1);
    page.send(json!({ "do": "credit", "frames": 50 }));
    page.send(json!({ "do": "play", "speed": "fastest" }));
    std::thread::sleep(Duration::from_millis(500));
    page.read();
    let left_out = u32::from_le_bytes(*page.frames[0][48..].first_chunk().expect("a number"));
    assert!(page.frames.len() == 1 && left_out > 3, "{} frames, {left_out}", page.frames.len());
    page.until("the others", |page| (page.frames.len() > 10).then_some(()));
}

#[test]
fn events_are_told_once_however_often_a_cycle_is_computed() {
    let (mut page, _) = Page::open(ROBOTS, 1);
    let events = |page: &mut Page| {
        page.ask(json!({ "do": "events", "from": 0, "until": 600, "limit": 100_000 }))
    };
    page.digest_at(600);
    let first = events(&mut page);
    assert!(!first["entries"].as_array().expect("events").is_empty() && first["left_out"] == 0);
    assert_eq!(first["entries"][0]["body"]["kind"], "robot");
    assert_eq!(first["entries"][0]["kind"], "contact");
    page.digest_at(10);
    page.digest_at(600);
    assert_eq!(events(&mut page), first);
}

#[test]
fn another_seed_and_another_text_start_anew_and_a_wrong_one_changes_nothing() {
    let (mut page, opened) = Page::open(ROBOTS, 1);
    assert_eq!(opened["answer"]["status"]["seed"], "5");
    let wrong = ROBOTS.replace("count = 6", "count = \"six\"");
    let id = page.send(json!({ "do": "restart", "seed": null, "text": wrong }));
    assert_eq!(page.wait(id)["problem"]["line"], 16);
    assert_eq!(page.digest_at(600), plain(ROBOTS, 600));
    let again = page.ask(json!({ "do": "restart", "seed": 77, "text": null }));
    assert_eq!(
        (&again["is"], &again["status"]["seed"], &again["status"]["cycle"]),
        (&"opened".into(), &"77".into(), &0.0.into())
    );
    assert_eq!(page.digest_at(100), plain(&ROBOTS.replace("seed = 5", "seed = 77"), 100));
    let other = ROBOTS.replace("count = 6", "count = 3");
    page.ask(json!({ "do": "restart", "seed": null, "text": other }));
    assert_eq!(page.digest_at(100), plain(&other, 100));
    assert_eq!(page.ask(json!({ "do": "source" }))["text"], other);
}

#[test]
fn a_way_that_is_given_up_is_answered_with_a_problem() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 1000000000"), 1);
    let far = page.send(json!({ "do": "seek", "cycle": 900_000_000 }));
    page.state("seeking");
    page.ask(json!({ "do": "pause" }));
    let reply = page.wait(far);
    assert!(reply["problem"]["cause"].as_str().is_some_and(|c| c.contains("paused")), "{reply}");
    page.state("paused");
}

#[test]
fn what_cannot_be_opened_or_done_is_a_problem_and_the_session_goes_on() {
    let wrong = ROBOTS.replace("world = \"robots\"", "world = \"robts\"");
    let (_, reply) = Page::open(&wrong, 1);
    assert!(reply["problem"]["remedy"].as_str().is_some_and(|r| r.contains("robots")), "{reply}");
    let (mut page, _) = Page::open(ROBOTS, 1);
    for call in [
        json!({ "do": "play", "speed": { "times": 0.0 } }),
        json!({ "do": "play", "speed": { "times": 1e9 } }),
        json!({ "do": "select-scans", "bodies": vec![json!({ "kind": "robot", "number": 1 }); 99] }),
        json!({ "do": "restart", "seed": u64::MAX, "text": null }),
        json!({ "do": "restart", "seed": 1, "text": "map = { file = \"/etc/passwd\" }" }),
    ] {
        let id = page.send(call.clone());
        assert!(page.wait(id).get("problem").is_some(), "{call}");
    }
    page.ask(json!({ "do": "step", "cycles": 1 }));
}

#[test]
fn a_text_is_checked_with_its_place_and_refused_where_the_studio_only_reads() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = Source::new("s.toml", ROBOTS, folder.path());
    let deps = deps(folder.path(), 1);
    let problems =
        text_problems(&deps, &source, ROBOTS.replace("count = 6", "cuont = 6")).expect("checked");
    assert_eq!((problems.len(), problems[0].line), (1, Some(16)));
    assert!(problems[0].remedy.contains("count") && !problems[0].is_warning);
    assert_eq!(problems[0].key.as_deref(), Some("robots.cuont"));
    let twice = ROBOTS.replace("count = 6", "cuont = 6").replace("seed = ", "seed = -");
    let keys = text_problems(&deps, &source, twice).expect("checked");
    let keys: Vec<_> = keys.iter().filter_map(|one| one.key.as_deref()).collect();
    assert_eq!(keys, ["seed", "robots.cuont"]);
    assert_eq!(text_problems(&deps, &source, ROBOTS.into()), Ok(vec![]));
    assert_eq!(text_problems(&deps, &source, "a = = 1".into()).expect("checked").len(), 1);
    let reads = SessionDeps { read_only: true, ..deps };
    assert!(text_problems(&reads, &source, ROBOTS.into()).is_err());
}

#[test]
fn a_session_that_is_dropped_ends_within_its_cycle_and_answers_all_requests() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 1000000000"), 2);
    page.outbox.add_open_request();
    page.send(json!({ "do": "seek", "cycle": 900_000_000 }));
    page.state("seeking");
    let Page { outbox, session, .. } = page;
    drop(session);
    let started = Instant::now();
    while outbox.backlog() > 0 {
        while outbox.pop().is_some() {}
        assert!(started.elapsed() < Duration::from_secs(20), "it did not end");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_bug_in_a_run_ends_its_session_with_a_notice() {
    let (mut page, _) = Page::open(ROBOTS, 1);
    let who = BodyId { kind: "no such kind".into(), number: 0, part: None };
    page.session.send_request(99, RunMethod::SelectScans { bodies: vec![who] }).expect("taken");
    page.wait(99);
    let worker = |work: fn()| {
        let (_, requests) = sync_channel(1);
        let (outbox, interrupt) = (page.outbox.clone(), Interrupt::default());
        SessionWorker { outbox, interrupt, requests }.catch_panic(work)
    };
    assert!(
        matches!(worker(|| panic!("a rule is broken")), Err(SessionExit::Bug(words)) if words == "a rule is broken")
    );
    assert!(matches!(worker(|| ()), Ok(())));
}

#[test]
fn a_run_that_is_played_at_a_speed_goes_on_until_it_is_paused() {
    let (mut page, _) = Page::open(ROBOTS, 1);
    page.ask(json!({ "do": "play", "speed": Speed::Times(20.0) }));
    page.until("some cycles", |page| {
        let last = page.notices.iter().rfind(|notice| notice["notice"] == "status")?;
        (last["cycle"].as_f64()? >= 5.0).then_some(())
    });
    page.ask(json!({ "do": "pause" }));
    let cycle = page.state("paused")["cycle"].as_f64().expect("a number");
    assert!((5.0..600.0).contains(&cycle), "{cycle}: it is paused on its way");
}

#[test]
fn a_restart_that_is_refused_on_the_way_to_a_cycle_leaves_the_run_standing() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 1000000000"), 1);
    let far = page.send(json!({ "do": "seek", "cycle": 900_000_000 }));
    page.state("seeking");
    let wrong = page.send(json!({ "do": "restart", "seed": null, "text": "x = =" }));
    assert!(page.wait(far).get("problem").is_some());
    assert!(page.wait(wrong).get("problem").is_some());
    assert!(!page.state("paused")["digest"].is_null());
    page.ask(json!({ "do": "step", "cycles": 1 }));
}

#[cfg(unix)]
#[test]
fn a_pipe_is_not_opened_for_nobody_may_ever_write_into_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pipe.toml");
    let made = std::process::Command::new("mkfifo").arg(&path).status().expect("mkfifo runs");
    assert!(made.success());
    let what = OpenTarget::Scenario { path: path.display().to_string() };
    let (_, reply) = Page::open_target(deps(folder.path(), 1), what, folder);
    assert!(reply.get("problem").is_some(), "{reply}");
}
