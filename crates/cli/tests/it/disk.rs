//! A full disk: the run fails with what replays it, and goes on when there is room.

use crate::support::{Place, SmallDisk};

#[test]
fn a_full_disk_fails_the_run_which_resumes_when_there_is_room() {
    let place = Place::new();
    let at = place.path("disk");
    let Some(disk) = SmallDisk::mount(&at, "200k") else {
        println!("skipped: this user may not mount a small disk");
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
