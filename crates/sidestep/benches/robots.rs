//! Speed of the robots world: robot-cycles per CPU second, speed-up, and related numbers.
//!
//! `cargo bench -p sidestep [-- PART ...]` with the parts `shipped`, `rates`, `teams`, `corridor`, `loop`,
//! `recording` and `looking`; every number is a ratio or a rate taken in one run, because the machine may be
//! noisy. Sensors and effectors are both unreliable.

use cpu_time::ProcessTime;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::heap_bytes;
use sidestep::worlds::robots::kinds::ROBOT;
use sidestep::worlds::robots::{RobotsRun, RobotsWorld, robots_run};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::ports::{Recorder, SystemClock};
use sidestep_kernel::view::{BodyId, FrameOptions};
use sidestep_kernel::{PhaseContext, Phases, Simulation};
use sidestep_record::{ParquetRecorder, Provenance};
use std::hint::black_box;
use std::time::Instant;

/// One case: bodies in a walled hall, 5 % of which they cover.
struct Case {
    name: &'static str,
    robots: u32,
    size: u32,
    /// Beams of this many boxes; `None` for no beams.
    ray_boxes: Option<u32>,
    /// Robot-cycles per CPU second that the project promises.
    promised: f64,
}

const CASES: [Case; 4] = [
    Case { name: "100-3x3-8x15", robots: 100, size: 3, ray_boxes: Some(15), promised: 6e6 },
    Case { name: "1000-3x3-8x15", robots: 1000, size: 3, ray_boxes: Some(15), promised: 5e6 },
    Case { name: "100000-1x1-8x8", robots: 100_000, size: 1, ray_boxes: Some(8), promised: 3e6 },
    Case { name: "1000-1x1-wander", robots: 1000, size: 1, ray_boxes: None, promised: 20e6 },
];

impl Case {
    fn scenario(&self) -> Source {
        let covered = f64::from(self.robots * self.size * self.size);
        let side = (covered / 0.05).sqrt().ceil() as usize;
        let row = format!("{}\n", ".".repeat(side));
        let sensors = if self.ray_boxes.is_some() { "sensors = [\"rays\"]" } else { "" };
        let range_m = f64::from(self.ray_boxes.unwrap_or(1)) * 0.25;
        let text = format!(
            r#"
format = 1
world = "robots"
seed = 1
[map]
box_size_m = 0.25
ascii = """
{}"""
[robots]
count = {}
size = {}
effector = "nomad"
{sensors}
[sensors.rays]
bearings_deg = [0, 45, 90, 135, 180, 225, 270, 315]
range_m = {range_m}
observations = ["nothing", "wall", "robot"]
distance_edges_m = [0.3, 1.5]
distance_classes = ["near", "medium", "far"]
[sensors.rays.confusion]
nothing = [0.97, 0.02, 0.01]
wall = [0.03, 0.92, 0.05]
robot = [0.05, 0.10, 0.85]
[sensors.rays.distance_confusion]
near = [0.94, 0.06, 0.0]
medium = [0.03, 0.93, 0.04]
far = [0.0, 0.05, 0.95]
beyond = [0.1, 0.3, 0.6]
"#,
            row.repeat(side),
            self.robots,
            self.size,
        );
        Source::new(self.name, text, "")
    }

    fn simulation(&self, workers: usize) -> RobotsRun {
        robots_run(&self.scenario(), workers).expect("the case is a valid scenario")
    }

    /// Returns a number of cycles that takes about a second.
    fn cycles(&self) -> u64 {
        (5_000_000 / u64::from(self.robots)).max(20)
    }
}

/// Returns the CPU and wall time of `cycles` cycles in seconds.
fn time(simulation: &mut RobotsRun, cycles: u64) -> (f64, f64) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    advance(simulation, cycles);
    (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64())
}

/// Advances past full recording buffers as well.
fn advance(simulation: &mut RobotsRun, cycles: u64) {
    let mut done = 0;
    while done < cycles {
        done += simulation.advance(cycles - done);
    }
}

