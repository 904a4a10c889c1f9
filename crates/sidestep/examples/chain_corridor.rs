//! A swarm that passes narrow corridors and open fields, in numbers.
//!
//! `cargo run --release -p sidestep --example chain_corridor [-- PART ...]` with the parts
//! `leader` (alone in the corridor), `field` (discs and a target), `chain` (a leader and the
//! chain behind it), `wheels` (followers on real wheels) and `narrow` (1.0 m).

use sidestep::kernel::Seed;
use sidestep::kernel::stream::Streams;
use sidestep::rods::geometry::{Point, distance};
use sidestep::rods::{Obstacle, Obstacles, Rod};
use sidestep::worlds::chain::convoy::{Convoy, ConvoyConfig, ConvoyStats, ConvoySurroundings};
use sidestep::worlds::chain::ground::corridor::{Corridor, WALL_PIECE_M};
use sidestep::worlds::chain::swarm::drive::DifferentialDrive;
use sidestep::worlds::chain::swarm::laser::LASER_NOISE;
use sidestep::worlds::chain::swarm::leader::{LeaveRule, TurnMode};
use sidestep::worlds::chain::swarm::{Follower, Pose2, WallLossRule};
use std::error::Error;
use std::f64::consts::PI;

const SPEED_M_S: f64 = 0.5;
const WIDTHS_M: [f64; 8] = [1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.5, 3.0];
const READINGS: [WallLossRule; 3] =
    [WallLossRule::Latched, WallLossRule::Range, WallLossRule::Level];

type Measure = fn() -> Result<(), Box<dyn Error>>;

/// A scene and its finish.
struct Course {
    obstacles: Obstacles<2>,
    target: Option<Point<2>>,
    finish: Point<2>,
    finish_radius_m: f64,
    start: Pose2,
    limit_s: f64,
}

/// Returns thin walls on both sides of the middle. The start is 0.8 m from the right wall, or in
/// the middle if the corridor is too narrow for that, and the finish is 1 m before the end.
fn corridor(width_m: f64, start_m: f64) -> Result<Course, Box<dyn Error>> {
    let corridor = Corridor::pinned(width_m)?;
    let (line, walls) = (corridor.center_line(WALL_PIECE_M), corridor.walls(0));
    Ok(Course {
        obstacles: Obstacles::new(walls, 1.3)?,
        target: None,
        finish: line[line.len() - 7].at,
        finish_radius_m: 0.5 * width_m,
        start: Pose2 { at: [start_m, (0.8 - 0.5 * width_m).min(0.0)], heading_rad: 0.0 },
        limit_s: 400.0,
    })
}

/// Returns discs of 0.2 to 0.5 m anywhere in 20 m x 20 m, but at least 1.5 m away from start and
/// target, which are in opposite corners.
fn field(seed: u64, discs: u32) -> Result<Course, Box<dyn Error>> {
    let mut draws = Streams::new(Seed(seed)).draws(0, 0, LASER_NOISE);
    let (start, target) = ([-8.5, -8.5], [8.5, 8.5]);
    let mut all = Vec::new();
    while all.len() < discs as usize {
        let at = [20.0 * draws.uniform() - 10.0, 20.0 * draws.uniform() - 10.0];
        let radius_m = 0.2 + 0.3 * draws.uniform();
        if distance(at, start).min(distance(at, target)) > radius_m + 1.5 {
            all.push(Obstacle::ball(all.len() as u32, at, radius_m));
        }
    }
    Ok(Course {
        obstacles: Obstacles::new(all, 1.3)?,
        target: Some(target),
        finish: target,
        finish_radius_m: 0.5,
        start: Pose2 { at: start, heading_rad: 2.0 * PI * draws.uniform() },
        limit_s: 300.0,
    })
}

struct Run {
    arrived: bool,
    measures: ConvoyStats,
}

fn run(plan: &ConvoyConfig, course: &Course) -> Result<Run, Box<dyn Error>> {
    let (obstacles, target) = (course.obstacles.clone(), course.target);
    let around = ConvoySurroundings { obstacles, target, seed: 1 };
    let mut convoy = Convoy::new(plan.clone(), course.start, around)?;
    let mut measures = ConvoyStats::default();
    for _ in 0..(course.limit_s / plan.dt_s) as u64 {
        let tick = convoy.tick();
        measures.record(&convoy, &course.obstacles, &tick);
        if distance(convoy.leader().at, course.finish) <= course.finish_radius_m {
            return Ok(Run { arrived: true, measures });
        }
    }
    Ok(Run { arrived: false, measures })
}

