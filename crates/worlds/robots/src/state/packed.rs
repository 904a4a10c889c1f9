//! Values of a body's state that are kept as one number each.

use crate::decide::Contact;
use crate::effector::Side;
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;
use sidestep_kernel::space::GridPosition;

/// The action that a body is about to do in this cycle, in one byte: 0 for none, else its number plus 1, and a
/// flag in the highest bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Intent(u8);

impl Intent {
    /// Of bodies that are not due, and of doors that stay as they are.
    pub(crate) const IDLE: Self = Self(0);
    /// The only action of bodies without a choice: people step on, doors toggle.
    pub(crate) const ONLY_ACTION: Self = Self(1);
    /// Flag added when every box that the action may sweep is free.
    const CLEAR: u8 = 0x80;

    /// Returns the intent to do the action of this number; there are fewer than 127.
    #[inline(always)]
    pub(crate) fn from_action(number: u8) -> Self {
        Self(number + 1)
    }

    /// Returns the same intent, marked that every box it may sweep is free.
    #[inline(always)]
    pub(crate) fn with_clear(self) -> Self {
        Self(self.0 | Self::CLEAR)
    }

    #[inline(always)]
    pub(crate) fn is_idle(self) -> bool {
        self == Self::IDLE
    }

    /// Returns whether every box that the action may sweep is free.
    #[inline(always)]
    pub(crate) fn is_clear(self) -> bool {
        self.0 & Self::CLEAR != 0
    }

    /// Returns the number of the action; the body must not be idle.
    #[inline(always)]
    pub(crate) fn number(self) -> u8 {
        (self.0 & !Self::CLEAR) - 1
    }
}

/// The heading of a body, or of a door, which has none, whether it is open; in one byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Facing(u8);

impl Facing {
    pub(crate) const CLOSED: Self = Self(0);
    pub(crate) const OPEN: Self = Self(1);

    /// Returns the one of a body with this heading: 0 east, 1 north, 2 west, 3 south.
    #[inline(always)]
    pub(crate) fn from_heading(heading: u8) -> Self {
        Self(heading)
    }

    /// Returns the heading of a body that is not a door: 0 east, 1 north, 2 west, 3 south.
    #[inline(always)]
    pub fn heading(self) -> u8 {
        self.0
    }

    /// Returns whether a door is open; the body must be one.
    #[inline(always)]
    pub fn is_open(self) -> bool {
        self == Self::OPEN
    }

    /// Returns the one after some quarter turns to the left.
    #[inline(always)]
    pub(crate) fn turned(self, quarters: u8) -> Self {
        Self((self.0 + quarters) % 4)
    }
}

/// The obstacle that stopped the last action, or none, in one word: bit 15 is set where there was one, the
/// side is in bits 8 to 14, the kind below.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LastContact(u16);

impl LastContact {
    pub(crate) const NONE: Self = Self(0);

    #[inline]
    pub(crate) fn from_contact(Contact { kind, side }: Contact) -> Self {
        Self(1 << 15 | u16::from(side as u8) << 8 | u16::from(kind))
    }

    /// Returns the contact, if there was one.
    pub fn get(self) -> Option<Contact> {
        let side = Side::ALL[usize::from(self.0 >> 8 & 3)];
        (self != Self::NONE).then_some(Contact { kind: (self.0 & 0x7f) as u8, side })
    }
}

/// Column, row and heading of a body while a run is recorded, in one word: the heading is in bits 30 and 31,
/// the row in bits 15 to 29, the column below.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PackedPose(u32);

impl PackedPose {
    /// Column and row are those of the padded grid, below 2^15.
    #[inline]
    pub(crate) fn new(at: GridPosition, facing: Facing) -> Self {
        Self(u32::from(facing.0) << 30 | at.row() << 15 | at.col())
    }

    /// Returns the column, in the padded grid.
    pub(crate) fn col(self) -> u32 {
        self.0 & 0x7fff
    }

    /// Returns the row, in the padded grid.
    pub(crate) fn row(self) -> u32 {
        self.0 >> 15 & 0x7fff
    }

    /// As [`Facing::heading`]; of a door 0 or 1.
    pub(crate) fn heading(self) -> u8 {
        (self.0 >> 30) as u8
    }
}

/// Keeps each of some types as the number that it holds.
macro_rules! packed {
    ($($name:ty: $code:ty;)*) => {$(
        impl Packed for $name {
            type Bits = $code;
            #[inline(always)]
            fn to_bits(self) -> $code { self.0 }
            #[inline(always)]
            fn from_bits(bits: $code) -> Self { Self(bits) }
        }
    )*};
}
packed! { Intent: u8; Facing: u8; LastContact: u16; PackedPose: u32; }
