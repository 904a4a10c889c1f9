//! Checks of the others' messages, before an agent accepts them.

use super::search::{LocalSearchAgent, SearchLimits};
use super::{PredictionSharingAgent, PredictionSharingMessage};
use crate::agents::participant::{InvalidMessage, are_valid_coordinates};
use sidestep_collectives::{Estimator, LocalSearch};

impl PredictionSharingAgent {
    /// Checks a message of the agent at place `from`.
    pub(super) fn validate_message(
        &self,
        from: usize,
        message: &PredictionSharingMessage,
    ) -> Result<(), InvalidMessage> {
        let common = &*self.own.common;
        let filed = &common.filed[from];
        let actions = filed.actions.len();
        match message {
            PredictionSharingMessage::Predictions { beacon, predictions } => {
                InvalidMessage::Kind.ensure(!self.by_model && filed.changes.is_none())?;
                common.check_beacon(from, beacon)?;
                common.check_predictions(predictions, actions)
            }
            PredictionSharingMessage::ChangePredictions { beacon, orders, predictions } => {
                InvalidMessage::Kind.ensure(!self.by_model && filed.changes.is_some())?;
                common.check_beacon(from, beacon)?;
                common.check_orders(from, *orders)?;
                common.check_predictions(predictions, actions)
            }
            PredictionSharingMessage::Model {
                beacon,
                next,
                mission,
                airplane,
                orders,
                altitude_m,
            } => {
                InvalidMessage::Kind.ensure(self.by_model)?;
                InvalidMessage::Airplane.ensure(*airplane == common.ids[from])?;
                common.check_beacon(from, beacon)?;
                let is_short = mission.len() <= filed.max_way_points;
                InvalidMessage::Length.ensure(is_short && *next as usize <= mission.len())?;
                common.check_orders(from, *orders)?;
                let coordinates_m = mission.as_flattened().iter().chain([altitude_m]);
                InvalidMessage::Number.ensure(are_valid_coordinates(coordinates_m.copied()))
            }
            PredictionSharingMessage::Samples { round, change, samples } => {
                let Estimator::Sampled { block, .. } = self.own.settings().estimator else {
                    return Err(InvalidMessage::Kind);
                };
                common.check_round(*round, *change)?;
                InvalidMessage::Length.ensure(samples.len() == block)?;
                InvalidMessage::Number.ensure(samples.iter().all(|&x| usize::from(x) < actions))
            }
            PredictionSharingMessage::Distribution { round, change, q } => {
                InvalidMessage::Kind.ensure(self.has_exact_estimator())?;
                common.check_round(*round, *change)?;
                InvalidMessage::Length.ensure(q.len() == actions)?;
                let are_probabilities = q.iter().all(|p| (0.0..=1.0).contains(p));
                // The sum is rounded.
                let is_complete = (q.iter().sum::<f64>() - 1.0).abs() < 1e-6;
                InvalidMessage::Number.ensure(is_complete && are_probabilities)
            }
            PredictionSharingMessage::Search(message) => {
                let is_local = self.own.settings().local_search == LocalSearch::Pairs;
                InvalidMessage::Kind.ensure(is_local)?;
                let actions: Vec<usize> =
                    common.filed.iter().map(|one| one.actions.len()).collect();
                let made = self.search.as_ref().map_or(0, LocalSearchAgent::steps);
                let limits =
                    SearchLimits { actions: &actions, starts: self.starts(), max_step: made + 1 };
                message.check(from, &limits)
            }
        }
    }
}
