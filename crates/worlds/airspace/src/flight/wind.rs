//! A wind that differs from level to level, and from place to place.
//!
//! It is known at the nodes of a grid: on levels, and on each of them in one place for all or on a grid of places.
//! Between nodes it is linear along each axis, and beyond the last ones it is as there. All airplanes know it, as they
//! know a wind that is the same everywhere. What flies is moved by the wind that is at its place and on its level at the
//! start of a cycle, for the whole cycle; so a leg has one drift, and closest approaches remain exact.

use super::levels::FlightLevelRange;
use super::motion::Point;
use super::surface::Surface;
use sidestep_kernel::geometry::{lerp, norm, sub};
use sidestep_kernel::math;

/// Meters to which altitudes are rounded before the wind is looked up. Two airplanes on one level, of which one came
/// there by a climb in many steps, are then in the same wind to the bit.
const ALTITUDE_STEP_M: f64 = 0.01;

/// A wind on levels and in places.
#[derive(Debug, Clone, PartialEq)]
pub struct WindField {
    surface: Surface,
    /// Altitudes of the levels in meters, rising.
    altitudes_m: Vec<f64>,
    /// The two coordinates of the places, rising; one of each where it is the same in all places.
    places: [Vec<f64>; 2],
    /// Velocities in meters per second, east and north: by level, then by the second coordinate, then by the first one.
    velocities_m_s: Vec<Point>,
    /// The velocity in the middle of all of them: of an air in which none is fast.
    pub(crate) middle_m_s: Point,
    /// The greatest speed relative to that air.
    pub(crate) max_drift_m_s: f64,
    /// The greatest speed over the ground.
    pub(crate) max_speed_m_s: f64,
}

/// What is wrong with a grid of winds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WindGridError {
    /// Two velocities at one node, of which this is the later one.
    Twice(usize),
    /// Fewer velocities than the grid has nodes.
    Missing { nodes: usize },
}

/// A velocity of the air at a node of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WindNode {
    pub(crate) altitude_m: f64,
    /// In coordinates of the scenario; any where the wind is the same in all places.
    pub(crate) at: Point,
    /// East and north, in meters per second.
    pub(crate) velocity_m_s: Point,
}

impl WindField {
    /// Returns the wind with velocities at the nodes of a grid, in any order.
    ///
    /// # Errors
    /// When a node is given twice, or is missing.
    pub(crate) fn new(surface: Surface, nodes: &[WindNode]) -> Result<Self, WindGridError> {
        let axis = |coordinate: &dyn Fn(&WindNode) -> f64| {
            let mut values: Vec<f64> = nodes.iter().map(coordinate).collect();
            values.sort_unstable_by(f64::total_cmp);
            values.dedup();
            values
        };
        let altitudes_m = axis(&|node| node.altitude_m);
        let places = [axis(&|node| node.at[0]), axis(&|node| node.at[1])];
        let count = altitudes_m.len() * places[0].len() * places[1].len();
        let mut velocities: Vec<Option<Point>> = Vec::new();
        // More nodes than velocities are missing in any case, however many they are.
        velocities.resize(count.min(nodes.len()), None);
        if count > nodes.len() {
            return Err(WindGridError::Missing { nodes: count });
        }
        for (number, node) in nodes.iter().enumerate() {
            let index = |values: &[f64], value: f64| values.partition_point(|one| *one < value);
            let row = index(&altitudes_m, node.altitude_m) * places[1].len()
                + index(&places[1], node.at[1]);
            let place = row * places[0].len() + index(&places[0], node.at[0]);
            if velocities[place].replace(node.velocity_m_s).is_some() {
                return Err(WindGridError::Twice(number));
            }
        }
        // As many as there are nodes, and none twice: none is missing.
        let velocities_m_s: Vec<Point> = velocities.into_iter().flatten().collect();
        let middle_m_s = middle_m_s(&velocities_m_s);
        Ok(Self {
            surface,
            altitudes_m,
            places,
            middle_m_s,
            // Between nodes no speed is greater than at some of them.
            max_drift_m_s: max_speed_m_s(&velocities_m_s, middle_m_s),
            max_speed_m_s: max_speed_m_s(&velocities_m_s, [0.0; 2]),
            velocities_m_s,
        })
    }

