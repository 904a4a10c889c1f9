//! The compared behaviors: to and fro along a corridor, trusting sensors more or less.
//!
//! All know where they are and the static map (as the built-in `shuttle` does); other obstacles
//! they must sense. The paper's robot avoids obstacles and follows corridors by its sonar;
//! [`Patrol`] does the same, and [`Trust`] says how far it believes a beam.

use sidestep::kernel::stream::Draws;
use sidestep::planning::FlowField;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept, Sector, Trip};
use sidestep::worlds::robots::effector::{ActionId, FORWARD, LEFT, RIGHT, STAY, Side};
use sidestep::worlds::robots::sensor::NOTHING;
use std::hint::black_box;
use std::sync::Arc;

/// The condition for believing that something is near.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trust {
    /// As soon as one beam of a sector reports it.
    OneBeam,
    /// Ahead, where a miss costs a contact, as soon as one beam reports it; at the sides only if
    /// two reports agree, out of those of this cycle and of the one before if the heading was the
    /// same. False alarms at the sides are many, and each costs a needless sidestep.
    TwoReports,
}

/// To and fro between two ends; a trip is there and back again.
#[derive(Debug, Clone)]
pub(super) struct Patrol {
    /// Ways to the two ends.
    pub(super) ends: [Arc<FlowField>; 2],
    /// When a near report is believed.
    pub(super) trust: Trust,
}

/// Word 0: ends reached.
const REACHED: usize = 0;
/// Word 1: a sidestep under way: heading in the low two bits, boxes left to go above them.
const SIDESTEP: usize = 1;
/// Word 2: near reports of the last cycle, a byte per sector (ahead, left, right), and in the
/// fourth byte its heading plus 1.
const SEEN: usize = 2;

/// The sectors that matter, in the order of the bytes of `SEEN`.
const SECTORS: [Sector; 3] = [Sector::Ahead, Sector::Left, Sector::Right];

/// The sides on which something is believed to be near.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Near {
    ahead: bool,
    left: bool,
    right: bool,
}

impl Behaviour for Patrol {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let (target, trip) = self.arrive(percept, memory);
        let near = self.near(percept, memory);
        let action = self.sidestep(percept, near, memory).unwrap_or_else(|| {
            match self.ends[target].direction(percept.at.0, percept.at.1) {
                Some(course) if course != percept.heading => turn(percept.heading, course, draws),
                _ => go(percept, near, memory, draws),
            }
        });
        Decision { trip, ..action.into() }
    }
}

impl Patrol {
    /// Returns the end to go to, and whether a trip starts or ends here.
    fn arrive(&self, percept: &Percept<'_>, memory: &mut Memory) -> (usize, Option<Trip>) {
        let reached = &mut memory.words[REACHED];
        let target = (*reached % 2) as usize;
        if !self.ends[target].is_goal(percept.at.0, percept.at.1) {
            return (target, None);
        }
        *reached = reached.wrapping_add(1);
        let first = if *reached > 1 { Trip::Done } else { Trip::Begun };
        (1 - target, (target == 0).then_some(first))
    }

    /// Returns the sides believed to be near something after this percept.
    fn near(&self, percept: &Percept<'_>, memory: &mut Memory) -> Near {
        let now = SECTORS.map(|sector| near_reports(percept, sector));
        let heading = percept.heading + 1;
        let [ahead, left, right, seen_heading] = memory.words[SEEN].to_le_bytes();
        memory.words[SEEN] = u32::from_le_bytes([now[0], now[1], now[2], heading]);
        let before = if seen_heading == heading { [ahead, left, right] } else { [0; 3] };
        let believed = |k: usize| match self.trust {
            Trust::TwoReports if k > 0 => now[k].saturating_add(before[k]) > 1,
            _ => now[k] > 0,
        };
        let touched = |side| percept.contact.is_some_and(|contact| contact.side == side);
        Near {
            ahead: believed(0) || touched(Side::Front),
            left: believed(1) || touched(Side::Left),
            right: believed(2) || touched(Side::Right),
        }
    }

