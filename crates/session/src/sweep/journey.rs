//! The path from a sweep to the table of its runs: in memory, in a folder, or share by share.

use super::crew::Engine;
use super::effort::Effort;
use super::gather::{Folder, check_build, gather, share_of, table_of};
use super::look::finished;
use super::piles::{PILE, Piles};
use super::prepare::{Make, prepare};
use super::stamped::Stamped;
use super::work::{Take, Work};
use crate::identity::build;
use crate::watcher::{Progress, Watched};
use crate::{Error, Watcher};
use sidestep::VERSION;
use sidestep::experiment::sweep::rounds::Rounds;
use sidestep::experiment::sweep::seeds::Trials;
use sidestep::experiment::sweep::{Cell, Outcome, Plan, Rows, RunTable, Shard, Sweep, rows::cells};
use sidestep::kernel::InputError;
use sidestep::scenario::{Resolved, Source, Worlds};
use sidestep_record::sweep::{Completion, fingerprint};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The result of working on a sweep, or on a share of one.
pub enum Ended {
    /// All of its runs are finished.
    Done(Done),
    /// The watcher asked to stop; this many runs are finished.
    Interrupted(usize),
}

/// Finished runs.
pub struct Done {
    /// One row per run.
    pub table: RunTable,
    /// The time that they took in this process.
    pub effort: Effort,
    /// Whether all were already finished before.
    pub was_done: bool,
}

impl Done {
    fn now(table: RunTable, effort: Effort) -> Ended {
        Ended::Done(Self { table, effort, was_done: false })
    }

    fn before(table: RunTable) -> Ended {
        Ended::Done(Self { table, effort: Effort::default(), was_done: true })
    }
}

/// Runs a sweep in memory, without writing anything.
///
/// # Errors
/// When the sweep is wrong, or the watcher asks to stop before the first run.
pub fn in_memory<'a>(
    worlds: Worlds,
    sweep: &Sweep,
    engine: impl Into<Engine<'a>>,
    watcher: &dyn Watcher,
) -> Result<(Plan, Ended), Error> {
    if sweep.record {
        let cause = "there is no folder to record runs to";
        return Err(InputError::new("--record-runs", cause, "name one with --out").into());
    }
    let engine = engine.into();
    let make: Make<'_, Source> = &|_, source, _| Ok(source.clone());
    let (plan, sources) = prepare(worlds, sweep, engine.planners(), watcher, make)?;
    let source = |variant: u32| Ok(sources[variant as usize].clone());
    let agents = plan.agents;
    let work = Work { worlds, agents, source: &source, record: None, engine, watcher };
    let (mut log, mut rows) = (Log::new(&plan), Rows::default());
    let effort = log.run_all(&work, &mut |outcome| {
        rows.push(outcome);
        Ok(())
    })?;
    let ended = match watcher.go_on() {
        true => Done::now(rows.table(&plan)?, effort),
        false => Ended::Interrupted(log.finished.len()),
    };
    Ok((plan, ended))
}

/// Plans a sweep into a folder, on a number of workers: completely or not at all.
///
/// # Errors
/// When the sweep is wrong, or the folder is taken.
pub fn planned(
    worlds: Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    Folder::create(out, VERSION, build(), |staging| {
        let (plan, fingerprints) =
            prepare(worlds, sweep, workers, watcher, &|k, source, compiled| {
                let Resolved { text, files } = compiled.resolve(source)?;
                Folder::write_variant(staging, k, &text, &files)?;
                Ok(fingerprint(text.as_bytes(), &files))
            })?;
        let cells = cells(&plan).columns;
        Ok::<_, Error>((plan, fingerprints, cells))
    })
}

/// Plans a sweep into a folder, or opens the folder if it holds the same sweep already.
///
/// # Errors
/// When the sweep is wrong, or the folder holds something else, or is of another build.
pub fn planned_or_there(
    worlds: Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    match Folder::is_at(out) {
        false => planned(worlds, sweep, out, workers, watcher),
        true => the_same(worlds, sweep, out, workers, watcher),
    }
}

/// Opens the sweep in the folder, which must be the given one.
fn the_same(
    worlds: Worlds,
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    let folder = Folder::open(out)?;
    let (plan, fingerprints) = prepare(worlds, sweep, workers, watcher, &|_, source, compiled| {
        let Resolved { text, files } = compiled.resolve(source)?;
        Ok(fingerprint(text.as_bytes(), &files))
    })?;
    let manifest = folder.manifest();
    if (&plan, &fingerprints) == (&manifest.plan, &manifest.fingerprints) {
        check_build(&folder)?;
        return Ok(folder);
    }
    let there = out.display();
    let remedy =
        format!("name another folder, or go on with what is there: sidestep resume {there}");
    Err(InputError::new(there, "the folder holds another sweep", remedy).into())
}

