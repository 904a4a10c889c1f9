//! Re-forming a broken chain (slide F3): the parts between two whole ends are scattered, or some of
//! them are missing.
//!
//! Passes from one stub (the last whole connector before the gap) to the other and back, each slave by
//! push, pull and resize, bring every rod into its limits; the whole ends keep every bit. Where the
//! parts only just reach, passes converge too slowly, and the parts are laid out instead. If the gap is
//! longer than the remaining parts, one end is pulled nearer, if it is allowed to move.

use super::candidates::guide_line_slave_position;
use super::chain::{Chain, LENGTH_TOLERANCE_M, Rod};
use super::geometry::{Point, distance, lerp};
use super::motion_context::is_length_allowed;
use super::obstacle::Obstacles;
use super::pass::ChainDirection;
use super::propagate::Propagator;
use super::span::joint_positions_across_gap;
use super::veto::MotionRequest;
use sidestep_kernel::InputError;
use std::ops::RangeInclusive;

/// Largest number of double passes before the parts are laid out. Where they reach with room to spare, 1,800 random
/// cases took 1 or 2 in the median and 120 at worst.
const MAX_DOUBLE_PASSES: usize = 1_000;
/// Ratio of the gap to the reach of the scattered parts from which on they are laid out on a line: passes straighten
/// stretched parts ever more slowly.
const STRETCH_RATIO: f64 = 0.999;
/// Ratio of the gap to the reach of the scattered parts that an end leaves when it is pulled nearer: with 5 % of slack
/// passes converge fast.
const SLACK_RATIO: f64 = 0.95;

/// The whole end that may move nearer if the gap is too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MovableEnd {
    /// Neither end.
    Nobody,
    /// The end with connector 0.
    First,
    /// The end with the last connector.
    Last,
}

/// Outcome of re-forming.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReformResult {
    /// All rods are within their limits again.
    Whole {
        /// Number of passes there and back.
        double_passes: usize,
    },
    /// The parts between the ends are too short; nothing has changed.
    GapTooLong {
        /// Reach of the parts, meters.
        have_m: f64,
        /// Reach that they would need, meters.
        need_m: f64,
        /// Least number of further parts, each on the longest of their rods, that would do.
        missing: usize,
    },
    /// The parts cannot be joined, because one rod is longer than the gap and all other rods, or an
    /// end could not be pulled near enough; nothing has changed.
    NotReached {
        /// Error of the worst rod, meters.
        off_m: f64,
    },
}

/// Brings the scattered connectors of a chain back between the two whole ends beside them. An end
/// that may move is pulled as a chain of its own; the other keeps every bit. Obstacles are ignored:
/// move the whole chain afterwards to avoid them.
///
/// # Errors
/// When the chain does not have the scattered connectors, or there is no connector beside them on
/// both sides.
pub fn reform_chain<const D: usize>(
    chain: &mut Chain<D>,
    scattered: RangeInclusive<usize>,
    movable: MovableEnd,
) -> Result<ReformResult, InputError> {
    let first = *scattered.start();
    let last = *scattered.end();
    check_scattered_range(chain, first, last)?;
    let before = chain.points().to_vec();
    let low = first - 1;
    let high = last + 1;
    let have_m: f64 = chain.rods()[low..high].iter().map(|r| r.max_m).sum();
    let need_m = distance(chain.points()[low], chain.points()[high]);
    if need_m > have_m + LENGTH_TOLERANCE_M {
        match movable {
            MovableEnd::Nobody => {
                let missing = count_missing_rods(&chain.rods()[low..high], need_m - have_m);
                return Ok(ReformResult::GapTooLong { have_m, need_m, missing });
            }
            MovableEnd::First => pull_end(chain, 0..=low, high, have_m)?,
            MovableEnd::Last => pull_end(chain, high..=chain.points().len() - 1, low, have_m)?,
        }
    }
    lay_out(chain, low, high, have_m);
    for double_passes in 0..MAX_DOUBLE_PASSES {
        if is_whole(chain, low, high) {
            return Ok(ReformResult::Whole { double_passes });
        }
        run_pass(chain, low, high, ChainDirection::Up);
        run_pass(chain, high, low, ChainDirection::Down);
    }
    if !is_whole(chain, low, high) {
        let [a, b] = [chain.points()[low], chain.points()[high]];
        let places = joint_positions_across_gap(a, b, &chain.rods()[low..high]);
        chain.points_mut()[first..=last].copy_from_slice(&places);
    }
    if is_whole(chain, low, high) {
        return Ok(ReformResult::Whole { double_passes: MAX_DOUBLE_PASSES });
    }
    let off_m = chain.max_rod_violation_m();
    chain.points_mut().copy_from_slice(&before);
    Ok(ReformResult::NotReached { off_m })
}

