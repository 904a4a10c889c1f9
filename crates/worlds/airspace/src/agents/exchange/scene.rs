//! The scene as all airplanes of a group see it before they exchange their plans.

use crate::flight::Air;
use crate::shield::Flyer;
use sidestep_kernel::stream::philox4x32;
use sidestep_kernel::{Cycle, EntityId};

/// Number of cycles after which airplanes take turns.
const TURN_CYCLES: Cycle = 12;

/// An airplane as others see it.
#[derive(Debug, Clone)]
pub struct Seen {
    /// Its place, its model, and its stored fallback.
    pub flyer: Flyer,
    /// Whether it is seen to be on that fallback.
    pub orbits: bool,
}

/// The scene as all of a group see it, and numbers on which they have agreed, before they exchange
/// their plans.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The air that all fly through.
    pub air: Air,
    /// Airplanes at least this many meters above each other need not mind each other.
    pub vertical_m: f64,
    /// The present cycle.
    pub now: Cycle,
    /// All airplanes of the group as they can be seen, by rising id.
    pub seen: Vec<Seen>,
}

impl Scene {
    /// Returns whether the airplane at one place goes before another one: it flies on without the
    /// other's consent, and the other not without its own.
    ///
    /// One that is seen to fly a way goes before one on an orbit, so that it is soon out of the
    /// other's reach. Among equals all go first in turn.
    pub fn goes_first(&self, place: usize, other: usize) -> bool {
        let key = |place: usize| {
            let Seen { flyer, orbits } = &self.seen[place];
            (*orbits, turn(flyer.id, self.now), flyer.id)
        };
        key(place) < key(other)
    }
}

/// Returns a number by which airplanes take turns: drawn without a seed, because all have to know it,
/// and anew when one has had time to get out of the others' way.
fn turn(id: EntityId, now: Cycle) -> u64 {
    let round = now / TURN_CYCLES;
    let [high, low, ..] = philox4x32([id, round as u32, (round >> 32) as u32, 0], [0; 2]);
    u64::from(high) << 32 | u64::from(low)
}
