//! Actions that a caller orders, as an airplane keeps them until it decides.

use super::flight::Point;
use serde::{Deserialize, Serialize};

/// An external order: the action that an airplane is to propose in its next decision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ExternalAction {
    /// Its actions by number, the best first.
    Ranking(Vec<u16>),
    /// A turn rate in radians per second, positive to the left.
    TurnRate(f64),
    /// A velocity through the air in meters per second, east and north.
    Velocity(Point),
}

impl ExternalAction {
    /// Name of the order whose values are the actions by number, the best first.
    pub const RANKING: &'static str = "ranking";
    /// Name of the order whose value is a turn rate in radians per second.
    pub const TURN_RATE: &'static str = "turn_rate_rad_s";
    /// Name of the order whose values are a velocity through the air in meters per second, east and north.
    pub const VELOCITY: &'static str = "velocity_m_s";

    /// Returns the action of an order by its name; `None` where there is no such order.
    pub(crate) fn from_order(order: &str, values: &[f64]) -> Option<Self> {
        match (order, values) {
            (Self::RANKING, actions) => {
                Some(Self::Ranking(actions.iter().map(|&action| action as u16).collect()))
            }
            (Self::TURN_RATE, &[omega_rad_s]) => Some(Self::TurnRate(omega_rad_s)),
            (Self::VELOCITY, &[vx, vy]) => Some(Self::Velocity([vx, vy])),
            _ => None,
        }
    }

    /// Checks whether it can be flown; its numbers are within their bounds.
    ///
    /// # Errors
    /// When it cannot: the reason, and the remedy.
    pub(crate) fn check(&self) -> Result<(), String> {
        match self {
            Self::Ranking(actions) => check_ranking(actions),
            Self::Velocity([0.0, 0.0]) => {
                Err("0 has no direction; give a velocity that is not 0 in both parts".into())
            }
            Self::TurnRate(_) | Self::Velocity(_) => Ok(()),
        }
    }
}

fn check_ranking(actions: &[u16]) -> Result<(), String> {
    let mut counts = vec![0_usize; actions.len()];
    for &action in actions {
        counts[usize::from(action)] += 1;
    }
    // Where no action occurs twice, none is missing.
    let Some(double) = counts.iter().position(|&count| count > 1) else { return Ok(()) };
    let Some(missing) = counts.iter().position(|&count| count == 0) else { return Ok(()) };
    Err(format!(
        "action {double} stands in it {} times and action {missing} not at all; give each action from \
         0 to {} once, the best first",
        counts[double],
        actions.len() - 1
    ))
}
