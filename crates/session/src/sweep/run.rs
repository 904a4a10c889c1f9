//! The path from a sweep to the table of its runs: in memory, in a folder, or share by share.

use super::buckets::{BUCKET_TRIALS, OutcomeBuckets};
use super::executor::Engine;
use super::finished_runs::{FinishedRuns, read_finished, read_series};
use super::folder::{Folder, check_build, for_each_outcome, to_run_table, to_share};
use super::journal::TimestampedOutcome;
use super::prepare::{VariantFn, prepare};
use super::timing::SweepTiming;
use super::trial_runner::{OutcomeHandler, TrialRunner};
use crate::VERSION;
use crate::watcher::{Progress, ProgressGuard};
use crate::{Error, Watcher};
use serde_json::Map;
use sidestep_experiment::sweep::rounds::Rounds;
use sidestep_experiment::sweep::seeds::PilotRuns;
use sidestep_experiment::sweep::{
    Outcome, Plan, RunTable, RunTableBuilder, Shard, Sweep, Trial, rows::trial_table,
};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::shell::sidestep_command;
use sidestep_record::sweep::{ResultColumns, ResultsWriter, fingerprint};
use sidestep_scenario::{ResolvedScenario, Source, Worlds};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The result of working on a sweep, or on a share of one.
pub enum SweepEnd {
    /// All of its runs are finished.
    Done(SweepResult),
    /// The watcher asked to stop; this many runs are finished.
    Interrupted(usize),
}

/// Finished runs.
pub struct SweepResult {
    /// One row per run.
    pub table: RunTable,
    /// Their metrics over time, one row per run and cycle; without columns where none were kept.
    pub series: RunTable,
    /// The time that they took in this process.
    pub effort: SweepTiming,
    /// Whether all were already finished before.
    pub was_done: bool,
}

impl SweepResult {
    /// Returns the result of runs that are finished now, with their metrics over time in the table.
    fn complete(table: RunTable, effort: SweepTiming) -> SweepEnd {
        let (table, series) = table.split_series();
        SweepEnd::Done(Self { table, series, effort, was_done: false })
    }

    /// Returns the same of runs that were finished before.
    fn already_complete(table: RunTable) -> SweepEnd {
        let (table, series) = table.split_series();
        SweepEnd::Done(Self { table, series, effort: SweepTiming::default(), was_done: true })
    }

    /// Reads the results of a folder that is done.
    fn read(folder: &Folder) -> Result<SweepEnd, Error> {
        let table = to_run_table(folder.results()?);
        let series = read_series(folder)?;
        let effort = SweepTiming::default();
        Ok(SweepEnd::Done(Self { table, series, effort, was_done: true }))
    }
}

/// Runs a sweep in memory, without writing anything.
///
/// # Errors
/// When the sweep is wrong, or the watcher asks to stop before the first run.
pub fn run_in_memory<'a>(
    worlds: &Worlds,
    sweep: &Sweep,
    engine: impl Into<Engine<'a>>,
    watcher: &dyn Watcher,
) -> Result<(Plan, SweepEnd), Error> {
    if sweep.record {
        let cause = "there is no folder to record runs to";
        return Err(InputError::new("--record-runs", cause, "give one with --out").into());
    }
    let engine = engine.into();
    let make: VariantFn<'_, Source> = &|_, source, _| Ok(source.clone());
    let (plan, sources) = prepare(worlds, sweep, engine.planning_workers(), watcher, make)?;
    let source = |variant: u32| Ok(sources[variant as usize].clone());
    let agents = plan.agents;
    let series = plan.series.as_deref();
    let runner =
        TrialRunner { worlds, agents, source: &source, record: None, series, engine, watcher };
    let mut scheduler = TrialScheduler::new(&plan);
    let mut rows = RunTableBuilder::default();
    let keeps_series = plan.keeps_series();
    let effort = scheduler.run_all(&runner, &mut |outcome| {
        rows.push(&kept_outcome(outcome, keeps_series));
        Ok(())
    })?;
    let end = if watcher.should_continue() {
        SweepResult::complete(rows.build(&plan)?, effort)
    } else {
        SweepEnd::Interrupted(scheduler.finished.len())
    };
    Ok((plan, end))
}

