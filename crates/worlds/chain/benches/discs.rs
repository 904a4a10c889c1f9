//! How well a chain of sixteen robots keeps out of discs that move, beside a reference that knows and tries far more.
//!
//! `cargo bench -p sidestep-chain --bench discs [-- RUNS [DISCS]]` runs `scenarios/chain/movers.toml` with 8 and with 16
//! discs (or with DISCS), for the seeds 1 to RUNS, and prints the share of steps with a part in a disc. Each time inside
//! of more than 50 steps is given to the reference, from 2 s before: it moves all connectors at once, knows where all
//! discs will be, and tries 1,000 joint motions of 2 s in each cycle. It keeps the limit of speed and the lengths of
//! rods, and no two robots closer than they may be.

use sidestep_chain::ground::MovingObstacles;
use sidestep_chain::scenario::ChainScenario;
use sidestep_chain::{ChainRun, ChainWorld};
use sidestep_kernel::distr::normal;
use sidestep_kernel::math::cos;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};
use sidestep_rods::geometry::{Point, add_scaled, distance, norm, normalized, scaled, sub, unit_x};
use sidestep_rods::{Chain, Obstacle};
use sidestep_scenario::Source;
use std::collections::VecDeque;
use std::f64::consts::PI;
use std::path::Path;

/// Steps inside from which on a time inside is long.
const LONG: usize = 50;
/// Steps before it at which the reference begins, and those that it makes.
const BEFORE: usize = 100;
const REFERENCE_STEPS: usize = 300;
/// Motions that the reference tries in a step, the steps of a motion, and the time of one, s.
const SAMPLES: usize = 1000;
const HORIZON_STEPS: usize = 20;
const SAMPLE_STEP_S: f64 = 0.1;
/// Greatest speed of a connector in the scenario, m/s.
const SPEED_M_S: f64 = 1.0;
/// Depth that counts as inside, meters.
const INSIDE_M: f64 = 1e-6;
/// Passes over all rods by which lengths are restored: in samples, and in what the reference does.
const PASSES: usize = 6;
const LAST_PASSES: usize = 200;

/// A long time inside a disc.
struct Episode {
    /// The cycle of the run at which the reference begins.
    cycle: u64,
    steps: usize,
    points: Vec<Point<2>>,
}

/// The share of steps inside of a run, and its long episodes.
struct Outcome {
    inside: u64,
    steps: u64,
    longest: usize,
    deepest_m: f64,
    episodes: Vec<Episode>,
}

fn start(discs: usize, seed: u64) -> ChainRun<2> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/chain/movers.toml");
    let overrides = [format!("seed={seed}"), format!("fields.0.n={discs}")];
    let source = Source::read(Path::new(path), &overrides).expect("a shipped scenario");
    ChainScenario::<2>::new(&source).expect("a valid scenario").start(&source, 1)
}

fn run(run: &mut ChainRun<2>) -> Outcome {
    let mut past: VecDeque<Vec<Point<2>>> = VecDeque::new();
    let mut inside = 0;
    let mut episodes = Vec::new();
    while run.cycle() < run.config().cycles {
        past.push_back(run.state().body(0).chain.points().to_vec());
        if past.len() > 1000 {
            past.pop_front();
        }
        run.advance(1);
        if run.state().body(0).tally.inside_steps > 0 {
            inside += 1;
            continue;
        }
        if inside > LONG {
            let back = past.len().saturating_sub(inside + 1 + BEFORE);
            let cycle = run.cycle() - (past.len() - back) as u64;
            episodes.push(Episode { cycle, steps: inside, points: past[back].clone() });
        }
        inside = 0;
    }
    let state = run.state();
    let body = state.body(0);
    let tally = &body.tally;
    Outcome {
        inside: tally.penetrations,
        steps: tally.steps,
        longest: tally.longest_inside_steps as usize,
        deepest_m: (-tally.min_clearance_m).max(0.0),
        episodes,
    }
}

/// A joint motion of all connectors: smooth along the chain, with one change on the way.
#[derive(Clone)]
struct JointMotion {
    /// Velocities of the connectors before the change and after it, m/s.
    legs: [Vec<Point<2>>; 2],
    /// The step of the change.
    turns_at: usize,
}

impl JointMotion {
    fn rest(connectors: usize) -> Self {
        let still = vec![[0.0; 2]; connectors];
        Self { legs: [still.clone(), still], turns_at: 0 }
    }

