//! What programs ask of a world that they do not know: orders and rewards of learning agents, and the tools of the
//! studio's page.

use super::decide::External;
use serde_json::json;
use sidestep_scenario::editing::{
    AskedNumber, EditAction, EditItems, EditNote, EditTool, Editing, FileUse, NewDrawing,
    PaintArea, UsedFile,
};
use sidestep_scenario::facts::{
    GroupSizes, PositionUnit, RecordedPositions, RewardMeasure, RewardTerm, WorldFacts,
};

pub(crate) const FACTS: WorldFacts = WorldFacts {
    default_order: Some(External::ACTION),
    reward_terms: &[
        RewardTerm {
            name: "contact",
            meaning: "1 where the last action was stopped",
            measure: RewardMeasure::Positive { observation: "contact" },
            // A first reward that makes sense by itself: agents learn to run into nothing.
            default_weight: -1.0,
        },
        RewardTerm {
            name: "moved",
            meaning: "boxes moved",
            measure: RewardMeasure::Distance { observation: "at_boxes" },
            default_weight: 0.0,
        },
        RewardTerm {
            name: "turned",
            meaning: "1 where the heading changed",
            measure: RewardMeasure::Changed { observation: "heading" },
            default_weight: 0.0,
        },
    ],
    positions: Some(RecordedPositions {
        agent: "body",
        part: None,
        axes: ["col_boxes", "row_boxes"],
        unit: PositionUnit::Boxes,
        kinds: &["robot", "person"],
    }),
    group_sizes: Some(GroupSizes::Metric { metric: "group_sizes" }),
};

fn paint(
    id: &'static str,
    sign: &'static str,
    name: &'static str,
    help: &'static str,
    area: PaintArea,
) -> EditTool {
    EditTool { id, sign, name, help, action: EditAction::Paint { area } }
}

pub(crate) fn editing() -> Editing {
    let robot = json!({
        "size": 2,
        "sensors": ["sonar-ring"],
        "effector": "nomad",
        "behaviour": { "kind": "wander" },
    });
    let person = json!({ "size": [2, 2], "period": 3 });
    let door = json!({ "periodic": { "open": 60, "closed": 20 } });
    Editing {
        tools: vec![
            EditTool::SELECT,
            paint("brush", "✎", "Brush", "Drag draws boxes", PaintArea::Brush),
            paint("line", "╱", "Line", "Drag from start to end", PaintArea::Line),
            paint(
                "rectangle",
                "▭",
                "Rectangle",
                "Drag from corner to corner; with Shift filled",
                PaintArea::Rectangle,
            ),
            paint("fill", "▨", "Fill", "Fills the connected area", PaintArea::Fill),
            paint("eraser", "⌫", "Eraser", "Drag clears boxes", PaintArea::Eraser),
            EditTool {
                id: "robot",
                sign: "●",
                name: "Robot",
                help: "Click adds a robot to the selected group",
                action: EditAction::AddBody { section: "robots", template: robot },
            },
            EditTool {
                id: "person",
                sign: "☺",
                name: "Person",
                help: "Click adds a person",
                action: EditAction::AddBody { section: "people", template: person },
            },
            EditTool {
                id: "door",
                sign: "▯",
                name: "Door",
                help: "Drag over the boxes of a door; walls there are removed",
                action: EditAction::AddDoor { section: "doors", template: door },
            },
            EditTool {
                id: "goal",
                sign: "⚑",
                name: "Way-point",
                help: "Click adds a way-point to the selected robots",
                action: EditAction::AddGoal { section: "robots" },
            },
        ],
        tools_in_space: Vec::new(),
        items: vec![
            EditItems::Goals { section: "robots" },
            EditItems::Bodies { section: "robots", noun: "robot", turns: true },
            EditItems::Bodies { section: "people", noun: "person", turns: false },
            EditItems::Bodies { section: "doors", noun: "door", turns: false },
        ],
        notes: vec![
            EditNote {
                when: Some("map.office"),
                unless: Some("map.ascii"),
                text: "The walls are those of a generated office: the text gives only its measures.",
            },
            EditNote {
                when: Some("map.file"),
                unless: Some("map.ascii"),
                text: "The walls come from a file that the scenario refers to.",
            },
        ],
        files: vec![
            FileUse {
                kind: UsedFile::Profile,
                endings: &[],
                key: "profiles",
                is_list: true,
                replaces: &[],
                about: "",
                asks: &[],
            },
            FileUse {
                kind: UsedFile::Map,
                endings: sidestep_import::IMAGE_ENDINGS,
                key: "map.file",
                is_list: false,
                replaces: &["map.ascii", "map.office", "map.file"],
                about: "image: dark is wall",
                asks: &[AskedNumber {
                    key: "map.resolution_m",
                    name: "Side of a pixel",
                    unit: "m",
                }],
            },
            // These give the side of their boxes themselves.
            FileUse {
                kind: UsedFile::Map,
                endings: &[".yaml", ".yml"],
                key: "map.file",
                is_list: false,
                replaces: &["map.ascii", "map.office", "map.file", "map.resolution_m"],
                about: "map of ROS",
                asks: &[],
            },
            FileUse {
                kind: UsedFile::Map,
                endings: &[".map"],
                key: "map.file",
                is_list: false,
                replaces: &["map.ascii", "map.office", "map.file", "map.resolution_m"],
                about: "map of MovingAI",
                asks: &[],
            },
        ],
        about_files: "A map replaces the scenario's own. A profile adds sensors and effectors that robots can use.",
        drawing: Some(NewDrawing {
            name: "scenario of robots",
            about: "An empty floor within walls, and one robot on it. Everything can be changed later.",
            text: include_str!("drawing.toml"),
            tool: "brush",
            text_on_map: include_str!("on-map.toml"),
        }),
    }
}
