//! `cargo xtask test`: every test of the workspace in the profile `release`, so that the program and
//! its tests share all that cargo compiles.

use crate::arguments::house;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// Runs the tests by nextest where it is installed, else by `cargo test`. `chosen` is handed to it: a
/// filter, for example. Nextest does not know the examples in the documentation; they follow it
/// when nothing was chosen.
pub(crate) fn run(chosen: &[String]) -> ExitCode {
    let skipped = Skipped::new();
    let passed = if has_nextest() {
        cargo(&["nextest", "run"], chosen) && (!chosen.is_empty() || cargo(&["test", "--doc"], &[]))
    } else {
        eprintln!("nextest is not installed: `cargo test` runs one test program after the other");
        cargo(&["test", "--no-fail-fast"], chosen)
    };
    skipped.tell();
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Reasons why tests were skipped: they say so in a file, as nobody sees what a test prints that passes.
struct Skipped(PathBuf);

impl Skipped {
    fn new() -> Self {
        let file = house().join("target/skipped-tests");
        // Of an earlier run; there need not be one.
        let _ = std::fs::remove_file(&file);
        Self(file)
    }

    /// Tells how many tests were skipped, for each reason.
    fn tell(&self) {
        let reasons = std::fs::read_to_string(&self.0).unwrap_or_default();
        for (why, times) in counted(&reasons) {
            eprintln!("skipped {times} times: {why}");
        }
    }
}

/// Returns how often each line is there.
fn counted(lines: &str) -> BTreeMap<&str, usize> {
    lines.lines().fold(BTreeMap::new(), |mut counts, line| {
        *counts.entry(line).or_default() += 1;
        counts
    })
}

fn has_nextest() -> bool {
    let mut asked = command(&["nextest", "--version"]);
    let asked = asked.stdout(Stdio::null()).stderr(Stdio::null()).status();
    asked.is_ok_and(|status| status.success())
}

/// Returns whether the command succeeded, in the whole workspace unless `more` names a package.
fn cargo(words: &[&str], more: &[String]) -> bool {
    let mut cargo = command(words);
    let is_chosen = more.iter().any(|word| word.starts_with("-p") || word.starts_with("--package"));
    cargo.env("SIDESTEP_SKIPPED", house().join("target/skipped-tests"));
    cargo.arg("--release").args((!is_chosen).then_some("--workspace")).args(more);
    cargo.status().is_ok_and(|status| status.success())
}

/// A command of cargo, in the root of the repository.
fn command(words: &[&str]) -> Command {
    // Cargo tells the programs that it runs which cargo it is.
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).current_dir(house());
    command
}

#[test]
fn reasons_for_skips_are_counted() {
    let counts = counted("no data\nno browser\nno data\n");
    assert_eq!(Vec::from_iter(counts), [("no browser", 1), ("no data", 2)]);
}
