//! Places of bodies at any cycle, from the tables that have them.

use crate::run_tables::has_rows;
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::view::{
    Body, BodyId, BodyKind, BodyRole, Frame, Pose, PositionTableColumns, Scenery, Shape, Trail,
    Vec3,
};
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{Table, read_table};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The approximate number of rows held at a time: some megabytes, and some seconds of playback.
const WINDOW_ROWS: u64 = 200_000;

/// Reads the poses of all bodies, window by window.
pub(super) struct PoseReader {
    folder: PathBuf,
    rows: Vec<PositionTableColumns>,
    scenery: Scenery,
    /// The bodies at the start, for their appearance.
    first: Vec<Body>,
    until: Cycle,
    /// The rows of each table around the last cycle.
    windows: Vec<Window>,
}

/// The rows of some cycles of a table.
struct Window {
    from: Cycle,
    table: Option<Table>,
}

/// Where a body is by its rows, and how it moves.
struct RecordedMotion {
    pose: Pose,
    /// The velocity of traffic; none of other bodies, which keep theirs.
    velocity_m_s: Option<Vec3>,
}

impl PoseReader {
    /// Opens the tables of a folder.
    ///
    /// # Errors
    /// When one of them is damaged.
    pub(super) fn new(
        folder: &Path,
        rows: Vec<PositionTableColumns>,
        scenery: Scenery,
        first: Vec<Body>,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let mut reader =
            Self { folder: folder.to_path_buf(), rows, scenery, first, until, windows: Vec::new() };
        for k in 0..reader.rows.len() {
            let window = reader.read(k, 0)?;
            reader.windows.push(window);
        }
        Ok(reader)
    }

    /// Returns the window around a cycle. Windows start at multiples of their length, so playback reads one after the
    /// other.
    fn window_range(&self, rows: &PositionTableColumns, cycle: Cycle) -> Range<Cycle> {
        let bodies = self.first.iter().filter(|body| body.kind == rows.kind).count();
        let cycles = (WINDOW_ROWS / bodies.max(1) as u64).max(1) * rows.interval;
        let from = cycle / cycles * cycles;
        from..from + cycles
    }

    /// Reads the rows around a cycle, and one moment before them, for directions.
    fn read(&self, k: usize, cycle: Cycle) -> Result<Window, InputError> {
        let rows = &self.rows[k];
        let range = self.window_range(rows, cycle);
        if !has_rows(&self.folder, rows.table) {
            return Ok(Window { from: range.start, table: None });
        }
        // Two intervals more: the row of a body may be one interval old, and its direction is that from the row
        // before.
        let before = range.start.saturating_sub(2 * rows.interval);
        let table = read_table(&self.folder, rows.table, before..range.end)?;
        Ok(Window { from: range.start, table: Some(table) })
    }

    /// Returns the bodies of a cycle. Bodies that are gone are left out, and so are all that move but have no rows.
    pub(super) fn bodies_at(&mut self, cycle: Cycle) -> Vec<Body> {
        // Rows are for the starts of cycles, and none starts at the end.
        let cycle = cycle.min(self.until.saturating_sub(1));
        let mut poses = BTreeMap::new();
        for k in 0..self.rows.len() {
            let from = self.window_range(&self.rows[k], cycle).start;
            if self.windows[k].from != from {
                // It could be read at the start. Rows that cannot be read now are not shown.
                self.windows[k] = self.read(k, cycle).unwrap_or(Window { from, table: None });
            }
            if let Some(table) = &self.windows[k].table {
                poses.extend(self.poses(&self.rows[k], table, cycle));
            }
        }
        self.bodies_with_poses(&poses)
    }