/// Returns the best rate of several repeats: the speed of the machine when nothing disturbs it.
fn rate(case: &Case) -> f64 {
    let mut simulation = case.simulation(1);
    time(&mut simulation, case.cycles() / 4);
    let best = (0..7).map(|_| time(&mut simulation, case.cycles()).0).fold(f64::INFINITY, f64::min);
    case.cycles() as f64 * f64::from(case.robots) / best
}

/// Returns the median of `n` ratios, each taken in one go.
fn median_of(n: usize, ratio: impl FnMut() -> f64) -> f64 {
    let mut ratios: Vec<f64> = std::iter::repeat_with(ratio).take(n).collect();
    ratios.sort_by(f64::total_cmp);
    ratios[n / 2]
}

/// Returns the median of wall(1 worker) / wall(`workers`), taken in turn.
fn speed_up(source: &Source, workers: usize, cycles: u64) -> f64 {
    let mut alone = robots_run(source, 1).expect("a valid scenario");
    let mut team = robots_run(source, workers).expect("a valid scenario");
    for simulation in [&mut alone, &mut team] {
        time(simulation, cycles / 4);
    }
    median_of(9, || time(&mut alone, cycles).1 / time(&mut team, cycles).1)
}

/// Shipped scenarios of the world.
const SHIPPED: [&str; 6] = ["office", "corridor", "crossing", "default", "radio", "one-robot"];

/// Prints what people run: each shipped scenario as it is, and the main two with each other behavior of their couriers.
fn shipped() {
    println!(
        "shipped scenarios, one worker: robot-cycles per CPU second, trips in 1000 robot-cycles"
    );
    for name in SHIPPED {
        print_shipped(name, "as it is", &shipped_scenario(name, str::to_owned));
    }
    for name in ["office", "corridor"] {
        for avoidance in ["avoid", "filter", "touch"] {
            let with_avoidance = |line: &str| {
                let keys = line.trim_end_matches([' ', '}']);
                format!("{keys}, avoidance = \"{avoidance}\" }}")
            };
            print_shipped(name, avoidance, &shipped_scenario(name, with_avoidance));
        }
        let wander = |_: &str| "behaviour = { kind = \"wander\" }".to_owned();
        print_shipped(name, "wander", &shipped_scenario(name, wander));
    }
}

