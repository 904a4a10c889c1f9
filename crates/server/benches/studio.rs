//! The costs of watching: frames, cycles a second with a page that watches, inspection, and seeking.
//!
//! `cargo bench -p sidestep-server [-- PART ...]` with the parts `frame`, `watched`, `inspect` and `seek`; the limits
//! in brackets are those of the project. Ratios are taken in one run, because the machine may be noisy.

use cpu_time::ProcessTime;
use serde_json::{Value, json};
use sidestep::worlds::WORLDS;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::FrameOptions;
use sidestep_scenario::Source;
use sidestep_server::protocol::FrameText;
use sidestep_server::{FrameEncoder, ServerOptions, StudioServer};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Many robots in a hall, 5 % of which they cover.
fn hall(robots: u32, cycles: u64) -> String {
    let side = (f64::from(robots * 4) / 0.05).sqrt().ceil() as usize;
    let rows = format!("{}\n", ".".repeat(side)).repeat(side);
    format!(
        "format = 1\nworld = \"robots\"\nseed = 1\ncycles = {cycles}\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\n\
         {rows}\"\"\"\n[robots]\ncount = {robots}\nsize = 2\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n"
    )
}

fn office(cycles: u64) -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/robots/office.toml");
    let text = std::fs::read_to_string(path).expect("the office");
    text.replace("\ncycles = 10000\n", &format!("\ncycles = {cycles}\n"))
}

fn start_run(text: &str) -> Box<dyn Simulation> {
    let source = Source::new("bench", text, "");
    WORLDS.compile(&source).unwrap_or_else(|e| panic!("{e}")).start(&source, 1)
}

fn sorted(mut times: Vec<f64>) -> Vec<f64> {
    times.sort_by(f64::total_cmp);
    times
}

/// Returns the median of [`REPEATS`] numbers.
fn median(times: Vec<f64>) -> f64 {
    sorted(times)[REPEATS / 2]
}

/// Number of measurements of which the median is reported.
const REPEATS: usize = 9;

/// CPU time of `n` calls, in milliseconds each; the median of several.
fn cpu_ms(n: u32, mut work: impl FnMut()) -> f64 {
    let once = |_| {
        let start = ProcessTime::now();
        (0..n).for_each(|_| work());
        start.elapsed().as_secs_f64() * 1e3 / f64::from(n)
    };
    median((0..REPEATS).map(once).collect())
}

fn frame() {
    let mut run = start_run(&hall(10_000, 1000));
    run.enable_events();
    run.advance(20);
    let text = FrameText { scans: Vec::new(), events: Vec::new(), events_left_out: 0 };
    let mut encoder = FrameEncoder::new(1, &run.scenery());
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let made = cpu_ms(20, || drop(run.frame(FrameOptions::WITHOUT_SCANS)));
    let encoded = cpu_ms(20, || drop(encoder.encode(&frame, &text, 0)));
    let (_, bytes) = encoder.encode(&frame, &text, 0);
    println!("a frame of {} bodies, CPU time of one core", frame.bodies.len());
    println!(
        "  made {made:.2} ms, encoded {encoded:.2} ms, together {:.2} ms  [1 ms]",
        made + encoded
    );
    println!("  {:.0} kB  [200 kB]", bytes.len() as f64 / 1e3);
}

/// A page that watches one session.
struct Page {
    socket: WebSocket<TcpStream>,
    id: u32,
    frames: u32,
    status: Value,
}

impl Page {
    fn open(studio: &StudioServer) -> Self {
        let host = studio.url().trim_start_matches("http://").trim_end_matches('/').to_string();
        let stream = TcpStream::connect(&host).expect("it listens");
        let (socket, _) =
            tungstenite::client(format!("ws://{host}/socket"), stream).expect("a socket");
        Self { socket, id: 0, frames: 0, status: Value::Null }
    }

    /// Sends a request; the call is written with the session that it is for, if there is one.
    fn send(&mut self, call: &Value) -> u32 {
        self.id += 1;
        let mut call = call.clone();
        let session = call.as_object_mut().and_then(|call| call.remove("session"));
        let text = json!({ "id": self.id, "session": session, "call": call }).to_string();
        self.socket.send(Message::text(text)).expect("sent");
        self.id
    }

    /// Reads a message; returns the number of the request that it answers.
    fn read(&mut self) -> Option<u64> {
        match self.socket.read().expect("a message") {
            Message::Binary(_) => {
                self.frames += 1;
                self.send(&json!({ "do": "credit", "session": 1, "frames": 1 }));
                None
            }
            Message::Text(text) => {
                let value: Value = serde_json::from_str(&text).expect("JSON");
                assert!(value.get("problem").is_none(), "{value}");
                if value["notice"] == "status" {
                    self.status = value.clone();
                }
                value["id"].as_u64()
            }
            _ => None,
        }
    }

    fn ask(&mut self, call: &Value) {
        let id = u64::from(self.send(call));
        while self.read() != Some(id) {}
    }

    fn cycle(&self) -> f64 {
        self.status["cycle"].as_f64().unwrap_or(0.0)
    }
}