/// Plans a sweep into a folder, on a number of workers: completely or not at all.
///
/// # Errors
/// When the sweep is wrong, or the folder is taken.
pub fn create(
    worlds: &Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    let folder = Folder::create(out, VERSION, worlds.build(), |staging| {
        let (plan, fingerprints) =
            prepare(worlds, sweep, workers, watcher, &|k, source, compiled| {
                let ResolvedScenario { text, files } = compiled.resolve(source)?;
                Folder::write_variant(staging, k, &text, &files)?;
                Ok(fingerprint(text.as_bytes(), &files))
            })?;
        let trials = trial_table(&plan).columns;
        Ok::<_, Error>((plan, fingerprints, trials))
    })?;
    folder.leftovers().iter().for_each(|leftover| watcher.note_removal(leftover));
    Ok(folder)
}

/// Plans a sweep into a folder, or opens the folder if it holds the same sweep already.
///
/// # Errors
/// When the sweep is wrong, or the folder holds something else, or is of another build.
pub fn open_or_create(
    worlds: &Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    if Folder::is_at(out) {
        open_same(worlds, sweep, out, workers, watcher)
    } else {
        create(worlds, sweep, out, workers, watcher)
    }
}

/// Opens the sweep in the folder, which must be the given one.
fn open_same(
    worlds: &Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    let folder = Folder::open(out)?;
    let (plan, fingerprints) = prepare(worlds, sweep, workers, watcher, &|_, source, compiled| {
        let ResolvedScenario { text, files } = compiled.resolve(source)?;
        Ok(fingerprint(text.as_bytes(), &files))
    })?;
    let manifest = folder.manifest();
    if (&plan, &fingerprints) == (&manifest.plan, &manifest.fingerprints) {
        check_build(worlds, &folder)?;
        return Ok(folder);
    }
    let resume = sidestep_command("resume", out);
    let remedy = format!("give another folder, or continue the sweep in this one: `{resume}`");
    Err(InputError::new(out.display(), "the folder holds another sweep", remedy).into())
}

/// Runs all trials that are not finished, and joins all runs into one table.
///
/// # Errors
/// When runs cannot be read or stored.
pub fn run_remaining<'a>(
    worlds: &Worlds,
    folder: &Folder,
    engine: impl Into<Engine<'a>>,
    watcher: &dyn Watcher,
) -> Result<SweepEnd, Error> {
    if folder.is_complete() {
        return SweepResult::read(folder);
    }
    check_build(worlds, folder)?;
    let keeps_series = folder.plan().keeps_series();
    let mut scheduler = TrialScheduler::new(folder.plan());
    // The journal of this share is read when it is locked, below: until then another process may append to it.
    for_each_outcome(folder, Some(Shard::ALL), |outcome| scheduler.record(&outcome))?;
    let mut effort = SweepTiming::default();
    // Locked until everything is joined, so that no other process begins to join.
    let mut journal = folder.journal(to_share(Shard::ALL), |outcome: Outcome| {
        scheduler.record(&outcome);
    })?;
    if let Some(journal) = &mut journal {
        with_trial_runner(worlds, folder, engine.into(), watcher, |runner| {
            effort = scheduler
                .run_all(runner, &mut |outcome| {
                    let kept = kept_outcome(outcome, keeps_series);
                    Ok(journal.append(&TimestampedOutcome::now(&kept))?)
                })
                .map_err(|e| with_resume_hint(e, folder.path()))?;
            Ok(())
        })?;
        journal.sync().map_err(|e| with_resume_hint(e.into(), folder.path()))?;
    }
    if !watcher.should_continue() {
        return Ok(SweepEnd::Interrupted(scheduler.finished.len()));
    }
    join_runs(folder, BUCKET_TRIALS, effort, watcher)
}

