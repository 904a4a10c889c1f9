//! The places where a run is recorded: taken together or not at all.

use crate::support::{Place, names};
use sidestep_session::{Error, Keep, Unwatched};
use std::path::Path;

fn start(place: &Place, folder: &Path, mcap: &Path) -> Result<(), Error> {
    let keep = Keep { folder: Some(folder), mcap: Some((mcap, 100)), replace: false };
    place.start(1, keep)?.travel(&Unwatched).map(drop)
}

#[test]
fn a_recording_that_cannot_be_made_leaves_no_run_folder() {
    let place = Place::new();
    std::fs::write(place.path("file"), "no folder").expect("written");
    let before = names(&place);
    start(&place, &place.path("run"), &place.path("file/z.mcap")).expect_err("no folder");
    assert_eq!(names(&place), before);
    start(&place, &place.path("run"), &place.path("z.mcap")).expect("the corrected places");
    // A folder that cannot be made leaves no recording.
    let before = names(&place);
    start(&place, &place.path("file/run"), &place.path("y.mcap")).expect_err("no folder");
    assert_eq!(names(&place), before);
}

#[test]
fn a_recording_in_the_place_of_the_folder_or_above_it_is_refused() {
    let place = Place::new();
    let before = names(&place);
    let same = place.path("run");
    let above = place.path("a/b");
    for (folder, mcap) in
        [(&same, &same), (&above, &place.path("a")), (&same, &place.path("./run"))]
    {
        let refused = start(&place, folder, mcap).expect_err("one place").to_string();
        assert!(refused.contains("the run folder is to be there"), "{refused}");
        assert_eq!(names(&place), before);
    }
    start(&place, &same, &same.join("run.mcap")).expect("a file in the folder");
    assert!(same.join("run.mcap").is_file() && same.join("run.json").is_file());
}
#[test]
#[cfg(unix)]
fn a_link_to_a_folder_stays_a_link() {
    use sidestep_session::sweep::{Folder, planned};
    use std::os::unix::fs::symlink;
    let place = Place::new();
    for (real, link) in [("disk/run", "run"), ("disk/sweep", "sweep")] {
        std::fs::create_dir_all(place.path(real)).expect("made");
        symlink(place.path(real), place.path(link)).expect("linked");
    }
    place.record("run");
    let sweep = crate::sweeps::sweep(&place);
    planned(crate::support::WORLDS, &sweep, &place.path("sweep"), 1, &Unwatched).expect("planned");
    assert!(place.path("run").is_symlink() && place.path("disk/run/run.json").is_file());
    assert!(place.path("sweep").is_symlink() && Folder::open(&place.path("disk/sweep")).is_ok());
    symlink(place.path("nowhere"), place.path("dangling")).expect("linked");
    let keep = Keep { folder: Some(&place.path("dangling")), ..Keep::default() };
    let refused = place.start(1, keep).map(drop).expect_err("nowhere").to_string();
    assert!(refused.contains("a link to what is not there"), "{refused}");
    assert!(place.path("dangling").is_symlink());
}
