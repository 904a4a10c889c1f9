//! Files that another crate makes of the frames of recorded runs.

use super::target::Target;
use super::{CycleRange, ExportContext, ExportResult, ExportScope};
use crate::driver::Sinks;
use crate::{Error, FrameSink, PictureLook, RecordedRun, Watcher};
use sidestep_kernel::{Cycle, InputError, Simulation};
use std::io::Write;
use std::path::Path;

/// A part of a recorded run whose frames are taken.
pub struct FrameSource<'a> {
    job: ExportContext<'a>,
}

impl<'a> FrameSource<'a> {
    /// Checks the part, before anything is computed.
    ///
    /// # Errors
    /// When nothing is recorded, or the part is wrong.
    pub fn check(
        recorded: &'a RecordedRun,
        scope: &'a ExportScope<'a>,
        watcher: &'a dyn Watcher,
    ) -> Result<Self, Error> {
        recorded.check_has_content()?;
        let span = CycleRange::from_request(scope, recorded)?;
        Ok(Self {
            job: ExportContext {
                recorded,
                wanted: scope,
                look: PictureLook::default(),
                span,
                watcher,
            },
        })
    }

    /// Returns the run that was recorded.
    pub fn recorded(&self) -> &RecordedRun {
        self.job.recorded
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
}

/// A folder that does not exist yet, or may be replaced.
pub struct ExportPlace {
    target: Target,
}

impl ExportPlace {
    /// Checks the place: the requested folder, or one beside a recorded run or a sweep with its name and `ending`.
    ///
    /// # Errors
    /// When the folder exists and may not be replaced, or is the recording itself.
    pub fn check(
        recorded: &Path,
        scope: &ExportScope<'_>,
        ending: &str,
    ) -> Result<Self, InputError> {
        Ok(Self { target: Target::for_folder_beside(recorded, scope, ending)? })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        self.target.path()
    }

    /// Creates the folder: `fill` gets one with another name, which takes its place once it is whole, with a list of its
    /// files.
    ///
    /// # Errors
    /// Those of `fill`; an I/O error. Nothing is left then.
    pub fn write<T>(
        &self,
        watcher: &dyn Watcher,
        fill: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.target.write_folder(watcher, fill)
    }
}

/// A file that does not exist yet, or may be replaced.
pub struct ExportFile {
    target: Target,
}

impl ExportFile {
    /// Checks the place: the requested file, or one beside the run with its name and `ending`.
    ///
    /// # Errors
    /// When the file exists and may not be replaced, or is the recording itself.
    pub fn check(source: &FrameSource<'_>, ending: &str) -> Result<Self, Error> {
        Ok(Self { target: Target::for_file(&source.job, ending)? })
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
