//! Many runs of one scenario.

use crate::support::{BUILD, TestFolder, WORLDS};
use sidestep_experiment::sweep::{Outcome, RunTable, Shard, Sweep, Trial, series_bands};
use sidestep_scenario::Source;
use sidestep_session::report::document;
use sidestep_session::sweep::{
    Engine, Folder, OutcomeSink, SweepEnd, SweepResult, Task, TrialBatch, TrialExecutor, collect,
    create, read_status, run_in_memory, run_remaining, run_share,
};
use sidestep_session::{Error, NoWatcher};

const SWEEP: &str = "format = 1\nscenario = \"pond.toml\"\nreplicates = 3\n\
                     [set]\n\"cycles\" = 700\n[vary]\n\"pond.frogs\" = [4, 20]\n";

/// The sweep of two variants with three seeds each.
pub(crate) fn sweep(place: &TestFolder) -> Sweep {
    let file = place.path("sweep.toml");
    std::fs::write(&file, SWEEP).expect("written");
    Sweep::read(&file).expect("valid")
}

fn finished(ended: SweepEnd) -> SweepResult {
    match ended {
        SweepEnd::Done(done) => done,
        SweepEnd::Interrupted(runs) => panic!("interrupted after {runs} runs"),
    }
}

fn done(ended: SweepEnd) -> RunTable {
    RunTable { columns: finished(ended).table.results().into_iter().cloned().collect() }
}

#[test]
fn means_over_seeds_are_those_of_plain_runs_however_a_sweep_is_run() {
    let place = TestFolder::new();
    let sweep = sweep(&place);
    let (_, ended) = run_in_memory(&WORLDS, &sweep, 2, &NoWatcher).expect("run");
    let whole = finished(ended);
    let folder = create(&WORLDS, &sweep, &place.path("s"), 2, &NoWatcher).expect("planned");
    for shard in ["1/2", "0/2"] {
        let shard: Shard = shard.parse().expect("a share");
        run_share(&WORLDS, &folder, shard, 1, &NoWatcher).expect("run");
    }
    let collected = finished(collect(&WORLDS, &folder, &NoWatcher).expect("collected"));
    assert!(whole.series == collected.series);
    assert!(place.path("s/series.parquet").is_file());
    let read = finished(run_remaining(&WORLDS, &folder, 1, &NoWatcher).expect("read"));
    assert!(read.was_done && read.series == whole.series);

    let recorded = Sweep { record: true, ..sweep.clone() };
    let folder = create(&WORLDS, &recorded, &place.path("r"), 2, &NoWatcher).expect("planned");
    let recorded = finished(run_remaining(&WORLDS, &folder, 2, &NoWatcher).expect("run"));
    assert!(recorded.series == whole.series, "recorded or not");

    let bands = series_bands(&whole.table, &whole.series);
    assert_eq!(bands.len(), 2, "one metric of two variants");
    for (band, frogs) in bands.iter().zip([4, 20]) {
        assert_eq!(band.points.len(), 100);
        for point in band.points.iter().step_by(33) {
            let hops: Vec<f64> = (1..=3).map(|seed| hops(frogs, seed, point.cycle)).collect();
            assert_eq!((point.runs, point.mean), (3, hops.iter().sum::<f64>() / 3.0));
        }
    }
}

/// Returns the hops of so many frogs in a run of so many cycles.
fn hops(frogs: u32, seed: u64, cycles: u64) -> f64 {
    let text = std::fs::read_to_string(TestFolder::new().path("pond.toml")).expect("a scenario");
    let settings = [format!("pond.frogs={frogs}"), format!("seed={seed}")];
    let source = Source::new("pond.toml", text, "").with_overrides(&settings).expect("keys");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    while run.cycle() < cycles && run.advance(cycles - run.cycle()) > 0 {}
    run.metrics()["hops"].as_f64().expect("a number")
}

#[test]
fn two_variants_with_three_seeds_come_to_one_table_however_they_are_run() {
    let place = TestFolder::new();
    let sweep = sweep(&place);
    let (plan, ended) = run_in_memory(&WORLDS, &sweep, 2, &NoWatcher).expect("run");
    let table = done(ended);
    assert_eq!((plan.world.as_str(), plan.variants.len(), table.runs()), ("pond", 2, 6));
    assert!(table.column("hops_per_frog").is_some());

    let folder = create(&WORLDS, &sweep, &place.path("one"), 2, &NoWatcher).expect("planned");
    let one = run_remaining(&WORLDS, &folder, 3, &NoWatcher).expect("run");
    assert_eq!(done(one), table);

    let folder = create(&WORLDS, &sweep, &place.path("shares"), 2, &NoWatcher).expect("planned");
    for shard in ["1/2", "0/2"] {
        let shard: Shard = shard.parse().expect("a share");
        let ended = run_share(&WORLDS, &folder, shard, 1, &NoWatcher).expect("run");
        assert_eq!(done(ended).runs(), 3);
    }
    assert_eq!(done(collect(&WORLDS, &folder, &NoWatcher).expect("collected")), table);
}

