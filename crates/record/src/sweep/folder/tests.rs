//! A sweep from its plan to its table; and failures that leave nothing.

use super::super::results::ResultColumns;
use super::super::shares::Share;
use super::*;
use crate::create_error::replace_path;
use crate::run_table::LoadedTable;
use sidestep_kernel::ports::ColumnValues;

type Folder = SweepFolder<Vec<u32>>;

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Failed(String);

impl From<InputError> for Failed {
    fn from(e: InputError) -> Self {
        Self(e.to_string())
    }
}

impl PathError for Failed {
    fn with_path(self, from: &Path, to: &Path) -> Self {
        Self(replace_path(&self.0, from, to))
    }
}

impl From<RecordError> for Failed {
    fn from(e: RecordError) -> Self {
        Self(e.to_string())
    }
}

fn cells() -> Vec<ColumnWithRole<String>> {
    let values = ColumnValues::I64(vec![0, 1].into());
    vec![ColumnWithRole { name: "cell".into(), role: "cell".into(), values }]
}

fn create(path: &Path) -> Result<Folder, Failed> {
    Folder::create(path, "0.1.0", "0.1.0+a", |staging| {
        let files = [("inputs/a.txt".to_string(), b"a".to_vec())];
        Folder::write_variant(staging, 0, "seed = 1\n", &files)?;
        Ok((vec![4, 5], vec!["f".into()], cells()))
    })
}

#[test]
fn a_sweep_goes_from_plan_over_shares_to_one_table() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("sweep");
    let folder = create(&path).unwrap();
    assert_eq!(fs::read_to_string(folder.scenario(0)).unwrap(), "seed = 1\n");
    let share = Share { index: 1, count: 2 };
    let mut journal = folder.journal(share, |_: u32| panic!("a run")).unwrap().unwrap();
    journal.append(&7u32).unwrap();
    let runs = |but| {
        let mut runs: Vec<u32> = Vec::new();
        folder.journals(but, |run| runs.push(run)).unwrap();
        runs
    };
    assert_eq!((runs(None), runs(Some(share))), (vec![7], vec![]));
    let cells_again = cells();
    let refs: Vec<_> = cells_again.iter().collect();
    folder.finish_share(share, journal, &refs).unwrap();
    let again = folder.journal(share, |_: u32| ()).unwrap();
    assert!(again.is_none(), "a share that is done is done");
    assert!(runs(None).is_empty());
    let mut parts = Vec::new();
    folder.parts(|part| parts.push(part.columns)).unwrap();
    assert_eq!(parts, [cells()]);
    assert!(folder.results::<String>().unwrap_err().cause().contains("not done"));
    let tables = ResultColumns { results: &refs, timings: &refs, series: &refs };
    let mut completion = folder.results_writer(&tables).unwrap();
    assert!(!folder.is_complete());
    completion.append(&tables).unwrap();
    completion.append(&tables).unwrap();
    completion.finish().unwrap();
    let again = Folder::open(&path).unwrap();
    assert_eq!((again.plan(), again.is_complete()), (&vec![4, 5], true));
    let twice = ColumnValues::I64(vec![0, 1, 0, 1].into());
    assert_eq!(again.results::<String>().unwrap().columns[0].values, twice);
    assert_eq!(again.series::<String>().unwrap().unwrap().columns[0].values, twice);
}

#[test]
fn tables_and_shares_of_another_sweep_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let other = |name: &str, plan: Vec<u32>, print: &str| {
        let fill = |_: &Path| Ok::<_, Failed>((plan, vec![print.to_string()], cells()));
        Folder::create(&place.path().join(name), "0.1.0", "0.1.0+a", fill).unwrap()
    };
    let own = create(&place.path().join("own")).unwrap();
    let columns = cells();
    let refs: Vec<_> = columns.iter().collect();
    let complete = |folder: &Folder| {
        let tables = ResultColumns { results: &refs, timings: &refs, series: &refs };
        let mut completion = folder.results_writer(&tables).unwrap();
        completion.append(&tables).unwrap();
        completion.finish().unwrap();
    };
    complete(&own);
    for other in [other("plan", vec![4], "f"), other("scenarios", vec![4, 5], "g")] {
        complete(&other);
        for table in ["results.parquet", "timings.parquet", "series.parquet"] {
            let file = own.path().join(table);
            let before = fs::read(&file).unwrap();
            fs::copy(other.path().join(table), &file).unwrap();
            let refused = own
                .results::<String>()
                .and_then(|_| own.timings::<String>())
                .and_then(|_| own.series::<String>());
            let refused = refused.unwrap_err();
            assert!(refused.cause().contains("another sweep"), "{refused}");
            assert!(refused.remedy().contains("delete `results.parquet`"), "{refused}");
            fs::write(&file, before).unwrap();
        }
    }
    own.results::<String>()
        .and_then(|_| own.timings::<String>())
        .and_then(|_| own.series::<String>())
        .unwrap();
    let (other, share) = (other("share", vec![4, 5], "g"), Share { index: 0, count: 1 });
    let journal = other.journal(share, |_: u32| ()).unwrap().unwrap();
    other.finish_share(share, journal, &refs).unwrap();
    let part = "shares/0-of-1.parquet";
    fs::copy(other.path().join(part), own.path().join(part)).unwrap();
    let refused = own.parts(|_: LoadedTable<String>| panic!("a foreign part")).unwrap_err();
    assert!(refused.cause().contains("another sweep"), "{refused}");
}

#[test]
fn a_table_of_runs_that_is_not_finished_and_a_place_to_join_them_leave_nothing() {
    let place = tempfile::tempdir().unwrap();
    let folder = create(&place.path().join("sweep")).unwrap();
    let names = || {
        let entries = fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    let columns = cells();
    let refs: Vec<_> = columns.iter().collect();
    let tables = ResultColumns { results: &refs, timings: &refs, series: &refs };
    let mut completion = folder.results_writer(&tables).unwrap();
    completion.append(&tables).unwrap();
    drop(completion);
    // A kill leaves its files there.
    std::mem::forget(folder.temp_folder().unwrap());
    let joining = folder.path().join(TEMP_FOLDER);
    fs::write(joining.join("0012.jsonl"), "rest").unwrap();
    fs::write(joining.join("notes.txt"), "of the user").unwrap();
    assert!(folder.temp_folder().unwrap_err().place.contains("notes.txt"));
    assert_eq!(fs::read_dir(&joining).unwrap().count(), 2, "nothing is deleted");
    fs::remove_file(joining.join("notes.txt")).unwrap();
    let scratch = folder.temp_folder().unwrap();
    assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 0);
    drop(scratch);
    assert_eq!(names(), before);
}

#[test]
fn a_plan_that_fails_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("a/sweep");
    let made = Folder::create::<String, _>(&path, "0.1.0", "0.1.0+a", |_| Err(Failed("no".into())));
    assert!(made.is_err());
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn nothing_of_yours_is_overwritten() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("letter.txt"), "dear").unwrap();
    assert!(create(place.path()).is_err());
    assert!(Folder::open(place.path()).unwrap_err().cause().contains("no sweep"));
}