/// Runs all cells that are not finished, and joins all runs into one table.
///
/// # Errors
/// When runs cannot be read or stored.
pub fn go_on<'a>(
    worlds: Worlds,
    folder: &Folder,
    engine: impl Into<Engine<'a>>,
    watcher: &dyn Watcher,
) -> Result<Ended, Error> {
    if folder.is_complete() {
        return Ok(Done::before(table_of(folder.results()?)));
    }
    check_build(folder)?;
    let mut log = Log::new(folder.plan());
    gather(folder, Some(Shard::ALL), |outcome| log.note(&outcome))?;
    let mut effort = Effort::default();
    // Locked until everything is joined, so that no other process begins to join.
    let mut journal = folder.journal(share_of(Shard::ALL), |o: Outcome| log.note(&o))?;
    if let Some(journal) = &mut journal {
        with_work(worlds, folder, engine.into(), watcher, |work| {
            let mut keep = |outcome: &Outcome| Ok(journal.append(&Stamped::now(outcome))?);
            effort = log.run_all(work, &mut keep).map_err(|e| saved(e, folder.path()))?;
            Ok(())
        })?;
        journal.sync()?;
    }
    if !watcher.go_on() {
        return Ok(Ended::Interrupted(log.finished.len()));
    }
    joined(folder, PILE, effort, watcher)
}

/// Joins all runs into the sweep's tables, in blocks of a number of cells: only one block is in memory at a time.
fn joined(
    folder: &Folder,
    cells: u64,
    effort: Effort,
    watcher: &dyn Watcher,
) -> Result<Ended, Error> {
    let watched = Watched(watcher);
    watched.at(Progress::Stage { what: "joining the runs", share: 0.0 });
    let mut piles = Piles::new(folder, cells)?;
    gather(folder, None, |outcome| piles.put(&outcome))?;
    watched.at(Progress::Stage { what: "writing the results", share: 0.5 });
    let (mut completion, mut only) = (None::<Completion>, None);
    let of = folder.plan().len().max(1) as f64;
    let mut written = 0;
    piles.blocks(|block| {
        let (results, timings) = (block.results(), block.timings());
        let completion = match &mut completion {
            Some(completion) => completion,
            begun => begun.insert(folder.completion(&results, &timings)?),
        };
        completion.append(&results, &timings)?;
        written += block.runs();
        let share = 0.5 + 0.5 * (written as f64 / of).min(1.0);
        watched.at(Progress::Stage { what: "writing the results", share });
        only = (written == block.runs()).then_some(block);
        Ok(())
    })?;
    completion.map_or(Ok(()), Completion::finish)?;
    // A table of several blocks is read again once the data that joined them is out of memory.
    let table = match only {
        Some(table) => table,
        None => finished(folder)?.table,
    };
    Ok(Done::now(table, effort))
}

/// Runs one share of the cells and writes its part.
///
/// # Errors
/// When the sweep stops at a precision or is of another build, or runs cannot be read or stored.
pub fn share(
    worlds: Worlds,
    folder: &Folder,
    shard: Shard,
    workers: usize,
    watcher: &dyn Watcher,
) -> Result<Ended, Error> {
    check_build(folder)?;
    let plan = folder.plan();
    if plan.until.is_some() {
        let cause = "this sweep stops by its precision, which takes all runs to be seen";
        let remedy =
            "run it in one process with `sidestep resume DIR`, or plan it with --replicate";
        return Err(InputError::new(folder.path().display(), cause, remedy).into());
    }
    let (mut log, mut rows) = (Log::new(plan), Rows::default());
    let mut note = |outcome: Outcome| {
        log.note(&outcome);
        rows.push(&outcome);
    };
    let journal = match folder.is_complete() {
        true => None,
        false => folder.journal(share_of(shard), &mut note)?,
    };
    let Some(mut journal) = journal else {
        return Ok(Done::before(finished_of(folder, shard)?));
    };
    // Shares of another count, or a sweep that continued here, may have finished some of these
    // runs.
    let mut elsewhere = BTreeSet::new();
    gather(folder, Some(shard), |outcome| _ = elsewhere.insert(outcome.cell))?;
    let cells: Vec<Cell> = plan.share(shard).filter(|c| !elsewhere.contains(&c.id)).collect();
    let mut effort = Effort::default();
    with_work(worlds, folder, workers.into(), watcher, |work| {
        let mut keep = |outcome: &Outcome| {
            journal.append(&Stamped::now(outcome))?;
            rows.push(outcome);
            Ok(())
        };
        effort = log.run(work, &cells, &mut keep).map_err(|e| saved(e, folder.path()))?;
        Ok(())
    })?;
    journal.sync()?;
    if !watcher.go_on() {
        return Ok(Ended::Interrupted(log.finished.len()));
    }
    let table = rows.table(plan)?;
    folder.end_share(share_of(shard), journal, &table.columns.iter().collect::<Vec<_>>())?;
    Ok(Done::now(table, effort))
}

