//! Damaged files and full disks are errors that name the file, never panics or wrong rows.

use std::fs;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::ports::{RecordError, Recorder};
use sidestep_record::verify::verify;
use sidestep_record::{IfExists, RunFolder, RunReader, Table, read_table};

use crate::support::{new_run, recorder, rows, trajectories};

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
        assert!(error.place.ends_with("part-000000000000000.parquet"), "{error}");
        assert!(error.cause.contains("No space left"), "{error}");
    };
    check(recorder.make_durable(10).unwrap_err());
    check(recorder.append(0, &rows(10, 20)).unwrap_err());
    check(recorder.finish().unwrap_err());
    assert!(!folder.path().join("trajectories").exists());
}

/// A complete run with every kind of file, in `path`.
fn complete_run(path: &Path) {
    let inputs = [("inputs/map.txt".to_string(), b"a map".to_vec())];
    let mut folder =
        RunFolder::create_with_files(path, &new_run(), &inputs, IfExists::Replace).unwrap();
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 50)).unwrap();
    recorder.make_durable(50).unwrap();
    folder.save_checkpoint(50, b"state").unwrap();
    recorder.append(0, &rows(50, 100)).unwrap();
    recorder.finish().unwrap();
    fs::write(path.join("trajectories.svg"), "<svg/>").unwrap();
    folder.write_summary(&std::collections::BTreeMap::from([("cycles", 900)])).unwrap();
    folder.add_file("trajectories.svg").unwrap();
    folder.complete(100, "abcd").unwrap();
}

/// The files of a run that hold anything.
const FILES: [&str; 8] = [
    "run.json",
    "scenario.toml",
    "summary.json",
    "checkpoint.bin",
    "trajectories.svg",
    "inputs/map.txt",
    "trajectories/part-000000000000000.parquet",
    "trajectories/part-000000000000050.parquet",
];

#[test]
fn a_flipped_bit_in_any_file_of_a_run_is_noticed_and_named() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("run");
    complete_run(&path);
    assert_eq!(verify(&path).unwrap().sound, FILES.len());
    for name in FILES {
        let file = path.join(name);
        let whole = fs::read(&file).unwrap();
        for k in 0..40 {
            let mut flipped = whole.clone();
            flipped[k * whole.len() / 40] ^= 1 << (k % 8);
            fs::write(&file, flipped).unwrap();
            let found = verify(&path).unwrap().damaged;
            let found: Vec<_> = found.into_iter().map(|damaged| damaged.path).collect();
            assert_eq!(found, [file.as_path()], "flip {k}");
            let read = RunReader::open(&path).and_then(|run| run.check_files(|_| true));
            assert!(read.is_err(), "{name}, flip {k}");
        }
        fs::remove_file(&file).unwrap();
        assert!(verify(&path).map_or(true, |result| !result.is_sound()), "{name} is missing");
        fs::write(&file, whole).unwrap();
    }
    assert!(verify(&path).unwrap().is_sound());
}

#[test]
fn only_files_that_the_manifest_names_are_replaced() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("run");
    complete_run(&path);
    fs::create_dir(path.join("plots")).unwrap();
    for name in ["notes.txt", "thesis.toml", "report.html", "plots/a.png"] {
        fs::write(path.join(name), name).unwrap();
    }
    assert_eq!(verify(&path).unwrap().others.len(), 4, "told, and no damage");
    let refusal = || {
        let created = RunFolder::create(&path, &new_run(), IfExists::Replace);
        created.unwrap_err().to_string()
    };
    let mine = path.join("trajectories/mine.csv");
    fs::write(&mine, "1,2").unwrap();
    assert!(refusal().contains("in the way: trajectories/mine.csv"), "{}", refusal());
    fs::remove_file(&mine).unwrap();
    let scenario = fs::read(path.join("scenario.toml")).unwrap();
    fs::write(path.join("scenario.toml"), "edited").unwrap();
    assert!(refusal().contains("changed since they were written: scenario.toml"), "{}", refusal());
    fs::write(path.join("scenario.toml"), scenario).unwrap();
    complete_run(&path);
    for name in ["notes.txt", "thesis.toml", "report.html", "plots/a.png"] {
        assert_eq!(fs::read(path.join(name)).unwrap(), name.as_bytes());
    }
    assert!(verify(&path).unwrap().is_sound());
    assert_eq!(crate::support::names(place.path()), ["run"], "nothing is left beside it");
    fs::write(path.join("run.json"), "{\"name\": \"of another program\"}").unwrap();
    assert!(refusal().contains("no manifest"), "{}", refusal());
}
