//! An agent's knowledge of its own airplane, and the knowledge that all agents of a group share.

use super::ActionChoice;
use super::participant::{InvalidMessage, are_valid_coordinates};
use super::traffic_state::{LastKnownState, StateBeacon, TrafficPicture};
use crate::areas::{AreaContext, Areas};
use crate::flight::{
    Action, AircraftModel, FlightConditions, Frame, KnownAircraft, Point, Pose2, Prediction,
    RoutePosition, TurnLimit, actions_at_turn_rate,
};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::objective::{ActionPredictions, Objective};
use crate::purpose;
use sidestep_collectives::{Estimator, OptimizerConfig, Player};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// The knowledge that all agents of a group share before their conversations.
#[derive(Debug, Clone)]
pub struct CommonKnowledge {
    /// The cycle in which they decide.
    pub now: Cycle,
    /// Ids of the group, rising.
    pub ids: Arc<[EntityId]>,
    /// The flights of the group as filed, in the order of the ids.
    pub filed: Vec<FiledFlight>,
    /// Poses at which all see the airplanes of the group, in the order of the ids.
    pub poses: Vec<Pose2>,
    /// The air that all fly through.
    pub air: FlightConditions,
    /// The objective that is minimized.
    pub objective: Objective,
    /// Settings of the optimizer, from the scenario.
    pub settings: OptimizerConfig,
    /// The random streams from which samples are drawn.
    pub streams: Streams,
    /// Non-cooperative airplanes near the group, as all see them.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
    /// The areas to stay out of, or inside of.
    pub areas: Areas,
    /// The wind around each of the group, in meters per second, in the order of the ids.
    pub winds_m_s: Vec<Point>,
    /// Whether the shield keeps airplanes that are not heard on their orbits.
    pub is_shielded: bool,
    /// Factor on the cost of deviations of each of the group, in the order of the ids.
    pub deviation_weights: Vec<f64>,
}

/// A flight as it was filed: what all others know of it without a message.
#[derive(Debug, Clone)]
pub struct FiledFlight {
    /// Abilities of the airplane.
    pub model: AircraftModel,
    /// Actions from which it may choose.
    pub actions: Vec<Action>,
    /// The knowledge that all others have of it before they have heard it.
    pub contact: LastKnownState,
    /// The limits on its turn rate.
    pub turn: TurnLimit,
    /// Its greatest speed in meters per second.
    pub max_speed_m_s: f64,
    /// Largest number of way-points that it is to reach under any orders.
    pub max_way_points: usize,
    /// Number of orders that it will be given.
    pub orders: usize,
}

impl CommonKnowledge {
    /// Returns where the actions of an airplane lead it, by the state that it sends.
    pub fn action_predictions(
        &self,
        place: usize,
        beacon: &StateBeacon,
        mission: &[Point],
        next: usize,
    ) -> ActionPredictions {
        let FiledFlight { model: filed, actions, .. } = &self.filed[place];
        let model = AircraftModel {
            v_m_s: beacon.v_m_s,
            omega_max_rad_s: beacon.omega_max_rad_s,
            separation_m: beacon.separation_m,
            ..filed.clone()
        };
        let route = RoutePosition { mission, next, pose: beacon.pose };
        let actions = actions_at_turn_rate(actions, filed, beacon.omega_max_rad_s);
        let predictions = self.air_around(place).predictions(&model, &actions, route, None);
        let frame = self.air.surface.frame_at(beacon.pose.at);
        ActionPredictions::new(predictions, frame, beacon.separation_m, beacon.levels)
            .with_non_cooperative(&self.non_cooperative, &self.objective, self.air.timing.dtau_s)
            .with_areas(&self.area_context(), &self.objective, self.air.timing.dtau_s)
            .with_deviation_weight(self.deviation_weights[place])
    }

    /// Returns the air around the airplane at a place.
    pub(super) fn air_around(&self, place: usize) -> FlightConditions {
        FlightConditions { wind_m_s: self.winds_m_s[place], ..self.air }
    }

