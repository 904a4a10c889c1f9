//! Checks of the others' messages, before an agent takes them.

use super::{Agent, Message};
use crate::agents::party::{Unsound, are_places};
use sidestep_collectives::Estimator;

impl Agent {
    /// Checks a message of the agent at place `from`.
    pub(super) fn checked(&self, from: usize, message: &Message) -> Result<(), Unsound> {
        let briefing = &*self.own.briefing;
        let filed = &briefing.filed[from];
        let actions = filed.actions.len();
        match message {
            Message::Ways { beacon, ways } => {
                Unsound::Kind.unless(!self.by_model)?;
                briefing.admits(from, beacon)?;
                briefing.admits_ways(ways, actions)
            }
            Message::Model { beacon, next, mission, airplane, orders, altitude_m } => {
                Unsound::Kind.unless(self.by_model)?;
                Unsound::Airplane.unless(*airplane == briefing.ids[from])?;
                briefing.admits(from, beacon)?;
                let is_short = mission.len() <= filed.most_way_points;
                Unsound::Length.unless(is_short && *next as usize <= mission.len())?;
                Unsound::Plan.unless(*orders as usize <= filed.orders)?;
                let told_m = mission.as_flattened().iter().chain([altitude_m]);
                Unsound::Number.unless(are_places(told_m.copied()))
            }
            Message::Samples { round, change, samples } => {
                let Estimator::Sampled { block, .. } = self.own.settings().estimator else {
                    return Err(Unsound::Kind);
                };
                briefing.admits_round(*round, *change)?;
                Unsound::Length.unless(samples.len() == block)?;
                Unsound::Number.unless(samples.iter().all(|&x| usize::from(x) < actions))
            }
            Message::Distribution { round, change, q } => {
                Unsound::Kind.unless(self.is_exact())?;
                briefing.admits_round(*round, *change)?;
                Unsound::Length.unless(q.len() == actions)?;
                let is_share = |p: &f64| (0.0..=1.0).contains(p);
                let is_whole = (q.iter().sum::<f64>() - 1.0).abs() < 1e-6;
                Unsound::Number.unless(is_whole && q.iter().all(is_share))
            }
        }
    }
}
