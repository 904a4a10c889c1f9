//! Actions: the possible motions of an airplane in the near future, as the optimizer knows them.

use super::change::{ChangeAlternatives, FlightChange};
use super::motion::AircraftModel;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// An action: a turn, and changes of level and speed beside it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Action {
    /// The turn.
    pub turn: TurnAction,
    /// The changes of level and speed.
    pub change: FlightChange,
}

/// A turn rate, held for some time, and then proceeding to the way-point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum TurnAction {
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
    /// Proceeding at the level and the speed of the filed flight: the optimal action.
    pub const OPTIMAL: Self = Self::from_turn(TurnAction::Proceed);

    /// Returns a turn at the level and the speed of the filed flight.
    pub const fn from_turn(turn: TurnAction) -> Self {
        Self { turn, change: FlightChange::NONE }
    }
}

impl TurnAction {
    /// Returns the turn rate of the action after `flown_s` seconds of it, unless it proceeds to the
    /// way-point by then.
    #[inline]
    pub fn turn_rate_rad_s(self, flown_s: f64) -> Option<f64> {
        match self {
            Self::Hold { omega_rad_s } => Some(omega_rad_s),
            Self::Then { omega_rad_s, hold_s } => is_before(flown_s, hold_s).then_some(omega_rad_s),
            Self::Leg { omega_rad_s, turn_s, .. } if is_before(flown_s, turn_s) => {
                Some(omega_rad_s)
            }
            Self::Leg { until_s, .. } => is_before(flown_s, until_s).then_some(0.0),
            Self::Proceed => None,
        }
    }

    /// Returns the action with another turn rate, which follows from its own.
    fn map_turn_rate(self, map: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Hold { omega_rad_s } => Self::Hold { omega_rad_s: map(omega_rad_s) },
            Self::Then { omega_rad_s, hold_s } => {
                Self::Then { omega_rad_s: map(omega_rad_s), hold_s }
            }
            Self::Leg { omega_rad_s, turn_s, until_s } => {
                Self::Leg { omega_rad_s: map(omega_rad_s), turn_s, until_s }
            }
            Self::Proceed => Self::Proceed,
        }
    }
}

/// Returns whether a time is before another one by more than the rounding of step times, which must not decide.
#[inline]
fn is_before(time_s: f64, end_s: f64) -> bool {
    time_s < end_s - 1e-9
}

impl fmt::Display for TurnAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Hold { omega_rad_s } => f.write_str(&turn_text(omega_rad_s)),
            Self::Then { omega_rad_s, hold_s } => {
                write!(f, "{} for {hold_s} s", turn_text(omega_rad_s))
            }
            Self::Leg { omega_rad_s, turn_s, until_s } => {
                let turn = turn_text(omega_rad_s);
                write!(f, "{turn} for {turn_s} s, straight on until {until_s} s")
            }
            Self::Proceed => f.write_str("to the way-point"),
        }
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FlightChange { level_m, speed_m_s } = self.change;
        write!(f, "{}", self.turn)?;
        if level_m != 0.0 {
            write!(f, ", {level_m:+} m")?;
        }
        if speed_m_s != 0.0 {
            write!(f, ", {speed_m_s:+} m/s")?;
        }
        Ok(())
    }
}

fn turn_text(omega_rad_s: f64) -> String {
    if omega_rad_s == 0.0 {
        "straight on".into()
    } else {
        format!("{:+.1} °/s", omega_rad_s.to_degrees())
    }
}

/// Detours around others: a turn, a straight leg, and then proceeding.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetourAlternatives {
    /// Times in seconds that the turns may last.
    pub turns_s: Vec<f64>,
    /// Ends of the legs, in seconds from the start of the turn.
    pub until_s: Vec<f64>,
}

impl DetourAlternatives {
    /// Returns the legs of the default preset: heading changes of 10 to 60 degrees at the paper's
    /// turn rates, held for as long as most conflicts take to pass.
    pub fn default_preset() -> Self {
        Self { turns_s: vec![5.0, 10.0, 15.0], until_s: vec![60.0] }
    }

    /// Returns whether there are no legs: each takes a time of either list.
    pub fn is_empty(&self) -> bool {
        self.turns_s.is_empty() || self.until_s.is_empty()
    }

    /// Returns the legs that start with a turn rate. For straight on there is one turning time
    /// only, because all of them are the same path.
    fn turns_with_rate(&self, omega_rad_s: f64) -> Vec<TurnAction> {
        let mut actions = Vec::new();
        if omega_rad_s == 0.0 {
            actions.extend(
                self.until_s.iter().map(|&hold_s| TurnAction::Then { omega_rad_s, hold_s }),
            );
            return actions;
        }
        for &turn_s in &self.turns_s {
            for &until_s in &self.until_s {
                actions.push(TurnAction::Leg { omega_rad_s, turn_s, until_s });
            }
        }
        actions
    }
}

/// Returns the action set of a model, ordered by turn rate, the optimal action last. Without legs
/// it is the paper's: `2 m + 1` actions, every rate held forever and for `dt_s`. With legs, which
/// never start a turn only to undo it, these take the place of the held turns; straight on forever
/// remains. `holds_s` are further times in seconds for which turns are held. `changes` of level and speed follow the turns:
/// each beside the way to the way-point alone, or beside every turn.
pub fn actions(
    model: &AircraftModel,
    dt_s: f64,
    holds_s: &[f64],
    legs: &DetourAlternatives,
    changes: &ChangeAlternatives,
) -> Vec<Action> {
    let turns = turns(model, dt_s, holds_s, legs);
    let mut all: Vec<Action> = turns.iter().copied().map(Action::from_turn).collect();
    for change in changes.all() {
        if changes.is_product {
            all.extend(turns.iter().map(|&turn| Action { turn, change }));
        }
        all.push(Action { turn: TurnAction::Proceed, change });
    }
    all.push(Action::OPTIMAL);
    all
}

