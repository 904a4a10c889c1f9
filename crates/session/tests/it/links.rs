//! Links to folders as places of results: they stay, and their targets are filled.

use crate::exports::wanted;
use crate::support::{TestFolder, WORLDS};
use sidestep_session::export::{Format, export};
use sidestep_session::sweep::{Folder, create};
use sidestep_session::{NoWatcher, OutputPaths, RecordedRun};
use std::os::unix::fs::symlink;

#[test]
fn a_link_to_a_folder_stays_a_link_also_with_a_slash_at_its_end() {
    for end in ["", "/"] {
        let place = TestFolder::new();
        let recorded = place.record("recorded").0;
        for name in ["run", "sweep", "tables"] {
            std::fs::create_dir_all(place.path("disk").join(name)).expect("made");
            symlink(place.path("disk").join(name), place.path(name)).expect("linked");
        }
        let named = |name: &str| place.path(&format!("{name}{end}"));
        place.record(&format!("run{end}"));
        let sweep = crate::sweeps::sweep(&place);
        create(&WORLDS, &sweep, &named("sweep"), 1, &NoWatcher).expect("planned");
        let tables = named("tables");
        let mut wanted = wanted(Format::Csv(None), &tables);
        wanted.scope.replace = true;
        let recorded = RecordedRun::open(&WORLDS, &recorded).expect("recorded");
        export(&recorded, &wanted, &NoWatcher).expect("written");
        for name in ["run", "sweep", "tables"] {
            assert!(place.path(name).is_symlink(), "{name}{end}");
        }
        assert!(place.path("disk/run/run.json").is_file());
        assert!(Folder::open(&place.path("disk/sweep")).is_ok());
        assert!(place.path("disk/tables/events.csv").is_file());
    }
}

#[test]
fn a_link_to_what_is_not_there_is_refused_and_stays() {
    let place = TestFolder::new();
    let recorded = place.record("recorded").0;
    let recorded = RecordedRun::open(&WORLDS, &recorded).expect("recorded");
    symlink(place.path("nowhere"), place.path("link")).expect("linked");
    for name in ["link", "link/"] {
        let folder = place.path(name);
        let keep = OutputPaths { folder: Some(&folder), ..OutputPaths::default() };
        let run = place.start(1, keep).map(drop).expect_err("nowhere");
        let tables = export(&recorded, &wanted(Format::Csv(None), &folder), &NoWatcher);
        for refused in [run, tables.expect_err("nowhere")] {
            assert!(refused.to_string().contains("a link to what is not there"), "{refused}");
        }
        assert!(place.path("link").is_symlink(), "{name}");
    }
}
