//! D1 for chains: the same build, scenario and seed give identical bits for 1, 2, 3 and 8
//! workers, recorded or not, resumed or not. What a run says of itself is what its record shows.

use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{MemoryRecorder, Recorder, Values};
use sidestep::scenario::Source;
use sidestep::worlds::chain::metrics::{ChainMetrics, Metrics};
use sidestep::worlds::chain::{ChainRun, ChainState, ChainWorld, chain_run};
use sidestep_kernel::math::hypot;
use std::any::Any;
use std::ops::{Deref, DerefMut};

/// Four chains that wander among pillars in a room of 5 m, and often come near each other.
pub(crate) const SEVERAL: &str = "
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
part = 0.05
radius_m = 0.2
[[chains]]
count = 4
apart_m = [0.0, 1.0]
connectors = 8
at_m = [0.0, -1.5]
rod_m = [0.25, 0.35]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 1.0
turn_deg = 60
within_m = [[-2.5, -2.5], [2.5, 2.5]]
patience_s = 1000.0
";

/// Two chains, each between two discs that go through each other.
const CAUGHT: &str = r#"
[chain]
dt_s = 0.02
escape_speed_m_s = 1.0
[[obstacles]]
at_m = [0.1, 1.5]
radius_m = 0.4
velocity_m_s = [0.0, -0.5]
[[obstacles]]
at_m = [0.1, -1.5]
radius_m = 0.4
velocity_m_s = [0.0, 0.5]
[[obstacles]]
at_m = [0.3, 9.5]
radius_m = 0.3
velocity_m_s = [0.0, -0.5]
[[obstacles]]
at_m = [0.3, 6.5]
radius_m = 0.5
velocity_m_s = [0.0, 0.5]
[[chains]]
connectors = 12
at_m = [4.0, 0.0]
rod_m = [0.6, 0.8]
radius_m = 0.25
rod_radius_m = 0.05
count = 2
apart_m = [0.0, 8.0]
[[chains.tasks]]
kind = "rest"
"#;

/// One chain that balls fly at, and that gets out of their way.
const DODGING: &str = "
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
n = 14
radius_m = [0.1, 0.3]
speed_m_s = [0.2, 0.6]
[[chains]]
connectors = 12
at_m = [2.0, 0.0]
rod_m = [0.3, 0.4]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 0.4
within_m = [[-3.0, -3.0], [3.0, 3.0]]
patience_s = 1000.0
";

/// Robots on wheels in a corridor with a bend, and somebody who walks to and fro in it.
pub(crate) const SWARM: &str = "
[ground]
corridor = { width_m = 2.4, legs = [{ straight_m = 6 }, { radius_m = 2, turn_deg = 90 }, { straight_m = 4 }] }
[[obstacles]]
at_m = [5.0, 0.9]
radius_m = 0.15
patrol_m = [[5.0, 0.9], [7.0, 0.9]]
speed_m_s = 0.3
[[chains]]
connectors = 5
at_m = [4.0, 0.0]
heading_deg = 0
rod_m = [0.6, 0.8]
rod_radius_m = 0.05
robots = { radius_m = 0.2 }
[[chains.tasks]]
kind = \"navigate\"
speed_m_s = 0.5
navigator = { noise_m = 0.01 }
";

/// A snake in space, past balls that stand still and balls that fly.
const SNAKE: &str = "
[chain]
dimensions = 3
[[fields]]
lo_m = [-3.0, -3.0, -3.0]
hi_m = [3.0, 3.0, 3.0]
part = 0.1
radius_m = 0.3
[[fields]]
lo_m = [-3.0, -3.0, -3.0]
hi_m = [3.0, 3.0, 3.0]
n = 10
radius_m = [0.1, 0.2]
speed_m_s = [0.1, 0.4]
[[chains]]
connectors = 30
at_m = [-1.0, -1.0, 0.0]
along = [0.0, 0.0, -1.0]
rod_m = 0.1
radius_m = 0.03
rod_radius_m = 0.02
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 0.5
turn_deg = 40
patience_s = 1000.0
";

/// A chain that breaks in cycle 10 and is joined from cycle 20 on, and one that stays whole.
pub(crate) const BROKEN: &str = "
[chain]
dt_s = 0.1
self_collision = false
[[chains]]
connectors = 14
at_m = [0.0, 0.0]
rod_m = [0.9, 1.1]
radius_m = 0.1
[[chains.changes]]
at_s = 1.0
scatter = [4, 9]
by_m = 2.0
[[chains.changes]]
at_s = 2.0
reform = true
speed_m_s = 1.0
[[chains.tasks]]
kind = \"script\"
script = \"wait 1 forward 1 turn 90 forward 1\"
[[chains]]
connectors = 3
at_m = [0.0, 40.0]
rod_m = 1.0
[[chains.tasks]]
kind = \"rest\"
lasts_s = 1.0
";

