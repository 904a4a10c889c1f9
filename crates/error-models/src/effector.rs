//! Effectors that slip: the transitions in which an action may end, and the effect of obstacles.
//!
//! Source: the paper's action modeling (a set of transitions with probabilities per agent type and
//! action, learned in free space) and its adaptation to places with obstacles.

use crate::delay::DelayModel;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Number of an action: its index among its effector's actions.
pub type ActionId = u8;
/// Go one box ahead.
pub const FORWARD: ActionId = 0;
/// Turn 90 degrees to the left.
pub const LEFT: ActionId = 1;
/// Turn 90 degrees to the right.
pub const RIGHT: ActionId = 2;
/// Do nothing.
pub const STAY: ActionId = 3;
/// The actions every effector has, in the order of their ids.
pub const STANDARD_ACTIONS: [&str; 4] = ["forward", "left", "right", "stay"];

/// A direction relative to a body: that of a step, or the side that is touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Ahead.
    Front,
    /// A move to the left.
    Left,
    /// Behind.
    Back,
    /// A move to the right.
    Right,
}

impl Side {
    /// All sides in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Front, Self::Left, Self::Back, Self::Right];

    /// Returns the side for a letter of a path: `F`, `L`, `B` or `R`.
    pub fn from_letter(letter: char) -> Option<Self> {
        match letter {
            'F' => Some(Self::Front),
            'L' => Some(Self::Left),
            'B' => Some(Self::Back),
            'R' => Some(Self::Right),
            _ => None,
        }
    }

    /// Adds a step to this side to numbers of boxes ahead and to the left.
    #[inline]
    pub fn add_to(self, ahead: &mut i32, left: &mut i32) {
        match self {
            Self::Front => *ahead += 1,
            Self::Back => *ahead -= 1,
            Self::Left => *left += 1,
            Self::Right => *left -= 1,
        }
    }

    /// Returns its letter in paths, see [`Self::from_letter`].
    pub fn letter(self) -> char {
        ['F', 'L', 'B', 'R'][self as usize]
    }

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        ["front", "left", "back", "right"][self as usize]
    }
}

/// Unit vectors of the headings east, north, west, south.
pub const HEADINGS: [(i32, i32); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
/// Names of the headings, by number.
pub const HEADING_NAMES: [&str; 4] = ["east", "north", "west", "south"];

/// Largest number of steps of a path. A body claims all boxes that its paths may sweep, and a map is padded by as
/// many rings of wall, so a bound keeps conflicts local.
pub const MAX_PATH_STEPS: usize = 16;

/// One possible end of an action, in free space.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Probability of the transition.
    pub p: f64,
    /// Unit steps, in the frame of the heading before the turn.
    pub path: Vec<Side>,
    /// Quarter turns to the left, 0 to 3, made after the path.
    pub turn: u8,
}

impl Transition {
    fn certain(path: Vec<Side>, turn: u8) -> Self {
        Self { p: 1.0, path, turn }
    }
}

/// An effector type as data: for each action its transitions, the intended one first.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectorModel {
    /// Name in the scenario.
    pub name: String,
    /// Names of the actions; the first four are [`STANDARD_ACTIONS`].
    pub actions: Vec<String>,
    /// Transitions per action.
    pub transitions: Vec<Vec<Transition>>,
    /// How often actions are delayed; `None` where they never are.
    pub delays: Option<DelayModel>,
}

impl EffectorModel {
    /// Returns an effector that never errs: one box ahead, quarter turns, nothing.
    pub fn perfect() -> Self {
        Self {
            name: "perfect".into(),
            actions: STANDARD_ACTIONS.map(String::from).to_vec(),
            transitions: vec![
                vec![Transition::certain(vec![Side::Front], 0)],
                vec![Transition::certain(vec![], 1)],
                vec![Transition::certain(vec![], 3)],
                vec![Transition::certain(vec![], 0)],
            ],
            delays: None,
        }
    }

    /// Returns whether some action may not end as intended.
    pub fn has_errors(&self) -> bool {
        self.transitions.iter().any(|list| list[0].p < 1.0)
    }

    /// Returns the transitions of an action; only the intended one where `reliable`.
    pub fn transitions_of(&self, action: ActionId, reliable: bool) -> Vec<Transition> {
        let all = &self.transitions[usize::from(action)];
        if !reliable {
            return all.clone();
        }
        // The intended transition, also where it has the probability 0.
        vec![Transition { p: 1.0, ..all[0].clone() }]
    }
}

/// The rule for a transition with a path that meets an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ObstacleRule {
    /// The path is cut at the first box that is not free.
    #[default]
    Cut,
    /// The whole transition is given up, and becomes a contact in place.
    Stay,
    /// Blocked transitions are removed and the rest is rescaled (the paper's "inhibited"); when
    /// none is left, the body stays with a contact.
    Renormalise,
}

impl ObstacleRule {
    /// Every rule once, in the order of declaration.
    pub const ALL: [Self; 3] = [Self::Cut, Self::Stay, Self::Renormalise];

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cut => "cut",
            Self::Stay => "stay",
            Self::Renormalise => "renormalise",
        }
    }
}
