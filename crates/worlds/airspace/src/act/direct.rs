//! One process that decides for all airplanes of a group.

use crate::avoid::NonCooperativeAvoidance;
use crate::decide::{
    DecisionStrategy, ManeuverCandidates, candidates_alone, candidates_by_choice,
    candidates_by_velocity, decide_centrally,
};
use crate::events::{Event, EventKind};
use crate::flight::KnownAircraft;
use crate::non_cooperative::NonCooperative;
use crate::pilot::{Control, Maneuver, Memory, OptimizerStats, OwnshipState};
use crate::scratch::PhaseContext;
use crate::shield::{PlanCertainty, ShieldedAircraft, TurnProfile, filter};
use crate::world::AirspaceWorld;
use sidestep_kernel::Slot;

/// Decides for the airplanes of a group. Returns the control of each, and the ways that it has considered.
pub(super) fn decide(
    turn: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    intruders: &[NonCooperative],
) -> Vec<(Control, ManeuverCandidates)> {
    let (world, clock) = (turn.world, turn.clock);
    let began_ns = clock.thread_cpu_ns();
    let mut all = decide_wishes(turn, own, intruders);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    let courses = match world.shield {
        true => shielded_maneuvers(world, own, intruders, &all),
        false => {
            own.iter().zip(&all).map(|(own, (_, one))| unshielded_maneuver(own, one)).collect()
        }
    };
    all.iter_mut().zip(courses).for_each(|((control, _), course)| control.course = course);
    all
}

/// Returns the wishes of the airplanes of a group, and controls that lack only the course.
fn decide_wishes(
    turn: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    intruders: &[NonCooperative],
) -> Vec<(Control, ManeuverCandidates)> {
    let PhaseContext { world, state, now, .. } = *turn;
    let slots: Vec<Slot> = own.iter().map(|own| own.id).collect();
    let group: Vec<KnownAircraft> = own.iter().map(OwnshipState::known_aircraft).collect();
    let mut memories = state.take_memories(&slots);
    let manner = DecisionStrategy::for_group(world, &group, intruders.len());
    let considered: Vec<ManeuverCandidates> = match manner {
        DecisionStrategy::Independent | DecisionStrategy::GroupTooLarge => own
            .iter()
            .map(|own| candidates_alone(world, own.known_aircraft(), own.wish.as_ref()))
            .collect(),
        DecisionStrategy::Reactive => decide_reactively(world, &group, intruders, &mut memories),
        DecisionStrategy::Joint => {
            let decided = decide_centrally(world, &group, intruders, now);
            let all = group.iter().zip(decided);
            all.map(|(known, decided)| candidates_by_choice(world, *known, decided)).collect()
        }
    };
    let control = |(slot, memory)| Control::stay_on_orbit(slot, now, memory);
    let mut controls: Vec<Control> = slots.into_iter().zip(memories).map(control).collect();
    if manner == DecisionStrategy::Joint {
        for (control, considered) in controls.iter_mut().zip(&considered) {
            control.optimized = Some(OptimizerStats::from_choice(considered.decided.as_ref()));
        }
    }
    if let Some(first) = controls.first_mut().filter(|_| manner == DecisionStrategy::GroupTooLarge)
    {
        let event = Event::new(now, EventKind::GroupTooLarge, first.id);
        first.events.push(event.with_value(own.len() as f64));
    }
    controls.into_iter().zip(considered).collect()
}

/// Returns the wishes of the airplanes of a group by a method that gives them headings.
fn decide_reactively(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    intruders: &[NonCooperative],
    memories: &mut [Memory],
) -> Vec<ManeuverCandidates> {
    let take = |memory: &mut Memory| std::mem::take(&mut memory.resolving);
    let mut resolving: Vec<_> = memories.iter_mut().map(take).collect();
    let considered = candidates_by_velocity(world, group, intruders, &mut resolving);
    memories.iter_mut().zip(resolving).for_each(|(memory, kept)| memory.resolving = kept);
    considered
}

/// Returns the course of an airplane that flies its first wish.
fn unshielded_maneuver(own: &OwnshipState, considered: &ManeuverCandidates) -> Maneuver {
    let way = considered.ways.first().cloned().unwrap_or_default();
    Maneuver::Way { wish: 0, way, side: own.fallback }
}

/// Returns the courses that the shield allows to the airplanes of a group.
fn shielded_maneuvers(
    world: &AirspaceWorld,
    own: &[OwnshipState],
    intruders: &[NonCooperative],
    all: &[(Control, ManeuverCandidates)],
) -> Vec<Maneuver> {
    let flyers: Vec<ShieldedAircraft> =
        own.iter().map(|own| own.shielded_aircraft(world)).collect();
    let dtau_s = world.timing.dtau_s;
    let allowed = |((own, flyer), (_, one)): (
        (&OwnshipState, &ShieldedAircraft),
        &(Control, ManeuverCandidates),
    )| {
        NonCooperativeAvoidance::new(flyer, intruders, dtau_s)
            .allowed_profiles(&one.ways, || own.orbit_profile(world))
    };
    let allowed: Vec<Vec<usize>> = own.iter().zip(&flyers).zip(all).map(allowed).collect();
    let candidates = |(allowed, (_, one)): (&Vec<usize>, &(Control, ManeuverCandidates))| {
        allowed.iter().map(|&k| one.ways[k].clone()).collect()
    };
    let candidates: Vec<Vec<TurnProfile>> = allowed.iter().zip(all).map(candidates).collect();
    let steps = world.timing.points_per_dt();
    let decisions = filter(&flyers, &candidates, steps, dtau_s, PlanCertainty::Sure);
    let decided = decisions.into_iter().zip(&allowed).zip(all);
    decided
        .map(|((decision, allowed), (_, one))| Maneuver::from_decision(decision, &allowed, one))
        .collect()
}
