//! How the studio's page edits the text of a scenario on its canvas. The page has the tools; a world declares those that
//! its scenarios need, with the keys that they edit.

use serde::Serialize;

/// The editing of a world's scenarios on the canvas; by default there is none.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Editing {
    /// The tools for scenes in the plane, in the order of the toolbar.
    pub tools: Vec<EditTool>,
    /// The tools for scenes in space, where a point on the screen has no unique position.
    pub tools_in_space: Vec<EditTool>,
    /// The items that can be selected, those that are drawn first in front.
    pub items: Vec<EditItems>,
    /// Restrictions of some scenarios; the first that holds is shown.
    pub notes: Vec<EditNote>,
    /// Uses of files that hold no scenario; the first that fits a file is made.
    pub files: Vec<FileUse>,
    /// Words about the use of such files, for people who choose one.
    pub about_files: &'static str,
    /// A new scenario that people begin by drawing its map; none for a world without drawn maps.
    pub drawing: Option<NewDrawing>,
}

/// A new scenario with an empty floor of a chosen size within walls.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NewDrawing {
    /// Its noun for people: "scenario of robots".
    pub name: &'static str,
    /// What is on the floor, for people who are about to choose its size.
    pub about: &'static str,
    /// Its text. The page writes in it `{name}`, as a string of TOML; `{box_size_m}`; `{map}`, the lines of `map.ascii`
    /// from north to south; and `{column}` and `{row}`, a box in the middle.
    pub text: &'static str,
    /// The tool with which drawing begins, by its `id`.
    pub tool: &'static str,
    /// The text of a new scenario on the map of a file, without the map, whose keys are those of the file's use. The page
    /// writes `{name}` in it, as a string of TOML.
    pub text_on_map: &'static str,
}

/// A tool of the page's toolbar.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EditTool {
    /// Its name for programs, unique among the tools of a world.
    pub id: &'static str,
    /// Its symbol on narrow screens.
    pub sign: &'static str,
    /// Its name for people, in the toolbar.
    pub name: &'static str,
    /// Its use in a sentence, which the page shows while the tool is chosen.
    pub help: &'static str,
    /// What a press on the canvas does to the text.
    pub action: EditAction,
}

/// The effect of a tool. Positions are those of a press and of its end.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum EditAction {
    /// Selects, moves, removes and rotates items.
    Select,
    /// Draws boxes of the map in `map.ascii`.
    Paint {
        /// The boxes.
        area: PaintArea,
    },
    /// Adds a body at a box, to the selected section that gives boxes (`at`), to the last one, or in a new one.
    AddBody {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
        /// Other keys of a new section.
        template: serde_json::Value,
    },
    /// Adds a body that covers all boxes of a rectangle, and clears the map there.
    AddDoor {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
        /// Other keys of a new section.
        template: serde_json::Value,
    },
    /// Adds a box to the way-points of the selected bodies (`behaviour.goals`).
    AddGoal {
        /// Key of the sections of the bodies.
        section: &'static str,
    },
    /// Adds a section with a point (`at_m`).
    AddPoint {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a ball (`at_m`, `radius_m`).
    AddBall {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a wall (`ends_m`).
    AddWall {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a box (`at_m`, `size_m`).
    AddBox {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a triangle, or a corner to the selected polygon (`corners_m`).
    AddPolygon {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a way-point to a ball or a box (`patrol_m`).
    AddPatrol {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a body with its start, heading and first way-point (`at_m`, `heading_deg`, `way_points_m`).
    AddRoute {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
    /// Adds a way-point to the selected route.
    AddWayPoint {
        /// Key of the sections that the tool adds to, or edits.
        section: &'static str,
    },
}

/// The boxes that a tool draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PaintArea {
    /// Those along the pointer's path.
    Brush,
    /// Those on a straight line.
    Line,
    /// The edge of a rectangle.
    Rectangle,
    /// All that are connected with one.
    Fill,
    /// Those along the pointer's path, which become free.
    Eraser,
}

/// Items of a text that have positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "of", rename_all = "kebab-case")]
pub enum EditItems {
    /// Way-points and areas of bodies on boxes.
    Goals {
        /// Key of the sections of the bodies.
        section: &'static str,
    },
    /// Bodies on boxes (`at`, `size`).
    Bodies {
        /// Key of the sections that have them.
        section: &'static str,
        /// The noun for one of them.
        noun: &'static str,
        /// Whether they have headings, and so can be rotated.
        turns: bool,
    },
    /// Points (`at_m`).
    Points {
        /// Key of the sections that have them.
        section: &'static str,
        /// The noun for one of them.
        noun: &'static str,
    },
    /// Balls, walls, boxes and polygons, with their patrols.
    Obstacles {
        /// Key of the sections that have them.
        section: &'static str,
    },
    /// Starts (`at_m`), and the targets of tasks.
    Starts {
        /// Key of the sections that have them.
        section: &'static str,
        /// The noun for one of them.
        noun: &'static str,
    },
    /// Routes: starts, headings and way-points.
    Routes {
        /// Key of the sections that have them.
        section: &'static str,
        /// The noun for one of them.
        noun: &'static str,
    },
}

/// A restriction of the scenarios that have or lack some keys, as `map.ascii`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct EditNote {
    /// The key that it needs.
    pub when: Option<&'static str>,
    /// The key without which it holds.
    pub unless: Option<&'static str>,
    /// The restriction in a sentence.
    pub text: &'static str,
}

/// The use of a file that holds no scenario.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileUse {
    /// The kind of the files, by which the page finds the use of one.
    pub kind: UsedFile,
    /// Endings of its name, e.g. `.png`; none for any name.
    pub endings: &'static [&'static str],
    /// The key that gets its path.
    pub key: &'static str,
    /// Whether that is a list, to which the path is added.
    pub is_list: bool,
    /// Keys that it replaces.
    pub replaces: &'static [&'static str],
    /// What such a file is, for people: `image: dark is wall`.
    pub about: &'static str,
    /// Numbers that the file does not say. The page asks for them as the commands do, unless the text has them.
    pub asks: &'static [AskedNumber],
}

/// A number that is asked for with a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AskedNumber {
    /// The key that gets it.
    pub key: &'static str,
    /// Its name for people: `Side of a pixel`.
    pub name: &'static str,
    /// Its unit. The number is above 0.
    pub unit: &'static str,
}

/// The kind of a file that holds no scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum UsedFile {
    /// A map or an image of a floor.
    Map,
    /// Sensors and effectors that were learned from logs.
    Profile,
}

impl EditTool {
    /// The tool that selects; in space a world gives it another `help`.
    pub const SELECT: Self = Self {
        id: "select",
        sign: "↖",
        name: "Select",
        help: "Click selects, drag moves, Delete removes, r rotates",
        action: EditAction::Select,
    };
}
