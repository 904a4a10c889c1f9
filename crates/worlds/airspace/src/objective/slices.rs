//! Slices of time, and bounds around what all actions of an airplane do in one: most pairs are never near each other.

use crate::flight::{Point, Prediction, RigidMotion, SteadyChange};
use sidestep_kernel::math;

/// Number of points of a slice of time. Within a slice airplanes move little, so bounds around it are
/// tight.
pub(super) const SLICE: usize = 16;

/// The paths of all actions of an airplane in one slice of time.
#[derive(Debug, Clone)]
pub(super) struct TimeSlice {
    pub(super) pieces: Vec<DistinctSlicePath>,
    /// Bounds around all of them.
    pub(super) all: BoundingBox,
}

/// Points of a slice that some actions share: actions with the same turn differ only later.
#[derive(Debug, Clone)]
pub(super) struct DistinctSlicePath {
    /// The actions, at least one.
    pub(super) actions: Vec<usize>,
    /// Point of the prediction at which the counted part of the slice ends.
    pub(super) counted: usize,
    pub(super) bounds: BoundingBox,
}

impl TimeSlice {
    /// Returns a slice from point `from` on. `altitudes` are those of all actions, where some change them.
    pub(super) fn new(
        predictions: &[Prediction],
        from: usize,
        altitudes: Option<&[SteadyChange]>,
    ) -> Self {
        let mut pieces: Vec<DistinctSlicePath> = Vec::new();
        for (action, prediction) in predictions.iter().enumerate() {
            let points = slice_points(prediction, from);
            let end = prediction.points.len().min(from + SLICE);
            let counted = prediction.counted.clamp(from.min(end), end);
            // The last points are compared first, because most paths that differ do so there.
            let same = pieces.iter_mut().find(|piece| {
                let first = piece.actions[0];
                let other = slice_points(&predictions[first], from);
                piece.counted == counted
                    && points.last() == other.last()
                    && points == other
                    && altitudes.is_none_or(|all| all[first] == all[action])
            });
            match same {
                Some(piece) => piece.actions.push(action),
                None => {
                    let bounds = BoundingBox::from_points(points);
                    pieces.push(DistinctSlicePath { actions: vec![action], counted, bounds });
                }
            }
        }
        let corners: Vec<Point> =
            pieces.iter().flat_map(|p| [p.bounds.low, p.bounds.high]).collect();
        Self { pieces, all: BoundingBox::from_points(&corners) }
    }
}

/// Returns the points of a prediction in the slice that starts with point `from`.
fn slice_points(prediction: &Prediction, from: usize) -> &[Point] {
    let end = prediction.points.len().min(from + SLICE);
    &prediction.points[from.min(end)..end]
}

/// The smallest upright rectangle around some points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoundingBox {
    pub(super) low: Point,
    pub(super) high: Point,
}

impl BoundingBox {
    pub(super) fn from_points(points: &[Point]) -> Self {
        let start = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        points.iter().fold(start, |b, p| Self {
            low: [b.low[0].min(p[0]), b.low[1].min(p[1])],
            high: [b.high[0].max(p[0]), b.high[1].max(p[1])],
        })
    }

    /// Returns the largest distance of a point in it from the origin.
    pub(super) fn reach_m(&self) -> f64 {
        let [x, y] = [0, 1].map(|k: usize| self.low[k].abs().max(self.high[k].abs()));
        math::hypot(x, y)
    }

    /// Returns the smallest upright rectangle around this one in another plane.
    pub(super) fn moved(&self, motion: &RigidMotion) -> Self {
        let [low, high] = [self.low, self.high];
        let corners = [low, [low[0], high[1]], [high[0], low[1]], high];
        // Corners of no points are infinite, and would become no numbers.
        if low[0] > high[0] {
            return *self;
        }
        Self::from_points(&corners.map(|corner| motion.point(corner)))
    }

    pub(super) fn is_within_gap(&self, other: &Self, gap_m: f64) -> bool {
        (0..2).all(|k| self.low[k] - gap_m <= other.high[k] && other.low[k] - gap_m <= self.high[k])
    }
}
