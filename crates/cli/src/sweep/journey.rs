//! From a sweep to the table of its runs: in memory, in a folder, or share by share.

use super::prepare::prepare;
use super::say::{Effort, say, say_share};
use super::work::{Take, Work};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::progress::Stages;
use serde_json::json;
use sidestep::experiment::sweep::rounds::Rounds;
use sidestep::experiment::sweep::{
    Cell, Outcome, Plan, Role, Rows, RunTable, Shard, Sweep, rows::cells,
};
use sidestep::kernel::InputError;
use sidestep::scenario::Source;
use sidestep_record::WholeTable;
use sidestep_record::sweep::{Share, SweepFolder, fingerprint};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The folder of a sweep.
pub(crate) type Folder = SweepFolder<Plan>;

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Runs a sweep and keeps nothing but what is printed.
///
/// # Errors
/// When the sweep is wrong.
pub(crate) fn in_memory(
    sweep: &Sweep,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    if sweep.record {
        let cause = "there is no folder to record runs to";
        return Err(InputError::new("--record-runs", cause, "name one with --out").into());
    }
    let stages = Stages::new(console);
    let mut sources: Vec<Source> = Vec::new();
    let plan = prepare(sweep, &stages, |_, source, _| {
        sources.push(source.clone());
        Ok(())
    });
    stages.clear();
    let plan = plan?;
    let source = |variant: u32| Ok(sources[variant as usize].clone());
    let work = Work { plan: &plan, source: &source, record: None, workers, console };
    interrupt::listen()?;
    let mut log = Log::new(&plan);
    let effort = log.run_all(&work, &mut |_| Ok(()))?;
    if interrupt::requested() {
        console.note("Interrupted; nothing is kept without --out DIR.");
        let json = json!({ "status": "interrupted", "runs": log.rows.len(), "folder": null });
        console.result(&json, String::new);
        return Ok(ExitCode::Interrupted);
    }
    say(&plan, &log.rows.table(&plan)?, effort, None, console)
}

/// Plans a sweep into a folder: all of it or nothing.
///
/// # Errors
/// When the sweep is wrong, or the folder taken.
pub(crate) fn planned(sweep: &Sweep, out: &Path, console: Console) -> Result<Folder, Failure> {
    interrupt::listen()?;
    let stages = Stages::new(console);
    let folder = Folder::create(out, VERSION, |staging| {
        let mut fingerprints = Vec::new();
        let plan = prepare(sweep, &stages, |k, source, compiled| {
            if interrupt::requested() {
                return Err(Failure::Interrupted);
            }
            let resolved = compiled.resolve(source)?;
            fingerprints.push(fingerprint(resolved.text.as_bytes(), &resolved.files));
            Ok(Folder::write_variant(staging, k, &resolved.text, &resolved.files)?)
        })?;
        let cells = cells(&plan).columns;
        Ok::<_, Failure>((plan, fingerprints, cells))
    });
    stages.clear();
    folder
}

/// Runs a sweep into a folder, or goes on with the same one that is there.
///
/// # Errors
/// When the sweep is wrong, the folder holds something else, or results cannot be stored.
pub(crate) fn in_folder(
    sweep: &Sweep,
    out: &Path,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    let folder = match Folder::is_at(out) {
        false => planned(sweep, out, console)?,
        true => the_same(sweep, out, console)?,
    };
    go_on(&folder, workers, console)
}

/// The sweep that is in the folder, which must be this one.
fn the_same(sweep: &Sweep, out: &Path, console: Console) -> Result<Folder, Failure> {
    let folder = Folder::open(out)?;
    let stages = Stages::new(console);
    let mut fingerprints = Vec::new();
    let plan = prepare(sweep, &stages, |_, source, compiled| {
        let resolved = compiled.resolve(source)?;
        fingerprints.push(fingerprint(resolved.text.as_bytes(), &resolved.files));
        Ok(())
    });
    stages.clear();
    let manifest = folder.manifest();
    if (&plan?, &fingerprints) == (&manifest.plan, &manifest.fingerprints) {
        check_version(&folder)?;
        return Ok(folder);
    }
    let remedy = "name another folder, or go on with what is there: sidestep resume DIR";
    Err(InputError::new(out.display(), "the folder holds another sweep", remedy).into())
}