/// Returns the finished runs of the cells of a share, regardless of their maker.
fn finished_of(folder: &Folder, shard: Shard) -> Result<RunTable, Error> {
    let own: BTreeSet<u64> = folder.plan().share(shard).map(|c| c.id).collect();
    let mut rows = Rows::default();
    let mut take = |outcome: Outcome| {
        if own.contains(&outcome.cell) {
            rows.push(&outcome);
        }
    };
    match folder.is_complete() {
        true => table_of(folder.results()?).outcomes(&mut take),
        false => gather(folder, None, &mut take)?,
    }
    Ok(rows.table(folder.plan())?)
}

/// Joins the shares into one table.
///
/// # Errors
/// When runs are missing, cannot be read or stored, or are of another build.
pub fn collect(folder: &Folder, watcher: &dyn Watcher) -> Result<Ended, Error> {
    if folder.is_complete() {
        return Ok(Done::before(table_of(folder.results()?)));
    }
    check_build(folder)?;
    let plan = folder.plan();
    let mut log = Log::new(plan);
    gather(folder, None, |outcome| log.note(&outcome))?;
    let missing = if log.rounds.is_some() { log.open() } else { log.missing() }.len();
    if missing > 0 {
        let cause = format!("{missing} of {} runs are missing", plan.runs());
        let remedy = "run the shares that are not finished (finished ones are not run again), or \
                      run the rest here: sidestep resume DIR";
        return Err(Error::stopped(cause, remedy));
    }
    joined(folder, PILE, Effort::default(), watcher)
}

/// Passes on everything needed to run the cells of a folder.
fn with_work(
    worlds: Worlds,
    folder: &Folder,
    engine: Engine<'_>,
    watcher: &dyn Watcher,
    run: impl FnOnce(&Work<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    let plan = folder.plan();
    if plan.record && matches!(engine, Engine::Crew(_)) {
        let cause = "its runs are recorded in its folder, which others cannot write to";
        let remedy = "run it on threads of this process, or sweep without recording";
        return Err(InputError::new(folder.path().display(), cause, remedy).into());
    }
    let checked: Vec<AtomicBool> = plan.variants.iter().map(|_| AtomicBool::new(false)).collect();
    let source = |variant: u32| {
        // A scenario that was edited in between would make runs of another sweep.
        let checked = &checked[variant as usize];
        if !checked.load(Ordering::Relaxed) {
            folder.check_variant(variant)?;
            checked.store(true, Ordering::Relaxed);
        }
        Source::read(&folder.scenario(variant), &[])
    };
    let place = |cell: u64| -> PathBuf { folder.run_folder(cell) };
    let record: Option<&(dyn Fn(u64) -> PathBuf + Sync)> =
        if plan.record { Some(&place) } else { None };
    run(&Work { worlds, agents: plan.agents, source: &source, record, engine, watcher })
}

/// Adds to a storage error the runs that are saved, and words for continuing.
fn saved(error: Error, folder: &Path) -> Error {
    match error {
        Error::Record(error) => {
            let remedy = "make room; the finished runs are saved, go on with: sidestep resume";
            Error::stopped(error.to_string(), format!("{remedy} {}", folder.display()))
        }
        other => other,
    }
}

/// The finished runs, as far as needed to choose the next ones: a number for each.
struct Log<'a> {
    plan: &'a Plan,
    finished: Vec<u64>,
    rounds: Option<Rounds<'a>>,
    trials: Trials<'a>,
}

/// Stores an outcome, if there is a place for it.
type Keep<'a> = dyn FnMut(&Outcome) -> Result<(), Error> + Send + 'a;

impl<'a> Log<'a> {
    fn new(plan: &'a Plan) -> Self {
        let rounds = plan.until.as_ref().map(|until| Rounds::new(plan, until));
        Self { plan, finished: Vec::new(), rounds, trials: Trials::new(plan) }
    }

    fn note(&mut self, outcome: &Outcome) {
        if let Some(rounds) = &mut self.rounds {
            rounds.note(outcome);
        }
        self.trials.note(outcome);
        self.finished.push(outcome.cell);
    }

    /// Returns the cells to run next: of the next round, or all, trials first.
    fn open(&self) -> Vec<Cell> {
        match &self.rounds {
            Some(rounds) => rounds.next(),
            None => self.trials.first_of(self.missing()),
        }
    }

