//! Liveness of nodes: lost ones, and silent ones, for which a fleet in lockstep waits.

use super::{FleetError, FleetServer, POLL_INTERVAL};
use crate::protocol::{ClockMode, Incarnation, JoinError, Message};
use crate::wire::PeerId;
use sidestep::kernel::EntityId;
use std::time::Duration;

/// Time after which a node that is not heard counts as silent: two of its reports are missing then.
pub const SILENCE_TIMEOUT: Duration = Duration::from_secs(1);

impl FleetServer<'_> {
    /// Returns whether a node that has joined was not heard for longer than some time.
    pub(super) fn is_silent(&self, agent: EntityId, time: Duration) -> bool {
        self.messenger.silent_for(PeerId::Node(agent)).is_some_and(|silent| silent > time)
    }

    /// Returns whether an agent has no node, because none has joined or it is lost.
    pub(super) fn has_no_node(&self, agent: EntityId) -> bool {
        self.nodes.get(&agent).is_none_or(|node| node.incarnation().is_none())
    }

    /// Returns whether the fleet is in lockstep.
    fn is_in_lockstep(&self) -> bool {
        self.config.welcome.clock == ClockMode::Lockstep
    }

    /// Returns whether an agent may get another node after the start. In real time the state of the world is with the
    /// server, and a new node needs only the next percept; in lockstep it depends on the world.
    pub(super) fn allows_rejoin(&self) -> bool {
        !self.is_in_lockstep() || self.run.world().waits_for_lost_nodes()
    }

    /// Records that a node is lost: it has ended.
    ///
    /// # Errors
    /// When the fleet cannot continue without it.
    pub(super) fn mark_lost(&mut self, agent: EntityId, reason: String) -> Result<(), FleetError> {
        let Some(node) = self.nodes.get_mut(&agent) else { return Ok(()) };
        node.may_return = false;
        self.messenger.disconnect(PeerId::Node(agent));
        self.record_loss(agent, reason)
    }

    /// Records that a node is lost, because it was not heard for the lease. What it was sent and has not acknowledged is
    /// kept, for the case that it is heard again.
    ///
    /// # Errors
    /// When the fleet cannot continue without it.
    pub(super) fn mark_silent(&mut self, agent: EntityId) -> Result<(), FleetError> {
        if let Some(node) = self.nodes.get_mut(&agent) {
            node.may_return = true;
        }
        self.record_loss(agent, format!("not heard for {} s", self.config.lease.as_secs_f64()))
    }

    fn record_loss(&mut self, agent: EntityId, reason: String) -> Result<(), FleetError> {
        let Some(node) = self.nodes.get_mut(&agent).filter(|node| node.incarnation().is_some())
        else {
            return Ok(());
        };
        node.is_lost = true;
        let who = self.run.agent_display_name(agent);
        let cycle = self.run.cycle();
        tracing::warn!(agent, who, cycle, reason, "a node is gone");
        if self.has_begun && !self.allows_rejoin() {
            return Err(FleetError::NodeLost { agent: who, cycle, reason });
        }
        Ok(())
    }

    /// Gives a node that is heard again after a silence its place back, if the fleet has gone on without it. Returns
    /// whether it has a place now.
    pub(super) fn take_back(&mut self, agent: EntityId, incarnation: Incarnation) -> bool {
        let Some(node) = self.nodes.get_mut(&agent).filter(|node| node.may_return) else {
            return false;
        };
        let is_former = node.member.as_ref().is_some_and(|known| known.incarnation == incarnation);
        if !is_former {
            return false;
        }
        node.is_lost = false;
        node.may_return = false;
        let who = self.run.agent_display_name(agent);
        tracing::info!(agent, who, cycle = self.run.cycle(), "a node is heard again");
        // Others may have joined meanwhile.
        self.send_roster_to(&[agent]);
        true
    }

    /// Tells a node whose agent has lost it, or has another one, that it has no place anymore: it ends then.
    pub(super) fn dismiss(&mut self, agent: EntityId, incarnation: Incarnation) {
        let Some(node) = self.nodes.get(&agent) else { return };
        let Some(known) = &node.member else { return };
        let has_place = known.incarnation == incarnation;
        if has_place && !node.is_lost {
            return;
        }
        let cause = if has_place {
            "the server considers this node lost"
        } else {
            "another node has the place of this one"
        };
        let error = JoinError { cause: cause.into(), remedy: "start it again".into() };
        self.messenger.reply(PeerId::Node(agent), incarnation, Message::Refused(error));
    }

    /// Waits until all nodes are there and ready, including replacements of lost ones.
    ///
    /// # Errors
    /// When the fleet is asked to end.
    pub(super) fn wait_until_all_ready(&mut self) -> Result<(), FleetError> {
        while !self.nodes.values().all(|node| node.is_ready && !node.is_lost) {
            self.receive(POLL_INTERVAL)?;
        }
        Ok(())
    }

    /// Updates the list of agents for which a fleet in lockstep waits, and logs the new ones.
    pub(super) fn report_waits(&mut self) {
        if !self.is_in_lockstep() || !self.has_begun {
            return;
        }
        let mut waits_for = Vec::new();
        for &agent in self.nodes.keys() {
            if self.has_no_node(agent) || self.is_silent(agent, SILENCE_TIMEOUT) {
                waits_for.push(agent);
            }
        }
        for &agent in waits_for.iter().filter(|agent| !self.waits_for.contains(agent)) {
            let who = self.run.agent_display_name(agent);
            let cycle = self.run.cycle();
            tracing::warn!(agent, who, cycle, "all wait for a node that is not heard");
        }
        self.waits_for = waits_for;
    }
}