/// Joins all runs into the sweep's tables, in blocks of a number of trials: only one block is in memory at a time. An error
/// of storage says how to go on.
fn join_runs(
    folder: &Folder,
    trials: u64,
    effort: SweepTiming,
    watcher: &dyn Watcher,
) -> Result<SweepEnd, Error> {
    join_blocks(folder, trials, effort, watcher).map_err(|e| with_resume_hint(e, folder.path()))
}

fn join_blocks(
    folder: &Folder,
    trials: u64,
    effort: SweepTiming,
    watcher: &dyn Watcher,
) -> Result<SweepEnd, Error> {
    let watched = ProgressGuard(watcher);
    watched.report(Progress::Stage { what: "joining the runs", share: 0.0 });
    let mut buckets = OutcomeBuckets::new(folder, trials)?;
    for_each_outcome(folder, None, |outcome| buckets.push(&outcome))?;
    watched.report(Progress::Stage { what: "writing the results", share: 0.5 });
    let mut writer: Option<ResultsWriter> = None;
    let mut only_block = None;
    let planned = folder.plan().len().max(1) as f64;
    let mut written = 0;
    buckets.for_each_block(|block| {
        let series = block.series();
        let columns = ResultColumns {
            results: &block.results(),
            timings: &block.timings(),
            series: &series.columns.iter().collect::<Vec<_>>(),
        };
        let writer = match &mut writer {
            Some(writer) => writer,
            // All blocks have the columns of the first one, so they are known from it.
            None => writer.insert(folder.results_writer(&columns)?),
        };
        writer.append(&columns)?;
        written += block.runs();
        let share = 0.5 + 0.5 * (written as f64 / planned).min(1.0);
        watched.report(Progress::Stage { what: "writing the results", share });
        only_block = (written == block.runs()).then_some(block);
        Ok(())
    })?;
    if let Some(writer) = writer {
        writer.finish()?;
    }
    // A table of several blocks is read again once the data that joined them is out of memory.
    match only_block {
        Some(table) => Ok(SweepResult::complete(table, effort)),
        None => {
            let FinishedRuns { table, series, .. } = read_finished(folder)?;
            Ok(SweepEnd::Done(SweepResult { table, series, effort, was_done: false }))
        }
    }
}

