//! Sixteen robots in a chain on open ground, among discs that move.
//!
//! `cargo bench -p sidestep-chain [-- RUNS [through|apart]]` prints, for numbers and
//! speeds of discs, for reactions and for limits of the robots' speed, how often a part of the
//! chain is more than 1 mm in a disc after it has reacted.

use sidestep_chain::{
    EscapeMethod, EscapePlan, ObstacleEscapeInput, ObstacleEscapeRules, ObstacleEscaper,
};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{InputError, Seed, math};
use sidestep_rods::geometry::{Aabb, Point, add_scaled, distance, dot, normalized, scaled, sub};
use sidestep_rods::{
    Chain, Connector, MotionOutcome, MotionRequest, Obstacle, Obstacles, Propagator, ReactionRules,
    Rod,
};
use std::f64::consts::TAU;

const DT_S: f64 = 0.02;
const ROBOT_M: f64 = 0.25;
const ROD_M: f64 = 0.05;
const TICKS: usize = 4000;
const ROBOTS: usize = 16;
const LEADER_M_S: f64 = 0.5;
/// Half the side in m of the square in which the discs stay.
const HALF_M: f64 = 10.0;
/// Gap in m between discs that keep apart, wide enough for a robot.
const MIN_GAP_M: f64 = 0.7;
const PENETRATION_M: f64 = 1e-3;

/// Random numbers in [0, 1), by (seed, index).
struct RandomNumbers {
    streams: Streams,
    next: u64,
}

impl RandomNumbers {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.next += 1;
        let word = self.streams.block(0, self.next, Purpose(1), 0)[0];
        low + (high - low) * f64::from(word) / 4_294_967_296.0
    }

    fn direction(&mut self) -> Point<2> {
        toward(self.within(0.0, TAU))
    }
}

fn toward(heading_rad: f64) -> Point<2> {
    [math::cos(heading_rad), math::sin(heading_rad)]
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Reaction {
    None,
    /// Escape, with this many ticks of look-ahead.
    Escape(f64),
}

/// One cell of the table.
#[derive(Debug, Clone, Copy)]
struct Cell {
    discs: u32,
    disc_m_s: f64,
    leader_moves: bool,
    /// Whether the discs turn back from each other; otherwise they pass through each other.
    keep_apart: bool,
    reaction: Reaction,
    limit_m_s: f64,
}

/// The results of a cell's runs.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    ticks: usize,
    /// Ticks in which a robot was in a disc, and ticks in which any part (robot or rod) was.
    robots_in: usize,
    parts_in: usize,
    deepest_m: f64,
    steps: usize,
    vetoes: usize,
    capped: usize,
    fastest_m_s: f64,
    /// Number of times that a part entered a disc, and how many of these had another disc less than
    /// a robot away from that one, and near the chain too.
    episodes: usize,
    squeezed: usize,
    is_in: bool,
}

fn chain() -> Result<Chain<2>, InputError> {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: ROD_M };
    let half_m = 0.5 * rod.max_m * (ROBOTS - 1) as f64;
    Chain::straight([half_m, 0.0], [-1.0, 0.0], ROBOTS - 1, rod, Connector::free(ROBOT_M))
}

/// Returns discs anywhere but on the chain.
fn discs(cell: &Cell, chain: &Chain<2>, numbers: &mut RandomNumbers) -> Vec<Obstacle<2>> {
    let mut disc = |id: u32| loop {
        let center = [0; 2].map(|_| numbers.within(-HALF_M, HALF_M));
        let radius_m = numbers.within(0.2, 0.5);
        let velocity_m_s = scaled(numbers.direction(), cell.disc_m_s);
        let is_free = chain.points().iter().all(|p| distance(*p, center) > radius_m + 0.75);
        if is_free {
            return Obstacle { velocity_m_s, ..Obstacle::ball(id, center, radius_m) };
        }
    };
    (0..cell.discs).map(&mut disc).collect()
}

/// Turns back the discs that leave the square.
fn reflect(obstacles: &mut Obstacles<2>) {
    let mut discs = obstacles.moving().to_vec();
    for disc in &mut discs {
        let at = center(disc);
        for (i, middle_m) in at.into_iter().enumerate() {
            if middle_m.abs() > HALF_M && middle_m * disc.velocity_m_s[i] > 0.0 {
                disc.velocity_m_s[i] = -disc.velocity_m_s[i];
            }
        }
    }
    obstacles.replace_moving(&discs).expect("discs are finite");
}