/// Two tasks of an operator, one of targets, and connectors that break down.
pub(crate) const TOLD: &str = "
[chain]
dt_s = 0.05
[[obstacles]]
at_m = [1.5, 0.6]
radius_m = 0.3
[[chains]]
connectors = 8
at_m = [0.0, 0.0]
rod_m = [0.25, 0.35]
radius_m = 0.05
max_bend_deg = 100
[[chains.limits]]
connector = 3
max_bend_deg = 60
[[chains.changes]]
at_s = 2.0
connector = 7
failed = true
[[chains.changes]]
at_s = 3.0
connector = 7
failed = false
[[chains.tasks]]
kind = \"script\"
script = \"to step :m forward :m turn 30 end repeat 3 [ step 0.5 ]\"
patience_s = 1.0
[[chains.tasks]]
kind = \"targets\"
connector = 7
targets_m = [[-2.0, 1.0], [-1.0, 1.5]]
tolerance_m = 0.05
patience_s = 1.0
";

/// A chain to which nothing can object, so that it may follow several motions at once: anywhere, to
/// places, as a script says, with a connector that fails and works again, and a slack tail.
const OPEN: &str = "
[chain]
dimensions = 3
dt_s = 0.05
self_collision = false
[[chains]]
connectors = 60
at_m = [0.0, 0.0, 0.0]
rod_m = [0.2, 0.3]
radius_m = 0.05
[[chains.changes]]
at_s = 4.0
connector = 30
failed = true
[[chains.changes]]
at_s = 4.5
connector = 30
failed = false
[[chains.tasks]]
kind = \"wander\"
turn_deg = 60
lasts_s = 6.0
[[chains.tasks]]
kind = \"targets\"
targets_m = [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]
[[chains.tasks]]
kind = \"script\"
script = \"forward 0.31 wait 0.2 turn 90 forward 0.4 turn 180 forward 0.6\"
";

/// The same in a chain's own way: tight turns, so that its parts come near each other.
const COILED: &str = "
[chain]
dt_s = 0.05
[[chains]]
connectors = 40
at_m = [0.0, 0.0]
rod_m = [0.2, 0.3]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
turn_deg = 90
within_m = [[-1.5, -1.5], [1.5, 1.5]]
patience_s = 1000.0
";

/// An arm whose tool is behind a wall of which it knows no way round but by a plan.
const PLANNED: &str = "
[chain]
dt_s = 0.05
[[obstacles]]
ends_m = [[0.5, 0.35], [2.5, 0.35]]
radius_m = 0.05
[[chains]]
points_m = [[0.0, 0.0], [0.0, -0.4], [0.4, -0.4], [0.4, 0.0], [0.8, 0.0], [1.2, 0.0]]
rod_m = 0.4
radius_m = 0.03
[[chains.limits]]
connector = 0
mobility = \"fixed\"
[[chains.tasks]]
kind = \"targets\"
connector = 5
targets_m = [[1.0, 0.9]]
tolerance_m = 0.005
planner = \"rrt-connect\"
";

pub(crate) fn source(seed: u64, text: &str) -> Source {
    let text = format!("format = 1\nworld = \"chain\"\nseed = {seed}\n{text}");
    Source::new("s.toml", text, "")
}

/// A run whose state tests look into. It stays behind the face of all worlds, so that the chain is not
/// compiled once more for its tests.
struct Running<const D: usize>(Box<dyn Simulation>);

impl<const D: usize> Running<D> {
    fn state(&self) -> &ChainState<D> {
        self.chains().state()
    }

    fn world(&self) -> &ChainWorld<D> {
        self.chains().world()
    }

    fn metrics(&self) -> Metrics {
        self.chains().metrics()
    }

    fn chains(&self) -> &ChainRun<D> {
        let run: &dyn Any = &*self.0;
        run.downcast_ref().expect("a run of that many dimensions")
    }
}

impl<const D: usize> Deref for Running<D> {
    type Target = dyn Simulation;

    fn deref(&self) -> &dyn Simulation {
        &*self.0
    }
}

impl<const D: usize> DerefMut for Running<D> {
    fn deref_mut(&mut self) -> &mut dyn Simulation {
        &mut *self.0
    }
}

