//! The trails of bodies, and the recorded rows from which they are made.

use super::body::{Body, BodyId, BodyKind, Shape};
use super::pose::{Isometry2, Vec3};
use super::{Frame, Scenery};
use crate::ports::Values;
use crate::units::Cycle;
use std::collections::BTreeMap;

/// The way that a body has gone.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// The body.
    pub of: BodyId,
    /// The places of its center at the start of cycles, the earliest first.
    pub points: Vec<(Cycle, Vec3)>,
}

/// Rows of a recorded table as places of bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionColumns {
    /// Name of the table; its column `cycle` has the cycle of each row.
    pub table: &'static str,
    /// The kind of the bodies.
    pub kind: BodyKind,
    /// The column with their numbers.
    pub number: &'static str,
    /// The column with the numbers of their parts.
    pub part: Option<&'static str>,
    /// Columns with the coordinates x, y and perhaps z.
    pub axes: Vec<Axis>,
    /// The plane of the coordinates x and y, that of the world unless given.
    pub plane: Option<Isometry2>,
    /// Whether the places are those of a body's corner with the lowest coordinates, not those of
    /// its center.
    pub is_corner: bool,
    /// The column with headings in quarter turns from east, of bodies that go straight ahead before
    /// they slip to a side.
    pub heading: Option<&'static str>,
    /// Cycles between two rows of a body.
    pub interval: Cycle,
    /// Number of cycles before the present that are worth showing.
    pub history: Cycle,
}

/// A column with coordinates: a coordinate in meters is `offset_m` plus the value times `scale_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Its name.
    pub column: &'static str,
    /// Meters per unit of the value.
    pub scale_m: f64,
    /// The coordinate of the value 0, in meters.
    pub offset_m: f64,
}

/// A row: the cycle, the place, and the heading in quarter turns.
type Row = (Cycle, Vec3, Option<u32>);

impl PositionColumns {
    /// Returns the trails of some bodies up to the moment of a frame, from the columns of the
    /// table; `None` where it has other columns. A body with rows that end before that moment,
    /// though it is still there, has no trail, because its trail would jump.
    pub fn trails<'a>(
        &self,
        scenery: &Scenery,
        frame: &Frame,
        whose: &[BodyId],
        column: impl Fn(&str) -> Option<&'a Values>,
    ) -> Option<Vec<Trail>> {
        let rows = self.rows(frame.cycle, whose, column)?;
        let trail = |(of, rows): (BodyId, Vec<Row>)| {
            let here = frame.bodies.iter().find(|body| body.id() == of);
            let way = self.points(rows, scenery, here.map(|body| (frame.cycle, body)), of.number);
            way.map(|way| Trail { of, points: way })
        };
        Some(rows.into_iter().filter_map(trail).collect())
    }

    /// Returns the rows of some bodies before a cycle.
    fn rows<'a>(
        &self,
        before: Cycle,
        whose: &[BodyId],
        column: impl Fn(&str) -> Option<&'a Values>,
    ) -> Option<BTreeMap<BodyId, Vec<Row>>> {
        let Values::U64(cycles) = column("cycle")? else { return None };
        let words = |name| match column(name)? {
            Values::U32(values) | Values::Label(values) => Some(values),
            _ => None,
        };
        let numbers = words(self.number)?;
        // A table without one of the named columns is another table.
        let parts = self.part.map(|name| words(name).ok_or(())).transpose().ok()?;
        let ahead = self.heading.map(|name| words(name).ok_or(())).transpose().ok()?;
        let axes = self.axes.iter().map(|axis| Some((axis, column(axis.column)?)));
        let axes: Vec<(&Axis, &Values)> = axes.collect::<Option<_>>()?;
        let mut rows: BTreeMap<BodyId, Vec<Row>> =
            whose.iter().map(|&of| (of, Vec::new())).collect();
        for (k, &cycle) in cycles.iter().enumerate().filter(|(_, cycle)| **cycle < before) {
            let of = BodyId::new(self.kind, numbers[k], parts.map(|parts| parts[k]));
            let Some(own) = rows.get_mut(&of) else { continue };
            let mut at_m = [0.0; 3];
            for (x, (axis, values)) in at_m.iter_mut().zip(&axes) {
                *x = axis.offset_m + axis.scale_m * number(values, k)?;
            }
            own.push((cycle, at_m, ahead.map(|ahead| ahead[k])));
        }
        rows.values_mut().for_each(|rows| rows.sort_by_key(|(cycle, ..)| *cycle));
        Some(rows)
    }

    fn points(
        &self,
        rows: Vec<Row>,
        scenery: &Scenery,
        here: Option<(Cycle, &Body)>,
        number: u32,
    ) -> Option<Vec<(Cycle, Vec3)>> {
        let &(last, ..) = rows.last()?;
        if here.is_some_and(|(now, _)| last + self.interval < now) {
            return None;
        }
        // A body that is gone has no shape in the frame, so the shape of its start is taken.
        let is_start = |body: &&Body| (body.kind, body.number) == (BodyKind::Start, number);
        let like = here.map(|(_, body)| body).or_else(|| scenery.bodies.iter().find(is_start));
        // The way from the corner to the center.
        let half_m = match like.map(|body| &body.shape) {
            Some(Shape::Cuboid { size_m }) if self.is_corner => size_m.map(|m| 0.5 * m),
            _ => [0.0; 3],
        };
        let middle = |at: Vec3| -> Vec3 {
            std::array::from_fn(|k| match k < self.axes.len() {
                true => at[k] + half_m[k],
                // The table has no heights, so the body's own is taken.
                false => like.map_or(0.0, |body| body.pose.at_m[k]),
            })
        };
        let turned = |turn: &dyn Fn(&Isometry2, [f64; 2]) -> [f64; 2], [x, y, z]: Vec3| {
            let [x, y] = self.plane.as_ref().map_or([x, y], |plane| turn(plane, [x, y]));
            [x, y, z]
        };
        // Trails have their corners along the axes of the columns.
        let now = here.map(|(now, body)| {
            (now, turned(&Isometry2::inverse_transform_point, body.pose.at_m), None)
        });
        let rows = rows.into_iter().map(|(cycle, at, ahead)| (cycle, middle(at), ahead)).chain(now);
        let mut way: Vec<(Cycle, Vec3)> = Vec::new();
        let mut left: Option<(Vec3, u32)> = None;
        for (cycle, at, ahead) in rows {
            if let Some((from, quarters)) = left {
                let between = corner(from, quarters, at);
                way.extend((between != from && between != at).then_some((cycle, between)));
            }
            way.push((cycle, at));
            left = ahead.map(|ahead| (at, ahead));
        }
        way.iter_mut().for_each(|(_, at)| *at = turned(&Isometry2::transform_point, *at));
        Some(way)
    }
}

