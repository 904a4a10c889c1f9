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
mod decide;
pub mod deploy;
mod entry;
pub mod events;
mod flight_plan;
mod generate;
pub mod levels;
mod memory;
pub mod metrics;
pub mod objective;
mod orbit;
pub mod orders;
mod react;
mod rows;
pub mod scenario;
pub mod shield;
pub mod simulation;
pub mod state;
pub mod track;
pub mod traffic;
mod view;
pub mod world;

pub use books::LOOKS_PER_STEP;
pub use decide::{Effort, Optimization};
use deploy::Traffic;
use events::Event;
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::{Cycle, Slot, World};
use state::{AirspaceState, PairRecord};
use std::collections::BTreeMap;
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

impl World for AirspaceWorld {
    type State = AirspaceState;
    type Scratch = Scratch;

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn bodies(&self, _: &AirspaceState) -> usize {
        self.airplanes.len()
    }

    fn perceive_and_decide(
        &self,
        state: &AirspaceState,
        now: Cycle,
        bodies: std::ops::Range<usize>,
        _: &mut Scratch,
    ) {
        for slot in bodies {
            if state.is_there(self, slot as Slot, now) {
                let at = state.airplanes[slot].pose().at;
                state.neighborhood.enter(slot as Slot, at, now);
            }
        }
    }

    fn find_conflicts(
        &self,
        state: &AirspaceState,
        now: Cycle,
        bodies: std::ops::Range<usize>,
        groups: &Groups,
        _: &mut Scratch,
    ) {
        for slot in bodies.map(|slot| slot as Slot) {
            let cell = &state.airplanes[slot as usize];
            if !state.is_there(self, slot, now) {
                continue;
            }
            state.neighborhood.around(cell.pose().at, now, |other| {
                if other < slot && state.is_near(self, (slot, other), now) {
                    groups.join(slot, other);
                }
            });
        }
    }

    fn react(&self, state: &AirspaceState, now: Cycle, group: &mut [Slot], scratch: &mut Scratch) {
        let mut flying = std::mem::take(&mut scratch.flying);
        flying.clear();
        flying.extend(group.iter().filter(|&&slot| state.is_there(self, slot, now)));
        flying.sort_unstable();
        if !flying.is_empty() {
            self.fly(state, now, &flying, scratch);
        }
        scratch.flying = flying;
    }
}
