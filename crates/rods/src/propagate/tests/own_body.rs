//! No two parts of a chain pass through each other, whatever their proportions. The judge knows nothing of the checks
//! that a motion makes: it looks at recorded positions, at the sign of the triple product of two rods in space and at
//! crossings in the plane.

use super::*;
use crate::fixtures::own_clearance_m;
use crate::geometry::{cross, cross_2d, dot, lerp, segments_cross};
use crate::reach::{ReachRequest, reach_target};

const TOLERANCE_M: f64 = 1.1e-9;
/// Times between two records at which the judge looks in the plane.
const LOOKS: usize = 40;

/// Returns six times the signed volume of the tetrahedron of two rods: it is zero where they are in one plane, and only
/// there they can cross.
fn volume(rods: [[Point<3>; 2]; 2]) -> f64 {
    let [[a, b], [c, d]] = rods;
    dot(cross(sub(b, a), sub(c, a)), sub(d, a))
}

/// Returns whether two rods in one plane cross: in the projection onto that plane.
fn cross_in_their_plane([[a, b], [c, d]]: [[Point<3>; 2]; 2]) -> bool {
    let normal = cross(sub(b, a), sub(d, c));
    let drop = (0..3).max_by(|i, j| normal[*i].abs().total_cmp(&normal[*j].abs())).unwrap();
    let flat = |p: Point<3>| [p[(drop + 1) % 3], p[(drop + 2) % 3]];
    segments_cross([flat(a), flat(b)], [flat(c), flat(d)])
}

/// Returns whether two rods pass through each other on the straight way between two records.
fn passes<const D: usize>(at: &dyn Fn(f64) -> [[Point<D>; 2]; 2]) -> bool {
    if D == 2 {
        return (0..=LOOKS).any(|k| {
            let [one, other] = at(k as f64 / LOOKS as f64);
            segments_cross(one, other)
        });
    }
    let in_space = |time: f64| {
        at(time).map(|rod| rod.map(|p| std::array::from_fn(|i| if i < D { p[i] } else { 0.0 })))
    };
    // The volume is a cubic of the time: between four looks it has every sign that it takes.
    let times: Vec<f64> = (0..=LOOKS).map(|k| k as f64 / LOOKS as f64).collect();
    times.windows(2).any(|span| {
        let [mut low, mut high] = [span[0], span[1]];
        let sign = volume(in_space(low)).signum();
        if volume(in_space(high)).signum() == sign {
            return false;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if volume(in_space(middle)).signum() == sign {
                low = middle;
            } else {
                high = middle;
            }
        }
        cross_in_their_plane(in_space(high))
    })
}

/// Asserts that a chain has come from one record to the next without passing through itself, and overlaps nowhere.
fn judge<const D: usize>(chain: &Chain<D>, before: &[Point<D>], what: &str) {
    let after = chain.points();
    let gap_m = own_clearance_m(chain);
    assert!(gap_m >= -TOLERANCE_M, "{what}: {gap_m} m to itself");
    let rods = chain.rods().len();
    for i in 0..rods {
        for j in i + 2..rods {
            let at = |time: f64| {
                [i, j].map(|rod| [rod, rod + 1].map(|k| lerp(before[k], after[k], time)))
            };
            assert!(!passes(&at), "{what}: rods {i} and {j} pass through each other");
        }
        // Neighbors in the plane pass where one is folded over the other.
        if D == 2 && i + 1 < rods {
            let turn = |k: usize| {
                let time = k as f64 / LOOKS as f64;
                let [a, b, c] = [i, i + 1, i + 2].map(|k| lerp(before[k], after[k], time));
                (cross_2d(sub(b, a), sub(c, b)), dot(sub(b, a), sub(c, b)))
            };
            let folds = (0..LOOKS).any(|k| {
                let [(was, was_ahead), (is, is_ahead)] = [turn(k), turn(k + 1)];
                was * is < 0.0 && was_ahead < 0.0 && is_ahead < 0.0
            });
            assert!(!folds, "{what}: rods {i} and {} fold over each other", i + 1);
        }
    }
}

/// What holds a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hold {
    Free,
    Fixed,
    Rail,
}

/// A chain of random proportions: radii of 0.5 to 50 % of its rods, bends of up to a right angle.
fn any_chain<const D: usize>(numbers: &mut TestRng, hold: Hold) -> Chain<D> {
    let n_rods = 4 + (22.0 * numbers.unit()) as usize;
    // As many thin ones as thick ones, by magnitude.
    let part = 0.005 * sidestep_kernel::math::exp(2.0 * numbers.unit() * std::f64::consts::LN_10);
    let radius_m = part.min(0.5);
    let rod_radius_m = if numbers.unit() < 0.5 { radius_m } else { radius_m * numbers.unit() };
    let slack_m = if numbers.unit() < 0.5 { 0.0 } else { 0.003 };
    let rod = Rod { min_m: 1.0 - slack_m, max_m: 1.0 + slack_m, radius_m: rod_radius_m };
    loop {
        let mut walk = Wanderer::<D>::new((1e9 * numbers.unit()) as u64);
        let mut points = vec![[0.0; D]];
        for i in 0..n_rods {
            points.push(walk.next(points[i], 1.0));
        }
        let connectors = vec![Connector::free(radius_m); n_rods + 1];
        let mut chain = Chain::new(points, connectors, vec![rod; n_rods]).unwrap();
        if own_clearance_m(&chain) < 1e-6 {
            continue;
        }
        let mut end = [0.0; D];
        end[0] = 1.5;
        match hold {
            Hold::Free => {}
            Hold::Fixed => chain.set_mobility(0, Mobility::Fixed).unwrap(),
            Hold::Rail => {
                let rail = Mobility::OnSegment([scaled(end, -1.0), end]);
                chain.set_mobility(0, rail).unwrap();
            }
        }
        return chain;
    }
}

