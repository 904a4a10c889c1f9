//! Counted time: lockstep on a network with faults.
//!
//! A packet takes a number of ticks, and an agent asks again after some. To have the same faults as in one process,
//! all nodes go through the same ticks: the server knows when each timer ends and each packet arrives, and lets the
//! nodes go on for which something happens next. No node goes on to a tick before all packets that arrive by then are
//! there: the server tells it their number.

use super::rounds::Group;
use super::{FleetError, POLL_INTERVAL, Server};
use crate::protocol::{AdvanceDone, AdvanceGrant, Message};
use crate::wire::Peer;
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;

/// The server's knowledge of a node in a cycle.
#[derive(Debug, Default)]
struct NodeClock {
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

impl NodeClock {
    /// Returns the next tick in which something happens.
    fn next_tick(&self) -> Option<u64> {
        let arrival = self.arrivals.keys().next().copied();
        self.timer.into_iter().chain(arrival).min()
    }

    /// Goes on to a tick, and returns the number of packets that have arrived by then.
    fn advance_to(&mut self, tick: u64) -> u64 {
        let later = self.arrivals.split_off(&(tick + 1));
        self.arrived += self.arrivals.values().sum::<u64>();
        self.arrivals = later;
        self.is_out = true;
        self.arrived
    }
}

/// The courses of the nodes of one group, with ticks of its own.
#[derive(Debug, Default)]
struct GroupClock {
    courses: BTreeMap<EntityId, NodeClock>,
    is_over: bool,
}

impl GroupClock {
    fn new(group: &[EntityId]) -> Self {
        let out = || NodeClock { is_out: true, ..NodeClock::default() };
        let courses = group.iter().map(|&agent| (agent, out())).collect();
        Self { courses, is_over: false }
    }

    fn record(&mut self, agent: EntityId, report: AdvanceDone) {
        for (receiver, arrives) in report.sent {
            if let Some(course) = self.courses.get_mut(&receiver) {
                *course.arrivals.entry(arrives).or_default() += 1;
            }
        }
        if let Some(course) = self.courses.get_mut(&agent) {
            (course.timer, course.is_done, course.is_out) = (report.timer, report.is_done, false);
        }
    }

    /// Returns the nodes that go on, with the packets that have arrived at each by then, and the tick; none before all
    /// have reported. When all are done, or nothing more can happen, the talk is over.
    fn advance(&mut self) -> Vec<(EntityId, u64, u64)> {
        if self.is_over || self.courses.values().any(|course| course.is_out) {
            return Vec::new();
        }
        let next = self.courses.values().filter_map(NodeClock::next_tick).min();
        let next = next.filter(|&tick| tick < u64::MAX);
        let is_done = self.courses.values().all(|course| course.is_done);
        let Some(tick) = next.filter(|_| !is_done) else {
            self.is_over = true;
            return Vec::new();
        };
        let go = self.courses.iter_mut().filter(|(_, course)| course.next_tick() == Some(tick));
        go.map(|(&agent, course)| (agent, course.advance_to(tick), tick)).collect()
    }
}

impl Server<'_> {
    /// Lets nodes talk, tick by tick, until each of them has a control.
    ///
    /// # Errors
    /// When a node that the fleet needs is gone, or the fleet is asked to end.
    pub(super) fn run_ticks(&mut self, groups: &[Group]) -> Result<(), FleetError> {
        let cycle = self.stage.cycle();
        let mut talks: Vec<GroupClock> =
            groups.iter().map(|group| GroupClock::new(group)).collect();
        while talks.iter().any(|talk| !talk.is_over) {
            self.receive(POLL_INTERVAL)?;
            for talk in &mut talks {
                // Others may wait forever for one that is gone.
                talk.is_over |= talk.courses.keys().any(|&agent| self.is_gone(agent));
            }
            for (agent, report) in std::mem::take(&mut self.ticked) {
                let of = |talk: &&mut GroupClock| talk.courses.contains_key(&agent);
                if let Some(talk) = talks.iter_mut().find(of)
                    && report.cycle == cycle
                {
                    talk.record(agent, report);
                    self.send_grants(talk);
                }
            }
        }
        Ok(())
    }

    fn send_grants(&mut self, talk: &mut GroupClock) {
        let cycle = self.stage.cycle();
        for (agent, packets, tick) in talk.advance() {
            self.mail.send_reliable(
                Peer::Node(agent),
                Message::Tick(AdvanceGrant { cycle, tick, packets }),
            );
        }
        if talk.is_over {
            for &agent in talk.courses.keys() {
                self.mail.send_reliable(Peer::Node(agent), Message::Close(cycle));
            }
        }
    }
}
