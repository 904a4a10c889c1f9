//! Run folders: created completely or not at all, written by one process, resumed after a stop.

use std::fs;
use std::path::Path;
use std::process::Command;

use sidestep_kernel::checkpoint::{CheckpointHeader, FORMAT_VERSION, encode};
use sidestep_kernel::ports::Recorder;
use sidestep_record::{IfExists, ResumePoint, RunFolder, RunReader, Status, read_table};

use crate::support::{joined, names, new_run, rows, trajectories};

fn create(path: &Path) -> RunFolder {
    RunFolder::create(path, &new_run(), IfExists::Refuse).unwrap()
}

/// Returns the reason why `path` cannot become a run folder.
fn refusal(path: &Path, existing: IfExists) -> String {
    RunFolder::create(path, &new_run(), existing).unwrap_err().to_string()
}

#[test]
fn a_run_from_its_creation_to_its_end() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("runs/today/a");
    let mut folder = create(&path);
    assert_eq!(names(path.parent().unwrap()), ["a"], "nothing else is left beside it");
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(10).unwrap();
    folder.save_checkpoint(10, b"state").unwrap();
    assert_eq!(RunReader::open(&path).unwrap().manifest.last_checkpoint, Some(10));
    recorder.append(0, &rows(10, 100)).unwrap();
    recorder.finish().unwrap();
    folder.write_summary(&std::collections::BTreeMap::from([("contacts", 3)])).unwrap();
    folder.complete(100, "abcd").unwrap();

    let view = RunReader::open(&path).unwrap();
    assert_eq!(view.scenario, new_run().origin.scenario);
    let m = view.manifest;
    assert_eq!((m.status, m.cycles_done, m.digest), (Status::Complete, 100, Some("abcd".into())));
    let expected =
        ["checkpoint.bin", "run.json", "run.lock", "scenario.toml", "summary.json", "trajectories"];
    assert_eq!(names(&path), expected);
    assert!(fs::read_to_string(path.join("summary.json")).unwrap().contains("\"contacts\": 3"));
    let error = RunFolder::resume(&path).unwrap_err();
    assert!(error.cause().contains("complete"), "{error}");
}

#[test]
fn a_killed_run_goes_on_at_its_checkpoint() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("a");
    let mut folder = create(&path);
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(10).unwrap();
    folder.save_checkpoint(10, b"state at 10").unwrap();
    recorder.append(0, &rows(10, 13)).unwrap();
    drop((recorder, folder));

    let (folder, point) = RunFolder::resume(&path).unwrap();
    assert_eq!(point, ResumePoint::Checkpoint(b"state at 10".to_vec()));
    assert_eq!(folder.manifest().status, Status::Running);
    let mut recorder = folder.recorder(&[trajectories()], 10).unwrap();
    recorder.append(0, &rows(10, 20)).unwrap();
    recorder.finish().unwrap();
    folder.complete(20, "abcd").unwrap();
    let table = read_table(&path, "trajectories", ..).unwrap();
    assert_eq!(table.columns, joined(&[rows(0, 10), rows(10, 20)]));
}

#[test]
fn a_run_stopped_before_its_first_checkpoint_starts_again() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("a");
    let folder = create(&path);
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 10)).unwrap();
    drop(recorder);
    folder.stop(10).unwrap();
    let (folder, point) = RunFolder::resume(&path).unwrap();
    assert_eq!((point, folder.manifest().status), (ResumePoint::Start, Status::Incomplete));
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 20)).unwrap();
    recorder.finish().unwrap();
    assert_eq!(read_table(&path, "trajectories", ..).unwrap().columns, rows(0, 20));
}

#[test]
fn two_writers_of_one_folder_are_refused() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("a");
    let folder = create(&path);
    let error = RunFolder::resume(&path).unwrap_err();
    assert!(error.cause().contains("this process itself is writing"), "{error}");
    assert!(refusal(&path, IfExists::Replace).contains("this process itself"));
    assert_eq!(names(parent.path()), ["a"]);
    drop(folder);
    assert!(RunFolder::resume(&path).is_ok());
}

#[test]
fn tables_are_not_begun_in_a_folder_that_was_deleted_and_the_error_says_so() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("a");
    let folder = create(&path);
    fs::rename(&path, parent.path().join("moved")).unwrap();
    let Err(error) = folder.recorder(&[trajectories()], 0) else { panic!("a table was begun") };
    let told = error.to_string();
    assert!(told.contains("deleted or moved while the run wrote to it"), "{told}");
    assert!(!path.exists());
}

#[test]
fn only_runs_are_replaced_and_only_on_request() {
    let parent = tempfile::tempdir().unwrap();
    let run = parent.path().join("run");
    create(&run).complete(100, "old").unwrap();
    assert!(refusal(&run, IfExists::Refuse).contains("holds a run already"));
    let other = parent.path().join("thesis");
    fs::create_dir(&other).unwrap();
    fs::write(other.join("chapter1.tex"), "years of work").unwrap();
    assert!(refusal(&other, IfExists::Replace).contains("something else"));
    assert!(refusal(&other.join("chapter1.tex"), IfExists::Replace).contains("cannot make"));

    let folder = RunFolder::create(&run, &new_run(), IfExists::Replace).unwrap();
    assert_eq!(folder.manifest().digest, None);
    assert_eq!(names(parent.path()), ["run", "thesis"]);
}

