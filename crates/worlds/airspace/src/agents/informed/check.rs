//! Checks of the others' messages, before an agent accepts them.

use super::{InformedAgent, InformedMessage};
use crate::agents::participant::{InvalidMessage, are_valid_coordinates};
use sidestep_collectives::Estimator;

impl InformedAgent {
    /// Checks a message of the agent at place `from`.
    pub(super) fn validate(
        &self,
        from: usize,
        message: &InformedMessage,
    ) -> Result<(), InvalidMessage> {
        let common = &*self.own.common;
        let filed = &common.filed[from];
        let actions = filed.actions.len();
        match message {
            InformedMessage::Predictions { beacon, predictions } => {
                InvalidMessage::Kind.unless(!self.by_model)?;
                common.check_beacon(from, beacon)?;
                common.check_predictions(predictions, actions)
            }
            InformedMessage::Model { beacon, next, mission, airplane, orders, altitude_m } => {
                InvalidMessage::Kind.unless(self.by_model)?;
                InvalidMessage::Airplane.unless(*airplane == common.ids[from])?;
                common.check_beacon(from, beacon)?;
                let is_short = mission.len() <= filed.max_way_points;
                InvalidMessage::Length.unless(is_short && *next as usize <= mission.len())?;
                InvalidMessage::Plan.unless(*orders as usize <= filed.orders)?;
                let coordinates_m = mission.as_flattened().iter().chain([altitude_m]);
                InvalidMessage::Number.unless(are_valid_coordinates(coordinates_m.copied()))
            }
            InformedMessage::Samples { round, change, samples } => {
                let Estimator::Sampled { block, .. } = self.own.settings().estimator else {
                    return Err(InvalidMessage::Kind);
                };
                common.check_round(*round, *change)?;
                InvalidMessage::Length.unless(samples.len() == block)?;
                InvalidMessage::Number.unless(samples.iter().all(|&x| usize::from(x) < actions))
            }
            InformedMessage::Distribution { round, change, q } => {
                InvalidMessage::Kind.unless(self.is_exact())?;
                common.check_round(*round, *change)?;
                InvalidMessage::Length.unless(q.len() == actions)?;
                let are_probabilities = q.iter().all(|p| (0.0..=1.0).contains(p));
                // The sum is rounded.
                let is_complete = (q.iter().sum::<f64>() - 1.0).abs() < 1e-6;
                InvalidMessage::Number.unless(is_complete && are_probabilities)
            }
        }
    }
}
