//! A run taken back to a checkpoint, and the rows recorded on the branch that is thereby abandoned.

use super::ManagedRun;
use sidestep_kernel::Cycle;
use sidestep_kernel::checkpoint::{CheckpointError, decode_header};
use sidestep_kernel::control::{MultiAgentOrder, OrderError};
use sidestep_kernel::ports::RecordError;

/// The reason why a run cannot continue from a checkpoint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// It is damaged, or belongs to another world, scenario or version.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Rows that wait cannot be handed over.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Stored rows cannot be taken back.
    #[error(
        "the run goes to {place}, which holds one past: it stands at cycle {now}, and the checkpoint is of {state}"
    )]
    AlreadyStored {
        /// The folder or file that has the rows.
        place: String,
        /// The cycle at which the run stands.
        now: Cycle,
        /// The cycle of the checkpoint, in words.
        state: String,
    },
    /// Rows kept in memory have a different past from the checkpoint.
    #[error(
        "rows are kept from cycle {from} on, of one past: the run stands at cycle {now}, and the checkpoint of cycle {of} \
         is not known to be of this past"
    )]
    UnknownHistory {
        /// The cycle from which on rows are kept.
        from: Cycle,
        /// The cycle at which the run stands.
        now: Cycle,
        /// The cycle of the checkpoint.
        of: Cycle,
    },
}

impl ManagedRun {
    /// Gives agents an order for the next cycle, see [`order`](sidestep_kernel::Simulation::order).
    ///
    /// # Errors
    /// An order that cannot be obeyed; nothing is ordered then.
    pub fn order(&mut self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.run.order(orders)?;
        self.ordered_at = Some(self.run.cycle());
        Ok(())
    }

    /// Returns the present state as bytes for [`Self::restore`].
    ///
    /// # Errors
    /// When rows that wait cannot be handed over.
    pub fn checkpoint(&mut self) -> Result<Vec<u8>, RecordError> {
        let bytes = self.run.checkpoint();
        self.record_checkpoint(&bytes)?;
        Ok(bytes)
    }

    /// Remembers a checkpoint of the present state: rows kept in memory may go back to it.
    fn record_checkpoint(&mut self, checkpoint: &[u8]) -> Result<(), RecordError> {
        let Some(rows) = &mut self.rows else { return Ok(()) };
        let now = self.run.cycle();
        if self.ordered_at == Some(now) {
            // Waiting orders have their rows already, and both come back together.
            self.run.record(rows)?;
        }
        rows.add_checkpoint(checkpoint, now);
        Ok(())
    }

    /// Continues from a checkpoint of the same scenario. Rows and frames kept in memory lose those of its cycle and of
    /// later ones, as if the run had never gone there; those taken before are up to the caller. While there are
    /// some of earlier cycles, it must be a checkpoint that this run made before, or the present state.
    ///
    /// # Errors
    /// When the checkpoint is damaged or belongs to another world, scenario or version; when rows of another past are
    /// kept; when the run is stored in a folder or file and the checkpoint is not its present state. The run then
    /// stays as it is.
    pub fn restore(&mut self, checkpoint: &[u8]) -> Result<(), RestoreError> {
        // All checks come before the first change, so that a run that is refused stays as it is.
        if self.rows.is_some() || self.recording.is_some() || self.mcap.is_some() {
            let present = self.run.checkpoint();
            if present == checkpoint {
                return Ok(self.record_checkpoint(checkpoint)?);
            }
            let header = decode_header(checkpoint)?;
            header.check_compatibility(&decode_header(&present)?)?;
            self.check_not_stored(header.cycle)?;
            self.check_history(checkpoint, header.cycle)?;
        }
        if let Some(rows) = &mut self.rows {
            // Waiting rows belong to past cycles.
            self.run.record(rows)?;
        }
        self.run.restore(checkpoint)?;
        Ok(self.drop_later_rows(checkpoint)?)
    }

    /// Refuses a different state of a stored run: its rows would be stored after those of an abandoned past.
    fn check_not_stored(&self, of: Cycle) -> Result<(), RestoreError> {
        let place = if let Some(recording) = &self.recording {
            format!("the folder {}", recording.folder().path().display())
        } else if self.mcap.is_some() {
            "an MCAP file".to_string()
        } else {
            return Ok(());
        };
        let now = self.run.cycle();
        let state =
            if of == now { "another state there".to_string() } else { format!("cycle {of}") };
        Err(RestoreError::AlreadyStored { place, now, state })
    }

    /// Refuses a checkpoint with a different past from the kept rows: they would be rows of two pasts.
    fn check_history(&self, checkpoint: &[u8], of: Cycle) -> Result<(), RestoreError> {
        let Some(rows) = &self.rows else { return Ok(()) };
        let now = self.run.cycle();
        if rows.is_consistent_with(checkpoint, of, now) {
            return Ok(());
        }
        Err(RestoreError::UnknownHistory { from: rows.first_cycle(), now, of })
    }

    /// Drops the rows and frames from the present cycle on, after a checkpoint was restored.
    fn drop_later_rows(&mut self, checkpoint: &[u8]) -> Result<(), RecordError> {
        let Some(rows) = &mut self.rows else { return Ok(()) };
        let now = self.run.cycle();
        let has_orders = rows.rewind(checkpoint, now)?;
        self.ordered_at = has_orders.then_some(now);
        if let Some(frames) = &mut self.frames {
            frames.rewind(rows.first_cycle()..now);
        }
        Ok(())
    }
}
