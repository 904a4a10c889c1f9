//! Places of bodies at any cycle, from the tables that have them.

use crate::run_tables::has_rows;
use sidestep_kernel::ports::Values;
use sidestep_kernel::view::{
    Body, BodyId, BodyKind, Frame, Pose, PositionColumns, Scenery, Shape, Vec3,
};
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{Table, read_table};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

/// The approximate number of rows held at a time.
const WINDOW_ROWS: u64 = 200_000;

/// The bodies of a recording.
pub(super) struct PoseReader {
    folder: PathBuf,
    rows: Vec<PositionColumns>,
    scenery: Scenery,
    /// The bodies at the start, for their appearance.
    first: Vec<Body>,
    until: Cycle,
    window: Vec<Window>,
}

/// The rows of some cycles of a table.
struct Window {
    from: Cycle,
    table: Option<Table>,
}

impl PoseReader {
    /// Opens the tables of a folder.
    ///
    /// # Errors
    /// When one of them is damaged.
    pub(super) fn new(
        folder: &Path,
        rows: Vec<PositionColumns>,
        scenery: Scenery,
        first: Vec<Body>,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let folder = folder.to_path_buf();
        let window = Vec::new();
        let mut places = Self { folder, rows, scenery, first, until, window };
        for k in 0..places.rows.len() {
            let window = places.read(k, 0)?;
            places.window.push(window);
        }
        Ok(places)
    }

    /// Returns the number of cycles of a window, and its first cycle.
    fn window_range(&self, rows: &PositionColumns, cycle: Cycle) -> (Cycle, Cycle) {
        let bodies = self.first.iter().filter(|body| body.kind == rows.kind).count();
        let cycles = (WINDOW_ROWS / bodies.max(1) as u64).max(1) * rows.interval;
        (cycle / cycles * cycles, cycles)
    }

    /// Reads the rows around a cycle, and one moment before them, for directions.
    fn read(&self, k: usize, cycle: Cycle) -> Result<Window, InputError> {
        let rows = &self.rows[k];
        let (from, cycles) = self.window_range(rows, cycle);
        if !has_rows(&self.folder, rows.table) {
            return Ok(Window { from, table: None });
        }
        let before = from.saturating_sub(2 * rows.interval);
        let table = read_table(&self.folder, rows.table, before..from + cycles)?;
        Ok(Window { from, table: Some(table) })
    }

    /// Returns the bodies of a cycle. Bodies that are gone are left out, and so are all that move but have no rows.
    pub(super) fn bodies_at(&mut self, cycle: Cycle) -> Vec<Body> {
        // Rows are for the starts of cycles, and none starts at the end.
        let cycle = cycle.min(self.until.saturating_sub(1));
        let mut poses = BTreeMap::new();
        for k in 0..self.rows.len() {
            if self.window_range(&self.rows[k], cycle).0 != self.window[k].from {
                // It could be read at the start. Rows that cannot be read now are not shown.
                let (from, _) = self.window_range(&self.rows[k], cycle);
                self.window[k] = self.read(k, cycle).unwrap_or(Window { from, table: None });
            }
            if let Some(table) = &self.window[k].table {
                poses.extend(self.poses(&self.rows[k], table, cycle));
            }
        }
        self.bodies_with_poses(&poses)
    }

    /// Returns the poses of the bodies of a table.
    fn poses(&self, rows: &PositionColumns, table: &Table, cycle: Cycle) -> Vec<(BodyId, Pose)> {
        let Some(headings) = last_headings(rows, table, cycle) else { return Vec::new() };
        let whose: Vec<BodyId> = headings.keys().copied().collect();
        // The numbers of people follow those of robots, in one table.
        let like = |body: &Body| Body { kind: rows.kind, ..body.clone() };
        let bodies = self.first.iter().filter(|body| has_rows_in(rows, body)).map(like).collect();
        let frame = Frame { cycle: cycle + 1, bodies, ..Frame::default() };
        let trails = rows.trails(&self.scenery, &frame, &whose, |name| table.column(name));
        let pose = |who: BodyId, way: &[(Cycle, Vec3)]| {
            let known: Vec<_> = way.iter().filter(|(at, _)| *at <= cycle).collect();
            let (last, at_m) = **known.last()?;
            let before = known.iter().rev().find(|(_, before)| *before != at_m);
            let ahead = before.map(|(_, [x, y, _])| (at_m[1] - y).atan2(at_m[0] - x));
            let yaw_rad = rows.plane.map_or(0.0, |plane| plane.yaw_rad);
            let quarters = headings[&who].map(|quarters| f64::from(quarters) * FRAC_PI_2 + yaw_rad);
            let is_here = last + rows.interval > cycle;
            is_here.then(|| (who, Pose::from_heading(at_m, quarters.or(ahead).unwrap_or(0.0))))
        };
        let trails = trails.unwrap_or_default();
        trails.iter().filter_map(|trail| pose(trail.of, &trail.points)).collect()
    }

