//! What programs ask of a world that they do not know: orders and rewards of learning agents, and the tools of the
//! studio's page.

use super::external_action::ExternalAction;
use sidestep_scenario::editing::{EditAction, EditItems, EditNote, EditTool, Editing};
use sidestep_scenario::facts::{
    GroupSizes, PositionUnit, RecordedPositions, RewardMeasure, RewardTerm, WorldFacts,
};

/// Distance beyond which an observed way-point stands for none, of an airplane that keeps a heading, in meters: farther
/// than any real one.
const NO_WAY_POINT_M: f64 = 1e11;

pub(crate) const FACTS: WorldFacts = WorldFacts {
    default_order: Some(ExternalAction::TURN_RATE),
    reward_terms: &[
        RewardTerm {
            name: "progress",
            meaning: "meters closer to its way-point",
            measure: RewardMeasure::Approach {
                target: "way_point_m",
                targets_left: "way_points_left",
                active: "due",
                none_beyond_m: NO_WAY_POINT_M,
            },
            default_weight: 0.0,
        },
        RewardTerm {
            name: "separation",
            meaning: "number of observed neighbors closer than the separation",
            measure: RewardMeasure::Near {
                positions: "neighbor_place_m",
                ids: "neighbor_id",
                separations: "neighbor_separation_m",
            },
            default_weight: -1.0,
        },
        RewardTerm {
            name: "delay",
            meaning: "seconds of additional delay at arrival",
            measure: RewardMeasure::Increase { observation: "delay_s", active: "due" },
            default_weight: -0.01,
        },
    ],
    positions: Some(RecordedPositions {
        agent: "airplane",
        part: None,
        axes: ["x_m", "y_m"],
        unit: PositionUnit::Meters,
        kinds: &[],
    }),
    group_sizes: Some(GroupSizes::Column { table: "optimizations", column: "airplanes" }),
};

/// Sections of airplanes that are given one by one.
const AIRPLANES: &str = "airplanes";

pub(crate) fn editing_tools() -> Editing {
    Editing {
        tools: vec![
            EditTool::SELECT,
            EditTool {
                id: "airplane",
                sign: "✈",
                name: "Airplane",
                help: "Drag from its start to its first way-point",
                action: EditAction::AddRoute { section: AIRPLANES },
            },
            EditTool {
                id: "way-point",
                sign: "⚑",
                name: "Way-point",
                help: "Click adds a way-point to the selected airplane",
                action: EditAction::AddWayPoint { section: AIRPLANES },
            },
        ],
        items: vec![EditItems::Routes { section: AIRPLANES, noun: "airplane" }],
        notes: vec![EditNote {
            when: None,
            unless: Some(AIRPLANES),
            text: "Generated traffic has no airplanes in the text; those that you add fly in addition to it.",
        }],
        ..Editing::default()
    }
}
