//! Stepping aside from near things that the sensors report, and trusting them more or less.
//!
//! The paper's robot avoids obstacles and follows corridors by its sonar; this does the same while it
//! goes to a goal, and [`SensorTrust`] says how far it believes a beam.

use super::{Memory, Percept, Sector, freer_side, random_turn};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STAY, Side};
use crate::sensor::NOTHING;
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;

/// The condition for believing that something is near.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorTrust {
    /// One beam of a sector that reports it is enough.
    OneBeam,
    /// Ahead, where a miss costs a contact, as soon as one beam reports it; at the sides only if
    /// two reports agree, out of those of this cycle and of the one before if the heading was the
    /// same. False alarms at the sides are many, and each costs a needless sidestep.
    TwoReports,
}

/// Word 1, after the count of goals in word 0 (`goto.rs`): a sidestep under way, its heading in the
/// low two bits, boxes left to go above them.
const SIDESTEP_WORD: usize = 1;
/// Word 2: near reports of the last cycle, a byte per sector (ahead, left, right), and in the
/// fourth byte its heading plus 1, so that the 0 of the start is no heading.
const LAST_REPORTS_WORD: usize = 2;

/// The sectors that matter to a robot that never moves backward, in the order of the bytes of
/// `LAST_REPORTS_WORD`.
const SECTORS: [Sector; 3] = [Sector::Ahead, Sector::Left, Sector::Right];

/// The sides on which something is believed to be near.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NearSides {
    ahead: bool,
    left: bool,
    right: bool,
}

/// Returns one action along the path, or of a sidestep.
pub(super) fn sidestep(
    trust: SensorTrust,
    field: &FlowField,
    percept: &Percept<'_>,
    memory: &mut Memory,
    draws: &mut Draws,
) -> ActionId {
    let near = near_sides(trust, percept, memory);
    if let Some(action) = resume_sidestep(percept, near, memory) {
        return action;
    }
    match field.direction(percept.at.0, percept.at.1) {
        Some(course) if course != percept.heading => turn_toward(percept.heading, course, draws),
        _ => follow_course(percept, near, memory, draws),
    }
}

/// Returns the sides believed to be near something after this percept.
fn near_sides(trust: SensorTrust, percept: &Percept<'_>, memory: &mut Memory) -> NearSides {
    let [ahead, left, right] = SECTORS.map(|sector| near_reports(percept, sector));
    let heading = percept.heading + 1;
    let last = memory.words[LAST_REPORTS_WORD].to_le_bytes();
    memory.words[LAST_REPORTS_WORD] = u32::from_le_bytes([ahead, left, right, heading]);
    let [_, last_left, last_right, last_heading] = last;
    // After a turn the sides are other places, and reports about them cannot agree.
    let (last_left, last_right) =
        if last_heading == heading { (last_left, last_right) } else { (0, 0) };
    let (left, right) = match trust {
        SensorTrust::OneBeam => (left > 0, right > 0),
        SensorTrust::TwoReports => {
            (left.saturating_add(last_left) > 1, right.saturating_add(last_right) > 1)
        }
    };
    let touched = percept.contact.map(|contact| contact.side);
    NearSides {
        ahead: ahead > 0 || touched == Some(Side::Front),
        left: left || touched == Some(Side::Left),
        right: right || touched == Some(Side::Right),
    }
}

/// Continues a sidestep, unless there is none or it is blocked.
fn resume_sidestep(
    percept: &Percept<'_>,
    near: NearSides,
    memory: &mut Memory,
) -> Option<ActionId> {
    let word = &mut memory.words[SIDESTEP_WORD];
    let heading = (*word % 4) as u8;
    let boxes_left = *word / 4;
    if boxes_left == 0 {
        return None;
    }
    match (4 + heading - percept.heading) % 4 {
        0 if near.ahead => {
            *word = 0;
            None
        }
        0 => {
            *word = (boxes_left - 1) * 4 + u32::from(heading);
            Some(FORWARD)
        }
        3 => Some(RIGHT),
        _ => Some(LEFT),
    }
}

/// Near is the first distance class, of whatever thing; capped at a byte of `LAST_REPORTS_WORD`.
fn near_reports(percept: &Percept<'_>, sector: Sector) -> u8 {
    let beams = percept.readings.iter().zip(percept.sectors);
    let near = beams.filter(|(reading, of)| {
        **of == sector && reading.observation != NOTHING && reading.class == 0
    });
    near.count().min(255) as u8
}

