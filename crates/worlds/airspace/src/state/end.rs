//! The end of a flight, and the number as which a state keeps it.

use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Coded;

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
pub struct Ended(u64);

impl Ended {
    /// No end yet.
    pub(crate) const NOT_YET: Self = Self(u64::MAX);
    /// Flag set beside the step in which an airplane was removed.
    const LEFT: u64 = 1 << 63;

    /// Returns the end, if there was one.
    pub fn get(self) -> Option<End> {
        match self {
            Self::NOT_YET => None,
            Self(step) if step & Self::LEFT != 0 => Some(End::Left(step & !Self::LEFT)),
            Self(step) => Some(End::Arrived(step)),
        }
    }
}

impl From<End> for Ended {
    fn from(end: End) -> Self {
        match end {
            End::Arrived(step) => Self(step),
            End::Left(step) => Self(step | Self::LEFT),
        }
    }
}

impl Default for Ended {
    fn default() -> Self {
        Self::NOT_YET
    }
}

impl Coded for Ended {
    type Code = u64;

    #[inline(always)]
    fn code(self) -> u64 {
        self.0
    }

    #[inline(always)]
    fn of_code(code: u64) -> Self {
        Self(code)
    }
}
