//! Joining: nodes ask, until every agent has one and all have received a message from each other.

use super::{FleetError, FleetServer, NodeEntry};
use crate::protocol::{FleetMember, Incarnation, JoinError, JoinRequest, Message, Topology};
use crate::wire::PeerId;
use sidestep::kernel::EntityId;

/// A refusal of a node.
struct JoinRefusal {
    /// The name of the reason in metrics.
    reason: &'static str,
    /// The reason and the remedy, for the node's user.
    error: JoinError,
}

impl JoinRefusal {
    fn new(reason: &'static str, cause: String, remedy: &str) -> Self {
        Self { reason, error: JoinError { cause, remedy: remedy.into() } }
    }
}

impl FleetServer<'_> {
    /// Waits until all nodes have joined and are ready.
    ///
    /// # Errors
    /// When the fleet is asked to end.
    pub(super) fn wait_for_nodes(&mut self) -> Result<(), FleetError> {
        self.wait_until_all_ready()?;
        tracing::info!(nodes = self.nodes.len(), "all nodes are there");
        Ok(())
    }

    /// Answers a node that asks to join. It repeats its request until it receives the answer.
    pub(super) fn on_join(&mut self, agent: EntityId, incarnation: Incarnation, join: JoinRequest) {
        if let Err(JoinRefusal { reason, error }) = self.check_join(agent, incarnation, &join) {
            let JoinError { cause, remedy } = &error;
            tracing::warn!(agent, process = join.process, cause, remedy, "a node is refused");
            *self.metrics.refused.entry(reason).or_default() += 1;
            self.messenger.reply(PeerId::Node(agent), incarnation, Message::Refused(error));
            return;
        }
        let is_known = self.nodes[&agent].incarnation() == Some(incarnation);
        self.messenger.connect(PeerId::Node(agent), incarnation);
        let welcome = Message::Welcome(self.config.welcome.clone());
        self.messenger.reply(PeerId::Node(agent), incarnation, welcome);
        if is_known {
            return;
        }
        let process = join.process;
        if let Some(node) = self.nodes.get_mut(&agent) {
            let JoinRequest { listens, session, .. } = join;
            node.record_join(FleetMember { agent, incarnation, listens, session }, process);
        }
        let who = self.run.agent_display_name(agent);
        tracing::info!(agent, who, process, "a node has joined");
        self.send_roster();
    }

    /// Sends all nodes the list of members, once all have joined.
    fn send_roster(&mut self) {
        let joined: Vec<EntityId> = self.joined_agents().collect();
        self.send_roster_to(&joined);
    }

    /// Does the same for some of them.
    pub(super) fn send_roster_to(&mut self, agents: &[EntityId]) {
        let members = self.nodes.values().map(|node| node.member.clone());
        let Some(members) = members.collect::<Option<Vec<FleetMember>>>() else { return };
        for &agent in agents {
            self.messenger.send_reliable(PeerId::Node(agent), Message::Roster(members.clone()));
        }
    }

    /// Checks whether the sender of a request may join.
    fn check_join(
        &self,
        agent: EntityId,
        incarnation: Incarnation,
        join: &JoinRequest,
    ) -> Result<(), JoinRefusal> {
        // A frame whose sender and content differ is of a faulty program.
        let Some(entry) = self.nodes.get(&agent).filter(|_| join.agent == agent) else {
            let cause = format!("the fleet has no agent {agent}");
            return Err(JoinRefusal::new("unknown", cause, &self.run.world().agent_hint()));
        };
        self.check_build_and_scenario(join)?;
        self.check_listens(join)?;
        self.check_session(incarnation, join)?;
        self.check_agent_free(entry, incarnation, join)
    }

    /// Refuses a node of another build or scenario.
    fn check_build_and_scenario(&self, join: &JoinRequest) -> Result<(), JoinRefusal> {
        if join.build != self.config.build {
            let cause = format!(
                "the server is of sidestep {}, this node of {}",
                self.config.build, join.build
            );
            return Err(JoinRefusal::new(
                "build",
                cause,
                "install the same build on both machines",
            ));
        }
        if join.scenario != self.config.scenario {
            let cause = format!(
                "the server flies another scenario (fingerprint {}, this node has read {})",
                self.config.scenario, join.scenario
            );
            return Err(JoinRefusal::new(
                "scenario",
                cause,
                "give the node the same file and the same --set, --seed and --cycles as the server",
            ));
        }
        Ok(())
    }

    /// Refuses a node of a mesh that others cannot reach.
    fn check_listens(&self, join: &JoinRequest) -> Result<(), JoinRefusal> {
        if self.config.welcome.topology == Topology::Mesh && join.listens.is_empty() {
            let cause = "in a mesh other nodes must reach this one, and it listens nowhere".into();
            let remedy = "give it an address of its machine: --listen tcp/ADDRESS:PORT (tls/ with \
                 certificates; port 0 for any)";
            return Err(JoinRefusal::new("listens", cause, remedy));
        }
        Ok(())
    }

    /// Refuses a node whose frames other nodes would not believe.
    fn check_session(
        &self,
        incarnation: Incarnation,
        join: &JoinRequest,
    ) -> Result<(), JoinRefusal> {
        let session = join.session.as_ref();
        self.messenger.check_session(join.agent, incarnation, session).map_err(|reason| {
            let cause = format!("other nodes would not believe what this one sends: {reason}");
            let remedy =
                "give the node the certificate of its agent by --tls-cert, with its --tls-key";
            JoinRefusal::new("signature", cause, remedy)
        })
    }

    /// Refuses a node whose agent has another one, or cannot get one again.
    fn check_agent_free(
        &self,
        entry: &NodeEntry,
        incarnation: Incarnation,
        join: &JoinRequest,
    ) -> Result<(), JoinRefusal> {
        let who = self.run.agent_display_name(join.agent);
        if entry.incarnation().is_some_and(|present| present != incarnation) {
            let cause = format!("{who} has a node already (process {})", entry.process);
            let noun = self.run.world().name(join.agent).noun;
            let remedy = format!("give the --{noun} of one that has none");
            return Err(JoinRefusal::new("taken", cause, &remedy));
        }
        let replaces_lost_node = entry.joins > 0 && entry.incarnation().is_none();
        if !replaces_lost_node || !self.has_begun {
            return Ok(());
        }
        if !self.allows_rejoin() {
            let cause = "the fleet flies in lockstep, and has begun".to_string();
            return Err(JoinRefusal::new("begun", cause, "start the fleet again"));
        }
        // The other nodes keep the endpoints of the first roster: their Zenoh sessions reconnect to these.
        if let Some(member) = &entry.member
            && member.listens != join.listens
        {
            let cause = format!("the other nodes look for {who} at {}", member.listens.join(", "));
            return Err(JoinRefusal::new("moved", cause, "give the same --listen as before"));
        }
        Ok(())
    }
}
