//! When a path first comes too near an area.
//!
//! A path consists of pieces of one turn rate, the last of which may go on forever. Straight pieces and whole circles are
//! compared with the border exactly. Where that does not settle it, and for arcs and what moves, the path is followed in
//! steps so short that the border cannot be crossed within one: the distance to it, divided by the speed. So no crossing
//! is missed. A path that comes within [`TOLERANCE_M`] of the margin may be found too near.

use super::local::{LocalArea, LocalBorder};
use super::shape::{Edge, circle_lines_distance_m, edge_distance_m, edge_to_circle_line_m};
use crate::flight::{Point, Pose2, distance_m};
use sidestep_kernel::math;

/// Meters above the margin from which on a path is surely found clear. It bounds the number of steps.
pub(crate) const TOLERANCE_M: f64 = 0.5;

/// A piece of a path, flown through the air at one turn rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathPiece {
    /// The pose at its start.
    pub(crate) start: Pose2,
    pub(crate) v_m_s: f64,
    /// Turn rate in radians per second.
    pub(crate) omega_rad_s: f64,
    /// Its start, in seconds from now.
    pub(crate) from_s: f64,
    /// Its end, in seconds from now; infinite for an orbit that is flown forever.
    pub(crate) until_s: f64,
}

impl PathPiece {
    fn at(&self, t_s: f64) -> Point {
        self.start.step(self.v_m_s, self.omega_rad_s, t_s - self.from_s).at
    }

    /// Returns the center of its circle, and the radius in meters.
    fn circle(&self) -> (Point, f64) {
        let radius_m = self.v_m_s / self.omega_rad_s;
        let (sin, cos) = math::sin_cos(self.start.heading_rad);
        let [x, y] = self.start.at;
        ([x - radius_m * sin, y + radius_m * cos], radius_m.abs())
    }
}

impl LocalArea {
    /// Returns the time, in seconds from now, at which an airplane on a path first comes nearer than `margin_m` to where
    /// it must not be while the area is considered; infinite for never. A negative margin permits it to be there by as
    /// much.
    pub(crate) fn conflict_s(
        &self,
        pieces: impl IntoIterator<Item = PathPiece>,
        margin_m: f64,
    ) -> f64 {
        let mut is_begun = false;
        for piece in pieces {
            let from_s = piece.from_s.max(self.from_s);
            let until_s = piece.until_s.min(self.until_s);
            if from_s >= until_s {
                continue;
            }
            // As long as the border is not crossed, it stays on the side on which it is when the area begins.
            if !is_begun
                && margin_m >= 0.0
                && self.forbids(self.relative_place(piece.at(from_s), from_s))
            {
                return from_s;
            }
            is_begun = true;
            if let Some(conflict_s) = self.piece_conflict_s(&piece, [from_s, until_s], margin_m) {
                return conflict_s;
            }
        }
        f64::INFINITY
    }

    fn piece_conflict_s(
        &self,
        piece: &PathPiece,
        [from_s, until_s]: [f64; 2],
        margin_m: f64,
    ) -> Option<f64> {
        // Beyond a border it does not count how near that is.
        if margin_m >= 0.0 && self.is_surely_apart(piece, [from_s, until_s], margin_m) {
            return None;
        }
        let is_turning = piece.omega_rad_s != 0.0;
        let is_moving = self.velocity_m_s != [0.0; 2];
        // After one turn an orbit is where it was; only straight flight and what moves come to new places.
        let period_s = std::f64::consts::TAU / piece.omega_rad_s.abs();
        let until_s =
            if is_turning && !is_moving { until_s.min(from_s + period_s) } else { until_s };
        let [ux, uy] = self.velocity_m_s;
        let speed_m_s = piece.v_m_s + math::hypot(ux, uy);
        let mut t_s = from_s;
        while t_s < until_s {
            let relative = self.relative_place(piece.at(t_s), t_s);
            let mut clearance_m = self.border_distance_m(relative);
            if margin_m < 0.0 && self.forbids(relative) {
                clearance_m = -clearance_m;
            }
            if clearance_m < margin_m + TOLERANCE_M {
                return Some(t_s);
            }
            t_s += (clearance_m - margin_m) / speed_m_s;
        }
        None
    }

