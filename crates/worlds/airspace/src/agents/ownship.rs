//! An agent's knowledge of its own airplane, and the knowledge that all agents of a group share.

use super::ActionChoice;
use super::participant::{InvalidMessage, are_valid_coordinates};
use super::traffic_state::{LastKnownState, StateBeacon, TrafficPicture};
use crate::areas::{AreaContext, Areas};
use crate::flight::{
    Action, AircraftModel, ChangeableFlight, FiledLevelSpeed, FlightConditions, Frame,
    KnownAircraft, MethodCommand, Performance, Point, Pose2, Prediction, RoutePosition, TurnLimit,
    actions_at_turn_rate,
};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::objective::{ActionChanges, ActionPredictions, Objective};
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
    /// What all see of the levels and the speeds of the group, in the order of the ids; empty where no method commands any.
    pub commanded: Vec<CommandedFlight>,
    /// Whether the shield keeps airplanes that are not heard on their orbits.
    pub is_shielded: bool,
    /// Factor on the cost of deviations of each of the group, in the order of the ids.
    pub deviation_weights: Vec<f64>,
}

/// What all see of an airplane whose level and speed a method may command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandedFlight {
    /// Altitude in meters.
    pub altitude_m: f64,
    /// The command that is in force.
    pub command: MethodCommand,
}

/// The filed level and speed of an airplane whose actions change them.
#[derive(Debug, Clone)]
pub struct FiledChanges {
    /// What the airplane can fly.
    pub performance: Performance,
    /// Its level and its speed after each number of its orders.
    pub filed: Vec<FiledLevelSpeed>,
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
    /// What its actions change; none where they are turns alone.
    pub changes: Option<FiledChanges>,
}

/// The part of a flight that only the airplane knows, and sends.
#[derive(Debug, Clone, Copy)]
pub struct RouteProgress<'a> {
    /// Way-points that it is to reach.
    pub mission: &'a [Point],
    /// Number of way-points done with.
    pub next: usize,
    /// Number of its orders that are carried out.
    pub orders: u32,
}

impl CommonKnowledge {
    /// Returns where the actions of an airplane lead it, by the state that it sends.
    pub fn action_predictions(
        &self,
        place: usize,
        beacon: &StateBeacon,
        progress: RouteProgress<'_>,
    ) -> ActionPredictions {
        let RouteProgress { mission, next, orders } = progress;
        let FiledFlight { model: filed, actions, .. } = &self.filed[place];
        let model = AircraftModel {
            v_m_s: beacon.v_m_s,
            omega_max_rad_s: beacon.omega_max_rad_s,
            separation_m: beacon.separation_m,
            ..filed.clone()
        };
        let route = RoutePosition { mission, next, pose: beacon.pose };
        let actions = actions_at_turn_rate(actions, filed, beacon.omega_max_rad_s);
        let flight = self.changeable_flight(place, orders, beacon.v_m_s);
        let air = self.air_around(place);
        let predictions = air.predictions(&model, &actions, route, flight.as_ref());
        let frame = self.air.surface.frame_at(beacon.pose.at);
        let options =
            ActionPredictions::new(predictions, frame, beacon.separation_m, beacon.levels);
        let timing = &self.air.timing;
        let changes = flight.map(|flight| ActionChanges::new(&flight, &actions, timing));
        self.with_costs(place, options, changes)
    }

    /// Returns the options of an airplane by the predictions that it sends; `changes` are those of its actions.
    pub(super) fn heard_options(
        &self,
        place: usize,
        beacon: &StateBeacon,
        predictions: Vec<Prediction>,
        changes: Option<ActionChanges>,
    ) -> ActionPredictions {
        let StateBeacon { separation_m, levels, .. } = *beacon;
        let options = ActionPredictions::new(predictions, self.frame(place), separation_m, levels);
        self.with_costs(place, options, changes)
    }

    /// Returns the options of the airplane at a place with all that others know of them.
    fn with_costs(
        &self,
        place: usize,
        mut options: ActionPredictions,
        changes: Option<ActionChanges>,
    ) -> ActionPredictions {
        if let Some(changes) = changes {
            options = options.with_changes(changes);
        }
        options
            .with_non_cooperative(&self.non_cooperative, &self.objective, self.air.timing.dtau_s)
            .with_areas(&self.area_context(), &self.objective, self.air.timing.dtau_s)
            .with_deviation_weight(self.deviation_weights[place])
    }

    /// Returns what the airplane at a place flies and would fly by its filed flight after some orders; `None` if it has no
    /// changes to choose from.
    fn changeable_flight(
        &self,
        place: usize,
        orders: u32,
        v_m_s: f64,
    ) -> Option<ChangeableFlight<'_>> {
        let FiledChanges { performance, filed } = self.filed[place].changes.as_ref()?;
        let altitude_m = self.commanded[place].altitude_m;
        Some(ChangeableFlight::new(*filed.get(orders as usize)?, performance, altitude_m, v_m_s))
    }

    /// Returns the altitudes and the speeds that the actions of the airplane at a place lead to, by what it sends; none
    /// where they are turns alone.
    pub(super) fn action_changes(
        &self,
        place: usize,
        orders: u32,
        beacon: &StateBeacon,
    ) -> Option<ActionChanges> {
        let flight = self.changeable_flight(place, orders, beacon.v_m_s)?;
        Some(ActionChanges::new(&flight, &self.filed[place].actions, &self.air.timing))
    }

    /// Returns whether the actions of some airplane of the group change levels or speeds.
    pub(super) fn has_changes(&self) -> bool {
        self.filed.iter().any(|filed| filed.changes.is_some())
    }

    /// Checks the number of orders that the airplane at a place says that it has carried out.
    ///
    /// # Errors
    /// When it will not be given so many.
    pub(super) fn check_orders(&self, place: usize, orders: u32) -> Result<(), InvalidMessage> {
        InvalidMessage::Plan.ensure(orders as usize <= self.filed[place].orders)
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
        let air = self.common.air_around(place);
        let Some(seen) = self.common.commanded.get(place) else {
            return contact.presumed_predictions(&air, is_shielded, now, frame);
        };
        // Its level and a command in force are seen, whether or not it is heard. Its speed by its orders is not: without a
        // command it is presumed to be that of its last message.
        let mut contact = contact.clone();
        let to_m = seen.command.level.map_or(seen.altitude_m, |level| level.altitude_m);
        let levels = &mut contact.beacon.levels;
        *levels = levels.extended_by_level(seen.altitude_m).extended_by_level(to_m);
        contact.beacon.v_m_s = seen.command.v_m_s.unwrap_or(contact.beacon.v_m_s);
        contact.presumed_predictions(&air, is_shielded, now, frame)
    }
}
