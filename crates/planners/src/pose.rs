//! Poses on the grid, and the actions between them.

use serde::{Deserialize, Serialize};
use sidestep_map::planning::STEPS;

/// The pose of an agent: its lower-left box and its heading.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
pub struct GridPose {
    /// Column of the lower-left box, from the west.
    pub col: u32,
    /// Row of the lower-left box, from the south.
    pub row: u32,
    /// Heading: 0 east, 1 north, 2 west, 3 south. It means nothing in [`ActionModel::Classical`].
    pub heading: u8,
}

/// What an agent does in one time step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Action {
    /// Keep the pose.
    Wait,
    /// Go one box in the direction of the heading.
    Forward,
    /// Turn counterclockwise by a quarter.
    TurnLeft,
    /// Turn clockwise by a quarter.
    TurnRight,
    /// Go one box east, north, west or south (0 to 3), whatever the heading.
    Move(u8),
}

/// The actions that agents have. Each takes one time step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum ActionModel {
    /// Forward, two turns and wait, as in the League of Robot Runners (Chan et al. 2024, "The League of Robot Runners
    /// competition").
    #[default]
    Turns,
    /// Four moves and wait, as in classical multi-agent path finding (Stern et al. 2019, "Multi-agent pathfinding:
    /// definitions, variants, and benchmarks").
    Classical,
}

impl ActionModel {
    /// Returns all actions of this model.
    pub fn actions(self) -> &'static [Action] {
        match self {
            Self::Turns => &[Action::Forward, Action::TurnLeft, Action::TurnRight, Action::Wait],
            Self::Classical => {
                &[Action::Move(0), Action::Move(1), Action::Move(2), Action::Move(3), Action::Wait]
            }
        }
    }

    /// Returns the action of this model that leads from one pose to the other; none if there is no such action.
    pub fn action_between(self, from: GridPose, to: GridPose) -> Option<Action> {
        self.actions().iter().copied().find(|&action| from.after(action) == Some(to))
    }
}

impl GridPose {
    /// Creates a pose.
    pub fn new(col: u32, row: u32, heading: u8) -> Self {
        Self { col, row, heading }
    }

    /// Returns column and row of the lower-left box.
    pub fn position(self) -> (u32, u32) {
        (self.col, self.row)
    }

    /// Returns the pose after an action, whether or not a wall is there; none beyond the west and the south edge.
    #[must_use]
    pub fn after(self, action: Action) -> Option<Self> {
        let heading = self.heading;
        match action {
            Action::Wait => Some(self),
            Action::Forward => self.neighbor(heading),
            Action::TurnLeft => Some(Self { heading: (heading % 4 + 1) % 4, ..self }),
            Action::TurnRight => Some(Self { heading: (heading % 4 + 3) % 4, ..self }),
            Action::Move(direction) => self.neighbor(direction),
        }
    }

    /// Returns the number of boxes and quarter turns to another pose, walls aside.
    #[must_use]
    pub fn steps_off(self, other: Self) -> u32 {
        let boxes = self.col.abs_diff(other.col) + self.row.abs_diff(other.row);
        boxes + u32::from(quarter_turns(self.heading % 4, other.heading % 4))
    }

    fn neighbor(self, direction: u8) -> Option<Self> {
        let (east, north) = STEPS[usize::from(direction % 4)];
        let col = self.col.checked_add_signed(east)?;
        let row = self.row.checked_add_signed(north)?;
        Some(Self { col, row, ..self })
    }
}

/// Returns the number of quarter turns from a heading to a direction: 0, 1 or 2.
pub(crate) fn quarter_turns(heading: u8, direction: u8) -> u8 {
    [0, 1, 2, 1][usize::from((direction + 4 - heading) % 4)]
}

/// Returns the first turn from a heading to a direction, left if both ways are equal; none if they are the same.
pub(crate) fn first_turn(heading: u8, direction: u8) -> Option<Action> {
    match (direction + 4 - heading) % 4 {
        0 => None,
        3 => Some(Action::TurnRight),
        _ => Some(Action::TurnLeft),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_left_turns_are_a_full_turn_and_a_right_turn_undoes_a_left_one() {
        let start = GridPose::new(3, 4, 1);
        let turn = |pose: GridPose| pose.after(Action::TurnLeft).unwrap();
        assert_eq!(turn(turn(turn(turn(start)))), start);
        assert_eq!(turn(start).after(Action::TurnRight), Some(start));
        assert_eq!(turn(GridPose::new(0, 0, u8::MAX)).heading, 0);
    }

    #[test]
    fn forward_goes_where_the_heading_points_and_not_off_the_west_or_south_edge() {
        let after = |heading| GridPose::new(0, 0, heading).after(Action::Forward);
        assert_eq!(after(0), Some(GridPose::new(1, 0, 0)));
        assert_eq!(after(1), Some(GridPose::new(0, 1, 1)));
        assert_eq!(after(2), None);
        assert_eq!(after(3), None);
    }

    #[test]
    fn the_first_turn_is_the_shorter_one() {
        assert_eq!(first_turn(0, 0), None);
        assert_eq!(first_turn(0, 3), Some(Action::TurnRight));
        assert_eq!(first_turn(3, 0), Some(Action::TurnLeft));
        assert_eq!(first_turn(1, 3), Some(Action::TurnLeft));
        assert_eq!([0, 1, 2, 3].map(|direction| quarter_turns(3, direction)), [1, 2, 1, 0]);
    }
}
