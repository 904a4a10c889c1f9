#![deny(clippy::disallowed_methods)]
//! Experiments: many runs under controlled differences, compared with confidence intervals; and all problems of a
//! scenario, not the first alone.
//!
//! [`sweep`] runs many variants of one scenario, each with many seeds, and summarizes the results as
//! tables and figures: plain data of `sidestep_document`, which other crates draw. [`problems()`] reports everything
//! that is wrong with a scenario.
//!
//! Nothing here knows a world, writes a file or starts a process: functions that need the list of worlds take
//! [`Worlds`](sidestep_scenario::Worlds).

mod problems;
pub mod sweep;

pub use problems::{MAX_PROBLEMS, problems};

#[cfg(test)]
mod testing {
    use sidestep_airspace::Airspace;
    use sidestep_chain::Chains;
    use sidestep_robots::Robots;
    use sidestep_scenario::Worlds;

    /// Returns the worlds whose scenarios the tests sweep.
    pub(crate) fn worlds() -> Worlds {
        Worlds::new("tests").with(Robots::new()).with(Airspace::new()).with(Chains::new())
    }
}
