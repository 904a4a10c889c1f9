//! How far connectors have moved in a solve: a contact that had room need not be looked at again before its room can be
//! used up. That is the idea of Verlet lists, and changes no result.

use sidestep_rods::ChainPart;
use sidestep_rods::geometry::{Point, dot, sub};

/// Sums up the longest moves of any connector.
#[derive(Debug, Clone, Default)]
pub(super) struct Odometer<const D: usize> {
    /// Positions to which it has counted.
    points: Vec<Point<D>>,
    /// The sum, meters: no connector has moved farther since the start.
    reading_m: f64,
}

impl<const D: usize> Odometer<D> {
    /// Starts at some positions.
    pub(super) fn start(&mut self, points: &[Point<D>]) {
        self.points.clear();
        self.points.extend_from_slice(points);
        self.reading_m = 0.0;
    }

    /// Counts the moves to other positions of the same connectors.
    pub(super) fn advance_to(&mut self, points: &[Point<D>]) {
        let mut farthest2 = 0.0_f64;
        for (was, now) in self.points.iter_mut().zip(points) {
            let by = sub(*now, *was);
            farthest2 = farthest2.max(dot(by, by));
            *was = *now;
        }
        self.reading_m += farthest2.sqrt();
    }

    /// Counts the moves of the connectors of one part.
    pub(super) fn advance_part(&mut self, points: &[Point<D>], part: ChainPart) {
        let mut farthest2 = 0.0_f64;
        for k in [part.connector(), part.last_connector()] {
            let by = sub(points[k], self.points[k]);
            farthest2 = farthest2.max(dot(by, by));
            self.points[k] = points[k];
        }
        self.reading_m += farthest2.sqrt();
    }

    /// Returns the reading, meters.
    pub(super) fn reading_m(&self) -> f64 {
        self.reading_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reading_is_no_less_than_any_way() {
        let mut odometer = Odometer::default();
        odometer.start(&[[0.0, 0.0], [1.0, 0.0]]);
        odometer.advance_to(&[[0.0, 3.0], [1.0, 1.0]]);
        odometer.advance_to(&[[0.0, 3.0], [1.0, 3.0]]);
        assert_eq!(odometer.reading_m(), 5.0);
        odometer.advance_part(&[[0.0, 4.0], [1.0, 9.0]], ChainPart::Connector(0));
        assert_eq!(odometer.reading_m(), 6.0);
        odometer.advance_part(&[[0.0, 4.0], [1.0, 5.0]], ChainPart::Rod(0));
        assert_eq!(odometer.reading_m(), 8.0);
        odometer.start(&[[0.0, 3.0], [1.0, 3.0]]);
        odometer.advance_to(&[[0.0, 3.0], [1.0, 3.0]]);
        assert_eq!(odometer.reading_m(), 0.0);
    }
}
