//! RLE_DICTIONARY: labels as indices into the vocabulary; runs are counted, the rest is bit-packed.

use super::packing::{PACK, Packer, bits, put_varint};

/// Number of indices handled together: either all equal, or bit-packed.
const CHUNK: usize = 4 * PACK;

/// Encodes one page of indices after another.
pub(crate) struct LabelEncoder {
    packer: Packer,
    width: u8,
    chunk: Box<[u32; CHUNK]>,
    pending: usize,
    /// The run that may still grow: value and length.
    run: (u32, usize),
    body: Vec<u8>,
}

impl LabelEncoder {
    /// Returns an encoder for indices below `labels`.
    pub(crate) fn new(labels: usize) -> Self {
        // At least one bit: width 0 is legal, but some readers fail on it.
        let width = bits(labels.saturating_sub(1) as u64).max(1);
        let packer = Packer::new();
        Self {
            packer,
            width,
            chunk: Box::new([0; CHUNK]),
            pending: 0,
            run: (0, 0),
            body: Vec::new(),
        }
    }

    /// Appends indices to the page.
    pub(crate) fn extend(&mut self, mut indices: &[u32]) {
        while !indices.is_empty() {
            let n = (CHUNK - self.pending).min(indices.len());
            self.chunk[self.pending..self.pending + n].copy_from_slice(&indices[..n]);
            self.pending += n;
            indices = &indices[n..];
            if self.pending == CHUNK {
                self.put_chunk();
            }
        }
    }

    fn put_chunk(&mut self) {
        let used = &self.chunk[..self.pending];
        let value = used[0];
        if used.iter().fold(0, |all, v| all | (v ^ value)) == 0 {
            self.extend_run(value, self.pending);
        } else {
            self.put_packed();
        }
        self.pending = 0;
    }

    fn extend_run(&mut self, value: u32, n: usize) {
        if self.run.0 != value {
            self.put_run();
        }
        self.run = (value, self.run.1 + n);
    }

    fn put_run(&mut self) {
        let (value, n) = self.run;
        if n > 0 {
            put_varint((n as u64) << 1, &mut self.body);
            let bytes = usize::from(self.width.div_ceil(8));
            self.body.extend_from_slice(&value.to_le_bytes()[..bytes]);
        }
        self.run.1 = 0;
    }

    /// Appends the chunk bit-packed; a short last chunk is padded to a multiple of eight.
    fn put_packed(&mut self) {
        self.put_run();
        self.chunk[self.pending..].fill(0);
        let eights = self.pending.div_ceil(8);
        put_varint((eights as u64) << 1 | 1, &mut self.body);
        let end = self.body.len() + eights * usize::from(self.width);
        let (groups, _) = self.chunk.as_chunks::<PACK>();
        for group in groups {
            self.packer.pack(group, self.width, &mut self.body);
        }
        self.body.truncate(end);
    }

    /// Ends the page and returns its bytes; the next one starts empty.
    pub(crate) fn take_page(&mut self) -> Vec<u8> {
        if self.pending > 0 {
            self.put_chunk();
        }
        self.put_run();
        let mut page = Vec::with_capacity(self.body.len() + 1);
        page.push(self.width);
        page.append(&mut self.body);
        page
    }
}
