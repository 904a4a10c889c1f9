//! Measures of traffic by the names of the field: what counts as a conflict, as a violation of well clear and as a near
//! mid-air collision, and what a flight costs.
//!
//! Definitions and sources are in the book (`docs/src/measures.md`). `encounters/` counts them in a run.
//!
//! ```text
//! relative.rs    one airplane as seen from another, and what is predicted from it
//! effort.rs      distance, fuel and maneuvers of a flight
//! ```

mod effort;
mod relative;

pub use effort::FlightEffort;
pub(crate) use effort::{CourseStep, Maneuvering};
pub use relative::{RelativeState, WellClearMinima};

use crate::flight::{ROUNDING_M, SeparationMinima};

/// Meters in a foot, exactly.
const FOOT_M: f64 = 0.3048;

/// The measures that a run takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasureSettings {
    /// The measures of pairs; `None` if none are taken.
    pub pairs: Option<PairMeasures>,
    /// The measures of flights; `None` if none are taken.
    pub flights: Option<FlightMeasures>,
}

/// The measures of pairs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairMeasures {
    /// Time in seconds within which a predicted loss of separation is a conflict.
    pub look_ahead_s: f64,
    /// The volume that two airplanes that are well clear of each other keep out of.
    pub well_clear: WellClearVolume,
    /// The minima below which two have had a near mid-air collision.
    pub nmac: SeparationMinima,
}

/// A near mid-air collision in the standards: nearer than 500 ft and 100 ft.
pub const NMAC: SeparationMinima =
    SeparationMinima { gap_m: 500.0 * FOOT_M, vertical_m: 100.0 * FOOT_M };

/// A volume of well clear, as a scenario gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WellClearVolume {
    /// Largest modified tau in seconds.
    pub tau_s: f64,
    /// DMOD and HMD in meters; `None` for the separation of the pair.
    pub horizontal_m: Option<f64>,
    /// Vertical threshold in meters; `None` for that of the separation.
    pub vertical_m: Option<f64>,
}

impl WellClearVolume {
    /// That of the scenario's separation, 35 seconds ahead.
    pub const SEPARATION: Self = Self { tau_s: 35.0, horizontal_m: None, vertical_m: None };
    /// RTCA DO-365, en route: 35 s, 4000 ft and 450 ft.
    pub const DO_365: Self =
        Self { tau_s: 35.0, horizontal_m: Some(4000.0 * FOOT_M), vertical_m: Some(450.0 * FOOT_M) };
    /// ASTM F3442, of small unmanned aircraft: 2000 ft and 250 ft, at any speed.
    pub const F3442: Self =
        Self { tau_s: 0.0, horizontal_m: Some(2000.0 * FOOT_M), vertical_m: Some(250.0 * FOOT_M) };

    /// Returns the volume of a pair.
    pub(crate) fn of_pair(&self, separation: SeparationMinima) -> WellClearMinima {
        WellClearMinima {
            tau_s: self.tau_s,
            // Pairs that fly by at just their separation keep it, whatever is rounded.
            horizontal_m: self.horizontal_m.unwrap_or(separation.gap_m - ROUNDING_M),
            vertical_m: self.vertical_m.unwrap_or(separation.vertical_m - ROUNDING_M),
        }
    }
}

/// The measures of flights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightMeasures {
    /// Ratio of lift to drag in level flight, by which a climb weighs against a distance.
    pub lift_to_drag: f64,
}

/// Lift-to-drag ratio unless a scenario gives one: between small unmanned airplanes (10 to 12) and airliners (17 to 20).
pub const DEFAULT_LIFT_TO_DRAG: f64 = 15.0;
