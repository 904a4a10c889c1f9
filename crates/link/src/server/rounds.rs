//! Rounds of a cycle: percepts go out to the agents that decide next, and controls come in; after the last round the
//! world advances.

use super::{FleetError, FleetServer};
use crate::agent::{AgentPercept, InvalidControl, SerializedControls};
use crate::protocol::{Control, Message};
use crate::wire::PeerId;
use sidestep::kernel::EntityId;
use std::time::Instant;

/// The agents that decide together.
pub(super) type DecisionGroup = Vec<EntityId>;

impl FleetServer<'_> {
    /// Sends each agent that decides next its percept; returns the groups of agents that decide together.
    pub(super) fn send_percepts(&mut self) -> Vec<DecisionGroup> {
        self.nodes.values_mut().for_each(|node| node.control = None);
        let mut groups = Vec::new();
        for AgentPercept { agent, group, start } in self.run.percepts() {
            // A lost node that returns needs the next percept, and none of those that it has missed.
            if !self.has_no_node(agent) {
                self.messenger.send_reliable(PeerId::Node(agent), Message::CycleStart(start));
            }
            // Each member has the whole group: it is taken from the first one.
            if group.first() == Some(&agent) {
                groups.push(group);
            }
        }
        groups
    }

    pub(super) fn on_control(&mut self, agent: EntityId, Control { cycle, control }: Control) {
        let Some(node) = self.nodes.get_mut(&agent) else { return };
        // A late control of an earlier cycle must not be carried out in this one.
        if cycle == self.run.cycle() {
            node.control = Some(control);
        }
    }

    /// Returns whether an agent has sent its control of the present round.
    pub(super) fn has_control(&self, agent: EntityId) -> bool {
        self.nodes.get(&agent).is_some_and(|node| node.control.is_some())
    }

    /// Hands the world the controls that have arrived, and counts those that have not.
    pub(super) fn accept_controls(&mut self, groups: &[DecisionGroup]) {
        let mut controls = SerializedControls::new();
        let mut lost = Vec::new();
        for &agent in groups.iter().flatten() {
            if self.has_no_node(agent) {
                lost.push(agent);
            }
            match self.take_control(agent) {
                Some(control) => controls.push((agent, control)),
                None => self.record_late(agent),
            }
        }
        let invalid = self.run.accept_controls(groups, controls, &lost);
        self.record_invalid(invalid);
    }

    /// Takes the control of an agent, if there is one that counts.
    fn take_control(&mut self, agent: EntityId) -> Option<Vec<u8>> {
        let counts =
            !self.has_no_node(agent) || self.run.world().accepts_controls_from_lost_nodes();
        let node = self.nodes.get_mut(&agent)?;
        let control = node.control.take().filter(|_| counts)?;
        node.carried_out += 1;
        Some(control)
    }

    fn record_late(&mut self, agent: EntityId) {
        let Some(node) = self.nodes.get_mut(&agent) else { return };
        let who = self.run.agent_display_name(agent);
        let cycle = self.run.cycle();
        tracing::info!(agent, who, cycle, talk = &*node.status.activity, "a control is late");
        node.late += 1;
        self.metrics.late_controls += 1;
    }

    /// Advances the world by one cycle.
    ///
    /// # Errors
    /// When it cannot.
    pub(super) fn advance(&mut self) -> Result<(), FleetError> {
        let started = Instant::now();
        let cycle = self.run.cycle();
        let invalid = self.run.advance()?;
        self.record_invalid(invalid);
        self.metrics.advance_time.record(started.elapsed());
        // Packets of the present cycle wait: a node may send more of them until it hears of the next one.
        let complete = self.packets.extract_if(.., |(_, packet)| packet.cycle < cycle).collect();
        self.hooks.on_packets(complete);
        Ok(())
    }

    /// Counts controls that [`FleetServer::take_control`] has counted as carried out, and were not.
    fn record_invalid(&mut self, invalid: Vec<InvalidControl>) {
        for InvalidControl { agent, reason } in invalid {
            let who = self.run.agent_display_name(agent);
            let cycle = self.run.cycle();
            tracing::warn!(agent, who, cycle, reason, "an invalid control");
            self.metrics.invalid_controls += 1;
            if let Some(node) = self.nodes.get_mut(&agent) {
                node.invalid += 1;
                node.carried_out -= 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hosted_run::HostedRun;
    use crate::messenger::Messenger;
    use crate::protocol::{ClockMode, FleetMember, Incarnation, Topology, Welcome};
    use crate::server::{FleetContext, ServerConfig, ServerHooks};
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

    struct NoHooks;

    impl ServerHooks for NoHooks {
        fn on_poll(&mut self, _: &FleetContext<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
            Ok(Vec::new())
        }
    }

    fn hosted_run(text: &str) -> HostedRun {
        let source = Source::new("s.toml", text, "");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        let world = distributed_world(compiled.as_ref(), &source).expect("agents of their own");
        let paths = OutputPaths::default();
        let run =
            ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths).expect("started");
        HostedRun::new(run, world, &NoWatcher)
    }

    fn config() -> ServerConfig {
        ServerConfig {
            scenario: String::new(),
            build: "test".into(),
            welcome: Welcome {
                clock: ClockMode::Lockstep,
                topology: Topology::Star,
                multicast_group: None,
                overrides: Vec::new(),
                logs_packets: false,
            },
            lease: Duration::from_secs(60),
            has_faults: false,
        }
    }

    /// Returns the decisions of agents with these percepts that hear each other completely.
    fn decide(run: &HostedRun, percepts: &[AgentPercept]) -> SerializedControls {
        let program = |percept: &AgentPercept| {
            let mut program = run.world().program(percept.agent, "test");
            program.start_cycle(percept.start.cycle, &percept.start.percept).expect("a percept");
            program
        };
        let mut programs: Vec<_> = percepts.iter().map(program).collect();
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
        let agents = percepts.iter().map(|percept| percept.agent);
        agents.zip(programs.iter().map(|program| program.control().expect("it is done"))).collect()
    }

    /// Runs a cycle in which all have decided before the node of agent 1 is lost. Returns the numbers of controls
    /// carried out and not carried out for each agent.
    fn run_with_a_loss(run: &mut HostedRun) -> Vec<(u64, u64)> {
        let percepts = run.percepts();
        let controls = decide(run, &percepts);
        let mut hooks = NoHooks;
        let messenger = Messenger::new(
            PeerId::Server,
            Box::new(MemoryHub::default().open_wire(PeerId::Server)),
        );
        let mut server = FleetServer::new(messenger, run, &mut hooks, config());
        server.has_begun = true;
        for agent in 0..3 {
            let member = FleetMember {
                agent,
                incarnation: Incarnation(1),
                listens: Vec::new(),
                session: None,
            };
            server.nodes.get_mut(&agent).expect("an entry").record_join(member, 0);
        }
        let groups = server.send_percepts();
        for (agent, control) in controls {
            server.on_control(agent, Control { cycle: 0, control });
        }
        let _ = server.mark_lost(1, "it was killed".into());
        server.accept_controls(&groups);
        server.advance().expect("the world advances");
        server.nodes.values().map(|node| (node.carried_out, node.late)).collect()
    }

    #[test]
    fn the_control_of_a_connector_lost_after_its_decision_does_not_count_and_its_chain_stands() {
        let mut run = hosted_run(CHAIN);
        assert_eq!(run_with_a_loss(&mut run), [(1, 0), (0, 1), (1, 0)]);
        assert_eq!(run.simulation().metrics()["stood"], 1, "{}", run.simulation().metrics());
    }

    #[test]
    fn the_control_of_an_airplane_lost_after_its_decision_is_flown() {
        let mut run = hosted_run(AIRPLANES);
        assert_eq!(run_with_a_loss(&mut run), [(1, 0), (1, 0), (1, 0)]);
        assert_eq!(
            run.simulation().metrics()["optimizations"],
            1,
            "{}",
            run.simulation().metrics()
        );
    }
}
