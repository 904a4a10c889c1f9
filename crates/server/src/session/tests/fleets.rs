//! Fleets that fly elsewhere: each view once, events once, no order taken, and the loss reported.

use super::*;
use crate::fleet_feed::FleetFeed;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::FrameOptions;
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus, NodeStatus};

const AT: &str = "tcp/127.0.0.1:7600";

/// A flight that is computed elsewhere.
struct RemoteFlight {
    run: Box<dyn Simulation>,
    screen: Arc<FleetFeed>,
    number: u64,
    events: Vec<sidestep_kernel::view::LogEvent>,
}

impl RemoteFlight {
    fn start() -> Self {
        let run = flight();
        let screen = Arc::new(FleetFeed::new(AT.into(), staged(run.as_ref())));
        Self { run, screen, number: 0, events: Vec::new() }
    }

    /// Flies from the start once more, at the same address.
    fn restart(&mut self) {
        self.run = flight();
        (self.number, self.events) = (0, Vec::new());
        self.screen.restart(staged(self.run.as_ref()));
    }

    /// Flies on and shows the flight, with all events so far.
    fn publish(&mut self, cycles: u64, is_over: bool) {
        self.run.advance(cycles);
        self.number += 1;
        let mut frame = self.run.frame(FrameOptions::WITHOUT_SCANS);
        self.events.append(&mut frame.log);
        frame.log.clone_from(&self.events);
        // As with connectors: the number on the network is not that of the body.
        let node =
            |agent| NodeStatus { agent, number: 4, part: Some(agent), ..NodeStatus::default() };
        let (nodes, noun) = ((0..6).map(node).collect(), "connector".into());
        let fleet =
            FleetStatus { cycle: frame.cycle, cycles: 40, noun, nodes, ..FleetStatus::default() };
        self.screen.replace_view(FleetFrame { number: self.number, frame, fleet, is_over });
    }

    fn page(&self) -> Page {
        let folder = tempfile::tempdir().expect("a folder");
        let deps = SessionDeps { fleets: vec![self.screen.clone()], ..deps(folder.path(), 1) };
        let (page, opened) = Page::open_target(deps, OpenTarget::Fleet { path: AT.into() }, folder);
        let opened = &opened["answer"];
        assert_eq!(
            (&opened["is"], &opened["scene"]["agent"]),
            (&"opened".into(), &"airplane".into())
        );
        page
    }
}

fn flight() -> Box<dyn Simulation> {
    let source = Source::new("s.toml", AIRPLANES, "");
    let compiled = WORLDS.compile(&source).expect("it is right");
    let mut run = compiled.start(&source, 1);
    run.enable_events();
    run
}

fn staged(run: &dyn Simulation) -> FleetScene {
    FleetScene {
        build: "b".into(),
        world: run.world_name().into(),
        agent: run.agent_noun().into(),
        seed: 7,
        scenery: run.scenery(),
    }
}

fn ended(page: &mut Page) -> Value {
    page.until("the end", |page| {
        page.notices.iter().find(|notice| notice["notice"] == "ended").cloned()
    })
}

fn status(page: &mut Page, is_it: impl Fn(&Value) -> bool) -> Value {
    page.until("a status", |page| {
        let is_found = |notice: &&Value| notice["notice"] == "status" && is_it(notice);
        page.notices.iter().rfind(is_found).cloned()
    })
}

#[test]
fn views_are_shown_as_they_are_heard_and_no_event_twice() {
    let mut elsewhere = RemoteFlight::start();
    elsewhere.publish(0, false);
    let mut page = elsewhere.page();
    page.ask(json!({ "do": "credit", "frames": 100 }));
    page.until("a frame", |page| (!page.frames.is_empty()).then_some(()));
    for _ in 0..4 {
        elsewhere.publish(9, false);
        let cycle = elsewhere.run.cycle() as f64;
        let now = status(&mut page, |status| status["cycle"] == cycle);
        assert_eq!((&now["state"], &now["cycles_planned"]), (&"watched".into(), &40.0.into()));
        assert_eq!(now["fleet"]["nodes"].as_array().map(Vec::len), Some(6));
        let who = json!({ "kind": "connector", "number": 4, "part": 5 });
        assert_eq!(now["fleet"]["nodes"][5]["body"], who);
    }
    assert!(elsewhere.events.len() > 3, "there is something to tell");
    let told = page.ask(json!({ "do": "events", "from": 0, "until": 99, "limit": 5000 }));
    assert_eq!(told["entries"].as_array().map(Vec::len), Some(elsewhere.events.len()));
    elsewhere.publish(4, true);
    status(&mut page, |status| status["state"] == "over");
}

#[test]
fn what_would_steer_a_fleet_is_refused_and_its_loss_ends_the_session() {
    let mut elsewhere = RemoteFlight::start();
    elsewhere.publish(1, false);
    let mut page = elsewhere.page();
    for call in [
        json!({ "do": "play", "speed": "fastest" }),
        json!({ "do": "step", "cycles": 1 }),
        json!({ "do": "source" }),
    ] {
        let id = page.send(call.clone());
        let cause = page.wait(id)["problem"]["cause"].clone();
        assert_eq!(cause, "a fleet is only watched here", "{call}");
    }
    elsewhere.screen.mark_disconnected("it was not heard", "watch it again");
    assert_eq!(ended(&mut page)["problem"]["cause"], "it was not heard");
    status(&mut page, |status| status["state"] == "failed");
}

#[test]
fn a_fleet_that_is_lost_cannot_be_opened_and_the_one_that_flies_there_next_can() {
    let mut elsewhere = RemoteFlight::start();
    elsewhere.publish(1, false);
    elsewhere.screen.mark_disconnected("it was not heard", "watch it again");
    let folder = tempfile::tempdir().expect("a folder");
    let deps = SessionDeps { fleets: vec![elsewhere.screen.clone()], ..deps(folder.path(), 1) };
    let (mut page, refused) =
        Page::open_target(deps, OpenTarget::Fleet { path: AT.into() }, folder);
    assert_eq!(refused["problem"]["cause"], "it was not heard");
    drop(page);
    elsewhere.restart();
    page = elsewhere.page();
    elsewhere.publish(3, false);
    status(&mut page, |status| status["cycle"] == 3.0);
}

#[test]
fn a_fleet_that_is_over_stays_to_be_seen_until_another_one_flies_there() {
    let mut elsewhere = RemoteFlight::start();
    elsewhere.publish(2, true);
    let mut page = elsewhere.page();
    status(&mut page, |status| status["state"] == "over");
    elsewhere.screen.mark_disconnected("nobody answers", "watch it again");
    // A second one finds it, too.
    drop(elsewhere.page());
    elsewhere.restart();
    let cause = &ended(&mut page)["problem"]["cause"];
    assert_eq!(*cause, "the fleet has ended, and another one flies here");
}

#[test]
fn a_fleet_that_the_command_line_did_not_name_is_no_fleet() {
    let folder = tempfile::tempdir().expect("a folder");
    let what = OpenTarget::Fleet { path: AT.into() };
    let (_, refused) = Page::open_target(deps(folder.path(), 1), what, folder);
    assert_eq!(
        refused["problem"]["remedy"],
        format!("start the studio with it: `sidestep studio {AT}`")
    );
}
