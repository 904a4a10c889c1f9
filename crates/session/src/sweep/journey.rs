//! From a sweep to the table of its runs: in memory, in a folder, or share by share.

use super::crew::Engine;
use super::effort::Effort;
use super::prepare::prepare;
use super::stamped::Stamped;
use super::work::{Take, Work};
use crate::identity::Maker;
use crate::identity::build;
use crate::watcher::{Progress, Watched};
use crate::{Error, Watcher};
use sidestep::VERSION;
use sidestep::experiment::sweep::rounds::Rounds;
use sidestep::experiment::sweep::seeds::Trials;
use sidestep::experiment::sweep::{
    Cell, Outcome, Plan, Role, Rows, RunTable, Shard, Sweep, rows::cells,
};
use sidestep::kernel::InputError;
use sidestep::scenario::{Source, Worlds};
use sidestep_record::WholeTable;
use sidestep_record::sweep::{Share, SweepFolder, fingerprint};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The folder of a sweep.
pub type Folder = SweepFolder<Plan>;

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
    /// Whether they were finished already.
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
    let mut sources: Vec<Source> = Vec::new();
    let plan = prepare(worlds, sweep, watcher, |_, source, _| {
        sources.push(source.clone());
        Ok(())
    })?;
    let source = |variant: u32| Ok(sources[variant as usize].clone());
    let (agents, engine) = (plan.agents, engine.into());
    let work = Work { worlds, agents, source: &source, record: None, engine, watcher };
    let mut log = Log::new(&plan);
    let effort = log.run_all(&work, &mut |_| Ok(()))?;
    let ended = match watcher.go_on() {
        true => Done::now(log.rows.table(&plan)?, effort),
        false => Ended::Interrupted(log.rows.len()),
    };
    Ok((plan, ended))
}

