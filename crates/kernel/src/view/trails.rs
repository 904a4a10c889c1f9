//! The trails of bodies, and the recorded rows from which they are made.

use super::body::{Body, BodyId, Shape};
use super::kind::{BodyKind, BodyRole};
use super::pose::{Isometry2, Vec3};
use super::{Frame, Scenery};
use crate::ports::ColumnValues;
use crate::units::Cycle;
use std::collections::BTreeMap;

/// The path of a body up to the moment of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// The body, which may be gone by now.
    pub of: BodyId,
    /// The positions of its center at the start of cycles, the earliest first.
    pub points: Vec<(Cycle, Vec3)>,
}

/// The table and the columns with the recorded positions of bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionTableColumns {
    /// Name of the table; its column `cycle` has the cycle of each row.
    pub table: &'static str,
    /// The kind of all bodies of the table.
    pub kind: BodyKind,
    /// The column with their numbers.
    pub number: &'static str,
    /// The column with the numbers of their parts.
    pub part: Option<&'static str>,
    /// Columns with the coordinates x, y and perhaps z.
    pub axes: Vec<CoordinateColumn>,
    /// The plane of the coordinates x and y, that of the world unless given.
    pub plane: Option<Isometry2>,
    /// Whether the positions are those of a body's corner with the lowest coordinates, not those of
    /// its center.
    pub is_corner: bool,
    /// The column with headings in quarter turns from east, of bodies that move straight ahead before
    /// they slip to a side.
    pub heading: Option<&'static str>,
    /// Cycles between two rows of a body.
    pub interval: Cycle,
    /// Length of a readable trail, in cycles before the present.
    pub history: Cycle,
}

/// A column with coordinates: a coordinate in meters is `offset_m` plus the value times `scale_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoordinateColumn {
    /// Name of the column in the table.
    pub column: &'static str,
    /// Meters per unit of the value.
    pub scale_m: f64,
    /// The coordinate of the value 0, in meters.
    pub offset_m: f64,
}

#[derive(Debug, PartialEq)]
struct PositionRow {
    cycle: Cycle,
    at_m: Vec3,
    /// Heading in quarter turns from east.
    heading: Option<u32>,
}

impl PositionTableColumns {
    /// Returns the trails of some bodies up to the moment of a frame, from the columns of the
    /// table; `None` where it has other columns. A body with rows that end before that moment,
    /// though it is still there, has no trail, because its trail would jump.
    pub fn trails<'a>(
        &self,
        scenery: &Scenery,
        frame: &Frame,
        bodies: &[BodyId],
        column: impl Fn(&str) -> Option<&'a ColumnValues>,
    ) -> Option<Vec<Trail>> {
        let rows = self.rows(frame.cycle, bodies, column)?;
        let mut trails = Vec::new();
        for (id, rows) in rows {
            let body = frame.bodies.iter().find(|body| body.id() == id);
            let is_current = |last: &PositionRow| last.cycle + self.interval >= frame.cycle;
            if rows.last().is_some_and(|last| body.is_none() || is_current(last)) {
                // A body that is gone has no shape in the frame, so that of its start is used.
                let start = || scenery.bodies.iter().find(|body| is_start_marker_of(body, id));
                let like = body.or_else(start);
                let present = body.map(|body| (frame.cycle, body.pose.at_m));
                trails.push(Trail { of: id, points: self.points(rows, like, present) });
            }
        }
        Some(trails)
    }

    /// Returns the rows of each body, by cycle; `None` if the columns are those of another table.
    fn rows<'a>(
        &self,
        before: Cycle,
        bodies: &[BodyId],
        column: impl Fn(&str) -> Option<&'a ColumnValues>,
    ) -> Option<BTreeMap<BodyId, Vec<PositionRow>>> {
        let ColumnValues::U64(cycles) = column("cycle")? else { return None };
        let integers = |name| match column(name)? {
            ColumnValues::U32(values) | ColumnValues::Label(values) => Some(values),
            _ => None,
        };
        let numbers = integers(self.number)?;
        // A table without one of the named columns is another table.
        let parts = self.part.map(|name| integers(name).ok_or(())).transpose().ok()?;
        let headings = self.heading.map(|name| integers(name).ok_or(())).transpose().ok()?;
        let axes = self.axes.iter().map(|axis| Some((axis, column(axis.column)?)));
        let axes: Vec<(&CoordinateColumn, &ColumnValues)> = axes.collect::<Option<_>>()?;
        let mut rows: BTreeMap<BodyId, Vec<PositionRow>> =
            bodies.iter().map(|&id| (id, Vec::new())).collect();
        for (k, &cycle) in cycles.iter().enumerate().filter(|(_, cycle)| **cycle < before) {
            let id = BodyId::new(self.kind, numbers[k], parts.map(|parts| parts[k]));
            let Some(own) = rows.get_mut(&id) else { continue };
            let mut at_m = [0.0; 3];
            for (x, (axis, values)) in at_m.iter_mut().zip(&axes) {
                *x = axis.offset_m + axis.scale_m * number(values, k)?;
            }
            own.push(PositionRow { cycle, at_m, heading: headings.map(|headings| headings[k]) });
        }
        rows.values_mut().for_each(|rows| rows.sort_by_key(|row| row.cycle));
        Some(rows)
    }

    /// Returns the points of a trail: the center at each row, the corner of each move that has one, and the present
    /// position. `like` is a body of the same shape.
    fn points(
        &self,
        rows: Vec<PositionRow>,
        like: Option<&Body>,
        present: Option<(Cycle, Vec3)>,
    ) -> Vec<(Cycle, Vec3)> {
        let half_m = match like.map(|body| &body.shape) {
            Some(Shape::Cuboid { size_m }) if self.is_corner => size_m.map(|m| 0.5 * m),
            _ => [0.0; 3],
        };
        let mut points: Vec<(Cycle, Vec3)> = Vec::new();
        let mut previous: Option<(Vec3, u32)> = None;
        for PositionRow { cycle, at_m, heading } in rows {
            let center_m = std::array::from_fn(|k| {
                if k < self.axes.len() {
                    at_m[k] + half_m[k]
                } else {
                    // The table has no heights, so the body's own is used.
                    like.map_or(0.0, |body| body.pose.at_m[k])
                }
            });
            push_with_corner(&mut points, previous, (cycle, center_m));
            previous = heading.map(|heading| (center_m, heading));
        }
        if let Some((cycle, at_m)) = present {
            // Corners lie along the axes of the columns, so they are found in the plane of these.
            let at_m = self.map_xy(at_m, Isometry2::inverse_transform_point);
            push_with_corner(&mut points, previous, (cycle, at_m));
        }
        for (_, at_m) in &mut points {
            *at_m = self.map_xy(*at_m, Isometry2::transform_point);
        }
        points
    }

    /// Transforms the horizontal coordinates of a point between the world and the plane of the columns.
    fn map_xy(
        &self,
        [x, y, z]: Vec3,
        transform: impl Fn(&Isometry2, [f64; 2]) -> [f64; 2],
    ) -> Vec3 {
        let [x, y] = match &self.plane {
            Some(plane) => transform(plane, [x, y]),
            None => [x, y],
        };
        [x, y, z]
    }
}

