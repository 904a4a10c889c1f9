//! What a replay holds is what the server would have sent, and nothing of the machine that made it.

use super::plane::tests::decode;
use super::*;
use crate::encode::{FrameColumns, FrameEncoder};
use crate::protocol::FrameText;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use sidestep::worlds::WORLDS;
use sidestep_scenario::Source;
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
use std::io::Read;

const ROBOTS: &str = "format = 1\nworld = \"robots\"\nname = \"</script><b>\"\nseed = 5\ncycles = 300\n[map]\n\
    box_size_m = 0.25\nascii = \"\"\"\n\
    ..............\n..............\n....##........\n....##........\n..............\n..............\n\"\"\"\n\
    [robots]\ncount = 6\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n[people]\ncount = 2\n";
const CHAINS: &str = "format = 1\nworld = \"chain\"\nseed = 9\ncycles = 90\n[chain]\ndt_s = 0.05\n[[chains]]\ncount = 2\n\
    apart_m = [0.0, 1.0]\nconnectors = 6\nat_m = [0.0, 0.0]\nrod_m = [0.25, 0.35]\nradius_m = 0.08\n[[chains.tasks]]\n\
    kind = \"wander\"\nspeed_m_s = 1.0\nturn_deg = 60\nwithin_m = [[-2.5, -2.5], [2.5, 2.5]]\npatience_s = 1000.0\n";
const AIRPLANES: &str = "format = 1\nworld = \"airspace\"\nseed = 7\ncycles = 40\n[airspace]\nmethod = \"none\"\n\
    shield = \"off\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

/// A recorded run, and what a replay of it holds.
struct Replay {
    _folder: tempfile::TempDir,
    place: String,
    content: ReplayContent,
}

fn replay(text: &str, change: impl FnOnce(&mut PageRequest<'_>)) -> Replay {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("r");
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("valid");
    let keep = OutputPaths { folder: Some(&run), ..OutputPaths::default() };
    let started = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, keep).expect("started");
    started.run_to_end(&NoWatcher).expect("recorded");
    let recorded = RecordedRun::open(&WORLDS, &run).expect("a recording");
    let scope =
        ExportScope { out: None, replace: false, from: None, until: None, every: None, workers: 1 };
    let inspections = InspectionRequest::default();
    let mut request = PageRequest { scope, inspections, beside: None };
    change(&mut request);
    let source = FrameSource::check(&recorded, &request.scope, &NoWatcher).expect("recorded");
    let content = collect(&WORLDS, &request.spec(), &[source]).expect("collected");
    Replay { place: folder.path().display().to_string(), _folder: folder, content }
}

impl Replay {
    fn parts(&self) -> Vec<Vec<u8>> {
        let inflate = |line: &str| {
            let packed = STANDARD.decode(line).expect("base64");
            let mut bytes = Vec::new();
            flate2::read::DeflateDecoder::new(&packed[..])
                .read_to_end(&mut bytes)
                .expect("deflate");
            bytes
        };
        self.content.parts.split('\n').map(inflate).collect()
    }

    fn run(&self) -> Value {
        let file: Value = serde_json::from_slice(&self.parts()[0]).expect("a directory");
        file["runs"][0].clone()
    }

    /// The values of a part that the directory names.
    fn part(&self, number: &Value) -> Value {
        let number = number.as_u64().expect("a number") as usize;
        serde_json::from_slice(&self.parts()[number]).expect("JSON")
    }

    fn frames(&self) -> Vec<FrameColumns> {
        let run = self.run();
        let parts = self.parts();
        let dimensions = run["scene"]["dimensions"].as_u64().expect("a number") as usize;
        let chunks = run["chunks"].as_array().expect("chunks");
        let part = |chunk: &Value| &parts[chunk["part"].as_u64().expect("a number") as usize];
        chunks.iter().flat_map(|chunk| decode_chunk(part(chunk), dimensions)).collect()
    }
}

fn decode_chunk(bytes: &[u8], d: usize) -> Vec<FrameColumns> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let mut at = 4;
    let mut frames = Vec::new();
    for _ in 0..word(0) {
        let head: Vec<usize> = (0..6).map(|k| word(at + 4 * k) as usize).collect();
        let [table, times, bodies, lines, points, speeds] = head[..] else { panic!("a head") };
        at += 24;
        let line_starts: Vec<u32> = (0..=lines).map(|k| word(at + 4 * k)).collect();
        at += 4 * line_starts.len();
        let mut plane = |channels: usize| {
            let (rows, used) = decode(&bytes[at..], channels, times);
            at += used;
            rows
        };
        let places = plane(d * (bodies + points));
        let turns = plane(bodies * if d == 2 { 1 } else { 4 });
        let velocities = if speeds == 0 { vec![Vec::new(); times] } else { plane(speeds) };
        let conditions = plane(bodies);
        let columns = places.into_iter().zip(turns).zip(velocities).zip(conditions);
        for (((places, turns), velocities), conditions) in columns {
            let table = table as u32;
            let line_starts = line_starts.clone();
            frames.push(FrameColumns { table, places, turns, velocities, line_starts, conditions });
        }
    }
    assert_eq!(at, bytes.len());
    frames
}

