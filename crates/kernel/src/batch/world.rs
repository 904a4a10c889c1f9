//! One world of a batch: its run, the observations of its agents, and its error.

use super::{BatchError, SimulationFactory};
use crate::control::{AgentTeam, BufferMut, OrderError};
use crate::simulation::Simulation;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A world behind its lock: any worker may work on it, one at a time.
pub(super) struct BatchWorldEntry {
    pub(super) seed: u64,
    /// `None` if it panicked, or never started.
    pub(super) run: Option<Box<dyn Simulation>>,
    /// Its error, until it is returned to the caller.
    pub(super) error: Option<BatchError>,
    /// Observations of its agents, filled on a thread that cannot borrow the caller's buffers. Kept between calls,
    /// because a batch is observed after every step.
    buffers: Vec<ObservationBuffer>,
    /// Whether the buffers hold observations that were not copied to the caller yet.
    has_observations: bool,
}

/// Type and number of one world's values in one space.
#[derive(Clone, Copy)]
pub(super) struct BufferLayout {
    pub(super) is_integer: bool,
    pub(super) length: usize,
}

/// One world's values in one space.
enum ObservationBuffer {
    Integer(Vec<i64>),
    Real(Vec<f64>),
}

impl BatchWorldEntry {
    /// Returns a world that has not started.
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, run: None, error: None, buffers: Vec::new(), has_observations: false }
    }

    /// Returns the teams of its agents; none without a run.
    pub(super) fn agent_teams(&self) -> &[AgentTeam] {
        self.run.as_ref().map_or(&[], |run| run.agent_teams())
    }

    /// A world without a run keeps its error, so the other answer would mean that the error was lost.
    pub(super) fn broken_world_error(&self, index: usize) -> BatchError {
        self.error.clone().unwrap_or_else(|| BatchError::Broken {
            world: index,
            seed: self.seed,
            cycle: 0,
            cause: "it never started".into(),
        })
    }

    /// Works with the run; keeps the error, and drops the run if it panics.
    pub(super) fn apply_to_run(
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
                self.error = Some(BatchError::Broken {
                    world: index,
                    seed: self.seed,
                    cycle,
                    cause: panic_message(&*payload),
                });
            }
        }
    }

    /// Starts the world again. It stays the same if the seed is refused or the teams differ from `teams`, where given;
    /// a panic breaks it.
    pub(super) fn restart(
        &mut self,
        index: usize,
        seed: u64,
        factory: &SimulationFactory,
        teams: Option<&[AgentTeam]>,
    ) {
        let started = catch_unwind(AssertUnwindSafe(|| factory(seed)));
        let error = match started {
            Ok(Ok(run)) if teams.is_some_and(|teams| *run.agent_teams() != *teams) => {
                BatchError::Shape { world: index }
            }
            Ok(Ok(run)) => {
                self.run = Some(run);
                self.seed = seed;
                self.error = None;
                return;
            }
            Ok(Err(error)) => BatchError::Start { world: index, seed, error },
            Err(payload) => {
                self.run = None;
                let cause = panic_message(&*payload);
                BatchError::Broken { world: index, seed, cycle: 0, cause }
            }
        };
        // For a broken world this replaces the older reason, which the restart did not fix.
        self.error = Some(error);
    }

    /// Observes into its own buffers, for [`Self::copy_observations`] on the calling thread.
    pub(super) fn observe(&mut self, index: usize, team: usize, layouts: &[BufferLayout]) {
        let mut buffers = std::mem::take(&mut self.buffers);
        let fits = buffers.len() == layouts.len()
            && buffers.iter().zip(layouts).all(|(buffer, &layout)| buffer.matches_layout(layout));
        // Another team than in the call before.
        if !fits {
            buffers = layouts.iter().map(|&layout| ObservationBuffer::new(layout)).collect();
        }
        let mut borrowed: Vec<BufferMut<'_>> =
            buffers.iter_mut().map(ObservationBuffer::as_mut).collect();
        self.apply_to_run(index, |run| run.observe(team, &mut borrowed));
        self.buffers = buffers;
        self.has_observations = true;
    }

    /// Copies its observations into its part of the caller's buffers, if it was observed into its own.
    pub(super) fn copy_observations(&mut self, slices: &mut [BufferMut<'_>]) {
        if !std::mem::take(&mut self.has_observations) {
            return;
        }
        for (from, to) in self.buffers.iter().zip(slices) {
            match (from, to) {
                (ObservationBuffer::Integer(from), BufferMut::Integer(to)) => {
                    to.copy_from_slice(from)
                }
                (ObservationBuffer::Real(from), BufferMut::Real(to)) => to.copy_from_slice(from),
                // `Batch::check_buffers` has compared the types.
                _ => {}
            }
        }
    }
}

impl ObservationBuffer {
    fn new(layout: BufferLayout) -> Self {
        if layout.is_integer {
            Self::Integer(vec![0; layout.length])
        } else {
            Self::Real(vec![0.0; layout.length])
        }
    }

    fn matches_layout(&self, layout: BufferLayout) -> bool {
        match self {
            Self::Integer(values) => layout.is_integer && values.len() == layout.length,
            Self::Real(values) => !layout.is_integer && values.len() == layout.length,
        }
    }

    fn as_mut(&mut self) -> BufferMut<'_> {
        match self {
            Self::Integer(values) => BufferMut::Integer(values),
            Self::Real(values) => BufferMut::Real(values),
        }
    }
}

/// Returns the message of a panic: `panic!` carries a `&str` or, with arguments, a `String`.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&str>() {
        (*text).to_string()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else {
        "without a message".into()
    }
}