/// Turns two discs away from each other if they come nearer than [`MIN_GAP_M`].
fn keep_apart(obstacles: &mut Obstacles<2>) {
    let mut discs = obstacles.moving().to_vec();
    for a in 0..discs.len() {
        for b in a + 1..discs.len() {
            let (from, to) = (center(&discs[a]), center(&discs[b]));
            let apart_m = distance(from, to) - discs[a].radius_m - discs[b].radius_m;
            let Some(u) = normalized(sub(to, from)) else { continue };
            let (va, vb) = (dot(discs[a].velocity_m_s, u), dot(discs[b].velocity_m_s, u));
            if apart_m < MIN_GAP_M && va > vb {
                // Each disc keeps its speed: the component toward the other is reversed.
                if va > 0.0 {
                    discs[a].velocity_m_s = add_scaled(discs[a].velocity_m_s, u, -2.0 * va);
                }
                if vb < 0.0 {
                    discs[b].velocity_m_s = add_scaled(discs[b].velocity_m_s, u, -2.0 * vb);
                }
            }
        }
    }
    obstacles.replace_moving(&discs).expect("discs are finite");
}

fn center(disc: &Obstacle<2>) -> Point<2> {
    let Aabb { lo, hi } = disc.bounds();
    [0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])]
}

/// A leader that wanders within the square.
struct Leader {
    heading_rad: f64,
}

impl Leader {
    fn target(&mut self, from: Point<2>, numbers: &mut RandomNumbers) -> Point<2> {
        self.heading_rad += numbers.within(-0.1, 0.1);
        if from.iter().any(|x| x.abs() > HALF_M - 1.0) {
            let home_rad = math::atan2(-from[1], -from[0]);
            self.heading_rad += 0.05 * math::wrap_angle(home_rad - self.heading_rad);
        }
        add_scaled(from, toward(self.heading_rad), LEADER_M_S * DT_S)
    }

    fn turn(&mut self, numbers: &mut RandomNumbers) {
        self.heading_rad += numbers.within(-1.5, 1.5);
    }
}

fn run(cell: &Cell, seed: u64, tally: &mut Tally) -> Result<(), InputError> {
    let mut numbers = RandomNumbers { streams: Streams::new(Seed(seed)), next: 0 };
    let mut chain = chain()?;
    let mut obstacles = Obstacles::new(discs(cell, &chain, &mut numbers), 1.0)?;
    let slave_step_max_m = cell.limit_m_s * DT_S;
    let mut propagator =
        Propagator::new(ReactionRules { slave_step_max_m, ..ReactionRules::default() });
    let ticks_ahead = match cell.reaction {
        Reaction::None => 0.0,
        Reaction::Escape(ticks) => ticks,
    };
    let usual = ObstacleEscapeRules::new(DT_S, cell.limit_m_s);
    let mut escaper = ObstacleEscaper::new(ObstacleEscapeRules {
        ticks_ahead,
        method: EscapeMethod::Literal,
        ..usual
    });
    let mut leader = Leader { heading_rad: 0.0 };
    for _ in 0..TICKS {
        let start = chain.points().to_vec();
        if cell.leader_moves {
            let to = leader.target(start[0], &mut numbers);
            let came = propagator.propagate(
                &mut chain,
                &obstacles,
                &MotionRequest::from_operator(0, to),
            )?;
            tally.steps += 1;
            if let MotionOutcome::Vetoed(_) = came {
                tally.vetoes += 1;
                leader.turn(&mut numbers);
            }
        }
        obstacles.advance(DT_S);
        reflect(&mut obstacles);
        if cell.keep_apart {
            keep_apart(&mut obstacles);
        }
        if cell.reaction != Reaction::None {
            let escaped = escaper.escape(
                ObstacleEscapeInput {
                    chain: &mut chain,
                    obstacles: &obstacles,
                    propagator: &mut propagator,
                    start: &start,
                },
                &mut EscapePlan::default(),
            )?;
            tally.capped += escaped.capped;
        }
        measure(&chain, &obstacles, &start, tally);
    }
    Ok(())
}

/// Returns the smallest distance of a disc's surface from robots and from rods, in m.
fn gaps_m(chain: &Chain<2>, disc: &Obstacle<2>) -> [f64; 2] {
    let points = chain.points();
    let robots = points.iter().map(|p| disc.core.nearest_to_point(*p).distance_m);
    let rods = points.windows(2).map(|ends| {
        let rod = [ends[0], ends[1]];
        disc.core.nearest_to_segment(rod).distance_m
    });
    [robots.fold(9.0, f64::min) - ROBOT_M, rods.fold(9.0, f64::min) - ROD_M]
        .map(|gap_m| gap_m - disc.radius_m)
}

