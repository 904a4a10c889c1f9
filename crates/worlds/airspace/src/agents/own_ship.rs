//! An agent's knowledge of its own airplane, and the knowledge that all agents of a group share.

use super::Decided;
use super::contact::{Beacon, Contact, Contacts};
use super::party::{Unsound, are_places};
use crate::flight::{Action, Air, Known, Model, Point, Pose, Prediction};
use crate::intruder::Intruder;
use crate::objective::{Objective, Options};
use crate::purpose;
use sidestep_collectives::{Estimator, Player, Settings};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// The knowledge that all agents of a group share before they talk.
#[derive(Debug, Clone)]
pub struct Briefing {
    /// The present cycle.
    pub now: Cycle,
    /// Ids of the group, rising.
    pub ids: Arc<[EntityId]>,
    /// The flights of the group as filed, in the order of the ids.
    pub filed: Vec<Filed>,
    /// Poses at which all see the airplanes of the group, in the order of the ids.
    pub poses: Vec<Pose>,
    /// The air that all fly through.
    pub air: Air,
    /// The objective that is minimized.
    pub objective: Objective,
    /// Settings of the optimizer.
    pub settings: Settings,
    /// The random streams from which samples are drawn.
    pub streams: Streams,
    /// Airplanes near the group that mind no other, as all see them.
    pub intruders: Vec<Intruder>,
    /// Whether the shield keeps airplanes that are not heard on their orbits.
    pub is_shielded: bool,
}

/// A flight as it was filed.
#[derive(Debug, Clone)]
pub struct Filed {
    /// Abilities of the airplane.
    pub model: Model,
    /// Actions from which it may choose.
    pub actions: Vec<Action>,
    /// The knowledge that all others have of it before they have heard it.
    pub contact: Contact,
    /// Its greatest speed in meters per second.
    pub top_m_s: f64,
    /// Largest number of way-points that it is to reach under any orders.
    pub most_way_points: usize,
    /// Number of orders that it will be given.
    pub orders: usize,
}

impl Briefing {
    /// Returns where the actions of an airplane lead it, by the state that it sends.
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
        let predictions = self.air.predictions(&model, actions, mission, beacon.pose, next);
        Options::new(predictions, beacon.separation_m, beacon.levels).beside(
            &self.intruders,
            &self.objective,
            self.air.timing.dtau_s,
        )
    }

    /// Returns the `k`-th uniform number in [0, 1) of an airplane's stream, which all can draw.
    pub(super) fn uniform(&self, place: usize, k: u64) -> f64 {
        purpose::sample(&self.streams, self.ids[place], self.now, k)
    }

    /// Returns the decision of an airplane's player after some rounds, of which the last `calm` were
    /// calm; none, if it has not learned anything.
    pub(super) fn decided(
        &self,
        place: usize,
        player: &Player,
        rounds: u32,
        calm: u32,
    ) -> Option<Decided> {
        let Settings { estimator, choice, stop, .. } = self.settings;
        let drawn = match estimator {
            Estimator::Exact => 0,
            Estimator::Sampled { block, .. } => u64::from(rounds) * block as u64,
        };
        (!player.expected().is_empty()).then(|| Decided {
            chosen: player.choose(choice, self.uniform(place, drawn)),
            expected: player.expected().to_vec(),
            rounds,
            converged: calm >= stop.calm_rounds,
            chances: player.q.clone(),
        })
    }

    /// Checks a beacon of the airplane at a place.
    ///
    /// # Errors
    /// When it is not where all see it, or cannot fly like that.
    pub(super) fn admits(&self, place: usize, beacon: &Beacon) -> Result<(), Unsound> {
        let Filed { contact: Contact { beacon: filed, .. }, top_m_s, .. } = &self.filed[place];
        let model = |b: &Beacon| [b.omega_max_rad_s, b.orbit_rad_s, b.separation_m];
        let is_filed = model(beacon) == model(filed) && beacon.pose == self.poses[place];
        Unsound::Plan.unless(is_filed)?;
        beacon.check(*top_m_s)
    }

    /// Checks some predicted ways.
    ///
    /// # Errors
    /// When there are not `expected` of them, or one does not span the whole horizon.
    pub(super) fn admits_ways(&self, ways: &[Prediction], expected: usize) -> Result<(), Unsound> {
        Unsound::Length.unless(ways.len() == expected)?;
        ways.iter().try_for_each(|way| {
            let is_whole = way.points.len() == self.air.timing.horizon;
            Unsound::Length.unless(is_whole && way.counted <= way.points.len())?;
            Unsound::Number.unless(are_places(way.points.as_flattened().iter().copied()))
        })
    }

    /// Checks how far an agent's probabilities have moved in a round: infinitely far before the first.
    ///
    /// # Errors
    /// When there is no such round, or a distance is no number.
    pub(super) fn admits_round(&self, round: u32, change: f64) -> Result<(), Unsound> {
        Unsound::Round.unless(round <= self.settings.stop.max_rounds)?;
        Unsound::Number.unless(change >= 0.0)
    }

    /// Returns the largest number of bytes of a message with this number of predicted ways.
    pub(super) fn most_bytes(&self, ways: usize) -> usize {
        let way_points = self.filed.iter().map(|filed| filed.most_way_points).max().unwrap_or(0);
        512 + ways * (16 * self.air.timing.horizon + 20) + 16 * way_points
    }

    /// Returns the largest number of actions of any airplane of the group.
    pub(super) fn most_actions(&self) -> usize {
        self.filed.iter().map(|filed| filed.actions.len()).max().unwrap_or(0)
    }
}

