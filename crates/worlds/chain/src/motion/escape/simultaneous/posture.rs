//! Positions under trial, and the ease with which each gives way.

use super::super::threat::Part;
use crate::rods::geometry::{Point, along};

/// Positions under trial.
pub(super) struct Posture<'a, const D: usize> {
    pub(super) points: &'a mut [Point<D>],
    /// 1 for a connector that may move, 0 for one that never does.
    pub(super) ease: &'a [f64],
}

/// A point of a part.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub(super) part: Part,
    /// Its place on a rod, from 0 to 1.
    pub(super) along_rod: f64,
}

/// Ease below which a part counts as held.
const HELD: f64 = 1e-9;

impl<const D: usize> Posture<'_, D> {
    /// Returns the ends of a part; for a connector its place twice.
    pub(super) fn ends(&self, part: Part) -> [Point<D>; 2] {
        ends(self.points, part)
    }

    /// Returns the ease with which a point of a part gives way; `along_rod` goes from 0 to 1.
    pub(super) fn ease(&self, part: Part, along_rod: f64) -> f64 {
        match part {
            Part::Connector(k) => self.ease[k],
            Part::Rod(i) => {
                let (a, b) = (1.0 - along_rod, along_rod);
                a * a * self.ease[i] + b * b * self.ease[i + 1]
            }
        }
    }

    /// Moves a point of a part by a vector, with as little motion of the ends as that takes.
    pub(super) fn shift(&mut self, part: Part, along_rod: f64, by: Point<D>) {
        let ease = self.ease(part, along_rod);
        if ease < HELD {
            return;
        }
        match part {
            Part::Connector(k) => self.points[k] = along(self.points[k], by, 1.0),
            Part::Rod(i) => {
                for (k, lever) in [(i, 1.0 - along_rod), (i + 1, along_rod)] {
                    self.points[k] = along(self.points[k], by, lever * self.ease[k] / ease);
                }
            }
        }
    }

    /// Moves two points of two parts apart by `gap_m` along a direction, each as easily as it
    /// gives way.
    pub(super) fn part(&mut self, one: Spot, other: Spot, away: Point<D>, gap_m: f64) {
        let [a, b] = [one, other].map(|spot| self.ease(spot.part, spot.along_rod));
        if a + b >= HELD {
            self.shift(one.part, one.along_rod, away.map(|x| -x * gap_m * a / (a + b)));
            self.shift(other.part, other.along_rod, away.map(|x| x * gap_m * b / (a + b)));
        }
    }
}

/// Returns the ends of a part; for a connector its place twice.
pub(super) fn ends<const D: usize>(points: &[Point<D>], part: Part) -> [Point<D>; 2] {
    match part {
        Part::Connector(k) => [points[k]; 2],
        Part::Rod(i) => [points[i], points[i + 1]],
    }
}
