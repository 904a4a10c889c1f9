//! Levels: the range of altitudes that an airplane occupies.

use serde::{Deserialize, Serialize};

/// The levels that an airplane is on or passes while it changes its level.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FlightLevelRange {
    /// Altitude of the lowest, in meters.
    pub low_m: f64,
    /// Altitude of the highest, in meters.
    pub high_m: f64,
}

impl FlightLevelRange {
    /// Every level: for an airplane whose altitude is not bounded, as on a recorded track.
    pub const ALL: Self = Self { low_m: f64::NEG_INFINITY, high_m: f64::INFINITY };

    /// Returns the range of an airplane that keeps its level.
    pub fn from_level(altitude_m: f64) -> Self {
        Self { low_m: altitude_m, high_m: altitude_m }
    }

    /// Returns the range of a change from one level to another, up or down.
    pub fn between(a_m: f64, b_m: f64) -> Self {
        Self { low_m: a_m.min(b_m), high_m: a_m.max(b_m) }
    }

    /// Returns the altitude at the end of a change of level that begins at another altitude of the range.
    pub(crate) fn end_of_change_m(&self, from_m: f64) -> f64 {
        if self.low_m < from_m { self.low_m } else { self.high_m }
    }

    /// Returns these levels, another, and all between.
    #[must_use]
    pub fn extended_by_level(self, altitude_m: f64) -> Self {
        Self { low_m: self.low_m.min(altitude_m), high_m: self.high_m.max(altitude_m) }
    }

    /// Returns whether some level of one is less than `vertical_m` meters from some level of the
    /// other.
    pub fn overlaps(&self, other: &Self, vertical_m: f64) -> bool {
        self.low_m - other.high_m < vertical_m && other.low_m - self.high_m < vertical_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn levels_meet_when_two_of_them_do(
            a in prop::array::uniform2(0.0f64..1000.0), b in prop::array::uniform2(0.0f64..1000.0),
        ) {
            let (one, other) = (FlightLevelRange::between(a[0], a[1]), FlightLevelRange::between(b[0], b[1]));
            let at = |levels: FlightLevelRange, k: i32| levels.low_m + f64::from(k) / 50.0 * (levels.high_m - levels.low_m);
            let nearest = (0..=50).flat_map(|i| (0..=50).map(move |j| (i, j)))
                .map(|(i, j)| (at(one, i) - at(other, j)).abs()).fold(f64::INFINITY, f64::min);
            // The grid is at most 20 m too coarse.
            prop_assert!(!one.overlaps(&other, 100.0) || nearest < 120.0);
            prop_assert!(one.overlaps(&other, 100.0) || nearest >= 100.0);
            prop_assert_eq!(one.overlaps(&other, 100.0), other.overlaps(&one, 100.0));
        }
    }
}