/// Runs one share of the trials and writes its part.
///
/// # Errors
/// When the sweep stops at a precision or is of another build, or runs cannot be read or stored.
pub fn run_share(
    worlds: &Worlds,
    folder: &Folder,
    shard: Shard,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<SweepEnd, Error> {
    check_build(worlds, folder)?;
    refuse_precision(folder)?;
    let plan = folder.plan();
    let keeps_series = plan.keeps_series();
    if folder.is_complete() {
        return Ok(SweepResult::already_complete(finished_in_share(folder, shard)?));
    }
    let mut scheduler = TrialScheduler::new(plan);
    let mut rows = RunTableBuilder::default();
    let journal = folder.journal(to_share(shard), |outcome: Outcome| {
        scheduler.record(&outcome);
        rows.push(&outcome);
    })?;
    // A share that is done has no journal.
    let Some(mut journal) = journal else {
        return Ok(SweepResult::already_complete(finished_in_share(folder, shard)?));
    };
    // Shares of another count, or a sweep that continued here, may have finished some of these
    // runs.
    let mut elsewhere = BTreeSet::new();
    for_each_outcome(folder, Some(shard), |outcome| _ = elsewhere.insert(outcome.trial))?;
    let trials: Vec<Trial> =
        plan.shard_trials(shard).filter(|trial| !elsewhere.contains(&trial.id)).collect();
    let mut effort = SweepTiming::default();
    with_trial_runner(worlds, folder, workers.into(), watcher, |runner| {
        effort = scheduler
            .run(runner, &trials, &mut |outcome| {
                let kept = kept_outcome(outcome, keeps_series);
                journal.append(&TimestampedOutcome::now(&kept))?;
                rows.push(&kept);
                Ok(())
            })
            .map_err(|e| with_resume_hint(e, folder.path()))?;
        Ok(())
    })?;
    let with_hint = |e: RecordError| with_resume_hint(e.into(), folder.path());
    journal.sync().map_err(with_hint)?;
    if !watcher.should_continue() {
        return Ok(SweepEnd::Interrupted(scheduler.finished.len()));
    }
    let table = rows.build(plan)?;
    let columns: Vec<_> = table.columns.iter().collect();
    folder.finish_share(to_share(shard), journal, &columns).map_err(with_hint)?;
    Ok(SweepResult::complete(table, effort))
}

fn refuse_precision(folder: &Folder) -> Result<(), InputError> {
    if folder.plan().until.is_none() {
        return Ok(());
    }
    let cause =
        "a sweep with a target precision cannot be sharded: its stopping rule needs all runs";
    let resume = sidestep_command("resume", folder.path());
    let remedy = format!("run it in one process with `{resume}`, or plan it with --replicate");
    Err(InputError::new(folder.path().display(), cause, remedy))
}

/// Returns the finished runs of the trials of a share, whichever process finished them.
fn finished_in_share(folder: &Folder, shard: Shard) -> Result<RunTable, Error> {
    let own: BTreeSet<u64> = folder.plan().shard_trials(shard).map(|trial| trial.id).collect();
    let mut rows = RunTableBuilder::default();
    let push_own = |outcome: Outcome| {
        if own.contains(&outcome.trial) {
            rows.push(&outcome);
        }
    };
    if folder.is_complete() {
        to_run_table(folder.results()?).for_each_outcome(push_own);
    } else {
        for_each_outcome(folder, None, push_own)?;
    }
    Ok(rows.build(folder.plan())?)
}

/// Joins the shares into one table.
///
/// # Errors
/// When runs are missing, cannot be read or stored, or are of another build.
pub fn collect(worlds: &Worlds, folder: &Folder, watcher: &dyn Watcher) -> Result<SweepEnd, Error> {
    if folder.is_complete() {
        return SweepResult::read(folder);
    }
    check_build(worlds, folder)?;
    let plan = folder.plan();
    let mut scheduler = TrialScheduler::new(plan);
    for_each_outcome(folder, None, |outcome| scheduler.record(&outcome))?;
    // Where a precision ends the sweep, how many runs come after the next round is not known.
    let missing = if scheduler.rounds.is_some() {
        scheduler.next_trials().len()
    } else {
        scheduler.missing_trials().len()
    };
    if missing > 0 {
        let cause = format!("{missing} of {} runs are missing", plan.runs());
        let resume = sidestep_command("resume", folder.path());
        let remedy = format!(
            "run the shares that are not finished (finished ones are not run again), or run the rest here: \
             `{resume}`"
        );
        return Err(Error::other(cause, remedy));
    }
    join_runs(folder, BUCKET_TRIALS, SweepTiming::default(), watcher)
}

/// Returns an outcome without its metrics over time where the sweep has too many runs to keep them.
fn kept_outcome(outcome: &Outcome, keeps_series: bool) -> Cow<'_, Outcome> {
    if keeps_series || outcome.series.is_empty() {
        return Cow::Borrowed(outcome);
    }
    Cow::Owned(Outcome { series: Map::new(), ..outcome.clone() })
}