#[test]
fn frames_are_those_that_a_server_sends() {
    for (text, cycles, tolerance) in [(ROBOTS, 300, 0.0), (CHAINS, 90, 1e-5), (AIRPLANES, 40, 0.05)]
    {
        let frames = replay(text, |_| ()).frames();
        assert_eq!(frames.len(), cycles + 1);
        let source = Source::new("s.toml", text, "");
        let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
        let mut encoder = FrameEncoder::new(0, &run.scenery());
        let words = FrameText { scans: Vec::new(), events: Vec::new(), events_left_out: 0 };
        for kept in frames {
            let frame = run.frame(FrameOptions::WITHOUT_SCANS);
            let sent = FrameColumns::from_frame(&encoder.encode(&frame, &words, 0).1);
            assert!(sent.has_same_layout(&kept) && sent.conditions == kept.conditions);
            let is_near = |a: &[f32], b: &[f32], most: f32| {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
            };
            assert!(is_near(&sent.places, &kept.places, tolerance), "cycle {}", run.cycle());
            assert!(
                is_near(&sent.velocities, &kept.velocities, tolerance),
                "cycle {}",
                run.cycle()
            );
            assert!(
                is_near(&sent.turns, &kept.turns, 4e-6_f32.min(tolerance)),
                "cycle {}",
                run.cycle()
            );
            run.advance(1);
        }
    }
}

#[test]
fn events_metrics_and_the_scenario_are_complete_and_name_no_folder() {
    let replay =
        replay(ROBOTS, |request| request.inspections.agents = vec!["2".parse().expect("a number")]);
    let run = replay.run();
    assert!(replay.content.content.is_confirmed && run["digest"].is_string());
    assert_eq!(run["cycles"], serde_json::json!([[0.0, 1.0, 301.0]]));
    let metrics = replay.part(&run["metrics"]);
    assert_eq!(metrics["cycles"].as_array().map(Vec::len), Some(301));
    assert!(
        replay.part(&run["source"])["text"].as_str().is_some_and(|text| text.contains("count = 6"))
    );
    let counted: u64 = run["events"]
        .as_array()
        .expect("events")
        .iter()
        .filter_map(|one| one["count"].as_u64())
        .sum();
    let events = replay.part(&run["events"][0]["part"]);
    assert_eq!(events["text"].as_array().map(|all| all.len() as u64), Some(counted));
    assert_eq!((run["name"].as_str(), replay.content.content.inspections), (Some("r"), 301));
    for part in replay.parts() {
        assert!(!String::from_utf8_lossy(&part).contains(&replay.place));
    }
}

#[test]
fn a_part_of_a_run_has_its_own_cycles_and_inspections() {
    let replay = replay(ROBOTS, |request| {
        request.scope.from = Some(100);
        request.scope.until = Some(205);
        request.scope.every = Some(10);
        request.inspections.cycles = Some("115:130".parse().expect("a window"));
    });
    let run = replay.run();
    assert_eq!(run["cycles"], serde_json::json!([[100.0, 10.0, 11.0], [205.0, 1.0, 1.0]]));
    assert!(run["digest"].is_null() && !replay.content.content.is_confirmed);
    assert_eq!(replay.content.content.inspections, 12, "six robots in cycles 120 and 130");
    let span = &run["inspections"][0];
    assert_eq!((&span["from"], &span["until"]), (&120.0.into(), &130.0.into()));
    let first = &replay.part(&span["part"])[0];
    assert_eq!(first["inspection"]["cycle"], 120);
    assert!(first["scans"].as_array().is_some_and(|scans| !scans.is_empty()));
}

#[test]
fn a_document_has_the_parts_and_an_escaped_title() {
    let replay = replay(ROBOTS, |request| request.scope.every = Some(100));
    let files = page::EntryFiles { script: "1;", style: "p {}", icon: b"<svg/>" };
    let text = html::document(&replay.content.title, &files, &replay.content.parts);
    assert!(text.contains("<title>&lt;/script&gt;&lt;b&gt; · Sidestep replay</title>"));
    assert!(text.contains(&replay.content.parts) && !text.contains("<b>"));
}

#[test]
fn metrics_of_agents_are_kept_at_evenly_spaced_cycles_and_at_the_last_one() {
    let replay = replay(ROBOTS, |_| ());
    let agents = &replay.run()["agents"];
    let cycles: Vec<u64> = agents["cycles"]
        .as_array()
        .expect("cycles")
        .iter()
        .map(|cycle| cycle.as_f64().expect("a number") as u64)
        .collect();
    let even: Vec<u64> = (0..=300).step_by(2).collect();
    assert_eq!(cycles, even, "every second of 301 frames, of which at most 200 have a row");
    let names = agents["names"].as_array().expect("names");
    let place = names.iter().position(|name| name["key"] == "counts.contacts").expect("contacts");
    let part = agents["parts"][place].as_u64().expect("a part") as usize;
    let parts = replay.parts();
    let (rows, used) = decode(&parts[part], 6, cycles.len());
    assert_eq!(used, parts[part].len());
    let source = Source::new("s.toml", ROBOTS, "");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    for (cycle, row) in cycles.into_iter().zip(rows) {
        run.advance(cycle - run.cycle());
        let told = run.agent_metrics();
        let contacts = |robot: usize| told[robot]["counts"]["contacts"].as_f64().expect("a number");
        let expected: Vec<f32> = (0..6).map(|robot| contacts(robot) as f32).collect();
        assert_eq!(row, expected, "cycle {cycle}");
    }
}
