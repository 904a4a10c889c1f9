//! A run as a recording for viewers.

use super::Film;
use crate::Error;
use crate::identity::build;
use sidestep::VERSION;
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::Look;
use sidestep::scenario::Resolved;
use sidestep_record::{McapEnd, McapOrigin, McapRecorder, Origin, Status};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The bodies of which scans are recorded; further scans are left out: each has its own topic, and
/// reading sensors for a scan costs as much as simulating.
pub(crate) const LOOK: Look = Look::first(64);

/// The reason why a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The run is complete.
    Complete,
    /// The requested part of the run is complete.
    Extract,
    /// The run was stopped: the file name keeps the ending `.partial`.
    Stopped,
}

/// An MCAP file that is written while a run advances.
pub struct McapFilm {
    recorder: McapRecorder,
    every: Cycle,
    took: Duration,
}

impl McapFilm {
    /// Starts a new file at `path`; from now on it records the run.
    ///
    /// # Errors
    /// An I/O error.
    pub fn begin(
        path: &Path,
        every: Cycle,
        resolved: Resolved,
        run: &mut dyn Simulation,
    ) -> Result<Self, Error> {
        let plan = run.plan();
        let mut files = resolved.files;
        files.sort();
        let about = McapOrigin {
            world: run.world().into(),
            build: build().into(),
            origin: Origin {
                program_version: VERSION.into(),
                scenario: resolved.text,
                seed: plan.seed,
            },
            files,
            cycles_planned: plan.cycles,
            every,
        };
        let recorder = McapRecorder::create(path, about, &run.scenery())?;
        run.watch();
        Ok(Self { recorder, every, took: Duration::ZERO })
    }

    /// Finishes the file and returns its name.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(self, run: &dyn Simulation, ending: Ending) -> Result<PathBuf, Error> {
        let status = match ending {
            Ending::Complete => Status::Complete,
            Ending::Extract | Ending::Stopped => Status::Incomplete,
        };
        let (cycles_done, digest) = (run.cycle(), run.digest().to_string());
        let end = McapEnd { status, cycles_done, digest };
        Ok(match ending {
            Ending::Stopped => self.recorder.stop(&end)?,
            Ending::Complete | Ending::Extract => self.recorder.finish(&end)?,
        })
    }

    /// Returns the time spent so far.
    pub fn took(&self) -> Duration {
        self.took
    }
}

impl Film for McapFilm {
    fn every(&self) -> Cycle {
        self.every
    }

    fn shoot(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let started = Instant::now();
        self.recorder.frame(&run.frame(LOOK))?;
        self.took += started.elapsed();
        Ok(())
    }
}