/// Results may change between versions, so only one version makes all runs.
fn check_version(folder: &Folder) -> Result<(), InputError> {
    let wrote = &folder.manifest().program_version;
    if wrote == VERSION {
        return Ok(());
    }
    let cause = format!("the sweep is of sidestep {wrote}, this is {VERSION}");
    let remedy = format!("go on with sidestep {wrote}, or sweep into a new folder");
    Err(InputError::new(folder.path().display(), cause, remedy))
}

/// Runs whatever is not finished yet, and joins all runs into one table.
///
/// # Errors
/// When runs cannot be read or stored.
pub(crate) fn go_on(
    folder: &Folder,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    if folder.is_complete() {
        console.note("All runs are finished already.");
        return show(folder, console);
    }
    check_version(folder)?;
    let mut log = Log::new(folder.plan());
    gather(folder, Some(Shard::ALL), |outcome| log.note(outcome))?;
    interrupt::listen()?;
    let mut effort = Effort::default();
    if let Some(mut journal) = folder.journal(share_of(Shard::ALL), |o: Outcome| log.note(o))? {
        with_work(folder, workers, console, |work| {
            let mut keep = |outcome: &Outcome| Ok(journal.append(outcome)?);
            effort = log.run_all(work, &mut keep).map_err(|e| saved(e, folder.path()))?;
            Ok(())
        })?;
        journal.sync()?;
    }
    if interrupt::requested() {
        return Ok(interrupted(folder, log.rows.len(), console));
    }
    let table = log.rows.table(folder.plan())?;
    folder.complete(&table.results().columns, &table.timings().columns)?;
    say(folder.plan(), &table, effort, Some(folder), console)
}

/// Runs a share of the cells and writes its part.
///
/// # Errors
/// When the sweep stops by precision, or runs cannot be read or stored.
pub(crate) fn share(
    folder: &Folder,
    shard: Shard,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    check_version(folder)?;
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
        console.note(format!("Share {shard} is finished already."));
        return say_share(&finished_of(folder, shard)?, shard, Effort::default(), folder, console);
    };
    interrupt::listen()?;
    // Shares of another count, or a sweep that went on here, may have made some of its runs.
    let mut elsewhere = BTreeSet::new();
    gather(folder, Some(shard), |outcome| _ = elsewhere.insert(outcome.cell))?;
    let cells: Vec<Cell> = plan.share(shard).filter(|c| !elsewhere.contains(&c.id)).collect();
    let mut effort = Effort::default();
    with_work(folder, workers, console, |work| {
        let mut keep = |outcome: &Outcome| Ok(journal.append(outcome)?);
        effort = log.run(work, &cells, &mut keep).map_err(|e| saved(e, folder.path()))?;
        Ok(())
    })?;
    journal.sync()?;
    if interrupt::requested() {
        return Ok(interrupted(folder, log.rows.len(), console));
    }
    let table = log.rows.table(plan)?;
    folder.end_share(share_of(shard), journal, &table.columns)?;
    say_share(&table, shard, effort, folder, console)
}

