//! The muster: nodes join, until every agent has one and all have heard each other.

use super::{FleetError, NodeEntry, Server};
use crate::protocol::{Incarnation, Join, JoinError, Member, Message};
use crate::wire::Peer;
use sidestep::kernel::EntityId;

impl Server<'_> {
    /// Waits until all nodes are there and ready.
    ///
    /// # Errors
    /// When the fleet is asked to end.
    pub(super) fn wait_for_nodes(&mut self) -> Result<(), FleetError> {
        self.wait_for_all()?;
        tracing::info!(nodes = self.seats.len(), "all nodes are there");
        Ok(())
    }

    /// Answers a node that wants to join. It asks until it hears the answer.
    pub(super) fn on_join(&mut self, agent: EntityId, life: Incarnation, join: Join) {
        if let Some((reason, refusal)) = self.join_error(agent, life, &join) {
            let JoinError { cause, remedy } = &refusal;
            tracing::warn!(agent, process = join.process, cause, remedy, "a node is refused");
            *self.tally.refused.entry(reason).or_default() += 1;
            self.mail.reply(Peer::Node(agent), life, Message::Refused(refusal));
            return;
        }
        let member = Member { agent, life, listens: join.listens };
        let is_known = self.seats[&agent].incarnation() == Some(life);
        self.mail.connect(Peer::Node(agent), life);
        let welcome = Message::Welcome(self.terms.welcome.clone());
        self.mail.reply(Peer::Node(agent), life, welcome);
        if is_known {
            return;
        }
        if let Some(seat) = self.seats.get_mut(&agent) {
            seat.assign(member, join.process);
        }
        let who = self.stage.agent_label(agent);
        tracing::info!(agent, who, process = join.process, "a node has joined");
        self.send_roster();
    }

    /// Tells all nodes the list of members, once all have joined.
    fn send_roster(&mut self) {
        let members = self.seats.values().map(|seat| seat.member.clone());
        let Some(members) = members.collect::<Option<Vec<Member>>>() else { return };
        let seated: Vec<EntityId> = self.joined_agents().collect();
        for agent in seated {
            self.mail.send_reliable(Peer::Node(agent), Message::Roster(members.clone()));
        }
    }

    /// Returns the reason why a node may not join, in one word and in detail; none if it may.
    fn join_error(
        &self,
        agent: EntityId,
        life: Incarnation,
        join: &Join,
    ) -> Option<(&'static str, JoinError)> {
        let Some(seat) = self.seats.get(&agent).filter(|_| join.agent == agent) else {
            let remedy = self.stage.world().agent_hint();
            return reject("unknown", format!("the fleet has no agent {agent}"), &remedy);
        };
        self.mismatch_error(join).or_else(|| self.entry_error(agent, seat, life, join))
    }

    /// Returns why a node of another build or scenario may not join.
    fn mismatch_error(&self, join: &Join) -> Option<(&'static str, JoinError)> {
        if join.build != self.terms.build {
            let cause = format!(
                "the server is of sidestep {}, this node of {}",
                self.terms.build, join.build
            );
            return reject("build", cause, "install the same build on both machines");
        }
        if join.scenario != self.terms.scenario {
            let cause = format!(
                "the server flies another scenario (fingerprint {}, this node has read {})",
                self.terms.scenario, join.scenario
            );
            return reject(
                "scenario",
                cause,
                "give the node the same file and the same --set, --seed and --cycles as the server",
            );
        }
        None
    }

    /// Returns why a node may not have the seat of its agent.
    fn entry_error(
        &self,
        agent: EntityId,
        seat: &NodeEntry,
        life: Incarnation,
        join: &Join,
    ) -> Option<(&'static str, JoinError)> {
        let who = self.stage.agent_label(agent);
        let is_other = seat.incarnation().is_some_and(|taken| taken != life);
        if is_other {
            let cause = format!("{who} has a node already (process {})", seat.process);
            let noun = self.stage.world().name(agent).noun();
            return reject("taken", cause, &format!("give the --{noun} of one that has none"));
        }
        let is_back = seat.lives > 0 && seat.incarnation().is_none();
        if is_back && self.has_begun && !self.allows_rejoin() {
            let cause = "the fleet flies in lockstep, and has begun".to_string();
            return reject("begun", cause, "start the fleet again");
        }
        let moved = seat.member.as_ref().filter(|_| is_back && self.has_begun);
        if moved.is_some_and(|member| member.listens != join.listens) {
            let cause = format!(
                "the other nodes look for {who} at {}",
                seat.member.as_ref().map(|member| member.listens.join(", ")).unwrap_or_default()
            );
            return reject("moved", cause, "give the same --listen as before");
        }
        None
    }
}

/// Returns a refusal, in a word and at length.
fn reject(word: &'static str, cause: String, remedy: &str) -> Option<(&'static str, JoinError)> {
    Some((word, JoinError { cause, remedy: remedy.into() }))
}
