//! A cycle of a chain whose connectors decide for themselves: what they perceive, what comes of their
//! talk, and who is no longer heard.

use super::event_sink::EventSink;
use super::situation::situation;
use super::{ActState, ChainContext, Initiator};
use crate::agents::percept::ChainPercepts;
use crate::agents::side::Side;
use crate::agents::{ChainControls, Intention, LeaderOutcome, Role};
use crate::deploy::{SensingContext, final_positions};
use crate::events::EventKind;
use crate::motion::recovery::RecoveryOutcome;
use crate::state::{Body, MissingNeighbors};
use sidestep_rods::geometry::Point;
use sidestep_rods::serde_point::WirePoint;
use std::collections::BTreeMap;

/// The talk of a chain's agents in a cycle.
pub(super) struct Negotiation<'a, const D: usize> {
    /// Perceptions of connectors, for somebody who asks.
    shown: Option<&'a mut Vec<ChainPercepts<D>>>,
    has_been: bool,
}

impl<'a, const D: usize> Negotiation<'a, D> {
    /// Returns the talk of a cycle before it has been.
    pub(super) fn new(shown: Option<&'a mut Vec<ChainPercepts<D>>>) -> Self {
        Self { shown, has_been: false }
    }
}

/// Lets the agents move the leader to a place, as the ladder allows; none if the chain stands because
/// somebody is lost, or if time was up before the leader had finished.
pub(super) fn negotiate_move<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    to: Point<D>,
) -> Option<RecoveryOutcome<D>> {
    let is_empty = who.setting.obstacles.is_empty();
    let wish = Intention {
        to: WirePoint(to),
        source: who.task.source(),
        situation: situation(who, acting.body),
        memory: std::mem::take(&mut acting.body.driving.ladder),
        is_empty,
        is_open: is_empty && acting.body.chain.is_plain(),
    };
    let memory = wish.memory.clone();
    let ended = negotiate(who.setting, acting, &Role::Leads(wish));
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

/// Lets the agents of a chain whose leader has not moved find out who is there.
pub(super) fn negotiate_rest<const D: usize>(
    setting: ChainContext<'_, D>,
    acting: &mut ActState<'_, D>,
) {
    if !acting.talk.has_been {
        negotiate(setting, acting, &Role::Rests);
    }
}

/// Lets the agents talk, and carries out their decisions; returns the end of the leader's wish.
fn negotiate<const D: usize>(
    setting: ChainContext<'_, D>,
    acting: &mut ActState<'_, D>,
    role: &Role<D>,
) -> Option<LeaderOutcome<D>> {
    let ActState { body, talk, told, .. } = acting;
    talk.has_been = true;
    let ChainContext { world, slot, now, obstacles, .. } = setting;
    let leader = setting.task(body).map_or(0, |task| task.agent);
    let sights = world.percepts(SensingContext { chain: slot, now, body, obstacles }, leader, role);
    let handed = body.handed.take().filter(|handed| handed.cycle == now);
    let ChainControls { controls, gone, .. } = match (handed, &mut talk.shown) {
        (Some(handed), _) => handed,
        (None, Some(shown)) => {
            shown.push((slot, sights));
            return None;
        }
        (None, None) => world.negotiate(slot, now, sights),
    };
    // Where somebody is gone nobody moves, also where the motion would not have come to it.
    if gone.is_empty()
        && let Some(points) = final_positions(&body.chain, &controls)
    {
        body.chain.points_mut().copy_from_slice(&points);
    }
    let all = || controls.iter().flatten();
    all().for_each(|control| body.tally.add_traffic(control.traffic));
    let mut missing = body.missing.clone();
    missing.resize(controls.len(), MissingNeighbors::default());
    all().for_each(|control| missing[control.connector as usize] = control.missing);
    mark_missing(&mut missing, &gone);
    record_missing(body, told, missing);
    let leads = controls.into_iter().nth(leader)??;
    if leads.is_late {
        body.tally.deadlines_missed += 1;
        told.record(&body.chain, EventKind::Deadline, leader, 0.0);
    }
    leads.ended.filter(|_| gone.is_empty())
}

/// Notes who is lost, and tells of each that a neighbor has lost, or has heard again.
fn record_missing<const D: usize>(
    body: &mut Body<D>,
    told: &mut EventSink<'_, D>,
    missing: Vec<MissingNeighbors>,
) {
    let (before, after) = (lost_connectors(&body.missing), lost_connectors(&missing));
    for (connector, by) in after.iter().filter(|(k, _)| !before.contains_key(k)) {
        body.tally.contacts_lost += 1;
        told.record(&body.chain, EventKind::Unheard, *connector as usize, f64::from(*by));
    }
    for (connector, by) in before.iter().filter(|(k, _)| !after.contains_key(k)) {
        told.record(&body.chain, EventKind::Heard, *connector as usize, f64::from(*by));
    }
    let nobody = missing.iter().all(|sides| sides == &[None; 2]);
    body.missing = if nobody { Vec::new() } else { missing };
}

/// Lets the neighbors miss those who are gone.
fn mark_missing(missing: &mut [MissingNeighbors], gone: &[u32]) {
    let n = missing.len() as u32;
    for &k in gone {
        for side in Side::ALL {
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
        for (side, missing) in Side::ALL.into_iter().zip(sides) {
            if let Some(connector) = missing.filter(|_| side.neighbor(k, n) == *missing) {
                lost.entry(connector).or_insert(k);
            }
        }
    }
    lost
}