#[test]
fn the_status_counts_each_run_once_and_tells_those_that_failed() {
    let place = TestFolder::new();
    let sweep = sweep(&place);
    let folder = create(&WORLDS, &sweep, &place.path("s"), 2, &NoWatcher).expect("planned");
    let shard: Shard = "1/2".parse().expect("a share");
    run_share(&WORLDS, &folder, shard, 1, &NoWatcher).expect("run");
    // A run of that share again, from another division into shares, and one that failed.
    let journal = place.path("s/shares/0-of-1.journal");
    let outcome = |trial: u64| {
        Outcome::from_failure(folder.plan().trial_of(trial).expect("a trial"), "no frogs")
    };
    let is_in_share =
        |trial: &u64| folder.plan().shard_trials(shard).any(|other| other.id == *trial);
    let (own, other) = ((0..6).find(is_in_share), (0..6).find(|trial| !is_in_share(trial)));
    let all = sidestep_record::sweep::Share { index: 0, count: 1 };
    let mut writing = folder.journal(all, |_: Outcome| ()).expect("a journal").expect("not done");
    for trial in [own, other].map(|trial| trial.expect("a trial")) {
        writing.append(&outcome(trial)).expect("written");
    }
    let found = read_status(&folder).expect("read");
    assert!(found.is_active && found.eta_s.is_none(), "before the second run, too");
    drop(writing);
    let found = read_status(&folder).expect("read");
    assert_eq!((found.runs, found.total, found.failed, found.is_complete), (4, 6, 1, false));
    assert!(!found.is_active, "no process has the lock of its journal");
    assert_eq!(found.failures[0].why, "no frogs");
    assert_eq!(found.failures[0].trial, other.expect("a trial"));
    // Lines of early journals have no times.
    assert_eq!((found.runs_per_s, found.idle_s, found.eta_s), (None, None, None));
    let shares: Vec<_> =
        found.shares.iter().map(|s| (s.share.as_str(), s.runs, s.is_done)).collect();
    assert_eq!(shares, [("0/1", 2, false), ("1/2", 3, true)]);
    std::fs::write(journal, "no journal\nat all\n").expect("written");
    assert!(read_status(&folder).is_err(), "damage is told");
}

#[test]
fn runs_of_a_sweep_are_recorded_and_reported() {
    let place = TestFolder::new();
    let sweep = Sweep { record: true, ..sweep(&place) };
    let path = place.path("sweep");
    let folder = create(&WORLDS, &sweep, &path, 2, &NoWatcher).expect("planned");
    run_remaining(&WORLDS, &folder, 2, &NoWatcher).expect("run");
    let folder = Folder::open(&path).expect("a sweep");
    assert!(folder.run_folder(5).join("trajectories.svg").is_file());
    let document = document(&WORLDS, &path, &NoWatcher).expect("a document");
    let pages = sidestep_report::render(&document, "pictures").expect("pages");
    for words in ["6 runs of 2 variants", "Hops per frog"] {
        assert!(
            pages.markdown.replace('\u{a0}', " ").contains(words),
            "no {words} in {}",
            pages.markdown
        );
    }
}

/// A crew outside that gets tasks, the last trials first, and does only some of them in a call.
struct ExternalExecutor {
    in_a_call: usize,
}

impl ExternalExecutor {
    fn task(deal: &TrialBatch<'_>, trials: &[Trial]) -> Task {
        let mut variants: Vec<u32> = trials.iter().map(|trial| trial.variant).collect();
        variants.sort_unstable();
        variants.dedup();
        let scenario = |variant: u32| (variant, deal.scenario(variant).expect("there"));
        let scenarios = variants.into_iter().map(scenario).collect();
        let series = deal.series().map(<[String]>::to_vec);
        Task { build: BUILD.into(), scenarios, trials: trials.to_vec(), series }
    }

    fn outcomes(deal: &TrialBatch<'_>, trials: &[Trial]) -> Vec<Outcome> {
        Self::task(deal, trials).run(&WORLDS, &NoWatcher).expect("run")
    }
}

impl TrialExecutor for ExternalExecutor {
    fn run(&self, deal: &TrialBatch<'_>, take: &mut OutcomeSink<'_>) -> Result<(), Error> {
        for trials in deal.trials().chunks(2).rev().take(self.in_a_call) {
            for outcome in Self::outcomes(deal, trials) {
                take(outcome.clone())?;
                // A task that was sent twice comes twice.
                take(outcome)?;
            }
        }
        Ok(())
    }

    fn parallelism(&self) -> usize {
        2
    }
}

#[test]
fn others_who_run_the_trials_come_to_the_same_table_in_any_order_and_any_number_of_calls() {
    let place = TestFolder::new();
    let sweep = sweep(&place);
    let (_, ended) = run_in_memory(&WORLDS, &sweep, 2, &NoWatcher).expect("run");
    let table = done(ended);
    for in_a_call in [1, usize::MAX] {
        let others = ExternalExecutor { in_a_call };
        let (_, ended) =
            run_in_memory(&WORLDS, &sweep, Engine::Executor(&others), &NoWatcher).expect("run");
        assert_eq!(done(ended), table);
        let path = place.path(&format!("others {in_a_call}"));
        let folder = create(&WORLDS, &sweep, &path, 2, &NoWatcher).expect("planned");
        let ended =
            run_remaining(&WORLDS, &folder, Engine::Executor(&others), &NoWatcher).expect("run");
        assert_eq!(done(ended), table);
    }
}

#[test]
fn a_task_of_another_build_is_refused_and_so_is_recording_by_others() {
    let build = "0.0.1+0".to_string();
    let task = Task { build, scenarios: Vec::new(), trials: Vec::new(), series: None };
    let told = task.run(&WORLDS, &NoWatcher).expect_err("another build").to_string();
    assert!(told.contains("0.0.1+0") && told.contains(BUILD), "{told}");

    let place = TestFolder::new();
    let sweep = Sweep { record: true, ..sweep(&place) };
    let folder = create(&WORLDS, &sweep, &place.path("sweep"), 2, &NoWatcher).expect("planned");
    let others = ExternalExecutor { in_a_call: 1 };
    let told = run_remaining(&WORLDS, &folder, Engine::Executor(&others), &NoWatcher);
    let told = told.err().expect("recorded by others").to_string();
    assert!(told.contains("which others cannot write to"), "{told}");
}