fn turn_toward(heading: u8, course: u8, draws: &mut Draws) -> ActionId {
    match (4 + course - heading) % 4 {
        1 => LEFT,
        3 => RIGHT,
        _ => random_turn(draws),
    }
}

/// Goes ahead on course, around obstacles nearby, and away from a wall on one side.
fn follow_course(
    percept: &Percept<'_>,
    near: NearSides,
    memory: &mut Memory,
    draws: &mut Draws,
) -> ActionId {
    let (away, boxes) = match near {
        // Two robots that meet must not mirror each other forever, so wait or step aside by a draw.
        // Waiting is the rarer choice, because most obstacles do not go away. The length is drawn
        // too, because two that step to the same side by as many boxes meet again.
        NearSides { ahead: true, .. } if draws.uniform_below(4) == 0 => return STAY,
        NearSides { ahead: true, .. } => (freer_side(percept, draws), 1 + draws.uniform_below(3)),
        NearSides { left: true, right: false, .. } => (RIGHT, 1),
        NearSides { left: false, right: true, .. } => (LEFT, 1),
        _ => return FORWARD,
    };
    let quarter = if away == LEFT { 1 } else { 3 };
    memory.words[SIDESTEP_WORD] = boxes * 4 + u32::from((percept.heading + quarter) % 4);
    away
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::{Contact, nearest_by_sector};
    use crate::sensor::Reading;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};
    use sidestep_map::planning::FreeSpace;

    const NOTHING_SEEN: Reading = Reading { observation: NOTHING, class: 3 };
    const NEAR: Reading = Reading { observation: 1, class: 0 };
    const ALL: [Sector; 4] = [Sector::Ahead, Sector::Ahead, Sector::Left, Sector::Right];

    fn percept(heading: u8, readings: &[Reading; 4], contact: Option<Contact>) -> Percept<'_> {
        let nearest_in = nearest_by_sector(readings, &ALL);
        Percept {
            now: 0,
            id: 0,
            readings,
            sectors: &ALL,
            nearest_in,
            contact,
            at: (4, 1),
            heading,
            heard: &[],
        }
    }

    /// Decides in a corridor of 9 x 3 boxes with the goal at its end in the west.
    fn decide(trust: SensorTrust, percept: &Percept<'_>, memory: &mut Memory) -> ActionId {
        let free = FreeSpace::new(9, 3, |_, _| true);
        let field = FlowField::to_nearest(&free, 1, &[(0, 0), (0, 1), (0, 2)]);
        let mut draws = Streams::new(Seed(1)).draws(0, percept.now, Purpose(0));
        sidestep(trust, &field, percept, memory, &mut draws)
    }

    #[test]
    fn a_single_report_at_the_side_is_believed_by_one_and_checked_by_the_other() {
        let beside = [NOTHING_SEEN, NOTHING_SEEN, NEAR, NOTHING_SEEN];
        let at = percept(2, &beside, None);
        let first = |trust| decide(trust, &at, &mut Memory::default());
        assert_eq!(first(SensorTrust::OneBeam), RIGHT);
        assert_eq!(first(SensorTrust::TwoReports), FORWARD);
        let mut memory = Memory::default();
        decide(SensorTrust::TwoReports, &at, &mut memory);
        assert_eq!(decide(SensorTrust::TwoReports, &at, &mut memory), RIGHT, "twice in a row");
        let ahead = [NEAR, NOTHING_SEEN, NOTHING_SEEN, NOTHING_SEEN];
        let action =
            decide(SensorTrust::TwoReports, &percept(2, &ahead, None), &mut Memory::default());
        assert_ne!(action, FORWARD);
    }

    #[test]
    fn a_sidestep_survives_a_turn_that_fails() {
        let (free, mut memory) = ([NOTHING_SEEN; 4], Memory::default());
        let touched = Some(Contact { kind: 1, side: Side::Left });
        let action = decide(SensorTrust::OneBeam, &percept(2, &free, touched), &mut memory);
        assert_eq!(action, RIGHT, "away from the wall");
        let mut next =
            |heading| decide(SensorTrust::OneBeam, &percept(heading, &free, None), &mut memory);
        assert_eq!(next(2), RIGHT, "again, since the turn has failed");
        assert_eq!(next(1), FORWARD);
        assert_eq!(next(1), LEFT, "back to course");
    }
}
