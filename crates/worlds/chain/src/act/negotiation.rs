//! A cycle of a chain whose connectors are agents: what they perceive, the outcome of their negotiation, and which
//! connectors are lost.

use super::event_sink::EventSink;
use super::situation::situation;
use super::{ChainContext, ChainCycleState, Initiator};
use crate::agents::percept::ChainPercepts;
use crate::agents::side::NeighborSide;
use crate::agents::{ChainCycleControls, ConnectorRole, Intention, LeaderOutcome};
use crate::deploy::{SensingContext, final_positions};
use crate::events::EventKind;
use crate::motion::recovery::RecoveryOutcome;
use crate::state::{ChainBodyState, MissingNeighbors};
use sidestep_rods::geometry::Point;
use sidestep_rods::serde_point::WirePoint;
use std::collections::BTreeMap;

/// The negotiation of a chain's agents in a cycle.
pub(super) struct Negotiation<'a, const D: usize> {
    /// Percepts of connectors, for a caller that runs the agents elsewhere.
    percept_log: Option<&'a mut Vec<ChainPercepts<D>>>,
    is_done: bool,
}

impl<'a, const D: usize> Negotiation<'a, D> {
    /// Returns the negotiation of a cycle before it has begun.
    pub(super) fn new(percept_log: Option<&'a mut Vec<ChainPercepts<D>>>) -> Self {
        Self { percept_log, is_done: false }
    }
}

/// Lets the agents move the leader to a position, as the recovery ladder allows; none if the chain stands because
/// an agent is lost, or if the deadline passed before the leader had finished.
pub(super) fn negotiate_move<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    to: Point<D>,
) -> Option<RecoveryOutcome<D>> {
    let is_empty = initiator.context.obstacles.is_empty();
    let intention = Intention {
        to: WirePoint(to),
        source: initiator.task.request_source(),
        situation: situation(initiator, acting.body),
        memory: std::mem::take(&mut acting.body.driving.ladder),
        is_empty,
        is_open: is_empty && acting.body.chain.is_plain(),
    };
    let memory = intention.memory.clone();
    let ended = negotiate(initiator.context, acting, &ConnectorRole::Leads(intention));
    let Some(LeaderOutcome::Climbed { climbed, objection, memory }) = ended else {
        acting.body.driving.ladder = memory;
        acting.body.tally.stood += 1;
        return None;
    };
    acting.body.driving.ladder = memory;
    if let Some(veto) = &objection {
        acting.record_veto(veto);
    }
    Some(climbed)
}

/// Lets the agents of a chain whose leader has not moved find out which of them are lost.
pub(super) fn negotiate_without_motion<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
) {
    if !acting.negotiation.is_done {
        negotiate(context, acting, &ConnectorRole::Rests);
    }
}

/// Lets the agents negotiate, and carries out their decisions; returns the outcome of the leader's intention.
fn negotiate<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    role: &ConnectorRole<D>,
) -> Option<LeaderOutcome<D>> {
    let ChainCycleState { body, negotiation, sink, .. } = acting;
    negotiation.is_done = true;
    let ChainContext { world, slot, now, obstacles, .. } = context;
    let leader = context.task(body).map_or(0, |task| task.agent);
    let sights = world.percepts(SensingContext { chain: slot, now, body, obstacles }, leader, role);
    let submitted = body.submitted.take().filter(|submitted| submitted.cycle == now);
    let ChainCycleControls { controls, gone, .. } = match (submitted, &mut negotiation.percept_log)
    {
        (Some(submitted), _) => submitted,
        (None, Some(percept_log)) => {
            percept_log.push((slot, sights));
            return None;
        }
        (None, None) => world.negotiate(slot, now, sights),
    };
    // Where an agent is lost no connector moves, even if the motion would not have reached it: its neighbors cannot
    // know whether it moves.
    if gone.is_empty()
        && let Some(points) = final_positions(&body.chain, &controls)
    {
        body.chain.points_mut().copy_from_slice(&points);
    }
    let mut missing = body.missing.clone();
    missing.resize(controls.len(), MissingNeighbors::default());
    for control in controls.iter().flatten() {
        body.tally.add_network_traffic(control.traffic);
        missing[control.connector as usize] = control.missing;
    }
    mark_missing(&mut missing, &gone);
    record_missing(body, sink, missing);
    let leads = controls.into_iter().nth(leader)??;
    if leads.is_late {
        body.tally.deadlines_missed += 1;
        sink.record(&body.chain, EventKind::Deadline, leader, 0.0);
    }
    leads.ended.filter(|_| gone.is_empty())
}

/// Records lost connectors, with an event for each that a neighbor has lost, or has heard again.
fn record_missing<const D: usize>(
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    missing: Vec<MissingNeighbors>,
) {
    let before = lost_connectors(&body.missing);
    let after = lost_connectors(&missing);
    for (connector, by) in after.iter().filter(|(k, _)| !before.contains_key(k)) {
        body.tally.contacts_lost += 1;
        sink.record(&body.chain, EventKind::Unheard, *connector as usize, f64::from(*by));
    }
    for (connector, by) in before.iter().filter(|(k, _)| !after.contains_key(k)) {
        sink.record(&body.chain, EventKind::Heard, *connector as usize, f64::from(*by));
    }
    let none_is_lost = missing.iter().all(|sides| sides == &[None; 2]);
    body.missing = if none_is_lost { Vec::new() } else { missing };
}

/// Marks connectors that are gone as missing at their neighbors.
fn mark_missing(missing: &mut [MissingNeighbors], gone: &[u32]) {
    let n = missing.len() as u32;
    for &k in gone {
        for side in NeighborSide::ALL {
            if let Some(neighbor) = side.neighbor(k, n) {
                missing[neighbor as usize][side.other() as usize] = Some(k);
            }
        }
    }
}

/// Returns the connectors that a neighbor has lost, and the lowest such neighbor.
fn lost_connectors(missing: &[MissingNeighbors]) -> BTreeMap<u32, u32> {
    let n = missing.len() as u32;
    let mut lost = BTreeMap::new();
    for (k, sides) in (0..).zip(missing) {
        for (side, missing) in NeighborSide::ALL.into_iter().zip(sides) {
            // Connectors farther away only know of it from messages.
            if let Some(connector) = missing.filter(|_| side.neighbor(k, n) == *missing) {
                lost.entry(connector).or_insert(k);
            }
        }
    }
    lost
}