fn yes(arrived: bool) -> &'static str {
    if arrived { "yes" } else { "NO" }
}

/// Measures a leader alone: every reading, sector and width.
fn leader() -> Result<(), Box<dyn Error>> {
    println!(
        "\n| sector | reading | arrived | least clearance m | mean speed m/s at 1.6 m | at 2 m |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut total = [0, 0];
    for sector in [[0.0, 90.0], [15.0, 90.0], [30.0, 90.0], [45.0, 90.0], [0.0, 60.0], [15.0, 60.0]]
    {
        for leaving in READINGS {
            let mut plan = ConvoyConfig::new(0, SPEED_M_S)?;
            plan.leader.leaving = leaving;
            plan.leader.sector_rad = sector.map(f64::to_radians);
            let runs = WIDTHS_M
                .map(|width_m| run(&plan, &corridor(width_m, 2.0)?))
                .into_iter()
                .collect::<Result<Vec<_>, _>>()?;
            let stuck: Vec<_> =
                runs.iter().zip(WIDTHS_M).filter(|(r, _)| !r.arrived).map(|(_, w)| w).collect();
            let arrived = runs.len() - stuck.len();
            total = [total[0] + arrived, total[1] + runs.len()];
            let least_m = runs.iter().map(|r| r.measures.leader_clearance_m).fold(1.0, f64::min);
            let vetoes: usize = runs.iter().map(|r| r.measures.vetoes).sum();
            let speed = |k: usize| {
                let m = &runs[k].measures;
                m.way_m / (m.ticks as f64 * plan.dt_s)
            };
            println!(
                "| {sector:?} | {leaving:?} | {arrived} of {} {stuck:?} | {least_m:.3} ({vetoes} vetoes) | {:.2} | {:.2} |",
                runs.len(),
                speed(2),
                speed(4)
            );
        }
    }
    println!("\n{} of {} arrived", total[0], total[1]);
    Ok(())
}

/// Measures a leader and a target in a field of discs, with 30 runs per cell.
fn fields() -> Result<(), Box<dyn Error>> {
    println!("\n| discs | reading | leave rule | arrived of 30 | runs with a veto | mean s |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for leave_rule in [Some(LeaveRule::default()), None] {
        for leaving in READINGS {
            for discs in [0, 10, 25, 40] {
                let mut plan = ConvoyConfig::new(0, SPEED_M_S)?;
                (plan.leader.leaving, plan.leader.leave_rule) = (leaving, leave_rule);
                let (mut arrived, mut touched, mut ticks) = (0, 0, 0);
                for seed in 0..30 {
                    let run = run(&plan, &field(seed, discs)?)?;
                    arrived += usize::from(run.arrived);
                    touched += usize::from(run.measures.vetoes > 0);
                    ticks += if run.arrived { run.measures.ticks } else { 0 };
                }
                let mean_s = ticks as f64 * plan.dt_s / arrived.max(1) as f64;
                let rule = yes(leave_rule.is_some());
                println!(
                    "| {discs} | {leaving:?} | {rule} | {arrived} | {touched} | {mean_s:.0} |"
                );
            }
        }
    }
    Ok(())
}

/// Measures a leader and followers that are exactly at their connectors.
fn chain() -> Result<(), Box<dyn Error>> {
    println!(
        "\n| width m | followers | rods m | arrived | vetoes | leader clearance m | connector clearance m | fastest connector, leader = 1 |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for width_m in [1.2, 1.6, 2.0, 2.5, 3.0] {
        for followers in [15, 40] {
            for (min_m, max_m) in [(0.6, 0.8), (1.0, 1.0)] {
                let mut plan = ConvoyConfig::new(followers, SPEED_M_S)?;
                plan.rod = Rod { min_m, max_m, radius_m: 0.05 };
                (plan.margin_m, plan.lag_limit_m) = (0.0, f64::INFINITY);
                let start_m = 0.3 + max_m * 15.0_f64.min(13.5 / max_m).floor();
                let Run { arrived, measures: m } = run(&plan, &corridor(width_m, start_m)?)?;
                println!(
                    "| {width_m} | {followers} | {min_m} to {max_m} | {} | {} | {:.3} | {:.1e} | {:.2} |",
                    yes(arrived),
                    m.vetoes,
                    m.leader_clearance_m,
                    m.connector_clearance_m,
                    m.fastest
                );
            }
        }
    }
    Ok(())
}

/// Measures followers on real wheels: margins and spare speed. Plain followers only stop before a
/// contact, and their leader does not wait for them; the others slide, and their leader waits.
fn wheels() -> Result<(), Box<dyn Error>> {
    println!(
        "\n| width m | margin m | wheels, leader = 1 | kind | arrived in s | vetoes | bumped % | held % | lag mean, max m | clearance m | pairs m |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for width_m in [1.2, 1.6, 2.0, 2.5, 3.0] {
        for margin_m in [0.0, 0.05, 0.08, 0.1] {
            for q in [1.0, 1.2, 1.5] {
                for (kind, slide_m, lag_limit_m) in [
                    ("plain", 0.0, f64::INFINITY),
                    ("waits", 0.0, 0.15),
                    ("slides, waits", 0.08, 0.15),
                ] {
                    let mut plan = ConvoyConfig::new(15, SPEED_M_S)?;
                    (plan.margin_m, plan.lag_limit_m) = (margin_m, lag_limit_m);
                    plan.follower =
                        Follower::new(DifferentialDrive::new(0.4, q * SPEED_M_S)?, 0.25)?;
                    plan.follower.slide_m = slide_m;
                    let run = run(&plan, &corridor(width_m, 12.3)?)?;
                    println!(
                        "| {width_m} | {margin_m} | {q} | {kind} | {}",
                        wheel_row(&plan, &run)
                    );
                }
            }
        }
    }
    Ok(())
}

fn wheel_row(plan: &ConvoyConfig, Run { arrived, measures: m }: &Run) -> String {
    let percent = |n: usize| 100.0 * n as f64 / (m.ticks * plan.followers) as f64;
    let time = if *arrived { format!("{:.0}", m.ticks as f64 * plan.dt_s) } else { "never".into() };
    format!(
        "{time} | {} | {:.2} | {:.2} | {:.3}, {:.3} | {:.3} | {:.2} to {:.2} |",
        m.vetoes,
        percent(m.bumped),
        percent(m.held),
        m.mean_lag_m(plan.followers),
        m.max_lag_m,
        m.follower_clearance_m,
        m.pairs_m[0],
        m.pairs_m[1]
    )
}

/// Measures a corridor without room to swing around.
fn narrow() -> Result<(), Box<dyn Error>> {
    println!(
        "\n| width m | turning | near, far m | arrived | vetoes | leader clearance m | seconds |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for width_m in [0.8, 0.9, 1.0, 1.1, 1.2] {
        for turning in [TurnMode::AboutAWheel, TurnMode::OnTheSpotWhereBlocked] {
            for (near_m, far_m) in [(0.7, 0.9), (0.45, 0.65)] {
                let mut plan = ConvoyConfig::new(0, SPEED_M_S)?;
                plan.leader.turning = turning;
                (plan.leader.near_m, plan.leader.far_m) = (near_m, far_m);
                let Run { arrived, measures: m } = run(&plan, &corridor(width_m, 2.0)?)?;
                println!(
                    "| {width_m} | {turning:?} | {near_m}, {far_m} | {} | {} | {:.3} | {:.0} |",
                    yes(arrived),
                    m.vetoes,
                    m.leader_clearance_m,
                    m.ticks as f64 * plan.dt_s
                );
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let parts: Vec<String> = std::env::args().skip(1).collect();
    let all: [(&str, Measure); 5] = [
        ("leader", leader),
        ("narrow", narrow),
        ("field", fields),
        ("chain", chain),
        ("wheels", wheels),
    ];
    for (_, measure) in
        all.iter().filter(|(part, _)| parts.is_empty() || parts.iter().any(|p| p == part))
    {
        measure()?;
    }
    Ok(())
}
