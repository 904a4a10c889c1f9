//! Speed of motions of chains.
//!
//! `cargo bench -p sidestep-rods [-- PART ...]` with the parts `open`, `middle`, `wavefront`,
//! `own`, `field`, `corridor`, and `corridors` for the table of all pinned corridors; CPU time. In brackets
//! the prototype's time.

use cpu_time::ProcessTime;
use sidestep_kernel::Seed;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_rods::geometry::{Point, add, add_scaled, norm, normalized, scaled, sub, unit_x};
use sidestep_rods::{
    Chain, Connector, MotionOutcome, MotionRequest, Obstacle, Obstacles, Propagator, Rod, wavefront,
};

/// Numbers in [0, 1), always the same.
struct Numbers {
    streams: Streams,
    next: u64,
}

impl Numbers {
    fn new(seed: u64) -> Self {
        Self { streams: Streams::new(Seed(seed)), next: 0 }
    }

    fn point(&mut self, half_m: f64) -> Point<3> {
        self.next += 1;
        let words = self.streams.block(0, self.next, Purpose(1), 0);
        [0, 1, 2].map(|i| half_m * (f64::from(words[i]) / 2_147_483_648.0 - 1.0))
    }
}

/// CPU seconds of the best of `n` repeats.
fn best_s(n: usize, mut work: impl FnMut()) -> f64 {
    let mut once = || {
        let started = ProcessTime::now();
        work();
        started.elapsed().as_secs_f64()
    };
    (0..n).map(|_| once()).fold(f64::INFINITY, f64::min)
}

const SIZES: [(usize, usize, f64, f64); 3] =
    [(450, 2000, 8.7, 1.75), (10_000, 100, 191.0, 38.5), (1_000_000, 2, 18_900.0, 3_800.0)];

/// A slightly bent chain, so that every connector moves at every step: a bend lets through only
/// its cosine, so the longer the chain the less it is bent.
fn snake(n: usize) -> Chain<3> {
    let mut points = vec![[0.0; 3]];
    let bent = 90.0 / n as f64;
    for i in 1..n {
        let u = [-1.0, bent * sin(i as f64 * 0.1), bent * cos(i as f64 * 0.07)];
        points.push(add_scaled(points[i - 1], normalized(u).expect("not zero"), 0.1));
    }
    let rod = Rod::with_fixed_length(0.1, 0.01);
    Chain::new(points, vec![Connector::free(0.02); n], vec![rod; n - 1]).expect("right")
}

fn head(k: usize) -> Point<3> {
    let t = k as f64 * 0.01;
    [t, 0.3 * sin(t), 0.3 * cos(t) - 0.3]
}

fn open() {
    for (n, motions, before_us, _) in SIZES {
        pull_open(&OpenCase { name: "open", n, by: 0, motions, before_us }, |_, k| head(k));
    }
}

/// The same led by a connector in the middle: both sweeps in one loop.
fn middle() {
    for ((n, motions, ..), before_us) in SIZES.into_iter().zip([4.5, 100.0, 10_100.0]) {
        pull_open(&OpenCase { name: "middle", n, by: n / 2, motions, before_us }, |home, k| {
            let t = k as f64 * 0.05;
            add(home, [0.05 * sin(t), 0.3 * sin(0.7 * t), 0.3 * cos(t)])
        });
    }
}

/// A chain in an open field.
struct OpenCase {
    name: &'static str,
    /// Number of connectors.
    n: usize,
    /// The connector that leads.
    by: usize,
    /// Number of motions to measure.
    motions: usize,
    /// Microseconds per motion of an earlier version.
    before_us: f64,
}

/// Measures motions to `to(home of the leader, number of the motion)`.
fn pull_open(case: &OpenCase, to: impl Fn(Point<3>, usize) -> Point<3>) {
    let &OpenCase { name, n, by, motions, before_us } = case;
    let mut chain = snake(n);
    let home = chain.points()[by];
    let mut propagator = Propagator::default();
    let nothing = Obstacles::default();
    let mut k = 0;
    let mut touched = 0;
    let s = best_s(7, || {
        for _ in 0..motions {
            k += 1;
            let request = MotionRequest::from_operator(by, to(home, k));
            let outcome = propagator.propagate(&mut chain, &nothing, &request).expect("right");
            touched += outcome.motion().map_or(0, |moved| moved.touched.len());
        }
    });
    let (us, touched) = (1e6 * s / motions as f64, touched as f64 / k as f64);
    println!(
        "{name}, {n} connectors: {us:.2} us per motion, {:.1} ns for each of the {:.0} % that move [{before_us} us]",
        1e3 * us / touched,
        100.0 * touched / n as f64
    );
}

