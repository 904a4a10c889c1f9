#![deny(clippy::disallowed_methods)]
//! Simulates and compares decentralized motion coordination. Results are the same to the bit on any number of threads.
//!
//! There are three worlds: robots with noisy sensors and slipping wheels on a grid, chains of connectors and rods that
//! creep among obstacles, and airplanes that avoid each other. All are used in one way: a scenario is TOML text, which
//! is loaded, changed and started; a run is advanced and looked at.
//!
//! ```no_run
//! let mut run = sidestep::load("office.toml")?.set("robots.0.count", 10)?.seed(7).start()?;
//! run.advance(500)?;
//! println!("{:#}", run.metrics());
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! Robots that wander in an office, whose metrics the world's own type has with their types:
//!
//! ```
//! use sidestep::worlds::robots::RobotsRun;
//!
//! let office = sidestep::parse(r#"
//!     format = 1
//!     world = "robots"
//!     map = { office = { corridors = 1, rooms_per_side = 2 } }
//!     robots = { count = 4, size = 2, sensors = ["sonar-8"], effector = "nomad" }
//! "#);
//! let mut run = office.start()?;
//! run.advance(500)?;
//! let metrics = run.downcast::<RobotsRun>().expect("robots").metrics();
//! assert_eq!(metrics.total.actions, 4 * 500);
//! assert!(metrics.coverage > 0.0);
//!
//! // The number of workers is no part of the result.
//! let mut serial = office.workers(1).start()?;
//! serial.advance(500)?;
//! assert_eq!(serial.digest(), run.digest());
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! A chain whose first connector follows a task, and the rows that the run recorded:
//!
//! ```
//! let chain = sidestep::parse(r#"
//!     format = 1
//!     world = "chain"
//!     [[chains]]
//!     connectors = 3
//!     at_m = [0.0, 0.0]
//!     rod_m = 0.7
//!     tasks = [{ kind = "targets", targets_m = [[-1.0, 1.0]] }]
//! "#);
//! let mut run = chain.keep_tables().start()?;
//! run.advance(100)?;
//! assert!(!run.tables()?.is_empty());
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! Airplanes on their way to one point, by two methods:
//!
//! ```
//! let flight = sidestep::parse(r#"
//!     format = 1
//!     world = "airspace"
//!     airspace = { method = "pc", generator = { kind = "superconflict", n = 4 } }
//! "#);
//! let collective = flight.clone().start()?.finish()?;
//! let velocity_obstacles = flight.set("airspace.method", "orca")?.start()?.finish()?;
//! assert_eq!(collective.metrics["arrived"], 4);
//! assert_ne!(collective.digest, velocity_obstacles.digest);
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! Wrong input is an error that reports its position and a remedy, and [`Scenario::check`] finds all mistakes:
//!
//! ```
//! let text = "format = 1\nworld = \"robots\"\nsede = 7\n[map]\nascii = \"....\"\n[robots]\ncount = -1\n";
//! let problems = sidestep::parse(text).check().unwrap_err();
//! assert_eq!(problems.0.len(), 2);
//! assert_eq!(problems.0[0].line_and_column(), Some((3, 1)));
//! assert_eq!(problems.0[0].remedy(), "did you mean `seed`?");
//! ```
//!
//! # Parts of your own
//!
//! Each is one trait, registered by a name that scenarios call it by:
//!
//! | world | trait | registered by | named in a scenario by |
//! |---|---|---|---|
//! | robots | [`Behaviour`](worlds::robots::decide::Behaviour) | `Robots::with_behaviour` | `robots.behaviour.kind` |
//! | airplanes | [`Method`](worlds::airspace::method::Method) | `Airspace::with_method` | `airspace.method` |
//! | chains | [`Driver`](worlds::chain::Driver) | `Chains::with_driver` | `chains.tasks.kind` |
//! | chains | [`Reaction`](worlds::chain::Reaction) | `Chains::with_reaction` | `chain.rotation` |
//!
//! The list of worlds with such parts is all that the command line needs (`sidestep_cli::main_with`) to check, run,
//! record, resume, sweep and show such scenarios.
//!
//! ```
//! use sidestep::Scenario;
//! use sidestep::kernel::stream::Draws;
//! use sidestep::worlds::WORLDS;
//! use sidestep::worlds::robots::Robots;
//! use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept};
//! use sidestep::worlds::robots::effector::FORWARD;
//!
//! #[derive(Debug)]
//! struct Ahead;
//!
//! impl Behaviour for Ahead {
//!     fn decide(&self, _: &Percept<'_>, _: &mut Memory, _: &mut Draws) -> Decision {
//!         FORWARD.into()
//!     }
//! }
//!
//! let worlds = WORLDS.clone().with(Robots::new().with_behaviour("ahead", Ahead));
//! let text = r#"
//!     format = 1
//!     world = "robots"
//!     map = { ascii = "......" }
//!     robots = { count = 1, behaviour = { kind = "ahead" } }
//! "#;
//! Scenario::parse(&worlds, text).start()?.advance(10)?;
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! A method sees its airplane and those around it, and the shield is over it as over all methods; a driver proposes the
//! motion of a chain's initiator; a reaction is how each connector passes a motion on, or vetoes it:
//!
//! ```
//! use sidestep::Scenario;
//! use sidestep::rods::{VetoReason, geometry::Point};
//! use sidestep::worlds::WORLDS;
//! use sidestep::worlds::chain::{Chains, MasterMove, Reaction};
//!
//! /// Never turns a rod: a connector that is in the way of something vetoes.
//! #[derive(Debug)]
//! struct Straight;
//!
//! impl Reaction for Straight {
//!     fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
//!         percept.check(percept.guided_m)?;
//!         Ok(percept.guided_m)
//!     }
//! }
//!
//! let worlds = WORLDS.clone().with(Chains::new().with_reaction("straight", Straight));
//! let text = r#"
//!     format = 1
//!     world = "chain"
//!     chain = { rotation = "straight" }
//!     chains = { connectors = 4, at_m = [0.0, 0.0], rod_m = 0.5, tasks = [{ kind = "wander" }] }
//! "#;
//! Scenario::parse(&worlds, text).start()?.advance(10)?;
//! # Ok::<(), sidestep::Error>(())
//! ```
//!
//! `crates/sidestep/examples/` has an example of each of these, of a first run, a sweep, and inverse kinematics.
//!
//! # Modules
//!
//! ```text
//! worlds       the list of worlds, and each of them
//! experiment   many runs and sweeps, and their results with confidence intervals
//! session      runs that are recorded, resumed, replayed, filmed, exported and reported
//! arms         arms: URDF -> joints, inverse kinematics, plans
//! rods         chains of constraints: one motion through all parts
//! learn        logs of a real robot -> error tables that a scenario loads
//! error_models sensors and effectors that err, as plain types
//! exact        the Markov chain of one robot, computed without random draws
//! scenario     TOML text + overrides -> typed sections, and errors with positions
//! import       ROS, MovingAI, CARMEN, MRCLAM and BlueSky files; URDF
//! map          floors of boxes, generated offices, paths on them
//! statistics   intervals, tests, and when there are enough runs
//! collectives  probability collectives for any finite game
//! document     reports as plain data
//! kernel       the cycle, workers, random streams, digests, checkpoints, recorder port
//! ```
//!
//! Each is a crate of its own. Programs that write no files depend on `sidestep-experiment` and the crates of worlds
//! instead.

mod builder;
mod run;
pub mod worlds;

pub use builder::{Problems, Scenario, load, parse};
pub use run::{Run, Table};
pub use sidestep_arms as arms;
pub use sidestep_collectives as collectives;
pub use sidestep_document as document;
pub use sidestep_error_models as error_models;
pub use sidestep_exact as exact;
pub use sidestep_experiment as experiment;
pub use sidestep_import as import;
pub use sidestep_kernel as kernel;
pub use sidestep_learn as learn;
pub use sidestep_map as map;
pub use sidestep_map::{Cell, GridMap, office, planning};
pub use sidestep_planners as planners;
pub use sidestep_rods as rods;
pub use sidestep_scenario as scenario;
pub use sidestep_session as session;
pub use sidestep_session::{Error, VERSION};
pub use sidestep_statistics as statistics;

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
        // Experiments use it, and no world does.
        assert!(text("statistics/src/lib.rs").contains("interval"));
        assert!(!found.iter().any(|(name, _)| name.starts_with("session/")));
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
