#![deny(clippy::disallowed_methods)]
//! Simulates and compares decentralized motion coordination, with noisy sensors and slipping
//! wheels. Results are the same to the bit on any number of threads.
//!
//! A scenario is TOML text. It compiles to an immutable world, and a run advances a state:
//!
//! ```
//! use sidestep::kernel::Simulation;
//! use sidestep::scenario::Source;
//! use sidestep::worlds::robots::robots_run;
//!
//! let text = r#"
//!     format = 1
//!     world = "robots"
//!     seed = 7
//!     map = { office = { corridors = 1, rooms_per_side = 2 } }
//!     robots = { count = 4, size = 2, sensors = ["sonar-8"], effector = "nomad" }
//! "#;
//! let source = Source::new("four robots", text, "");
//! let mut run = robots_run(&source, 1)?;
//! run.advance(500);
//!
//! let metrics = run.metrics();
//! assert_eq!(metrics.total.actions, 4 * 500);
//! assert!(metrics.coverage > 0.0);
//!
//! // The number of workers is no part of the result.
//! let mut shared = robots_run(&source, 3)?;
//! shared.advance(500);
//! assert_eq!(shared.digest(), run.digest());
//! # Ok::<(), sidestep::kernel::InputError>(())
//! ```
//!
//! Wrong input is an error that reports its position and a remedy:
//!
//! ```
//! use sidestep::scenario::Source;
//! use sidestep::worlds::robots::robots_run;
//!
//! let text = "format = 1\nworld = \"robots\"\nsede = 7\n[map]\nascii = \"....\"\n[robots]\ncount = 1\n";
//! let error = robots_run(&Source::new("s.toml", text, ""), 1).unwrap_err();
//! assert_eq!(error.position(), Some((3, 1)));
//! assert_eq!(error.remedy(), "did you mean `seed`?");
//! ```
//!
//! # Modules
//!
//! ```text
//! scenario        TOML text + overrides -> typed sections, and errors with positions
//!    │            map: boxes of a floor      office: a generated building
//!    │            import: ROS, MovingAI, CARMEN and MRCLAM files
//!    ▼
//! worlds          scenario -> world + state; the phases of a cycle; metrics
//!    │            planning: paths on the static map, for behaviors with a goal
//!    ▼
//! kernel          the cycle, workers, random streams, digests, checkpoints, recorder port
//!
//! error_models    sensors and effectors that err, as plain types
//! learn           logs of a real robot -> error tables that a scenario loads
//! exact           the Markov chain of one robot, computed without random draws
//! experiment      many runs and sweeps, and their results with confidence intervals
//! statistics      intervals, tests, and when there are enough runs
//! ```
//!
//! To define a behavior of your own, implement the trait [`worlds::robots::decide::Behaviour`]; the
//! example `own_behaviour` defines, registers and runs one in less than 40 lines. To record a run,
//! pass a [`kernel::ports::Recorder`] to [`kernel::Simulation::record`]: the recorder in memory is
//! part of the kernel, and the crate `sidestep-record` has one that writes Parquet.

pub mod experiment;
mod problems;
pub mod worlds;

pub use problems::{MAX_PROBLEMS as MOST_PROBLEMS, problems};
pub use sidestep_collectives as collectives;
pub use sidestep_document as document;
pub use sidestep_error_models as error_models;
pub use sidestep_exact as exact;
pub use sidestep_import as import;
pub use sidestep_kernel as kernel;
pub use sidestep_learn as learn;
pub use sidestep_map as map;
pub use sidestep_map::{Cell, GridMap, office, planning};
pub use sidestep_scenario as scenario;
pub use sidestep_statistics as statistics;

/// The version of this crate.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The build: the version and a digest over what results follow from (sources, `Cargo.lock`, the compiler's
/// version), as `0.1.0+0123456789ab`. Only the build that started a run or a sweep continues it.
pub const BUILD: &str = env!("SIDESTEP_BUILD");

#[cfg(test)]
#[path = "../build.rs"]
#[allow(dead_code, reason = "cargo calls its `main`")]
mod build_script;

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn libraries_and_compiler_are_part_of_a_builds_identity() {
        let found = build_script::ingredients(Path::new(env!("CARGO_MANIFEST_DIR")))
            .expect("the repository");
        let text = |name: &str| {
            let found = found.iter().find(|(own, _)| own == name);
            found.map(|(_, text)| text.as_str()).unwrap_or_else(|| panic!("{name} is missing"))
        };
        assert!(text("Cargo.lock").contains("name = \"libm\""));
        assert!(text("rustc --version").starts_with("rustc 1."));
        assert!(
            text("kernel/Cargo.toml").contains("libm") && !text("kernel/src/math.rs").is_empty()
        );
        let digest = build_script::digest(found.clone());
        for name in ["Cargo.lock", "rustc --version", "worlds/chain/src/lib.rs"] {
            let mut changed = found.clone();
            changed.iter_mut().filter(|(own, _)| own == name).for_each(|(_, text)| text.push('1'));
            assert_ne!(build_script::digest(changed), digest, "{name}");
        }
        assert!(BUILD.ends_with(&digest), "{BUILD} is not {digest}");
    }

    #[test]
    fn a_build_out_of_the_repository_has_an_identity() {
        let digest = BUILD.strip_prefix(VERSION).and_then(|rest| rest.strip_prefix('+'));
        let digest = digest.expect("version, plus, digest");
        assert!(digest.len() == 12 && digest.bytes().all(|b| b.is_ascii_hexdigit()), "{BUILD}");
    }
}
