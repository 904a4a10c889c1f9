//! What a phase works on: world, state and cycle, with the floor in the width of its words.

use super::RobotsState;
use super::state::BodyCell;
use super::world::{BodyType, RobotsWorld};
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::{Column, Cycle, EntityId, Slot};

/// The world and its state in one cycle, as every phase sees them.
#[derive(Debug)]
pub(super) struct Scene<'a, T: BoxWord> {
    pub(super) world: &'a RobotsWorld,
    pub(super) state: &'a RobotsState,
    /// Who stands in each box or claims it.
    pub(super) floor: &'a Column<T>,
    pub(super) now: Cycle,
}

/// Evaluates an expression with the scene of a world's state, whatever the width of the words on
/// its floor is: the phases are compiled for either.
macro_rules! with_scene {
    ($world:expr, $state:expr, $now:expr, |$scene:ident| $value:expr) => {{
        let (world, state, now) = ($world, $state, $now);
        match &state.floor {
            sidestep_kernel::space::Floor::Narrow(floor) => {
                let $scene = &$crate::scene::Scene { world, state, floor, now };
                $value
            }
            sidestep_kernel::space::Floor::Wide(floor) => {
                let $scene = &$crate::scene::Scene { world, state, floor, now };
                $value
            }
        }
    }};
}
pub(super) use with_scene;

impl<'a, T: BoxWord> Scene<'a, T> {
    /// What changes of a body.
    #[inline(always)]
    pub(super) fn cell(&self, slot: Slot) -> &'a BodyCell {
        &self.state.bodies[slot as usize]
    }

    /// What a body has in common with those of its type.
    #[inline(always)]
    pub(super) fn type_of(&self, cell: &BodyCell) -> &'a BodyType {
        &self.world.types[usize::from(cell.ty)]
    }

    /// Index of a body's lower-left box on the floor.
    #[inline(always)]
    pub(super) fn base(&self, cell: &BodyCell) -> u32 {
        cell.at().index(self.world.stride)
    }

    /// The draws of a body's action: what it comes to, and its priority.
    #[inline]
    pub(super) fn act_words(&self, id: EntityId) -> [u32; 2] {
        let [effect, priority, ..] = self.world.streams.block(id, self.now, super::purpose::ACT, 0);
        [effect, priority]
    }
}

/// Index of the box at an offset from a body's lower-left one.
#[inline(always)]
pub(super) fn at(base: u32, offset: i32) -> usize {
    base.wrapping_add_signed(offset) as usize
}

/// Whether nothing stands in any of some boxes.
#[inline]
pub(super) fn all_free<T: BoxWord>(floor: &Column<T>, base: u32, offsets: &[i32]) -> bool {
    offsets.iter().fold(T::FREE, |all, &offset| all & floor.get(at(base, offset))).is_free()
}
