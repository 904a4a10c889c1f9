//! Words of the targets of an arm's tool.

use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_arms::Arm;

/// A part of a pose that does not count, in the axes of the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum FreeAxis {
    /// The position along x.
    X,
    /// The position along y.
    Y,
    /// The position along z.
    Z,
    /// The turn about x.
    Rx,
    /// The turn about y.
    Ry,
    /// The turn about z.
    Rz,
}

/// The way from one target to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PathWord {
    /// Any: by local rules and plans.
    Any,
    /// A straight line of the tool.
    Line,
}

/// The tool of an arm whose targets are compiled.
#[derive(Clone, Copy)]
pub(super) struct ToolContext<'a> {
    pub(super) arm: Option<&'a Arm>,
    /// The connector that leads.
    pub(super) connector: usize,
}
