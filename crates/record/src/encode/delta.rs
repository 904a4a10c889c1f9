//! DELTA_BINARY_PACKED: differences of consecutive integers, bit-packed.
//!
//! A page is a header, then blocks of 128 differences: the smallest one, then four groups of 32,
//! each packed with as many bits as the group needs. For a robot that moves by one box, a
//! coordinate takes two bits.

use super::packing::{PACK, Packer, bits, put_varint, put_zigzag, width_u32};

/// Number of differences in a block; the format asks for a multiple of 128, and short blocks adapt better.
const BLOCK: usize = 128;
/// The format wants a multiple of 32 differences in a group, which is what [`PACK`] is.
const GROUPS: usize = BLOCK / PACK;

/// An integer with differences that wrap around in its own width.
pub(crate) trait Integer: Copy + Ord {
    /// The type of a difference.
    type Delta: Copy + Default + Ord;

    /// `self - previous`, wrapping.
    fn minus(self, previous: Self) -> Self::Delta;

    /// The value as the header's signed integer.
    fn signed(self) -> i64;

    /// Appends one block.
    fn put_block(deltas: &[Self::Delta; BLOCK], packer: &Packer, out: &mut Vec<u8>);
}

impl Integer for u32 {
    type Delta = i32;

    fn minus(self, previous: Self) -> i32 {
        self.wrapping_sub(previous) as i32
    }

    fn signed(self) -> i64 {
        i64::from(self as i32)
    }

    fn put_block(deltas: &[i32; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
        put_narrow_block(deltas, packer, out);
    }
}

impl Integer for i32 {
    type Delta = i32;

    fn minus(self, previous: Self) -> i32 {
        self.wrapping_sub(previous)
    }

    fn signed(self) -> i64 {
        i64::from(self)
    }

    fn put_block(deltas: &[i32; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
        put_narrow_block(deltas, packer, out);
    }
}

impl Integer for u64 {
    type Delta = i64;

    fn minus(self, previous: Self) -> i64 {
        self.wrapping_sub(previous) as i64
    }

    fn signed(self) -> i64 {
        self as i64
    }

    fn put_block(deltas: &[i64; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
        put_any_block(deltas, packer, out);
    }
}

impl Integer for i64 {
    type Delta = i64;

    fn minus(self, previous: Self) -> i64 {
        self.wrapping_sub(previous)
    }

    fn signed(self) -> i64 {
        self
    }

    fn put_block(deltas: &[i64; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
        put_any_block(deltas, packer, out);
    }
}

/// Appends a block of 64-bit differences. Nearly every block of a counter has small differences,
/// which take the narrow path.
fn put_any_block(deltas: &[i64; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
    let narrow = deltas.map(|d| d as i32);
    let changed = deltas.iter().zip(&narrow).fold(0, |all, (d, n)| all | (d ^ i64::from(*n)));
    if changed == 0 {
        put_narrow_block(&narrow, packer, out);
    } else {
        put_wide_block(deltas, packer, out);
    }
}

/// Appends a block of differences that fit 32 bits; with the smallest one subtracted they still do, without a sign.
fn put_narrow_block(deltas: &[i32; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
    let least = deltas.iter().copied().fold(i32::MAX, i32::min);
    let above = deltas.map(|d| d.wrapping_sub(least) as u32);
    put_zigzag(i64::from(least), out);
    let (groups, _) = above.as_chunks::<PACK>();
    let mut widths = [0; GROUPS];
    for (width, group) in widths.iter_mut().zip(groups) {
        *width = width_u32(group);
    }
    out.extend_from_slice(&widths);
    for (&width, group) in widths.iter().zip(groups) {
        packer.pack(group, width, out);
    }
}

/// Returns the number of bits for each value of a group: as many as the largest needs, or 64, because the packer takes
/// values of up to 32 bits.
fn group_width(group: &[u64; PACK]) -> u8 {
    match bits(group.iter().fold(0, |all, v| all | v)) {
        narrow @ 0..=32 => narrow,
        _ => 64,
    }
}

/// Appends a block with some difference of more than 32 bits. Groups that need it are stored with
/// 64 bits: this is rare, so speed and size matter little.
fn put_wide_block(deltas: &[i64; BLOCK], packer: &Packer, out: &mut Vec<u8>) {
    let least = deltas.iter().copied().fold(i64::MAX, i64::min);
    let above = deltas.map(|d| d.wrapping_sub(least) as u64);
    put_zigzag(least, out);
    let (groups, _) = above.as_chunks::<PACK>();
    out.extend(groups.iter().map(group_width));
    for group in groups {
        match group_width(group) {
            64 => out.extend(group.iter().flat_map(|v| v.to_le_bytes())),
            narrow => packer.pack(&group.map(|v| v as u32), narrow, out),
        }
    }
}

/// Encodes one page after another.
pub(crate) struct DeltaEncoder<V: Integer> {
    packer: Packer,
    first: Option<V>,
    previous: Option<V>,
    count: usize,
    deltas: Box<[V::Delta; BLOCK]>,
    pending: usize,
    body: Vec<u8>,
}

impl<V: Integer> DeltaEncoder<V> {
    /// Returns an encoder with an empty page.
    pub(crate) fn new() -> Self {
        Self {
            packer: Packer::new(),
            first: None,
            previous: None,
            count: 0,
            deltas: Box::new([V::Delta::default(); BLOCK]),
            pending: 0,
            body: Vec::new(),
        }
    }

    /// Appends values to the page.
    pub(crate) fn extend(&mut self, values: &[V]) {
        let Some((&first, rest)) = values.split_first() else { return };
        self.count += values.len();
        match self.previous {
            Some(previous) => self.push(first.minus(previous)),
            None => self.first = Some(first),
        }
        self.extend_differences(values);
        self.previous = Some(*rest.last().unwrap_or(&first));
    }

    fn push(&mut self, delta: V::Delta) {
        self.deltas[self.pending] = delta;
        self.pending += 1;
        if self.pending == BLOCK {
            self.put_block();
        }
    }

    /// Appends the differences inside `values`, as many at a time as fit the block.
    fn extend_differences(&mut self, mut values: &[V]) {
        while values.len() > 1 {
            let n = (BLOCK - self.pending).min(values.len() - 1);
            let deltas = &mut self.deltas[self.pending..self.pending + n];
            for ((delta, v), previous) in deltas.iter_mut().zip(&values[1..]).zip(values) {
                *delta = v.minus(*previous);
            }
            self.pending += n;
            values = &values[n..];
            if self.pending == BLOCK {
                self.put_block();
            }
        }
    }

    fn put_block(&mut self) {
        V::put_block(&self.deltas, &self.packer, &mut self.body);
        self.pending = 0;
    }

    /// Ends the page and returns its bytes; the next one starts empty.
    pub(crate) fn take_page(&mut self) -> Vec<u8> {
        if let Some(&least) = self.deltas[..self.pending].iter().min() {
            // Unused groups become all zero, so that their width is 0, as the format requires.
            self.deltas[self.pending..].fill(least);
            self.put_block();
        }
        let mut page = Vec::with_capacity(self.body.len() + 32);
        put_varint(BLOCK as u64, &mut page);
        put_varint(GROUPS as u64, &mut page);
        put_varint(self.count as u64, &mut page);
        put_zigzag(self.first.map_or(0, V::signed), &mut page);
        page.extend_from_slice(&self.body);
        self.body.clear();
        (self.first, self.previous, self.count) = (None, None, 0);
        page
    }
}
