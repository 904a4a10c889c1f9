//! Knowledge of an agent about its own airplane, and of all agents of a group alike.

use super::Decided;
use super::contact::{Beacon, Contact, Contacts};
use crate::flight::{Action, Air, Known, Model, Point};
use crate::objective::{Objective, Options};
use crate::purpose;
use sidestep_collectives::{Estimator, Player, Settings};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Knowledge that all agents of a group share before they talk.
#[derive(Debug, Clone)]
pub struct Briefing {
    /// The cycle.
    pub now: Cycle,
    /// Ids of the group, rising.
    pub ids: Arc<[EntityId]>,
    /// Their flights as they were filed, in this order.
    pub filed: Vec<Filed>,
    /// The air that all fly through.
    pub air: Air,
    /// What is optimized,
    pub objective: Objective,
    /// and how.
    pub settings: Settings,
    /// From which samples are drawn.
    pub streams: Streams,
    /// Whether the shield keeps airplanes that are not heard on their orbits.
    pub is_shielded: bool,
}

/// A flight as it was filed.
#[derive(Debug, Clone)]
pub struct Filed {
    /// Abilities of the airplane.
    pub model: Model,
    /// Actions that it may choose from.
    pub actions: Vec<Action>,
    /// Knowledge that all have of it before they have heard of it.
    pub contact: Contact,
}

impl Briefing {
    /// Returns where the actions of an airplane lead it, by what it tells of itself.
    pub fn options(
        &self,
        place: usize,
        beacon: &Beacon,
        mission: &[Point],
        next: usize,
    ) -> Options {
        let Filed { model, actions, .. } = &self.filed[place];
        let model = Model {
            v_m_s: beacon.v_m_s,
            omega_max_rad_s: beacon.omega_max_rad_s,
            separation_m: beacon.separation_m,
            ..model.clone()
        };
        let predictions = self.air.predictions(&model, actions, mission, (beacon.pose, next));
        Options::new(predictions, beacon.separation_m, beacon.levels)
    }
}

/// Knowledge of an agent about its own airplane, and hearsay about others.
#[derive(Debug, Clone)]
pub struct OwnShip {
    /// Place in the group.
    pub me: usize,
    /// Its place, and the number of way-points behind it.
    pub known: Known,
    /// Message in which it tells of itself.
    pub beacon: Beacon,
    /// Way-points that it is to reach.
    pub mission: Vec<Point>,
    /// Predictions of its actions.
    pub options: Options,
    /// Hearsay about others from earlier cycles.
    pub contacts: Contacts,
    /// Knowledge that all share.
    pub briefing: Arc<Briefing>,
}

impl OwnShip {
    pub(super) fn settings(&self) -> &Settings {
        &self.briefing.settings
    }

    pub(super) fn uniform(&self, k: u64) -> f64 {
        purpose::sample(&self.briefing.streams, self.known.slot, self.briefing.now, k)
    }

    /// The next `block` samples of a player after `drawn`.
    pub(super) fn samples(&self, player: &Player, drawn: u64, block: usize) -> Vec<usize> {
        (drawn..drawn + block as u64).map(|k| player.draw(self.uniform(k))).collect()
    }

    /// What a player of samples or of distributions comes to after some rounds, of which the
    /// last `calm` were calm; nothing, if it has not learned anything.
    pub(super) fn decided(&self, player: &Player, rounds: u32, calm: u32) -> Option<Decided> {
        let Settings { estimator, choice, stop, .. } = *self.settings();
        let drawn = match estimator {
            Estimator::Exact => 0,
            Estimator::Sampled { block, .. } => u64::from(rounds) * block as u64,
        };
        (!player.expected().is_empty()).then(|| Decided {
            chosen: player.choose(choice, self.uniform(drawn)),
            expected: player.expected().to_vec(),
            rounds,
            converged: calm >= stop.calm_rounds,
        })
    }

    /// Whether another one was heard of late, or never yet.
    pub(super) fn expects(&self, other: usize) -> bool {
        let contact = self.contacts.get(&self.briefing.ids[other]);
        contact.is_none_or(|contact| contact.heard_in + 1 >= self.briefing.now)
    }

    /// Predictions for another one that is not heard.
    pub(super) fn presumed(&self, other: usize) -> Options {
        let id = self.briefing.ids[other];
        let filed = || &self.briefing.filed[other].contact;
        self.taken_to_fly(self.contacts.get(&id).unwrap_or_else(filed))
    }

    /// The same of one that was heard a moment ago.
    pub(super) fn presumed_from(&self, beacon: &Beacon) -> Options {
        self.taken_to_fly(&Contact::heard(beacon.clone(), self.briefing.now))
    }

    fn taken_to_fly(&self, contact: &Contact) -> Options {
        let Briefing { air, is_shielded, now, .. } = &*self.briefing;
        contact.options(air, *is_shielded, *now)
    }
}