/// Passes on everything needed to run the trials of a folder.
fn with_trial_runner(
    worlds: &Worlds,
    folder: &Folder,
    engine: Engine<'_>,
    watcher: &dyn Watcher,
    run: impl FnOnce(&TrialRunner<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    let plan = folder.plan();
    if plan.record && matches!(engine, Engine::Executor(_)) {
        let cause = "its runs are recorded in its folder, which others cannot write to";
        let remedy = "run it on threads of this process, or sweep without recording";
        return Err(InputError::new(folder.path().display(), cause, remedy).into());
    }
    let checked: Vec<AtomicBool> = plan.variants.iter().map(|_| AtomicBool::new(false)).collect();
    let source = |variant: u32| read_checked_variant(folder, variant, &checked[variant as usize]);
    let run_folder = |trial: u64| -> PathBuf { folder.run_folder(trial) };
    let record: Option<&(dyn Fn(u64) -> PathBuf + Sync)> =
        if plan.record { Some(&run_folder) } else { None };
    let agents = plan.agents;
    let series = plan.series.as_deref();
    run(&TrialRunner { worlds, agents, source: &source, record, series, engine, watcher })
}

/// Reads the scenario of a variant, checked when it is read for the first time: one that was edited since the plan was
/// made would make runs of another sweep. Two threads may both check it, which does no harm.
fn read_checked_variant(
    folder: &Folder,
    variant: u32,
    is_checked: &AtomicBool,
) -> Result<Source, InputError> {
    if !is_checked.load(Ordering::Relaxed) {
        folder.check_variant(variant)?;
        is_checked.store(true, Ordering::Relaxed);
    }
    Source::read(&folder.scenario(variant), &[])
}

/// Adds to a storage error the runs that are saved, and words for continuing.
fn with_resume_hint(error: Error, folder: &Path) -> Error {
    match error {
        Error::Record(error) => {
            let resume = sidestep_command("resume", folder);
            let remedy =
                format!("free some space; the finished runs are saved, continue with `{resume}`");
            Error::other(error.to_string(), remedy)
        }
        other => other,
    }
}

/// The finished runs, as far as needed to choose the next ones: a number for each.
struct TrialScheduler<'a> {
    plan: &'a Plan,
    finished: Vec<u64>,
    rounds: Option<Rounds<'a>>,
    pilots: PilotRuns<'a>,
}

/// Stores an outcome, if there is a place for it.
type OutcomeWriter<'a> = dyn FnMut(&Outcome) -> Result<(), Error> + Send + 'a;

impl<'a> TrialScheduler<'a> {
    fn new(plan: &'a Plan) -> Self {
        let rounds = plan.until.as_ref().map(|until| Rounds::new(plan, until));
        Self { plan, finished: Vec::new(), rounds, pilots: PilotRuns::new(plan) }
    }

    fn record(&mut self, outcome: &Outcome) {
        if let Some(rounds) = &mut self.rounds {
            rounds.add(outcome);
        }
        self.pilots.add(outcome);
        self.finished.push(outcome.trial);
    }

    /// Returns the trials to run next: of the next round, or all, pilots first.
    fn next_trials(&self) -> Vec<Trial> {
        match &self.rounds {
            Some(rounds) => rounds.next_trials(),
            None => self.pilots.next_trials(self.missing_trials()),
        }
    }

    /// Returns the trials of a fixed number of runs that are not finished.
    fn missing_trials(&self) -> Vec<Trial> {
        let trials = self.plan.shard_trials(Shard::ALL);
        self.unfinished_of(trials.filter(|trial| self.pilots.needs(trial)))
    }

    fn unfinished_of(&self, trials: impl Iterator<Item = Trial>) -> Vec<Trial> {
        let mut finished = self.finished.clone();
        finished.sort_unstable();
        trials.filter(|trial| finished.binary_search(&trial.id).is_err()).collect()
    }

    /// Runs all open trials, round by round if a precision ends the sweep.
    fn run_all(
        &mut self,
        runner: &TrialRunner<'_>,
        keep: &mut OutcomeWriter<'_>,
    ) -> Result<SweepTiming, Error> {
        let mut effort = SweepTiming::default();
        loop {
            let open = self.next_trials();
            if open.is_empty() || !runner.watcher.should_continue() {
                return Ok(effort);
            }
            effort.add(self.run(runner, &open, keep)?);
        }
    }

