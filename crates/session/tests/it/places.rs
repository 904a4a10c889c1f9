//! The places where a run is recorded: taken together or not at all.

use crate::support::{TestFolder, names};
use sidestep_session::{Error, NoWatcher, OutputPaths};
use std::path::Path;

fn start(place: &TestFolder, folder: &Path, mcap: &Path) -> Result<(), Error> {
    let keep =
        OutputPaths { folder: Some(folder), mcap: Some((mcap, 100)), ..OutputPaths::default() };
    place.start(1, keep)?.run_to_end(&NoWatcher).map(drop)
}

#[test]
fn a_recording_that_cannot_be_made_leaves_no_run_folder() {
    let place = TestFolder::new();
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
    let place = TestFolder::new();
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
