//! A run as a recording for viewers.

use super::FrameSink;
use crate::Error;
use crate::VERSION;
use sidestep_kernel::Cycle;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::FrameOptions;
use sidestep_record::{McapFooter, McapProvenance, McapRecorder, Provenance, Status};
use sidestep_scenario::ResolvedScenario;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The bodies of which scans are recorded; further scans are left out: each has its own topic, and
/// reading sensors for a scan costs as much as simulating.
pub(crate) const FRAME_OPTIONS: FrameOptions = FrameOptions::with_first_scans(64);

/// The reason why a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndReason {
    /// The run is complete.
    Complete,
    /// The requested part of the run is complete.
    Extract,
    /// The run was stopped: the file name keeps the ending `.partial`.
    Stopped,
}

/// An MCAP file that is written while a run advances.
pub struct McapSink {
    recorder: McapRecorder,
    every: Cycle,
    elapsed: Duration,
}

impl McapSink {
    /// Starts a new file at `path`; from now on it records the run, which `build` makes.
    ///
    /// # Errors
    /// An I/O error.
    pub fn start(
        path: &Path,
        every: Cycle,
        resolved: ResolvedScenario,
        run: &mut dyn Simulation,
        build: &str,
    ) -> Result<Self, Error> {
        let plan = run.config();
        // Sorted, so that the same run gives the same bytes.
        let mut files = resolved.files;
        files.sort();
        let about = McapProvenance {
            world: run.world_name().into(),
            build: build.into(),
            origin: Provenance {
                program_version: VERSION.into(),
                scenario: resolved.text,
                seed: plan.seed,
            },
            files,
            cycles_planned: plan.cycles,
            every,
        };
        let recorder = McapRecorder::create(path, about, &run.scenery())?;
        run.enable_events();
        Ok(Self { recorder, every, elapsed: Duration::ZERO })
    }

    /// Finishes the file and returns its name.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(self, run: &dyn Simulation, ending: EndReason) -> Result<PathBuf, Error> {
        let status = match ending {
            EndReason::Complete => Status::Complete,
            EndReason::Extract | EndReason::Stopped => Status::Incomplete,
        };
        let end = McapFooter { status, cycles_done: run.cycle(), digest: run.digest().to_string() };
        Ok(match ending {
            EndReason::Stopped => self.recorder.stop(&end)?,
            EndReason::Complete | EndReason::Extract => self.recorder.finish(&end)?,
        })
    }

    /// Returns the time spent so far.
    pub fn elapsed(&self) -> Duration {
        self.elapsed
    }
}

impl FrameSink for McapSink {
    fn interval(&self) -> Cycle {
        self.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let started = Instant::now();
        self.recorder.write_frame(&run.frame(FRAME_OPTIONS))?;
        self.elapsed += started.elapsed();
        Ok(())
    }
}
