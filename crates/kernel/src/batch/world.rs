//! One world of a batch: its run, the observations of its agents, and its error.

use super::{BatchError, SimulationFactory};
use crate::control::{BufferMut, OrderError, Team};
use crate::simulation::Simulation;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// One of the worlds.
pub(super) struct BatchWorld {
    pub(super) seed: u64,
    /// `None` for one that broke off, or never started.
    pub(super) run: Option<Box<dyn Simulation>>,
    /// Its error, until it is returned to the caller.
    pub(super) error: Option<BatchError>,
    /// Observations of its agents, for the caller to take.
    room: Vec<ObservationBuffer>,
    has_observed: bool,
}

/// The values of one space: what they are, and how many.
#[derive(Clone, Copy)]
pub(super) struct BufferLayout {
    pub(super) is_integer: bool,
    pub(super) length: usize,
}

/// Values of one space.
enum ObservationBuffer {
    Integer(Vec<i64>),
    Real(Vec<f64>),
}

impl BatchWorld {
    /// Returns a world that has not started.
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, run: None, error: None, room: Vec::new(), has_observed: false }
    }

    /// Returns the error of a world without a run.
    pub(super) fn no_run_error(&self, index: usize) -> BatchError {
        self.error.clone().unwrap_or_else(|| BatchError::Broken {
            world: index,
            seed: self.seed,
            cycle: 0,
            cause: "it never started".into(),
        })
    }

    /// Works with the run; keeps the error, and drops the run if it panics.
    pub(super) fn with_run(
        &mut self,
        index: usize,
        work: impl FnOnce(&mut dyn Simulation) -> Result<(), OrderError>,
    ) {
        let Some(run) = self.run.as_deref_mut() else { return };
        let cycle = run.cycle();
        match catch_unwind(AssertUnwindSafe(|| work(run))) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => self.error = Some(BatchError::Order { world: index, error }),
            Err(payload) => {
                self.run = None;
                let (seed, cause) = (self.seed, panic_message(&*payload));
                self.error = Some(BatchError::Broken { world: index, seed, cycle, cause });
            }
        }
    }

    /// Starts the world again; it stays the same if that fails.
    pub(super) fn restart(
        &mut self,
        index: usize,
        seed: u64,
        start: &SimulationFactory,
        teams: Option<&[Team]>,
    ) {
        let started = catch_unwind(AssertUnwindSafe(|| start(seed)));
        let refused = match started {
            Ok(Ok(run)) if teams.is_some_and(|teams| *run.teams() != *teams) => {
                BatchError::Shape { world: index }
            }
            Ok(Ok(run)) => {
                (self.run, self.seed, self.error) = (Some(run), seed, None);
                return;
            }
            Ok(Err(error)) => BatchError::Start { world: index, seed, error },
            Err(payload) => {
                let (cycle, cause) = (0, panic_message(&*payload));
                self.run = None;
                BatchError::Broken { world: index, seed, cycle, cause }
            }
        };
        // For a broken world this replaces the older reason, which the restart did not fix.
        self.error = Some(refused);
    }

    /// Observes into its own room.
    pub(super) fn observe(&mut self, index: usize, team: usize, spaces: &[BufferLayout]) {
        let mut room = std::mem::take(&mut self.room);
        if room.len() != spaces.len() || !room.iter().zip(spaces).all(|(room, &s)| room.fits(s)) {
            room = spaces.iter().map(|&space| ObservationBuffer::new(space)).collect();
        }
        let mut cells: Vec<BufferMut<'_>> =
            room.iter_mut().map(ObservationBuffer::as_mut).collect();
        self.with_run(index, |run| run.observe(team, &mut cells));
        (self.room, self.has_observed) = (room, true);
    }

    /// Copies its observations into its part of the caller's room.
    pub(super) fn copy_observations(&mut self, parts: &mut [BufferMut<'_>]) {
        if !std::mem::take(&mut self.has_observed) {
            return;
        }
        for (from, to) in self.room.iter().zip(parts) {
            match (from, to) {
                (ObservationBuffer::Integer(from), BufferMut::Integer(to)) => {
                    to.copy_from_slice(from)
                }
                (ObservationBuffer::Real(from), BufferMut::Real(to)) => to.copy_from_slice(from),
                _ => {}
            }
        }
    }
}

impl ObservationBuffer {
    fn new(space: BufferLayout) -> Self {
        match space.is_integer {
            true => Self::Integer(vec![0; space.length]),
            false => Self::Real(vec![0.0; space.length]),
        }
    }

    fn fits(&self, space: BufferLayout) -> bool {
        match self {
            Self::Integer(cells) => space.is_integer && cells.len() == space.length,
            Self::Real(cells) => !space.is_integer && cells.len() == space.length,
        }
    }

    fn as_mut(&mut self) -> BufferMut<'_> {
        match self {
            Self::Integer(cells) => BufferMut::Integer(cells),
            Self::Real(cells) => BufferMut::Real(cells),
        }
    }
}

/// Returns the message of a panic.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_string());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "without a message".into())
}
