//! Changes of level and speed among which an airplane may choose, as keys of a scenario give them.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::json;
use sidestep_scenario::{invalid_value, schema_by_hand};

/// Largest number of changes in a list: the work for a pair grows with the square of the number of actions.
const MAX_CHANGES: usize = 8;
/// Largest change, in meters or meters per second.
const MAX_CHANGE: f64 = 100_000.0;

/// A list of changes, none of them 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ChangeList(pub(crate) Vec<f64>);

impl<'de> Deserialize<'de> for ChangeList {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let changes = Vec::<f64>::deserialize(deserializer)?;
        let is_valid = |change: &f64| *change != 0.0 && change.abs() <= MAX_CHANGE;
        if changes.len() <= MAX_CHANGES && changes.iter().all(is_valid) {
            return Ok(Self(changes));
        }
        let remedy = format!(
            "give up to {MAX_CHANGES} numbers from -{MAX_CHANGE} to {MAX_CHANGE}, and not 0: that is always among them"
        );
        Err(invalid_value(format_args!("{changes:?}"), &remedy))
    }
}

schema_by_hand!(
    ChangeList,
    json!({
        "type": "array",
        "items": { "type": "number", "minimum": -MAX_CHANGE, "maximum": MAX_CHANGE },
        "maxItems": MAX_CHANGES,
    })
);

/// Which changes of heading, level and speed an action may have together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Combinations {
    /// An action has a turn, a change of level or a change of speed.
    #[default]
    None,
    /// Every turn is combined with every change of level and of speed.
    All,
}