/// Plans a sweep into a folder: completely or not at all.
///
/// # Errors
/// When the sweep is wrong, or the folder is taken.
pub fn planned(
    worlds: Worlds,
    sweep: &Sweep,
    out: &Path,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    Folder::create(out, VERSION, build(), |staging| {
        let mut fingerprints = Vec::new();
        let plan = prepare(worlds, sweep, watcher, |k, source, compiled| {
            let resolved = compiled.resolve(source)?;
            fingerprints.push(fingerprint(resolved.text.as_bytes(), &resolved.files));
            Ok(Folder::write_variant(staging, k, &resolved.text, &resolved.files)?)
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
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    match Folder::is_at(out) {
        false => planned(worlds, sweep, out, watcher),
        true => the_same(worlds, sweep, out, watcher),
    }
}

/// Opens the sweep in the folder, which must be this one.
fn the_same(
    worlds: Worlds,
    sweep: &Sweep,
    out: &Path,
    watcher: &dyn Watcher,
) -> Result<Folder, Error> {
    let folder = Folder::open(out)?;
    let mut fingerprints = Vec::new();
    let plan = prepare(worlds, sweep, watcher, |_, source, compiled| {
        let resolved = compiled.resolve(source)?;
        fingerprints.push(fingerprint(resolved.text.as_bytes(), &resolved.files));
        Ok(())
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

/// Refuses another build: results may change between builds, so only one makes all runs.
fn check_build(folder: &Folder) -> Result<(), InputError> {
    let manifest = folder.manifest();
    let maker = Maker { version: manifest.program_version.clone(), build: manifest.build.clone() };
    maker.check(folder.path(), "sweep", |wrote| {
        format!("go on with sidestep {wrote}, or sweep into a new folder")
    })
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
    gather(folder, Some(Shard::ALL), |outcome| log.note(outcome))?;
    let mut effort = Effort::default();
    if let Some(mut journal) = folder.journal(share_of(Shard::ALL), |o: Outcome| log.note(o))? {
        with_work(worlds, folder, engine.into(), watcher, |work| {
            let mut keep = |outcome: &Outcome| Ok(journal.append(&Stamped::now(outcome))?);
            effort = log.run_all(work, &mut keep).map_err(|e| saved(e, folder.path()))?;
            Ok(())
        })?;
        journal.sync()?;
    }
    if !watcher.go_on() {
        return Ok(Ended::Interrupted(log.rows.len()));
    }
    joined(folder, log.rows, effort, watcher)
}

/// Joins all runs into the sweep's tables.
fn joined(
    folder: &Folder,
    rows: Rows,
    effort: Effort,
    watcher: &dyn Watcher,
) -> Result<Ended, Error> {
    let watched = Watched(watcher);
    watched.at(Progress::Stage { what: "joining the runs", share: 0.0 });
    let table = rows.table(folder.plan())?;
    watched.at(Progress::Stage { what: "writing the results", share: 0.5 });
    folder.complete(&table.results(), &table.timings())?;
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
    let mut log = Log::new(plan);
    let journal = match folder.is_complete() {
        true => None,
        false => folder.journal(share_of(shard), |outcome: Outcome| log.note(outcome))?,
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
        let mut keep = |outcome: &Outcome| Ok(journal.append(&Stamped::now(outcome))?);
        effort = log.run(work, &cells, &mut keep).map_err(|e| saved(e, folder.path()))?;
        Ok(())
    })?;
    journal.sync()?;
    if !watcher.go_on() {
        return Ok(Ended::Interrupted(log.rows.len()));
    }
    let table = log.rows.table(plan)?;
    folder.end_share(share_of(shard), journal, &table.columns.iter().collect::<Vec<_>>())?;
    Ok(Done::now(table, effort))
}

/// Returns the finished runs of the cells of a share, whoever made them.
fn finished_of(folder: &Folder, shard: Shard) -> Result<RunTable, Error> {
    let own: BTreeSet<u64> = folder.plan().share(shard).map(|c| c.id).collect();
    let mut rows = Rows::default();
    let mut take = |outcome: Outcome| {
        if own.contains(&outcome.cell) {
            rows.push(outcome);
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
    gather(folder, None, |outcome| log.note(outcome))?;
    let missing = if log.rounds.is_some() { log.open() } else { log.missing() }.len();
    if missing > 0 {
        let cause = format!("{missing} of {} runs are missing", plan.runs());
        let remedy = "run the shares that are not finished (finished ones are not run again), or \
                      run the rest here: sidestep resume DIR";
        return Err(Error::stopped(cause, remedy));
    }
    joined(folder, log.rows, Effort::default(), watcher)
}

/// Returns the table of runs in a file.
pub(super) fn table_of(file: WholeTable<Role>) -> RunTable {
    RunTable { columns: file.columns }
}

/// Converts a share to the type that folders use.
fn share_of(shard: Shard) -> Share {
    Share { index: shard.index, count: shard.count }
}

/// Passes on all finished runs, except those of the share `but`.
pub(super) fn gather(
    folder: &Folder,
    but: Option<Shard>,
    mut each: impl FnMut(Outcome),
) -> Result<(), InputError> {
    folder.parts(|part| table_of(part).outcomes(&mut each))?;
    folder.journals(but.map(share_of), &mut each)
}

/// Passes on what is needed to run the cells of a folder.
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

/// Adds to an error of storing which runs are saved, and how to continue.
fn saved(error: Error, folder: &Path) -> Error {
    match error {
        Error::Record(error) => {
            let remedy = "make room; the finished runs are saved, go on with: sidestep resume";
            Error::stopped(error.to_string(), format!("{remedy} {}", folder.display()))
        }
        other => other,
    }
}

/// All finished runs.
struct Log<'a> {
    plan: &'a Plan,
    rows: Rows,
    rounds: Option<Rounds<'a>>,
    trials: Trials<'a>,
}

/// Stores an outcome, if there is a place for it.
type Keep<'a> = dyn FnMut(&Outcome) -> Result<(), Error> + Send + 'a;

impl<'a> Log<'a> {
    fn new(plan: &'a Plan) -> Self {
        let rounds = plan.until.as_ref().map(|until| Rounds::new(plan, until));
        Self { plan, rows: Rows::default(), rounds, trials: Trials::new(plan) }
    }

    fn note(&mut self, outcome: Outcome) {
        if let Some(rounds) = &mut self.rounds {
            rounds.note(&outcome);
        }
        self.trials.note(&outcome);
        self.rows.push(outcome);
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
        let mut finished = self.rows.cells().to_vec();
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
        let before = self.rows.len() as u64;
        let mut effort = Effort::begin();
        let mut take = |outcome: Outcome| {
            keep(&outcome)?;
            effort.note(&outcome);
            self.note(outcome);
            Ok(())
        };
        let take: &mut Take<'_> = &mut take;
        let ran = work.run(&open, (before, before + open.len() as u64), take);
        effort.end(work.at_once(open.len()));
        ran.map(|()| effort)
    }
}
