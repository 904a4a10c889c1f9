//! Damaged files and full disks are errors that name the file, never panics or wrong rows.

use std::fs;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::ports::{RecordError, Recorder};
use sidestep_record::{Table, read_table};

use crate::support::{recorder, rows};

/// A finished table and its only part.
fn finished(folder: &Path) -> PathBuf {
    let mut recorder = recorder(folder);
    recorder.append(0, &rows(0, 200)).unwrap();
    recorder.finish().unwrap();
    folder.join("trajectories/part-000000000000000.parquet")
}

fn read(folder: &Path) -> Result<Table, InputError> {
    read_table(folder, "trajectories", ..)
}

#[test]
fn a_truncated_part_is_refused_at_every_length() {
    let folder = tempfile::tempdir().unwrap();
    let part = finished(folder.path());
    let whole = fs::read(&part).unwrap();
    for length in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
        fs::write(&part, &whole[..length]).unwrap();
        let error = read(folder.path()).unwrap_err();
        assert!(error.place().contains("part-000000000000000"), "{error}");
        assert!(error.remedy().contains("damaged"), "{error}");
    }
}

#[test]
fn a_changed_byte_is_never_a_panic_and_never_changes_a_row() {
    let folder = tempfile::tempdir().unwrap();
    let part = finished(folder.path());
    let whole = fs::read(&part).unwrap();
    let flips = [0xFF, 0x01, 0x80];
    for (at, flip) in (0..whole.len()).zip(flips.into_iter().cycle()) {
        let mut damaged = whole.clone();
        damaged[at] ^= flip;
        fs::write(&part, &damaged).unwrap();
        if let Ok(table) = read(folder.path()) {
            assert_eq!(table.columns, rows(0, 200), "byte {at} changed by {flip:#x}");
        }
    }
}

#[test]
fn a_newer_format_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let part = finished(folder.path());
    let bytes = fs::read(&part).unwrap();
    let key = b"sidestep.format";
    let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len();
    let version = at + bytes[at..].windows(3).position(|w| w == b"1.1").unwrap();
    let mut newer = bytes;
    newer[version] = b'2';
    fs::write(&part, newer).unwrap();
    let error = read(folder.path()).unwrap_err();
    assert!(error.remedy().contains("newer version"), "{error}");
}

#[test]
fn a_file_of_another_origin_or_a_missing_table_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let error = read(folder.path()).unwrap_err();
    assert!(error.cause().contains("no such table"), "{error}");
    let part = finished(folder.path());
    fs::write(&part, "cycle,robot\n1,2\n").unwrap();
    assert!(read(folder.path()).is_err());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_names_the_file_and_lasts() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    let part = folder.path().join("trajectories.partial/part-000000000000000.parquet.partial");
    std::os::unix::fs::symlink("/dev/full", &part).unwrap();
    recorder.append(0, &rows(0, 10)).unwrap();
    let check = |error: RecordError| {
        assert!(error.place.contains("part-000000000000000.parquet.partial"), "{error}");
        assert!(error.cause.contains("No space left"), "{error}");
    };
    check(recorder.make_durable(10).unwrap_err());
    check(recorder.append(0, &rows(10, 20)).unwrap_err());
    check(recorder.finish().unwrap_err());
    assert!(!folder.path().join("trajectories").exists());
}
