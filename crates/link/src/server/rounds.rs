//! Rounds of a cycle: percepts go out to the agents that decide next, and controls come in; after the last round the
//! world goes on.

use super::{FleetError, Server};
use crate::agent::{AgentPercept, Controls, InvalidControl};
use crate::protocol::{Control, Message};
use crate::wire::Peer;
use sidestep::kernel::EntityId;
use std::time::Instant;

/// The agents that decide together.
pub(super) type Group = Vec<EntityId>;

impl Server<'_> {
    /// Hands each agent that decides next its percept; returns the groups of agents that decide together.
    pub(super) fn send_percepts(&mut self) -> Vec<Group> {
        self.seats.values_mut().for_each(|seat| seat.control = None);
        let mut groups = Vec::new();
        for AgentPercept { agent, group, begin } in self.stage.percepts() {
            self.mail.send_reliable(Peer::Node(agent), Message::Begin(begin));
            if group.first() == Some(&agent) {
                groups.push(group);
            }
        }
        groups
    }

    pub(super) fn on_control(&mut self, agent: EntityId, Control { cycle, control }: Control) {
        let Some(seat) = self.seats.get_mut(&agent) else { return };
        if cycle == self.stage.cycle() {
            seat.control = Some(control);
        }
    }

    /// Returns whether an agent has sent its control.
    pub(super) fn has_control(&self, agent: EntityId) -> bool {
        self.seats.get(&agent).is_some_and(|seat| seat.control.is_some())
    }

    /// Takes the controls that are there, and counts those that are not.
    pub(super) fn accept_controls(&mut self, groups: &[Group]) {
        let mut controls = Controls::new();
        let mut gone = Vec::new();
        for &agent in groups.iter().flatten() {
            if self.is_gone(agent) {
                gone.push(agent);
            }
            match self.take_control(agent) {
                Some(control) => controls.push((agent, control)),
                None => self.record_late(agent),
            }
        }
        let absurd = self.stage.accept_controls(groups, controls, &gone);
        self.record_invalid(absurd);
    }

    /// Takes the control of an agent, if there is one that counts.
    fn take_control(&mut self, agent: EntityId) -> Option<Vec<u8>> {
        let is_heeded = !self.is_gone(agent) || self.stage.world().keeps_controls_of_lost_nodes();
        let seat = self.seats.get_mut(&agent)?;
        let control = seat.control.take().filter(|_| is_heeded)?;
        seat.flown += 1;
        Some(control)
    }

    fn record_late(&mut self, agent: EntityId) {
        let Some(seat) = self.seats.get_mut(&agent) else { return };
        let (who, cycle) = (self.stage.agent_label(agent), self.stage.cycle());
        let talk = &*seat.status.doing;
        tracing::info!(agent, who, cycle, talk, "a control is late");
        seat.late += 1;
        self.tally.late_controls += 1;
    }

    /// Lets the world go on.
    ///
    /// # Errors
    /// When it cannot.
    pub(super) fn advance(&mut self) -> Result<(), FleetError> {
        let began = Instant::now();
        let cycle = self.stage.cycle();
        let absurd = self.stage.advance()?;
        self.record_invalid(absurd);
        self.tally.advanced.record(began.elapsed());
        // A node may report on a cycle until it hears of the next one.
        let past = self.packets.extract_if(.., |(_, packet)| packet.cycle < cycle).collect();
        self.attendant.on_packets(past);
        Ok(())
    }

    fn record_invalid(&mut self, absurd: Vec<InvalidControl>) {
        for InvalidControl { agent, reason } in absurd {
            let (who, cycle) = (self.stage.agent_label(agent), self.stage.cycle());
            tracing::warn!(agent, who, cycle, reason, "an absurd control");
            self.tally.absurd_controls += 1;
            if let Some(seat) = self.seats.get_mut(&agent) {
                seat.absurd += 1;
                seat.flown -= 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hosted_run::HostedRun;
    use crate::messenger::Messenger;
    use crate::protocol::{ClockMode, Incarnation, Member, Topology, Welcome};
    use crate::server::{FleetView, ServerConfig, ServerHooks};
    use crate::wire::memory::MemoryHub;
    use crate::worlds::distributed_world;
    use sidestep::scenario::Source;
    use sidestep::worlds::WORLDS;
    use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
    use std::time::Duration;

    const CHAIN: &str = "format = 1\nworld = \"chain\"\nseed = 1\ncycles = 9\n[chain]\ndt_s = 0.05\n\
        self_collision = false\nbacktracks = 0\nescape = \"off\"\ndeployment = \"team\"\n\
        [[chains]]\nconnectors = 3\nat_m = [0, 0]\nrod_m = [0.3, 0.35]\n\
        [[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-3, -3], [4, 3]]\npatience_s = 100\n";

    const AIRPLANES: &str = "format = 1\nworld = \"airspace\"\nseed = 1\ncycles = 9\n[airspace]\n\
        deployment = \"compact-team\"\nmax_rounds = 20\n[airspace.generator]\nkind = \"superconflict\"\n\
        n = 3\nradius_m = 1500.0\n";

    struct Nobody;

    impl ServerHooks for Nobody {
        fn on_poll(&mut self, _: &FleetView<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
            Ok(Vec::new())
        }
    }

    fn stage(text: &str) -> HostedRun {
        let source = Source::new("s.toml", text, "");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        let world = distributed_world(compiled.as_ref(), &source).expect("agents of their own");
        let keep = OutputPaths::default();
        let journey =
            ManagedRun::start(compiled.as_ref(), &source, 1, keep, None).expect("started");
        HostedRun::new(journey, world, &NoWatcher)
    }

    fn terms() -> ServerConfig {
        let (clock, topology, overrides) = (ClockMode::Lockstep, Topology::Star, Vec::new());
        ServerConfig {
            scenario: String::new(),
            build: "test".into(),
            welcome: Welcome { clock, topology, overrides, logs_packets: false },
            lease: Duration::from_secs(60),
            has_faults: false,
        }
    }

    /// Returns the decisions of agents with these percepts that hear each other completely.
    fn decided(stage: &HostedRun, sights: &[AgentPercept]) -> Controls {
        let program = |sight: &AgentPercept| {
            let mut program = stage.world().program(sight.agent, "test");
            program.start_cycle(sight.begin.cycle, &sight.begin.sight).expect("a percept");
            program
        };
        let mut programs: Vec<_> = sights.iter().map(program).collect();
        let mut tick = 0;
        while !programs.iter().all(|program| program.is_done()) {
            tick += 1;
            assert!(tick < 10_000, "they never come to an end");
            for from in 0..programs.len() {
                for packet in programs[from].take_packets() {
                    for &to in &*packet.to {
                        programs[to as usize].on_packet(from as EntityId, &packet.payload, tick);
                    }
                }
            }
        }
        let agents = sights.iter().map(|sight| sight.agent);
        agents.zip(programs.iter().map(|program| program.control().expect("it is done"))).collect()
    }

    /// Makes a cycle in which all have decided before the node of agent 1 is lost. Returns the numbers of controls
    /// flown and not flown for each agent.
    fn with_a_loss(stage: &mut HostedRun) -> Vec<(u64, u64)> {
        let sights = stage.percepts();
        let controls = decided(stage, &sights);
        let mut nobody = Nobody;
        let mail = Messenger::new(Peer::Server, Box::new(MemoryHub::default().wire(Peer::Server)));
        let mut server = Server::new(mail, stage, &mut nobody, terms());
        server.has_begun = true;
        for agent in 0..3 {
            let member = Member { agent, life: Incarnation(1), listens: Vec::new() };
            server.seats.get_mut(&agent).expect("a seat").assign(member, 0);
        }
        let groups = server.send_percepts();
        for (agent, control) in controls {
            server.on_control(agent, Control { cycle: 0, control });
        }
        let _ = server.mark_lost(1, "it was killed".into());
        server.accept_controls(&groups);
        server.advance().expect("the world goes on");
        server.seats.values().map(|seat| (seat.flown, seat.late)).collect()
    }

    #[test]
    fn a_connector_that_is_lost_after_it_has_decided_is_not_flown_and_its_chain_stands() {
        let mut stage = stage(CHAIN);
        assert_eq!(with_a_loss(&mut stage), [(1, 0), (0, 1), (1, 0)]);
        assert_eq!(stage.run().metrics()["stood"], 1, "{}", stage.run().metrics());
    }

    #[test]
    fn what_an_airplane_has_decided_is_flown_although_its_node_is_lost_then() {
        let mut stage = stage(AIRPLANES);
        assert_eq!(with_a_loss(&mut stage), [(1, 0), (1, 0), (1, 0)]);
        assert_eq!(stage.run().metrics()["optimizations"], 1, "{}", stage.run().metrics());
    }
}
