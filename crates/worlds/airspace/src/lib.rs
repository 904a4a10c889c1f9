#![deny(clippy::disallowed_methods)]
//! Airplanes that avoid each other by probability collectives.
//!
//! See `README.md` beside this file for the model, and the paper "Integration of Probability
//! Collectives for Collision Avoidance in AGENTFLY" (2009) for its source.
//!
//! ```text
//! scenario.rs, flight_plan.rs, generate.rs -> world.rs (immutable), state.rs (cells)
//! near each other -> groups;  entry.rs, orders.rs, track.rs: who comes in, and what it is told
//! decide.rs -> shield.rs -> react.rs                                      one cycle of dt
//! airplane.rs, levels.rs, objective.rs: motion and cost behind it
//! orbit.rs: what is flown for ever     books.rs: how near pairs come     metrics.rs: what came of it
//! ```

pub mod airplane;
mod baseline;
mod books;
pub mod bundle;
mod decide;
pub mod deploy;
mod entry;
pub mod events;
mod flight_plan;
mod foreign;
mod generate;
mod kind;
pub mod levels;
mod memory;
pub mod metrics;
pub mod objective;
mod orbit;
pub mod orders;
mod react;
mod rows;
pub mod run;
pub mod scenario;
pub mod shield;
pub mod state;
pub mod track;
pub mod traffic;
mod view;
mod words;
pub mod world;

pub use books::LOOKS_PER_STEP;
pub use decide::{Effort, Optimization};
use deploy::Traffic;
use events::Event;
pub use kind::Airspace;
pub use run::{AirspaceRun, airspace_run};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::world::Decides;
use sidestep_kernel::{Cycle, Phases, Slot, Turn};
use state::{AirspaceState, PairRecord};
use std::collections::BTreeMap;
use std::ops::Range;
pub use world::AirspaceWorld;

/// What a worker keeps between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Pairs that came near each other.
    pairs: BTreeMap<(Slot, Slot), PairRecord>,
    optimizations: Vec<Optimization>,
    /// What the shield has sent.
    exchanged: Traffic,
    events: Vec<Event>,
    /// Pairs without fallbacks that are apart, of which one came in: cycle and both.
    too_close: Vec<(Cycle, Slot, Slot)>,
    /// Processor time spent deciding: told beside the results, never part of them.
    decide_ns: u64,
    flying: Vec<Slot>,
}

impl Phases for AirspaceWorld {
    const DECIDES: Decides = Decides::Together;

    type State = AirspaceState;
    type Scratch = Scratch;

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn bodies(&self, _: &AirspaceState) -> usize {
        self.airplanes.len()
    }

    fn claim(turn: &mut Turn<'_, Self>, bodies: Range<usize>) {
        let Turn { world, state, now, .. } = *turn;
        for slot in bodies {
            if state.is_there(world, slot as Slot, now) {
                let at = state.airplanes[slot].pose().at;
                state.neighborhood.enter(slot as Slot, at, now);
            }
        }
    }

    fn join(turn: &mut Turn<'_, Self>, bodies: Range<usize>, groups: &Groups) {
        let Turn { world, state, now, .. } = *turn;
        for slot in bodies.map(|slot| slot as Slot) {
            let cell = &state.airplanes[slot as usize];
            if !state.is_there(world, slot, now) {
                continue;
            }
            state.neighborhood.around(cell.pose().at, now, |other| {
                if other < slot && state.is_near(world, (slot, other), now) {
                    groups.join(slot, other);
                }
            });
        }
    }

    fn act(turn: &mut Turn<'_, Self>, group: &mut [Slot]) {
        let Turn { world, state, now, .. } = *turn;
        let mut flying = std::mem::take(&mut turn.scratch.flying);
        flying.clear();
        flying.extend(group.iter().filter(|&&slot| state.is_there(world, slot, now)));
        flying.sort_unstable();
        if !flying.is_empty() {
            world.fly(turn, &flying);
        }
        turn.scratch.flying = flying;
    }
}
