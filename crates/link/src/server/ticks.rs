//! Counted time: lockstep on a network with faults.
//!
//! A packet takes a number of ticks, and an agent asks again after some. For the same faults as in one process, all
//! nodes go through the same ticks: the server knows when each timer ends and each packet arrives, and lets those
//! nodes go on for which something happens next. No node goes on to a tick before all packets that arrive by then
//! are there: the server tells it how many they are.

use super::{Broken, LOOK, Server};
use crate::wire::Party;
use crate::words::{Tick, Ticked, Word};
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;

/// The server's knowledge of a node in a cycle.
#[derive(Debug, Default)]
struct Course {
    /// The tick of its next timer.
    timer: Option<u64>,
    /// Number of packets that arrive at it, by tick.
    arrivals: BTreeMap<u64, u64>,
    /// Number of those that have arrived.
    arrived: u64,
    is_done: bool,
    /// Whether it has yet to report.
    is_out: bool,
}

impl Course {
    /// Returns the next tick in which something happens.
    fn next(&self) -> Option<u64> {
        let arrival = self.arrivals.keys().next().copied();
        self.timer.filter(|_| !self.is_done).into_iter().chain(arrival).min()
    }

    /// Goes on to a tick, and returns the number of packets that have arrived by then.
    fn go_on_to(&mut self, tick: u64) -> u64 {
        let later = self.arrivals.split_off(&(tick + 1));
        self.arrived += self.arrivals.values().sum::<u64>();
        self.arrivals = later;
        self.is_out = true;
        self.arrived
    }
}

impl Server<'_> {
    /// Lets nodes talk, tick by tick, until each of them has a control.
    ///
    /// # Errors
    /// When a node is gone, or somebody asks the fleet to end.
    pub(super) fn count_ticks(&mut self, decide: &[EntityId]) -> Result<(), Broken> {
        let cycle = self.stage.cycle();
        let out = || Course { is_out: true, ..Course::default() };
        let mut courses: BTreeMap<EntityId, Course> =
            decide.iter().map(|&agent| (agent, out())).collect();
        loop {
            self.hear_reports(&mut courses)?;
            if courses.values().all(|course| course.is_done) {
                break;
            }
            let Some(tick) = courses.values().filter_map(Course::next).min() else { break };
            for (&agent, course) in &mut courses {
                if course.next().is_some_and(|next| next <= tick) {
                    let packets = course.go_on_to(tick);
                    let word = Word::Tick(Tick { cycle, tick, packets });
                    self.mail.letter(Party::Node(agent), word);
                }
            }
        }
        for &agent in decide {
            self.mail.letter(Party::Node(agent), Word::Close(cycle));
        }
        Ok(())
    }

    /// Waits until no node has yet to report, and notes what they have sent.
    fn hear_reports(&mut self, courses: &mut BTreeMap<EntityId, Course>) -> Result<(), Broken> {
        let cycle = self.stage.cycle();
        while courses.values().any(|course| course.is_out) {
            self.hear(LOOK)?;
            for (agent, report) in std::mem::take(&mut self.ticked) {
                if report.cycle == cycle {
                    note(courses, agent, report);
                }
            }
        }
        Ok(())
    }
}

fn note(courses: &mut BTreeMap<EntityId, Course>, agent: EntityId, report: Ticked) {
    for (receiver, arrives) in report.sent {
        if let Some(course) = courses.get_mut(&receiver) {
            *course.arrivals.entry(arrives).or_default() += 1;
        }
    }
    if let Some(course) = courses.get_mut(&agent) {
        (course.timer, course.is_done, course.is_out) = (report.timer, report.is_done, false);
    }
}