/// The same chain with its own parts as obstacles, beside the time without that: alone, and with a ball
/// far away, where every motion looks at all parts that it comes near.
fn own() {
    for (n, motions) in [(450, 2000), (10_000, 100), (100_000, 10)] {
        for far in [false, true] {
            let [without_us, with_us] =
                [false, true].map(|self_collision| pull_beside(n, motions, self_collision, far));
            println!(
                "own body, {n} connectors, {}: {with_us:.1} us per motion, {:.2} times as without (bar: 3)",
                if far { "a ball far away" } else { "alone" },
                with_us / without_us,
            );
        }
    }
}

/// Straight chains of long and of short rods, whose parts are near each other at all times; and the exponent with which
/// their time grows.
fn straight() {
    for rod_m in [0.05, 0.1] {
        let mut times_us = [0.0; 2];
        for (k, (n, motions)) in [(10_000, 100), (100_000, 10)].into_iter().enumerate() {
            let [without_us, with_us] = [false, true]
                .map(|self_collision| pull_straight(n, rod_m, motions, self_collision));
            times_us[k] = with_us;
            println!(
                "own body, {n} connectors in a line, rods of {rod_m} m: {with_us:.1} us per motion, {:.2} times as without (bar: 3)",
                with_us / without_us,
            );
        }
        let exponent = (times_us[1] / times_us[0]).log10();
        println!("own body, rods of {rod_m} m: time grows with exponent {exponent:.3} (bar: 1.05)");
    }
}

/// Microseconds per motion of a straight chain whose head is led along a wave.
fn pull_straight(n: usize, rod_m: f64, motions: usize, self_collision: bool) -> f64 {
    let rod = Rod::with_fixed_length(rod_m, 0.008);
    let back = scaled(unit_x(), -1.0);
    let chain = Chain::straight([0.0; 3], back, n - 1, rod, Connector::free(0.02)).expect("right");
    pull_head(chain, &Obstacles::default(), motions, self_collision, |k| {
        let ahead_m = 0.01 * k as f64;
        [ahead_m, 0.05 * sin(ahead_m), 0.05 * (1.0 - cos(ahead_m))]
    })
}

/// Microseconds per motion of a snake, alone or with a ball far away.
fn pull_beside(n: usize, motions: usize, self_collision: bool, far: bool) -> f64 {
    let balls = if far { vec![Obstacle::ball(1, [0.0, 0.0, 1e4], 0.5)] } else { Vec::new() };
    let obstacles = Obstacles::new(balls, 0.15).expect("right");
    pull_head(snake(n), &obstacles, motions, self_collision, head)
}

/// Microseconds per motion of a chain whose head is led to `to(number of the motion)`, where nothing is in the way.
fn pull_head(
    mut chain: Chain<3>,
    obstacles: &Obstacles<3>,
    motions: usize,
    self_collision: bool,
    to: impl Fn(usize) -> Point<3>,
) -> f64 {
    let mut propagator = Propagator::default();
    propagator.rules.self_collision = self_collision;
    let mut k = 0;
    let s = best_s(7, || {
        for _ in 0..motions {
            k += 1;
            let request = MotionRequest::from_operator(0, to(k));
            let outcome = propagator.propagate(&mut chain, obstacles, &request).expect("right");
            assert!(outcome.motion().is_some(), "nothing is in the way");
        }
    });
    1e6 * s / motions as f64
}

fn lanes() {
    for (n, motions, _, us_before) in SIZES {
        let mut chain = snake(n);
        let motions = motions.max(wavefront::LANES);
        let mut k = 0;
        let s = best_s(7, || {
            let heads: Vec<_> = (0..motions).map(|i| head(k + i + 1)).collect();
            k += motions;
            wavefront::pull_first(&mut chain, &heads).expect("right");
        });
        let us = 1e6 * s / motions as f64;
        println!(
            "wavefront, {n} connectors: {us:.2} us per motion, {:.1} ns each [{us_before} us]",
            1e3 * us / n as f64
        );
    }
}

