//! The deployments, by their names in scenarios.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A deployment of the rules by which chains move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Deployment {
    /// One process moves a whole chain.
    #[default]
    Direct,
    /// An agent per connector, which knows its neighbors.
    Team,
}
