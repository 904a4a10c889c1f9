//! One world of a batch: its run, the observations of its agents, and its error.

use super::{BatchError, Start};
use crate::control::{CellsMut, OrderError, Team};
use crate::simulation::Simulation;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// One of the worlds.
pub(super) struct World {
    pub(super) seed: u64,
    /// `None` for one that broke off, or never started.
    pub(super) run: Option<Box<dyn Simulation>>,
    /// Its error, until it is returned to the caller.
    pub(super) error: Option<BatchError>,
    /// Observations of its agents, for the caller to take.
    room: Vec<Cells>,
    has_observed: bool,
}

/// The values of one space: what they are, and how many.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub(super) is_whole: bool,
    pub(super) length: usize,
}

/// Values of one space.
enum Cells {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl World {
    /// Returns a world that has not started.
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, run: None, error: None, room: Vec::new(), has_observed: false }
    }

    /// Returns the error of a world without a run.
    pub(super) fn unfit(&self, index: usize) -> BatchError {
        self.error.clone().unwrap_or_else(|| BatchError::Broken {
            world: index,
            seed: self.seed,
            cycle: 0,
            cause: "it never started".into(),
        })
    }

    /// Works with the run; keeps the error, and drops the run if it panics.
    pub(super) fn guarded(
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
                let (seed, cause) = (self.seed, message(&*payload));
                self.error = Some(BatchError::Broken { world: index, seed, cycle, cause });
            }
        }
    }

    /// Starts the world again; it stays the same if that fails.
    pub(super) fn restart(
        &mut self,
        index: usize,
        seed: u64,
        start: &Start,
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
                let (cycle, cause) = (0, message(&*payload));
                self.run = None;
                BatchError::Broken { world: index, seed, cycle, cause }
            }
        };
        // For a broken world this replaces the older reason, which the restart did not fix.
        self.error = Some(refused);
    }

    /// Observes into its own room.
    pub(super) fn look(&mut self, index: usize, team: usize, spaces: &[Extent]) {
        let mut room = std::mem::take(&mut self.room);
        if room.len() != spaces.len() || !room.iter().zip(spaces).all(|(room, &s)| room.fits(s)) {
            room = spaces.iter().map(|&space| Cells::new(space)).collect();
        }
        let mut cells: Vec<CellsMut<'_>> = room.iter_mut().map(Cells::cells).collect();
        self.guarded(index, |run| run.observe(team, &mut cells));
        (self.room, self.has_observed) = (room, true);
    }

    /// Copies its observations into its part of the caller's room.
    pub(super) fn hand_over(&mut self, parts: &mut [CellsMut<'_>]) {
        if !std::mem::take(&mut self.has_observed) {
            return;
        }
        for (from, to) in self.room.iter().zip(parts) {
            match (from, to) {
                (Cells::Whole(from), CellsMut::Whole(to)) => to.copy_from_slice(from),
                (Cells::Real(from), CellsMut::Real(to)) => to.copy_from_slice(from),
                _ => {}
            }
        }
    }
}

impl Cells {
    fn new(space: Extent) -> Self {
        match space.is_whole {
            true => Self::Whole(vec![0; space.length]),
            false => Self::Real(vec![0.0; space.length]),
        }
    }

    fn fits(&self, space: Extent) -> bool {
        match self {
            Self::Whole(cells) => space.is_whole && cells.len() == space.length,
            Self::Real(cells) => !space.is_whole && cells.len() == space.length,
        }
    }

    fn cells(&mut self) -> CellsMut<'_> {
        match self {
            Self::Whole(cells) => CellsMut::Whole(cells),
            Self::Real(cells) => CellsMut::Real(cells),
        }
    }
}

/// Returns the message of a panic.
fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_string());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "without a message".into())
}
