//! The pilots of a group, on a network in memory.

use crate::decide::ManeuverCandidates;
use crate::join::CooperativeGroup;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::pilot::{AirplaneControl, CommonPlans, ConversationSchedule, Pilot, PilotMemory};
use crate::purpose;
use crate::scratch::PhaseContext;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::network::{
    AgentLoop, DistanceLookup, FaultInjector, FaultStreams, FaultyTransport, ReplyBatching,
};
use sidestep_kernel::ports::MemoryTransport;
use sidestep_kernel::{Cycle, EntityId, EntitySlot};
use std::sync::Arc;

/// Lets the pilots of a group decide. Returns the control of each, and what it has considered.
pub(crate) fn decide_group(
    context: &mut PhaseContext<'_>,
    flown: &CooperativeGroup,
    non_cooperative: &[NonCooperativeAircraft],
) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    let PhaseContext { world, state, now, clock, .. } = *context;
    let start_ns = clock.thread_cpu_ns();
    let schedule = ConversationSchedule::for_cycle(now, world.conversation_windows());
    let percepts = flown.percepts(context, non_cooperative);
    let conversations = world.scheduled_conversation_times(now, schedule);
    let mut network = conversation_network(world, state, &conversations);
    let mut pilots = pilots(world, &flown.ids, state.take_memories(&flown.ids));
    let plans = CommonPlans::default();
    for (pilot, percept) in pilots.iter_mut().zip(percepts) {
        pilot.share_common_plans(&plans);
        pilot.start_with_schedule(percept, schedule);
    }
    network.run(&mut pilots, schedule.begins, Pilot::has_decided);
    context.scratch.decide_ns += clock.thread_cpu_ns() - start_ns;
    network.run(&mut pilots, schedule.begins, Pilot::is_done);
    pilot_outcomes_or_fallbacks(pilots)
}

/// Returns the outcome of the conversations of a group. Where one waits for a message that never comes, all stay on
/// their orbits, because plans that are sure are safe only if all fly them.
fn pilot_outcomes_or_fallbacks(pilots: Vec<Pilot>) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    if pilots.iter().all(Pilot::is_done) {
        let outcomes = pilots.into_iter().map(Pilot::into_outcome);
        outcomes.map(|outcome| outcome.expect("it has come to an end")).collect()
    } else {
        pilots.into_iter().map(Pilot::into_fallback).collect()
    }
}

/// Runs the conversations of pilots that have begun a cycle until all have ended.
#[cfg(test)]
pub(crate) fn run_pilot_conversations(
    world: &AirspaceWorld,
    state: &AirspaceState,
    (now, schedule): (Cycle, ConversationSchedule),
    pilots: &mut [Pilot],
) {
    let conversations = world.scheduled_conversation_times(now, schedule);
    conversation_network(world, state, &conversations).run(pilots, schedule.begins, Pilot::is_done);
}

/// Returns the network of the conversations of a cycle.
fn conversation_network<'a>(
    world: &'a AirspaceWorld,
    state: &'a AirspaceState,
    conversations: &'a [(u64, f64)],
) -> AgentLoop<FaultyTransport<'a, MemoryTransport>> {
    let transport = FaultyTransport::in_memory(
        world.network.as_ref(),
        world.fault_streams(),
        Some(state),
        conversations,
    );
    AgentLoop { transport, replies: ReplyBatching::PerPacket, max_flight_ticks: None }
}

impl DistanceLookup for AirspaceState {
    fn distance_m(&self, link: [EntityId; 2]) -> f64 {
        AirspaceState::distance_m(self, link)
    }
}

impl AirspaceWorld {
    /// Returns the first tick of each conversation of a cycle, and its time in seconds after the start of the run: the
    /// first conversation starts with the cycle, and the shield's exchange when that has to be over.
    fn scheduled_conversation_times(
        &self,
        now: Cycle,
        schedule: ConversationSchedule,
    ) -> [(u64, f64); 2] {
        let starts_s = self.cycle_start_s(now);
        let deadline_s = self.network.as_ref().map_or(0.0, |network| network.deadline_s);
        let exchange_s = starts_s + deadline_s * self.decision_fraction();
        [(schedule.begins, starts_s), (schedule.shield_from, exchange_s)]
    }

    /// Returns the faults of the packets that an airplane sends where each is flown by a process of its own; none
    /// where the network is reliable.
    pub fn fault_injector(&self) -> Option<FaultInjector> {
        Some(FaultInjector::new(self.network.clone()?, self.fault_streams()))
    }

    /// Returns the first tick of each conversation of a cycle, and its time in seconds after the start of the run.
    pub fn conversation_times(&self, now: Cycle) -> [(u64, f64); 2] {
        self.scheduled_conversation_times(
            now,
            ConversationSchedule::for_cycle(now, self.conversation_windows()),
        )
    }

    /// Returns the streams and purposes from which faults are drawn.
    fn fault_streams(&self) -> FaultStreams {
        purpose::network_fault_streams(self.streams)
    }
}

fn pilots(world: &AirspaceWorld, flown: &[EntitySlot], memories: Vec<PilotMemory>) -> Vec<Pilot> {
    // Nearly all of a world is shared by its copies.
    let world = Arc::new(world.clone());
    flown
        .iter()
        .zip(memories)
        .map(|(&slot, memory)| Pilot::with_memory(world.clone(), slot, memory))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::EventKind;
    use crate::pilot::{Maneuver, Percept};
    use crate::{AirspaceRun, RemotePilotRun, airspace_run};
    use sidestep_scenario::Source;

    /// Returns the pilots of a group that looks for itself; the first one is of another build, and no other takes it
    /// in.
    fn begun(run: &AirspaceRun) -> Vec<Pilot> {
        let world = run.world();
        let pilot = |percept: Percept| {
            let build = if percept.own.id == 0 { "another" } else { "this" };
            let pilot = Pilot::new(world.clone(), percept.own.id, Default::default());
            let mut pilot = pilot.with_build_id(build);
            pilot.start_with_schedule(percept, ConversationSchedule::for_cycle(0, None));
            pilot
        };
        run.percepts().into_iter().map(pilot).collect()
    }

    #[test]
    fn a_group_in_which_one_waits_for_ever_stays_on_its_orbits() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\ndeployment = \"team\"\ngroups = \"heard\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 3000.0\n";
        let run = airspace_run(&Source::new("g", text, ""), 1).expect("a scenario");
        let mut pilots = begun(&run);
        run_pilot_conversations(
            run.world(),
            run.state(),
            (0, ConversationSchedule::for_cycle(0, None)),
            &mut pilots,
        );
        assert!(pilots.iter().all(|pilot| !pilot.is_done()));
        for (control, _) in pilot_outcomes_or_fallbacks(pilots) {
            assert_eq!(control.maneuver, Maneuver::Orbit);
            let kinds: Vec<EventKind> = control.events.iter().map(|event| event.kind).collect();
            assert_eq!(kinds, [EventKind::Deadline]);
        }
    }
}
