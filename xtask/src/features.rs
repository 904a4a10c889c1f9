//! Features of packages, equal for the command and the tests: every package has the same features in
//! both. Otherwise `cargo run` compiles the packages of the tests again, and everything that depends
//! on them.

use std::collections::BTreeSet;
use std::process::Command;

/// Returns a line for each package with its version and features, as cargo resolves them for a choice of crates.
fn resolved(choice: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--prefix", "none", "--format", "{p} {f}"])
        .args(choice)
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(|line| line.trim_end_matches(" (*)").trim_end().to_owned()).collect()
}

#[test]
fn the_command_and_the_tests_share_every_compiled_crate() {
    let command = resolved(&["--package", "sidestep-cli", "--edges", "normal,build"]);
    let tests = resolved(&["--workspace", "--edges", "normal,build,dev"]);
    assert!(command.len() > 50 && tests.len() > command.len());
    let twice: Vec<&String> = command.difference(&tests).collect();
    assert!(
        twice.is_empty(),
        "compiled once for the command and again for the tests: {twice:?}; name them in crates/cli/Cargo.toml \
         with the features that the tests' dependencies switch on"
    );
}
