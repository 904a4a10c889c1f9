//! A world of frogs on lily pads, written against the kernel and the scenario format alone. It
//! shows the parts of a new world: phases, a run, rows, a picture, and its `Kind`.

mod rows;
mod world_impl;
mod world_type;

pub(crate) use world_type::Pond;

use rows::{Event, FrogAction};
use serde::{Deserialize, Serialize};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{Column, Cycle, PhaseContext, Phases, Slot};
use std::ops::Range;

const HOP: Purpose = Purpose(1);

/// Pads in rows, and frogs that hop from one to another. No pad carries two frogs.
pub(crate) struct PondWorld {
    frogs: u32,
    width: u32,
    height: u32,
    streams: Streams,
}

/// The pads of all frogs: everything that changes in a run, except sums.
pub(crate) struct PondState {
    /// The pad under each frog.
    pad: Column<u32>,
    /// The pad that each frog wants.
    goal: Column<u32>,
    /// The frog on each pad, counted from 1; 0 if there is none.
    frog: Column<u32>,
}

/// The state as saved.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Saved {
    pads: Vec<u32>,
    sums: Sums,
}

/// Sums over the run so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Sums {
    hops: u64,
    bumps: u64,
}

impl PondWorld {
    /// Returns the start: frogs on every other pad.
    fn start(&self) -> PondState {
        self.with_pads((0..self.frogs).map(|frog| 2 * frog).collect())
    }

    fn with_pads(&self, pads: Vec<u32>) -> PondState {
        let frog = Column::filled((self.width * self.height) as usize, 0);
        (1u32..).zip(&pads).for_each(|(number, &pad)| frog.set(pad as usize, number));
        PondState { goal: pads.iter().copied().collect(), pad: pads.into_iter().collect(), frog }
    }

    /// Returns the pad that a frog wants: one beside its own, or its own at the bank.
    fn wanted(&self, frog: Slot, pad: u32, now: Cycle) -> u32 {
        let (column, row) = (pad % self.width, pad / self.width);
        match self.streams.draws(frog, now, HOP).uniform_below(4) {
            0 if column + 1 < self.width => pad + 1,
            1 if column > 0 => pad - 1,
            2 if row + 1 < self.height => pad + self.width,
            3 if row > 0 => pad - self.width,
            _ => pad,
        }
    }

    fn place_m(&self, pad: u32) -> [f64; 2] {
        [f64::from(pad % self.width) + 0.5, f64::from(pad / self.width) + 0.5]
    }
}

impl Phases for PondWorld {
    type State = PondState;
    type Scratch = Vec<Event>;

    fn scratch(&self) -> Vec<Event> {
        Vec::new()
    }

    fn bodies(&self, _: &PondState) -> usize {
        self.frogs as usize
    }

    fn claim(turn: &mut PhaseContext<'_, Self>, bodies: Range<usize>) {
        for frog in bodies {
            let pad = turn.state.pad.get(frog);
            turn.state.goal.set(frog, turn.world.wanted(frog as Slot, pad, turn.now));
        }
    }

    fn join(turn: &mut PhaseContext<'_, Self>, bodies: Range<usize>, groups: &ConflictGroups) {
        let claims = |frog: usize| [turn.state.pad.get(frog), turn.state.goal.get(frog)];
        for frog in bodies {
            let own = claims(frog);
            let meets = |other: &usize| claims(*other).iter().any(|pad| own.contains(pad));
            (0..frog).filter(meets).for_each(|other| groups.join(frog as Slot, other as Slot));
        }
    }

    fn act(turn: &mut PhaseContext<'_, Self>, group: &mut [Slot]) {
        group.sort_unstable();
        let state = turn.state;
        for &mut frog in group {
            let (pad, goal) = (state.pad.get(frog as usize), state.goal.get(frog as usize));
            if pad == goal {
                continue;
            }
            let what =
                if state.frog.get(goal as usize) == 0 { FrogAction::Hop } else { FrogAction::Bump };
            if what == FrogAction::Hop {
                state.frog.set(pad as usize, 0);
                state.frog.set(goal as usize, frog + 1);
                state.pad.set(frog as usize, goal);
            }
            turn.scratch.push(Event { cycle: turn.now, frog, what });
        }
    }
}