fn number(values: &Values, row: usize) -> Option<f64> {
    values.number(row).filter(|_| values.is_numeric())
}

impl Axis {
    /// Creates the axis of a column that is in meters already.
    pub fn meters(column: &'static str) -> Self {
        Self { column, scale_m: 1.0, offset_m: 0.0 }
    }
}

/// Returns the place between two others where a body was if it went ahead before it slipped to a
/// side: `quarters` is the heading, in quarter turns from east, in which it left the first one.
pub fn corner(from: Vec3, quarters: u32, to: Vec3) -> Vec3 {
    if quarters.is_multiple_of(2) { [to[0], from[1], from[2]] } else { [from[0], to[1], from[2]] }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::*;

    #[test]
    fn a_slip_goes_ahead_before_it_goes_aside() {
        let (east, north) = (0, 1);
        assert_eq!(corner([5.0, 5.0, 0.0], east, [6.0, 6.0, 0.0]), [6.0, 5.0, 0.0]);
        assert_eq!(corner([5.0, 5.0, 0.0], north, [4.0, 6.0, 0.0]), [5.0, 6.0, 0.0]);
        assert_eq!(corner([5.0, 5.0, 0.0], east, [5.0, 5.0, 0.0]), [5.0, 5.0, 0.0]);
    }

    fn rows() -> PositionColumns {
        let axis = |column| Axis { column, scale_m: 0.5, offset_m: 10.0 };
        PositionColumns {
            table: "trajectories",
            kind: BodyKind::Robot,
            number: "body",
            part: None,
            axes: vec![axis("col"), axis("row")],
            plane: None,
            is_corner: true,
            heading: Some("heading"),
            interval: 1,
            history: 400,
        }
    }

    /// The trails of a robot of two boxes that slips north while it goes east, until a cycle.
    fn trails(until: Cycle) -> Option<Vec<Trail>> {
        let size_m = [1.0, 1.0, 0.5];
        let robot = Body::new(
            BodyKind::Robot,
            7,
            Pose::from_position([11.5, 11.0, 0.25]),
            Shape::Cuboid { size_m },
        );
        let frame = Frame { cycle: until, bodies: vec![robot], ..Frame::default() };
        let columns = [
            ("cycle", Values::U64(vec![1, 0, 0].into())),
            ("body", Values::U32(vec![7, 7, 8].into())),
            ("col", Values::U32(vec![1, 0, 9].into())),
            ("row", Values::U32(vec![0, 0, 9].into())),
            ("heading", Values::Label(vec![0, 0, 0].into())),
        ];
        let column = |name: &str| columns.iter().find(|(n, _)| *n == name).map(|(_, v)| v);
        let scenery = Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: Vec::new(),
        };
        rows().trails(&scenery, &frame, &[BodyId::new(BodyKind::Robot, 7, None)], column)
    }

    #[test]
    fn rows_become_the_way_to_where_a_body_is() {
        let [trail] = &trails(2).unwrap()[..] else { panic!("one robot is asked for") };
        let way = [
            (0, [10.5, 10.5, 0.25]),
            (1, [11.0, 10.5, 0.25]),
            (2, [11.5, 10.5, 0.25]),
            (2, [11.5, 11.0, 0.25]),
        ];
        assert_eq!(
            (trail.of, &trail.points[..]),
            (BodyId::new(BodyKind::Robot, 7, None), &way[..])
        );
    }

    #[test]
    fn rows_that_end_too_early_are_no_way() {
        assert!(trails(3).unwrap().is_empty());
        let none = rows().rows(9, &[], |_| None);
        assert_eq!(none, None, "a table with other columns");
    }
}
