//! What a worker needs in a phase: the borrowed inputs, and its own buffers.

use crate::agents::network_traffic::NetworkTraffic;
use crate::decide::OptimizationRecord;
use crate::events::Event;
use crate::flight::FlightPhase;
use crate::flown_leg::FlownLeg;
use crate::metrics::AreaRecord;
use crate::state::PairRecord;
use crate::surveillance::ObservationCounts;
use crate::trace::InspectionTrace;
use crate::world::AirspaceWorld;
use sidestep_kernel::{Cycle, EntitySlot};
use std::collections::BTreeMap;

/// A worker's turn in one phase of one cycle.
pub(crate) type PhaseContext<'a> = sidestep_kernel::PhaseContext<'a, AirspaceWorld>;

/// A worker's buffers and sums, kept between tasks.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Pairs that came near each other.
    pub(crate) pairs: BTreeMap<(EntitySlot, EntitySlot), PairRecord>,
    /// Losses of separation of recorded flights, by their phase.
    pub(crate) losses_by_phase: BTreeMap<FlightPhase, u64>,
    pub(crate) optimizations: Vec<OptimizationRecord>,
    /// Beacons by which airplanes have found their groups.
    pub(crate) grouped: NetworkTraffic,
    /// Messages and bytes that the shield has sent.
    pub(crate) exchanged: NetworkTraffic,
    pub(crate) events: Vec<Event>,
    pub(crate) flown: Vec<FlownLeg>,
    /// Pairs that were named, for which the shield promises nothing: cycle and both airplanes.
    pub(crate) too_close: Vec<(Cycle, EntitySlot, EntitySlot)>,
    /// Observations by surveillance.
    pub(crate) observed: ObservationCounts,
    /// Times of airplanes in areas, by airplane and number of the area.
    pub(crate) areas: BTreeMap<(EntitySlot, u32), AreaRecord>,
    /// Airplanes that the shield does not keep clear of an area: cycle, airplane, and number of the area.
    pub(crate) exempt_areas: Vec<(Cycle, EntitySlot, u32)>,
    /// Processor time spent deciding, in nanoseconds: reported beside the results, never part of
    /// them.
    pub(crate) decide_ns: u64,
    pub(crate) flying: Vec<EntitySlot>,
    /// Notes for an inspection of an airplane; none in a run.
    pub(crate) trace: Option<Box<InspectionTrace>>,
}
