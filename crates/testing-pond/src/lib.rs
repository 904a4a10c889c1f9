//! A world of frogs on lily pads, written against the kernel and the scenario format alone. It
//! shows the parts of a new world: phases, a run, orders, rows, a picture, and its `WorldType`.
//!
//! No program knows it. Tests of the session, the server, fleets and the Python package take it as an argument, so
//! none of these can rely on a world that is shipped.

mod external;
mod facts;
pub mod kinds;
mod rows;
mod world_impl;
mod world_type;

pub use world_type::Pond;

use rows::{Event, FrogAction};
use serde::{Deserialize, Serialize};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::control::AgentTeams;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{AtomicColumn, Cycle, EntitySlot, PhaseContext, Phases};
use std::ops::Range;
use std::sync::Arc;

const HOP: Purpose = Purpose(1);

/// Pads in rows, and frogs that hop from one to another. No pad carries two frogs.
pub(crate) struct PondWorld {
    frogs: u32,
    width: u32,
    height: u32,
    /// Pads overgrown with reeds, which no frog enters.
    reeds: Vec<u32>,
    streams: Streams,
    /// The frogs as a caller sees them, if they take orders.
    teams: Arc<AgentTeams>,
}

/// The pads of all frogs: everything that changes in a run, except sums.
pub(crate) struct PondState {
    /// The pad under each frog.
    pad: AtomicColumn<u32>,
    /// The pad that each frog wants.
    goal: AtomicColumn<u32>,
    /// The frog on each pad, counted from 1; 0 if there is none.
    frog: AtomicColumn<u32>,
    /// The ordered hop of each frog, as a number of [`Hop`]; that of [`Hop::Stay`] without an order.
    order: AtomicColumn<u32>,
}

/// A hop of a frog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hop {
    Stay,
    East,
    West,
    North,
    South,
}

impl Hop {
    const ALL: [Self; 5] = [Self::Stay, Self::East, Self::West, Self::North, Self::South];
    /// Their names, in the same order.
    const NAMES: [&'static str; 5] = ["stay", "east", "west", "north", "south"];
}

/// The state as saved.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Saved {
    pads: Vec<u32>,
    orders: Vec<u32>,
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
        let pads = (0..self.frogs).map(|frog| 2 * frog).collect();
        self.state(pads, vec![Hop::Stay as u32; self.frogs as usize])
    }

    fn state(&self, pads: Vec<u32>, orders: Vec<u32>) -> PondState {
        let frog = AtomicColumn::filled((self.width * self.height) as usize, 0);
        (1u32..).zip(&pads).for_each(|(number, &pad)| frog.set(pad as usize, number));
        PondState {
            goal: pads.iter().copied().collect(),
            pad: pads.into_iter().collect(),
            frog,
            order: orders.into_iter().collect(),
        }
    }

    /// Returns the hop of a frog: the ordered one, or one drawn at random.
    fn decide(&self, state: &PondState, frog: usize, now: Cycle) -> Hop {
        if self.takes_orders() {
            let order = state.order.get(frog) as usize;
            // An order is for one cycle: a frog without a new one stays.
            state.order.set(frog, Hop::Stay as u32);
            return Hop::ALL[order];
        }
        match self.streams.draws(frog as EntitySlot, now, HOP).uniform_below(4) {
            0 => Hop::East,
            1 => Hop::West,
            2 => Hop::North,
            _ => Hop::South,
        }
    }

    /// Returns the pad that a hop leads to: the frog's own at the bank and before reeds.
    fn target(&self, pad: u32, hop: Hop) -> u32 {
        let column = pad % self.width;
        let row = pad / self.width;
        let target = match hop {
            Hop::East if column + 1 < self.width => pad + 1,
            Hop::West if column > 0 => pad - 1,
            Hop::North if row + 1 < self.height => pad + self.width,
            Hop::South if row > 0 => pad - self.width,
            _ => pad,
        };
        if self.reeds.contains(&target) { pad } else { target }
    }

    fn place_m(&self, pad: u32) -> [f64; 2] {
        [f64::from(pad % self.width) + 0.5, f64::from(pad / self.width) + 0.5]
    }
}

impl Phases for PondWorld {
    type State = PondState;
    type Scratch = Vec<Event>;

    fn new_scratch(&self) -> Vec<Event> {
        Vec::new()
    }

    fn body_count(&self, _: &PondState) -> usize {
        self.frogs as usize
    }

    fn claim(turn: &mut PhaseContext<'_, Self>, bodies: Range<usize>) {
        for frog in bodies {
            let pad = turn.state.pad.get(frog);
            let hop = turn.world.decide(turn.state, frog, turn.now);
            turn.state.goal.set(frog, turn.world.target(pad, hop));
        }
    }

    fn join(turn: &mut PhaseContext<'_, Self>, bodies: Range<usize>, groups: &ConflictGroups) {
        let claims = |frog: usize| [turn.state.pad.get(frog), turn.state.goal.get(frog)];
        for frog in bodies {
            let own = claims(frog);
            let meets = |other: &usize| claims(*other).iter().any(|pad| own.contains(pad));
            (0..frog)
                .filter(meets)
                .for_each(|other| groups.join_groups(frog as EntitySlot, other as EntitySlot));
        }
    }

    fn act(turn: &mut PhaseContext<'_, Self>, group: &mut [EntitySlot]) {
        group.sort_unstable();
        let state = turn.state;
        for &mut frog in group {
            let pad = state.pad.get(frog as usize);
            let goal = state.goal.get(frog as usize);
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