fn check_scattered_range<const D: usize>(
    chain: &Chain<D>,
    first: usize,
    last: usize,
) -> Result<(), InputError> {
    if 0 < first && first <= last && last + 1 < chain.points().len() {
        return Ok(());
    }
    let cause = format!("are {first} to {last}, of a chain of {}", chain.points().len());
    Err(InputError::new("scattered connectors", cause, "leave a whole end on both sides"))
}

/// Returns whether all rods between two connectors are within their limits.
fn is_whole<const D: usize>(chain: &Chain<D>, low: usize, high: usize) -> bool {
    (low..high).all(|i| is_length_allowed(chain.rods()[i], chain.length_m(i)))
}

/// Returns the least number of rods, each as long as the longest, that fill a gap.
fn count_missing_rods(rods: &[Rod], gap_m: f64) -> usize {
    let longest_m = rods.iter().map(|rod| rod.max_m).fold(0.0, f64::max);
    // A gap of a whole number of rods needs no further part because of rounding.
    ((gap_m - LENGTH_TOLERANCE_M) / longest_m).ceil().max(1.0) as usize
}

/// Lays the parts on the straight line between the stubs if they only just reach across the gap,
/// because passes would converge to that line without end.
fn lay_out<const D: usize>(chain: &mut Chain<D>, low: usize, high: usize, have_m: f64) {
    let [a, b] = [chain.points()[low], chain.points()[high]];
    let stretch = distance(a, b) / have_m;
    let mut rods = chain.rods()[low..high].iter();
    let all_fit = rods.all(|rod| is_length_allowed(*rod, stretch * rod.max_m));
    if stretch < STRETCH_RATIO || !all_fit {
        return;
    }
    let mut along_m = 0.0;
    for i in low..high - 1 {
        along_m += chain.rods()[i].max_m;
        chain.points_mut()[i + 1] = lerp(a, b, along_m / have_m);
    }
}

/// Passes from one stub to the connector before the other.
fn run_pass<const D: usize>(
    chain: &mut Chain<D>,
    from: usize,
    to: usize,
    direction: ChainDirection,
) {
    let min_move_m = chain.min_move_m();
    let mut master = from;
    let mut mo = chain.points()[from];
    while let Some(slave) = direction.next(master, chain.points().len()).filter(|&s| s != to) {
        let mn = chain.points()[master];
        let so = chain.points()[slave];
        let rod = chain.rod_between(master, slave);
        chain.points_mut()[slave] = guide_line_slave_position([mo, mn, so], rod, min_move_m);
        master = slave;
        mo = so;
    }
}