fn studio(folder: &Path, text: &str) -> (StudioServer, Page) {
    std::fs::write(folder.join("s.toml"), text).expect("written");
    let options = ServerOptions {
        worlds: WORLDS.clone(),
        program: "bench".into(),
        targets: vec![folder.to_path_buf()],
        host: "127.0.0.1".into(),
        port: Some(0),
        read_only: false,
        workers: 1,
        foxglove: None,
        fleets: Vec::new(),
        gallery: &[],
    };
    let studio = StudioServer::start(options).unwrap_or_else(|e| panic!("{e}"));
    let mut page = Page::open(&studio);
    let path = folder.join("s.toml").display().to_string();
    page.ask(
        &json!({ "do": "open", "target": { "kind": "scenario", "path": path }, "seed": null }),
    );
    (studio, page)
}

/// Cycles, CPU seconds and wall seconds.
type Measurement = (f64, f64, f64);

/// Advances a run without a watcher for a while.
fn measure_unwatched(run: &mut dyn Simulation, cycles: u64) -> Measurement {
    let (cpu, wall, from) = (ProcessTime::now(), Instant::now(), run.cycle());
    while wall.elapsed() < STRETCH_DURATION {
        run.advance(cycles);
    }
    ((run.cycle() - from) as f64, cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64())
}

/// Plays a session for a while, with a page that takes all frames.
fn measure_watched(page: &mut Page) -> Measurement {
    let from = page.cycle();
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    page.ask(&json!({ "do": "play", "session": 1, "speed": "fastest" }));
    while wall.elapsed() < STRETCH_DURATION {
        page.read();
    }
    page.ask(&json!({ "do": "pause", "session": 1 }));
    let times = (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64());
    while page.status["state"] != "paused" {
        page.read();
    }
    (page.cycle() - from, times.0, times.1)
}

/// Duration of a compared stretch.
const STRETCH_DURATION: Duration = Duration::from_millis(1500);

fn watching() {
    println!(
        "cycles with a page at 30 frames/s against nobody watching (median of {REPEATS} pairs)  [0.95]"
    );
    let endless = u64::from(u32::MAX);
    for (name, text) in [("office", office(endless)), ("10000 robots", hall(10_000, endless))] {
        let folder = tempfile::tempdir().expect("a folder");
        let (_studio, mut page) = studio(folder.path(), &text);
        page.ask(&json!({ "do": "credit", "session": 1, "frames": 3 }));
        let mut run = start_run(&text);
        let slice = if name == "office" { 200 } else { 2 };
        let (mut by_cpu, mut by_wall, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..REPEATS {
            let frames = page.frames;
            let (cycles, cpu_s, wall_s) = measure_watched(&mut page);
            shown.push(f64::from(page.frames - frames) / wall_s);
            let alone = measure_unwatched(run.as_mut(), slice);
            by_cpu.push((cycles / cpu_s) / (alone.0 / alone.1));
            by_wall.push((cycles / wall_s) / (alone.0 / alone.2));
        }
        let (cpu, wall, shown) = (median(by_cpu), median(by_wall), median(shown));
        println!(
            "  {name:<14} {cpu:.3} by CPU time of all, {wall:.3} by wall time, {shown:.1} frames/s"
        );
    }
}

/// Shipped scenarios of each world, with a kind of body to inspect and the number of these.
const INSPECTED: [(&str, &str, u32); 3] = [
    ("robots/office", "robot", 24),
    ("chain/serpentine", "connector", 1),
    ("airspace/superconflict", "airplane", 10),
];

fn inspecting() {
    println!(
        "inspection while the run is played, asked and answered over the socket  [95 % in 100 ms]"
    );
    for (name, kind, count) in INSPECTED {
        let path = format!("{}/../../scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("a scenario");
        let folder = tempfile::tempdir().expect("a folder");
        let (_studio, mut page) = studio(folder.path(), &text);
        page.ask(&json!({ "do": "credit", "session": 1, "frames": 3 }));
        page.ask(&json!({ "do": "play", "session": 1, "speed": { "times": 1.0 } }));
        let part = (kind == "connector").then_some(1);
        let asked = (0..200_u32).map(|k| {
            let who = json!({ "kind": kind, "number": k % count, "part": part });
            let start = Instant::now();
            page.ask(&json!({ "do": "inspect", "session": 1, "body": who }));
            start.elapsed().as_secs_f64() * 1e3
        });
        let times = sorted(asked.collect());
        println!("  {name:<24} median {:.1} ms, 95 % within {:.1} ms", times[100], times[190]);
    }
}

fn seeking() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_studio, mut page) = studio(folder.path(), &office(20_000));
    let start = Instant::now();
    page.ask(&json!({ "do": "seek", "session": 1, "cycle": 20_000 }));
    println!("20,000 cycles of the office computed in {:.2} s", start.elapsed().as_secs_f64());
    let mut at = 1_u64;
    let seek = |page: &mut Page, cycle: u64| {
        let start = Instant::now();
        page.ask(&json!({ "do": "seek", "session": 1, "cycle": cycle }));
        start.elapsed().as_secs_f64()
    };
    let times = (0..200).map(|_| {
        at = at.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        seek(&mut page, (at >> 33) % 20_001)
    });
    let times = sorted(times.collect());
    let (middle, most, all) = (times[100], times[190], times[199]);
    println!(
        "  200 seeks: median {middle:.3} s, 95 % within {most:.3} s  [0.3 s], all within {all:.3} s"
    );
}

fn main() {
    let parts: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    for (name, measure) in [
        ("frame", frame as fn()),
        ("watched", watching),
        ("inspect", inspecting),
        ("seek", seeking),
    ] {
        if parts.is_empty() || parts.iter().any(|part| part == name) {
            measure();
        }
    }
}