/// The finished runs of the cells of a share, whoever made them.
fn finished_of(folder: &Folder, shard: Shard) -> Result<RunTable, Failure> {
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
/// When runs are missing, or cannot be read or stored.
pub(crate) fn collect(folder: &Folder, console: Console) -> Result<ExitCode, Failure> {
    if folder.is_complete() {
        console.note("The runs are collected already.");
        return show(folder, console);
    }
    let plan = folder.plan();
    let mut log = Log::new(plan);
    gather(folder, None, |outcome| log.note(outcome))?;
    let missing = log.open().len();
    if missing > 0 {
        let cause = format!("{missing} of {} runs are missing", plan.len());
        let remedy = "run the shares that are not finished (finished ones are not run again), or \
                      run the rest here: sidestep resume DIR";
        return Err(Failure::stopped(cause, remedy));
    }
    let table = log.rows.table(plan)?;
    folder.complete(&table.results().columns, &table.timings().columns)?;
    say(plan, &table, Effort::default(), Some(folder), console)
}

/// What came of a sweep that is done.
fn show(folder: &Folder, console: Console) -> Result<ExitCode, Failure> {
    let table = table_of(folder.results()?);
    say(folder.plan(), &table, Effort::default(), Some(folder), console)
}

/// The table of runs in a file.
pub(super) fn table_of(file: WholeTable<Role>) -> RunTable {
    RunTable { columns: file.columns }
}

/// The same share, as folders name it.
fn share_of(shard: Shard) -> Share {
    Share { index: shard.index, count: shard.count }
}

/// Hands over all finished runs, but for those of the share `but`.
pub(super) fn gather(
    folder: &Folder,
    but: Option<Shard>,
    mut each: impl FnMut(Outcome),
) -> Result<(), InputError> {
    folder.parts(|part| table_of(part).outcomes(&mut each))?;
    folder.journals(but.map(share_of), &mut each)
}

/// Hands over what the cells of a folder are run with.
fn with_work(
    folder: &Folder,
    workers: usize,
    console: Console,
    run: impl FnOnce(&Work<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let plan = folder.plan();
    let checked: Vec<AtomicBool> = plan.variants.iter().map(|_| AtomicBool::new(false)).collect();
    let source = |variant: u32| {
        // Runs of a scenario that somebody has changed would be runs of another sweep.
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
    run(&Work { plan, source: &source, record, workers, console })
}

/// Something could not be stored: says what is saved, and how to go on.
fn saved(failure: Failure, folder: &Path) -> Failure {
    match failure {
        Failure::Record(error) => {
            let remedy = "make room; the finished runs are saved, go on with: sidestep resume";
            Failure::stopped(error.to_string(), format!("{remedy} {}", folder.display()))
        }
        other => other,
    }
}

fn interrupted(folder: &Folder, finished: usize, console: Console) -> ExitCode {
    let (all, path) = (folder.plan().len(), folder.path().display());
    let of = if folder.plan().until.is_some() { String::new() } else { format!(" of {all}") };
    console.note(format!("{finished}{of} runs are finished; `sidestep resume {path}` goes on."));
    let json = json!({ "status": "interrupted", "runs": finished, "folder": folder.path() });
    console.result(&json, String::new);
    ExitCode::Interrupted
}

/// All finished runs.
struct Log<'a> {
    plan: &'a Plan,
    rows: Rows,
    rounds: Option<Rounds<'a>>,
}

/// Stores an outcome, if there is a place for it.
type Keep<'a> = dyn FnMut(&Outcome) -> Result<(), Failure> + Send + 'a;

impl<'a> Log<'a> {
    fn new(plan: &'a Plan) -> Self {
        let rounds = plan.until.as_ref().map(|until| Rounds::new(plan, until));
        Self { plan, rows: Rows::default(), rounds }
    }

    fn note(&mut self, outcome: Outcome) {
        if let Some(rounds) = &mut self.rounds {
            rounds.note(&outcome);
        }
        self.rows.push(outcome);
    }

    /// Cells that are not finished: of the next round, or all.
    fn open(&self) -> Vec<Cell> {
        match &self.rounds {
            Some(rounds) => rounds.next(),
            None => self.unfinished(self.plan.share(Shard::ALL)),
        }
    }

    fn unfinished(&self, cells: impl Iterator<Item = Cell>) -> Vec<Cell> {
        let mut finished = self.rows.cells().to_vec();
        finished.sort_unstable();
        cells.filter(|cell| finished.binary_search(&cell.id).is_err()).collect()
    }

    /// Runs all that is open, round by round where a precision is wanted.
    fn run_all(&mut self, work: &Work<'_>, keep: &mut Keep<'_>) -> Result<Effort, Failure> {
        let mut effort = Effort::default();
        loop {
            let open = self.open();
            if open.is_empty() || interrupt::requested() {
                return Ok(effort);
            }
            effort.add(self.run(work, &open, keep)?);
        }
    }

    /// Runs those of the cells that are not finished.
    fn run(
        &mut self,
        work: &Work<'_>,
        cells: &[Cell],
        keep: &mut Keep<'_>,
    ) -> Result<Effort, Failure> {
        let open = self.unfinished(cells.iter().copied());
        let before = match &self.rounds {
            Some(_) => self.rows.len(),
            None => cells.len() - open.len(),
        } as u64;
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
