//! A host: the airplane's part in all coordinators of its group.

use super::epoch::CoordinatorEpoch;
use super::messages::{self, MessageReceiverContext};
use super::replica::{CoordinatorReplica, HostedCoordinator, OutgoingHostMessage};
use super::{
    CoordinatorHostConfig, CoordinatorHostContext, CoordinatorHostServices,
    CoordinatorItineraryStep, HostMoment, MigratingCoordinator,
};
use crate::agents::participant::InvalidMessage;
use std::sync::Arc;

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on: a state
/// machine without a clock or a network of its own. Others are known by their place in the group.
#[derive(Debug, Clone)]
pub(super) struct CoordinatorHost<P: MigratingCoordinator> {
    pub services: P::Services,
    pub replicas: Vec<CoordinatorReplica<P>>,
    pub rules: Arc<CoordinatorHostConfig>,
}

impl<P: MigratingCoordinator> CoordinatorHost<P> {
    /// Returns a host of coordinators, each of which visits the hosts at some places and begins on
    /// the first of them.
    pub(super) fn new(
        services: P::Services,
        stops: &[Vec<usize>],
        rules: CoordinatorHostConfig,
    ) -> Self {
        let rules = Arc::new(rules);
        let replicas = stops
            .iter()
            .enumerate()
            .map(|(number, stops)| CoordinatorReplica::new(number, stops, &rules))
            .collect();
        Self { services, replicas, rules }
    }

    /// Starts: the coordinators are on their first hosts.
    pub(super) fn start(&mut self, tick: u64) {
        let moment = HostMoment { services: &self.services, tick };
        for replica in &mut self.replicas {
            replica.start(&moment);
        }
        self.run_coordinators(tick);
    }

    /// Takes a message of another host.
    ///
    /// # Errors
    /// When it is not sound; nothing has changed then.
    pub(super) fn on_message(
        &mut self,
        from: usize,
        bytes: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage> {
        let CoordinatorHostConfig { me, group, .. } = *self.rules;
        let reader = MessageReceiverContext { me, group, replicas: self.replicas.len() };
        let (replica, message, state) = messages::decode(bytes, from, reader)?;
        let replica = &mut self.replicas[usize::from(replica)];
        let moment = HostMoment { services: &self.services, tick };
        replica.on_message(from, message, state, &moment)?;
        self.run_coordinators(tick);
        Ok(())
    }

    /// Performs all actions that are due.
    pub(super) fn on_timer(&mut self, tick: u64) {
        let moment = HostMoment { services: &self.services, tick };
        for replica in &mut self.replicas {
            let watches = self.services.is_awaiting_coordinator(replica.number.into());
            replica.on_timer(watches, &moment);
        }
        self.run_coordinators(tick);
    }

    /// Returns the tick in which something is due, whether the host itself is done or not: others
    /// may depend on it.
    pub(super) fn next_timer(&self) -> Option<u64> {
        self.replicas
            .iter()
            .filter_map(|replica| {
                replica.next_timer(self.services.is_awaiting_coordinator(replica.number.into()))
            })
            .min()
    }

    /// Runs the coordinators that are here until each has left, is over, or waits.
    fn run_coordinators(&mut self, tick: u64) {
        for replica in &self.replicas {
            if let Some(unanswering) = &replica.unanswering {
                self.services.on_no_majority(replica.number.into(), unanswering);
            }
        }
        let mut has_changed = true;
        while std::mem::take(&mut has_changed) {
            for k in 0..self.replicas.len() {
                has_changed |= self.run_coordinator(k, tick);
            }
        }
    }

    /// Runs a coordinator if it is here. Returns whether anything has changed for the others here.
    fn run_coordinator(&mut self, k: usize, tick: u64) -> bool {
        let epochs: Vec<CoordinatorEpoch> =
            self.replicas.iter().map(|replica| replica.promised).collect();
        let is_here: Vec<bool> = self.replicas.iter().map(CoordinatorReplica::is_hosting).collect();
        let replica = &mut self.replicas[k];
        let Some(HostedCoordinator { mut coordinator, heartbeat_at, timeout_at }) =
            replica.take_coordinator()
        else {
            return false;
        };
        let has_timed_out = timeout_at <= tick;
        let context =
            CoordinatorHostContext { epochs: &epochs, is_here: &is_here, has_timed_out, tick };
        match coordinator.advance(&mut self.services, &context) {
            CoordinatorItineraryStep::Hop(to) => {
                replica.migrate_coordinator(&coordinator, to, tick)
            }
            CoordinatorItineraryStep::Done => {}
            // It has continued without the one that it waited for, and waits anew.
            CoordinatorItineraryStep::Stay if has_timed_out => {
                replica.host_coordinator(coordinator, tick)
            }
            CoordinatorItineraryStep::Stay => {
                replica.put_back(HostedCoordinator { coordinator, heartbeat_at, timeout_at });
                return self.services.has_news();
            }
        }
        true
    }

    /// Returns whether no coordinator is in the care of the host, and none is missed by it.
    pub(super) fn is_idle(&self) -> bool {
        self.replicas.iter().all(CoordinatorReplica::is_idle)
    }

    /// Returns the messages on their way out.
    pub(super) fn take_messages(&mut self) -> Vec<OutgoingHostMessage> {
        self.replicas.iter_mut().flat_map(|replica| std::mem::take(&mut replica.out)).collect()
    }
}
