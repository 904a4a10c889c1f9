//! A full disk: the error describes how to replay the run, and the run continues once there is
//! room.

use crate::support::{SmallDisk, TestFolder, names};

#[test]
fn a_full_disk_leaves_nothing_of_a_new_file_and_all_of_an_old_one() {
    let place = TestFolder::new();
    let at = place.path("disk");
    // Too small for either file.
    let Some(_disk) = SmallDisk::mount(&at, "8k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    std::fs::write(at.join("old.json"), "old").expect("there is room");
    for args in [
        &["new", "robots", "disk/deep/er/n.toml"][..],
        &["schema", "robots", "--out", "disk/old.json"],
        &["schema", "robots", "--out", "disk/deep/s.json"],
    ] {
        let ended = place.run(args);
        assert_ne!(ended.code(), 0, "{args:?}: {}", ended.out());
        assert!(ended.err().contains("disk/"), "{}", ended.err());
        assert_eq!(names(&at), ["old.json"], "{args:?}");
        assert_eq!(place.read("disk/old.json"), "old", "{args:?}");
    }
}

#[test]
fn a_full_disk_fails_the_run_which_resumes_when_there_is_room() {
    let place = TestFolder::new();
    let at = place.path("disk");
    let Some(disk) = SmallDisk::mount(&at, "200k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    let run = ["run", "s.toml", "--cycles", "60000"];
    let ended = place.run(&[&run[..], &["--out", "disk/r", "--json"]].concat());
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    for word in ["disk/r", "cycle", "seed 5", "sidestep resume"] {
        assert!(ended.err().contains(word), "{word}: {}", ended.err());
    }
    assert!(!at.join("r/trajectories").exists(), "nothing looks whole");
    disk.grow("64m");
    let resumed = place.json(&["resume", "disk/r"]);
    assert_eq!(resumed["digest"], place.json(&run)["digest"]);
}

#[test]
fn a_full_disk_fails_a_recording_for_viewers_and_keeps_no_space() {
    let place = TestFolder::new();
    let at = place.path("disk");
    let Some(_disk) = SmallDisk::mount(&at, "200k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    let ended = place.run(&["run", "s.toml", "--cycles", "60000", "--mcap", "disk/x.mcap"]);
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    for word in ["disk/x.mcap", "No space", "cycle", "seed 5", "run it again"] {
        assert!(ended.err().contains(word), "{word}: {}", ended.err());
    }
    assert_eq!(std::fs::read_dir(&at).expect("a folder").count(), 0);
    place.json(&["run", "s.toml", "--out", "r"]);
    let exported = place.run(&["export", "r", "--to", "parquet", "--out", "disk/tables"]);
    assert_eq!(exported.code(), 0, "small tables fit: {}", exported.err());
    let exported = place.run(&["export", "r", "--to", "mp4-frames", "--out", "disk/frames"]);
    assert_eq!((exported.code(), exported.out().as_str()), (1, ""), "{}", exported.err());
    assert!(!at.join("frames").exists() && !at.join("frames.partial").exists());
}
