//! The end of a flight, and the number as which a state keeps it.

use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;

/// The end of a flight, with its step of `dtau` since the run's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The airplane is at its last way-point, or at the end of its recorded way.
    Arrived(u64),
    /// Removed before it arrived.
    Left(u64),
}

/// The end of a flight, or none yet, in one number: the step of `dtau` since the run's start, with the
/// highest bit set where the airplane was removed before it arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PackedEnd(u64);

impl PackedEnd {
    /// No end yet.
    pub(crate) const NONE: Self = Self(u64::MAX);
    /// Flag set beside the step in which an airplane was removed.
    const LEFT_FLAG: u64 = 1 << 63;

    /// Returns the end, if there was one.
    pub fn get(self) -> Option<End> {
        match self {
            Self::NONE => None,
            Self(step) if step & Self::LEFT_FLAG != 0 => Some(End::Left(step & !Self::LEFT_FLAG)),
            Self(step) => Some(End::Arrived(step)),
        }
    }
}

impl From<End> for PackedEnd {
    fn from(end: End) -> Self {
        match end {
            End::Arrived(step) => Self(step),
            End::Left(step) => Self(step | Self::LEFT_FLAG),
        }
    }
}

impl Default for PackedEnd {
    fn default() -> Self {
        Self::NONE
    }
}

impl Packed for PackedEnd {
    type Bits = u64;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        self.0
    }

    #[inline(always)]
    fn from_bits(code: u64) -> Self {
        Self(code)
    }
}
