//! `cargo xtask test`: every test of the workspace, in two builds that share all third-party crates.
//!
//! Tests beside the code run with overflow checks and debug assertions on, in a build that is quick to make.
//! Tests from outside (`tests/`: promises, the program itself) run against the shipped build, so that the
//! program and its tests share all that cargo compiles.

use crate::arguments::house;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// Settings of the build with checks, as environment of cargo. They are no profile of their own: that would
/// compile the dependencies again. A low level of optimization changes no bit of a result.
const CHECKS: [(&str, &str); 3] = [
    ("CARGO_PROFILE_RELEASE_OVERFLOW_CHECKS", "true"),
    ("CARGO_PROFILE_RELEASE_DEBUG_ASSERTIONS", "true"),
    ("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1"),
];

/// A part of the tests, compiled in one way.
struct Part {
    /// Targets of cargo.
    targets: &'static [&'static str],
    environment: &'static [(&'static str, &'static str)],
}

/// Tests beside the code. Of the programs, only those with tests: each other one would be compiled for nothing,
/// together with its library. `.ci/soak` runs all others with checks as well.
const BESIDE: Part =
    Part { targets: &["--lib", "--bin", "sidestep-fuzz", "--bin", "xtask"], environment: &CHECKS };

/// Tests from outside, some of which run examples: the promises of the library, too, so that its golden digests
/// are those of the shipped build.
const OUTSIDE: Part = Part { targets: &["--test", "*"], environment: &[] };

/// Examples as programs: among the targets of tests, cargo would compile each as a program of tests.
const PROGRAMS: Part = Part { targets: &["--examples"], environment: &[] };

/// Examples in the documentation.
const EXAMPLES: Part = Part { targets: &["--doc"], environment: &[] };

/// All of one package, as it is shipped: not every package has each sort of target.
const ONE_PACKAGE: Part = Part { targets: &[], environment: &[] };

/// Runs the tests by nextest where it is installed, else by `cargo test`. `chosen` is handed to it: a
/// filter, for example. Nextest does not know the examples in the documentation; they follow it
/// when nothing was chosen. With `--no-run`, everything is compiled only.
pub(crate) fn run(chosen: &[String]) -> ExitCode {
    let skipped = Skipped::new();
    let runner: &[&str] = if has_nextest() {
        // A filter that meets tests of one part alone is no mistake. Nextest refuses that option where nothing runs.
        let is_run = !chosen.iter().any(|word| word == "--no-run");
        if is_run { &["nextest", "run", "--no-tests", "pass"] } else { &["nextest", "run"] }
    } else {
        eprintln!("nextest is not installed: `cargo test` runs one test program after the other");
        &["test", "--no-fail-fast"]
    };
    let all = !names_a_package(chosen);
    if all && !cargo(&["build"], &PROGRAMS, &[]) {
        return ExitCode::FAILURE;
    }
    let parts = if all { &[BESIDE, OUTSIDE][..] } else { &[ONE_PACKAGE] };
    // All are run, even if the first fail: a developer wants to see every failure.
    let failed = parts.iter().filter(|part| !cargo(runner, part, chosen)).count();
    let passed = failed == 0 && (!chosen.is_empty() || cargo(&["test"], &EXAMPLES, &[]));
    skipped.tell();
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Reasons why tests were skipped: they say so in a file, because the output of a passing test is not shown.
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

fn names_a_package(words: &[String]) -> bool {
    words.iter().any(|word| word.starts_with("-p") || word.starts_with("--package"))
}

/// Returns whether the command succeeded, in the whole workspace unless `more` names a package.
fn cargo(words: &[&str], part: &Part, more: &[String]) -> bool {
    let mut cargo = command(words);
    cargo.env("SIDESTEP_SKIPPED", house().join("target/skipped-tests"));
    cargo.envs(part.environment.iter().copied()).arg("--release").args(part.targets);
    cargo.args((!names_a_package(more)).then_some("--workspace")).args(more);
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

/// Returns programs with tests that are not run, and programs that are compiled for tests without having any.
#[cfg(test)]
pub(crate) fn misnamed_programs(members: &[crate::members::Member]) -> Vec<String> {
    let main = std::path::Path::new("src/main.rs");
    let mut wrong = Vec::new();
    for member in members {
        let own = member.sources.iter().filter(|source| {
            source.path == main || source.module.as_ref().is_some_and(|place| place.root == main)
        });
        let is_tested = own.flat_map(|source| &source.lines).any(|line| line.text == "#[test]");
        if is_tested != BESIDE.targets.contains(&member.name.as_str()) {
            let name = &member.name;
            wrong.push(format!("{name}: BESIDE names its program if it has tests, and only then"));
        }
    }
    wrong
}
