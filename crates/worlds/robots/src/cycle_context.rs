//! The data of a phase: world, state and cycle, with the floor in the width of its words.

use super::RobotsState;
use super::state::BodyState;
use super::world::{BodyType, RobotsWorld};
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::{AtomicColumn, Cycle, EntityId, EntitySlot};

/// The world and its state in one cycle, as every phase sees them.
#[derive(Debug)]
pub(super) struct CycleContext<'a, T: OccupantWord> {
    pub(super) world: &'a RobotsWorld,
    pub(super) state: &'a RobotsState,
    /// The body that stands in each box or claims it.
    pub(super) floor: &'a AtomicColumn<T>,
    pub(super) now: Cycle,
}

/// Evaluates an expression with the context of a cycle. The phases are compiled for each
/// width of the floor's words, because small words mean fewer cache misses and a branch at each box would cost
/// more than they save; this picks the right one once.
macro_rules! with_cycle {
    ($world:expr, $state:expr, $now:expr, |$cycle:ident| $value:expr) => {{
        let world = $world;
        let state = $state;
        let now = $now;
        match &state.floor {
            sidestep_kernel::space::OccupantGrid::Narrow(floor) => {
                let $cycle = &$crate::cycle_context::CycleContext { world, state, floor, now };
                $value
            }
            sidestep_kernel::space::OccupantGrid::Wide(floor) => {
                let $cycle = &$crate::cycle_context::CycleContext { world, state, floor, now };
                $value
            }
        }
    }};
}
pub(super) use with_cycle;

impl<'a, T: OccupantWord> CycleContext<'a, T> {
    /// Returns the changing part of a body.
    #[inline(always)]
    pub(super) fn body(&self, slot: EntitySlot) -> &'a BodyState {
        &self.state.bodies[slot as usize]
    }

    /// Returns the properties that a body shares with others of its type.
    #[inline(always)]
    pub(super) fn type_of(&self, body: &BodyState) -> &'a BodyType {
        &self.world.types[usize::from(body.ty)]
    }

    /// Returns the index of a body's lower-left box on the floor.
    #[inline(always)]
    pub(super) fn base(&self, body: &BodyState) -> u32 {
        body.position().row_major_index(self.world.stride)
    }

    /// Returns the draws of a body's action: that of its outcome, and that of its priority.
    #[inline]
    pub(super) fn act_words(&self, id: EntityId) -> [u32; 2] {
        let [effect, priority, ..] = self.world.streams.block(id, self.now, super::purpose::ACT, 0);
        [effect, priority]
    }
}

/// Returns the index of the box at an offset from a body's lower-left one.
#[inline(always)]
pub(super) fn box_index(base: u32, offset: i32) -> usize {
    base.wrapping_add_signed(offset) as usize
}

/// Returns whether some boxes are all empty.
#[inline]
pub(super) fn are_free<T: OccupantWord>(
    floor: &AtomicColumn<T>,
    base: u32,
    offsets: &[i32],
) -> bool {
    // Free is the highest bit of a word, so one branch at the end answers for all boxes.
    offsets.iter().fold(T::FREE, |all, &offset| all & floor.get(box_index(base, offset))).is_free()
}
