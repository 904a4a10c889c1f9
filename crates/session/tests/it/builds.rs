//! A build continues its own runs and sweeps; another one is refused.

use crate::support::{BUILD, StopAt, TestFolder, WORLDS, edit};
use crate::sweeps::sweep;
use sidestep_experiment::sweep::Shard;
use sidestep_session::VERSION;
use sidestep_session::sweep::{Folder, collect, create, open_or_create, run_remaining, run_share};
use sidestep_session::{Error, ManagedRun, NoWatcher, OutputPaths, RecordedRun, replay_all};

const OTHER: &str = "0.1.0+000000000000";

fn is_refused<T>(result: Result<T, Error>) {
    let error = result.map(drop).expect_err("another build").to_string();
    assert!(error.contains(OTHER) && error.contains(BUILD) && error.contains("help"), "{error}");
}

#[test]
fn two_builds_do_not_mix_in_one_sweep() {
    let place = TestFolder::new();
    let (sweep, path) = (sweep(&place), place.path("sweep"));
    create(&WORLDS, &sweep, &path, 2, &NoWatcher).expect("planned");
    let run = |shard: &str| {
        let folder = Folder::open(&path).expect("a sweep");
        let shard: Shard = shard.parse().expect("a share");
        run_share(&WORLDS, &folder, shard, 1, &NoWatcher)
    };
    run("0/2").expect("the build that planned it");
    let manifest = path.join("sweep.json");
    edit(&manifest, BUILD, OTHER);
    is_refused(run("1/2"));
    let folder = Folder::open(&path).expect("a sweep");
    is_refused(collect(&WORLDS, &folder, &NoWatcher));
    is_refused(run_remaining(&WORLDS, &folder, 1, &NoWatcher));
    is_refused(open_or_create(&WORLDS, &sweep, &path, 2, &NoWatcher));
    // A folder from before builds had identities.
    edit(&manifest, &format!("  \"build\": \"{OTHER}\",\n"), "");
    run("1/2").expect("the version is the same");
    collect(&WORLDS, &Folder::open(&path).expect("a sweep"), &NoWatcher).expect("collected");
}

#[test]
fn a_run_of_another_build_is_neither_resumed_nor_replayed() {
    let place = TestFolder::new();
    let folder = place.path("run");
    let keep = OutputPaths { folder: Some(&folder), ..OutputPaths::default() };
    place.start(1, keep).expect("started").run_to_end(&StopAt::new(600)).expect("stopped");
    let resume = || ManagedRun::resume(&WORLDS, &folder, 1, None);
    let manifest = folder.join("run.json");
    edit(&manifest, BUILD, OTHER);
    is_refused(resume());
    edit(&manifest, &format!("  \"build\": \"{OTHER}\",\n"), "");
    resume().expect("the version is the same").run_to_end(&NoWatcher).expect("no bug");
    let replay = || {
        let recorded = RecordedRun::open(&WORLDS, &folder).expect("recorded");
        replay_all(&recorded, 1, &NoWatcher)
    };
    replay().expect("the same digest");
    let version = format!("\"program_version\": \"{VERSION}\",");
    edit(&manifest, &version, &format!("{version}\n  \"build\": \"{OTHER}\","));
    is_refused(replay());
}