    /// Returns the wind in meters per second, east and north, in a place in coordinates of the scenario.
    pub(crate) fn velocity_m_s(&self, at: Point, altitude_m: f64) -> Point {
        let altitude_m = (altitude_m / ALTITUDE_STEP_M).round() * ALTITUDE_STEP_M;
        let level = AxisPosition::new(&self.altitudes_m, altitude_m);
        let [x, y] = &self.places;
        let column = AxisPosition::new(x, self.near_axis(x, at[0]));
        let row = AxisPosition::new(y, at[1]);
        level.interpolate(|level| {
            row.interpolate(|row| {
                let first = (level * y.len() + row) * x.len();
                column.interpolate(|column| self.velocities_m_s[first + column])
            })
        })
    }

    /// Returns a first coordinate as near to those of the axis as it can be: on the earth longitudes repeat.
    fn near_axis(&self, axis: &[f64], value: f64) -> f64 {
        match self.surface {
            Surface::Plane => value,
            Surface::Earth => {
                let center = 0.5 * (axis[0] + axis[axis.len() - 1]);
                center + math::wrap_angle(value - center)
            }
        }
    }

    /// Returns a speed in meters per second that the wind does not exceed on some levels: the greatest one at the nodes of
    /// these levels, and of those next to them.
    pub(crate) fn max_speed_on_levels_m_s(&self, levels: FlightLevelRange) -> f64 {
        let first = AxisPosition::new(&self.altitudes_m, levels.low_m).before;
        let last = AxisPosition::new(&self.altitudes_m, levels.high_m).after;
        let nodes = self.places[0].len() * self.places[1].len();
        max_speed_m_s(&self.velocities_m_s[first * nodes..(last + 1) * nodes], [0.0; 2])
    }

    /// Returns whether it is another wind in other places of one level.
    pub(crate) fn varies_by_place(&self) -> bool {
        self.places.iter().any(|axis| axis.len() > 1)
    }
}

fn middle_m_s(velocities_m_s: &[Point]) -> Point {
    [0, 1].map(|part| {
        let parts = velocities_m_s.iter().map(|velocity| velocity[part]);
        let low = parts.clone().fold(f64::INFINITY, f64::min);
        let high = parts.fold(f64::NEG_INFINITY, f64::max);
        0.5 * (low + high)
    })
}

fn max_speed_m_s(velocities_m_s: &[Point], relative_to_m_s: Point) -> f64 {
    let speeds = velocities_m_s.iter().map(|&velocity| norm(sub(velocity, relative_to_m_s)));
    speeds.fold(0.0, f64::max)
}

/// A position on an axis of a grid: between two of its nodes.
#[derive(Debug, Clone, Copy)]
struct AxisPosition {
    before: usize,
    after: usize,
    /// Part of the way from the one before to the one after.
    fraction: f64,
}

impl AxisPosition {
    fn new(axis: &[f64], value: f64) -> Self {
        let last = axis.len() - 1;
        let after = axis.partition_point(|node| *node < value).min(last);
        let before = after.saturating_sub(1);
        let width = axis[after] - axis[before];
        // Beyond the ends it is as at the last node.
        let fraction =
            if width > 0.0 { ((value - axis[before]) / width).clamp(0.0, 1.0) } else { 0.0 };
        Self { before, after, fraction }
    }

