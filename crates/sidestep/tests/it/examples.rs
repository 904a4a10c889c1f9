//! Every example of the library runs, and says what it shows.

use std::path::Path;
use std::process::Command;

/// Runs an example in the root of the repository and returns its output; cargo builds examples beside the tests.
fn run(name: &str) -> String {
    let test = std::env::current_exe().expect("a program");
    let build = test.parent().and_then(Path::parent).expect("the folder of the build");
    let program = build.join("examples").join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let mut command = Command::new(program);
    let output = command.current_dir(sidestep_testing::root()).output().expect("it is built");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_first_run_prints_coverage_and_tables() {
    let text = run("first_run");
    assert!(text.contains("% of the floor seen"), "{text}");
    assert!(text.contains("table events"), "{text}");
}

#[test]
fn an_own_behavior_moves_robots() {
    assert!(run("own_behavior").contains("\"coverage\""));
}

#[test]
fn an_own_method_brings_airplanes_to_their_goals() {
    let text = run("own_method");
    assert!(text.contains("\"arrived\": 6"), "{text}");
    assert!(text.contains("\"losses_of_separation\": 0"), "{text}");
}

#[test]
fn an_own_driver_finishes_its_task() {
    let text = run("own_driver");
    assert!(text.contains("\"done\": 1"), "{text}");
}

#[test]
fn a_sweep_prints_a_comparison() {
    let text = run("sweep");
    assert!(text.contains("orca") && text.contains("mvp"), "{text}");
}

#[test]
fn inverse_kinematics_finds_joints_or_a_reason() {
    let text = run("ik");
    assert!(text.lines().count() == 3 && text.contains("reach"), "{text}");
}
