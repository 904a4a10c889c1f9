//! Speed and success of inverse kinematics.
//!
//! `cargo bench --manifest-path benches/ik/Cargo.toml [-- PART ...]` with the parts `free` (the default),
//! `guarded` and `arms` (slow; arms need `../shared/data`); CPU time. The yardstick of the first is
//! the FABRIK of the crate `rebirth-ik`, in single precision, on the same chains and targets in the
//! same run, and where it is bearable the Jacobian solver of the crate `k` on a joint per rod (two
//! in space) and the first twenty targets; `itself` is the success without the closed form that
//! every engine falls back on. In brackets what the prototype reached.

use cpu_time::ProcessTime;
use sidestep_arms::ik::{ChainIkGoal, IkEngine, IkSolver, MotionOrPosture};
use sidestep_arms::kinematics::{ArmGoal, SerialChain};
use sidestep_import::urdf::Model;
use sidestep_kernel::Seed;
use sidestep_kernel::distr::normal;
use sidestep_kernel::math::powf;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_rods::geometry::{
    Point, add_scaled, angle_between_rad, distance, normalized, scaled, sub,
};
use sidestep_rods::{Chain, Connector, Mobility, Obstacle, Obstacles, Rod};

fn draws(index: u64) -> Draws {
    Streams::new(Seed(7)).draws(0, index, Purpose(1))
}

fn direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    normalized(std::array::from_fn(|_| normal(draws))).expect("not zero")
}

/// A random walk of rods of 1 m whose directions wander by `spread`.
fn walk<const D: usize>(n: usize, spread: f64, draws: &mut Draws) -> Vec<Point<D>> {
    let mut u = direction(draws);
    let mut points = vec![[0.0; D]];
    for i in 0..n {
        points.push(add_scaled(points[i], u, 1.0));
        u = normalized(add_scaled(u, direction(draws), spread)).expect("not zero");
    }
    points
}

fn chain_of<const D: usize>(points: Vec<Point<D>>) -> Chain<D> {
    let n = points.len();
    let rods = vec![Rod::with_fixed_length(1.0, 0.0); n - 1];
    Chain::new(points, vec![Connector::free(0.0); n], rods).expect("right")
}

/// Uniform in the ball of `radius_m`.
fn in_ball<const D: usize>(radius_m: f64, draws: &mut Draws) -> Point<D> {
    scaled(direction(draws), radius_m * powf(draws.uniform(), 1.0 / D as f64))
}

/// Success, and success of the engine itself, in percent; median steps, median CPU us.
struct Row {
    success: f64,
    itself: f64,
    steps: usize,
    us: f64,
}

fn percent(part: usize, all: usize) -> f64 {
    100.0 * part as f64 / all as f64
}

const TARGETS: usize = 300;

fn measure<const D: usize>(chain: &Chain<D>, targets: &[Point<D>], engine: IkEngine) -> Row {
    let n = chain.rods().len();
    let mut solver = IkSolver::default();
    let (mut met, mut direct, mut steps) = (0, 0, Vec::new());
    let nothing = Obstacles::default();
    let goal = |target| ChainIkGoal {
        engine,
        tolerance_m: 1e-4 * n as f64,
        ..ChainIkGoal::new(n, 0, target)
    };
    for target in targets {
        let answer = solver.solve(chain, &nothing, &goal(*target)).expect("right");
        let whole = chain_of_answer(chain, answer.points.clone());
        met += usize::from(answer.reached && whole);
        direct += usize::from(answer.engine == IkEngine::Direct);
        steps.push(answer.iterations);
    }
    let us = median_us(targets.len(), |i| {
        let _ = std::hint::black_box(solver.solve(chain, &nothing, &goal(targets[i])));
    });
    steps.sort_unstable();
    let (success, itself) = (percent(met, targets.len()), percent(met - direct, targets.len()));
    Row { success, itself, steps: steps[steps.len() / 2], us }
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
    let success = percent(met, targets.len());
    Row { success, itself: success, steps: steps[steps.len() / 2], us }
}

/// Targets for the crate `k`, and the longest chain that it is asked about.
const FEW_TARGETS: usize = 20;
const MOST_RODS_OF_K: usize = 100;

