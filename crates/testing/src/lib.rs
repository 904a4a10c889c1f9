//! Helpers that the tests of several crates share.

mod json_process;
mod process_faults;

pub use json_process::JsonProcess;
pub use process_faults::{ProcessFault, StoppedProcesses, try_signal};

use std::fmt::Display;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Says that a test is skipped and why. Where `SIDESTEP_SKIPPED` names a file, it gets a line as well, of
/// which `cargo xtask test` tells at its end: the output of tests that pass is not shown.
///
/// # Panics
/// When that file cannot be written.
pub fn skip(why: impl Display) {
    println!("skipped: {why}");
    if let Some(path) = std::env::var_os("SIDESTEP_SKIPPED") {
        let file = OpenOptions::new().create(true).append(true).open(path);
        // One call writes the whole line: tests run side by side.
        file.and_then(|mut file| file.write_all(format!("{why}\n").as_bytes()))
            .expect("a place for skips");
    }
}

/// Skips a test that needs a thing, which is missing, with the reason; fails if `SIDESTEP_REQUIRE` names the thing, among
/// others with commas between.
///
/// # Panics
/// When it is required.
pub fn require(thing: &str, why: &str) {
    let required = std::env::var("SIDESTEP_REQUIRE").unwrap_or_default();
    assert!(!required.split(',').any(|word| word.trim() == thing), "{thing} is required: {why}");
    skip(why);
}

/// Returns whether Python has some modules, given with commas between; skips the test, or fails where `SIDESTEP_REQUIRE`
/// names `python`.
pub fn has_modules(modules: &str) -> bool {
    let tried = Command::new(python()).args(["-c", &format!("import {modules}")]).output();
    let said = match tried {
        Ok(output) if output.status.success() => return true,
        Ok(output) => String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or("").into(),
        Err(error) => error.to_string(),
    };
    require("python", &format!("python with {modules} is not here: {said}"));
    false
}

/// Returns the Python that reads what was written: that of `SIDESTEP_PYTHON`, else `python3`.
pub fn python() -> PathBuf {
    std::env::var_os("SIDESTEP_PYTHON").map_or("python3".into(), PathBuf::from)
}

/// Returns the folder of the repository.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Returns a file or folder of the shared data, or `None` (with one message) where that folder is
/// missing, because recorded data of others are not part of the repository.
pub fn shared_data(name: &str) -> Option<PathBuf> {
    let path = root().join("../shared/data").join(name);
    if !path.exists() {
        skip("../shared/data is not here");
        return None;
    }
    Some(path)
}

/// Returns a robot model of the shared data, or `None` where that folder is missing.
pub fn robot_model(name: &str) -> Option<PathBuf> {
    shared_data(&format!("urdf/{name}"))
}

/// The URDF files of the shared data.
pub const ROBOT_MODELS: [&str; 11] = [
    "REU_snake.urdf",
    "RSNAKE_snake.urdf",
    "iiwa14_primitive_collision.urdf",
    "panda.urdf",
    "pendulum5.urdf",
    "ur5_robot.urdf",
    "z1.urdf",
    "chain/iiwa7.urdf",
    "chain/panda.urdf",
    "chain/snake16_own.urdf",
    "chain/ur5.urdf",
];

#[cfg(test)]
mod tests {
    use proptest::test_runner::{Config, RngSeed};

    /// The seed is in `.cargo/config.toml`, or given by `.ci/soak`.
    #[test]
    fn random_cases_begin_where_the_configuration_says() {
        let seed = Config::default().rng_seed;
        assert!(matches!(seed, RngSeed::Fixed(_)), "{seed:?}: run the tests by cargo");
    }
}
