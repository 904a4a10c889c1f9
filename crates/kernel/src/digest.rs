//! A digest of a state: 128 bits of BLAKE3 over its canonical bytes.
//!
//! Worlds write every value of a state, little-endian, in a fixed order (by entity id) that does
//! not depend on storage. Equal digests therefore mean equal states, on every machine and for every
//! number of workers.

use std::fmt;

/// 128 bits that identify a state.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Digest([u8; 16]);

impl Digest {
    /// Returns the digest of one piece of text or bytes.
    pub fn hash_bytes(bytes: &[u8]) -> Self {
        let mut hasher = Hasher::default();
        hasher.write_bytes(bytes);
        hasher.finish()
    }

    /// The bytes in the order in which `Display` writes them.
    pub fn as_bytes(&self) -> &[u8; 16] {
        &self.0
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|b| write!(f, "{b:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Hashes a state's values one after the other.
#[derive(Default)]
pub struct Hasher {
    inner: blake3::Hasher,
    /// Values wait here for the hash, because BLAKE3 hashes 16 chunks of 1 KiB side by side and so is fastest on long
    /// inputs.
    buffer: Vec<u8>,
}

/// Bytes at which the buffer is hashed: several times as many as one call hashes side by side, and still in the cache.
const BUFFER_BYTES: usize = 1 << 16;

impl Hasher {
    /// Adds bytes without their length; add the length first where it may vary.
    pub fn write_bytes(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER_BYTES {
            self.inner.update(&self.buffer);
            self.buffer.clear();
        }
    }

    /// Adds a byte.
    pub fn write_u8(&mut self, value: u8) {
        self.write_bytes(&[value]);
    }

    /// Adds a 32-bit word, little-endian.
    pub fn write_u32(&mut self, value: u32) {
        self.write_bytes(&value.to_le_bytes());
    }

    /// Adds a 64-bit word, little-endian.
    pub fn write_u64(&mut self, value: u64) {
        self.write_bytes(&value.to_le_bytes());
    }

    /// Adds a float by its bits; the two zeros count as one, because they compare equal.
    pub fn write_f64(&mut self, value: f64) {
        self.write_u64((value + 0.0).to_bits());
    }

    /// Returns the digest of everything that was added.
    pub fn finish(mut self) -> Digest {
        self.inner.update(&self.buffer);
        // BLAKE3 gives 32 bytes, any prefix of which is a hash: 16 are enough, because nobody forges a state.
        let mut prefix = [0; 16];
        prefix.copy_from_slice(&self.inner.finalize().as_bytes()[..16]);
        Digest(prefix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_blake3_and_prints_as_hex() {
        // First 16 bytes of the published BLAKE3 test vector for the empty input.
        assert_eq!(Digest::hash_bytes(b"").to_string(), "af1349b9f5f9a1a6a0404dea36dcc949");
    }

    #[test]
    fn gathering_does_not_change_the_digest_and_signed_zeros_are_one() {
        let mut a = Hasher::default();
        let mut b = Hasher::default();
        for i in 0..40_000u64 {
            a.write_u64(i);
            i.to_le_bytes().iter().for_each(|&x| b.write_u8(x));
        }
        a.write_f64(0.0);
        b.write_f64(-0.0);
        assert_eq!(a.finish(), b.finish());
    }
}
