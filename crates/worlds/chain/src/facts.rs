//! What programs ask of a world that they do not know: orders and rewards of learning agents, and the tools of the
//! studio's page.

use sidestep_scenario::editing::{EditAction, EditItems, EditTool, Editing, FileUse, UsedFile};
use sidestep_scenario::facts::{
    PositionUnit, RecordedPositions, RewardMeasure, RewardTerm, WorldFacts,
};

pub(crate) const FACTS: WorldFacts = WorldFacts {
    default_order: Some("to_m"),
    reward_terms: &[
        RewardTerm {
            name: "veto",
            meaning: "1 where a part of the chain vetoed",
            measure: RewardMeasure::Positive { observation: "veto" },
            default_weight: -1.0,
        },
        RewardTerm {
            name: "progress",
            meaning: "fraction of the ordered motion that was carried out",
            measure: RewardMeasure::Value { observation: "done_share" },
            default_weight: 0.1,
        },
    ],
    positions: Some(RecordedPositions {
        agent: "chain",
        part: Some("connector"),
        axes: ["x_m", "y_m"],
        unit: PositionUnit::Meters,
        kinds: &[],
    }),
    group_sizes: None,
};

/// Sections of what chains creep among.
const OBSTACLES: &str = "obstacles";

pub(crate) fn editing() -> Editing {
    let tool = |id, sign, name, help, action| EditTool { id, sign, name, help, action };
    let section = OBSTACLES;
    Editing {
        tools: vec![
            EditTool::SELECT,
            tool("ball", "●", "Ball", "Drag from center to edge", EditAction::AddBall { section }),
            tool("wall", "╱", "Wall", "Drag from end to end", EditAction::AddWall { section }),
            tool("box", "▭", "Box", "Drag from corner to corner", EditAction::AddBox { section }),
            tool(
                "polygon",
                "△",
                "Polygon",
                "Drag one side of a triangle; a click adds a corner to the selected polygon",
                EditAction::AddPolygon { section },
            ),
            tool(
                "patrol",
                "⇄",
                "Patrol",
                "Click adds a way-point to the selected ball or box, which then moves back and forth",
                EditAction::AddPatrol { section },
            ),
        ],
        // A new item would need a height that a point on the screen does not give.
        tools_in_space: vec![EditTool {
            help: "Drag moves in the plane of the view, an arrow of the selected item along its axis; Delete removes",
            ..EditTool::SELECT
        }],
        items: vec![
            EditItems::Obstacles { section },
            EditItems::Starts { section: "chains", noun: "chain" },
        ],
        notes: Vec::new(),
        files: vec![
            FileUse {
                kind: UsedFile::Map,
                endings: &[".world"],
                key: "ground.stage",
                is_list: false,
                replaces: &["ground.corridor", "ground.map", "ground.stage", "ground.unknown"],
                about: "world of Stage",
                asks: &[],
            },
            FileUse {
                kind: UsedFile::Map,
                endings: &[".yaml", ".yml"],
                key: "ground.map",
                is_list: false,
                replaces: &["ground.corridor", "ground.map", "ground.stage"],
                about: "map of ROS",
                asks: &[],
            },
        ],
        about_files: "A ROS map or a Stage world becomes the ground on which chains move.",
        drawing: None,
    }
}