fn measure(chain: &Chain<2>, obstacles: &Obstacles<2>, start: &[Point<2>], tally: &mut Tally) {
    let gaps: Vec<_> = obstacles.moving().iter().map(|disc| gaps_m(chain, disc)).collect();
    let gap_m = |k: usize| gaps[k][0].min(gaps[k][1]);
    let worst = (0..gaps.len()).min_by(|&a, &b| gap_m(a).total_cmp(&gap_m(b))).unwrap_or(0);
    let is_in = gap_m(worst) < -PENETRATION_M;
    tally.ticks += 1;
    tally.robots_in += usize::from(gaps.iter().any(|gaps| gaps[0] < -PENETRATION_M));
    tally.parts_in += usize::from(is_in);
    tally.deepest_m = tally.deepest_m.max(-gap_m(worst));
    if is_in && !tally.is_in {
        tally.episodes += 1;
        let disc = &obstacles.moving()[worst];
        let squeezes = |(k, other): (usize, &Obstacle<2>)| {
            let apart_m = distance(center(disc), center(other)) - disc.radius_m - other.radius_m;
            k != worst && apart_m < 2.0 * ROBOT_M && gap_m(k) < 0.1
        };
        tally.squeezed += usize::from(obstacles.moving().iter().enumerate().any(squeezes));
    }
    tally.is_in = is_in;
    let ways_m = start.iter().zip(chain.points()).map(|(s, p)| distance(*s, *p));
    tally.fastest_m_s = ways_m.fold(tally.fastest_m_s, |most, way_m| most.max(way_m / DT_S));
}

fn percent(part: usize, of: usize) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

/// Runs a cell and prints its row.
fn row(cell: &Cell, runs: u64) -> Result<(), InputError> {
    let mut tally = Tally::default();
    for seed in 1..=runs {
        run(cell, seed, &mut tally)?;
    }
    println!(
        "{:>2} {:>5.3} {:<5} {:<10} {:>5.2} | {:>7.3} {:>7.3} {:>6.1} {:>7.3} {:>6.2} {:>6} {:>4} {:>4}",
        cell.discs,
        cell.disc_m_s,
        if cell.leader_moves { "moves" } else { "rests" },
        match cell.reaction {
            Reaction::None => "none".to_string(),
            Reaction::Escape(ticks) => format!("ahead {ticks}"),
        },
        cell.limit_m_s,
        percent(tally.parts_in, tally.ticks),
        percent(tally.robots_in, tally.ticks),
        1e3 * tally.deepest_m,
        percent(tally.vetoes, tally.steps),
        tally.fastest_m_s,
        tally.capped,
        tally.episodes,
        tally.squeezed,
    );
    Ok(())
}

fn main() -> Result<(), InputError> {
    // Cargo adds an option of its own.
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let runs = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(6);
    let which = arguments.next();
    for keep_apart in [false, true] {
        if which.as_deref().is_some_and(|which| (which == "apart") != keep_apart) {
            continue;
        }
        println!(
            "\nDiscs {}. {runs} runs of {} s a row.",
            if keep_apart { "turn back 0.7 m before another" } else { "pass through each other" },
            TICKS as f64 * DT_S
        );
        println!("discs m/s, leader, reaction, limit m/s | % of ticks in a disc, robots alone,");
        println!("    deepest mm, leader's vetoes %, fastest m/s, times held back by the limit,");
        println!("    times a part got into a disc, of those between two discs");
        for (discs, times, leader_moves) in cells() {
            let disc_m_s = times * LEADER_M_S;
            for (reaction, limit_m_s) in reactions(disc_m_s) {
                let cell = Cell { discs, disc_m_s, leader_moves, keep_apart, reaction, limit_m_s };
                row(&cell, runs)?;
            }
        }
    }
    Ok(())
}

/// Returns the number of discs, their speed as a multiple of the leader's, and whether the leader
/// moves.
fn cells() -> impl Iterator<Item = (u32, f64, bool)> {
    [8, 16].into_iter().flat_map(|discs| {
        [0.25, 0.5, 1.0, 2.0, 4.0]
            .into_iter()
            .flat_map(move |times| [true, false].map(|moves| (discs, times, moves)))
    })
}

/// Returns reactions and limits of the robots' speed, the tightest last.
fn reactions(disc_m_s: f64) -> Vec<(Reaction, f64)> {
    let limits_m_s = [3.0, 2.0, 1.5].map(|times| f64::max(1.0, times * disc_m_s));
    let mut all = vec![
        (Reaction::None, f64::INFINITY),
        (Reaction::Escape(0.0), f64::INFINITY),
        (Reaction::Escape(2.0), f64::INFINITY),
        (Reaction::Escape(2.0), limits_m_s[0]),
    ];
    all.extend(limits_m_s.map(|limit_m_s| (Reaction::Escape(20.0), limit_m_s)));
    all.push((Reaction::Escape(20.0), 1.0));
    all.dedup();
    all
}