/// Leads a chain of random proportions into itself; returns the numbers of motions and of vetoes.
fn lead<const D: usize>(seed: u64, hold: Hold) -> [usize; 2] {
    let mut numbers = TestRng::new(seed);
    let mut chain = any_chain::<D>(&mut numbers, hold);
    let mut propagator = Propagator::new(own());
    let obstacles = Obstacles::default();
    let n = chain.points().len();
    let k =
        if numbers.unit() < 0.5 { n - 1 } else { 1 + ((n - 1) as f64 * numbers.unit()) as usize };
    // Sub-steps of thin chains are so short that several make a record, as in a run.
    let step_m = chain.step_m().max(0.01) * numbers.uniform(0.5, 1.0);
    let what =
        format!("seed {seed}, {hold:?}, {D} dimensions, radius {}", chain.connectors()[0].radius_m);
    let mut target: Point<D> = chain.points()[0];
    let mut counts = [0, 0];
    for step in 0..150 {
        // Toward other parts of the chain, where it meets itself.
        if step % 30 == 0 {
            target = chain.points()[(n as f64 * numbers.unit()) as usize];
        }
        let before = chain.points().to_vec();
        let toward = sub(target, before[k]);
        let by =
            add(scaled(toward, step_m / norm(toward).max(step_m)), numbers.point(0.3 * step_m));
        let to = add(before[k], by);
        let has_moved = if hold == Hold::Free {
            let request = MotionRequest::from_operator(k, to);
            propagator.propagate(&mut chain, &obstacles, &request).unwrap().motion().is_some()
        } else {
            let request = ReachRequest { k, target: to, base: 0, tolerance_m: 1e-7 };
            let outcome = reach_target(&mut propagator, &mut chain, &obstacles, &request).unwrap();
            matches!(outcome, crate::reach::ReachOutcome::There { .. })
        };
        counts[usize::from(!has_moved)] += 1;
        judge(&chain, &before, &what);
    }
    counts
}

fn lead_many(seeds: std::ops::Range<u64>) {
    for hold in [Hold::Free, Hold::Fixed, Hold::Rail] {
        let mut sum = [0, 0];
        for seed in seeds.clone() {
            for counts in [lead::<2>(seed, hold), lead::<3>(seed, hold)] {
                sum = [sum[0] + counts[0], sum[1] + counts[1]];
            }
        }
        let [moves, vetoes] = sum;
        assert!(moves > vetoes && vetoes > 0, "{hold:?}: {moves} motions, {vetoes} vetoes");
    }
}

#[test]
fn no_two_parts_pass_through_each_other_at_any_proportion() {
    lead_many(0..25);
}

#[test]
#[ignore = "minutes: for .ci/soak"]
fn no_two_parts_of_many_more_chains_pass_through_each_other() {
    lead_many(25..1500);
}

/// A chain that is about to close to a ring has no direction along which all of its rods point forward.
#[test]
fn the_ends_of_a_chain_do_not_meet_in_one_place() {
    let rod = Rod { min_m: 0.5, max_m: 1.5, radius_m: 0.05 };
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut chain = Chain::new(points, vec![Connector::free(0.05); 4], vec![rod; 3]).unwrap();
    let rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    let mut propagator = Propagator::new(rules);
    let mode = VetoEffect::AsFarAsPossible;
    let request = MotionRequest { mode, ..MotionRequest::from_operator(3, [0.0, 0.0]) };
    propagator.propagate(&mut chain, &Obstacles::default(), &request).unwrap();
    let apart_m = distance(chain.points()[0], chain.points()[3]);
    assert!(apart_m > 0.1 - TOLERANCE_M, "{apart_m}");
}

/// The gaps of a thin chain say nothing about a thick one of as many connectors at the same places: the head of a chain
/// that lies double moves toward its tail.
#[test]
fn chains_that_share_a_propagator_move_as_if_each_had_its_own() {
    let strand = |y: f64| (0..10).map(move |i| [0.5 * f64::from(i), y]);
    let points: Vec<_> = strand(0.0).chain(strand(0.21).rev()).collect();
    let double = |radius_m: f64| {
        let rod = Rod { min_m: 0.2, max_m: 0.5, radius_m };
        Chain::new(points.clone(), vec![Connector::free(radius_m); 20], vec![rod; 19]).unwrap()
    };
    let (mut thin, mut thick) = (double(0.01), double(0.1));
    let rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    let mut propagator = Propagator::new(rules);
    for (chain, up_m) in [(&mut thin, 0.001), (&mut thick, 0.03)] {
        let mode = VetoEffect::AsFarAsPossible;
        let request = MotionRequest { mode, ..MotionRequest::from_operator(0, [0.0, up_m]) };
        propagator.propagate(chain, &Obstacles::default(), &request).unwrap();
    }
    let apart_m = distance(thick.points()[0], thick.points()[19]);
    assert!(apart_m > 0.2 - TOLERANCE_M, "{apart_m}");
}