    /// Returns the poses of the bodies of a table that have a recent row.
    fn poses(
        &self,
        rows: &PositionTableColumns,
        table: &Table,
        cycle: Cycle,
    ) -> Vec<(BodyId, RecordedMotion)> {
        let Some(headings) = last_headings(rows, table, cycle) else { return Vec::new() };
        let whose: Vec<BodyId> = headings.keys().copied().collect();
        let mut bodies = Vec::new();
        for body in self.first.iter().filter(|body| has_rows_in(rows, body)) {
            // In a table that has other bodies beside agents, all have the kind of the agents.
            bodies.push(Body { kind: rows.kind, ..body.clone() });
        }
        // Trails end before the cycle of a frame, so the next cycle includes the rows of this one.
        let frame = Frame { cycle: cycle + 1, bodies, ..Frame::default() };
        let trails = rows.trails(&self.scenery, &frame, &whose, |name| table.column(name));
        let mut poses = Vec::new();
        for Trail { of, points } in trails.unwrap_or_default() {
            if let Some(pose) = last_pose(rows, &points, headings[&of], cycle) {
                let velocity_m_s = self.velocity_m_s(&points, cycle);
                poses.push((of, RecordedMotion { pose, velocity_m_s }));
            }
        }
        poses
    }

    /// Returns the velocity of traffic between its last two points; zero before its second one.
    fn velocity_m_s(&self, points: &[(Cycle, Vec3)], cycle: Cycle) -> Option<Vec3> {
        self.scenery.traffic.as_ref()?;
        let known = points.partition_point(|(at, _)| *at <= cycle);
        if known < 2 {
            return Some([0.0; 3]);
        }
        let (from, from_m) = points[known - 2];
        let (to, to_m) = points[known - 1];
        let time_s = (to - from) as f64 * self.scenery.cycle_s;
        if time_s <= 0.0 {
            return Some([0.0; 3]);
        }
        Some(std::array::from_fn(|k| (to_m[k] - from_m[k]) / time_s))
    }

    /// Returns the bodies at their places, the known ones in the order of the start.
    fn bodies_with_poses(&self, poses: &BTreeMap<BodyId, RecordedMotion>) -> Vec<Body> {
        let mut used = BTreeSet::new();
        let mut joints: BTreeMap<u32, u32> = BTreeMap::new();
        let mut bodies = Vec::new();
        for body in &self.first {
            let recorded_id = self.recorded_id(body);
            let moved = match body.kind.role() {
                // Rods have no rows of their own: they are lines through the connectors' places.
                BodyRole::LineThroughParts(kind) => {
                    let joint = joints.entry(body.number).or_default();
                    line_through_parts(body, kind, poses, joint)
                }
                BodyRole::AroundAgent(kind) => {
                    poses.get(&BodyId::new(kind, body.number, None)).map(|motion| Body {
                        pose: Pose::from_position(motion.pose.at_m),
                        ..body.clone()
                    })
                }
                _ => recorded_id.and_then(|id| poses.get(&id)).map(|motion| {
                    used.extend(recorded_id);
                    let RecordedMotion { pose, velocity_m_s } = *motion;
                    let velocity_m_s = velocity_m_s.unwrap_or(body.velocity_m_s);
                    Body { pose, velocity_m_s, ..body.clone() }
                }),
            };
            // What has no rows in any table does not move, such as a door or an obstacle. Agents without rows do: robots
            // on the joints of a chain.
            let is_carried =
                body.kind.is_of_agent() || matches!(body.kind.role(), BodyRole::AroundAgent(_));
            let stays = recorded_id.is_none() && !is_carried;
            match moved {
                Some(moved) => bodies.push(moved),
                None if stays => bodies.push(body.clone()),
                None => {}
            }
        }
        let late = poses.iter().filter(|(who, _)| !used.contains(*who));
        bodies.extend(late.map(|(who, motion)| self.new_body(*who, motion)));
        bodies
    }

    /// Returns the id of a body in the tables, if it has rows there.
    fn recorded_id(&self, body: &Body) -> Option<BodyId> {
        let rows = self.rows.iter().find(|rows| has_rows_in(rows, body))?;
        Some(BodyId::new(rows.kind, body.number, body.part))
    }

