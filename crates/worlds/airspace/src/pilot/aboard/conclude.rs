//! The conclusions that a pilot draws: from its perception, and from the talks that it has ended.

use super::Pilot;
use super::turn::Stage;
use crate::agents::contact::{Contacts, note};
use crate::agents::exchange::Agreed;
use crate::agents::intent::Intent;
use crate::agents::packet::Topic;
use crate::agents::{Conclusion, Ended};
use crate::decide::{Considered, Manner, alone, as_decided, by_velocity};
use crate::events::{Event, EventKind};
use crate::flight::Known;
use crate::pilot::briefing::unheard;
use crate::pilot::control::{Course, Optimized};
use crate::pilot::sight::Sighted;
use crate::pilot::talks::Came;

impl Pilot {
    /// Notes the group that it has found; without an outcome it is alone.
    fn is_grouped(&mut self, came: Option<Came>, tick: u64) {
        let Some(turn) = &mut self.turn else { return };
        let sight = &mut turn.sight;
        let near = std::mem::take(&mut sight.group);
        match came {
            Some(Came::Found(found)) => {
                (sight.group, sight.intruders) = (found.members, found.intruders);
            }
            _ => sight.group = near.iter().filter(|one| one.id == self.id).copied().collect(),
        }
        turn.members = sight.members().into();
        let is_member = |one: &Sighted| turn.members.binary_search(&one.id).is_ok();
        turn.unheard = near.into_iter().filter(|one| !is_member(one)).collect();
        let unheard = turn.unheard.iter().map(|one| one.id).collect();
        turn.note_unheard(&self.world, unheard, &self.memory.contacts);
        self.decide(tick);
    }

    /// Starts to choose its wishes.
    pub(super) fn decide(&mut self, tick: u64) {
        let Some(turn) = &self.turn else { return };
        let group: Vec<Known> = turn.sight.group.iter().map(|one| one.known()).collect();
        let others = turn.sight.intruders.len() + turn.unheard.len();
        let manner = Manner::of(&self.world, &group, others);
        match manner {
            Manner::Optimizing | Manner::Reacting => self.talk(Topic::Decision, tick),
            Manner::Alone | Manner::TooMany => self.decide_alone(manner, group.len()),
        }
    }

    /// Decides without a talk.
    pub(super) fn decide_alone(&mut self, manner: Manner, members: usize) {
        let Some(turn) = &mut self.turn else { return };
        let own = &turn.sight.own;
        if manner == Manner::TooMany && turn.members.first() == Some(&self.id) {
            let event = Event::of(turn.sight.cycle, EventKind::GroupTooLarge, self.id);
            turn.control.events.push(event.with(members as f64));
        }
        let considered = alone(&self.world, own.known(), own.wish.as_ref());
        self.is_decided(considered);
    }

    /// Notes its wishes; without the shield it flies the first of them.
    fn is_decided(&mut self, considered: Considered) {
        let Some(turn) = &mut self.turn else { return };
        turn.considered = considered;
        turn.stage = Stage::Decided;
        if !self.world.shield {
            let way = turn.considered.ways.first().cloned().unwrap_or_default();
            let side = turn.sight.own.fallback;
            turn.control.course = Course::Way { wish: 0, way, side };
            self.is_over();
        }
    }

    fn is_over(&mut self) {
        if let Some(turn) = &mut self.turn {
            turn.stage = Stage::Over;
            turn.control.memory = self.memory.clone();
        }
    }

    /// Ends the talk that it is in, and draws the conclusion from it.
    pub(super) fn conclude(&mut self, ended: Ended<Came>, tick: u64) {
        let Some(turn) = &mut self.turn else { return };
        if self.world.network.is_some() {
            turn.note_end(&self.world, &ended, &self.memory.contacts);
        }
        match std::mem::replace(&mut turn.stage, Stage::Decided) {
            Stage::Grouping(talk) => {
                self.keep_past(talk);
                self.is_grouped(ended.outcome, tick);
            }
            Stage::Deciding(talk) => {
                self.keep_past(talk);
                match ended.outcome {
                    Some(Came::Told(told)) => self.react(&told),
                    Some(Came::Decided(conclusion)) => self.is_optimized(Some(conclusion)),
                    _ => self.is_optimized(None),
                }
            }
            Stage::Shielding(talk, allowed) => {
                self.keep_past(talk);
                self.is_shielded(ended.outcome, &allowed);
            }
            Stage::Decided | Stage::Over => {}
        }
    }

    /// Notes the outcome of the shield's exchange, in which it has proposed the ways that were `allowed`.
    fn is_shielded(&mut self, came: Option<Came>, allowed: &[usize]) {
        let Some(turn) = &mut self.turn else { return };
        self.memory.contacts = match came {
            Some(Came::Agreed(Agreed { decision, held_back, contacts })) => {
                if held_back {
                    let event = Event::of(turn.sight.cycle, EventKind::HeldBack, self.id);
                    turn.control.events.push(event);
                }
                turn.control.course = turn.considered.course(decision, allowed);
                contacts
            }
            // Without an agreement it no longer knows where any other airplane is.
            _ => Contacts::new(),
        };
        self.is_over();
    }

    /// Notes the outcome of an optimization; none if time was up before there was any.
    fn is_optimized(&mut self, conclusion: Option<Conclusion>) {
        let Some(turn) = &mut self.turn else { return };
        let (decided, beacons) =
            conclusion.map_or_else(Default::default, |came| (came.decided, came.beacons));
        turn.control.optimized = Some(Optimized::of(decided.as_ref()));
        if self.world.network.is_some() {
            for (beacon, &id) in beacons.into_iter().zip(&*turn.members) {
                if let Some(beacon) = beacon {
                    note(&mut self.memory.contacts, id, beacon, turn.sight.cycle);
                }
            }
        }
        let considered = as_decided(&self.world, turn.sight.own.known(), decided);
        self.is_decided(considered);
    }

    /// Finds the headings of all from their messages; one without a message is taken to fly straight on.
    fn react(&mut self, told: &[Option<Intent>]) {
        let Some(turn) = &self.turn else { return };
        let (mut group, mut memory, mut me) = (Vec::new(), Vec::new(), 0);
        let beside = turn.unheard.iter().map(|one| unheard(&self.world, one));
        let mut intruders: Vec<_> = turn.sight.intruders.iter().cloned().chain(beside).collect();
        for (one, intent) in turn.sight.group.iter().zip(told) {
            let Some(intent) = intent else {
                intruders.push(unheard(&self.world, one));
                continue;
            };
            if one.id == self.id {
                me = group.len();
            }
            let &Intent { next, orders, altitude_m, .. } = intent;
            let next = next as usize;
            group.push(Known { slot: one.id, pose: one.pose, next, orders, altitude_m });
            memory.push(intent.resolving.clone());
        }
        let mut all = by_velocity(&self.world, &group, &intruders, &mut memory);
        if self.world.is_resolving() {
            self.memory.resolving = memory.swap_remove(me);
        }
        self.is_decided(all.swap_remove(me));
    }
}