    /// Draws a motion: waves along the chain, the shorter the weaker, at the limit of speed.
    fn draw(connectors: usize, draws: &mut Draws) -> Self {
        let legs = [0, 1].map(|_| {
            let waves: [Point<2>; 5] = std::array::from_fn(|m| {
                let size = 1.0 / (1.0 + m as f64);
                [size * normal(draws), size * normal(draws)]
            });
            let velocity = |k: usize| {
                let along = PI * k as f64 / (connectors - 1) as f64;
                let waves = waves.iter().enumerate();
                waves.fold([0.0; 2], |sum, (m, by)| add_scaled(sum, *by, cos(m as f64 * along)))
            };
            (0..connectors).map(velocity).map(limited).collect()
        });
        Self { legs, turns_at: draws.uniform_below(HORIZON_STEPS as u32) as usize }
    }

    fn velocities(&self, step: usize) -> &[Point<2>] {
        &self.legs[usize::from(step >= self.turns_at)]
    }

    /// Returns what is left of the motion a tenth of a sampled step or so later.
    fn continued(&self, by: usize) -> Self {
        Self { turns_at: self.turns_at.saturating_sub(by), ..self.clone() }
    }
}

/// Returns a velocity within the limit.
fn limited(velocity_m_s: Point<2>) -> Point<2> {
    let speed_m_s = norm(velocity_m_s);
    if speed_m_s > SPEED_M_S { scaled(velocity_m_s, SPEED_M_S / speed_m_s) } else { velocity_m_s }
}

/// The chain's sizes, which all postures keep.
struct Reference<'a> {
    chain: &'a Chain<2>,
    movers: &'a MovingObstacles<2>,
    dt_s: f64,
}

impl Reference<'_> {
    /// Brings rods back within their limits, nearly or well, and robots apart.
    fn restore(&self, points: &mut [Point<2>], passes: usize) {
        for _ in 0..passes {
            for k in 0..points.len() {
                if k + 1 < points.len() {
                    let rod = self.chain.rods()[k];
                    separate(points, [k, k + 1], [rod.min_m, rod.max_m]);
                }
                for other in k + 2..points.len() {
                    let radius_m = self.chain.connectors()[k].radius_m;
                    separate(points, [k, other], [2.0 * radius_m, f64::INFINITY]);
                }
            }
        }
    }

    /// Returns the depth of the chain in the discs, meters; 0 outside.
    fn depth_m(&self, points: &[Point<2>], discs: &[Obstacle<2>]) -> f64 {
        let mut depth_m = 0.0_f64;
        for disc in discs {
            for (k, point) in points.iter().enumerate() {
                let gap_m = disc.core.nearest_to_point(*point).distance_m - disc.radius_m;
                depth_m = depth_m.max(self.chain.connectors()[k].radius_m - gap_m);
                if k + 1 < points.len() {
                    let rod = [*point, points[k + 1]];
                    let gap_m = disc.core.nearest_to_segment(rod).distance_m - disc.radius_m;
                    depth_m = depth_m.max(self.chain.rods()[k].radius_m - gap_m);
                }
            }
        }
        depth_m
    }

    /// Returns the cost of a motion: seconds inside, with a surcharge for depth. It ends at `enough`.
    fn cost(
        &self,
        from: &[Point<2>],
        motion: &JointMotion,
        discs: &[Vec<Obstacle<2>>],
        enough: f64,
    ) -> f64 {
        let mut points = from.to_vec();
        let mut cost = 0.0;
        for (step, discs) in discs.iter().enumerate() {
            for (point, by) in points.iter_mut().zip(motion.velocities(step)) {
                *point = add_scaled(*point, *by, SAMPLE_STEP_S);
            }
            self.restore(&mut points, PASSES);
            let depth_m = self.depth_m(&points, discs);
            if depth_m > INSIDE_M {
                cost += SAMPLE_STEP_S * (1.0 + 0.2 * depth_m);
            }
            if cost >= enough {
                break;
            }
        }
        cost
    }

    /// Returns the longest time inside from an episode's start on, in steps.
    fn longest_inside(&self, episode: &Episode, seed: u64) -> usize {
        let streams = Streams::new(Seed(seed));
        let mut points = episode.points.clone();
        let mut best = JointMotion::rest(points.len());
        let mut inside = 0;
        let mut longest = 0;
        for step in 0..REFERENCE_STEPS as u64 {
            let cycle = episode.cycle + step;
            let time_s = cycle as f64 * self.dt_s;
            let discs: Vec<Vec<Obstacle<2>>> = (1..=HORIZON_STEPS)
                .map(|k| self.movers.at(time_s + k as f64 * SAMPLE_STEP_S).collect())
                .collect();
            let mut draws = streams.draws(0, cycle, Purpose(1));
            let is_sampled_step = (step as f64 * self.dt_s / SAMPLE_STEP_S).fract() < 1e-9;
            let continued = best.continued(usize::from(is_sampled_step && step > 0));
            let mut least = self.cost(&points, &continued, &discs, f64::INFINITY);
            best = continued;
            let rest = JointMotion::rest(points.len());
            let others = (1..SAMPLES).map(|_| JointMotion::draw(points.len(), &mut draws));
            for motion in std::iter::once(rest).chain(others) {
                if least == 0.0 {
                    break;
                }
                let cost = self.cost(&points, &motion, &discs, least);
                if cost < least {
                    least = cost;
                    best = motion;
                }
            }
            self.advance(&mut points, best.velocities(0));
            let discs: Vec<_> = self.movers.at(time_s + self.dt_s).collect();
            inside = if self.depth_m(&points, &discs) > INSIDE_M { inside + 1 } else { 0 };
            longest = longest.max(inside);
        }
        longest
    }

    /// Moves all connectors by a cycle, each no farther than it may go.
    fn advance(&self, points: &mut [Point<2>], velocities: &[Point<2>]) {
        let before = points.to_vec();
        let most_m = SPEED_M_S * self.dt_s;
        // Room for the lengths of rods, which are restored last.
        for (point, by) in points.iter_mut().zip(velocities) {
            *point = add_scaled(*point, *by, 0.9 * self.dt_s);
        }
        for _ in 0..8 {
            self.restore(points, LAST_PASSES / 8);
            for (point, was) in points.iter_mut().zip(&before) {
                let by = sub(*point, *was);
                let way_m = norm(by);
                if way_m > most_m {
                    *point = add_scaled(*was, by, most_m / way_m);
                }
            }
        }
    }
}

