//! An initiator on wheels that finds its way with a laser, and where it is to come (slides N1 to N6).

use super::rods::geometry::{Point, distance};
use super::swarm::drive::Drive;
use super::swarm::leader::{Leader, Turning};

/// The end of a line counts as reached so far before it, meters.
const BEFORE_THE_END_M: f64 = 0.5;

/// An initiator that navigates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Navigator {
    /// How it behaves.
    pub(crate) leader: Leader,
    /// Its wheels.
    pub(crate) drive: Drive,
    /// Where it is to come; without a goal it goes on and on.
    pub(crate) goal: Option<Goal>,
}

/// Where a navigator is to come.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Goal {
    /// To a place that it can detect.
    Target {
        /// The place.
        at: Point<2>,
        /// How near counts as there.
        tolerance_m: f64,
    },
    /// To the end of a line, such as the middle of a corridor, which it does not know of.
    EndOf(Vec<Point<2>>),
}

impl Navigator {
    /// Whether it may turn without going.
    pub(crate) fn can_turn_on_the_spot(&self) -> bool {
        self.leader.turning == Turning::OnTheSpotWhereBlocked
    }
}

impl Goal {
    /// What the leader can detect.
    pub(crate) fn target(&self) -> Option<Point<2>> {
        match self {
            Self::Target { at, .. } => Some(*at),
            Self::EndOf(_) => None,
        }
    }

    /// The point of the line that a navigator at `at` has come to, if it was at `index`.
    pub(crate) fn passed(&self, at: Point<2>, index: usize) -> usize {
        let Self::EndOf(line) = self else { return index };
        let nearer = |i: usize| distance(line[i + 1], at) <= distance(line[i], at);
        (index..line.len() - 1).find(|&i| !nearer(i)).unwrap_or(line.len() - 1)
    }

    pub(crate) fn is_reached(&self, at: Point<2>, index: usize) -> bool {
        match self {
            Self::Target { at: target, tolerance_m } => distance(at, *target) <= *tolerance_m,
            Self::EndOf(line) => distance(line[index], line[line.len() - 1]) <= BEFORE_THE_END_M,
        }
    }

    /// The part of the way that is done: by the points of a line, or by what is left to a target
    /// compared with what was left at the start.
    pub(crate) fn progress(&self, index: usize, start: Point<2>, nearest_m: f64) -> f64 {
        match self {
            Self::Target { at, .. } if nearest_m.is_finite() => {
                1.0 - nearest_m / distance(start, *at).max(nearest_m).max(1e-9)
            }
            Self::Target { .. } => 0.0,
            Self::EndOf(line) => index as f64 / (line.len() - 1).max(1) as f64,
        }
    }
}