/// 450 agents, rods of 0.1 m, in a field of balls that fills 30 % of a cube.
fn field() {
    let (n, half_m, radius_m) = (450, 6.0, 0.5);
    let mut numbers = Numbers::new(1);
    let count = (0.30 * 8.0 * half_m * half_m * half_m
        / (4.188_79 * radius_m * radius_m * radius_m)) as u32;
    let balls: Vec<_> = (0..count)
        .map(|id| (id, numbers.point(half_m)))
        // The chain starts straight along the first axis, from the origin backward.
        .filter(|(_, c)| c[0] > 0.6 || c[1] * c[1] + c[2] * c[2] > 0.6 * 0.6)
        .map(|(id, c)| Obstacle::ball(id, c, radius_m))
        .collect();
    let rod = Rod::with_fixed_length(0.1, 0.02);
    let obstacles = Obstacles::new(balls, 0.14).expect("right");
    let back = scaled(unit_x(), -1.0);
    let mut chain =
        Chain::straight([0.0; 3], back, n - 1, rod, Connector::free(0.03)).expect("right");
    let mut propagator = Propagator::default();
    propagator.rules.step_m = Some(0.01);
    let mut u = unit_x();
    let (mut vetoes, mut own_vetoes, mut moves, mut rotated, mut touched) = (0, 0, 0, 0, 0);
    let started = ProcessTime::now();
    while moves < 4000 {
        u = normalized(add(u, numbers.point(0.2))).expect("not zero");
        let from = chain.points()[0];
        // Near the border it heads home.
        let inward = if from.iter().any(|x| x.abs() > half_m - 1.0) { -0.1 } else { 0.0 };
        u = normalized(add_scaled(u, from, inward)).expect("not zero");
        let request = MotionRequest::from_operator(0, add_scaled(from, u, 0.0099));
        match propagator.propagate(&mut chain, &obstacles, &request).expect("right") {
            MotionOutcome::Moved(moved) => {
                moves += 1;
                rotated += moved.rotated;
                touched += moved.changed;
            }
            MotionOutcome::Vetoed(veto) => {
                own_vetoes += usize::from(veto.by == 0);
                vetoes += usize::from(veto.by != 0);
                u = normalized(numbers.point(1.0)).expect("not zero");
            }
        }
    }
    let us = 1e6 * started.elapsed().as_secs_f64() / moves as f64;
    let clearance_m = clearance_m(&chain, &obstacles);
    println!(
        "field 30 %, {n} connectors: {us:.1} us per step, {:.0} ns each, {:.2} turns, {} moved of each; {vetoes} vetoes of slaves, {own_vetoes} of the head, clearance {clearance_m:.1e} m [105 us; goal 40]",
        1e3 * us / n as f64,
        rotated as f64 / moves as f64,
        touched / moves,
    );
}

fn clearance_m<const D: usize>(chain: &Chain<D>, obstacles: &Obstacles<D>) -> f64 {
    let p = chain.points();
    let tip = |i: usize| obstacles.clearance_m([p[i]; 2], chain.connectors()[i].radius_m, 1.0);
    let rod = |i: usize| obstacles.clearance_m([p[i], p[i + 1]], chain.rods()[i].radius_m, 1.0);
    let tips = (0..p.len()).map(tip).fold(1.0, f64::min);
    (0..p.len() - 1).map(rod).fold(tips, f64::min)
}

/// The center line of the pinned corridor: radius and degrees of a bend,
/// or 0 and meters.
const CORRIDOR: [(f64, f64); 9] = [
    (0.0, 14.0),
    (2.0, 90.0),
    (1.5, -90.0),
    (1.6, 180.0),
    (1.3, 60.0),
    (1.3, -120.0),
    (1.3, 60.0),
    (2.0, -180.0),
    (0.0, 8.0),
];

fn corridor_line(step_m: f64) -> Vec<(Point<2>, f64)> {
    let mut line = vec![([0.0, 0.0], 0.0)];
    for (radius_m, amount) in CORRIDOR {
        let turn_rad = if radius_m == 0.0 { 0.0 } else { f64::to_radians(amount) };
        let length_m = if radius_m == 0.0 { amount } else { radius_m * turn_rad.abs() };
        let n = (length_m / step_m).ceil();
        for _ in 0..n as usize {
            let ([x, y], heading): (Point<2>, f64) = line[line.len() - 1];
            let middle = heading + 0.5 * turn_rad / n;
            let at = [x + length_m / n * cos(middle), y + length_m / n * sin(middle)];
            line.push((at, heading + turn_rad / n));
        }
    }
    line
}