fn is_start_marker_of(body: &Body, of: BodyId) -> bool {
    body.kind.role() == BodyRole::StartOf(of.kind) && body.number == of.number
}

/// Appends a point, and before it the corner of the move from the previous one, whose position and heading are given.
fn push_with_corner(
    points: &mut Vec<(Cycle, Vec3)>,
    previous: Option<(Vec3, u32)>,
    (cycle, at_m): (Cycle, Vec3),
) {
    if let Some((from_m, heading)) = previous {
        let between_m = corner_of_move(from_m, heading, at_m);
        if between_m != from_m && between_m != at_m {
            points.push((cycle, between_m));
        }
    }
    points.push((cycle, at_m));
}

/// Returns a value of a numeric column as a number; a label or a truth value is no coordinate.
fn number(values: &ColumnValues, row: usize) -> Option<f64> {
    values.number(row).filter(|_| values.is_numeric())
}

impl CoordinateColumn {
    /// Creates the axis of a column that is in meters already.
    pub fn meters(column: &'static str) -> Self {
        Self { column, scale_m: 1.0, offset_m: 0.0 }
    }
}

/// Returns the position between two others where a body was if it moved ahead before it slipped to a
/// side: `heading` is the direction in which it left the first one, in quarter turns from east.
pub fn corner_of_move(from: Vec3, heading: u32, to: Vec3) -> Vec3 {
    if heading.is_multiple_of(2) { [to[0], from[1], from[2]] } else { [from[0], to[1], from[2]] }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::super::kind::samples::ROBOT;
    use super::*;

    #[test]
    fn a_slip_goes_ahead_before_it_goes_aside() {
        let (east, north) = (0, 1);
        assert_eq!(corner_of_move([5.0, 5.0, 0.0], east, [6.0, 6.0, 0.0]), [6.0, 5.0, 0.0]);
        assert_eq!(corner_of_move([5.0, 5.0, 0.0], north, [4.0, 6.0, 0.0]), [5.0, 6.0, 0.0]);
        assert_eq!(corner_of_move([5.0, 5.0, 0.0], east, [5.0, 5.0, 0.0]), [5.0, 5.0, 0.0]);
    }

    fn rows() -> PositionTableColumns {
        let axis = |column| CoordinateColumn { column, scale_m: 0.5, offset_m: 10.0 };
        PositionTableColumns {
            table: "trajectories",
            kind: ROBOT,
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
        let robot =
            Body::new(ROBOT, 7, Pose::from_position([11.5, 11.0, 0.25]), Shape::Cuboid { size_m });
        let frame = Frame { cycle: until, bodies: vec![robot], ..Frame::default() };
        let columns = [
            ("cycle", ColumnValues::U64(vec![1, 0, 0].into())),
            ("body", ColumnValues::U32(vec![7, 7, 8].into())),
            ("col", ColumnValues::U32(vec![1, 0, 9].into())),
            ("row", ColumnValues::U32(vec![0, 0, 9].into())),
            ("heading", ColumnValues::Label(vec![0, 0, 0].into())),
        ];
        let column = |name: &str| columns.iter().find(|(n, _)| *n == name).map(|(_, v)| v);
        let scenery = Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: Vec::new(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        };
        rows().trails(&scenery, &frame, &[BodyId::new(ROBOT, 7, None)], column)
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
        assert_eq!((trail.of, &trail.points[..]), (BodyId::new(ROBOT, 7, None), &way[..]));
    }

    #[test]
    fn rows_that_end_too_early_are_no_way() {
        assert!(trails(3).unwrap().is_empty());
        let none = rows().rows(9, &[], |_| None);
        assert_eq!(none, None, "a table with other columns");
    }
}
