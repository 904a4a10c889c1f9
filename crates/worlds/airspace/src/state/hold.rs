//! Holds of an airplane by the shield, as the state keeps them.

use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;

/// Number of bits beside the count.
const FLAG_BITS: u32 = 2;
const LEVEL_OFF_BIT: u32 = 1;
const LOW_BIT: u32 = 2;

/// How the shield has held an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HoldState {
    /// Number of `dt` in which it held a change of level.
    pub level_offs: u32,
    /// Whether it did in the last one.
    pub is_level_off: bool,
    /// Whether it held the airplane in the last one below the safe altitude.
    pub is_low: bool,
}

impl Packed for HoldState {
    type Bits = u32;

    fn to_bits(self) -> u32 {
        let mut bits = self.level_offs << FLAG_BITS;
        if self.is_level_off {
            bits |= LEVEL_OFF_BIT;
        }
        if self.is_low {
            bits |= LOW_BIT;
        }
        bits
    }

    fn from_bits(bits: u32) -> Self {
        Self {
            level_offs: bits >> FLAG_BITS,
            is_level_off: bits & LEVEL_OFF_BIT > 0,
            is_low: bits & LOW_BIT > 0,
        }
    }
}