/// The crate `k` knows joints: one about z for each rod, in space one about y as well. It starts
/// from a posture that is bent a little.
fn measure_k<const D: usize>(n: usize, targets: &[Point<D>]) -> (f64, f64) {
    use k::{InverseKinematicsSolver, nalgebra as na};
    let mut nodes: Vec<k::Node<f64>> = Vec::new();
    for i in 0..n {
        let axes = [na::Vector3::z_axis(), na::Vector3::y_axis()];
        for (j, axis) in axes.into_iter().take(D - 1).enumerate() {
            let along_m = if i > 0 && j == 0 { 1.0 } else { 0.0 };
            let node = k::NodeBuilder::new()
                .name(&format!("{i}-{j}"))
                .translation(na::Translation3::new(along_m, 0.0, 0.0))
                .joint_type(k::JointType::Rotational { axis })
                .into_node();
            nodes.push(node);
        }
    }
    let tip = k::NodeBuilder::new()
        .name("tip")
        .translation(na::Translation3::new(1.0, 0.0, 0.0))
        .joint_type(k::JointType::Fixed)
        .into_node();
    nodes.push(tip.clone());
    for pair in nodes.windows(2) {
        pair[1].set_parent(&pair[0]);
    }
    let arm = k::SerialChain::from_end(&tip);
    let tolerance_m = 1e-4 * n as f64;
    let solver = k::JacobianIkSolver::new(tolerance_m, 1.0, 0.5, 1000);
    let position_only = k::Constraints {
        rotation_x: false,
        rotation_y: false,
        rotation_z: false,
        ..Default::default()
    };
    let bent = vec![0.05; arm.dof()];
    let solve = |target: &Point<D>| {
        let z_m = target.get(2).copied().unwrap_or(0.0);
        let pose = na::Isometry3::translation(target[0], target[1], z_m);
        arm.set_joint_positions(&bent).expect("no limits");
        let constraints = k::Constraints { position_z: D == 3, ..position_only.clone() };
        solver.solve_with_constraints(&arm, &pose, &constraints).is_ok()
    };
    let few = &targets[..FEW_TARGETS.min(targets.len())];
    let met = few.iter().filter(|target| solve(target)).count();
    let mut all: Vec<f64> = few
        .iter()
        .map(|target| {
            let started = ProcessTime::now();
            let _ = std::hint::black_box(solve(target));
            started.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    all.sort_by(f64::total_cmp);
    (percent(met, few.len()), all[all.len() / 2])
}

fn free_in<const D: usize>() {
    for part in [0.9, 1.0] {
        for n in [7, 25, 100, 450] {
            let mut draws = draws(n as u64);
            let chain = chain_of(walk::<D>(n, 0.05, &mut draws));
            let targets: Vec<_> =
                (0..TARGETS).map(|_| in_ball(part * n as f64, &mut draws)).collect();
            let other = measure_rebirth(&chain, &targets);
            print!("{D}-D, {n} rods, {part} reach:");
            for engine in [IkEngine::Chain, IkEngine::Dls, IkEngine::Direct] {
                let row = measure(&chain, &targets, engine);
                print!(
                    "  {} {:.1} % (itself {:.1})/{}/{:.2} us",
                    engine.name(),
                    row.success,
                    row.itself,
                    row.steps,
                    row.us
                );
            }
            print!("  rebirth-ik {:.1} %/{}/{:.2} us", other.success, other.steps, other.us);
            if n <= MOST_RODS_OF_K {
                let (success, us) = measure_k(n, &targets);
                print!("  k {success:.0} %/{us:.0} us");
            }
            println!();
        }
    }
}

/// A scene of `guarded`: obstacles that take no part of the base.
struct Scene<const D: usize> {
    obstacles: Obstacles<D>,
    balls: Vec<(Point<D>, f64)>,
    max_bend_rad: f64,
}

const ROD_M: f64 = 0.02;
const CONNECTOR_M: f64 = 0.05;

impl<const D: usize> Scene<D> {
    fn new(n: usize, n_balls: u32, max_bend_rad: f64, draws: &mut Draws) -> Self {
        let mut balls = Vec::new();
        while balls.len() < n_balls as usize {
            let radius_m = n as f64 * (0.04 + 0.08 * draws.uniform());
            let center = in_ball::<D>(0.9 * n as f64, draws);
            if distance(center, [0.0; D]) > radius_m + 0.6 {
                balls.push((center, radius_m));
            }
        }
        let all = (0..).zip(&balls).map(|(id, (c, r))| Obstacle::ball(id, *c, *r)).collect();
        Self { obstacles: Obstacles::new(all, 1.1).expect("right"), balls, max_bend_rad }
    }

    /// A good posture: a random walk that turns until it is clear.
    fn posture(&self, n: usize, draws: &mut Draws) -> Vec<Point<D>> {
        loop {
            let mut points = vec![[0.0; D]];
            while points.len() <= n {
                let Some(next) = (0..60).find_map(|_| self.next(&points, draws)) else { break };
                points.push(next);
            }
            if points.len() == n + 1 {
                return points;
            }
        }
    }

    fn next(&self, points: &[Point<D>], draws: &mut Draws) -> Option<Point<D>> {
        let last = points[points.len() - 1];
        let into = points.len().checked_sub(2).map(|i| sub(last, points[i]));
        let u = match into {
            Some(u) => normalized(add_scaled(u, direction(draws), 0.5)).expect("not zero"),
            None => direction(draws),
        };
        let next = add_scaled(last, u, 1.0);
        let clear = self.balls.iter().all(|(c, r)| {
            let foot = sidestep_rods::geometry::nearest_on_segment(*c, last, next);
            distance(*c, foot) > r + CONNECTOR_M + 1e-3
        });
        let bends = into.is_none_or(|v| angle_between_rad(v, u) <= self.max_bend_rad - 1e-6);
        (clear && bends).then_some(next)
    }

    fn chain(&self, points: Vec<Point<D>>) -> Chain<D> {
        let n = points.len();
        let connector =
            Connector { max_bend_rad: self.max_bend_rad, ..Connector::free(CONNECTOR_M) };
        let mut connectors = vec![connector; n];
        connectors[0].mobility = Mobility::Fixed;
        Chain::new(points, connectors, vec![Rod::with_fixed_length(1.0, ROD_M); n - 1])
            .expect("right")
    }
}

fn guarded_in<const D: usize>(n: usize, n_balls: u32, max_bend_deg: f64, before: &str) {
    const RUNS: usize = 60;
    let mut draws = draws(1000 * u64::from(n_balls) + n as u64 + D as u64 * 100_000);
    let mut solver = IkSolver::default();
    let (mut met, mut moved, mut times) = (0, 0, Vec::new());
    for _ in 0..RUNS {
        let scene = Scene::<D>::new(n, n_balls, max_bend_deg.to_radians(), &mut draws);
        let chain = scene.chain(scene.posture(n, &mut draws));
        let target = scene.posture(n, &mut draws)[n];
        let started = ProcessTime::now();
        let answer = solver.solve(&chain, &scene.obstacles, &ChainIkGoal::new(n, 0, target));
        times.push(started.elapsed().as_secs_f64() * 1e6);
        let answer = answer.expect("right");
        met += usize::from(answer.reached);
        moved += usize::from(answer.reached && answer.kind == MotionOrPosture::Motion);
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{D}-D, {n} rods, {n_balls} balls, bends to {max_bend_deg} deg: {:.1} % reached, {:.1} % by motion, median {:.0} us, p90 {:.0} us, worst {:.0} us [{before}]",
        percent(met, RUNS),
        percent(moved, RUNS),
        times[RUNS / 2],
        times[RUNS * 9 / 10],
        times[RUNS - 1],
    );
}

fn guarded() {
    guarded_in::<2>(7, 4, 180.0, "87 %");
    guarded_in::<2>(7, 8, 180.0, "85 %");
    guarded_in::<2>(25, 4, 180.0, "88 %");
    guarded_in::<2>(25, 8, 180.0, "83 %");
    guarded_in::<2>(7, 0, 60.0, "57 %");
    guarded_in::<2>(7, 8, 60.0, "53 %");
    guarded_in::<2>(25, 0, 60.0, "78 %");
    guarded_in::<2>(25, 4, 60.0, "70 %");
    guarded_in::<3>(7, 8, 180.0, "none");
    guarded_in::<3>(25, 8, 60.0, "none");
}

/// Success of position targets that come from random postures inside the limits.
fn arms() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/urdf");
    let arms = [
        "chain/iiwa7",
        "iiwa14_primitive_collision",
        "chain/panda",
        "panda",
        "chain/ur5",
        "ur5_robot",
        "z1",
        "chain/snake16_own",
        "REU_snake",
        "RSNAKE_snake",
        "pendulum5",
    ];
    for name in arms {
        let path = format!("{folder}/{name}.urdf");
        let Ok(model) = Model::load(std::path::Path::new(&path)) else {
            println!("skipped: {path} is not here");
            continue;
        };
        let arm = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("an arm");
        for (engine, restarts) in [(IkEngine::Dls, 0), (IkEngine::Dls, 100), (IkEngine::Chain, 100)]
        {
            arm_row(name, &arm, engine, restarts);
        }
    }
}

fn arm_row(name: &str, arm: &SerialChain, engine: IkEngine, restarts: usize) {
    const RUNS: usize = 500;
    let mut draws = draws(77);
    let mut random = || -> Vec<f64> {
        let range = |l: Option<sidestep_import::urdf::Limits>| {
            l.map_or([-3.0, 3.0], |l| [l.lower, l.upper])
        };
        let values = arm.variables.iter().map(|v| {
            let [lower, upper] = range(v.limits);
            lower + draws.uniform() * (upper - lower)
        });
        values.collect()
    };
    let (mut met, mut times) = (0, Vec::new());
    for _ in 0..RUNS {
        let target = arm.forward_kinematics(&random()).tip.origin_m;
        let start = random();
        let goal = ArmGoal { engine, restarts, ..ArmGoal::new(target) };
        let started = ProcessTime::now();
        let answer = arm.solve(&goal, &start).expect("right");
        times.push(started.elapsed().as_secs_f64() * 1e6);
        let there = distance(arm.forward_kinematics(&answer.values).tip.origin_m, target) <= 1e-6;
        let legal = arm.outside_limits(&answer.values).is_empty();
        met += usize::from(answer.reached && there && legal);
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{name}, {} joints, {} with {restarts} restarts: {:.1} % reached, median {:.0} us, p99 {:.0} us",
        arm.variables.len(),
        engine.name(),
        percent(met, RUNS),
        times[RUNS / 2],
        times[RUNS * 99 / 100],
    );
}

fn main() {
    let typed: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let wants = |part: &str| typed.iter().any(|t| t == part);
    if typed.is_empty() || wants("free") {
        free_in::<2>();
        free_in::<3>();
    }
    if wants("guarded") {
        guarded();
    }
    if wants("arms") {
        arms();
    }
}
