//! Frames as bytes, and the messages beside them. The layout is in [`protocol`](crate::protocol).

mod body_set;
mod columns;
mod convert;

pub(crate) use columns::FrameColumns;
pub(crate) use convert::{body_id, event, problem, requested_body, scan, scene};

use crate::protocol::{BodyTable, FrameText, SessionId, VERSION};
use body_set::BodySet;
use sidestep_kernel::view::{Body, BodyCondition, BodyKind, Frame, Pose, Scenery, Shape};
use std::collections::BTreeMap;

/// First bytes of a frame: `SSTF`, least significant byte first.
const MAGIC: u32 = 0x4654_5353;
/// Bytes before the first column; a multiple of 8, so that the two floats in it are aligned.
const HEADER_BYTES: usize = 56;

/// Encodes the frames of a session, and a body table whenever the bodies are no longer those of the last one.
pub struct FrameEncoder {
    session: SessionId,
    dimensions: u8,
    /// Whether frames have the velocities of bodies.
    has_velocities: bool,
    names: BTreeMap<(BodyKind, u32), String>,
    body_set: Option<BodySet>,
    tables: u32,
}

impl FrameEncoder {
    /// Creates an encoder for a run with this scenery, whose first frame begins a body table.
    pub fn new(session: SessionId, scenery: &Scenery) -> Self {
        let names = BTreeMap::new();
        let mut encoder = Self {
            session,
            dimensions: 2,
            has_velocities: false,
            names,
            body_set: None,
            tables: 0,
        };
        encoder.restart(scenery);
        encoder
    }

    /// Switches to another run; the numbering of body tables continues.
    pub fn restart(&mut self, scenery: &Scenery) {
        self.names.clear();
        for (kind, number, name) in &scenery.names {
            self.names.insert((*kind, *number), name.clone());
        }
        self.dimensions = scenery.dimensions;
        self.has_velocities = scenery.traffic.is_some();
        self.body_set = None;
    }

    /// Returns a frame as bytes, and the body table that it begins, if it begins one.
    pub fn encode(
        &mut self,
        frame: &Frame,
        text: &FrameText,
        left_out: u32,
    ) -> (Option<BodyTable>, Vec<u8>) {
        let is_new =
            !self.body_set.as_ref().is_some_and(|body_set| body_set.matches(&frame.bodies));
        if is_new {
            self.tables += 1;
            self.body_set = Some(BodySet::from_bodies(&frame.bodies, self.dimensions));
        }
        let table = self.body_set.as_ref().filter(|_| is_new).map(|body_set| {
            body_set.to_table(self.session, self.tables, &frame.bodies, &self.names)
        });
        // Text made of numbers and strings only: serializing cannot fail.
        let text = serde_json::to_vec(text).unwrap_or_default();
        (table, self.frame_bytes(frame, &text, left_out))
    }

    fn frame_bytes(&self, frame: &Frame, text: &[u8], left_out: u32) -> Vec<u8> {
        let bodies = &frame.bodies;
        let lines: Vec<&[[f64; 3]]> = bodies.iter().filter_map(line_points).collect();
        let count: usize = lines.iter().map(|points| points.len()).sum();
        let d = usize::from(self.dimensions);
        let velocities = if self.has_velocities { 3 * bodies.len() } else { 0 };
        let floats = (d + if d == 2 { 1 } else { 4 }) * bodies.len() + d * count + velocities;
        let flags = bodies.len().next_multiple_of(4);
        let size = HEADER_BYTES + 4 * (floats + lines.len() + 1) + flags + text.len();
        let mut out = Vec::with_capacity(size);
        let counts = [bodies.len(), lines.len(), count, text.len()];
        self.put_header(&mut out, frame, counts.map(|n| n as u32), left_out);
        put_column(&mut out, bodies.iter().flat_map(|body| body.pose.at_m.into_iter().take(d)));
        match d {
            2 => put_column(&mut out, bodies.iter().map(|body| heading_rad(&body.pose))),
            _ => put_column(&mut out, bodies.iter().flat_map(|body| body.pose.turn)),
        }
        put_starts(&mut out, &lines);
        put_column(
            &mut out,
            lines.iter().copied().flatten().flat_map(|at_m| at_m.iter().copied().take(d)),
        );
        if self.has_velocities {
            put_column(&mut out, bodies.iter().flat_map(|body| body.velocity_m_s));
        }
        out.extend(bodies.iter().map(|body| condition_code(body.state)));
        out.resize(out.len() + flags - bodies.len(), 0);
        out.extend_from_slice(text);
        debug_assert_eq!(out.len(), size);
        out
    }

    fn put_header(&self, out: &mut Vec<u8>, frame: &Frame, counts: [u32; 4], left_out: u32) {
        out.extend(MAGIC.to_le_bytes());
        out.extend((VERSION as u16).to_le_bytes());
        out.extend([self.dimensions, u8::from(self.has_velocities)]);
        out.extend(self.session.to_le_bytes());
        out.extend(self.tables.to_le_bytes());
        out.extend((frame.cycle as f64).to_le_bytes());
        out.extend(frame.time_s.to_le_bytes());
        counts.iter().chain(&[left_out, 0]).for_each(|n| out.extend(n.to_le_bytes()));
    }
}

fn line_points(body: &Body) -> Option<&[[f64; 3]]> {
    match &body.shape {
        Shape::Line { points_m, .. } => Some(points_m),
        _ => None,
    }
}

/// Writes a column of numbers as `f32`: half the bytes of `f64`, and finer than a pixel.
fn put_column(out: &mut Vec<u8>, numbers: impl Iterator<Item = f64>) {
    numbers.for_each(|number| out.extend_from_slice(&(number as f32).to_le_bytes()));
}

/// Writes the number of the first point of each line, and the number after the last point.
fn put_starts(out: &mut Vec<u8>, lines: &[&[[f64; 3]]]) {
    let mut start = 0_u32;
    out.extend(start.to_le_bytes());
    for points in lines {
        start += points.len() as u32;
        out.extend(start.to_le_bytes());
    }
}

/// Returns the heading of a body that is turned about the vertical axis alone.
fn heading_rad(pose: &Pose) -> f64 {
    let [_, _, z, w] = pose.turn;
    f64::from(2.0 * (z as f32).atan2(w as f32))
}

fn condition_code(condition: BodyCondition) -> u8 {
    match condition {
        BodyCondition::Plain => 0,
        BodyCondition::Leading => 1,
        BodyCondition::Open => 2,
        BodyCondition::Touching => 3,
        BodyCondition::Failed => 4,
    }
}

/// The conditions of a body, at the index that [`condition_code`] gives each; the page numbers them alike.
const CONDITIONS: [BodyCondition; 5] = [
    BodyCondition::Plain,
    BodyCondition::Leading,
    BodyCondition::Open,
    BodyCondition::Touching,
    BodyCondition::Failed,
];

#[cfg(test)]
mod tests;
