//! The muster: nodes join, until every agent has one and all have heard each other.

use super::{Broken, Seat, Server};
use crate::wire::Party;
use crate::words::{Join, Life, Member, Refusal, Word};
use sidestep::kernel::EntityId;

impl Server<'_> {
    /// Waits until all nodes are there and ready.
    ///
    /// # Errors
    /// When the fleet is asked to end.
    pub(super) fn muster(&mut self) -> Result<(), Broken> {
        self.wait_for_all()?;
        tracing::info!(nodes = self.seats.len(), "all nodes are there");
        Ok(())
    }

    /// Answers a node that wants to join. It asks until it hears the answer.
    pub(super) fn on_join(&mut self, agent: EntityId, life: Life, join: Join) {
        if let Some((reason, refusal)) = self.refusal(agent, life, &join) {
            let Refusal { cause, remedy } = &refusal;
            tracing::warn!(agent, process = join.process, cause, remedy, "a node is refused");
            *self.tally.refused.entry(reason).or_default() += 1;
            self.mail.reply(Party::Node(agent), life, Word::Refused(refusal));
            return;
        }
        let member = Member { agent, life, listens: join.listens };
        let is_known = self.seats[&agent].life() == Some(life);
        self.mail.meet(Party::Node(agent), life);
        let welcome = Word::Welcome(self.terms.welcome.clone());
        self.mail.reply(Party::Node(agent), life, welcome);
        if is_known {
            return;
        }
        if let Some(seat) = self.seats.get_mut(&agent) {
            seat.take(member, join.process);
        }
        let who = self.stage.called(agent);
        tracing::info!(agent, who, process = join.process, "a node has joined");
        self.tell_roster();
    }

    /// Tells all nodes the list of members, once all have joined.
    fn tell_roster(&mut self) {
        let members = self.seats.values().map(|seat| seat.member.clone());
        let Some(members) = members.collect::<Option<Vec<Member>>>() else { return };
        let seated: Vec<EntityId> = self.seated().collect();
        for agent in seated {
            self.mail.letter(Party::Node(agent), Word::Roster(members.clone()));
        }
    }

    /// Returns the reason why a node may not join, in one word and in detail; none if it may.
    fn refusal(&self, agent: EntityId, life: Life, join: &Join) -> Option<(&'static str, Refusal)> {
        let Some(seat) = self.seats.get(&agent).filter(|_| join.agent == agent) else {
            let remedy = self.stage.world().which();
            return refused("unknown", format!("the fleet has no agent {agent}"), &remedy);
        };
        self.unlike(join).or_else(|| self.taken(agent, seat, life, join))
    }

    /// Returns why a node of another build or scenario may not join.
    fn unlike(&self, join: &Join) -> Option<(&'static str, Refusal)> {
        if join.build != self.terms.build {
            let cause = format!(
                "the server is of sidestep {}, this node of {}",
                self.terms.build, join.build
            );
            return refused("build", cause, "install the same build on both machines");
        }
        if join.scenario != self.terms.scenario {
            let cause = format!(
                "the server flies another scenario (fingerprint {}, this node has read {})",
                self.terms.scenario, join.scenario
            );
            return refused(
                "scenario",
                cause,
                "give the node the same file and the same --set, --seed and --cycles as the server",
            );
        }
        None
    }

    /// Returns why a node may not have the seat of its agent.
    fn taken(
        &self,
        agent: EntityId,
        seat: &Seat,
        life: Life,
        join: &Join,
    ) -> Option<(&'static str, Refusal)> {
        let who = self.stage.called(agent);
        let is_other = seat.life().is_some_and(|taken| taken != life);
        if is_other {
            let cause = format!("{who} has a node already (process {})", seat.process);
            let noun = self.stage.world().name(agent).noun();
            return refused("taken", cause, &format!("give the --{noun} of one that has none"));
        }
        let is_back = seat.lives > 0 && seat.life().is_none();
        if is_back && self.has_begun && !self.takes_back() {
            let cause = "the fleet flies in lockstep, and has begun".to_string();
            return refused("begun", cause, "start the fleet again");
        }
        let moved = seat.member.as_ref().filter(|_| is_back && self.has_begun);
        if moved.is_some_and(|member| member.listens != join.listens) {
            let cause = format!(
                "the other nodes look for {who} at {}",
                seat.member.as_ref().map(|member| member.listens.join(", ")).unwrap_or_default()
            );
            return refused("moved", cause, "give the same --listen as before");
        }
        None
    }
}

/// Returns a refusal, in a word and at length.
fn refused(word: &'static str, cause: String, remedy: &str) -> Option<(&'static str, Refusal)> {
    Some((word, Refusal { cause, remedy: remedy.into() }))
}
