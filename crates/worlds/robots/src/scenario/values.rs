//! Values of a scenario that are checked when they are read.

use crate::effector::{self, MAX_PATH_STEPS};
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use sidestep_error_models::delay::MAX_DELAY_CYCLES;
use sidestep_scenario::{Integer, Rule, invalid_value, schema_by_hand};

/// Boxes of a body's side: 64 of 0.25 m are 16 m, more than any body in a building, and each box of
/// a body costs time in every action.
pub(crate) type SideBoxes = Integer<1, 64>;
/// Cycles of a delay.
pub(crate) type DelayCycles = Integer<1, { MAX_DELAY_CYCLES as u64 }>;
/// Cycles that an action takes; as many as a delay may have.
pub(crate) type ActionCycles = Integer<1, { MAX_DELAY_CYCLES as u64 }>;
/// Cycles from one action to the next.
pub(crate) type Period = Integer<1, { u32::MAX as u64 }>;

/// Actions of a plan.
pub(crate) type Steps = Integer<1, { u32::MAX as u64 }>;
/// Expansions of a search: each takes some microseconds and some hundred bytes a robot.
pub(crate) type Budget = Integer<1, 1_000_000_000>;

/// Length of a box's side in meters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxSide;

impl Rule for BoxSide {
    fn allows(number: f64) -> bool {
        number > 0.0 && number <= 1000.0
    }

    fn description() -> String {
        "a side above 0 m, typically 0.1 to 0.5".into()
    }

    fn limits() -> Value {
        json!({ "exclusiveMinimum": 0, "maximum": 1000 })
    }
}

/// Column and row, and the facing unless it is to be drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StartPose {
    pub(crate) at: (u32, u32),
    pub(crate) facing: Option<u8>,
}

impl<'de> Deserialize<'de> for StartPose {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<u32>::deserialize(deserializer)?;
        match numbers[..] {
            [col, row] => Ok(Self { at: (col, row), facing: None }),
            [col, row, facing] if facing < 4 => {
                Ok(Self { at: (col, row), facing: Some(facing as u8) })
            }
            _ => {
                let remedy = "write [col, row] or [col, row, heading] with heading 0 east, \
                              1 north, 2 west, 3 south";
                Err(invalid_value(format_args!("{numbers:?}"), remedy))
            }
        }
    }
}

schema_by_hand!(StartPose, {
    let whole = json!({ "type": "integer", "minimum": 0, "maximum": u32::MAX });
    let heading = json!({ "type": "integer", "minimum": 0, "maximum": 3 });
    json!({
        "type": "array", "prefixItems": [whole, whole, heading], "items": false,
        "minItems": 2, "maxItems": 3
    })
});

/// Steps of an action: letters F, L, B, R.
#[derive(Debug, Clone, Default)]
pub(crate) struct PathSteps(pub(crate) Vec<effector::Side>);

impl<'de> Deserialize<'de> for PathSteps {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let steps: Option<Vec<_>> = text.chars().map(effector::Side::from_letter).collect();
        let remedy = "write up to 16 letters F, L, B, R, e.g. \"FL\"";
        let steps = steps.filter(|steps| steps.len() <= MAX_PATH_STEPS);
        steps.map(Self).ok_or_else(|| invalid_value(format_args!("{text:?}"), remedy))
    }
}

schema_by_hand!(
    PathSteps,
    json!({ "type": "string", "pattern": "^[FLBR]*$", "maxLength": MAX_PATH_STEPS })
);

/// Quarters of a full turn to the left, given in degrees.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct QuarterTurns(pub(crate) u8);

impl<'de> Deserialize<'de> for QuarterTurns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let turn_deg = i32::deserialize(deserializer)?;
        if turn_deg % 90 != 0 {
            let remedy = "give a multiple of 90 degrees, positive to the left";
            return Err(invalid_value(turn_deg, remedy));
        }
        Ok(Self((turn_deg / 90).rem_euclid(4) as u8))
    }
}

schema_by_hand!(QuarterTurns, json!({ "type": "integer", "multipleOf": 90 }));
