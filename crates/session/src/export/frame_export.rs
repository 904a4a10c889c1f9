//! A file that another crate makes of the frames of a recorded run.

use super::target::Target;
use super::{CycleRange, ExportContext, ExportResult, ExportScope};
use crate::driver::Sinks;
use crate::{Error, FrameSink, RecordedRun, Watcher};
use sidestep_kernel::{Cycle, Simulation};
use std::io::Write;

/// An export whose part and place were checked before anything is computed.
pub struct FrameExport<'a> {
    job: ExportContext<'a>,
    target: Target,
}

impl<'a> FrameExport<'a> {
    /// Checks the part and the place: the requested file, or one beside the run with its name and `ending`.
    ///
    /// # Errors
    /// When nothing is recorded, the part is wrong, or the file exists and may not be replaced.
    pub fn check(
        recorded: &'a RecordedRun,
        scope: &'a ExportScope<'a>,
        ending: &str,
        watcher: &'a dyn Watcher,
    ) -> Result<Self, Error> {
        recorded.check_has_content()?;
        let span = CycleRange::from_request(scope, recorded)?;
        let job = ExportContext { recorded, wanted: scope, span, watcher };
        let target = Target::for_file(&job, ending)?;
        Ok(Self { job, target })
    }

    /// Returns the first and the last cycle of the part.
    pub fn cycles(&self) -> (Cycle, Cycle) {
        (self.job.span.from, self.job.span.until)
    }

    /// Returns the run at the first cycle of the part.
    ///
    /// # Errors
    /// When another build made the recording, its scenario is no longer valid, or the watcher asked to stop.
    pub fn start(&self) -> Result<Box<dyn Simulation>, Error> {
        self.job.run_up_to(self.job.span.from)
    }

    /// Drives the run to the last cycle of the part; returns whether it has the recorded digest there.
    ///
    /// # Errors
    /// Those of the sink; when the digests differ, or the watcher asked to stop.
    pub fn drive(&self, run: &mut dyn Simulation, sink: &mut dyn FrameSink) -> Result<bool, Error> {
        let sinks = Sinks { frames: Some(sink), ..Sinks::default() };
        self.job.drive(run, self.job.span.until, sinks)?;
        self.job.recorded.verify_digest(run)
    }

    /// Writes the file, and its list.
    ///
    /// # Errors
    /// When it cannot be stored; nothing is left then.
    pub fn write(&self, bytes: &[u8], is_confirmed: bool) -> Result<ExportResult, Error> {
        self.target.write_stream(|file| file.write_all(bytes))?;
        Ok(ExportResult::single_file(self.target.path(), is_confirmed))
    }
}