/// Pulls a whole end, as a chain of its own, until the parts reach across the gap.
fn pull_end<const D: usize>(
    chain: &mut Chain<D>,
    end: RangeInclusive<usize>,
    other_stub: usize,
    have_m: f64,
) -> Result<(), InputError> {
    let low = *end.start();
    let high = *end.end();
    let stub = if low == 0 { high } else { low };
    let at = chain.points()[stub];
    let to = chain.points()[other_stub];
    // Passes converge slowly where the parts are stretched out, so they get some slack.
    let fraction = 1.0 - SLACK_RATIO * have_m / distance(at, to);
    let target: Point<D> = lerp(at, to, fraction);
    let mut alone = chain.part(low..high + 1)?;
    let request = MotionRequest::from_operator(stub - low, target);
    // If the end cannot move, the check of all rods that follows says so.
    let _ = Propagator::default().propagate(&mut alone, &Obstacles::default(), &request)?;
    chain.points_mut()[low..=high].copy_from_slice(alone.points());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::chain::Connector;
    use super::super::geometry::add;
    use super::*;
    use crate::fixtures::TestRng;

    fn broken<const D: usize>(seed: u64, scattered: RangeInclusive<usize>, by_m: f64) -> Chain<D> {
        let mut numbers = TestRng::new(seed);
        let mut points: Vec<Point<D>> = (0..40)
            .map(|i| {
                let mut p = [0.0; D];
                p[0] = i as f64;
                p
            })
            .collect();
        for i in scattered {
            points[i] = add(points[i], numbers.point(by_m));
        }
        let rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.0 };
        Chain::new_broken(points, vec![Connector::free(0.0); 40], vec![rod; 39]).unwrap()
    }

    #[test]
    fn scattered_parts_come_back_and_the_ends_keep_every_bit() {
        for seed in 0..60 {
            let n = [4, 10, 20][seed as usize % 3];
            let scattered = 20 - n / 2..=20 + n / 2 - 1;
            let mut chain =
                broken::<2>(seed, scattered.clone(), [1.0, 10.0, 100.0][seed as usize / 20]);
            let before = chain.clone();
            let result = reform_chain(&mut chain, scattered.clone(), MovableEnd::Nobody).unwrap();
            assert!(matches!(result, ReformResult::Whole { .. }), "{seed}: {result:?}");
            assert!(chain.max_rod_violation_m() <= 1e-9);
            assert_eq!(chain.points()[..*scattered.start()], before.points()[..*scattered.start()]);
            assert_eq!(
                chain.points()[scattered.end() + 1..],
                before.points()[scattered.end() + 1..]
            );
        }
    }

    /// The layout of a scenario: every rod at its greatest length.
    #[test]
    fn parts_that_only_just_reach_across_lie_on_a_line() {
        for (rod_m, n) in [(1.1, 40), (0.3, 30), (0.7, 12)] {
            let rod = Rod { min_m: 0.9 * rod_m, max_m: rod_m, radius_m: 0.0 };
            let mut chain =
                Chain::straight([0.0; 2], [1.0, 0.0], n - 1, rod, Connector::free(0.0)).unwrap();
            let mut numbers = TestRng::new(n as u64);
            for p in &mut chain.points_mut()[3..n - 2] {
                *p = add(*p, numbers.point(5.0));
            }
            let result = reform_chain(&mut chain, 3..=n - 3, MovableEnd::Nobody).unwrap();
            assert_eq!(result, ReformResult::Whole { double_passes: 0 });
            assert!(chain.max_rod_violation_m() <= 1e-9);
        }
    }

    #[test]
    fn a_gap_too_long_is_reported_unless_an_end_may_move() {
        let mut chain = broken::<3>(1, 18..=21, 3.0);
        // Two parts are missing: the far end is two rods further away.
        for p in &mut chain.points_mut()[22..] {
            p[0] += 2.0;
        }
        let before = chain.clone();
        let result = reform_chain(&mut chain, 18..=21, MovableEnd::Nobody).unwrap();
        let ReformResult::GapTooLong { have_m, need_m, missing } = result else {
            panic!("{result:?}")
        };
        assert!((have_m - 5.5).abs() < 1e-12 && (need_m - 7.0).abs() < 1e-12);
        assert_eq!(missing, 2, "1.5 m of rods of 1.1 m");
        assert_eq!(chain, before);
        let result = reform_chain(&mut chain, 18..=21, MovableEnd::Last).unwrap();
        assert!(matches!(result, ReformResult::Whole { .. }), "{result:?}");
        assert!(chain.max_rod_violation_m() <= 1e-9);
        assert_eq!(chain.points()[..18], before.points()[..18]);
        assert!(reform_chain(&mut chain, 0..=3, MovableEnd::Nobody).is_err());
    }

    /// Chains with missing parts, so that those left reach across the gap with `part` of their length.
    fn chain_with_missing_parts<const D: usize>(seed: u64, part: f64) -> Chain<D> {
        let mut numbers = TestRng::new(seed);
        let parts = 3 + seed as usize % 18;
        let gap_m = part * 1.1 * (parts + 1) as f64;
        let mut points: Vec<Point<D>> = (0..parts + 6).map(|_| numbers.point(5.0)).collect();
        for k in 0..3 {
            for (at, x_m) in [(k, k as f64), (parts + 3 + k, 2.0 + gap_m + k as f64)] {
                points[at] = [0.0; D];
                points[at][0] = x_m;
            }
        }
        let n = points.len();
        let rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.0 };
        Chain::new_broken(points, vec![Connector::free(0.0); n], vec![rod; n - 1]).unwrap()
    }

    #[test]
    fn all_that_just_reach_are_joined_and_all_that_do_not_are_refused() {
        for seed in 0..400 {
            let part = 1.01 - 0.02 * (seed as f64 / 400.0) * (seed as f64 / 400.0);
            let mut chain = chain_with_missing_parts::<2>(seed, part);
            let scattered = 3..=chain.points().len() - 4;
            let result = reform_chain(&mut chain, scattered, MovableEnd::Nobody).unwrap();
            let reaches = part <= 1.0;
            assert_eq!(
                matches!(result, ReformResult::Whole { .. }),
                reaches,
                "{seed}: {part}, {result:?}"
            );
            assert!(!reaches || chain.max_rod_violation_m() <= 1e-9);
        }
    }

    /// Passes along a line never leave it, so they cannot fold rods of fixed length.
    #[test]
    fn parts_on_a_line_fold_where_they_are_too_long_for_the_gap() {
        let rod = Rod::with_fixed_length(1.0, 0.0);
        let points: Vec<Point<3>> = (0..8).map(|i| [0.7 * i as f64, 0.0, 0.0]).collect();
        let mut chain =
            Chain::new_broken(points, vec![Connector::free(0.0); 8], vec![rod; 7]).unwrap();
        let result = reform_chain(&mut chain, 1..=6, MovableEnd::Nobody).unwrap();
        assert!(matches!(result, ReformResult::Whole { .. }), "{result:?}");
        assert!(chain.max_rod_violation_m() <= 1e-9);
    }
}
