//! Time counted in ticks: lockstep on a network with faults.
//!
//! A packet takes a number of ticks, and an agent repeats a request after some. To have the same faults as in one
//! process, all nodes go through the same ticks. This is a conservative discrete-event simulation with the server as
//! coordinator: it knows when each timer ends and each packet arrives, and grants the next tick in which anything
//! happens to the nodes at which it happens. No node advances to a tick before all packets that arrive by then are
//! there: the grant says how many.

use super::rounds::DecisionGroup;
use super::{FleetError, FleetServer, POLL_INTERVAL};
use crate::protocol::{AdvanceDone, AdvanceGrant, Message};
use crate::wire::PeerId;
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;

/// A node's time in a cycle, as far as the server knows it.
#[derive(Debug, Default)]
struct NodeTickState {
    /// The tick of its next timer, by its last report.
    next_timer: Option<u64>,
    /// Number of packets that will arrive at it, by tick.
    arrivals: BTreeMap<u64, u64>,
    /// Number of packets that have arrived.
    arrived: u64,
    is_done: bool,
    /// Whether it has yet to report on the tick that it was granted.
    is_advancing: bool,
}

impl NodeTickState {
    /// Returns the next tick in which something happens.
    fn next_tick(&self) -> Option<u64> {
        let next_arrival = self.arrivals.keys().next().copied();
        self.next_timer.into_iter().chain(next_arrival).min()
    }

    /// Advances to a tick, and returns the number of packets that have arrived by then.
    fn advance_to(&mut self, tick: u64) -> u64 {
        let later = self.arrivals.split_off(&(tick + 1));
        self.arrived += self.arrivals.values().sum::<u64>();
        self.arrivals = later;
        self.is_advancing = true;
        self.arrived
    }
}

/// The clocks of the nodes of one group. Groups do not talk to each other, so each has ticks of its own.
#[derive(Debug, Default)]
struct GroupTickScheduler {
    nodes: BTreeMap<EntityId, NodeTickState>,
    is_over: bool,
}

impl GroupTickScheduler {
    fn new(group: &[EntityId]) -> Self {
        let mut nodes = BTreeMap::new();
        for &agent in group {
            // Nodes do their first tick without a grant.
            nodes.insert(agent, NodeTickState { is_advancing: true, ..NodeTickState::default() });
        }
        Self { nodes, is_over: false }
    }

    fn record(&mut self, agent: EntityId, report: AdvanceDone) {
        for (receiver, tick) in report.sent {
            if let Some(node) = self.nodes.get_mut(&receiver) {
                *node.arrivals.entry(tick).or_default() += 1;
            }
        }
        if let Some(node) = self.nodes.get_mut(&agent) {
            node.next_timer = report.next_timer;
            node.is_done = report.is_done;
            node.is_advancing = false;
        }
    }

    /// Returns the grants of the next tick, by the agents of the nodes for which something happens in it; none before all
    /// nodes have reported, because any of them may still send a packet that arrives earlier. When all are done, or
    /// nothing more can happen, the conversation is over.
    fn advance(&mut self, cycle: u64) -> Vec<(EntityId, AdvanceGrant)> {
        if self.is_over || self.nodes.values().any(|node| node.is_advancing) {
            return Vec::new();
        }
        let next = self.nodes.values().filter_map(NodeTickState::next_tick).min();
        // A timer that never ends is in the last tick there is.
        let next = next.filter(|&tick| tick < u64::MAX);
        let is_done = self.nodes.values().all(|node| node.is_done);
        let Some(tick) = next.filter(|_| !is_done) else {
            self.is_over = true;
            return Vec::new();
        };
        let mut grants = Vec::new();
        for (&agent, node) in &mut self.nodes {
            if node.next_tick() == Some(tick) {
                let packets = node.advance_to(tick);
                grants.push((agent, AdvanceGrant { cycle, tick, packets }));
            }
        }
        grants
    }
}

impl FleetServer<'_> {
    /// Runs the conversations of groups, tick by tick, until each agent has a control.
    ///
    /// # Errors
    /// When a node that the fleet needs is lost, or the fleet is asked to end.
    pub(super) fn run_group_conversations(
        &mut self,
        groups: &[DecisionGroup],
    ) -> Result<(), FleetError> {
        let cycle = self.run.cycle();
        let mut clocks: Vec<GroupTickScheduler> =
            groups.iter().map(|group| GroupTickScheduler::new(group)).collect();
        while clocks.iter().any(|clock| !clock.is_over) {
            self.receive(POLL_INTERVAL)?;
            for clock in &mut clocks {
                // Without a node of the group its tick would never be complete.
                clock.is_over |= clock.nodes.keys().any(|&agent| self.has_no_node(agent));
            }
            for (agent, report) in std::mem::take(&mut self.advance_reports) {
                // One of an earlier cycle may arrive late, if its conversation was ended by the loss of a node.
                if report.cycle != cycle {
                    continue;
                }
                let clock = clocks.iter_mut().find(|clock| clock.nodes.contains_key(&agent));
                if let Some(clock) = clock {
                    clock.record(agent, report);
                    self.send_grants(clock);
                }
            }
        }
        Ok(())
    }

    fn send_grants(&mut self, clock: &mut GroupTickScheduler) {
        let cycle = self.run.cycle();
        for (agent, grant) in clock.advance(cycle) {
            self.messenger.send_reliable(PeerId::Node(agent), Message::Grant(grant));
        }
        if clock.is_over {
            for &agent in clock.nodes.keys() {
                self.messenger.send_reliable(PeerId::Node(agent), Message::Close(cycle));
            }
        }
    }
}