#[test]
fn an_empty_folder_is_taken() {
    let parent = tempfile::tempdir().unwrap();
    create(parent.path());
    assert!(RunReader::open(parent.path()).is_ok());
}

#[test]
fn a_folder_that_cannot_be_made_leaves_nothing() {
    let parent = tempfile::tempdir().unwrap();
    fs::write(parent.path().join("file"), "").unwrap();
    assert!(refusal(&parent.path().join("file/runs/a"), IfExists::Refuse).contains("cannot make"));
    let too_long = parent.path().join("new").join("x".repeat(300));
    assert!(refusal(&too_long, IfExists::Refuse).contains("cannot make"));
    assert_eq!(names(parent.path()), ["file"]);
    assert!(refusal(Path::new("/"), IfExists::Replace).contains("something else"));
}

#[test]
fn what_is_no_run_folder_is_refused_with_a_remedy() {
    let parent = tempfile::tempdir().unwrap();
    let refusal = |path: &Path| {
        let error = RunFolder::resume(path).unwrap_err();
        assert_eq!(error, RunReader::open(path).unwrap_err());
        assert!(!error.remedy().is_empty());
        error.to_string()
    };
    assert!(refusal(&parent.path().join("missing")).contains("No such file"));
    assert!(refusal(parent.path()).contains("holds no `run.json`"));
    fs::write(parent.path().join("file"), "").unwrap();
    assert!(refusal(&parent.path().join("file")).contains("no folder"));
    fs::write(parent.path().join("run.json"), "{\n  \"format\": 1\n}").unwrap();
    assert!(refusal(parent.path()).contains("run.json:2:"));
    fs::write(parent.path().join("run.json"), "{\"format\": \"9.0\"}").unwrap();
    assert!(refusal(parent.path()).contains("newer version"));
}

/// A file system of this size at `path`, gone when dropped.
struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    fn mount(path: &'a Path) -> Option<Self> {
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=256k", "sidestep-test"]).arg(path);
        mount.output().is_ok_and(|o| o.status.success()).then_some(Self(path))
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).output();
    }
}

#[test]
fn a_run_on_a_full_disk_keeps_its_checkpoint_and_goes_on_when_there_is_room() {
    let parent = tempfile::tempdir().unwrap();
    let Some(_disk) = SmallDisk::mount(parent.path()) else {
        sidestep_testing::skip("only root can mount a small disk");
        return;
    };
    let path = parent.path().join("a");
    let mut folder = create(&path);
    let mut recorder = folder.recorder(&[trajectories()], 0).unwrap();
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(10).unwrap();
    folder.save_checkpoint(10, b"state").unwrap();
    let ballast = parent.path().join("ballast");
    let _ = fs::write(&ballast, vec![0; 1 << 20]);

    let error = folder.save_checkpoint(11, &[1; 1 << 16]).unwrap_err();
    assert!(error.place.contains("checkpoint.bin") && error.cause.contains("No space"), "{error}");
    recorder.append(0, &rows(10, 2000)).unwrap();
    let error = recorder.make_durable(2000).unwrap_err();
    assert!(error.place.ends_with("part-000000000000010.parquet"), "{error}");
    drop((recorder, folder));

    fs::remove_file(ballast).unwrap();
    let (folder, point) = RunFolder::resume(&path).unwrap();
    assert_eq!(point, ResumePoint::Checkpoint(b"state".to_vec()));
    let mut recorder = folder.recorder(&[trajectories()], 10).unwrap();
    recorder.append(0, &rows(10, 20)).unwrap();
    recorder.finish().unwrap();
    folder.complete(20, "abcd").unwrap();
    assert_eq!(read_table(&path, "trajectories", ..).unwrap().rows(), 40);
}

#[test]
fn a_run_that_was_killed_between_a_checkpoint_and_its_manifest_is_whole_when_it_has_gone_on() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("a");
    let state = |cycle| {
        let header = CheckpointHeader {
            format: FORMAT_VERSION,
            program_version: "0.1.0".into(),
            world: "robots".into(),
            scenario: [0; 16],
            cycle,
        };
        encode(&header, &cycle)
    };
    let mut folder = create(&path);
    folder.save_checkpoint(10, &state(10)).unwrap();
    let manifest = fs::read(path.join("run.json")).unwrap();
    folder.save_checkpoint(20, &state(20)).unwrap();
    drop(folder);
    fs::write(path.join("run.json"), manifest).unwrap();

    let (folder, point) = RunFolder::resume(&path).unwrap();
    assert_eq!(point, ResumePoint::Checkpoint(state(20)));
    folder.complete(30, "abcd").unwrap();
    RunReader::open(&path).unwrap().check_files(|_| true).unwrap();
}