/// Moves two points along their line until their distance is within limits.
fn separate(points: &mut [Point<2>], [a, b]: [usize; 2], [min_m, max_m]: [f64; 2]) {
    let apart_m = distance(points[a], points[b]);
    let wanted_m = apart_m.clamp(min_m, max_m);
    if wanted_m != apart_m {
        let along = normalized(sub(points[b], points[a])).unwrap_or(unit_x());
        let by_m = 0.5 * (wanted_m - apart_m);
        points[a] = add_scaled(points[a], along, -by_m);
        points[b] = add_scaled(points[b], along, by_m);
    }
}

/// Runs all seeds with so many discs, and prints what came out.
fn print_discs(discs: usize, runs: u64) {
    println!("{discs} discs\nseed | % of steps inside, longest in a row, deepest m");
    let mut inside = 0;
    let mut steps = 0;
    for seed in 1..=runs {
        let mut started = start(discs, seed);
        let outcome = run(&mut started);
        inside += outcome.inside;
        steps += outcome.steps;
        let percent = 100.0 * outcome.inside as f64 / outcome.steps as f64;
        println!("{seed:>4} | {percent:>6.3} {:>4} {:>6.3}", outcome.longest, outcome.deepest_m);
        let world: &ChainWorld<2> = started.world();
        for episode in &outcome.episodes {
            let state = started.state();
            let body = state.body(0);
            let reference =
                Reference { chain: &body.chain, movers: &world.movers, dt_s: world.dt_s };
            let longest = reference.longest_inside(episode, seed);
            println!(
                "       {} steps inside 2 s after cycle {}; the reference {longest}",
                episode.steps, episode.cycle
            );
        }
    }
    println!("all | {:.3} % of steps inside", 100.0 * inside as f64 / steps as f64);
}

fn main() {
    // Cargo adds an option of its own.
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let runs = arguments.next().map_or(12, |n| n.parse().expect("RUNS is a number"));
    let only: Option<usize> = arguments.next().map(|n| n.parse().expect("DISCS is a number"));
    for discs in [8, 16] {
        if only.is_none_or(|only| only == discs) {
            print_discs(discs, runs);
        }
    }
}
