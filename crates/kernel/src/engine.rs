//! Runs a world for many cycles: the crew, the groups, and how many workers are worth it.
//!
//! A cycle that is too small to share out runs on one worker by itself. The engine measures
//! instead of guessing: it times stretches of cycles with one worker and with all, keeps to
//! the faster, and looks again now and then. Results do not depend on it.

use crate::conflict::Groups;
use crate::cycle::{Mate, PhaseTimes, advance};
use crate::ports::Clock;
use crate::units::Cycle;
use crate::world::World;

/// A stretch between two decisions lasts about this long.
const STRETCH_NS: f64 = 5e6;
/// The slower way is tried again after this many stretches.
const LOOK_AGAIN: u32 = 40;
/// Bodies are arranged anew after at least this many cycles: they have not gone far by then,
/// and sorting is below 1 % of the work.
const ARRANGE_EVERY: u64 = 64;

/// What runs a world: as many workers as asked for, and what they share.
#[derive(Debug)]
pub struct Engine<W: World> {
    groups: Groups,
    /// Cycles since the bodies were arranged.
    since_arranged: u64,
    crew: Vec<Mate<W::Scratch>>,
    pace: Pace,
    times: PhaseTimes,
}

impl<W: World> Engine<W> {
    /// An engine of `workers` workers (at least 1) for `bodies` bodies.
    pub fn new(world: &W, bodies: usize, workers: usize) -> Self {
        let crew = (0..workers.max(1)).map(|_| Mate::new(world.scratch())).collect();
        Self {
            groups: Groups::new(bodies),
            since_arranged: ARRANGE_EVERY,
            crew,
            pace: Pace::default(),
            times: PhaseTimes::default(),
        }
    }

    /// Uses all workers from now on, even where one would be faster; for tests and benchmarks.
    pub fn share_always(&mut self) {
        self.pace.share_always = true;
    }

    /// The workers, for what they have gathered.
    pub fn crew(&self) -> &[Mate<W::Scratch>] {
        &self.crew
    }

    /// The workers, to take what they have gathered.
    pub fn crew_mut(&mut self) -> &mut [Mate<W::Scratch>] {
        &mut self.crew
    }

    /// Time per phase so far.
    pub fn times(&self) -> PhaseTimes {
        self.times
    }

    /// Bytes on the heap that grow with the bodies.
    pub fn heap_bytes(&self) -> usize {
        self.groups.heap_bytes()
    }

    /// Runs `cycles` cycles from `from` on.
    pub fn advance(
        &mut self,
        world: &W,
        state: &mut W::State,
        (from, cycles): (Cycle, u64),
        clock: &impl Clock,
    ) {
        let mut done = 0;
        while done < cycles {
            if self.since_arranged >= ARRANGE_EVERY {
                world.arrange(state);
                self.since_arranged = 0;
            }
            let (team, stretch) = self.pace.next(self.crew.len(), cycles - done);
            let started_ns = clock.now_ns();
            let crew = &mut self.crew[..team];
            let span = (from + done, stretch);
            self.times.add(advance(world, state, &self.groups, crew, span, clock));
            self.pace.note(team, stretch, clock.now_ns() - started_ns);
            self.since_arranged += stretch;
            done += stretch;
        }
    }
}

/// Which team is faster, by measurement.
#[derive(Debug, Default)]
struct Pace {
    /// Nanoseconds per cycle with one worker and with all; 0 = not measured yet.
    alone_ns: f64,
    team_ns: f64,
    stretches: u32,
    share_always: bool,
}

impl Pace {
    /// Workers and cycles of the next stretch.
    fn next(&self, crew: usize, left: u64) -> (usize, u64) {
        let (expected_ns, team) = if crew == 1 || (self.alone_ns == 0.0 && !self.share_always) {
            (self.alone_ns, 1)
        } else if self.share_always {
            (self.team_ns, crew)
        } else if self.team_ns == 0.0 {
            (self.alone_ns, crew)
        } else {
            let team_is_faster = self.team_ns < self.alone_ns;
            let look_again = self.stretches % LOOK_AGAIN == LOOK_AGAIN - 1;
            let chosen = if team_is_faster != look_again { crew } else { 1 };
            (self.alone_ns.max(self.team_ns), chosen)
        };
        let stretch = if expected_ns == 0.0 { 1.0 } else { (STRETCH_NS / expected_ns).max(1.0) };
        (team, (stretch as u64).min(left))
    }

    fn note(&mut self, team: usize, cycles: u64, took_ns: u64) {
        let per_cycle = (took_ns as f64 / cycles as f64).max(1.0);
        let measured = if team == 1 { &mut self.alone_ns } else { &mut self.team_ns };
        *measured = if *measured == 0.0 { per_cycle } else { 0.5 * *measured + 0.5 * per_cycle };
        self.stretches = self.stretches.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settled(alone_ns: f64, team_ns: f64) -> Pace {
        Pace { alone_ns, team_ns, ..Pace::default() }
    }

    #[test]
    fn the_faster_team_is_kept() {
        assert_eq!(settled(1e6, 6e5).next(2, 100).0, 2);
        assert_eq!(settled(1e4, 3e4).next(2, 100).0, 1);
        assert_eq!(settled(1e6, 0.0).next(1, 100).0, 1);
    }

    #[test]
    fn both_are_measured_first_and_the_slower_is_looked_at_again() {
        let mut pace = Pace::default();
        let (first, stretch) = pace.next(4, 100);
        assert_eq!((first, stretch), (1, 1));
        pace.note(1, 1, 1_000_000);
        assert_eq!(pace.next(4, 100).0, 4);
        pace.note(4, 5, 1_500_000);
        let teams: Vec<usize> = (0..LOOK_AGAIN)
            .map(|_| {
                let (team, n) = pace.next(4, 100);
                pace.note(team, n, if team == 1 { 1_000_000 } else { 300_000 } * n);
                team
            })
            .collect();
        assert_eq!(teams.iter().filter(|&&t| t == 1).count(), 1);
    }

    #[test]
    fn a_stretch_never_exceeds_what_is_left() {
        assert_eq!(settled(10.0, 10.0).next(2, 7).1, 7);
        assert_eq!(settled(1e12, 1e12).next(2, 7).1, 1);
    }
}
