//! The columns of an encoded frame, read back from its bytes: what a file keeps is what the page would have been sent.

use super::HEADER_BYTES;

/// The columns of a frame, as its bytes have them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameColumns {
    /// The number of the body table.
    pub(crate) table: u32,
    /// Places of bodies, then points of lines.
    pub(crate) places: Vec<f32>,
    /// Headings, or components of quaternions.
    pub(crate) turns: Vec<f32>,
    /// Velocities of bodies, east, north and up; of traffic only.
    pub(crate) velocities: Vec<f32>,
    /// First point of each line, and the number of all points.
    pub(crate) line_starts: Vec<u32>,
    /// Conditions of bodies, as numbers of their own.
    pub(crate) conditions: Vec<f32>,
}

impl FrameColumns {
    /// Reads the columns of a frame that was encoded here.
    pub(crate) fn from_frame(bytes: &[u8]) -> Self {
        let word = |at: usize| {
            let four = bytes[at..at + 4].try_into().unwrap_or_default();
            u32::from_le_bytes(four)
        };
        let count = |at: usize| word(at) as usize;
        let d = usize::from(bytes[6]);
        let bodies = count(32);
        let lines = count(36);
        let points = count(40);
        let mut at = HEADER_BYTES;
        let mut words = |n: usize| {
            let found: Vec<u32> = (0..n).map(|k| word(at + 4 * k)).collect();
            at += 4 * n;
            found
        };
        let floats = |words: Vec<u32>| words.into_iter().map(f32::from_bits);
        let mut places: Vec<f32> = floats(words(d * bodies)).collect();
        let turns = floats(words(bodies * if d == 2 { 1 } else { 4 })).collect();
        let line_starts = words(lines + 1);
        places.extend(floats(words(d * points)));
        let velocities = floats(words(if bytes[7] == 1 { 3 * bodies } else { 0 })).collect();
        let conditions = bytes[at..at + bodies].iter().map(|&code| f32::from(code)).collect();
        Self { table: word(12), places, turns, velocities, line_starts, conditions }
    }

    /// Returns whether the columns of two frames stand for the same bodies and points.
    pub(crate) fn has_same_layout(&self, other: &Self) -> bool {
        self.table == other.table && self.line_starts == other.line_starts
    }
}
