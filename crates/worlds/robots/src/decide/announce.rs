//! Wandering with a radio: robots announce where they will be, and give way to each other.

use super::{Behaviour, Decision, Memory, Percept, ReceivedMessage, Sector, Wander};
use crate::effector::{ActionId, FORWARD, HEADINGS, LEFT, RIGHT, STAY};
use sidestep_kernel::stream::Draws;

/// Wanders, and broadcasts the place where its action is meant to end. It turns before a robot that
/// it hears of, as before one that it senses, and waits where a robot with a smaller id is about to
/// enter the same boxes. Without radio it behaves as [`Wander`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Announce {
    /// Chooses the actions where no other robot is in the way.
    pub wander: Wander,
    /// Side of the robot, in boxes.
    pub size: u32,
}

/// The square in which a robot stands, and its heading: the content of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct AnnouncedPose {
    col: i32,
    row: i32,
    heading: u8,
    size: i32,
}

impl Behaviour for Announce {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let here = AnnouncedPose {
            col: percept.at.0 as i32,
            row: percept.at.1 as i32,
            heading: percept.heading,
            size: self.size as i32,
        };
        let next = here.after_action(FORWARD);
        let mut nearest_in = percept.nearest_in;
        if announced_poses(percept.heard).any(|(_, other)| other.overlaps(next)) {
            nearest_in[Sector::Ahead as usize] = 0;
        }
        let wander = self.wander.decide(&Percept { nearest_in, ..*percept }, memory, draws);
        // Of two that are about to enter the same boxes exactly one waits: the one with the larger id.
        let mut smaller_ids =
            announced_poses(percept.heard).filter(|(sender, _)| *sender < percept.id);
        let gives_way = wander.action == FORWARD
            && smaller_ids.any(|(_, other)| other.after_action(FORWARD).overlaps(next));
        let action = if gives_way { STAY } else { wander.action };
        Decision { action, broadcast: Some(here.after_action(action).word()), ..wander }
    }
}

/// Reads every word as a pose: one of another behavior only makes the robot turn or wait in vain.
fn announced_poses(heard: &[ReceivedMessage]) -> impl Iterator<Item = (u32, AnnouncedPose)> + '_ {
    heard.iter().map(|heard| (heard.sender, AnnouncedPose::from_word(heard.word)))
}

impl AnnouncedPose {
    /// Returns the pose after one of the standard actions, if the effector does not err.
    fn after_action(self, action: ActionId) -> Self {
        let (east, north) = HEADINGS[usize::from(self.heading % 4)];
        match action {
            FORWARD => Self { col: self.col + east, row: self.row + north, ..self },
            LEFT => Self { heading: (self.heading + 1) % 4, ..self },
            RIGHT => Self { heading: (self.heading + 3) % 4, ..self },
            _ => self,
        }
    }

    /// Returns whether two squares share a box.
    fn overlaps(self, other: Self) -> bool {
        let share_columns = self.col < other.col + other.size && other.col < self.col + self.size;
        let share_rows = self.row < other.row + other.size && other.row < self.row + self.size;
        share_columns && share_rows
    }

    /// Returns the pose in one word: 16 bits each for column, row, heading and size. Columns and
    /// rows are below 32,768, and may be -1 where a robot faces a wall at the edge of the map.
    fn word(self) -> u64 {
        let parts = [self.col as u16, self.row as u16, u16::from(self.heading), self.size as u16];
        parts.iter().rev().fold(0, |word, &part| word << 16 | u64::from(part))
    }

    fn from_word(word: u64) -> Self {
        Self {
            col: signed_part(word, 0),
            row: signed_part(word, 1),
            // Any word may come in over the radio, from other behaviors too. A negative part leaves
            // 253 to 255 here, which `after_action` brings back below 4.
            heading: (signed_part(word, 2) % 4) as u8,
            size: signed_part(word, 3),
        }
    }
}

/// Returns 16 bits of a word, of which part 0 is the lowest, as a number with a sign.
fn signed_part(word: u64, part: u32) -> i32 {
    i32::from((word >> (16 * part)) as u16 as i16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::UNSEEN;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    const EAST: u8 = 0;
    const WEST: u8 = 2;

    fn place(col: i32, heading: u8) -> AnnouncedPose {
        AnnouncedPose { col, row: 0, heading, size: 2 }
    }

    /// Returns the decision of robot 5, which heads east from column 0 and senses nothing.
    fn decide(heard: &[ReceivedMessage]) -> Decision {
        let percept = Percept {
            now: 0,
            id: 5,
            readings: &[],
            sectors: &[],
            nearest_in: [UNSEEN; 4],
            contact: None,
            at: (0, 0),
            heading: EAST,
            heard,
        };
        let mut draws = Streams::new(Seed(1)).draws(5, 0, Purpose(3));
        let announce = Announce { wander: Wander::default(), size: 2 };
        announce.decide(&percept, &mut Memory::default(), &mut draws)
    }

    fn of(sender: u32, place: AnnouncedPose) -> ReceivedMessage {
        ReceivedMessage { sender, word: place.word() }
    }

    #[test]
    fn a_place_comes_back_from_its_word() {
        for (col, heading) in [(0, 0), (-1, 2), (32_759, 3)] {
            assert_eq!(AnnouncedPose::from_word(place(col, heading).word()), place(col, heading));
        }
    }

    #[test]
    fn a_robot_announces_where_its_action_is_meant_to_end() {
        let decision = decide(&[]);
        assert_eq!(decision.action, FORWARD);
        assert_eq!(decision.broadcast.map(AnnouncedPose::from_word), Some(place(1, EAST)));
    }

    #[test]
    fn the_larger_id_waits_where_two_are_about_to_enter_the_same_boxes() {
        let faces = place(3, WEST);
        assert_eq!(decide(&[of(3, faces)]).action, STAY);
        assert_eq!(decide(&[of(7, faces)]).action, FORWARD);
        assert_eq!(decide(&[of(3, place(3, EAST))]).action, FORWARD, "it goes away");
    }

    #[test]
    fn a_robot_turns_before_one_that_it_hears_of_but_does_not_sense() {
        for sender in [3, 7] {
            let action = decide(&[of(sender, place(2, EAST))]).action;
            assert!([LEFT, RIGHT].contains(&action), "{action}");
        }
    }
}