    /// Returns a body that was not there at the start; it looks like the others of its kind.
    fn new_body(&self, who: BodyId, motion: &RecordedMotion) -> Body {
        let BodyId { kind, number, part } = who;
        let other = self.first.iter().find(|body| body.kind == kind);
        let shape = other.map_or(Shape::Sphere { radius_m: 1.0 }, |body| body.shape.clone());
        let RecordedMotion { pose, velocity_m_s } = *motion;
        let velocity_m_s = velocity_m_s.unwrap_or_default();
        Body { part, velocity_m_s, ..Body::new(kind, number, pose, shape) }
    }
}

/// Returns the pose of a body at a cycle, from its recorded points: with its recorded heading in quarter turns, or in
/// the direction of its last motion. `None` if its last point is older than the interval of rows: it is gone.
fn last_pose(
    rows: &PositionTableColumns,
    points: &[(Cycle, Vec3)],
    heading: Option<u32>,
    cycle: Cycle,
) -> Option<Pose> {
    let known: Vec<_> = points.iter().filter(|(at, _)| *at <= cycle).collect();
    let (last, at_m) = **known.last()?;
    if last + rows.interval <= cycle {
        return None;
    }
    let yaw_rad = rows.plane.map_or(0.0, |plane| plane.yaw_rad);
    let recorded_rad = heading.map(|quarters| f64::from(quarters) * FRAC_PI_2 + yaw_rad);
    let before = known.iter().rev().find(|(_, before)| *before != at_m);
    let motion_rad = before.map(|(_, [x, y, _])| (at_m[1] - y).atan2(at_m[0] - x));
    Some(Pose::from_heading(at_m, recorded_rad.or(motion_rad).unwrap_or(0.0)))
}

/// Returns whether a body may have rows.
fn has_rows_in(rows: &PositionTableColumns, body: &Body) -> bool {
    let is_kind = body.kind == rows.kind || body.kind.role() == BodyRole::MovesAmong(rows.kind);
    is_kind && body.part.is_some() == rows.part.is_some()
}

/// Returns the line through the next parts of a kind, after those of the lines before.
fn line_through_parts(
    body: &Body,
    kind: BodyKind,
    poses: &BTreeMap<BodyId, RecordedMotion>,
    joint: &mut u32,
) -> Option<Body> {
    let Shape::Line { points_m, thickness_m } = &body.shape else { return None };
    let from = *joint;
    *joint += points_m.len() as u32;
    let mut joints_m = Vec::with_capacity(points_m.len());
    for part in from..*joint {
        let id = BodyId::new(kind, body.number, Some(part));
        joints_m.push(poses.get(&id)?.pose.at_m);
    }
    let shape = Shape::Line { points_m: joints_m, thickness_m: *thickness_m };
    Some(Body { shape, ..body.clone() })
}

/// Returns all bodies that have rows up to a cycle, with the last recorded heading in quarter turns.
fn last_headings(
    rows: &PositionTableColumns,
    table: &Table,
    cycle: Cycle,
) -> Option<BTreeMap<BodyId, Option<u32>>> {
    let ColumnValues::U64(cycles) = table.column("cycle")? else { return None };
    let mut found: BTreeMap<BodyId, (Cycle, Option<u32>)> = BTreeMap::new();
    for (row, &at) in cycles.iter().enumerate().filter(|(_, at)| **at <= cycle) {
        let number = whole_number(table, rows.number, row)?;
        let part = rows.part.and_then(|part| whole_number(table, part, row));
        let last = found.entry(BodyId::new(rows.kind, number, part)).or_default();
        if at >= last.0 {
            *last = (at, rows.heading.and_then(|heading| whole_number(table, heading, row)));
        }
    }
    Some(found.into_iter().map(|(who, (_, heading))| (who, heading)).collect())
}

fn whole_number(table: &Table, column: &str, row: usize) -> Option<u32> {
    table.column(column)?.number(row).map(|number| number as u32)
}