fn run<const D: usize>(source: &Source, workers: usize) -> Running<D> {
    let mut run = chain_run(source, workers).unwrap_or_else(|e| panic!("{e}"));
    let chains: &mut dyn Any = &mut *run;
    chains.downcast_mut::<ChainRun<D>>().expect("of that many dimensions").share_always();
    Running(run)
}

/// To a cycle, or to the end of all tasks.
fn advance_to<const D: usize>(run: &mut Running<D>, cycle: u64) {
    while run.cycle() < cycle && !run.is_over() {
        let left = cycle - run.cycle();
        run.advance(left);
    }
}

fn recorded<const D: usize>(
    source: &Source,
    workers: usize,
    cycles: u64,
) -> (Running<D>, MemoryRecorder) {
    let mut run = run::<D>(source, workers);
    run.begin_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    while run.cycle() < cycles && !run.is_over() {
        let left = cycles - run.cycle();
        run.advance(left.min(7));
        run.record(&mut recorder).expect("memory has room");
    }
    recorder.finish().expect("memory has room");
    (run, recorder)
}

/// What came of each chain; nothing in it is about time that was spent.
fn outcome<const D: usize>(run: &Running<D>) -> String {
    let one = |slot| format!("{:?}", run.world().metrics_of(run.state(), slot));
    (0..run.state().len()).map(one).collect()
}

fn assert_d1<const D: usize>(text: &str, cycles: u64, stops: &[u64]) {
    let source = source(3, text);
    let mut alone = run::<D>(&source, 1);
    advance_to(&mut alone, cycles);
    for workers in [2, 3, 8] {
        let mut team = run::<D>(&source, workers);
        advance_to(&mut team, cycles);
        assert_eq!(team.digest(), alone.digest(), "{workers} workers, {text}");
        assert_eq!(outcome(&team), outcome(&alone), "{workers} workers, {text}");
    }
    let (kept, rows) = recorded::<D>(&source, 1, cycles);
    assert_eq!(kept.digest(), alone.digest(), "recorded, {text}");
    assert_eq!(outcome(&kept), outcome(&alone), "recorded, {text}");
    let (_, same) = recorded::<D>(&source, 3, cycles);
    assert!(rows == same, "rows differ for 3 workers, {text}");
    let mut first = run::<D>(&source, 2);
    for &stop in stops {
        advance_to(&mut first, stop);
        let saved = first.checkpoint();
        let mut second = run::<D>(&source, 3);
        second.restore(&saved).expect("its own checkpoint");
        assert_eq!((second.cycle(), second.digest()), (first.cycle(), first.digest()));
        assert_eq!(second.checkpoint(), saved, "a checkpoint is a function of the state");
        advance_to(&mut second, cycles);
        assert_eq!(second.digest(), alone.digest(), "resumed at {stop}, {text}");
        assert_eq!(outcome(&second), outcome(&alone), "resumed at {stop}, {text}");
    }
}

#[test]
fn chains_that_meet_have_the_same_bits_however_they_are_run() {
    assert_d1::<2>(SEVERAL, 120, &[0, 1, 37, 74, 119, 120]);
}

#[test]
fn a_chain_that_dodges_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(DODGING, 100, &[0, 1, 33, 99]);
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", "dt_s = 0.05\nescape = \"touch\""), 100, &[50]);
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", "dt_s = 0.05\nescape = \"off\""), 100, &[50]);
    let literal = "dt_s = 0.05\nescape_by = \"literal\"";
    assert_d1::<2>(&DODGING.replace("dt_s = 0.05", literal), 100, &[33]);
}

/// Discs close like tongs; the chain is on its way through one of them when the run is resumed.
#[test]
fn a_chain_that_is_caught_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(CAUGHT, 160, &[0, 80, 90, 100, 110, 120, 159]);
}

#[test]
fn a_swarm_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(SWARM, 250, &[0, 1, 100, 249]);
}

#[test]
fn a_snake_in_space_has_the_same_bits_however_it_is_run() {
    assert_d1::<3>(SNAKE, 100, &[0, 1, 50, 99]);
}

/// Before, in and after the cycles in which it breaks, is joined, and something fails.
#[test]
fn broken_chains_and_changes_have_the_same_bits_however_they_are_run() {
    assert_d1::<2>(BROKEN, 120, &[9, 10, 11, 19, 20, 21, 40, 80]);
    assert_d1::<2>(TOLD, 400, &[0, 39, 40, 41, 60, 61, 200]);
}

#[test]
fn a_chain_that_follows_several_motions_at_once_has_the_same_bits_however_it_is_run() {
    assert_d1::<3>(OPEN, 300, &[0, 1, 7, 79, 80, 95, 121, 200, 299]);
    assert_d1::<2>(COILED, 200, &[0, 1, 99]);
}

