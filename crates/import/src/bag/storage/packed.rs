//! Compressed bytes, unpacked up to a limit: a small file may unpack to any size.

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

/// The first bytes of data that is compressed with zstd.
pub(super) const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// Maximum size of an unpacked file in bytes: the longest recordings of a robot have tens of gigabytes.
const MAX_FILE_BYTES: u64 = 1 << 36;
/// Number of bytes that tell the format of a file.
const HEAD_BYTES: usize = 16;

/// A file from its first byte on, unpacked where it is packed as a whole.
pub(super) struct Unpacked {
    /// The first bytes of the content, which [`Self::stream`] gives again.
    pub(super) head: Vec<u8>,
    pub(super) stream: Box<dyn Read>,
    /// What it was packed with.
    pub(super) packing: Option<&'static str>,
}

/// Opens a file that may be packed with zstd or gzip, and looks at its first bytes. Nothing else is read.
pub(super) fn open(path: &Path) -> io::Result<Unpacked> {
    let (first, file) = with_head(File::open(path)?, ZSTD.len())?;
    let reader = BufReader::new(file);
    let (packing, unpacked): (_, Box<dyn Read>) = if first.starts_with(&ZSTD) {
        (Some("zstd"), Box::new(zstd::stream::read::Decoder::with_buffer(reader)?))
    } else if first.starts_with(&GZIP) {
        (Some("gzip"), Box::new(MultiGzDecoder::new(reader)))
    } else {
        (None, Box::new(reader))
    };
    let (head, stream) = with_head(unpacked, HEAD_BYTES)?;
    let stream: Box<dyn Read> = match packing {
        Some(_) => Box::new(Limited { stream, remaining: MAX_FILE_BYTES }),
        None => Box::new(stream),
    };
    Ok(Unpacked { head, stream, packing })
}

/// A stream whose first bytes were read, from its start.
type Rewound<R> = io::Chain<Cursor<Vec<u8>>, R>;

/// Returns the first bytes of a stream, and the stream from its start.
fn with_head<R: Read>(mut stream: R, n: usize) -> io::Result<(Vec<u8>, Rewound<R>)> {
    let mut head = Vec::with_capacity(n);
    stream.by_ref().take(n as u64).read_to_end(&mut head)?;
    Ok((head.clone(), Cursor::new(head).chain(stream)))
}

/// A stream that fails after a number of bytes.
struct Limited<R> {
    stream: R,
    remaining: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.stream.read(buffer)?;
        self.remaining = self.remaining.checked_sub(n as u64).ok_or_else(|| {
            io::Error::other(format!("it unpacks to more than {MAX_FILE_BYTES} bytes"))
        })?;
        Ok(n)
    }
}

/// Unpacks data that is compressed with zstd.
pub(super) fn unzstd(bytes: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    let decoder = zstd::stream::read::Decoder::with_buffer(bytes).map_err(|e| e.to_string())?;
    read_up_to(decoder, limit)
}

/// Unpacks data that is compressed with LZ4, in frames.
pub(super) fn unlz4(bytes: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    read_up_to(lz4::Decoder::new(bytes).map_err(|e| e.to_string())?, limit)
}

/// Unpacks data that is compressed with bzip2.
pub(super) fn unbzip2(bytes: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    read_up_to(bzip2::bufread::MultiBzDecoder::new(bytes), limit)
}

fn read_up_to(decoder: impl Read, limit: usize) -> Result<Vec<u8>, String> {
    let mut unpacked = Vec::new();
    let read = decoder.take(limit as u64 + 1).read_to_end(&mut unpacked);
    read.map_err(|e| format!("it cannot be unpacked: {e}"))?;
    if unpacked.len() > limit {
        return Err(format!("it unpacks to more than {limit} bytes"));
    }
    Ok(unpacked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn data_that_unpacks_beyond_the_limit_is_refused_before_it_takes_memory() {
        let zeros = vec![0; 1 << 20];
        let zstd = zstd::encode_all(&zeros[..], 1).unwrap();
        let mut lz4 = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
        lz4.write_all(&zeros).unwrap();
        let lz4 = lz4.finish().0;
        let mut bz2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
        bz2.write_all(&zeros).unwrap();
        let bz2 = bz2.finish().unwrap();
        type Unpack = fn(&[u8], usize) -> Result<Vec<u8>, String>;
        let unpackers: [(Unpack, &[u8]); 3] = [(unzstd, &zstd), (unlz4, &lz4), (unbzip2, &bz2)];
        for (unpack, packed) in unpackers {
            assert_eq!(unpack(packed, 1 << 20).unwrap(), zeros);
            assert!(unpack(packed, 9999).unwrap_err().contains("more than 9999 bytes"));
            // The decoder of LZ4 takes an early end for the end: chunks tell their size.
            let cut = unpack(&packed[..packed.len() / 2], 1 << 20);
            assert!(cut.is_err() || cut.is_ok_and(|bytes| bytes.len() < zeros.len()));
            assert!(unpack(b"nothing of this kind", 99).is_err());
        }
    }
}
