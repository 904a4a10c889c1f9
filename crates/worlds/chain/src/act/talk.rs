//! A cycle of a chain whose connectors decide for themselves: what they perceive, what comes of their
//! talk, and who is no longer heard.

use super::situation::situation;
use super::told::Told;
use super::{Acting, Initiator, Setting};
use crate::agents::side::Side;
use crate::agents::sight::Shown;
use crate::agents::{Ended, Handed, Role, Wish};
use crate::deploy::{Sensed, settled};
use crate::events::EventKind;
use crate::motion::replan::Climbed;
use crate::rods::geometry::Point;
use crate::rods::wire::Place;
use crate::state::{Body, Missing};
use std::collections::BTreeMap;

/// The talk of a chain's agents in a cycle.
pub(super) struct Talk<'a, const D: usize> {
    /// Perceptions of connectors, for somebody who asks.
    shown: Option<&'a mut Vec<Shown<D>>>,
    has_been: bool,
}

impl<'a, const D: usize> Talk<'a, D> {
    /// Returns the talk of a cycle before it has been.
    pub(super) fn new(shown: Option<&'a mut Vec<Shown<D>>>) -> Self {
        Self { shown, has_been: false }
    }
}

/// Lets the agents move the leader to a place, as the ladder allows; none if the chain stands because
/// somebody is lost, or if time was up before the leader had finished.
pub(super) fn climb<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    to: Point<D>,
) -> Option<Climbed<D>> {
    let is_empty = who.setting.obstacles.is_empty();
    let wish = Wish {
        to: Place(to),
        source: who.task.source(),
        situation: situation(who, acting.body),
        memory: std::mem::take(&mut acting.body.driving.ladder),
        is_empty,
        is_open: is_empty && acting.body.chain.is_plain(),
    };
    let memory = wish.memory.clone();
    let ended = talk(who.setting, acting, &Role::Leads(wish));
    let Some(Ended::Climbed { climbed, objection, memory }) = ended else {
        acting.body.driving.ladder = memory;
        acting.body.tally.stood += 1;
        return None;
    };
    acting.body.driving.ladder = memory;
    if let Some(veto) = &objection {
        acting.vetoed(veto);
    }
    Some(climbed)
}

/// Lets the agents of a chain whose leader has not moved find out who is there.
pub(super) fn rest<const D: usize>(setting: Setting<'_, D>, acting: &mut Acting<'_, D>) {
    if !acting.talk.has_been {
        talk(setting, acting, &Role::Rests);
    }
}

/// Lets the agents talk, and carries out their decisions; returns the end of the leader's wish.
fn talk<const D: usize>(
    setting: Setting<'_, D>,
    acting: &mut Acting<'_, D>,
    role: &Role<D>,
) -> Option<Ended<D>> {
    let Acting { body, talk, told, .. } = acting;
    talk.has_been = true;
    let Setting { world, slot, now, obstacles, .. } = setting;
    let leader = setting.task(body).map_or(0, |task| task.agent);
    let sights = world.sights(Sensed { chain: slot, now, body, obstacles }, leader, role);
    let handed = body.handed.take().filter(|handed| handed.cycle == now);
    let Handed { controls, gone, .. } = match (handed, &mut talk.shown) {
        (Some(handed), _) => handed,
        (None, Some(shown)) => {
            shown.push((slot, sights));
            return None;
        }
        (None, None) => world.talked(slot, now, sights),
    };
    // Where somebody is gone nobody moves, also where the motion would not have come to it.
    if gone.is_empty()
        && let Some(points) = settled(&body.chain, &controls)
    {
        body.chain.points_mut().copy_from_slice(&points);
    }
    let all = || controls.iter().flatten();
    all().for_each(|control| body.tally.add_traffic(control.traffic));
    let mut missing = body.missing.clone();
    missing.resize(controls.len(), Missing::default());
    all().for_each(|control| missing[control.connector as usize] = control.missing);
    miss(&mut missing, &gone);
    note_missing(body, told, missing);
    let leads = controls.into_iter().nth(leader)??;
    if leads.is_late {
        body.tally.deadlines_missed += 1;
        told.tell(&body.chain, EventKind::Deadline, leader, 0.0);
    }
    leads.ended.filter(|_| gone.is_empty())
}

/// Notes who is lost, and tells of each that a neighbor has lost, or has heard again.
fn note_missing<const D: usize>(body: &mut Body<D>, told: &mut Told<'_, D>, missing: Vec<Missing>) {
    let (before, after) = (lost(&body.missing), lost(&missing));
    for (connector, by) in after.iter().filter(|(k, _)| !before.contains_key(k)) {
        body.tally.contacts_lost += 1;
        told.tell(&body.chain, EventKind::Unheard, *connector as usize, f64::from(*by));
    }
    for (connector, by) in before.iter().filter(|(k, _)| !after.contains_key(k)) {
        told.tell(&body.chain, EventKind::Heard, *connector as usize, f64::from(*by));
    }
    let nobody = missing.iter().all(|sides| sides == &[None; 2]);
    body.missing = if nobody { Vec::new() } else { missing };
}

/// Lets the neighbors miss those who are gone.
fn miss(missing: &mut [Missing], gone: &[u32]) {
    let n = missing.len() as u32;
    for &k in gone {
        for side in Side::ALL {
            if let Some(neighbor) = side.of(k, n) {
                missing[neighbor as usize][side.other() as usize] = Some(k);
            }
        }
    }
}

/// Returns the connectors that a neighbor has lost, and the lowest such neighbor.
fn lost(missing: &[Missing]) -> BTreeMap<u32, u32> {
    let n = missing.len() as u32;
    let mut lost = BTreeMap::new();
    for (k, sides) in (0..).zip(missing) {
        for (side, missing) in Side::ALL.into_iter().zip(sides) {
            if let Some(connector) = missing.filter(|_| side.of(k, n) == *missing) {
                lost.entry(connector).or_insert(k);
            }
        }
    }
    lost
}