/// With a limit of sub-steps, though it has no effect, every motion is made by itself; with a pebble
/// far away every part is looked at. All that comes of it is the same.
#[test]
fn what_is_put_off_or_proven_is_what_single_motions_do() {
    let single = OPEN.replace("[chain]", "[chain]\nstep_m = 1.0");
    let pebble = format!("{COILED}\n[[obstacles]]\nat_m = [900.0, 900.0]\nradius_m = 0.1\n");
    for seed in 0..6 {
        assert_same_end::<3>(seed, OPEN, &single, 300);
        assert_same_end::<2>(seed, COILED, &pebble, 200);
    }
}

/// Whether two scenarios lead the first chain to the same places with the same counts.
fn assert_same_end<const D: usize>(seed: u64, one: &str, other: &str, cycles: u64) {
    let [one, other] = [one, other].map(|text| {
        let mut run = run::<D>(&source(seed, text), 1);
        advance_to(&mut run, cycles);
        let points: Vec<_> = run.state().body(0).chain.points().to_vec();
        (points, run.world().metrics_of(run.state(), 0))
    });
    assert_eq!(one.0, other.0, "{seed}");
    let counts =
        |m: &ChainMetrics| (m.tally.moved, m.tally.max_slave_step_m, m.tally.max_speed_m_s);
    assert_eq!(counts(&one.1), counts(&other.1), "{seed}");
    assert_eq!(one.1.tally.way_m, other.1.tally.way_m, "{seed}");
}

#[test]
fn an_arm_that_follows_a_plan_reaches_its_target_and_has_the_same_bits_however_it_is_run() {
    let mut run = run::<2>(&source(3, PLANNED), 1);
    advance_to(&mut run, 1000);
    let metrics = run.metrics();
    assert_eq!((metrics.progress, metrics.penetrations), (1.0, 0), "{metrics:?}");
    assert!(metrics.rungs.planned >= 1, "{metrics:?}");
    assert!(metrics.max_speed_m_s <= 1.0 + 1e-9, "no joint is faster than twice the tool");
    let end = run.cycle();
    assert_d1::<2>(PLANNED, 1000, &[0, end / 4, end / 2, end - 10]);
}

#[test]
fn another_seed_is_another_run_and_a_checkpoint_of_it_is_refused() {
    let [a, b] = [1, 2].map(|seed| {
        let mut run = run::<2>(&source(seed, SEVERAL), 1);
        run.advance(20);
        run
    });
    assert_ne!(a.digest(), b.digest());
    let refused = run::<2>(&source(2, SEVERAL), 1).restore(&a.checkpoint());
    assert!(refused.expect_err("another seed").to_string().contains("scenario"));
}

/// Wherever this is run, the bits must be these (D3); a change needs a line in the CHANGELOG
/// (D4), and the lines that this prints in the file.
#[test]
fn the_golden_digests_of_chains_are_what_every_machine_gets() {
    fn digest<const D: usize>(name: &str, text: &str) -> String {
        let mut run = run::<D>(&source(1, text), 2);
        advance_to(&mut run, 150);
        format!("{name} {}\n", run.digest())
    }
    let found = digest::<2>("several", SEVERAL)
        + &digest::<2>("dodging", DODGING)
        + &digest::<2>("swarm", SWARM)
        + &digest::<3>("snake", SNAKE)
        + &digest::<2>("broken", BROKEN)
        + &digest::<2>("told", TOLD);
    assert_eq!(found, include_str!("golden/serpentine.txt"), "found:\n{found}");
}

fn sub<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|i| a[i] * b[i]).sum()
}

fn apart<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    sub(a, b).iter().fold(0.0, |all, x| hypot(all, *x))
}

/// From a point to a segment.
fn to_segment<const D: usize>(p: [f64; D], [a, b]: [[f64; D]; 2]) -> f64 {
    let d = sub(b, a);
    let part = (dot(sub(p, a), d) / dot(d, d).max(1e-300)).clamp(0.0, 1.0);
    apart(p, std::array::from_fn(|i| a[i] + part * d[i]))
}

/// From a segment to a segment, by ternary search: the distance along one is convex.
fn between<const D: usize>(one: [[f64; D]; 2], two: [[f64; D]; 2]) -> f64 {
    let at =
        |s: f64| to_segment(std::array::from_fn(|i| one[0][i] + s * (one[1][i] - one[0][i])), two);
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..80 {
        let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if at(a) < at(b) { hi = b } else { lo = a }
    }
    at(lo).min(at(hi))
}

