#![deny(clippy::disallowed_methods)]
//! Simulate and compare decentralized motion coordination, with sensors that lie and wheels
//! that slip, bit for bit the same on any number of threads.
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
//! Wrong input is an error that says where it stands and what would be right:
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
//! # Where things are
//!
//! ```text
//! scenario        TOML text + overrides -> typed sections, and errors that point
//!    │            map: boxes of a floor      office: a generated building
//!    │            import: ROS, MovingAI, CARMEN and MRCLAM files
//!    ▼
//! worlds::robots  scenario -> world + state; perceive, decide, resolve, react; metrics
//!    │            planning: ways on the static map, for behaviors that go somewhere
//!    ▼
//! kernel          the cycle, workers, random streams, digests, checkpoints, recorder port
//!
//! learn           logs of a real robot -> error tables that a scenario loads
//! experiment      many runs and sweeps, what they come to with intervals, the papers' experiments
//! statistics      intervals, tests, and when there are runs enough
//! ```
//!
//! A behavior of your own is one trait, [`worlds::robots::decide::Behaviour`]; the example
//! `own_behaviour` writes, registers and runs one in less than 40 lines. To record a run, hand
//! [`kernel::Simulation::record`] a [`kernel::ports::Recorder`]: the one in memory is here, the
//! one that writes Parquet is in the crate `sidestep-record`.

pub mod experiment;
pub mod worlds;

pub use sidestep_collectives as collectives;
pub use sidestep_import as import;
pub use sidestep_kernel as kernel;
pub use sidestep_map as map;
pub use sidestep_map::{Cell, GridMap, office, planning};
pub use sidestep_robots::learn;
pub use sidestep_scenario as scenario;
pub use sidestep_statistics as statistics;

/// The version.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The build: the version and a digest over the sources that results follow from, as
/// `0.1.0+0123456789ab`. Only the build that began a run or a sweep goes on with it.
pub const BUILD: &str = env!("SIDESTEP_BUILD");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_out_of_the_repository_has_an_identity() {
        let digest = BUILD.strip_prefix(VERSION).and_then(|rest| rest.strip_prefix('+'));
        let digest = digest.expect("version, plus, digest");
        assert!(digest.len() == 12 && digest.bytes().all(|b| b.is_ascii_hexdigit()), "{BUILD}");
    }
}
