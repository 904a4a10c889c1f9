//! Runs of the pond in a folder of their own.

use sidestep_airspace::Airspace;
use sidestep_kernel::{Cycle, Interrupt};
use sidestep_robots::Robots;
use sidestep_scenario::{WorldType, Worlds};
use sidestep_session::{
    Error, ManagedRun, NoWatcher, OutputPaths, Progress, Summary, Watcher, read_scenario,
};
use sidestep_testing_pond::Pond;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The one world of these tests.
pub(crate) static WORLDS: LazyLock<Worlds> = LazyLock::new(|| Worlds::new(BUILD).with(Pond));

/// Worlds that are shipped.
pub(crate) static SHIPPED_WORLDS: LazyLock<Worlds> =
    LazyLock::new(|| Worlds::new(BUILD).with(Robots::new()).with(Airspace::new()));

/// The build of these tests.
pub(crate) const BUILD: &str = "0.1.0+0123456789ab";

/// A folder that is deleted when dropped.
pub(crate) struct TestFolder(tempfile::TempDir);

impl TestFolder {
    /// A folder with the scenario `pond.toml`.
    pub(crate) fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a folder"));
        std::fs::write(place.path("pond.toml"), Pond.default_scenario()).expect("written");
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Returns the run of the scenario, at its start.
    pub(crate) fn start(&self, workers: usize, keep: OutputPaths<'_>) -> Result<ManagedRun, Error> {
        let (source, compiled) = read_scenario(&WORLDS, &self.path("pond.toml"), &[])?;
        ManagedRun::start(&WORLDS, compiled.as_ref(), &source, workers, keep)
    }

    /// Returns the whole run, recorded to the folder `name`.
    pub(crate) fn record(&self, name: &str) -> (PathBuf, Summary) {
        let folder = self.path(name);
        let keep = OutputPaths { folder: Some(&folder), ..OutputPaths::default() };
        let journey = self.start(2, keep).expect("started");
        let summary = journey.run_to_end(&NoWatcher).expect("recorded");
        (folder, summary)
    }
}

/// Returns the names in the folder, sorted.
pub(crate) fn names(place: &TestFolder) -> Vec<String> {
    let entries = std::fs::read_dir(place.path("")).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("an entry").file_name();
    let mut names: Vec<_> = entries.map(|e| name(e).to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A watcher that asks to stop once a run has reached a cycle.
pub(crate) struct StopAt {
    cycle: Cycle,
    is_there: AtomicBool,
}

impl StopAt {
    pub(crate) fn new(cycle: Cycle) -> Self {
        Self { cycle, is_there: AtomicBool::new(false) }
    }
}

impl Watcher for StopAt {
    fn on_progress(&self, progress: Progress<'_>) {
        if let Progress::Cycles { done, .. } = progress
            && done >= self.cycle
        {
            self.is_there.store(true, Ordering::Relaxed);
        }
    }

    fn should_continue(&self) -> bool {
        !self.is_there.load(Ordering::Relaxed)
    }
}

/// A watcher that interrupts the first cycle of a slice once a run has reached a cycle, and never
/// asks to stop between two.
pub(crate) struct InterruptAt {
    pub(crate) cycle: Cycle,
    pub(crate) interrupt: Interrupt,
}

impl Watcher for InterruptAt {
    fn on_progress(&self, progress: Progress<'_>) {
        if let Progress::Cycles { done, .. } = progress
            && done >= self.cycle
        {
            self.interrupt.raise();
        }
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }
}

/// Replaces `from` by `to` in a file, which must hold it.
pub(crate) fn edit(file: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(file).expect("readable");
    assert!(text.contains(from), "{} holds no {from}", file.display());
    let text = text.replace(from, to);
    // A manifest that was edited with its digest: what is in it is read.
    let is_manifest = file.extension().is_some_and(|ending| ending == "json");
    let text = if is_manifest { sidestep_record::seal_again(&text) } else { text };
    std::fs::write(file, text).expect("written");
}