    /// Returns the bodies at their places, the known ones in the order of the start.
    fn bodies_with_poses(&self, poses: &BTreeMap<BodyId, Pose>) -> Vec<Body> {
        let mut used = BTreeSet::new();
        let mut joints: BTreeMap<u32, u32> = BTreeMap::new();
        let mut bodies = Vec::new();
        for body in &self.first {
            let who = self.recorded_id(body);
            let followed = match body.kind {
                BodyKind::Rods => rods_body(body, poses, joints.entry(body.number).or_default()),
                BodyKind::Zone => poses
                    .get(&BodyId::new(BodyKind::Airplane, body.number, None))
                    .map(|pose| Body { pose: Pose::from_position(pose.at_m), ..body.clone() }),
                _ => who.and_then(|who| poses.get(&who)).map(|pose| {
                    used.extend(who);
                    Body { pose: *pose, ..body.clone() }
                }),
            };
            let stays = who.is_none()
                && !matches!(body.kind, BodyKind::Rods | BodyKind::Zone | BodyKind::Robot);
            bodies.extend(followed.or_else(|| stays.then(|| body.clone())));
        }
        let late = poses.iter().filter(|(who, _)| !used.contains(*who));
        bodies.extend(late.map(|(who, pose)| self.new_body(*who, *pose)));
        bodies
    }

    /// Returns the name of a body in the tables, if it has rows there.
    fn recorded_id(&self, body: &Body) -> Option<BodyId> {
        let rows = self.rows.iter().find(|rows| has_rows_in(rows, body))?;
        Some(BodyId::new(rows.kind, body.number, body.part))
    }

    /// Returns a body that was not there at the start; it looks like the others of its kind.
    fn new_body(&self, who: BodyId, pose: Pose) -> Body {
        let BodyId { kind, number, part } = who;
        let like = self.first.iter().find(|body| body.kind == kind);
        let shape = like.map_or(Shape::Sphere { radius_m: 1.0 }, |body| body.shape.clone());
        Body { part, ..Body::new(kind, number, pose, shape) }
    }
}

/// Returns whether a body may have rows.
fn has_rows_in(rows: &PositionColumns, body: &Body) -> bool {
    let is_kind =
        body.kind == rows.kind || (rows.kind == BodyKind::Robot && body.kind == BodyKind::Person);
    is_kind && body.part.is_some() == rows.part.is_some()
}

/// Returns the line through the next joints, after those of the lines before.
fn rods_body(body: &Body, poses: &BTreeMap<BodyId, Pose>, joint: &mut u32) -> Option<Body> {
    let Shape::Line { points_m, thickness_m } = &body.shape else { return None };
    let from = *joint;
    *joint += points_m.len() as u32;
    let place =
        |part| Some(poses.get(&BodyId::new(BodyKind::Connector, body.number, Some(part)))?.at_m);
    let points_m = (from..*joint).map(place).collect::<Option<Vec<_>>>()?;
    let shape = Shape::Line { points_m, thickness_m: *thickness_m };
    Some(Body { shape, ..body.clone() })
}

/// Returns all bodies that have rows up to a cycle, with the last recorded heading in quarter turns.
fn last_headings(
    rows: &PositionColumns,
    table: &Table,
    cycle: Cycle,
) -> Option<BTreeMap<BodyId, Option<u32>>> {
    let Values::U64(cycles) = table.column("cycle")? else { return None };
    let whole = |name: &str, row| table.column(name)?.number(row).map(|number| number as u32);
    let mut found: BTreeMap<BodyId, (Cycle, Option<u32>)> = BTreeMap::new();
    for (row, &at) in cycles.iter().enumerate().filter(|(_, at)| **at <= cycle) {
        let part = rows.part.and_then(|part| whole(part, row));
        let who = BodyId::new(rows.kind, whole(rows.number, row)?, part);
        let last = found.entry(who).or_default();
        if at >= last.0 {
            *last = (at, rows.heading.and_then(|ahead| whole(ahead, row)));
        }
    }
    Some(found.into_iter().map(|(who, (_, heading))| (who, heading)).collect())
}