/// An agent's knowledge of its own airplane, and of others from messages.
#[derive(Debug, Clone)]
pub struct OwnShip {
    /// Place in the group.
    pub me: usize,
    /// State of the airplane, and the number of way-points behind it.
    pub known: Known,
    /// The message in which it describes itself.
    pub beacon: Beacon,
    /// Way-points that it is to reach.
    pub mission: Vec<Point>,
    /// Predictions of its own actions.
    pub options: Options,
    /// Knowledge of others from earlier cycles.
    pub contacts: Contacts,
    /// The knowledge that all share.
    pub briefing: Arc<Briefing>,
}

impl OwnShip {
    pub(super) fn settings(&self) -> &Settings {
        &self.briefing.settings
    }

    pub(super) fn uniform(&self, k: u64) -> f64 {
        self.briefing.uniform(self.me, k)
    }

    /// Returns the next `block` samples of a player after `drawn`.
    pub(super) fn samples(&self, player: &Player, drawn: u64, block: usize) -> Vec<usize> {
        (drawn..drawn + block as u64).map(|k| player.draw(self.uniform(k))).collect()
    }

    /// Returns the decision of a player of samples or of distributions after some rounds, of which
    /// the last `calm` were calm; none, if it has not learned anything.
    pub(super) fn decided(&self, player: &Player, rounds: u32, calm: u32) -> Option<Decided> {
        self.briefing.decided(self.me, player, rounds, calm)
    }

    /// Returns whether another one was heard lately, or is met for the first time.
    pub(super) fn expects(&self, other: usize) -> bool {
        let contact = self.contacts.get(&self.briefing.ids[other]);
        contact.is_none_or(|contact| contact.heard_in + 1 >= self.briefing.now)
    }

    /// Returns the predictions for another one that is not heard.
    pub(super) fn presumed(&self, other: usize) -> Options {
        let id = self.briefing.ids[other];
        let filed = || &self.briefing.filed[other].contact;
        self.taken_to_fly(self.contacts.get(&id).unwrap_or_else(filed))
    }

    /// Returns the same for one that was heard a moment ago.
    pub(super) fn presumed_from(&self, beacon: &Beacon) -> Options {
        self.taken_to_fly(&Contact::heard(beacon.clone(), self.briefing.now))
    }

    fn taken_to_fly(&self, contact: &Contact) -> Options {
        let Briefing { air, is_shielded, now, .. } = &*self.briefing;
        contact.options(air, *is_shielded, *now)
    }
}