/// Whether the boxes of two segments are half a meter apart.
fn are_far<const D: usize>(one: [[f64; D]; 2], two: [[f64; D]; 2]) -> bool {
    let lo = |[a, b]: [[f64; D]; 2], i: usize| a[i].min(b[i]);
    let hi = |[a, b]: [[f64; D]; 2], i: usize| a[i].max(b[i]);
    (0..D).any(|i| lo(one, i) > hi(two, i) + 0.5 || lo(two, i) > hi(one, i) + 0.5)
}

/// Connectors and rods of a chain as capsules.
fn parts<const D: usize>(run: &Running<D>, slot: usize) -> Vec<([[f64; D]; 2], f64)> {
    let body = run.state().body(slot);
    let (points, chain) = (body.chain.points(), &body.chain);
    let balls = points.iter().zip(chain.connectors()).map(|(p, c)| ([*p; 2], c.radius_m));
    let rods = points.windows(2).zip(chain.rods()).map(|(w, rod)| ([w[0], w[1]], rod.radius_m));
    balls.chain(rods).collect()
}

/// The least distance of a chain from balls.
fn clearance<const D: usize>(run: &Running<D>, slot: usize, balls: &[([f64; D], f64)]) -> f64 {
    let least = |(ends, radius_m): ([[f64; D]; 2], f64)| {
        let to = |(at, r): &([f64; D], f64)| to_segment(*at, ends) - r - radius_m;
        balls.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    parts(run, slot).into_iter().map(least).fold(f64::INFINITY, f64::min)
}

/// All balls of a world at a cycle.
fn balls<const D: usize>(run: &Running<D>, cycle: u64) -> Vec<([f64; D], f64)> {
    use sidestep::worlds::chain::geometry::Core;
    let world = run.world();
    let moving: Vec<_> = world.movers.at(world.starts_s(cycle)).collect();
    let all = world.obstacles.still().iter().chain(&moving);
    let ball = |core: &Core<D>, radius_m: f64| match core {
        Core::Point(at) => (*at, radius_m),
        other => panic!("{other:?} is no ball"),
    };
    all.map(|o| ball(&o.core, o.radius_m)).collect()
}

/// Steps a world cycle by cycle, and counts what its metrics count from its state alone.
fn assert_recount<const D: usize>(seed: u64, text: &str, cycles: u64) -> u64 {
    let mut run = run::<D>(&source(seed, text), 1);
    let n = run.state().len();
    let (mut inside, mut least, mut violation) = (0, f64::INFINITY, 0.0f64);
    for cycle in 1..=cycles {
        run.advance(1);
        let balls = balls(&run, cycle);
        for slot in 0..n {
            let clear_m = clearance(&run, slot, &balls);
            inside += u64::from(clear_m < -1e-6);
            least = least.min(clear_m);
            let body = run.state().body(slot);
            for (w, rod) in body.chain.points().windows(2).zip(body.chain.rods()) {
                let length_m = apart(w[0], w[1]);
                violation = violation.max(rod.min_m - length_m).max(length_m - rod.max_m);
            }
        }
    }
    let metrics = run.metrics();
    assert_eq!(metrics.steps, cycles * n as u64);
    assert!((metrics.max_rod_violation_m - violation).abs() < 1e-12, "seed {seed}");
    assert!(violation <= 1e-9, "seed {seed}: a rod is {violation} m outside its limits");
    if n == 1 {
        assert_eq!(metrics.penetrations, inside, "seed {seed}");
        match metrics.min_clearance_m {
            Some(told_m) => assert!((told_m - least).abs() < 1e-9, "seed {seed}: {told_m} {least}"),
            None => assert!(least >= run.world().look_m, "seed {seed}: {least}"),
        }
    } else {
        // The metrics look at other chains too.
        assert!(metrics.penetrations >= inside, "seed {seed}");
        assert!(metrics.min_clearance_m.is_some_and(|m| m <= least + 1e-9), "seed {seed}");
    }
    metrics.penetrations
}

const STILL: &str = "
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
part = 0.15
radius_m = 0.2
[[chains]]
connectors = 14
at_m = [2.0, 0.0]
rod_m = [0.25, 0.35]
radius_m = 0.08
rod_radius_m = 0.03
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 1.0
turn_deg = 60
within_m = [[-3.0, -3.0], [3.0, 3.0]]
patience_s = 1000.0
";

/// L1 for chains.
#[test]
fn among_what_stands_still_nothing_is_ever_penetrated_and_the_metrics_are_true() {
    for seed in 0..60 {
        assert_eq!(assert_recount::<2>(seed, STILL, 200), 0, "seed {seed}");
    }
    let still = SNAKE.replace("n = 10\n", "n = 0\n");
    for seed in 0..12 {
        assert_eq!(assert_recount::<3>(seed, &still, 100), 0, "seed {seed}");
    }
}

#[test]
fn among_what_moves_the_metrics_are_true_whether_chains_escape_or_not() {
    let off = DODGING.replace("dt_s = 0.05", "dt_s = 0.05\nescape = \"off\"");
    let [dodging, staying] = [DODGING, &off]
        .map(|text| (0..8).map(|seed| assert_recount::<2>(seed, text, 150)).sum::<u64>());
    assert!(dodging < staying, "{dodging} steps inside with escape, {staying} without");
}

#[test]
fn chains_that_meet_never_overlap() {
    let mut nearest_m = f64::INFINITY;
    for seed in 0..15 {
        let mut run = run::<2>(&source(seed, SEVERAL), 2);
        for cycle in 0..120 {
            run.advance(1);
            let all: Vec<_> = (0..4).map(|slot| parts(&run, slot)).collect();
            for (a, b) in (0..4).flat_map(|b| (0..b).map(move |a| (a, b))) {
                for (one, r) in &all[a] {
                    for (two, s) in &all[b] {
                        if are_far(*one, *two) {
                            continue;
                        }
                        let apart_m = between(*one, *two) - r - s;
                        assert!(apart_m > -1e-6, "seed {seed}, cycle {cycle}: {a}, {b}: {apart_m}");
                        nearest_m = nearest_m.min(apart_m);
                    }
                }
            }
        }
        assert_eq!(run.metrics().penetrations, 0, "seed {seed}");
    }
    assert!(nearest_m < 0.02, "they never came near each other: {nearest_m} m");
}

/// Places of one connector, cycle by cycle.
fn track(rows: &MemoryRecorder, connector: u32) -> Vec<[f64; 2]> {
    let column = |name| rows.column("trajectories", name).expect("a column");
    match (column("connector"), column("x_m"), column("y_m")) {
        (Values::U32(who), Values::F64(x), Values::F64(y)) => {
            let rows = who.iter().zip(x.iter().zip(y)).filter(|(who, _)| **who == connector);
            rows.map(|(_, (x, y))| [*x, *y]).collect()
        }
        other => panic!("{other:?}"),
    }
}

/// Events as (cycle, name, connector, reason, value).
fn events<const D: usize>(
    run: &Running<D>,
    rows: &MemoryRecorder,
) -> Vec<(u64, String, u32, String, f64)> {
    let schemas = run.schemas();
    let table = schemas.iter().find(|s| s.name == "events").expect("events are recorded");
    let labels = |name: &str| &table.columns.iter().find(|c| c.name == name).expect(name).labels;
    let column = |name| rows.column("events", name).expect("a column");
    match (column("cycle"), column("event"), column("connector"), column("reason"), column("value"))
    {
        (
            Values::U64(cycle),
            Values::Label(event),
            Values::U32(who),
            Values::Label(why),
            Values::F64(value),
        ) => {
            let row = |k: usize| {
                let [event, why] = [(event[k], "event"), (why[k], "reason")]
                    .map(|(label, name)| labels(name)[label as usize].clone());
                (cycle[k], event, who[k], why, value[k])
            };
            (0..cycle.len()).map(row).collect()
        }
        other => panic!("{other:?}"),
    }
}

const PULLED: &str = "
[chain]
dt_s = 0.1
[[chains]]
connectors = 6
at_m = [0.0, 0.0]
rod_m = [0.9, 1.0]
radius_m = 0.1
";

#[test]
fn a_connector_that_is_fixed_or_has_failed_never_moves() {
    for limit in ["mobility = \"fixed\"", "failed = true"] {
        let text = format!(
            "{PULLED}[[chains.limits]]\nconnector = 3\n{limit}\n[[chains.tasks]]\nkind = \"wander\"\n\
             turn_deg = 90\npatience_s = 1000\n"
        );
        let (run, rows) = recorded::<2>(&source(4, &text), 1, 300);
        let still = track(&rows, 3);
        assert_eq!(still.len(), 300);
        assert!(still.iter().all(|at| *at == [-3.0, 0.0]), "{limit}");
        assert!(track(&rows, 0).windows(2).any(|w| w[0] != w[1]), "{limit}: nothing moved");
        assert!(run.metrics().max_rod_violation_m <= 1e-9);
    }
}

/// All rods at their greatest length, and the last connector fixed: nothing can come along.
#[test]
fn a_vetoed_order_is_told_and_leaves_every_bit_until_patience_ends() {
    let text = format!(
        "{PULLED}[[chains.limits]]\nconnector = 5\nmobility = \"fixed\"\n[[chains.tasks]]\n\
         kind = \"script\"\nscript = \"forward 1\"\npatience_s = 2.0\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 500);
    let told = events(&run, &rows);
    assert_eq!(told.len(), 2, "{told:?}");
    assert_eq!(
        (told[0].0, told[0].1.as_str(), told[0].2, told[0].3.as_str()),
        (0, "veto", 5, "out-of-reach")
    );
    // It is tried for 2 s of 0.1 s, and once more.
    assert_eq!((told[1].0, told[1].1.as_str()), (20, "given-up"));
    assert!((0..6).all(|k| track(&rows, k).iter().all(|at| *at == [-f64::from(k), 0.0])));
    assert!(run.is_over() && run.cycle() == 21, "{}", run.cycle());
    let metrics = run.metrics();
    assert_eq!((metrics.vetoes, metrics.vetoes_by_reason["out-of-reach"]), (21, 21));
    let given_up = &metrics.given_up[0].what;
    assert_eq!(
        (given_up.task, given_up.by, given_up.reason.as_deref()),
        (0, Some(5), Some("out-of-reach"))
    );
    assert_eq!(given_up.nearest_m, 1.0);
    assert_eq!(metrics.progress, 0.0, "what was given up is not done");
}

#[test]
fn a_gap_too_long_is_told_with_the_number_of_missing_parts() {
    let text = BROKEN.replace("by_m = 2.0", "by_m = 2.0\napart_m = [-2.5, 0.0]");
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 60);
    let told = events(&run, &rows);
    let gap = told.iter().position(|event| event.1 == "gap-too-long").expect("a gap");
    assert!((told[gap].4 - 2.5).abs() < 1e-9, "{told:?}");
    let Some(Values::U32(missing)) = rows.column("events", "missing") else { panic!("no column") };
    // 2.5 m of rods of 1.1 m; of other events nothing is missing.
    assert_eq!(missing.iter().sum::<u32>(), 3, "{missing:?}");
    assert_eq!(missing[gap], 3);
    assert_eq!(run.metrics().missing_parts, 3);
}

/// The second of three targets is inside a pillar.
#[test]
fn a_target_that_is_given_up_is_told_with_how_near_it_was_and_why() {
    let text = format!(
        "{PULLED}[[obstacles]]\nat_m = [3.0, 0.0]\nradius_m = 0.5\n[[chains.tasks]]\nkind = \"targets\"\n\
         targets_m = [[1.0, 0.0], [3.0, 0.0], [1.0, 1.0]]\npatience_s = 1.0\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 3000);
    let metrics = run.metrics();
    assert!(run.is_over() && run.cycle() < 3000);
    let [given_up] = &metrics.given_up[..] else { panic!("{:?}", metrics.given_up) };
    assert_eq!((given_up.chain, given_up.what.task, given_up.what.part), (0, 0, 1));
    assert!((0.6 - 1e-6..0.7).contains(&given_up.what.nearest_m), "{given_up:?}");
    assert!(given_up.what.reason.is_some() && given_up.what.by.is_some(), "{given_up:?}");
    assert!((metrics.progress - 2.0 / 3.0).abs() < 1e-12, "{}", metrics.progress);
    let names: Vec<_> = events(&run, &rows).into_iter().map(|e| (e.1, e.4)).collect();
    for told in [("target", 0.0), ("given-up", 0.0), ("target", 2.0), ("done", 0.0)] {
        assert!(names.contains(&(told.0.into(), told.1)), "{told:?} in {names:?}");
    }
    assert_eq!(metrics.penetrations, 0);
}

#[test]
fn changes_take_effect_at_their_time() {
    let text = format!(
        "{PULLED}[[chains.changes]]\nat_s = 1.0\nconnector = 5\nfailed = true\n\
         [[chains.changes]]\nat_s = 2.0\nconnector = 5\nfailed = false\n\
         [[chains.changes]]\nat_s = 3.0\nconnector = 0\nmobility = \"fixed\"\n\
         [[chains.tasks]]\nkind = \"script\"\nscript = \"forward 10\"\nspeed_m_s = 0.5\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 50);
    let last = track(&rows, 5);
    let moves = |from: usize, to: usize| (from..to).filter(|&k| last[k] != last[k + 1]).count();
    assert_eq!((moves(0, 10), moves(10, 20), moves(20, 30), moves(30, 49)), (10, 0, 10, 0));
    let told = events(&run, &rows);
    let changed: Vec<_> = told.iter().filter(|e| e.1 == "changed").map(|e| (e.0, e.2)).collect();
    assert_eq!(changed, [(10, 5), (20, 5), (30, 0)]);
    let vetoes: Vec<_> =
        told.iter().filter(|e| e.1 == "veto").map(|e| (e.0, e.3.as_str())).collect();
    assert_eq!(vetoes, [(10, "failed"), (30, "fixed")]);
}

/// A chain that is led around a corner may bend as far as its limit says at the time.
#[test]
fn a_bend_limit_takes_effect_at_its_time() {
    let text = format!(
        "{PULLED}[[chains.changes]]\nat_s = 2.0\nconnector = 1\nmax_bend_deg = 30\n\
         [[chains.tasks]]\nkind = \"script\"\nscript = \"wait 3 turn 120 forward 2\"\npatience_s = 1\n"
    );
    let bend_deg = |text: &str| {
        let mut run = run::<2>(&source(1, text), 1);
        let mut most_deg = 0.0f64;
        while run.cycle() < 100 && !run.is_over() {
            run.advance(1);
            let bend_rad = run.state().body(0).chain.bend_rad(1).expect("an inner connector");
            most_deg = most_deg.max(bend_rad.to_degrees());
        }
        most_deg
    };
    assert!(bend_deg(&text) <= 30.0 + 1e-6, "{}", bend_deg(&text));
    let free = bend_deg(&text.replace("max_bend_deg = 30", "max_bend_deg = 180"));
    assert!(free > 60.0, "{free}");
}

#[test]
fn a_run_is_over_when_all_tasks_of_all_chains_are_done() {
    let mut run = run::<2>(&source(1, BROKEN), 1);
    let mut least = 0.0;
    while !run.is_over() {
        assert!(run.cycle() < 1000, "it never ends");
        run.advance(1);
        let progress = run.metrics().progress;
        assert!((0.0..=1.0).contains(&progress) && progress >= least - 1e-12, "{progress}");
        least = progress;
    }
    let metrics = run.metrics();
    assert_eq!((metrics.progress, metrics.reformed, metrics.done), (1.0, 1, 2));
    assert!(metrics.max_rod_violation_m <= 1e-9 && metrics.given_up.is_empty(), "{metrics:?}");
}

/// Of a time by time, of a script by motions, of targets by targets, without an end by the run.
#[test]
fn progress_means_what_the_task_asks_for() {
    let progress = |task: &str, cycles: u64| {
        let mut run = run::<2>(&source(1, &format!("{PULLED}[[chains.tasks]]\n{task}\n")), 1);
        advance_to(&mut run, cycles);
        run.metrics().progress
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a}, not {b}");
    near(progress("kind = \"rest\"\nlasts_s = 4.0", 10), 0.25);
    near(progress("kind = \"wander\"\nlasts_s = 4.0", 10), 0.25);
    // Without an end, by what can be done in the 2000 cycles of the run.
    near(progress("kind = \"wander\"\nturn_deg = 1", 10), 0.005);
    near(progress("kind = \"rest\"", 10), 0.005);
    let script = "kind = \"script\"\nscript = \"forward 0.5 turn 10 wait 100 forward 1\"";
    near(progress(script, 30), 0.5);
    near(progress("kind = \"targets\"\ntargets_m = [[0.5, 0.0], [9.0, 0.0]]", 30), 0.5);
    let two = "kind = \"rest\"\nlasts_s = 1.0\n[[chains.tasks]]\nkind = \"rest\"\nlasts_s = 2.0";
    near(progress(two, 20), 0.75);
    near(progress(two, 100), 1.0);
}

#[test]
fn what_moves_comes_back_in_the_table_of_movers() {
    let (run, rows) = recorded::<2>(&source(2, DODGING), 2, 40);
    let column = |name| rows.column("movers", name).expect("a column");
    let (Values::U64(cycle), Values::U32(who), Values::F64(x), Values::F64(y)) =
        (column("cycle"), column("obstacle"), column("x_m"), column("y_m"))
    else {
        panic!("other columns")
    };
    assert_eq!(cycle.len(), 40 * 14);
    let mut row = 0;
    for now in 0..40 {
        for (at, _) in balls(&run, now) {
            assert_eq!((cycle[row], [x[row], y[row]]), (now, at));
            row += 1;
        }
    }
    assert_eq!(who[..14], who[14..28]);
    assert_eq!(rows.rows("robots"), 0, "nothing is on wheels");
    let (_, swarm) = recorded::<2>(&source(2, SWARM), 1, 20);
    assert_eq!((swarm.rows("robots"), swarm.rows("movers")), (20 * 5, 20));
}
