//! Shortcuts on a path of an arm's joints, between any two points of it: trees leave corners in the middle of long
//! straight pieces, and between postures alone those would stay.
//!
//! Source: Geraerts and Overmars, "Creating high-quality paths for motion planning", The International Journal of
//! Robotics Research 26, 2007.

use super::ConfigurationSpace;
use super::joints::JointSpace;
use sidestep_kernel::interrupt;
use sidestep_kernel::stream::Draws;

/// Shortcuts that are tried at most.
const MAX_SHORTCUTS: usize = 150;
/// Shortcuts without a gain after which no more are tried: gains have become rare.
const MAX_FAILURES: usize = 40;
/// Least gain of a shortcut, as a fraction of the piece that it replaces; less is not worth the check.
const MIN_GAIN_FRACTION: f64 = 0.01;

/// A point on a path.
struct PathPoint {
    /// The number of the path's posture before it.
    after: usize,
    joints: Vec<f64>,
    /// Time on the path before it, s.
    at_s: f64,
}

/// Returns a path, given by the postures after the present one, with shortcuts.
pub(super) fn shorten_joint_path<const D: usize>(
    space: &JointSpace<'_, D>,
    path: Vec<Vec<f64>>,
    draws: &mut Draws,
) -> Vec<Vec<f64>> {
    let mut whole = vec![space.present_posture()];
    whole.extend(path);
    let mut failures = 0;
    for _ in 0..MAX_SHORTCUTS {
        if whole.len() < 3 || failures == MAX_FAILURES {
            break;
        }
        interrupt::check();
        failures = if try_shortcut(space, &mut whole, draws) { 0 } else { failures + 1 };
    }
    whole.split_off(1)
}

/// Tries a shortcut between two random points of a path; returns whether there was one.
fn try_shortcut<const D: usize>(
    space: &JointSpace<'_, D>,
    path: &mut Vec<Vec<f64>>,
    draws: &mut Draws,
) -> bool {
    let duration_s: f64 = path.windows(2).map(|pair| space.duration_s(&pair[0], &pair[1])).sum();
    let [one_s, other_s] = [0, 1].map(|_| draws.uniform() * duration_s);
    let from = point_at(space, path, one_s.min(other_s));
    let to = point_at(space, path, one_s.max(other_s));
    // On one straight piece there is none.
    if from.after == to.after {
        return false;
    }
    let replaced_s = to.at_s - from.at_s;
    let straight_s = space.duration_s(&from.joints, &to.joints);
    if straight_s > (1.0 - MIN_GAIN_FRACTION) * replaced_s
        || !space.is_path_free(&from.joints, &to.joints)
    {
        return false;
    }
    path.splice(from.after + 1..=to.after, [from.joints, to.joints]);
    true
}

/// Returns the point of a path after a time on it.
fn point_at<const D: usize>(space: &JointSpace<'_, D>, path: &[Vec<f64>], at_s: f64) -> PathPoint {
    let mut passed_s = 0.0;
    for (after, pair) in path.windows(2).enumerate() {
        let piece_s = space.duration_s(&pair[0], &pair[1]);
        if passed_s + piece_s >= at_s && piece_s > 0.0 {
            let joints = space.interpolate(&pair[0], &pair[1], (at_s - passed_s) / piece_s);
            return PathPoint { after, joints, at_s };
        }
        passed_s += piece_s;
    }
    // By rounding, the end may be before it.
    PathPoint { after: path.len() - 2, joints: path[path.len() - 1].clone(), at_s: passed_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::joints::tests::{arm, with_space};
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};
    use sidestep_rods::Obstacles;

    fn draws(seed: u64) -> Draws {
        Streams::new(Seed(seed)).draws(0, 0, Purpose(9))
    }

    fn duration_s<const D: usize>(space: &JointSpace<'_, D>, path: &[Vec<f64>]) -> f64 {
        let starts = std::iter::once(space.present_posture()).chain(path.iter().cloned());
        starts.zip(path).map(|(from, to)| space.duration_s(&from, to)).sum()
    }

    #[test]
    fn a_corner_in_free_space_is_cut_until_the_path_is_nearly_straight() {
        with_space(&arm(), &Obstacles::default(), |space| {
            let start = space.present_posture();
            let end: Vec<f64> = start.iter().map(|x| x + 0.3).collect();
            let mut corner = end.clone();
            corner[0] = start[0] - 0.6;
            let path = vec![corner.clone(), end.clone()];
            let before_s = duration_s(space, &path);
            let straight_s = space.duration_s(&start, &end);
            for seed in 0..5 {
                let short = shorten_joint_path(space, path.clone(), &mut draws(seed));
                assert_eq!(short.last(), Some(&end));
                let after_s = duration_s(space, &short);
                assert!(after_s < straight_s + 0.1 * (before_s - straight_s), "{seed}: {after_s}");
                assert_eq!(short, shorten_joint_path(space, path.clone(), &mut draws(seed)));
            }
        });
    }

    #[test]
    fn points_of_a_path_are_where_its_time_says() {
        with_space(&arm(), &Obstacles::default(), |space| {
            let start = space.present_posture();
            let [mut middle, mut end] = [start.clone(), start.clone()];
            middle[0] += 0.2;
            end[0] += 0.2;
            end[1] += 0.4;
            let path = vec![start.clone(), middle.clone(), end.clone()];
            let speeds: Vec<f64> = space.arm().motion.reference_speeds().collect();
            let [first_s, second_s] = [0.2 / speeds[0], 0.4 / speeds[1]];
            let half = point_at(space, &path, first_s + 0.5 * second_s);
            assert_eq!(half.after, 1);
            assert!((half.joints[1] - start[1] - 0.2).abs() < 1e-12);
            assert_eq!(point_at(space, &path, 2.0 * (first_s + second_s)).joints, end);
        });
    }
}
