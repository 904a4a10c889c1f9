//! An initiator on wheels that navigates with a laser, and its goal (slides N1 to N6).

use super::swarm::drive::DifferentialDrive;
use super::swarm::leader::{LeaderController, TurnMode};
use sidestep_rods::geometry::{Point, distance};
use std::ops::Range;

/// Distance before the end of a line at which the end counts as reached, meters: a corridor is open at its end, where a
/// leader may turn aside and never pass the last point itself.
const END_TOLERANCE_M: f64 = 0.5;

/// Points of a line ahead among which a navigator looks for the one that it has reached: a meter of a corridor's middle.
/// A leader that cuts a bend passes some of them no nearer than the one before; the next leg of a hairpin is farther on.
const LOOKAHEAD_POINTS: usize = 10;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Navigator {
    pub(crate) leader: LeaderController,
    pub(crate) drive: DifferentialDrive,
    /// Its destination; without one it never stops.
    pub(crate) goal: Option<NavigationGoal>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NavigationGoal {
    /// A place that it can detect.
    Target {
        /// Where it is, meters.
        at: Point<2>,
        /// Distance at which the place counts as reached, meters.
        tolerance_m: f64,
    },
    /// The end of the middle of a corridor, which the navigator does not know.
    EndOf {
        /// Points of the middle; at least two.
        line: Vec<Point<2>>,
        /// Width of the corridor, meters.
        width_m: f64,
    },
}

impl Navigator {
    pub(crate) fn can_turn_on_the_spot(&self) -> bool {
        self.leader.turning == TurnMode::OnTheSpotWhereBlocked
    }
}

impl NavigationGoal {
    /// Returns the target that the leader can detect.
    pub(crate) fn target(&self) -> Option<Point<2>> {
        match self {
            Self::Target { at, .. } => Some(*at),
            Self::EndOf { .. } => None,
        }
    }

    /// Returns the point of the line at which a navigator at `at` begins: the first one beside which it is in the
    /// corridor, because a corridor may come back to where it was; the nearest one if it is outside.
    pub(crate) fn start_waypoint_index(&self, at: Point<2>) -> usize {
        let Self::EndOf { line, width_m } = self else { return 0 };
        match line.iter().position(|&p| distance(p, at) <= 0.5 * width_m) {
            Some(first) => last_approaching_index(line, first, at),
            None => nearest(line, 0..line.len(), at).unwrap_or(0),
        }
    }

    /// Returns the point of the line that a navigator at `at` has reached, if it was at `index`: it goes on while points
    /// come nearer, also beyond some that do not.
    pub(crate) fn reached_index(&self, at: Point<2>, mut index: usize) -> usize {
        let Self::EndOf { line, .. } = self else { return index };
        loop {
            let here = last_approaching_index(line, index, at);
            let ahead = here..(here + 1 + LOOKAHEAD_POINTS).min(line.len());
            match nearest(line, ahead, at).filter(|&i| i > here) {
                Some(further) => index = further,
                None => return here,
            }
        }
    }

    pub(crate) fn is_reached(&self, at: Point<2>, index: usize) -> bool {
        match self {
            Self::Target { at: target, tolerance_m } => distance(at, *target) <= *tolerance_m,
            // All the rest of the line is near its end: near it alone is also the start of a line that comes
            // back.
            Self::EndOf { line, .. } => {
                let end = line[line.len() - 1];
                line[index..].iter().all(|&p| distance(p, end) <= END_TOLERANCE_M)
            }
        }
    }

    /// Returns the fraction of the path that is done: by the points of a line from where it began, or by the
    /// distance left to a target compared with the distance at the start.
    pub(crate) fn progress(&self, index: usize, start: Point<2>, nearest_m: f64) -> f64 {
        match self {
            Self::Target { at, .. } if nearest_m.is_finite() => {
                // At least 1 nm, or a start on the target would divide by zero.
                1.0 - nearest_m / distance(start, *at).max(nearest_m).max(1e-9)
            }
            Self::Target { .. } => 0.0,
            Self::EndOf { line, .. } => {
                let first = self.start_waypoint_index(start);
                let left = (line.len() - 1).saturating_sub(first);
                index.saturating_sub(first) as f64 / left.max(1) as f64
            }
        }
    }
}

/// Returns the last point of a line up to which all from `index` on come nearer.
fn last_approaching_index(line: &[Point<2>], index: usize, at: Point<2>) -> usize {
    let last = line.len() - 1;
    let farther = (index..last).find(|&i| {
        let is_nearing = distance(line[i + 1], at) <= distance(line[i], at);
        !is_nearing
    });
    farther.unwrap_or(last)
}

/// Returns the nearest of some points of a line; of equals the first.
fn nearest(line: &[Point<2>], among: Range<usize>, at: Point<2>) -> Option<usize> {
    among.min_by(|&a, &b| distance(line[a], at).total_cmp(&distance(line[b], at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::{Corridor, CorridorLeg};

    /// Two legs of 5 m, 4 m apart, and the way from one to the other.
    fn hairpin() -> NavigationGoal {
        let leg = |y: f64, x: &dyn Fn(f64) -> f64| {
            (0..50).map(|k| [x(0.1 * f64::from(k)), y]).collect::<Vec<_>>()
        };
        let turn = (0..40).map(|k| [5.0, 0.1 * f64::from(k)]);
        let there = leg(0.0, &|x| x);
        let line = there.into_iter().chain(turn).chain(leg(4.0, &|x| 5.0 - x)).collect();
        NavigationGoal::EndOf { line, width_m: 2.0 }
    }

    /// The middle of a corridor of 2 m.
    fn middle(legs: &[CorridorLeg]) -> NavigationGoal {
        let corridor = Corridor::new(legs.to_vec(), 2.0).unwrap();
        let line = corridor.center_line(0.1).iter().map(|pose| pose.at).collect();
        NavigationGoal::EndOf { line, width_m: 2.0 }
    }

    /// Passes the line from `begins` on, along its own points; returns how many of them went by before the end.
    fn passes_all(goal: &NavigationGoal, begins: usize) -> usize {
        let NavigationGoal::EndOf { line, .. } = goal else { panic!("a line") };
        let (mut index, mut count) = (begins, 0);
        for &at in &line[begins..] {
            if goal.is_reached(at, index) {
                return count;
            }
            (index, count) = (goal.reached_index(at, index), count + 1);
        }
        panic!("the end is never reached: at {index}")
    }

    #[test]
    fn a_line_that_ends_where_it_begins_is_passed_as_a_whole() {
        let turn = |turn_deg| CorridorLeg::Bend { radius_m: 3.0, turn_deg };
        let straight = CorridorLeg::Straight { length_m: 10.0 };
        let round = middle(&[straight, turn(180.0), straight, turn(180.0)]);
        for at in [[-0.2, 0.0], [0.0, 0.0], [0.03, 0.4]] {
            let begins = round.start_waypoint_index(at);
            assert_eq!(begins, 0, "{at:?}");
            assert!(!round.is_reached(at, begins), "{at:?}");
        }
        assert!(passes_all(&round, 0) > 380);
        for turn_deg in [720.0, 3600.0, -720.0] {
            let laps = middle(&[turn(turn_deg)]);
            let NavigationGoal::EndOf { line, .. } = &laps else { panic!("a line") };
            let lap = (line.len() - 1) as f64 * 360.0 / turn_deg.abs();
            for &at in &line[..lap as usize - 12] {
                let begins = laps.start_waypoint_index(at) as f64;
                assert!(begins < lap, "{turn_deg} deg, {at:?}: {begins} of {lap}");
            }
            assert!(passes_all(&laps, 0) > line.len() - 10, "{turn_deg} deg");
        }
    }

    #[test]
    fn progress_along_a_line_counts_from_where_it_began() {
        let goal = middle(&[CorridorLeg::Straight { length_m: 20.0 }]);
        let start = [10.0, 0.3];
        let begins = goal.start_waypoint_index(start);
        assert_eq!(begins, 100);
        let progress = |index| goal.progress(index, start, f64::INFINITY);
        assert_eq!([begins, 150, 200].map(progress), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn a_navigator_begins_at_the_nearest_point_of_its_line_and_goes_on_from_there() {
        let line = hairpin();
        let begins = line.start_waypoint_index([3.0, 3.8]);
        assert_eq!(begins, 50 + 40 + 20);
        let passed = line.reached_index([0.2, 4.0], begins);
        assert!(line.is_reached([0.2, 4.0], passed), "{passed}");
        assert_eq!(line.start_waypoint_index([-1.0, 0.1]), 0);
        // From the first leg the second one is not taken for passed.
        assert_eq!(line.reached_index([3.0, 1.9], 25), 30);
    }

    #[test]
    fn a_navigator_is_not_held_up_by_a_point_beside_its_line() {
        let line = vec![[0.0, 0.0], [0.1, 0.0], [0.15, 0.3], [0.2, 0.0], [0.9, 0.0]];
        let bumpy = NavigationGoal::EndOf { line, width_m: 2.0 };
        assert_eq!(bumpy.reached_index([0.2, 0.0], 0), 3);
    }
}