/// Returns a shipped scenario with the behavior of each shuttle edited.
fn shipped_scenario(name: &str, edit: impl Fn(&str) -> String) -> Source {
    let path = format!("{}/../../scenarios/robots/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("a shipped scenario");
    let is_shuttle = |line: &str| line.starts_with("behaviour = { kind = \"shuttle\"");
    let lines =
        text.lines().map(|line| if is_shuttle(line) { edit(line) } else { line.to_owned() });
    let text = lines.collect::<Vec<_>>().join("\n");
    Source::new(path, text, "")
}

fn print_shipped(name: &str, what: &str, source: &Source) {
    const CYCLES: u64 = 4_000;
    let mut run = robots_run(source, 1).expect("a valid scenario");
    let robot_cycles = CYCLES as f64 * run.world().robots().len() as f64;
    // The best of several stretches: the speed of the machine when nothing disturbs it.
    let best = (0..3).map(|_| time(&mut run, CYCLES).0).fold(f64::INFINITY, f64::min);
    let total = run.metrics().total;
    println!(
        "  {name:<10} {what:<9} {:>6.2} M  {:>6.2} trips",
        robot_cycles / best / 1e6,
        1000.0 * total.trips as f64 / (3.0 * robot_cycles),
    );
}

fn rates() {
    println!("robot-cycles per CPU second, one worker, both unreliable (promised in brackets)");
    for case in CASES {
        let simulation = case.simulation(1);
        let (boxes, bodies) = heap_bytes(&simulation);
        let map_boxes = simulation.world().map.cells().len() as f64;
        let robots = f64::from(case.robots);
        let allowed = 200.0 * robots + 2.0 * map_boxes;
        println!(
            "  {:<16} {:>6.2} M  [{:>4.1} M]   {:>4.0} B per robot + {:.2} B per box = {:.0} % of the memory allowed",
            case.name,
            rate(&case) / 1e6,
            case.promised / 1e6,
            bodies as f64 / robots,
            boxes as f64 / map_boxes,
            100.0 * (boxes + bodies) as f64 / allowed,
        );
    }
}

fn teams() {
    let most = sidestep_kernel::workers::available_workers().min(16);
    println!("speed-up over one worker, wall time (median of 9 pairs)");
    for case in CASES {
        print!("  {:<16}", case.name);
        for workers in (0..).map(|k| 1usize << k).skip(1).take_while(|w| *w <= most) {
            let s = speed_up(&case.scenario(), workers, case.cycles());
            print!("  {workers} workers {s:.2}x (efficiency {:.2})", s / workers as f64);
        }
        println!();
    }
}

/// Measures all robots in one corridor: large groups, the worst case of merging.
fn corridor() {
    let row = |c: &str| format!("{}\n", c.repeat(240));
    let art = format!("{}{}", row("."), row(".").repeat(5));
    for policy in ["random", "rounds", "simultaneous"] {
        let text = format!(
            "format = 1\nworld = \"robots\"\nconflict_policy = \"{policy}\"\n[map]\nascii = \"\"\"\n{art}\"\"\"\n\
             [robots]\ncount = 1000\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n"
        );
        let source = Source::new("corridor", text, "");
        let ratio = speed_up(&source, 2, 2_000);
        let mut run = robots_run(&source, 1).expect("a valid scenario");
        advance(&mut run, 200);
        let largest = run.metrics().largest_group;
        println!(
            "corridor, 1000 robots on 1440 boxes, {policy}: 2 workers {ratio:.2}x, largest group {largest}"
        );
    }
}

/// Compares the engine with one worker with a plain loop over the phases.
fn plain_loop() {
    for case in &CASES[..2] {
        let source = case.scenario();
        let mut engine = case.simulation(1);
        let plain = case.simulation(1);
        let (world, state) = (plain.world().clone(), plain.state());
        let (mut scratch, groups) = (world.new_scratch(), ConflictGroups::new(world.bodies.len()));
        let n = world.bodies.len();
        let clock = &SystemClock::default();
        let mut now = 0;
        let mut members = Vec::new();
        let mut plain_cycle = || {
            (0..n as u32).for_each(|slot| groups.make_singleton(slot));
            let turn =
                &mut PhaseContext { world: &*world, state, now, clock, scratch: &mut scratch };
            RobotsWorld::claim(turn, 0..n);
            RobotsWorld::join(turn, 0..n, &groups);
            for slot in (0..n as u32).filter(|&s| groups.is_leader(s)) {
                groups.members(slot, &mut members);
                RobotsWorld::act(turn, &mut members);
            }
            now += 1;
        };
        let cycles = case.cycles() / 4;
        let ratio = median_of(15, || {
            let engine_s = time(&mut engine, cycles).0;
            let started = ProcessTime::now();
            (0..cycles).for_each(|_| plain_cycle());
            engine_s / started.elapsed().as_secs_f64()
        });
        println!("{}: --workers 1 takes {ratio:.3} of a plain loop's CPU time", source.place);
    }
}

/// Measures CPU time with and without recording every pose to Parquet, and bytes on disk.
fn recording() {
    let case = &CASES[1];
    let folder = std::env::temp_dir().join(format!("sidestep-bench-{}", std::process::id()));
    let origin = Provenance { program_version: "bench".into(), scenario: String::new(), seed: 1 };
    let mut plain = case.simulation(1);
    let cycles = 4096;
    let mut bytes = 0.0;
    let ratio = median_of(7, || {
        let plain_s = time(&mut plain, cycles).0;
        let mut recorded = case.simulation(1);
        recorded.start_recording();
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        let mut recorder =
            ParquetRecorder::create(&folder, &recorded.schemas(), &origin).expect("a recorder");
        let started = ProcessTime::now();
        while recorded.cycle() < cycles {
            recorded.advance(cycles - recorded.cycle());
            recorded.record(&mut recorder).expect("there is room");
        }
        recorder.finish().expect("there is room");
        let recorded_s = started.elapsed().as_secs_f64();
        bytes = size_of_folder(&folder) as f64 / (cycles as f64 * f64::from(case.robots));
        std::fs::remove_dir_all(&folder).expect("our own folder");
        recorded_s / plain_s
    });
    println!(
        "{}: recording takes {:.1} % more CPU time and {bytes:.2} bytes per robot-cycle",
        case.name,
        100.0 * (ratio - 1.0)
    );
}

/// Prints the cost of a frame and of an inspection of 10,000 robots, in CPU time: the best of
/// several; and inspections in other worlds.
fn looking() {
    let case =
        Case { name: "10000-1x1-8x8", robots: 10_000, size: 1, ray_boxes: Some(8), promised: 0.0 };
    let mut run = case.simulation(1);
    run.enable_events();
    let best_ms = |n: u32, mut work: Box<dyn FnMut(u32) + '_>| {
        let once = |k: u32| {
            let started = ProcessTime::now();
            work(k);
            1e3 * started.elapsed().as_secs_f64()
        };
        (0..n).map(once).fold(f64::INFINITY, f64::min)
    };
    advance(&mut run, 20);
    let frame_ms =
        best_ms(40, Box::new(|_| drop(black_box(run.frame(FrameOptions::WITHOUT_SCANS)))));
    let asked = |k: u32| BodyId::new(ROBOT, 97 * k, None);
    let inspect_ms = best_ms(20, Box::new(|k| drop(black_box(run.inspect(asked(k))))));
    println!("{}: a frame in {frame_ms:.2} ms, an inspection in {inspect_ms:.1} ms", case.name);
    let traffic = |kind: &str, n: u32, more: &str| {
        format!(
            "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"{kind}\"\nn = {n}\n{more}\n"
        )
    };
    let chains = WORLDS.find("chain").map_or("", |kind| kind.default_scenario());
    inspections("20 airplanes in one conflict", traffic("superconflict", 20, ""));
    inspections("5000 airplanes", traffic("random", 5000, "radius_m = 400000"));
    inspections("the chains of the default scenario", chains.into());
}