    /// Returns what is the same for all areas around the group.
    pub(super) fn area_context(&self) -> AreaContext<'_> {
        let FlightConditions { timing, wind_m_s, surface, .. } = self.air;
        AreaContext {
            areas: &self.areas,
            surface,
            wind_m_s,
            now_s: self.now as f64 * timing.dt_s,
            look_ahead_s: timing.horizon_s() + timing.dtau_s,
        }
    }

    /// Returns the frame in which the predictions of the airplane at a place lie: where all see it.
    pub(super) fn frame(&self, place: usize) -> Frame {
        self.air.surface.frame_at(self.poses[place].at)
    }

    /// Returns the `k`-th uniform number in [0, 1) of an airplane's stream, which all can draw.
    pub(super) fn uniform(&self, place: usize, k: u64) -> f64 {
        purpose::sample(&self.streams, self.ids[place], self.now, k)
    }

    /// Returns the decision of an airplane's player after some rounds, of which the last `calm` were
    /// calm; none if it has not learned anything.
    pub(super) fn action_choice(
        &self,
        place: usize,
        player: &Player,
        rounds: u32,
        calm: u32,
    ) -> Option<ActionChoice> {
        let OptimizerConfig { estimator, choice, stop, .. } = self.settings;
        let drawn = match estimator {
            Estimator::Exact => 0,
            Estimator::Sampled { block, .. } => u64::from(rounds) * block as u64,
        };
        (!player.expected().is_empty()).then(|| ActionChoice {
            chosen: player.choose(choice, self.uniform(place, drawn)),
            expected: player.expected().to_vec(),
            rounds,
            converged: calm >= stop.calm_rounds,
            reached: None,
            chances: player.q.clone(),
        })
    }

    /// Checks a beacon of the airplane at a place.
    ///
    /// # Errors
    /// When it is not where all see it, or cannot fly like that.
    pub(super) fn check_beacon(
        &self,
        place: usize,
        beacon: &StateBeacon,
    ) -> Result<(), InvalidMessage> {
        let FiledFlight { contact, turn, max_speed_m_s, .. } = &self.filed[place];
        let filed = &contact.beacon;
        // As fast as it can turn at the speed that it has.
        let is_filed = beacon.omega_max_rad_s == turn.omega_rad_s(beacon.v_m_s)
            && beacon.orbit_rad_s == filed.orbit_rad_s
            && beacon.separation_m == filed.separation_m;
        InvalidMessage::Plan.ensure(is_filed && beacon.pose == self.poses[place])?;
        beacon.check(*max_speed_m_s)
    }

    /// Checks some predictions.
    ///
    /// # Errors
    /// When there are not `expected` of them, or one does not span the whole horizon.
    pub(super) fn check_predictions(
        &self,
        predictions: &[Prediction],
        expected: usize,
    ) -> Result<(), InvalidMessage> {
        InvalidMessage::Length.ensure(predictions.len() == expected)?;
        predictions.iter().try_for_each(|prediction| {
            let is_whole = prediction.points.len() == self.air.timing.horizon;
            InvalidMessage::Length
                .ensure(is_whole && prediction.counted <= prediction.points.len())?;
            InvalidMessage::Number
                .ensure(are_valid_coordinates(prediction.points.as_flattened().iter().copied()))
        })
    }

    /// Checks how far an agent's probabilities have moved in a round: infinitely far before the first.
    ///
    /// # Errors
    /// When there is no such round, or a distance is no number.
    pub(super) fn check_round(&self, round: u32, change: f64) -> Result<(), InvalidMessage> {
        InvalidMessage::Round.ensure(round <= self.settings.stop.max_rounds)?;
        InvalidMessage::Number.ensure(change >= 0.0)
    }

    /// Returns the largest number of bytes of a message with this number of predictions.
    pub(super) fn max_message_bytes(&self, predictions: usize) -> usize {
        let way_points = self.filed.iter().map(|filed| filed.max_way_points).max().unwrap_or(0);
        // A point takes 16 bytes, a length at most 10; the rest of a message is well below 512.
        512 + predictions * (16 * self.air.timing.horizon + 20) + 16 * way_points
    }

    /// Returns the largest number of actions of any airplane of the group.
    pub(super) fn max_actions(&self) -> usize {
        self.filed.iter().map(|filed| filed.actions.len()).max().unwrap_or(0)
    }
}

/// An agent's knowledge of its own airplane, and of others from messages.
#[derive(Debug, Clone)]
pub struct Ownship {
    /// Place in the group.
    pub me: usize,
    /// State of the airplane, and the number of way-points behind it.
    pub known: KnownAircraft,
    /// The message in which it describes itself.
    pub beacon: StateBeacon,
    /// Way-points that it is to reach.
    pub mission: Vec<Point>,
    /// Predictions of its own actions.
    pub options: ActionPredictions,
    /// Knowledge of others from earlier cycles.
    pub contacts: TrafficPicture,
    /// The knowledge that all share.
    pub common: Arc<CommonKnowledge>,
}

impl Ownship {
    pub(super) fn settings(&self) -> &OptimizerConfig {
        &self.common.settings
    }

    pub(super) fn uniform(&self, k: u64) -> f64 {
        self.common.uniform(self.me, k)
    }

    /// Returns the next `block` samples of a player after `drawn`.
    pub(super) fn samples(&self, player: &Player, drawn: u64, block: usize) -> Vec<usize> {
        (drawn..drawn + block as u64).map(|k| player.sample(self.uniform(k))).collect()
    }

    /// Returns the decision of a player of samples or of distributions after some rounds, of which
    /// the last `calm` were calm; none if it has not learned anything.
    pub(super) fn action_choice(
        &self,
        player: &Player,
        rounds: u32,
        calm: u32,
    ) -> Option<ActionChoice> {
        self.common.action_choice(self.me, player, rounds, calm)
    }

    /// Returns whether another one was heard lately, or is met for the first time.
    pub(super) fn is_expected(&self, other: usize) -> bool {
        let contact = self.contacts.get(&self.common.ids[other]);
        contact.is_none_or(|contact| contact.heard_in + 1 >= self.common.now)
    }

    /// Returns the predictions for another one that is not heard.
    pub(crate) fn presumed_predictions(&self, other: usize) -> ActionPredictions {
        let id = self.common.ids[other];
        let filed = &self.common.filed[other].contact;
        self.predictions_from_state(self.contacts.get(&id).unwrap_or(filed), other)
    }

    /// Returns the same for one that was heard a moment ago.
    pub(super) fn predictions_from_beacon(
        &self,
        other: usize,
        beacon: &StateBeacon,
    ) -> ActionPredictions {
        let contact = LastKnownState::from_beacon(beacon.clone(), self.common.now);
        self.predictions_from_state(&contact, other)
    }

    fn predictions_from_state(&self, contact: &LastKnownState, place: usize) -> ActionPredictions {
        let CommonKnowledge { is_shielded, now, .. } = *self.common;
        let frame = self.common.frame(place);
        contact.presumed_predictions(&self.common.air_around(place), is_shielded, now, frame)
    }
}
