//! Nodes that are not heard: gone ones, and silent ones, for which a fleet in lockstep waits.

use super::{FleetError, POLL_INTERVAL, Server};
use crate::protocol::{ClockMode, Incarnation, JoinError, Message};
use crate::wire::Peer;
use sidestep::kernel::EntityId;
use std::time::Duration;

/// Time after which a node that is not heard counts as silent: it sends a status twice a second.
pub const SILENCE_TIMEOUT: Duration = Duration::from_secs(1);

impl Server<'_> {
    /// Returns whether a node that has joined was not heard for longer than some time.
    pub(super) fn is_silent(&self, agent: EntityId, time: Duration) -> bool {
        self.mail.silent_for(Peer::Node(agent)).is_some_and(|silent| silent > time)
    }

    /// Returns whether the node of an agent is gone.
    pub(super) fn is_gone(&self, agent: EntityId) -> bool {
        self.seats.get(&agent).is_none_or(|seat| seat.incarnation().is_none())
    }

    /// Returns whether the fleet is in lockstep.
    fn is_in_lockstep(&self) -> bool {
        self.terms.welcome.clock == ClockMode::Lockstep
    }

    /// Returns whether the fleet takes back a node that returns after the start.
    pub(super) fn allows_rejoin(&self) -> bool {
        !self.is_in_lockstep() || self.stage.world().waits_for_lost_nodes()
    }

    /// Notes that a node is gone.
    ///
    /// # Errors
    /// When the fleet does not go on without it.
    pub(super) fn mark_lost(&mut self, agent: EntityId, reason: String) -> Result<(), FleetError> {
        let Some(seat) = self.seats.get_mut(&agent).filter(|seat| seat.incarnation().is_some())
        else {
            return Ok(());
        };
        seat.is_gone = true;
        self.mail.disconnect(Peer::Node(agent));
        let (who, cycle) = (self.stage.agent_label(agent), self.stage.cycle());
        tracing::warn!(agent, who, cycle, reason, "a node is gone");
        match self.has_begun && !self.allows_rejoin() {
            true => Err(FleetError::Gone { agent: who, cycle, reason }),
            false => Ok(()),
        }
    }

    /// Tells a node that was taken to be gone, and still speaks, that its place is lost.
    pub(super) fn dismiss(&mut self, agent: EntityId, life: Incarnation) {
        let Some(seat) = self.seats.get(&agent) else { return };
        let is_lost = seat.is_gone && seat.member.as_ref().is_some_and(|one| one.life == life);
        if is_lost {
            let cause = "the server had not heard this node for a while, and has given it up";
            let remedy = "start it again";
            let refusal = JoinError { cause: cause.into(), remedy: remedy.into() };
            self.mail.reply(Peer::Node(agent), life, Message::Refused(refusal));
        }
    }

    /// Waits until all nodes are there and ready, also those that were gone.
    ///
    /// # Errors
    /// When the fleet is asked to end.
    pub(super) fn wait_for_all(&mut self) -> Result<(), FleetError> {
        while !self.seats.values().all(|seat| seat.is_ready && !seat.is_gone) {
            self.receive(POLL_INTERVAL)?;
        }
        Ok(())
    }

    /// Notes the agents for which a fleet in lockstep waits, and reports the new ones.
    pub(super) fn report_waits(&mut self) {
        if !self.is_in_lockstep() || !self.has_begun {
            return;
        }
        let is_missed =
            |agent: &EntityId| self.is_gone(*agent) || self.is_silent(*agent, SILENCE_TIMEOUT);
        let waits_for: Vec<EntityId> = self.seats.keys().copied().filter(is_missed).collect();
        for &agent in waits_for.iter().filter(|agent| !self.waits_for.contains(agent)) {
            let (who, cycle) = (self.stage.agent_label(agent), self.stage.cycle());
            tracing::warn!(agent, who, cycle, "all wait for a node of which nothing is heard");
        }
        self.waits_for = waits_for;
    }
}