    /// Goes on with a sidestep, unless there is none or its way is blocked.
    fn sidestep(&self, percept: &Percept<'_>, near: Near, memory: &mut Memory) -> Option<ActionId> {
        let word = &mut memory.words[SIDESTEP];
        let (heading, boxes) = ((*word % 4) as u8, *word / 4);
        if boxes == 0 {
            return None;
        }
        match (4 + heading - percept.heading) % 4 {
            0 if near.ahead => {
                *word = 0;
                None
            }
            0 => {
                *word -= 4;
                Some(FORWARD)
            }
            3 => Some(RIGHT),
            _ => Some(LEFT),
        }
    }
}

/// Returns the number of near reports of a sector in one percept.
fn near_reports(percept: &Percept<'_>, sector: Sector) -> u8 {
    let beams = percept.readings.iter().zip(percept.sectors);
    let near = beams.filter(|(r, s)| **s == sector && r.observation != NOTHING && r.class == 0);
    near.count().min(255) as u8
}

fn turn(heading: u8, course: u8, draws: &mut Draws) -> ActionId {
    match (4 + course - heading) % 4 {
        1 => LEFT,
        3 => RIGHT,
        _ => either(draws),
    }
}

/// Goes ahead on course, around obstacles nearby, and away from a wall on one side.
fn go(percept: &Percept<'_>, near: Near, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    let (away, boxes) = match near {
        // Two robots that meet must not mirror each other, so wait or step aside by a fair draw.
        Near { ahead: true, .. } if draws.below(4) == 0 => return STAY,
        Near { ahead: true, .. } => (freer_side(percept, draws), 1 + draws.below(3)),
        Near { left: true, right: false, .. } => (RIGHT, 1),
        Near { left: false, right: true, .. } => (LEFT, 1),
        _ => return FORWARD,
    };
    let quarter = if away == LEFT { 1 } else { 3 };
    memory.words[SIDESTEP] = boxes * 4 + u32::from((percept.heading + quarter) % 4);
    away
}

fn freer_side(percept: &Percept<'_>, draws: &mut Draws) -> ActionId {
    let clear = |sector| percept.nearest(sector).unwrap_or(u8::MAX);
    match clear(Sector::Left).cmp(&clear(Sector::Right)) {
        std::cmp::Ordering::Greater => LEFT,
        std::cmp::Ordering::Less => RIGHT,
        std::cmp::Ordering::Equal => either(draws),
    }
}

fn either(draws: &mut Draws) -> ActionId {
    if draws.below(2) == 0 { LEFT } else { RIGHT }
}

/// A behavior that thinks longer: it decides as another does, after extra operations.
#[derive(Debug, Clone)]
pub(super) struct Costly {
    /// The behavior that really decides.
    pub(super) inner: Arc<dyn Behaviour>,
    /// Dependent multiply-and-adds per decision.
    pub(super) operations: u32,
}

/// Does `operations` dependent multiply-and-adds, only to spend time.
pub(super) fn burn(mut x: u64, operations: u32) {
    for _ in 0..operations {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    }
    black_box(x);
}

impl Behaviour for Costly {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        burn(percept.now, self.operations);
        self.inner.decide(percept, memory, draws)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::kernel::Seed;
    use sidestep::kernel::stream::{Purpose, Streams};
    use sidestep::planning::FreeSpace;
    use sidestep::worlds::robots::decide::Contact;
    use sidestep::worlds::robots::decide::nearest_in;
    use sidestep::worlds::robots::sensor::Reading;

    const NOTHING_SEEN: Reading = Reading { observation: NOTHING, class: 3 };
    const NEAR: Reading = Reading { observation: 1, class: 0 };

    /// A corridor of 9 x 3 boxes with its ends in the west and in the east.
    fn patrol(trust: Trust) -> Patrol {
        let free = FreeSpace::new(9, 3, |_, _| true);
        let end = |col| Arc::new(FlowField::towards(&free, 1, &[(col, 0), (col, 1), (col, 2)]));
        Patrol { ends: [end(0), end(8)], trust }
    }