/// Prints the cost of inspections of some bodies of a scenario, in CPU time.
fn inspections(what: &str, text: String) {
    let source = Source::new(what, text, "");
    let compiled = WORLDS.compile(&source).expect("a valid scenario");
    let mut run = compiled.start(&source, 1);
    run.advance(25);
    let bodies = run.frame(FrameOptions::WITHOUT_SCANS).bodies;
    let agents: Vec<_> = bodies.iter().filter(|body| body.kind.is_agent()).collect();
    let every = agents.len().div_ceil(20);
    let mut took_ms: Vec<f64> = Vec::new();
    for body in agents.iter().step_by(every) {
        let started = ProcessTime::now();
        black_box(run.inspect(body.id()));
        took_ms.push(1e3 * started.elapsed().as_secs_f64());
    }
    took_ms.sort_by(f64::total_cmp);
    let (middle, longest) = (took_ms[took_ms.len() / 2], took_ms[took_ms.len() - 1]);
    println!("{what}: an inspection in {middle:.1} ms, at most {longest:.1} ms");
}

fn size_of_folder(folder: &std::path::Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|e| {
            if e.path().is_dir() {
                size_of_folder(&e.path())
            } else {
                e.metadata().map_or(0, |m| m.len())
            }
        })
        .sum()
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let parts: [(&str, fn()); 7] = [
        ("shipped", shipped),
        ("rates", rates),
        ("teams", teams),
        ("corridor", corridor),
        ("loop", plain_loop),
        ("recording", recording),
        ("looking", looking),
    ];
    for (name, part) in parts {
        if asked.is_empty() || asked.iter().any(|a| a == name) {
            part();
        }
    }
}
