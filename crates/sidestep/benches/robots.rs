//! Speed of the robots world: robot-cycles per CPU second, speed-up, and their like.
//!
//! `cargo bench -p sidestep --bench robots [-- CASE]`; every figure is a ratio or a rate taken
//! in one run, since the machine may be noisy. Sensors and effectors are both unreliable.

use cpu_time::ProcessTime;
use sidestep::scenario::Source;
use sidestep::worlds::robots::simulation::RobotsSimulation;
use sidestep_kernel::Simulation;
use std::time::Instant;

/// One case: bodies in a walled hall of which they cover 5 %.
struct Case {
    name: &'static str,
    robots: u32,
    size: u32,
    /// Beams of this many boxes, or none.
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

    fn simulation(&self, workers: usize) -> RobotsSimulation {
        RobotsSimulation::new(&self.scenario(), workers).expect("the case is a valid scenario")
    }

    /// Cycles that take about a second.
    fn cycles(&self) -> u64 {
        (5_000_000 / u64::from(self.robots)).max(20)
    }
}

/// CPU and wall seconds of `cycles` cycles.
fn time(simulation: &mut RobotsSimulation, cycles: u64) -> (f64, f64) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    simulation.advance(cycles);
    (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64())
}

/// Best rate of several repeats: what the machine gives when nobody disturbs it.
fn rate(case: &Case) -> f64 {
    let mut simulation = case.simulation(1);
    time(&mut simulation, case.cycles() / 4);
    let best = (0..5).map(|_| time(&mut simulation, case.cycles()).0).fold(f64::INFINITY, f64::min);
    case.cycles() as f64 * f64::from(case.robots) / best
}

/// Median of wall(1 worker) / wall(`workers`), taken in turn.
fn speed_up(case: &Case, workers: usize) -> f64 {
    let (mut alone, mut team) = (case.simulation(1), case.simulation(workers));
    (time(&mut alone, case.cycles() / 4), time(&mut team, case.cycles() / 4));
    let mut ratios: Vec<f64> = (0..7)
        .map(|_| time(&mut alone, case.cycles()).1 / time(&mut team, case.cycles()).1)
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios[ratios.len() / 2]
}

fn main() {
    let filter: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<18} {:>12} {:>10} {:>10} {:>8} {:>8}",
        "case", "M rc/cpu-s", "promised", "2 workers", "B/robot", "B/box"
    );
    for case in CASES {
        if !filter.is_empty() && !filter.iter().any(|f| case.name.contains(f.as_str())) {
            continue;
        }
        let simulation = case.simulation(1);
        let (boxes, bodies) = simulation.heap_bytes();
        let map_boxes = simulation.world().map.cells().len();
        println!(
            "{:<18} {:>12.2} {:>10.1} {:>9.2}x {:>8.0} {:>8.2}",
            case.name,
            rate(&case) / 1e6,
            case.promised / 1e6,
            speed_up(&case, 2),
            bodies as f64 / f64::from(case.robots),
            boxes as f64 / map_boxes as f64,
        );
    }
}
