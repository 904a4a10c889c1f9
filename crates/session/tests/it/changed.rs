//! Folders changed after they were written: they are refused, and nothing panics.

use crate::support::{BUILD, TestFolder, WORLDS, edit};
use crate::sweeps::sweep;
use serde_json::{Value, json};
use sidestep_experiment::sweep::{Precision, Shard, Sweep};
use sidestep_kernel::InputError;
use sidestep_session::report::document;
use sidestep_session::sweep::{
    Folder, SweepEnd, collect, create, read_status, run_remaining, run_share,
};
use sidestep_session::{Error, NoWatcher, RecordedRun, replay_all};
use std::path::Path;

fn refused<T>(result: Result<T, impl Into<Error>>, cause: &str) {
    let told = result.map(drop).map_err(Into::<Error>::into).expect_err(cause).to_string();
    assert!(told.contains(cause) && told.contains("help"), "{told}");
}

/// Calls every reader of a sweep; each refuses it for this reason.
fn refused_by_all(path: &Path, cause: &str) {
    let open = || Folder::open(path).map_err(Error::from);
    refused(open().and_then(|folder| Ok(read_status(&folder)?)), cause);
    refused(open().and_then(|folder| run_remaining(&WORLDS, &folder, 1, &NoWatcher)), cause);
    refused(open().and_then(|folder| collect(&WORLDS, &folder, &NoWatcher)), cause);
    refused(document(&WORLDS, path, &NoWatcher), cause);
}

#[test]
fn a_table_of_another_sweep_is_refused_by_all_who_read_it() {
    let place = TestFolder::new();
    let own = sweep(&place);
    let more = Sweep { replicates: 5, ..own.clone() };
    for (name, sweep) in [("own", &own), ("more", &more)] {
        let folder = create(&WORLDS, sweep, &place.path(name), 1, &NoWatcher).expect("planned");
        run_remaining(&WORLDS, &folder, 1, &NoWatcher).expect("run");
    }
    for table in ["results.parquet", "timings.parquet"] {
        let from = place.path("more").join(table);
        std::fs::copy(from, place.path("own").join(table)).expect("copied");
    }
    refused_by_all(&place.path("own"), "the table is of another sweep");
    std::fs::remove_file(place.path("own/results.parquet")).expect("deleted, as the error says");
    let folder = Folder::open(&place.path("own")).expect("a sweep");
    run_remaining(&WORLDS, &folder, 1, &NoWatcher).expect("joined again");
    assert_eq!(read_status(&folder).expect("its own table").runs, 6);
}

#[test]
fn a_plan_that_does_not_fit_together_is_refused_by_all_who_read_it() {
    let place = TestFolder::new();
    let sweep = sweep(&place);
    let path = place.path("sweep");
    let folder = create(&WORLDS, &sweep, &path, 1, &NoWatcher).expect("planned");
    run_share(&WORLDS, &folder, Shard { index: 0, count: 2 }, 1, &NoWatcher).expect("run");
    let file = path.join("sweep.json");
    let text = std::fs::read_to_string(&file).expect("there");
    let whole: Value = serde_json::from_str(&text).expect("JSON");
    let baseline = json!({ "name": "b", "of": [null, 7], "alone": 0 });
    let one = json!([whole["plan"]["variants"][1]]);
    for (key, value, cause) in [
        ("variants", json!([]), "a plan of 0 variants"),
        ("variants", one, "its plan has 1 variants, and there are 2 scenarios"),
        ("replicates", json!(0), "with 0 runs each"),
        ("replicates", json!(u32::MAX), "are too many"),
        ("first_seed", json!(u64::MAX), "exceed 2^63 - 1"),
        ("parameters", json!([]), "which is no parameter"),
        ("baseline", baseline, "variant 7 is a baseline"),
    ] {
        let mut changed = whole.clone();
        changed["plan"][key] = value;
        let text = sidestep_record::seal_again(&changed.to_string());
        std::fs::write(&file, text).expect("written");
        refused_by_all(&path, cause);
    }
}

#[test]
fn a_run_that_says_to_have_more_cycles_than_its_scenario_is_not_computed_for_as_long() {
    let place = TestFolder::new();
    let (folder, _) = place.record("run");
    let manifest = folder.join("run.json");
    edit(&manifest, "\"cycles_done\": 6000", "\"cycles_done\": 18446744073709551615");
    let recorded = RecordedRun::open(&WORLDS, &folder).expect("recorded");
    refused(replay_all(&recorded, 1, &NoWatcher), "its scenario has 6000");
    let shown: Result<_, InputError> = recorded.start_for_viewing(1);
    refused(shown, "its scenario has 6000");
}

#[test]
fn a_report_shows_no_picture_of_a_run_that_is_not_in_its_table() {
    let place = TestFolder::new();
    let report = |name: &str, change: &dyn Fn(&Path)| {
        let path = place.path(name);
        let folder = create(&WORLDS, &sweep(&place), &path, 1, &NoWatcher).expect("planned");
        run_remaining(&WORLDS, &folder, 1, &NoWatcher).expect("run");
        change(&path);
        let document = document(&WORLDS, &path, &NoWatcher).expect("a document");
        sidestep_report::render(&document, "pictures").expect("pages").markdown
    };
    let plain = report("plain", &|_| ());
    for row in [0, 3] {
        assert!(plain.contains(&format!("in row {row} of results.parquet")), "{plain}");
    }
    let other_scenario = report("scenario", &|path| {
        edit(&path.join("variants/0001/scenario.toml"), "frogs = 20", "frogs = 19");
    });
    assert!(other_scenario.contains("in row 0 of"), "{other_scenario}");
    assert!(!other_scenario.contains("in row 3 of"), "{other_scenario}");
    assert!(other_scenario.contains("is not as it was planned"), "{other_scenario}");
    let other_build = report("build", &|path| {
        edit(&path.join("sweep.json"), BUILD, "0.1.0+000000000000");
    });
    assert!(!other_build.contains("in row 0 of"), "{other_build}");
    assert!(other_build.contains("There is no picture of"), "{other_build}");
}

#[test]
fn a_report_finds_the_rows_of_variants_with_different_numbers_of_runs() {
    let place = TestFolder::new();
    let metrics = vec!["hops_per_frog".to_string()];
    let until = Precision { half_width: 0.5, is_relative: true, metrics };
    let sweep = Sweep { until: Some(until), replicates: 40, ..sweep(&place) };
    let path = place.path("until");
    let folder = create(&WORLDS, &sweep, &path, 2, &NoWatcher).expect("planned");
    let SweepEnd::Done(done) = run_remaining(&WORLDS, &folder, 2, &NoWatcher).expect("run") else {
        panic!("interrupted")
    };
    let trials = done.table.column("cell").expect("a column");
    let row = (0..done.table.runs()).find(|row| trials.values.number(*row) == Some(40.0));
    let row = row.expect("the first run of the second variant");
    assert!(row < 40, "the first variant has fewer runs than it may have");
    let document = document(&WORLDS, &path, &NoWatcher).expect("a document");
    let pages = sidestep_report::render(&document, "pictures").expect("pages");
    assert!(pages.markdown.contains(&format!("in row {row} of")), "{}", pages.markdown);
}
