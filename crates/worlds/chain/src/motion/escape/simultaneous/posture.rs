//! Positions under trial, with the inverse masses by which corrections are shared, as in position-based dynamics.

use sidestep_rods::ChainPart;
use sidestep_rods::geometry::{Point, add_scaled};

pub(super) struct TrialPosture<'a, const D: usize> {
    pub(super) points: &'a mut [Point<D>],
    /// 1 for a connector that may move, 0 for one that never does.
    pub(super) inverse_mass: &'a [f64],
}

#[derive(Clone, Copy)]
pub(super) struct PartPoint {
    pub(super) part: ChainPart,
    /// Its position on a rod, from 0 to 1.
    pub(super) along_rod: f64,
}

impl PartPoint {
    /// Returns the middle of a connector.
    pub(super) fn connector(k: usize) -> Self {
        Self { part: ChainPart::Connector(k), along_rod: 0.0 }
    }
}

/// Inverse mass below which a part counts as held, because the division by it would throw the part about.
const MIN_INVERSE_MASS: f64 = 1e-9;

impl<const D: usize> TrialPosture<'_, D> {
    /// Returns the ends of a part; for a connector its position twice.
    pub(super) fn ends(&self, part: ChainPart) -> [Point<D>; 2] {
        ends(self.points, part)
    }

    /// Returns the inverse mass of a point of a part; `along_rod` is from 0 to 1.
    pub(super) fn inverse_mass(&self, part: ChainPart, along_rod: f64) -> f64 {
        match part {
            ChainPart::Connector(k) => self.inverse_mass[k],
            ChainPart::Rod(i) => {
                let a = 1.0 - along_rod;
                let b = along_rod;
                a * a * self.inverse_mass[i] + b * b * self.inverse_mass[i + 1]
            }
        }
    }

    /// Moves a point of a part by a vector, with as little motion of the ends as that takes.
    pub(super) fn shift(&mut self, part: ChainPart, along_rod: f64, by: Point<D>) {
        let inverse_mass = self.inverse_mass(part, along_rod);
        if inverse_mass < MIN_INVERSE_MASS {
            return;
        }
        match part {
            ChainPart::Connector(k) => self.points[k] = add_scaled(self.points[k], by, 1.0),
            ChainPart::Rod(i) => {
                for (k, lever) in [(i, 1.0 - along_rod), (i + 1, along_rod)] {
                    self.points[k] =
                        add_scaled(self.points[k], by, lever * self.inverse_mass[k] / inverse_mass);
                }
            }
        }
    }

    /// Moves two points of two parts apart by `gap_m` along a direction, each in proportion to its inverse mass.
    pub(super) fn separate(
        &mut self,
        one: PartPoint,
        other: PartPoint,
        away: Point<D>,
        gap_m: f64,
    ) {
        let [a, b] = [one, other].map(|spot| self.inverse_mass(spot.part, spot.along_rod));
        if a + b >= MIN_INVERSE_MASS {
            self.shift(one.part, one.along_rod, away.map(|x| -x * gap_m * a / (a + b)));
            self.shift(other.part, other.along_rod, away.map(|x| x * gap_m * b / (a + b)));
        }
    }
}

/// Returns the ends of a part; for a connector its position twice.
pub(super) fn ends<const D: usize>(points: &[Point<D>], part: ChainPart) -> [Point<D>; 2] {
    match part {
        ChainPart::Connector(k) => [points[k]; 2],
        ChainPart::Rod(i) => [points[i], points[i + 1]],
    }
}
