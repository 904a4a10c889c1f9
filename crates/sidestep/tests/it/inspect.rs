//! D1 for inspections: every world can be asked for the next action of a body, at any time, without changing
//! a result; and the answer is then what happens.

use crate::chain::{BROKEN, CAUGHT, PLANNED, SEVERAL, SNAKE, SWARM};
use crate::common::{CROWD, source};
use sidestep::kernel::Simulation;
use sidestep::kernel::view::{BodyId, FactValue, FrameOptions, Inspection, Vec3};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use std::collections::BTreeMap;

/// Airplanes by each kind of method, and over a network that loses messages.
const FLOWN: [&str; 5] = [
    "method = \"pc\"",
    "method = \"pc\"\nshield = \"off\"\nposition_noise_m = 5.0",
    "method = \"mvp\"",
    "method = \"orca\"\nshield = \"off\"",
    "deployment = \"team\"\nnetwork = { loss = 0.2, silent = [{ airplane = 1, from_s = 20.0 }] }",
];

/// Scenarios of all worlds.
fn scenarios(seed: u32) -> Vec<Source> {
    let chains = [SEVERAL, SWARM, BROKEN, CAUGHT, SNAKE, PLANNED];
    let chains = chains.map(|text| format!("format = 1\nworld = \"chain\"\nseed = {seed}\n{text}"));
    let flown = FLOWN.map(|airspace| {
        format!(
            "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\n{airspace}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 5\n"
        )
    });
    let texts = chains.into_iter().chain(flown);
    let robots = source(CROWD, &[&format!("seed={seed}")]);
    [robots].into_iter().chain(texts.map(|text| Source::new("asked", text, ""))).collect()
}

fn start(source: &Source, workers: usize) -> Box<dyn Simulation> {
    let compiled = WORLDS.compile(source).unwrap_or_else(|e| panic!("{e}"));
    compiled.start(source, workers)
}

/// Returns where all bodies are.
fn places(run: &mut dyn Simulation) -> BTreeMap<BodyId, Vec3> {
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    frame.bodies.iter().map(|body| (body.id(), body.pose.at_m)).collect()
}

/// Asks all bodies that there are.
fn inspect_all(run: &mut dyn Simulation) -> Vec<Inspection> {
    let all: Vec<BodyId> = places(run).into_keys().collect();
    all.into_iter().filter_map(|who| run.inspect(who)).collect()
}

#[test]
fn asking_changes_no_result_whoever_computes_it_and_wherever_it_was_resumed() {
    for source in scenarios(1) {
        let mut plain = start(&source, 1);
        plain.advance(6);
        let half = plain.checkpoint();
        while plain.cycle() < 18 {
            plain.advance(18 - plain.cycle());
        }
        for workers in 1..=3 {
            let (mut fresh, mut resumed) = (start(&source, workers), start(&source, workers));
            resumed.restore(&half).expect("the same scenario");
            for run in [&mut fresh, &mut resumed] {
                let mut told = 0;
                while run.cycle() < 18 {
                    told += inspect_all(&mut **run).len();
                    run.advance((18 - run.cycle()).min(4));
                }
                assert!(told >= 3 * run.agent_count(), "{}: {told} answers", run.world_name());
                assert_eq!(run.digest(), plain.digest(), "{}, {workers} workers", run.world_name());
                assert_eq!(run.checkpoint(), plain.checkpoint(), "{}", run.world_name());
            }
        }
    }
}

#[test]
fn what_is_told_of_a_body_is_what_then_comes() {
    for source in (1..4).flat_map(scenarios) {
        let mut run = start(&source, 1);
        let (mut compared, mut moved) = (0, 0);
        while run.cycle() < 60 && !run.is_over() {
            let (before, all) = (places(&mut *run), inspect_all(&mut *run));
            run.advance(1);
            let after = places(&mut *run);
            for told in &all {
                let next = told.fact_value("Outcome", "next place");
                let Some(now) = after.get(&told.body) else {
                    assert_eq!(next, Some(&FactValue::None), "{} is gone", told.title);
                    continue;
                };
                let expected = FactValue::Place(*now);
                assert_eq!(
                    next,
                    Some(&expected),
                    "{}, cycle {}\n{}",
                    told.title,
                    told.cycle,
                    source.text
                );
                compared += 1;
                moved += usize::from(before.get(&told.body) != Some(now));
            }
            run.advance(3);
        }
        assert!(
            compared > 10 * run.agent_count() && moved > 0,
            "{}: {compared}, {moved}",
            run.world_name()
        );
    }
}

#[test]
fn what_is_told_can_be_shown() {
    for source in scenarios(1) {
        let mut run = start(&source, 1);
        run.advance(3);
        for told in inspect_all(&mut *run) {
            assert!(!told.title.is_empty() && told.cycle == 3, "{:?}", told.body);
            let titles: Vec<&str> = told.sections.iter().map(|s| s.title.as_str()).collect();
            assert!(titles.contains(&"Now") && titles.contains(&"Outcome"), "{titles:?}");
            let tables = told.sections.iter().filter_map(|section| section.table.as_ref());
            for table in tables {
                assert!(table.rows.iter().all(|row| row.len() == table.columns.len()));
            }
            assert!(told.marks.iter().all(|mark| (0.0..=1.0).contains(&mark.weight)));
            serde_json::to_string(&told).expect("plain data");
        }
    }
}
