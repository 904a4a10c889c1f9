//! Where a connector may be.

use super::super::rods::chain::Mobility;
use super::Place;
use serde::Deserialize;

/// The places where a connector may be.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum MobilitySection<const D: usize> {
    Free,
    Fixed,
    OnSegment([Place<D>; 2]),
    OnPlane { normal: Place<D>, offset_m: f64 },
    InBox([Place<D>; 2]),
}

impl<const D: usize> MobilitySection<D> {
    pub(super) fn mobility(&self) -> Mobility<D> {
        match *self {
            Self::Free => Mobility::Free,
            Self::Fixed => Mobility::Fixed,
            Self::OnSegment(ends) => Mobility::OnSegment(ends.map(Place::get)),
            Self::OnPlane { normal, offset_m } => {
                Mobility::OnPlane { normal: normal.get(), offset_m }
            }
            Self::InBox([lo, hi]) => Mobility::InBox { lo: lo.get(), hi: hi.get() },
        }
    }
}
