//! Laws and metrics of chains, counted again from their states by geometry of its own.

use super::*;

fn sub<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|i| a[i] * b[i]).sum()
}

fn apart<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    sub(a, b).iter().fold(0.0, |all, x| hypot(all, *x))
}

/// Returns the distance from a point to a segment.
fn to_segment<const D: usize>(p: [f64; D], [a, b]: [[f64; D]; 2]) -> f64 {
    let d = sub(b, a);
    let part = (dot(sub(p, a), d) / dot(d, d).max(1e-300)).clamp(0.0, 1.0);
    apart(p, std::array::from_fn(|i| a[i] + part * d[i]))
}

/// Returns the distance between two segments, by ternary search: the distance along one is convex.
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

/// Returns whether the boxes of two segments are half a meter apart.
fn are_far<const D: usize>(one: [[f64; D]; 2], two: [[f64; D]; 2]) -> bool {
    let lo = |[a, b]: [[f64; D]; 2], i: usize| a[i].min(b[i]);
    let hi = |[a, b]: [[f64; D]; 2], i: usize| a[i].max(b[i]);
    (0..D).any(|i| lo(one, i) > hi(two, i) + 0.5 || lo(two, i) > hi(one, i) + 0.5)
}

/// Connectors and rods of a chain as capsules.
fn parts<const D: usize>(run: &TestRun<D>, slot: usize) -> Vec<([[f64; D]; 2], f64)> {
    let body = run.state().body(slot);
    let (points, chain) = (body.chain.points(), &body.chain);
    let balls = points.iter().zip(chain.connectors()).map(|(p, c)| ([*p; 2], c.radius_m));
    let rods = points.windows(2).zip(chain.rods()).map(|(w, rod)| ([w[0], w[1]], rod.radius_m));
    balls.chain(rods).collect()
}

/// The least distance of a chain from balls.
fn clearance<const D: usize>(run: &TestRun<D>, slot: usize, balls: &[([f64; D], f64)]) -> f64 {
    let least = |(ends, radius_m): ([[f64; D]; 2], f64)| {
        let to = |(at, r): &([f64; D], f64)| to_segment(*at, ends) - r - radius_m;
        balls.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    parts(run, slot).into_iter().map(least).fold(f64::INFINITY, f64::min)
}

/// All balls of a world at a cycle.
pub(super) fn balls<const D: usize>(run: &TestRun<D>, cycle: u64) -> Vec<([f64; D], f64)> {
    use sidestep::rods::geometry::ConvexCore;
    let world = run.world();
    let moving: Vec<_> = world.movers.at(world.cycle_start_time_s(cycle)).collect();
    let all = world.obstacles.still().iter().chain(&moving);
    let ball = |core: &ConvexCore<D>, radius_m: f64| match core {
        ConvexCore::Point(at) => (*at, radius_m),
        other => panic!("{other:?} is no ball"),
    };
    all.map(|o| ball(&o.core, o.radius_m)).collect()
}

/// Steps a world cycle by cycle, and counts the same quantities as its metrics, from its state alone.
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
