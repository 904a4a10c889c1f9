//! A cycle of a chain whose connectors decide for themselves: what they perceive, what comes of their
//! talk, and who is no longer heard.

use super::Acting;
use crate::agents::side::Side;
use crate::agents::{Ended, Handed, Role, Wish};
use crate::deploy::kind::Deployment;
use crate::deploy::settled;
use crate::driver::Task;
use crate::events::EventKind;
use crate::motion::replan::Climbed;
use crate::rods::geometry::Point;
use crate::rods::wire::Place;
use crate::state::Missing;
use std::collections::BTreeMap;

impl<const D: usize> Acting<'_, D> {
    /// Returns whether agents move the chain.
    pub(super) fn is_team(&self) -> bool {
        self.world.deployment == Deployment::Team
    }

    /// Lets the agents move the leader to a place, as the ladder allows; none if the chain stands because
    /// somebody is lost, or if time was up before the leader had finished.
    pub(super) fn climb_as_team(&mut self, task: &Task<D>, to: Point<D>) -> Option<Climbed<D>> {
        let is_empty = self.scratch.obstacles.is_empty();
        let wish = Wish {
            to: Place(to),
            source: task.source(),
            situation: self.situation(task),
            memory: std::mem::take(&mut self.body.driving.ladder),
            is_empty,
            is_open: is_empty && self.body.chain.is_plain(),
        };
        let memory = wish.memory.clone();
        let ended = self.talk(&Role::Leads(wish));
        let Some(Ended::Climbed { climbed, objection, memory }) = ended else {
            self.body.driving.ladder = memory;
            self.body.tally.stood += 1;
            return None;
        };
        self.body.driving.ladder = memory;
        if let Some(veto) = &objection {
            self.vetoed(veto);
        }
        Some(climbed)
    }

    /// Lets the agents of a chain whose leader has not moved find out who is there.
    pub(super) fn rest_as_team(&mut self) {
        if self.is_team() && !self.has_talked {
            self.talk(&Role::Rests);
        }
    }

    /// Lets the agents talk, and carries out their decisions; returns the end of the leader's wish.
    fn talk(&mut self, role: &Role<D>) -> Option<Ended<D>> {
        self.has_talked = true;
        let leader = self.task().map_or(0, |task| task.agent);
        let (who, obstacles) = ((self.slot, self.now), &self.scratch.obstacles);
        let sights = self.world.sights(who, self.body, obstacles, (leader, role));
        let handed = self.body.handed.take().filter(|handed| handed.cycle == self.now);
        let Handed { controls, gone, .. } = match (handed, &mut self.scratch.shown) {
            (Some(handed), _) => handed,
            (None, Some(shown)) => {
                shown.push((self.slot, sights));
                return None;
            }
            (None, None) => self.world.talked(who, sights),
        };
        // Where somebody is gone nobody moves, also where the motion would not have come to it.
        if gone.is_empty()
            && let Some(points) = settled(&self.body.chain, &controls)
        {
            self.body.chain.points_mut().copy_from_slice(&points);
        }
        let all = || controls.iter().flatten();
        all().for_each(|control| self.body.tally.add_traffic(control.traffic));
        let mut missing = self.body.missing.clone();
        missing.resize(controls.len(), Missing::default());
        all().for_each(|control| missing[control.connector as usize] = control.missing);
        miss(&mut missing, &gone);
        self.note_missing(missing);
        let leads = controls.into_iter().nth(leader)??;
        if leads.is_late {
            self.body.tally.deadlines_missed += 1;
            self.tell(EventKind::Deadline, leader, 0.0);
        }
        leads.ended.filter(|_| gone.is_empty())
    }

    /// Notes who is lost, and tells of each that a neighbor has lost, or has heard again.
    fn note_missing(&mut self, missing: Vec<Missing>) {
        let (before, after) = (lost(&self.body.missing), lost(&missing));
        for (connector, by) in after.iter().filter(|(k, _)| !before.contains_key(k)) {
            self.body.tally.contacts_lost += 1;
            self.tell(EventKind::Unheard, *connector as usize, f64::from(*by));
        }
        for (connector, by) in before.iter().filter(|(k, _)| !after.contains_key(k)) {
            self.tell(EventKind::Heard, *connector as usize, f64::from(*by));
        }
        let nobody = missing.iter().all(|sides| sides == &[None; 2]);
        self.body.missing = if nobody { Vec::new() } else { missing };
    }
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
