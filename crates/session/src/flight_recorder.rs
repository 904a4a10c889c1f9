//! The recorder of a flight in real time: its rows are on disk within a second, and no cycle waits for the disk.
//!
//! A thread writes the rows. The run only copies them to a queue; twice a second the thread seals the tables, and writes
//! to `run.json` how far they reach. So whatever ends the process, and whenever, all rows up to the last second are
//! in tables that every command reads.

use sidestep_kernel::Cycle;
use sidestep_kernel::ports::{ColumnValues, RecordError, Recorder};
use sidestep_record::{FlightProgress, ParquetRecorder};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two seals: half of the second that may be lost, so that a cycle and the disk have the other half.
const SEAL_INTERVAL: Duration = Duration::from_millis(500);

/// A job for the thread.
enum WriterJob {
    Append(usize, Vec<ColumnValues>),
    /// All rows so far belong to cycles before this one.
    Seal(Cycle),
    Finish,
}

/// What the thread tells the run.
#[derive(Default)]
struct WriterState {
    /// Whether a seal waits or is under way.
    is_sealing: AtomicBool,
    /// The reason why nothing is written any more.
    error: Mutex<Option<RecordError>>,
}

impl WriterState {
    fn error(&self) -> std::sync::MutexGuard<'_, Option<RecordError>> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Hands the rows of a flight to the thread that writes them.
pub struct FlightRecorder {
    /// `None` once all is written.
    jobs: Option<Sender<WriterJob>>,
    thread: Option<JoinHandle<()>>,
    state: Arc<WriterState>,
    seal_at: Instant,
    /// The cycle before which all rows handed over are.
    cycle: Cycle,
}

impl FlightRecorder {
    /// Starts the thread; `progress` is that of the run, where these are its own tables.
    pub fn start(recorder: ParquetRecorder, progress: Option<FlightProgress>) -> Self {
        let (jobs, received) = channel();
        let state = Arc::new(WriterState::default());
        let of_thread = state.clone();
        let thread = std::thread::spawn(move || {
            let recorder = recorder.with_growing_parts();
            if let Err(error) = write_all(&received, recorder, progress, &of_thread) {
                *of_thread.error() = Some(error);
            }
        });
        let seal_at = Instant::now() + SEAL_INTERVAL;
        Self { jobs: Some(jobs), thread: Some(thread), state, seal_at, cycle: 0 }
    }

    /// Asks the thread to make all rows so far durable, if it is time or `is_asked` for; not if it still does so.
    ///
    /// # Errors
    /// What the thread could not write.
    pub fn seal_if_due(&mut self, cycle: Cycle, is_asked: bool) -> Result<(), RecordError> {
        self.cycle = cycle;
        let is_due = is_asked || Instant::now() >= self.seal_at;
        if is_due && !self.state.is_sealing.swap(true, Ordering::AcqRel) {
            self.seal_at = Instant::now() + SEAL_INTERVAL;
            return self.send(WriterJob::Seal(cycle));
        }
        Ok(())
    }

    fn send(&self, job: WriterJob) -> Result<(), RecordError> {
        let is_sent = self.jobs.as_ref().is_some_and(|jobs| jobs.send(job).is_ok());
        if is_sent { Ok(()) } else { Err(self.failure()) }
    }

    /// Returns why the thread has ended.
    fn failure(&self) -> RecordError {
        match &*self.state.error() {
            Some(RecordError { place, cause }) => RecordError::new(place, cause),
            None => RecordError::new("the tables of the flight", "their writer has ended"),
        }
    }

    /// Waits until the thread has done all of its jobs.
    fn join(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Recorder for FlightRecorder {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        self.send(WriterJob::Append(table, block.to_vec()))
    }

    fn make_durable(&mut self, next_cycle: Cycle) -> Result<(), RecordError> {
        self.cycle = next_cycle;
        self.send(WriterJob::Seal(next_cycle))
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.send(WriterJob::Finish)?;
        self.join();
        match self.state.error().take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

impl Drop for FlightRecorder {
    /// A flight that ends by an error keeps its last rows, too.
    fn drop(&mut self) {
        if self.jobs.is_some() {
            let _ = self.send(WriterJob::Seal(self.cycle));
            self.join();
        }
    }
}

/// Does the jobs of a flight.
///
/// # Errors
/// An I/O error; later rows are not written.
fn write_all(
    jobs: &Receiver<WriterJob>,
    mut recorder: ParquetRecorder,
    mut progress: Option<FlightProgress>,
    state: &WriterState,
) -> Result<(), RecordError> {
    while let Ok(job) = jobs.recv() {
        match job {
            WriterJob::Append(table, block) => recorder.append(table, &block)?,
            WriterJob::Seal(cycle) => {
                recorder.make_durable(cycle)?;
                progress.as_mut().map_or(Ok(()), |progress| progress.save(cycle))?;
                state.is_sealing.store(false, Ordering::Release);
            }
            WriterJob::Finish => return recorder.finish(),
        }
    }
    Ok(())
}