/// Returns the turns of a model, ordered by turn rate, without the way to the way-point.
fn turns(
    model: &AircraftModel,
    dt_s: f64,
    holds_s: &[f64],
    legs: &DetourAlternatives,
) -> Vec<TurnAction> {
    let mut all = Vec::new();
    for k in 0..model.turns {
        let omega_rad_s = turn_rate_rad_s(model, k);
        if legs.is_empty() || omega_rad_s == 0.0 {
            all.push(TurnAction::Hold { omega_rad_s });
        }
        if legs.is_empty() {
            all.push(TurnAction::Then { omega_rad_s, hold_s: dt_s });
        }
        all.extend(holds_s.iter().map(|&hold_s| TurnAction::Then { omega_rad_s, hold_s }));
        all.extend(legs.turns_with_rate(omega_rad_s));
    }
    all
}

/// Returns the action set of a model at another largest turn rate: the same turns, as much slower or faster.
pub(crate) fn actions_at_turn_rate<'a>(
    actions: &'a [Action],
    model: &AircraftModel,
    omega_max_rad_s: f64,
) -> Cow<'a, [Action]> {
    if omega_max_rad_s == model.omega_max_rad_s {
        return Cow::Borrowed(actions);
    }
    let factor = omega_max_rad_s / model.omega_max_rad_s;
    // Rounding must not lead beyond the limit, which all check.
    let scaled = |omega_rad_s: f64| (factor * omega_rad_s).clamp(-omega_max_rad_s, omega_max_rad_s);
    actions
        .iter()
        .map(|action| Action { turn: action.turn.map_turn_rate(scaled), ..*action })
        .collect()
}

/// Returns the `k`-th of a model's turn rates, from the fastest right turn to the fastest left turn.
fn turn_rate_rad_s(model: &AircraftModel, k: usize) -> f64 {
    let m = model.turns;
    // The middle rate is exactly 0, free of rounding: straight flight is recognized by that.
    if 2 * k + 1 == m {
        return 0.0;
    }
    let fraction = 2.0 * k as f64 / (m - 1) as f64 - 1.0;
    fraction * model.omega_max_rad_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: ChangeAlternatives =
        ChangeAlternatives { levels_m: Vec::new(), speeds_m_s: Vec::new(), is_product: false };

    fn model() -> AircraftModel {
        AircraftModel {
            v_m_s: 35.0,
            omega_max_rad_s: 4f64.to_radians(),
            separation_m: 500.0,
            turns: 5,
        }
    }

    #[test]
    fn the_action_set_is_ordered_and_contains_straight_flight() {
        let all = actions(&model(), 5.0, &[30.0], &DetourAlternatives::default(), &NONE);
        assert_eq!(all.len(), 5 * 3 + 1);
        assert_eq!(all[6], Action::from_turn(TurnAction::Hold { omega_rad_s: 0.0 }));
        assert_eq!(all[8], Action::from_turn(TurnAction::Then { omega_rad_s: 0.0, hold_s: 30.0 }));
        assert_eq!(all[15], Action::OPTIMAL);
    }

    #[test]
    fn legs_take_the_place_of_turns_that_are_undone() {
        let legs = DetourAlternatives { turns_s: vec![5.0, 15.0], until_s: vec![60.0] };
        let all = actions(&model(), 5.0, &[], &legs, &NONE);
        let omega_rad_s = -4f64.to_radians();
        assert_eq!(all.len(), 4 * 2 + 2 + 1);
        assert_eq!(
            all[1],
            Action::from_turn(TurnAction::Leg { omega_rad_s, turn_s: 15.0, until_s: 60.0 })
        );
        assert_eq!(all[4], Action::from_turn(TurnAction::Hold { omega_rad_s: 0.0 }));
        assert_eq!(all[5], Action::from_turn(TurnAction::Then { omega_rad_s: 0.0, hold_s: 60.0 }));
        assert_eq!(all[10], Action::OPTIMAL);
        let rates: Vec<_> =
            [0.0, 14.0, 15.0, 59.0, 60.0].map(|t| all[1].turn.turn_rate_rad_s(t)).into();
        assert_eq!(rates, [Some(omega_rad_s), Some(omega_rad_s), Some(0.0), Some(0.0), None]);
    }

    #[test]
    fn changes_of_level_and_speed_stand_beside_the_way_to_the_way_point_or_beside_every_turn() {
        let legs = DetourAlternatives::default();
        let mut changes = ChangeAlternatives {
            levels_m: vec![-300.0, 300.0],
            speeds_m_s: vec![-5.0],
            is_product: false,
        };
        let alone = actions(&model(), 5.0, &[], &legs, &changes);
        assert_eq!(alone.len(), 5 * 2 + 3 + 1);
        assert_eq!(alone[10].to_string(), "to the way-point, -300 m");
        assert_eq!(alone[13], Action::OPTIMAL);
        changes.is_product = true;
        let all = actions(&model(), 5.0, &[], &legs, &changes);
        assert_eq!(all.len(), 11 * 6);
        assert_eq!(all[0].to_string(), "-4.0 °/s");
        assert_eq!(all[64].to_string(), "to the way-point, +300 m, -5 m/s");
    }
}
