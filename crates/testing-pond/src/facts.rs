//! What programs ask of a world that they do not know.

use super::external;
use sidestep_scenario::editing::{EditAction, EditItems, EditTool, Editing};
use sidestep_scenario::facts::{
    PositionUnit, RecordedPositions, RewardMeasure, RewardTerm, WorldFacts,
};

pub(crate) const FACTS: WorldFacts = WorldFacts {
    default_order: Some(external::HOP),
    reward_terms: &[RewardTerm {
        name: "hopped",
        meaning: "1 where a frog has left its pad",
        measure: RewardMeasure::Changed { observation: "pad" },
        default_weight: 1.0,
    }],
    positions: Some(RecordedPositions {
        agent: "frog",
        part: None,
        axes: ["x_m", "y_m"],
        unit: PositionUnit::Meters,
        kinds: &[],
    }),
    group_sizes: None,
};

pub(crate) fn editing() -> Editing {
    Editing {
        tools: vec![
            EditTool::SELECT,
            EditTool {
                id: "reed",
                sign: "|",
                name: "Reed",
                help: "Click lets reeds grow on a pad",
                action: EditAction::AddPoint { section: "reeds" },
            },
        ],
        items: vec![EditItems::Points { section: "reeds", noun: "reed" }],
        ..Editing::default()
    }
}
