//! Constraints on the places of a connector.

use super::PointValue;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_rods::Mobility;

/// The places where a connector may be.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "MobilitySection")]
pub(super) enum MobilitySection<const D: usize> {
    /// Anywhere.
    Free,
    /// Stays at the place where it begins.
    Fixed,
    /// Stays on the line between two points.
    OnSegment([PointValue<D>; 2]),
    /// Stays on a line or a plane, given by its normal and its distance from the origin.
    OnPlane { normal: PointValue<D>, offset_m: f64 },
    /// Stays in a box, given by its lower and its upper corner.
    InBox([PointValue<D>; 2]),
}

impl<const D: usize> MobilitySection<D> {
    pub(super) fn mobility(&self) -> Mobility<D> {
        match *self {
            Self::Free => Mobility::Free,
            Self::Fixed => Mobility::Fixed,
            Self::OnSegment(ends) => Mobility::OnSegment(ends.map(PointValue::get)),
            Self::OnPlane { normal, offset_m } => {
                Mobility::OnPlane { normal: normal.get(), offset_m }
            }
            Self::InBox([lo, hi]) => Mobility::InBox { lo: lo.get(), hi: hi.get() },
        }
    }
}
