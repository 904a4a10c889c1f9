//! `cargo xtask test`: every test of the workspace in the profile `release`, so that the program and
//! its tests share all that cargo compiles.

use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

/// Runs the tests by nextest where it is installed, else by `cargo test`. `chosen` is handed to it: a
/// filter, for example. Nextest does not know the examples in the documentation; they follow it
/// when nothing was chosen.
pub(crate) fn run(chosen: &[String]) -> ExitCode {
    let passed = if has_nextest() {
        cargo(&["nextest", "run"], chosen) && (!chosen.is_empty() || cargo(&["test", "--doc"], &[]))
    } else {
        eprintln!("nextest is not installed: `cargo test` runs one test program after the other");
        cargo(&["test", "--no-fail-fast"], chosen)
    };
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
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
    cargo.arg("--release").args((!is_chosen).then_some("--workspace")).args(more);
    cargo.status().is_ok_and(|status| status.success())
}

/// A command of cargo, in the root of the repository.
fn command(words: &[&str]) -> Command {
    // Cargo tells the programs that it runs which cargo it is.
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
    command
}
