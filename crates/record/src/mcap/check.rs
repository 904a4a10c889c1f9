//! Whether a recording is as it was written: MCAP files have checksums of all their bytes.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use ::mcap::records::{Record, op};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{McapError, parse_record};
use sidestep_kernel::InputError;

use super::reader::{McapRunInfo, damaged};

/// The begin of the name of this program in files that it wrote.
pub(super) const LIBRARY: &str = "sidestep ";

/// Reads a recording of this program and compares its bytes with their checksums.
///
/// # Errors
/// A missing file; one of another program; one that is cut off, damaged, or was changed.
pub fn check_mcap(path: &Path) -> Result<(), InputError> {
    McapRunInfo::open(path)?;
    check_bytes(path)
        .map_err(|e| damaged(path, format!("it does not match its checksums: {}", error_text(e))))
}

fn check_bytes(path: &Path) -> Result<(), McapError> {
    let file = File::open(path)?;
    let length = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    // Chunks need not be unpacked: the checksum of the data is that of the bytes in the file.
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(length);
    let mut file = BufReader::new(file);
    let mut reader = LinearReader::new_with_options(options);
    let mut checksums = 0;
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted))?;
                reader.notify_read(read);
            }
            // Without a checksum, which the format allows, nothing would be compared.
            LinearReadEvent::Record { opcode: opcode @ (op::DATA_END | op::FOOTER), data } => {
                checksums += u32::from(has_checksum(parse_record(opcode, data)?));
            }
            LinearReadEvent::Record { .. } => {}
        }
    }
    match checksums {
        2 => Ok(()),
        _ => Err(McapError::Io(std::io::Error::other("it has lost one of them"))),
    }
}

fn has_checksum(record: Record<'_>) -> bool {
    match record {
        Record::DataEnd(end) => end.data_section_crc != 0,
        Record::Footer(footer) => footer.summary_crc != 0,
        _ => false,
    }
}

/// Returns whether this program began a file, which need not be whole: it may have been killed before the first byte.
pub(crate) fn is_begun_by_us(path: &Path) -> bool {
    let is_empty = std::fs::metadata(path).is_ok_and(|found| found.len() == 0);
    is_empty || library(path).is_some_and(|library| library.starts_with(LIBRARY))
}

/// Returns the name of the program in the first record of a file.
fn library(path: &Path) -> Option<String> {
    let mut file = BufReader::new(File::open(path).ok()?);
    let options = LinearReaderOptions::default().with_record_length_limit(1 << 16);
    let mut reader = LinearReader::new_with_options(options);
    loop {
        match reader.next_event()?.ok()? {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted)).ok()?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                let Ok(Record::Header(header)) = parse_record(opcode, data) else { return None };
                return Some(header.library);
            }
        }
    }
}

/// Returns the system's message, without the library's wrapping.
pub(super) fn error_text(error: McapError) -> String {
    match error {
        McapError::Io(error) => error.to_string(),
        other => other.to_string(),
    }
}
