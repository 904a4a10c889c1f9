//! The end of a flight, and the number as which a state keeps it.

use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;

/// The end of a flight, with its step of `dtau` since the run's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlightEnd {
    /// The airplane is at its last way-point, or at the end of its recorded way.
    Arrived(u64),
    /// Removed before it arrived.
    Left(u64),
}

/// The end of a flight, or none yet, in one number: the step of `dtau` since the run's start, with the
/// highest bit set where the airplane was removed before it arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PackedFlightEnd(u64);

impl PackedFlightEnd {
    /// No end yet.
    pub(crate) const NONE: Self = Self(u64::MAX);
    /// Flag set beside the step in which an airplane was removed.
    const LEFT_FLAG: u64 = 1 << 63;

    /// Returns the end, if there was one.
    pub fn unpack(self) -> Option<FlightEnd> {
        match self {
            Self::NONE => None,
            Self(step) if step & Self::LEFT_FLAG != 0 => {
                Some(FlightEnd::Left(step & !Self::LEFT_FLAG))
            }
            Self(step) => Some(FlightEnd::Arrived(step)),
        }
    }
}

impl From<FlightEnd> for PackedFlightEnd {
    fn from(end: FlightEnd) -> Self {
        match end {
            FlightEnd::Arrived(step) => Self(step),
            FlightEnd::Left(step) => Self(step | Self::LEFT_FLAG),
        }
    }
}

impl Default for PackedFlightEnd {
    fn default() -> Self {
        Self::NONE
    }
}

impl Packed for PackedFlightEnd {
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