    fn interpolate(self, velocity_m_s: impl Fn(usize) -> Point) -> Point {
        if self.fraction == 0.0 {
            return velocity_m_s(self.before);
        }
        lerp(velocity_m_s(self.before), velocity_m_s(self.after), self.fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::coordinates_from_degrees;
    use proptest::prelude::*;

    fn node(altitude_m: f64, at: Point, velocity_m_s: Point) -> WindNode {
        WindNode { altitude_m, at, velocity_m_s }
    }

    fn field(nodes: &[WindNode]) -> WindField {
        WindField::new(Surface::Plane, nodes).expect("a grid")
    }

    #[test]
    fn between_levels_it_is_linear_and_beyond_them_as_on_the_last_one() {
        let layers =
            field(&[node(3000.0, [0.0; 2], [30.0, -10.0]), node(1000.0, [0.0; 2], [10.0, 0.0])]);
        for (altitude_m, expected) in [
            (-500.0, [10.0, 0.0]),
            (1000.0, [10.0, 0.0]),
            (1500.0, [15.0, -2.5]),
            (3000.0, [30.0, -10.0]),
            (9000.0, [30.0, -10.0]),
        ] {
            assert_eq!(layers.velocity_m_s([5e3, -9e9], altitude_m), expected, "{altitude_m}");
        }
        assert!(!layers.varies_by_place());
        assert_eq!(layers.middle_m_s, [20.0, -5.0]);
        assert_eq!(layers.max_speed_m_s, 1000.0_f64.sqrt());
        assert_eq!(layers.max_drift_m_s, 125.0_f64.sqrt());
    }

    #[test]
    fn a_node_that_is_missing_or_given_twice_is_found() {
        let four = [[0.0, 0.0], [0.0, 9.0], [7.0, 0.0], [7.0, 9.0]];
        let nodes = four.map(|at| node(0.0, at, at));
        let found = |nodes: &[WindNode]| WindField::new(Surface::Plane, nodes).map(|_| ());
        assert_eq!(found(&nodes), Ok(()));
        assert_eq!(found(&nodes[..3]), Err(WindGridError::Missing { nodes: 4 }));
        assert_eq!(found(&[nodes, nodes].concat()), Err(WindGridError::Twice(4)));
    }

    #[test]
    fn across_the_date_line_a_grid_is_one() {
        let at = |lon_deg: f64| coordinates_from_degrees([10.0, lon_deg]);
        let wind = |lon_deg: f64| node(0.0, at(lon_deg), [lon_deg, 0.0]);
        let nodes = [wind(170.0), wind(190.0)].map(|one| {
            let east_of_line = one.velocity_m_s[0].to_radians();
            WindNode { at: [east_of_line, one.at[1]], ..one }
        });
        let field = WindField::new(Surface::Earth, &nodes).expect("a grid");
        for (lon_deg, expected) in [(175.0, 175.0), (-175.0, 185.0), (-179.0, 181.0)] {
            let [east, _] = field.velocity_m_s(at(lon_deg), 0.0);
            assert!((east - expected).abs() < 1e-9, "{lon_deg}: {east}");
        }
    }

    proptest! {
        /// At each node it is what was given there, and nowhere is it faster than at some node.
        #[test]
        fn a_grid_passes_through_its_nodes(
            winds in prop::collection::vec(prop::array::uniform2(-40.0f64..40.0), 12),
            at in prop::array::uniform2(-9e3f64..9e3), altitude_m in -500.0f64..4000.0,
        ) {
            let mut nodes = Vec::new();
            for (k, &wind) in winds.iter().enumerate() {
                let place = [[-5e3, 1e3, 6e3][k % 3], [-2e3, 2e3][k / 3 % 2]];
                nodes.push(node([0.0, 1234.56][k / 6], place, wind));
            }
            let field = field(&nodes);
            for node in &nodes {
                let found = field.velocity_m_s(node.at, node.altitude_m);
                prop_assert!(norm(sub(found, node.velocity_m_s)) < 1e-9);
            }
            let found = field.velocity_m_s(at, altitude_m);
            prop_assert!(norm(found) <= field.max_speed_m_s + 1e-9);
            prop_assert!(norm(sub(found, field.middle_m_s)) <= field.max_drift_m_s + 1e-9);
        }
    }
}
