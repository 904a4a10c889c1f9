//! What the shield does not keep clear, by names and times.

use super::Counters;
use crate::world::AirspaceWorld;
use serde::Serialize;
use sidestep_kernel::EntityId;

/// An airplane with errors beyond the shield's bounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorBoundViolation {
    /// Time of the first such error, in seconds after the start of the run.
    pub at_s: f64,
    /// Id of the airplane.
    pub airplane: EntityId,
    /// Its call sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub callsign: Option<String>,
}

/// An airplane that the shield does not keep clear of an area.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AreaExemption {
    /// Time when that was reported first, in seconds after the start of the run.
    pub at_s: f64,
    /// Id of the airplane.
    pub airplane: EntityId,
    /// Its call sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub callsign: Option<String>,
    /// Name of the area, or else its number.
    pub area: String,
}

/// Two airplanes that were too near each other for the shield when the later one came in, or one of
/// which minds no other and could reach the second one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnprotectedPair {
    /// Time when that began, in seconds after the start of the run.
    pub at_s: f64,
    /// Ids of the two.
    pub airplanes: [EntityId; 2],
    /// Their call signs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub callsigns: Option<[String; 2]>,
}

/// Returns the airplanes whose errors exceeded the shield's bounds, by ids.
pub(super) fn error_bound_violations(
    world: &AirspaceWorld,
    counters: &Counters,
) -> Vec<ErrorBoundViolation> {
    counters
        .beyond_bound
        .iter()
        .map(|(&airplane, &cycle)| ErrorBoundViolation {
            at_s: world.cycle_start_s(cycle),
            airplane,
            callsign: world.callsign(airplane),
        })
        .collect()
}

/// Returns the airplanes that the shield does not keep clear of areas, by the time when that began.
pub(super) fn area_exemptions(world: &AirspaceWorld, counters: &Counters) -> Vec<AreaExemption> {
    let mut all: Vec<_> = counters.exempt_areas.iter().map(|(&key, &cycle)| (cycle, key)).collect();
    all.sort_unstable();
    all.into_iter()
        .map(|(cycle, (airplane, number))| AreaExemption {
            at_s: world.cycle_start_s(cycle),
            airplane,
            callsign: world.callsign(airplane),
            area: world.areas[number as usize].display_name(number as usize),
        })
        .collect()
}

/// Returns the pairs whose separation the shield does not guarantee, by the time when that began.
pub(super) fn unprotected_pairs(
    world: &AirspaceWorld,
    counters: &Counters,
) -> Vec<UnprotectedPair> {
    let mut pairs: Vec<_> =
        counters.too_close.iter().map(|(&pair, &cycle)| (cycle, pair)).collect();
    pairs.sort_unstable();
    pairs
        .into_iter()
        .map(|(cycle, (a, b))| UnprotectedPair {
            at_s: world.cycle_start_s(cycle),
            airplanes: [a, b],
            callsigns: world.callsigns([a, b]),
        })
        .collect()
}
