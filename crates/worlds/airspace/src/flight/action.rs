//! Actions: the possible motions of an airplane in the near future, as the optimizer knows them.

use super::motion::Model;
use serde::{Deserialize, Serialize};
use std::fmt;

/// An action: a turn rate, held for some time, and then proceeding to the way-point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// The turn rate, held for the whole horizon (the paper's g = 0).
    Hold {
        /// Turn rate in radians per second, positive to the left.
        omega_rad_s: f64,
    },
    /// The turn rate for `hold_s` (dt in the paper, g = 1), and then proceeding.
    Then {
        /// Turn rate in radians per second, positive to the left.
        omega_rad_s: f64,
        /// Time in seconds for which it is held.
        hold_s: f64,
    },
    /// The turn rate, then straight on, and then proceeding: a leg to one side.
    Leg {
        /// Turn rate in radians per second, positive to the left.
        omega_rad_s: f64,
        /// Time in seconds for which it turns.
        turn_s: f64,
        /// End of the leg, in seconds from the start of the turn.
        until_s: f64,
    },
    /// Proceeding from the start: the optimal action.
    Proceed,
}

impl Action {
    /// Returns the turn rate of the action after `flown_s` seconds of it, unless it proceeds to the
    /// way-point by then.
    #[inline]
    pub fn turn_rate_rad_s(self, flown_s: f64) -> Option<f64> {
        // A tolerance, because rounding of step times must not decide.
        let before = |end_s: f64| flown_s < end_s - 1e-9;
        match self {
            Self::Hold { omega_rad_s } => Some(omega_rad_s),
            Self::Then { omega_rad_s, hold_s } => before(hold_s).then_some(omega_rad_s),
            Self::Leg { omega_rad_s, turn_s, .. } if before(turn_s) => Some(omega_rad_s),
            Self::Leg { until_s, .. } => before(until_s).then_some(0.0),
            Self::Proceed => None,
        }
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let turn = |omega_rad_s: f64| match omega_rad_s {
            0.0 => "straight on".into(),
            _ => format!("{:+.1} °/s", omega_rad_s.to_degrees()),
        };
        match *self {
            Self::Hold { omega_rad_s } => f.write_str(&turn(omega_rad_s)),
            Self::Then { omega_rad_s, hold_s } => write!(f, "{} for {hold_s} s", turn(omega_rad_s)),
            Self::Leg { omega_rad_s, turn_s, until_s } => {
                write!(f, "{} for {turn_s} s, straight on until {until_s} s", turn(omega_rad_s))
            }
            Self::Proceed => f.write_str("to the way-point"),
        }
    }
}

/// Ways around others: a turn, a straight leg, and then proceeding.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Legs {
    /// Times in seconds that the turns may last.
    pub turns_s: Vec<f64>,
    /// Ends of the legs, in seconds from the start of the turn.
    pub until_s: Vec<f64>,
}

impl Legs {
    /// Returns the legs of the default preset: heading changes of 10 to 60 degrees at the paper's
    /// turn rates, held for as long as most conflicts take to pass.
    pub fn default_preset() -> Self {
        Self { turns_s: vec![5.0, 10.0, 15.0], until_s: vec![60.0] }
    }

    /// Returns whether there are no legs.
    pub fn is_empty(&self) -> bool {
        self.turns_s.is_empty() || self.until_s.is_empty()
    }

    /// Returns the legs that start with a turn rate. For straight on there is one turning time
    /// only, because all of them lead the same way.
    fn actions_with_turn_rate(&self, omega_rad_s: f64) -> Vec<Action> {
        let straight = |&hold_s: &f64| Action::Then { omega_rad_s: 0.0, hold_s };
        if omega_rad_s == 0.0 {
            return self.until_s.iter().map(straight).collect();
        }
        let leg = |(&turn_s, &until_s): (&f64, &f64)| Action::Leg { omega_rad_s, turn_s, until_s };
        self.turns_s
            .iter()
            .flat_map(|turn_s| self.until_s.iter().map(move |until_s| leg((turn_s, until_s))))
            .collect()
    }
}

/// Returns the action set of a model, ordered by turn rate, the optimal action last. Without legs
/// it is the paper's: `2 m + 1` actions, every rate held forever and for `dt_s`. With legs, which
/// never start a turn only to undo it, these take the place of the held turns; straight on forever
/// remains. `holds_s` are further times in seconds for which turns are held.
pub fn actions(model: &Model, dt_s: f64, holds_s: &[f64], legs: &Legs) -> Vec<Action> {
    let m = model.turns;
    let rate = |k: usize| match 2.0 * k as f64 / (m - 1) as f64 - 1.0 {
        // The middle rate is exactly 0, free of rounding.
        _ if 2 * k + 1 == m => 0.0,
        part => part * model.omega_max_rad_s,
    };
    let mut all = Vec::new();
    for omega_rad_s in (0..m).map(rate) {
        if legs.is_empty() || omega_rad_s == 0.0 {
            all.push(Action::Hold { omega_rad_s });
        }
        if legs.is_empty() {
            all.push(Action::Then { omega_rad_s, hold_s: dt_s });
        }
        all.extend(holds_s.iter().map(|&hold_s| Action::Then { omega_rad_s, hold_s }));
        all.extend(legs.actions_with_turn_rate(omega_rad_s));
    }
    all.push(Action::Proceed);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Model {
        Model { v_m_s: 35.0, omega_max_rad_s: 4f64.to_radians(), separation_m: 500.0, turns: 5 }
    }

    #[test]
    fn the_action_set_is_ordered_and_contains_straight_flight() {
        let all = actions(&model(), 5.0, &[30.0], &Legs::default());
        assert_eq!(all.len(), 5 * 3 + 1);
        assert_eq!(all[6], Action::Hold { omega_rad_s: 0.0 });
        assert_eq!(all[8], Action::Then { omega_rad_s: 0.0, hold_s: 30.0 });
        assert_eq!(all[15], Action::Proceed);
    }

    #[test]
    fn legs_take_the_place_of_turns_that_are_undone() {
        let legs = Legs { turns_s: vec![5.0, 15.0], until_s: vec![60.0] };
        let all = actions(&model(), 5.0, &[], &legs);
        let omega_rad_s = -4f64.to_radians();
        assert_eq!(all.len(), 4 * 2 + 2 + 1);
        assert_eq!(all[1], Action::Leg { omega_rad_s, turn_s: 15.0, until_s: 60.0 });
        assert_eq!(all[4], Action::Hold { omega_rad_s: 0.0 });
        assert_eq!(all[5], Action::Then { omega_rad_s: 0.0, hold_s: 60.0 });
        assert_eq!(all[10], Action::Proceed);
        let rates: Vec<_> = [0.0, 14.0, 15.0, 59.0, 60.0].map(|t| all[1].turn_rate_rad_s(t)).into();
        assert_eq!(rates, [Some(omega_rad_s), Some(omega_rad_s), Some(0.0), Some(0.0), None]);
    }
}