    /// Runs the trials that are not finished.
    fn run(
        &mut self,
        runner: &TrialRunner<'_>,
        trials: &[Trial],
        keep: &mut OutcomeWriter<'_>,
    ) -> Result<SweepTiming, Error> {
        let open = self.unfinished_of(trials.iter().copied());
        let before = self.finished.len() as u64;
        let mut effort = SweepTiming::start();
        let accept: &mut OutcomeHandler<'_> = &mut |outcome: Outcome| {
            // Stored first: an outcome that could not be stored does not count as finished.
            keep(&outcome)?;
            effort.record(&outcome);
            self.record(&outcome);
            Ok(())
        };
        runner.run(&open, before, before + open.len() as u64, accept)?;
        effort.stop(runner.parallelism(open.len()));
        Ok(effort)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoWatcher;
    use crate::testing::WORLDS;
    use serde_json::json;
    use sidestep_experiment::sweep::Factor;
    use sidestep_record::sweep::Share;

    /// A planned sweep of two times 300 runs, all of them in journals of two shares: made up, and in no order.
    fn folder(place: &Path) -> Folder {
        let text =
            "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"random\"\nn = 2\n";
        let mut sweep = Sweep::from_source(Source::new("s.toml", text, place));
        sweep.design.factors = vec![Factor::parse("airspace.generator.n=2,3").expect("valid")];
        sweep.replicates = 300;
        let folder = create(&WORLDS, &sweep, &place.join("sweep"), 2, &NoWatcher).expect("planned");
        let mut trials: Vec<Trial> = folder.plan().shard_trials(Shard::ALL).collect();
        trials.sort_by_key(|trial| trial.id.wrapping_mul(2_654_435_761) % 1009);
        for index in 0..2 {
            let share = Share { index, count: 2 };
            let mut journal =
                folder.journal(share, |_: Outcome| ()).expect("opened").expect("open");
            for trial in trials.iter().filter(|trial| trial.id % 2 == u64::from(index)) {
                journal.append(&outcome(*trial)).expect("written");
            }
        }
        folder
    }

    /// Columns that come and go, and one with a type that only a late trial reveals.
    fn outcome(trial: Trial) -> Outcome {
        let value = if trial.id == 555 { json!(0.5) } else { json!(trial.id) };
        let mut metrics = serde_json::Map::from_iter([("wide".to_string(), value)]);
        if trial.id > 400 {
            metrics.insert("late".into(), json!(trial.id.is_multiple_of(3)));
        }
        let costs = serde_json::Map::from_iter([("run_wall_s".to_string(), json!(0.25))]);
        let (digest, failure) = (format!("end {}", trial.id), None);
        let series = serde_json::Map::from_iter([
            ("cycle".to_string(), json!("3,6")),
            ("arrived".to_string(), json!(format!("{},", trial.id))),
        ]);
        let from = Outcome::from_failure(trial, "");
        Outcome { metrics, costs, digest, failure, series, cycles: 7, ..from }
    }

    #[test]
    fn runs_joined_in_blocks_give_the_files_that_all_at_once_give() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = folder(place.path());
        let tables = |trials| {
            let ended =
                join_runs(&folder, trials, SweepTiming::default(), &NoWatcher).expect("joined");
            let SweepEnd::Done(done) = ended else { panic!("nobody interrupts") };
            let file = read_finished(&folder).expect("it is done");
            std::fs::remove_file(folder.results_file()).expect("there");
            assert_eq!(done.table, file.table, "{trials} trials at a time");
            assert_eq!(done.series, file.series, "{trials} trials at a time");
            (file.table, file.series)
        };
        let whole = tables(BUCKET_TRIALS);
        assert_eq!((whole.0.runs(), whole.1.runs()), (600, 1200));
        for trials in [1000, 600, 599, 64, 7] {
            assert_eq!(tables(trials), whole, "{trials} trials at a time");
        }
        assert!(!folder.path().join("joining.partial").exists());
    }

    #[test]
    fn no_more_rows_are_in_memory_than_a_block_has_trials() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = folder(place.path());
        let mut piles = OutcomeBuckets::new(&folder, 50).expect("room");
        for_each_outcome(&folder, None, |outcome| piles.push(&outcome)).expect("read");
        let mut sizes = Vec::new();
        piles
            .for_each_block(|block| {
                sizes.push(block.runs());
                Ok(())
            })
            .expect("joined");
        assert_eq!(sizes, [50; 12]);
    }
}