fn corridor_walls(width_m: f64) -> Vec<Obstacle<2>> {
    let line = corridor_line(0.16);
    let beside = |k: usize, by_m: f64| {
        let ([x, y], heading) = line[k];
        [x - by_m * sin(heading), y + by_m * cos(heading)]
    };
    let wall = |k: usize, by_m: f64| {
        Obstacle::capsule(k as u32, [beside(k, by_m), beside(k + 1, by_m)], 0.0)
    };
    let walls = |by_m: f64| (0..line.len() - 1).map(move |k| (k, by_m));
    walls(-0.5 * width_m).chain(walls(0.5 * width_m)).map(|(k, by_m)| wall(k, by_m)).collect()
}

/// Result of pulling a convoy through the corridor.
struct Pulled {
    us_per_step: f64,
    turns_per_step: f64,
    vetoes: usize,
    /// The longest way of a slave in one step, in steps of the leader.
    longest_slave_steps: f64,
    /// The least clearance after any step, where asked for; otherwise after the last.
    clearance_m: f64,
}

/// The leader's start: in the first, straight part. The tail may still be outside.
const LEAD_M: f64 = 13.0;

fn pull(width_m: f64, followers: usize, rod: Rod, look_at_every_step: bool) -> Pulled {
    let obstacles = Obstacles::new(corridor_walls(width_m), rod.max_m + 0.5).expect("right");
    let robot = Connector::free(0.25);
    let mut chain =
        Chain::straight([LEAD_M, 0.0], [-1.0, 0.0], followers, rod, robot).expect("right");
    let mut propagator = Propagator::default();
    let line = corridor_line(0.01);
    let is_ahead = |at: &Point<2>| at[0] > LEAD_M || at[1] != 0.0;
    let (mut steps, mut turns, mut vetoes) = (0, 0, 0);
    let (mut longest_slave_steps, mut least_m) = (0.0f64, 1.0f64);
    let started = ProcessTime::now();
    for (at, _) in line[..line.len() - 100].iter().filter(|(at, _)| is_ahead(at)) {
        let way_m = norm(sub(*at, chain.points()[0]));
        let request = MotionRequest::from_operator(0, *at);
        let outcome = propagator.propagate(&mut chain, &obstacles, &request).expect("right");
        steps += 1;
        match outcome {
            MotionOutcome::Moved(moved) => {
                turns += moved.rotated;
                longest_slave_steps = longest_slave_steps.max(moved.max_slave_step_m / way_m);
            }
            MotionOutcome::Vetoed(_) => vetoes += 1,
        }
        if look_at_every_step {
            least_m = least_m.min(clearance_m(&chain, &obstacles));
        }
    }
    Pulled {
        us_per_step: 1e6 * started.elapsed().as_secs_f64() / f64::from(steps),
        turns_per_step: turns as f64 / f64::from(steps),
        vetoes,
        longest_slave_steps,
        clearance_m: least_m.min(clearance_m(&chain, &obstacles)),
    }
}

fn corridor() {
    for width_m in [1.2, 1.6, 2.0, 3.0] {
        let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
        let run = pull(width_m, 15, rod, false);
        println!(
            "corridor {width_m} m, 16 agents: {:.2} us per step, {:.1} turns, {} vetoes, clearance at the end {:.1e} m [87 us; goal 10]",
            run.us_per_step, run.turns_per_step, run.vetoes, run.clearance_m,
        );
    }
}

/// Every width with every rod: vetoes, clearance, jumps. Rods of 1.5 m as thick as the robots
/// cannot go around the narrowest bend of the narrowest corridor; that veto is right.
fn corridors() {
    println!(
        "width m | rods m    | radius m | followers | vetoes | clearance m | slave step / leader step | turns per step"
    );
    for width_m in [1.2, 1.6, 2.0, 2.5, 3.0] {
        for (min_m, max_m) in [(0.6, 0.8), (1.0, 1.0), (1.5, 1.5)] {
            for (radius_m, followers) in [(0.05, 15), (0.05, 40), (0.25, 15), (0.25, 40)] {
                let run = pull(width_m, followers, Rod { min_m, max_m, radius_m }, true);
                println!(
                    "{width_m:7} | {min_m:.1}..{max_m:.1}  | {radius_m:8} | {followers:9} | {:6} | {:11.1e} | {:24.2} | {:.2}",
                    run.vetoes, run.clearance_m, run.longest_slave_steps, run.turns_per_step,
                );
            }
        }
    }
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let parts: [(&str, fn()); 8] = [
        ("open", open),
        ("middle", middle),
        ("wavefront", lanes),
        ("own", own),
        ("straight", straight),
        ("field", field),
        ("corridor", corridor),
        ("corridors", corridors),
    ];
    for (name, part) in parts {
        if asked.is_empty() || asked.iter().any(|a| a == name) {
            part();
        }
    }
}
