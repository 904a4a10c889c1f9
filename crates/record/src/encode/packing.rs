//! Bit packing and the variable-length integers of the Parquet format.

use bitpacking::{BitPacker, BitPacker1x};

/// Number of values that [`Packer::pack`] takes at once.
pub(super) const PACK: usize = BitPacker1x::BLOCK_LEN;

/// Appends values of few bits, least significant bit first, as both Parquet encodings require.
pub(super) struct Packer(BitPacker1x);

impl Packer {
    pub(super) fn new() -> Self {
        Self(BitPacker1x::new())
    }

    /// Appends `values` with `width` bits (at most 32) each.
    pub(super) fn pack(&self, values: &[u32; PACK], width: u8, out: &mut Vec<u8>) {
        let start = out.len();
        out.resize(start + PACK * usize::from(width) / 8, 0);
        self.0.compress(values, &mut out[start..], width);
    }
}

/// Returns the number of bits that the largest of `values` needs; 0 if all are 0.
pub(super) fn width_u32(values: &[u32]) -> u8 {
    bits(u64::from(values.iter().fold(0, |all, v| all | v)))
}

/// Returns the number of bits that `value` needs; 0 for 0.
pub(super) fn bits(value: u64) -> u8 {
    (u64::BITS - value.leading_zeros()) as u8
}

/// Appends an unsigned LEB128 integer.
pub(super) fn put_varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Appends a signed integer; small magnitudes take few bytes.
pub(super) fn put_zigzag(value: i64, out: &mut Vec<u8>) {
    put_varint(((value << 1) ^ (value >> 63)) as u64, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_puts_the_first_value_into_the_lowest_bits() {
        let mut values = [0; PACK];
        values[0] = 0b101;
        values[1] = 0b011;
        values[31] = 0b111;
        let mut out = vec![9];
        Packer::new().pack(&values, 3, &mut out);
        assert_eq!(out, [9, 0b0001_1101, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0b1110_0000]);
    }

    #[test]
    fn integers_follow_the_examples_of_the_format() {
        let mut out = Vec::new();
        put_varint(300, &mut out);
        put_zigzag(-1, &mut out);
        put_zigzag(i64::MIN, &mut out);
        assert_eq!(out[..3], [0xAC, 0x02, 0x01]);
        assert_eq!(out.len(), 3 + 10);
    }
}