    fn decide(patrol: &Patrol, percept: &Percept<'_>, memory: &mut Memory) -> Decision {
        let mut draws = Streams::new(Seed(1)).draws(0, percept.now, Purpose(0));
        patrol.decide(percept, memory, &mut draws)
    }

    fn percept<'a>(at: (u32, u32), heading: u8, readings: &'a [Reading; 4]) -> Percept<'a> {
        const ALL: [Sector; 4] = [Sector::Ahead, Sector::Ahead, Sector::Left, Sector::Right];
        let nearest_in = nearest_in(readings, &ALL);
        Percept {
            now: 0,
            id: 0,
            readings,
            sectors: &ALL,
            nearest_in,
            contact: None,
            at,
            heading,
            heard: &[],
        }
    }

    #[test]
    fn a_trip_is_there_and_back_again() {
        let (patrol, mut memory) = (patrol(Trust::OneBeam), Memory::default());
        let free = [NOTHING_SEEN; 4];
        let mut trip =
            |at, heading| decide(&patrol, &percept(at, heading, &free), &mut memory).trip;
        assert_eq!(trip((4, 1), 2), None);
        assert_eq!(trip((0, 1), 2), Some(Trip::Begun));
        assert_eq!(trip((8, 1), 0), None);
        assert_eq!(trip((0, 1), 2), Some(Trip::Done));
    }

    #[test]
    fn a_single_report_at_the_side_is_believed_by_one_and_checked_by_the_other() {
        let beside = [NOTHING_SEEN, NOTHING_SEEN, NEAR, NOTHING_SEEN];
        let at = percept((4, 1), 2, &beside);
        let first = |trust| decide(&patrol(trust), &at, &mut Memory::default()).action;
        assert_eq!(first(Trust::OneBeam), RIGHT);
        assert_eq!(first(Trust::TwoReports), FORWARD);
        let (filter, mut memory) = (patrol(Trust::TwoReports), Memory::default());
        decide(&filter, &at, &mut memory);
        assert_eq!(decide(&filter, &at, &mut memory).action, RIGHT, "twice in a row");
        let ahead = [NEAR, NOTHING_SEEN, NOTHING_SEEN, NOTHING_SEEN];
        let action = decide(&filter, &percept((4, 1), 2, &ahead), &mut Memory::default()).action;
        assert_ne!(action, FORWARD);
    }

    #[test]
    fn a_sidestep_survives_a_turn_that_fails() {
        let (patrol, mut memory) = (patrol(Trust::OneBeam), Memory::default());
        let free = [NOTHING_SEEN; 4];
        let mut touching = percept((4, 1), 2, &free);
        touching.contact = Some(Contact { kind: 1, side: Side::Left });
        assert_eq!(decide(&patrol, &touching, &mut memory).action, RIGHT, "away from the wall");
        let mut next =
            |heading| decide(&patrol, &percept((4, 1), heading, &free), &mut memory).action;
        assert_eq!(next(2), RIGHT, "again, since the turn has failed");
        assert_eq!(next(1), FORWARD);
        assert_eq!(next(1), LEFT, "back to course");
    }

    #[test]
    fn costly_decides_as_what_it_wraps() {
        let inner: Arc<dyn Behaviour> = Arc::new(patrol(Trust::OneBeam));
        let costly = Costly { inner: Arc::clone(&inner), operations: 100 };
        let free = [NOTHING_SEEN; 4];
        let at = percept((4, 1), 2, &free);
        let mut draws = Streams::new(Seed(1)).draws(0, 0, Purpose(0));
        let (mut a, mut b) = (Memory::default(), Memory::default());
        let same = inner.decide(&at, &mut a, &mut draws.clone());
        assert_eq!(costly.decide(&at, &mut b, &mut draws), same);
        assert_eq!(a, b);
    }
}
