//! Speed and success of inverse kinematics.
//!
//! `cargo bench -p sidestep --bench ik [-- PART ...]` with the parts `free` (the default),
//! `guarded` and `arms`; CPU time. The yardstick is the FABRIK of the crate `rebirth-ik`, in single
//! precision, on the same chains and targets in the same run.

use cpu_time::ProcessTime;
use sidestep::worlds::chain::geometry::{Point, add, along, distance, first_axis, scaled, unit};
use sidestep::worlds::chain::ik::{Engine, Goal, Solver};
use sidestep::worlds::chain::{Chain, Connector, Obstacles, Rod};
use sidestep_kernel::Seed;
use sidestep_kernel::distr::normal;
use sidestep_kernel::math::powf;
use sidestep_kernel::stream::{Draws, Purpose, Streams};

fn draws(index: u64) -> Draws {
    Streams::new(Seed(7)).draws(0, index, Purpose(1))
}

fn direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    unit(std::array::from_fn(|_| normal(draws))).expect("not zero")
}

/// A random walk of rods of 1 m whose directions wander by `spread`.
fn walk<const D: usize>(n: usize, spread: f64, draws: &mut Draws) -> Vec<Point<D>> {
    let mut u = direction(draws);
    let mut points = vec![[0.0; D]];
    for i in 0..n {
        points.push(along(points[i], u, 1.0));
        u = unit(along(u, direction(draws), spread)).expect("not zero");
    }
    points
}

fn chain_of<const D: usize>(points: Vec<Point<D>>) -> Chain<D> {
    let n = points.len();
    let rods = vec![Rod::fixed(1.0, 0.0); n - 1];
    Chain::new(points, vec![Connector::free(0.0); n], rods).expect("right")
}

/// Uniform in the ball of `radius_m`.
fn in_ball<const D: usize>(radius_m: f64, draws: &mut Draws) -> Point<D> {
    scaled(direction(draws), radius_m * powf(draws.uniform(), 1.0 / D as f64))
}

/// Success in percent, median steps, median CPU us.
struct Row {
    success: f64,
    steps: usize,
    us: f64,
}

const TARGETS: usize = 300;

fn measure<const D: usize>(chain: &Chain<D>, targets: &[Point<D>], engine: Engine) -> Row {
    let n = chain.rods().len();
    let mut solver = Solver::default();
    let (mut met, mut steps) = (0, Vec::new());
    let nothing = Obstacles::default();
    let goal = |target| Goal { engine, tolerance_m: 1e-4 * n as f64, ..Goal::new(n, 0, target) };
    for target in targets {
        let answer = solver.solve(chain, &nothing, &goal(*target)).expect("right");
        let whole = chain_of_answer(chain, answer.points.clone());
        met += usize::from(answer.reached && whole && answer.engine == engine);
        steps.push(answer.iterations);
    }
    let us = median_us(targets.len(), |i| {
        let _ = std::hint::black_box(solver.solve(chain, &nothing, &goal(targets[i])));
    });
    steps.sort_unstable();
    Row { success: 100.0 * met as f64 / targets.len() as f64, steps: steps[steps.len() / 2], us }
}

fn chain_of_answer<const D: usize>(chain: &Chain<D>, points: Vec<Point<D>>) -> bool {
    Chain::new(points, chain.connectors().to_vec(), chain.rods().to_vec()).is_ok()
}

/// The median over `n` cases of the best of a few repeats.
fn median_us(n: usize, mut work: impl FnMut(usize)) -> f64 {
    let mut all: Vec<f64> = (0..n)
        .map(|i| {
            let once = |work: &mut dyn FnMut(usize)| {
                let started = ProcessTime::now();
                for _ in 0..10 {
                    work(i);
                }
                started.elapsed().as_secs_f64() * 1e5
            };
            (0..3).map(|_| once(&mut work)).fold(f64::INFINITY, f64::min)
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[n / 2]
}

/// The other crate knows three dimensions; plane chains have a third coordinate of 0.
fn measure_rebirth<const D: usize>(chain: &Chain<D>, targets: &[Point<D>]) -> Row {
    let vector = |p: &Point<D>| {
        rebirth_ik::Vec3::new(p[0] as f32, p[1] as f32, p.get(2).map_or(0.0, |z| *z as f32))
    };
    let start: Vec<_> = chain.points().iter().map(vector).collect();
    let lengths = vec![1.0; chain.rods().len()];
    let tolerance = 1e-4 * lengths.len() as f32;
    let solve = |points: &mut [rebirth_ik::Vec3], target: &Point<D>| {
        rebirth_ik::solve_chain(points, &lengths, vector(target), 1000, tolerance)
    };
    let (mut met, mut steps) = (0, Vec::new());
    for target in targets {
        let mut points = start.clone();
        steps.push(solve(&mut points, target).iterations as usize);
        let tip = points[points.len() - 1];
        met += usize::from(tip.distance(vector(target)) <= 1.01 * tolerance);
    }
    let mut points = start.clone();
    let us = median_us(targets.len(), |i| {
        points.copy_from_slice(&start);
        let _ = std::hint::black_box(solve(&mut points, &targets[i]));
    });
    steps.sort_unstable();
    Row { success: 100.0 * met as f64 / targets.len() as f64, steps: steps[steps.len() / 2], us }
}

fn free_in<const D: usize>() {
    for part in [0.9, 1.0] {
        for n in [7, 25, 100, 450] {
            let mut draws = draws(n as u64);
            let chain = chain_of(walk::<D>(n, 0.4, &mut draws));
            let targets: Vec<_> =
                (0..TARGETS).map(|_| in_ball(part * n as f64, &mut draws)).collect();
            let other = measure_rebirth(&chain, &targets);
            print!("{D}-D, {n} rods, {part} reach:");
            for engine in [Engine::Chain, Engine::Dls, Engine::Auto] {
                let row = measure(&chain, &targets, engine);
                print!("  {} {:.1} %/{}/{:.2} us", engine.name(), row.success, row.steps, row.us);
            }
            println!("  rebirth-ik {:.1} %/{}/{:.2} us", other.success, other.steps, other.us);
        }
    }
}

fn main() {
    free_in::<2>();
    free_in::<3>();
    let _ = (add::<2>([0.0; 2], [0.0; 2]), distance::<2>([0.0; 2], first_axis()));
}