    /// Returns the cells of a fixed number of runs that are not finished.
    fn missing(&self) -> Vec<Cell> {
        let cells = self.plan.share(Shard::ALL);
        self.unfinished(cells.filter(|cell| self.trials.asks_for(cell)))
    }

    fn unfinished(&self, cells: impl Iterator<Item = Cell>) -> Vec<Cell> {
        let mut finished = self.finished.clone();
        finished.sort_unstable();
        cells.filter(|cell| finished.binary_search(&cell.id).is_err()).collect()
    }

    /// Runs all open cells, round by round if a precision ends the sweep.
    fn run_all(&mut self, work: &Work<'_>, keep: &mut Keep<'_>) -> Result<Effort, Error> {
        let mut effort = Effort::default();
        loop {
            let open = self.open();
            if open.is_empty() || !work.watcher.go_on() {
                return Ok(effort);
            }
            effort.add(self.run(work, &open, keep)?);
        }
    }

    /// Runs the cells that are not finished.
    fn run(
        &mut self,
        work: &Work<'_>,
        cells: &[Cell],
        keep: &mut Keep<'_>,
    ) -> Result<Effort, Error> {
        let open = self.unfinished(cells.iter().copied());
        let before = self.finished.len() as u64;
        let mut effort = Effort::begin();
        let mut take = |outcome: Outcome| {
            keep(&outcome)?;
            effort.note(&outcome);
            self.note(&outcome);
            Ok(())
        };
        let take: &mut Take<'_> = &mut take;
        let ran = work.run(&open, before, before + open.len() as u64, take);
        effort.end(work.at_once(open.len()));
        ran.map(|()| effort)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;
    use serde_json::json;
    use sidestep::experiment::sweep::Factor;
    use sidestep::worlds::WORLDS;
    use sidestep_record::sweep::Share;

    /// A planned sweep of two times 300 runs, all of them in journals of two shares: made up, and in no order.
    fn folder(place: &Path) -> Folder {
        let text =
            "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"random\"\nn = 2\n";
        let mut sweep = Sweep::of_source(Source::new("s.toml", text, place));
        sweep.design.factors = vec![Factor::parse("airspace.generator.n=2,3").expect("valid")];
        sweep.replicates = 300;
        let folder = planned(WORLDS, &sweep, &place.join("sweep"), 2, &Unwatched).expect("planned");
        let mut cells: Vec<Cell> = folder.plan().share(Shard::ALL).collect();
        cells.sort_by_key(|cell| cell.id.wrapping_mul(2_654_435_761) % 1009);
        for index in 0..2 {
            let share = Share { index, count: 2 };
            let mut journal =
                folder.journal(share, |_: Outcome| ()).expect("opened").expect("open");
            for cell in cells.iter().filter(|cell| cell.id % 2 == u64::from(index)) {
                journal.append(&outcome(*cell)).expect("written");
            }
        }
        folder
    }

    /// Columns that come and go, and one with a type that only a late cell reveals.
    fn outcome(cell: Cell) -> Outcome {
        let value = if cell.id == 555 { json!(0.5) } else { json!(cell.id) };
        let mut metrics = serde_json::Map::from_iter([("wide".to_string(), value)]);
        if cell.id > 400 {
            metrics.insert("late".into(), json!(cell.id.is_multiple_of(3)));
        }
        let costs = serde_json::Map::from_iter([("run_wall_s".to_string(), json!(0.25))]);
        let (digest, failure) = (format!("end {}", cell.id), None);
        Outcome { metrics, costs, digest, failure, cycles: 7, ..Outcome::failed(cell, "") }
    }

    #[test]
    fn runs_joined_in_blocks_give_the_files_that_all_at_once_give() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = folder(place.path());
        let tables = |cells| {
            let ended = joined(&folder, cells, Effort::default(), &Unwatched).expect("joined");
            let Ended::Done(done) = ended else { panic!("nobody interrupts") };
            let file = finished(&folder).expect("it is done");
            std::fs::remove_file(folder.results_file()).expect("there");
            assert_eq!(done.table, file.table, "{cells} cells at a time");
            file.table
        };
        let whole = tables(PILE);
        assert_eq!(whole.runs(), 600);
        for cells in [1000, 600, 599, 64, 7] {
            assert_eq!(tables(cells), whole, "{cells} cells at a time");
        }
        assert!(!folder.path().join("joining.partial").exists());
    }

    #[test]
    fn no_more_rows_are_in_memory_than_a_block_has_cells() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = folder(place.path());
        let mut piles = Piles::new(&folder, 50).expect("room");
        gather(&folder, None, |outcome| piles.put(&outcome)).expect("read");
        let mut sizes = Vec::new();
        piles
            .blocks(|block| {
                sizes.push(block.runs());
                Ok(())
            })
            .expect("joined");
        assert_eq!(sizes, [50; 12]);
    }
}
