//! What a robot knows of the places around it.

use super::super::pass_request::PassRequest;
use super::local_box_set::LocalBoxSet;
use crate::effector::HEADINGS;
use sidestep_map::planning::FlowField;

/// Everything that a robot knows of the places around it.
pub(super) struct LocalView<'a> {
    pub(super) field: &'a FlowField,
    pub(super) at: (u32, u32),
    pub(super) heading: u8,
    pub(super) blocked: LocalBoxSet,
    pub(super) vague: LocalBoxSet,
    /// Whether it has reached its last goal before.
    pub(super) is_done: bool,
    /// Whether sensors or wheels err.
    pub(super) may_err: bool,
    /// Whether the robot has one box and nothing errs.
    pub(super) is_agile: bool,
    /// Whether no other body is noticed.
    pub(super) is_alone: bool,
}

impl LocalView<'_> {
    pub(super) fn offset(&self, col: i32, row: i32) -> (u32, u32) {
        (self.at.0.wrapping_add_signed(col), self.at.1.wrapping_add_signed(row))
    }

    pub(super) fn rise(&self, direction: u8) -> Option<i8> {
        self.field.rise(self.at.0, self.at.1, direction)
    }

    pub(super) fn is_blocked(&self, direction: u8) -> bool {
        let (east, north) = HEADINGS[usize::from(direction)];
        self.blocked.contains(east, north)
    }

    /// Returns whether a step in a direction meets neither a wall nor a known obstacle.
    pub(super) fn is_open(&self, direction: u8) -> bool {
        self.rise(direction).is_some() && !self.is_blocked(direction)
    }

    /// Returns whether an obstacle stands next to the place ahead, on that side of it.
    pub(super) fn is_blocked_beyond(&self, ahead: u8, side: u8) -> bool {
        let (east, north) = HEADINGS[usize::from(ahead)];
        let (side_east, side_north) = HEADINGS[usize::from(side % 4)];
        self.blocked.contains(east + side_east, north + side_north)
    }

    /// Returns the direction of a shortest path on the static map; ahead where there is one, because
    /// every turn costs an action.
    pub(super) fn goal_direction(&self) -> Option<u8> {
        goal_direction(self.field, self.at, self.heading)
    }

    /// Returns the direction in which the path goes on behind the next place.
    pub(super) fn next_direction(&self, direction: u8) -> Option<u8> {
        next_direction(self.field, self.at, direction)
    }

    /// Returns whether a shortest path on the static map begins with a step in a direction.
    pub(super) fn descends(&self, direction: u8) -> bool {
        self.field.descends(self.at.0, self.at.1, direction)
    }

    /// Returns whether the robot itself wants to go where it is asked to make room.
    pub(super) fn goes_that_way(&self, request: PassRequest) -> bool {
        !self.is_done && self.goal_direction() == Some(request.toward)
    }
}

/// Returns the direction of a shortest path on the static map; ahead where there is one, because
/// every turn costs an action.
pub(super) fn goal_direction(field: &FlowField, at: (u32, u32), heading: u8) -> Option<u8> {
    if field.descends(at.0, at.1, heading) {
        return Some(heading);
    }
    field.direction(at.0, at.1)
}

/// Returns the direction in which the path goes on behind the next place.
pub(super) fn next_direction(field: &FlowField, at: (u32, u32), direction: u8) -> Option<u8> {
    let (east, north) = HEADINGS[usize::from(direction)];
    field.direction(at.0.wrapping_add_signed(east), at.1.wrapping_add_signed(north))
}
