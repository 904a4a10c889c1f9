//! `cargo xtask test`: every test of the workspace, in two builds that share all third-party crates.
//!
//! Tests beside the code of the hot crates (kernel, worlds and their libraries) run with overflow checks and debug
//! assertions on, in a build that is quick to make. All others run against the shipped build, so that the program and
//! its tests share all that cargo compiles.

use crate::root;
use std::fs;
use std::process::{Command, ExitCode, Stdio};

/// Settings of the build with checks, as environment of cargo. They are no profile of their own: that would
/// compile the dependencies again. A low level of optimization changes no bit of a result.
const CHECKS: [(&str, &str); 3] = [
    ("CARGO_PROFILE_RELEASE_OVERFLOW_CHECKS", "true"),
    ("CARGO_PROFILE_RELEASE_DEBUG_ASSERTIONS", "true"),
    ("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1"),
];

/// Crates that are hot: they are shipped without checks, so their tests beside the code are built once more with checks.
/// All other crates of ours have overflow checks in the shipped build, too (`Cargo.toml`), and are tested in it.
const HOT: [&str; 10] = [
    "sidestep-airspace",
    "sidestep-arms",
    "sidestep-chain",
    "sidestep-collectives",
    "sidestep-error-models",
    "sidestep-kernel",
    "sidestep-map",
    "sidestep-planners",
    "sidestep-robots",
    "sidestep-rods",
];

/// Crates without tests in Rust: the Python package is tested from Python, and the crate of features has nothing to test.
const UNTESTED: [&str; 4] = [
    "sidestep-pond-python",
    "sidestep-python",
    "sidestep-python-native",
    "sidestep-workspace-hack",
];

/// Programs with tests beside their code: each other program would be compiled for nothing, with its library.
/// `.ci/soak` runs all of them with checks.
const TESTED_PROGRAMS: [&str; 4] = ["--bin", "sidestep-fuzz", "--bin", "xtask"];

/// Tests from outside, some of which run examples: the promises of the library, too, so that its golden digests
/// are those of the shipped build.
const OUTSIDE: [&str; 3] = ["--workspace", "--test", "*"];

/// File in which tests say why they were skipped, because the output of a passing test is not shown.
const SKIPPED_TESTS: &str = "target/skipped-tests";

/// Runs the tests by nextest where it is installed, else by `cargo test`. `chosen` is handed to it: a
/// filter, for example. Nextest does not know the examples in the documentation; they follow it
/// when nothing was chosen. With `--no-run`, everything is compiled only.
pub(crate) fn run(chosen: &[String]) -> ExitCode {
    // Of an earlier run; there need not be one.
    let _ = fs::remove_file(root().join(SKIPPED_TESTS));
    let is_one = chosen.iter().any(|word| word.starts_with("-p") || word.starts_with("--package"));
    let passed = if is_one {
        // All of one package as it is shipped: not every package has each sort of target.
        tests(&[], &[], chosen)
    } else {
        // Examples as programs: among the targets of tests, cargo would compile each as a program of tests.
        let has_examples = cargo(&["build", "--release", "--workspace", "--examples"], &[]);
        // All parts are run, even if the first fails: a developer wants to see every failure.
        let has_passed_with_checks = tests(&with_checks(), &CHECKS, chosen);
        let has_passed_beside = tests(&beside(), &[], chosen);
        let has_passed_outside = tests(&OUTSIDE, &[], chosen);
        has_examples
            && has_passed_with_checks
            && has_passed_beside
            && has_passed_outside
            && (!chosen.is_empty() || cargo(&["test", "--release", "--workspace", "--doc"], &[]))
    };
    print_skipped();
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Returns the choice of tests beside the code of hot crates.
fn with_checks() -> Vec<&'static str> {
    // This program depends on the crate that unifies features (`.config/hakari.toml`): without one that does, packages
    // of others would be compiled again with fewer features.
    let mut words = vec!["-p", "xtask", "--lib"];
    for name in HOT {
        words.extend(["-p", name]);
    }
    words
}

/// Returns the choice of tests beside the code of all other crates.
fn beside() -> Vec<&'static str> {
    let mut words = vec!["--workspace", "--lib"];
    words.extend(TESTED_PROGRAMS);
    for name in HOT.into_iter().chain(UNTESTED) {
        words.extend(["--exclude", name]);
    }
    words
}

/// Runs tests by nextest where it is installed, else by `cargo test`.
fn tests(targets: &[&str], settings: &[(&str, &str)], chosen: &[String]) -> bool {
    let mut words = if has_nextest() {
        vec!["nextest", "run", "--release"]
    } else {
        eprintln!("nextest is not installed: `cargo test` runs one test program after the other");
        vec!["test", "--release", "--no-fail-fast"]
    };
    // A filter that meets tests of one part alone is no mistake. Nextest refuses the option where nothing runs.
    if words[0] == "nextest" && !chosen.iter().any(|word| word == "--no-run") {
        words.extend(["--no-tests", "pass"]);
    }
    words.extend(targets);
    words.extend(chosen.iter().map(String::as_str));
    cargo(&words, settings)
}

fn has_nextest() -> bool {
    let answer =
        command(&["nextest", "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    answer.is_ok_and(|status| status.success())
}

/// Returns whether the command succeeded.
fn cargo(words: &[&str], settings: &[(&str, &str)]) -> bool {
    let mut cargo = command(words);
    cargo.envs(settings.iter().copied());
    cargo.env("SIDESTEP_SKIPPED", root().join(SKIPPED_TESTS));
    cargo.status().is_ok_and(|status| status.success())
}

/// Returns a command of cargo, in the root of the repository.
fn command(words: &[&str]) -> Command {
    // Cargo tells the programs that it runs which cargo it is.
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).current_dir(root());
    // It also tells them their own package. Build scripts that ask for that would run again in each cargo that is not
    // started from here, and all that depends on them would be compiled again.
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(|name| {
            name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_")
        }) {
            command.env_remove(&name);
        }
    }
    command
}

/// Prints each reason for which tests were skipped, and how many.
fn print_skipped() {
    let text = fs::read_to_string(root().join(SKIPPED_TESTS)).unwrap_or_default();
    let mut reasons: Vec<&str> = text.lines().collect();
    reasons.sort_unstable();
    for equal in reasons.chunk_by(|a, b| a == b) {
        eprintln!("skipped {} times: {}", equal.len(), equal[0]);
    }
}
