//! The order in which the bodies of a conflict group act.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The order within a conflict group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConflictPolicy {
    /// A fair draw per body and cycle.
    #[default]
    Random,
    /// The order of entity ids.
    Fixed,
    /// The rank of the kind (`kind_order`), then a fair draw.
    ByKind,
    /// The body that comes from the right goes first; where all four headings meet, a fair draw
    /// says which heading starts.
    RightOfWay,
    /// The fair draw of `random`, but in rounds: a body acts when it has the highest key among its
    /// neighbors, until all have acted. The outcome is the same, but found in parallel inside large
    /// groups.
    Rounds,
    /// No order: all transitions are drawn, then made at once. A box that is left can be entered in the same cycle,
    /// rings rotate, two bodies do not exchange their boxes, and a fair draw decides between those that want the same
    /// box.
    Simultaneous,
}

impl ConflictPolicy {
    /// Every policy, the default one first.
    pub const ALL: [Self; 6] = [
        Self::Random,
        Self::Fixed,
        Self::ByKind,
        Self::RightOfWay,
        Self::Rounds,
        Self::Simultaneous,
    ];

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Fixed => "fixed",
            Self::ByKind => "by_kind",
            Self::RightOfWay => "right_of_way",
            Self::Rounds => "rounds",
            Self::Simultaneous => "simultaneous",
        }
    }
}