    /// Returns whether a piece keeps so far from the border, as far as that has a closed form.
    fn is_surely_apart(
        &self,
        piece: &PathPiece,
        [from_s, until_s]: [f64; 2],
        margin_m: f64,
    ) -> bool {
        let is_moving = self.velocity_m_s != [0.0; 2];
        if piece.omega_rad_s == 0.0 {
            let ends = [from_s, until_s].map(|t_s| self.relative_place(piece.at(t_s), t_s));
            // A line that crosses the border is 0 from it, which is no less than a margin of 0.
            return until_s < f64::INFINITY && self.line_distance_m(ends) > margin_m;
        }
        let (center, radius_m) = piece.circle();
        if !is_moving {
            return self.circle_distance_m(center, radius_m) > margin_m;
        }
        // The circle drifts along the border, and reaches to both sides of the path of its center.
        let ends = [from_s, until_s].map(|t_s| self.relative_place(center, t_s));
        until_s < f64::INFINITY && self.line_distance_m(ends) > margin_m + radius_m
    }

    /// Returns the distance of a straight line from the border, in meters.
    fn line_distance_m(&self, line: Edge) -> f64 {
        let near_m = match self.border() {
            LocalBorder::Circle { center, radius_m } => {
                edge_to_circle_line_m(line, *center, *radius_m)
            }
            LocalBorder::Edges(edges) => {
                edges.iter().map(|&edge| edge_distance_m(edge, line)).fold(f64::INFINITY, f64::min)
            }
        };
        line.into_iter().fold(near_m, |near_m, end| near_m.min(self.unknown_distance_m(end)))
    }

    /// Returns the distance of a circle's line from the border, in meters.
    fn circle_distance_m(&self, center: Point, radius_m: f64) -> f64 {
        let near_m = match self.border() {
            LocalBorder::Circle { center: other, radius_m: other_m } => {
                circle_lines_distance_m(distance_m(center, *other), [radius_m, *other_m])
            }
            LocalBorder::Edges(edges) => edges
                .iter()
                .map(|&edge| edge_to_circle_line_m(edge, center, radius_m))
                .fold(f64::INFINITY, f64::min),
        };
        near_m.min(self.unknown_distance_m(center) - radius_m)
    }

    /// Returns when an airplane that flies straight on from now for some seconds first comes within `margin_m` meters of
    /// where it must not be; infinite for never.
    pub(crate) fn straight_conflict_s(
        &self,
        start: Pose2,
        v_m_s: f64,
        for_s: f64,
        margin_m: f64,
    ) -> f64 {
        let piece = PathPiece { start, v_m_s, omega_rad_s: 0.0, from_s: 0.0, until_s: for_s };
        self.conflict_s([piece], margin_m)
    }
}

/// Returns the path from a pose with a turn rate per step.
pub(crate) fn profile_pieces(
    start: Pose2,
    v_m_s: f64,
    omegas_rad_s: &[f64],
    dtau_s: f64,
) -> Vec<PathPiece> {
    let mut pieces: Vec<PathPiece> = Vec::with_capacity(omegas_rad_s.len());
    let mut pose = start;
    for (k, &omega_rad_s) in omegas_rad_s.iter().enumerate() {
        let from_s = k as f64 * dtau_s;
        let until_s = from_s + dtau_s;
        match pieces.last_mut().filter(|last| last.omega_rad_s == omega_rad_s) {
            Some(last) => last.until_s = until_s,
            None => pieces.push(PathPiece { start: pose, v_m_s, omega_rad_s, from_s, until_s }),
        }
        pose = pose.step(v_m_s, omega_rad_s, dtau_s);
    }
    pieces
}
