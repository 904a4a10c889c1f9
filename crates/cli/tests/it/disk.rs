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
fn a_full_disk_leaves_no_half_of_a_manual_page() {
    let place = TestFolder::new();
    let whole = place.run(&["man", "whole"]);
    assert_eq!(whole.code(), 0, "{}", whole.err());
    let at = place.path("disk");
    // Room for a few of the pages.
    let Some(_disk) = SmallDisk::mount(&at, "40k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    let ended = place.run(&["man", "disk/man1"]);
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    for word in ["disk/man1/sidestep", "No space", "help:"] {
        assert!(ended.err().contains(word), "{word}: {}", ended.err());
    }
    let pages = names(&at.join("man1"));
    assert!(!pages.is_empty() && pages.len() < names(&place.path("whole")).len(), "{pages:?}");
    for page in pages {
        let read = |folder: &str| place.read(&format!("{folder}/{page}"));
        assert!(read("disk/man1") == read("whole"), "{page} is no whole page");
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

/// Asserts that a command failed to store something: it names the path that was given and no hidden one, and a remedy.
fn assert_fails_to_store(place: &TestFolder, args: &[&str], given: &str) {
    let ended = place.run(args);
    let told = ended.err();
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{args:?}: {told}");
    for word in [given, "No space", "help:", "--out"] {
        assert!(told.contains(word), "{word}: {args:?}: {told}");
    }
    for hidden in [".new-", ".partial"] {
        assert!(!told.contains(hidden), "{hidden}: {args:?}: {told}");
    }
}

#[test]
fn what_a_full_disk_refuses_is_named_by_the_path_that_was_given_with_a_remedy() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "1000", "--out", "r"]);
    let at = place.path("disk");
    // Room for the first file or two of an export.
    let Some(_disk) = SmallDisk::mount(&at, "12k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    for form in ["csv", "parquet", "mp4-frames", "rosbag"] {
        let args = ["export", "r", "--to", form, "--out", "disk/x"];
        assert_fails_to_store(&place, &args, "disk/x");
        assert!(names(&at).is_empty(), "{form}: {:?}", names(&at));
    }
    // A single small file finds room for a part of it alone.
    std::fs::write(at.join("full"), [0; 8192]).expect("there is room");
    for (form, more) in [
        ("csv", &["--table", "trajectories"][..]),
        ("parquet", &["--table", "trajectories"]),
        ("mcap", &[]),
        ("svg", &[]),
        ("png", &[]),
        ("gif", &[]),
    ] {
        let args = [&["export", "r", "--to", form, "--out", "disk/x"], more].concat();
        assert_fails_to_store(&place, &args, "disk/x");
        assert_eq!(names(&at), ["full"], "{form}");
    }
    assert_fails_to_store(&place, &["report", "r", "--out", "disk/r.html"], "disk/r");
    let figures = ["report", "r", "--out", "disk/r.html", "--figure", "svg,png"];
    assert_fails_to_store(&place, &figures, "disk/r");
    let vary = ["--vary", "robots.0.count=1,2,3,4,5,6", "--replicate", "2", "--out", "disk/d"];
    assert_fails_to_store(&place, &[&["sweep", "s.toml"], &vary[..]].concat(), "disk/d");
    assert_fails_to_store(&place, &[&["sweep", "plan", "s.toml"], &vary[..]].concat(), "disk/d");
    assert_eq!(names(&at), ["full"]);
}

#[test]
fn a_run_whose_place_cannot_be_written_fails_and_one_whose_place_is_wrong_is_wrong_input() {
    let place = TestFolder::new();
    let at = place.path("disk");
    let Some(disk) = SmallDisk::mount(&at, "8k") else {
        sidestep_testing::skip("this user may not mount a small disk");
        return;
    };
    std::fs::write(at.join("full"), [0; 8192]).expect("there is room");
    for args in [
        &["run", "s.toml", "--out", "disk/r"][..],
        &["run", "s.toml", "--mcap", "disk/r.mcap"],
        &["new", "robots", "disk/r.toml"],
    ] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{args:?}: {}", ended.err());
        for word in ["disk/r", "No space", "help:"] {
            assert!(ended.err().contains(word), "{word}: {}", ended.err());
        }
        assert!(!ended.err().contains(".new-"), "{}", ended.err());
        assert_eq!(names(&at), ["full"], "{args:?}");
    }
    disk.forbid_writing();
    let ended = place.run(&["run", "s.toml", "--out", "disk/deep/r"]);
    assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{}", ended.err());
    assert!(ended.err().contains("disk/deep/r: cannot make the folder"), "{}", ended.err());
    for wrong in ["s.toml/r", "s.toml", ".."] {
        let ended = place.run(&["run", "s.toml", "--out", wrong]);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{wrong}: {}", ended.err());
        assert!(ended.err().contains("help:"), "{wrong}: {}", ended.err());
    }
}
