//! Some consecutive frames as few bytes.
//!
//! ```text
//! u32 number of segments; of each segment, whose frames have the same bodies and as many points:
//!   u32 body table     u32 frames     u32 bodies (n)     u32 lines (k)     u32 points of all lines (p)
//!   u32 velocities: 3n of traffic, else 0
//!   u32[k+1]           first point of each line
//!   plane (see plane.rs) of d*n places and d*p points
//!   plane of n headings, or 4n components of quaternions
//!   plane of velocities, if there are any
//!   plane of n conditions
//! ```
//! The columns are those of frames of the [protocol](crate::protocol).

use super::plane;
use crate::encode::FrameColumns;

/// Maximum number of values in a chunk: one is decoded within a picture of a browser.
const MAX_VALUES: usize = 1 << 19;
/// Maximum number of frames in a chunk, so that a seek decodes little.
const MAX_FRAMES: usize = 512;
/// The exponent of the step of angles and of components of quaternions: as fine as `f32` is there.
const FINEST_TURN: i8 = -24;

/// The exponent of the step of velocities: 4 mm/s, which is below a pixel of any vector and a digit of any text.
const FINEST_VELOCITY: i8 = -8;

/// Frames that are collected until they are a chunk.
pub(super) struct ChunkBuilder {
    frames: Vec<FrameColumns>,
    values: usize,
    /// The exponent of the finest step of places.
    finest: i8,
}

impl ChunkBuilder {
    pub(super) fn new(finest: i8) -> Self {
        Self { frames: Vec::new(), values: 0, finest }
    }

    /// Adds a frame; returns the chunk that it completes, with its number of frames.
    pub(super) fn push(&mut self, frame: FrameColumns) -> Option<(Vec<u8>, u32)> {
        self.values += frame.places.len() + frame.turns.len() + frame.conditions.len();
        self.values += frame.velocities.len();
        self.frames.push(frame);
        let is_full = self.values >= MAX_VALUES || self.frames.len() == MAX_FRAMES;
        if is_full { self.take() } else { None }
    }

    /// Returns the chunk of the frames so far; none if there are none.
    pub(super) fn take(&mut self) -> Option<(Vec<u8>, u32)> {
        let frames = std::mem::take(&mut self.frames);
        self.values = 0;
        if frames.is_empty() {
            return None;
        }
        let segments: Vec<&[FrameColumns]> =
            frames.chunk_by(FrameColumns::has_same_layout).collect();
        let mut out = Vec::new();
        out.extend((segments.len() as u32).to_le_bytes());
        segments.iter().for_each(|segment| push_segment(&mut out, segment, self.finest));
        Some((out, frames.len() as u32))
    }
}

fn push_segment(out: &mut Vec<u8>, frames: &[FrameColumns], finest: i8) {
    let FrameColumns { table, line_starts, velocities, conditions, .. } = &frames[0];
    let points = line_starts.last().copied().unwrap_or(0);
    let lines = line_starts.len().saturating_sub(1);
    for n in [*table, frames.len() as u32, conditions.len() as u32, lines as u32, points] {
        out.extend(n.to_le_bytes());
    }
    out.extend((velocities.len() as u32).to_le_bytes());
    line_starts.iter().for_each(|start| out.extend(start.to_le_bytes()));
    let places: Vec<&[f32]> = frames.iter().map(|frame| &frame.places[..]).collect();
    out.extend(plane::encode(&places, finest));
    let turns: Vec<&[f32]> = frames.iter().map(|frame| &frame.turns[..]).collect();
    out.extend(plane::encode(&turns, FINEST_TURN));
    if !velocities.is_empty() {
        let velocities: Vec<&[f32]> = frames.iter().map(|frame| &frame.velocities[..]).collect();
        out.extend(plane::encode(&velocities, FINEST_VELOCITY));
    }
    let conditions: Vec<&[f32]> = frames.iter().map(|frame| &frame.conditions[..]).collect();
    out.extend(plane::encode(&conditions, 0));
}
