//! Bounded reading of files, plain or compressed with gzip.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;
use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_path;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Returns the content of the file at `path`, decompressed if it is compressed with gzip (recognized by
/// its first bytes, not by its name).
///
/// # Errors
/// When the file cannot be read or decompressed, or has more than `max_bytes` after that: a small file may decompress
/// to any size.
pub fn read_bytes(path: &Path, max_bytes: u64) -> Result<Vec<u8>, InputError> {
    // One byte beyond the limit is enough to detect that there are too many.
    let bytes = try_read(path, max_bytes.saturating_add(1)).map_err(|e| unreadable(path, &e))?;
    if bytes.len() as u64 > max_bytes {
        let cause = format!("is larger than the {max_bytes} bytes allowed for such a file");
        return Err(InputError::new(path.display(), cause, "check that this is the right file"));
    }
    Ok(bytes)
}

/// Returns the content of a text file, UTF-8 or UTF-16 with a byte order mark, read by [`read_bytes`], without that mark.
///
/// # Errors
/// Those of [`read_bytes`], and bytes that are not UTF-8, with their line and column.
pub fn read_text(path: &Path, max_bytes: u64) -> Result<String, InputError> {
    let text = decode_text(path, read_bytes(path, max_bytes)?)?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Returns the bytes of a file as text: UTF-8, or UTF-16 where they begin with its byte order mark.
///
/// # Errors
/// When they are neither: a binary file is named for what it is, and in a text of another encoding the error points at
/// the first byte that does not fit.
pub fn decode_text(path: &Path, bytes: Vec<u8>) -> Result<String, InputError> {
    if let Some(text) = decode_utf16(&bytes) {
        return text.ok_or_else(|| {
            let cause = "begins as a text in UTF-16, and is none";
            InputError::new(path.display(), cause, "save the file as UTF-8")
        });
    }
    String::from_utf8(bytes).map_err(|error| {
        if let Some(error) = packed_error(path, error.as_bytes()) {
            return error;
        }
        if let Some(format) = binary_format(error.as_bytes()) {
            let cause = format!("is {format}, and a text file is read here");
            return InputError::new(path.display(), cause, "check that this is the right file");
        }
        let readable = String::from_utf8_lossy(error.as_bytes());
        InputError::new(path.display(), "is not a text file (UTF-8)", "save the file as UTF-8")
            .with_byte_offset(&readable, error.utf8_error().valid_up_to())
    })
}

/// Returns the text of a file in UTF-16, which its byte order mark tells: `None` for anything else, `Some(None)` for one
/// that is damaged.
fn decode_utf16(bytes: &[u8]) -> Option<Option<String>> {
    let unit: fn([u8; 2]) -> u16 = match bytes.get(..2)? {
        [0xff, 0xfe] => u16::from_le_bytes,
        [0xfe, 0xff] => u16::from_be_bytes,
        _ => return None,
    };
    let pairs = bytes[2..].chunks(2);
    let units = pairs.map(|pair| unit([pair[0], *pair.get(1).unwrap_or(&0)]));
    Some(char::decode_utf16(units).collect::<Result<String, _>>().ok())
}

/// The first bytes of binary files that people have beside their scenarios, and what these are.
const SIGNATURES: [(&[u8], &str); 16] = [
    (b"PAR1", "a Parquet file"),
    (b"\x89MCAP", "an MCAP file"),
    (b"#ROSBAG V", "a bag of ROS 1"),
    (b"SQLite format 3\0", "an SQLite database"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"GIF8", "a GIF image"),
    (b"P4", "an image (PBM)"),
    (b"P5", "an image (PGM)"),
    (b"P6", "an image (PPM)"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x28\xb5\x2f\xfd", "compressed with zstd"),
    (b"\x04\x22\x4d\x18", "compressed with LZ4"),
    (b"BZh", "compressed with bzip2"),
    (b"\xfd7zXZ", "compressed with xz"),
    (b"%PDF", "a PDF document"),
];

/// Number of bytes in which a zero tells that a file is no text.
const SEARCHED_BYTES: usize = 8192;

/// Commands that unpack a file, whatever its name ends with, by the first bytes of its format; `IN` and `OUT` stand for the
/// file and for what comes out.
const UNPACK_COMMANDS: [(&[u8], &str); 5] = [
    (b"PK\x03\x04", "unzip IN"),
    (b"\x28\xb5\x2f\xfd", "zstd -d IN -o OUT"),
    (b"\x04\x22\x4d\x18", "lz4 -d IN OUT"),
    (b"BZh", "bunzip2 -c IN > OUT"),
    (b"\xfd7zXZ", "xz -dc IN > OUT"),
];

/// What the names of packed files end with.
const PACKED_EXTENSIONS: [&str; 5] = ["zst", "lz4", "bz2", "xz", "zip"];

/// Returns the error of a file that is packed in a way that is not unpacked here, with the command that does it.
pub fn packed_error(path: &Path, start: &[u8]) -> Option<InputError> {
    let (_, template) =
        UNPACK_COMMANDS.iter().find(|(signature, _)| start.starts_with(signature))?;
    let format = binary_format(start).unwrap_or("packed");
    let words = template.split(' ').map(|word| match word {
        "IN" => shell_path(path),
        "OUT" => shell_path(unpacked_path(path)),
        _ => word.to_owned(),
    });
    let command = words.collect::<Vec<String>>().join(" ");
    let remedy = format!("unpack it: `{command}`, and give what comes out; gzip is read as it is");
    Some(InputError::new(path.display(), format!("is {format}"), remedy))
}

/// Returns the path of a new file beside a packed one, with the extension of its content.
fn unpacked_path(path: &Path) -> PathBuf {
    let is_packed = |extension: &OsStr| {
        PACKED_EXTENSIONS.iter().any(|packed| extension.eq_ignore_ascii_case(packed))
    };
    let stem = path.file_stem().filter(|_| path.extension().is_some_and(is_packed));
    let mut name = OsString::from("unpacked-");
    name.push(stem.or(path.file_name()).unwrap_or_default());
    path.with_file_name(name)
}

/// Returns what a file that is not UTF-8 is, as the predicate of a sentence; `None` for a text of another encoding.
fn binary_format(bytes: &[u8]) -> Option<&'static str> {
    let known = SIGNATURES.iter().find(|(signature, _)| bytes.starts_with(signature));
    let has_zero = bytes.iter().take(SEARCHED_BYTES).any(|byte| *byte == 0);
    known.map(|(_, format)| *format).or(has_zero.then_some("a binary file"))
}

/// Returns the first bytes of the file at `path`, at most `max_bytes`, decompressed as by [`read_bytes`]: enough to tell
/// what kind of file it is.
///
/// # Errors
/// When the file cannot be read or decompressed.
pub fn read_start(path: &Path, max_bytes: u64) -> Result<Vec<u8>, InputError> {
    try_read(path, max_bytes).map_err(|e| unreadable(path, &e))
}

fn try_read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut file = BufReader::new(File::open(path)?);
    let is_compressed = file.fill_buf()?.starts_with(&GZIP_MAGIC);
    let mut bytes = Vec::new();
    if is_compressed {
        // Several members in a row are one file, as `cat a.gz b.gz` writes it.
        MultiGzDecoder::new(file).take(limit).read_to_end(&mut bytes)?;
    } else {
        file.take(limit).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

fn unreadable(path: &Path, error: &io::Error) -> InputError {
    let remedy = match error.kind() {
        io::ErrorKind::NotFound => "check the path; relative ones start at the working directory",
        io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidInput => {
            "the gzip file is damaged or cut short: compress or download it again"
        }
        _ => "check that this is a file and that it may be read",
    };
    InputError::new(path.display(), format!("cannot be read: {error}"), remedy)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use flate2::{Compression, write::GzEncoder};

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).expect("memory takes all");
        encoder.finish().expect("memory takes all")
    }

    fn file_with(bytes: &[u8]) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.write_all(bytes).expect("written");
        file
    }

    #[test]
    fn plain_and_packed_files_read_the_same() {
        for bytes in [b"text".to_vec(), gzip(b"text")] {
            let file = file_with(&bytes);
            assert_eq!(read_text(file.path(), 4).as_deref(), Ok("text"));
        }
    }

    #[test]
    fn a_file_over_its_limit_is_refused_packed_or_not() {
        for bytes in [vec![0; 5000], gzip(&vec![0; 5000])] {
            let file = file_with(&bytes);
            let error = read_bytes(file.path(), 4999).expect_err("too large");
            assert!(error.cause().contains("4999 bytes"), "{error}");
            assert_eq!(read_bytes(file.path(), 5000).map(|b| b.len()), Ok(5000));
        }
    }

    #[test]
    fn a_cut_gzip_file_a_missing_file_and_a_folder_are_errors() {
        let packed = gzip(b"some text that is packed");
        let file = file_with(&packed[..packed.len() - 6]);
        let error = read_bytes(file.path(), 100).expect_err("cut");
        assert!(error.remedy().contains("gzip"), "{error}");
        assert!(read_bytes(Path::new("/no/such/file"), 100).is_err());
        assert!(read_bytes(&std::env::temp_dir(), 100).is_err());
    }

    #[test]
    fn text_that_is_not_utf8_is_pointed_at() {
        let file = file_with(b"ok\nab\xff");
        let error = read_text(file.path(), 100).expect_err("not UTF-8");
        assert_eq!(error.line_and_column(), Some((2, 3)));
    }

    #[test]
    fn text_in_utf_16_is_read_by_its_byte_order_mark() {
        for bytes in [b"\xff\xfea\0\xe4\0".as_slice(), b"\xfe\xff\0a\0\xe4"] {
            assert_eq!(read_text(file_with(bytes).path(), 100).as_deref(), Ok("a\u{e4}"));
        }
        let error =
            read_text(file_with(b"\xff\xfe\0\xd8").path(), 100).expect_err("half a character");
        assert!(error.cause().contains("UTF-16, and is none"), "{error}");
    }

    #[test]
    fn a_binary_file_is_named_and_not_printed() {
        for (bytes, format) in [
            (b"PAR1\x15\x04\xff\x00".as_slice(), "a Parquet file"),
            (b"\x89PNG\r\n\x1a\n\0", "a PNG image"),
            (b"SQLite format 3\0\x10\0\xff", "an SQLite database"),
            (b"what\0\xff", "a binary file"),
        ] {
            let file = file_with(bytes);
            let error = read_text(file.path(), 100).expect_err("no text");
            assert!(error.cause().contains(format), "{error}");
            assert_eq!(error.line_and_column(), None, "{error}");
        }
        let latin = file_with(b"name = \"Z\xfcrich\"");
        let error = read_text(latin.path(), 100).expect_err("Latin-1");
        assert_eq!(error.line_and_column(), Some((1, 10)));
    }

    #[test]
    fn a_packed_file_is_refused_with_the_command_that_unpacks_it() {
        // These commands take any name: `zstd -d` alone asks for one with `.zst`.
        for (bytes, name, command) in [
            (b"PK\x03\x04\x14\0\xff".as_slice(), "my day.csv", "`unzip 'my day.csv'`"),
            (
                b"\x28\xb5\x2f\xfd\x04\xff",
                "my day.csv",
                "`zstd -d 'my day.csv' -o 'unpacked-my day.csv'`",
            ),
            (
                b"\x28\xb5\x2f\xfd\x04\xff",
                "b/a.csv.zst",
                "`zstd -d b/a.csv.zst -o b/unpacked-a.csv`",
            ),
            (b"\x04\x22\x4d\x18\xff", "a.lz4", "`lz4 -d a.lz4 unpacked-a`"),
            (b"BZh91AY\xff", "day.csv", "`bunzip2 -c day.csv > unpacked-day.csv`"),
            (b"\xfd7zXZ\0\xff", "-a.tsv.XZ", "`xz -dc ./-a.tsv.XZ > unpacked--a.tsv`"),
        ] {
            let error = decode_text(Path::new(name), bytes.to_vec()).expect_err("packed");
            assert!(error.remedy().contains(command), "{error}");
        }
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_text() {
        let file = file_with("\u{feff}x".as_bytes());
        assert_eq!(read_text(file.path(), 100).as_deref(), Ok("x"));
    }
}
