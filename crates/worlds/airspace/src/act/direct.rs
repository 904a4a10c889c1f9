//! One process that decides for all airplanes of a group.

use crate::Turn;
use crate::avoid::Beset;
use crate::decide::{Considered, Manner, alone, as_decided, by_velocity, direct};
use crate::events::{Event, EventKind};
use crate::flight::Known;
use crate::intruder::Intruder;
use crate::pilot::{Control, Course, Memory, Optimized, Own};
use crate::shield::{Certainty, Flyer, Way, filter};
use crate::world::AirspaceWorld;
use sidestep_kernel::Slot;

/// Decides for the airplanes of a group. Returns the control of each, and the ways that it has considered.
pub(super) fn decided(
    turn: &mut Turn<'_>,
    own: &[Own],
    intruders: &[Intruder],
) -> Vec<(Control, Considered)> {
    let (world, clock) = (turn.world, turn.clock);
    let began_ns = clock.thread_cpu_ns();
    let mut all = wanted(turn, own, intruders);
    turn.scratch.decide_ns += clock.thread_cpu_ns() - began_ns;
    let courses = match world.shield {
        true => shielded(world, own, intruders, &all),
        false => own.iter().zip(&all).map(|(own, (_, one))| unshielded(own, one)).collect(),
    };
    all.iter_mut().zip(courses).for_each(|((control, _), course)| control.course = course);
    all
}

/// Returns the wishes of the airplanes of a group, and controls that lack only the course.
fn wanted(turn: &mut Turn<'_>, own: &[Own], intruders: &[Intruder]) -> Vec<(Control, Considered)> {
    let Turn { world, state, now, .. } = *turn;
    let slots: Vec<Slot> = own.iter().map(|own| own.id).collect();
    let group: Vec<Known> = own.iter().map(Own::known).collect();
    let mut memories = state.take_memories(&slots);
    let manner = Manner::of(world, &group, intruders.len());
    let considered: Vec<Considered> = match manner {
        Manner::Alone | Manner::TooMany => {
            own.iter().map(|own| alone(world, own.known(), own.wish.as_ref())).collect()
        }
        Manner::Reacting => reacting(world, &group, intruders, &mut memories),
        Manner::Optimizing => {
            let decided = direct(world, &group, intruders, now);
            let all = group.iter().zip(decided);
            all.map(|(known, decided)| as_decided(world, *known, decided)).collect()
        }
    };
    let control = |(slot, memory)| Control::orbit(slot, now, memory);
    let mut controls: Vec<Control> = slots.into_iter().zip(memories).map(control).collect();
    if manner == Manner::Optimizing {
        for (control, considered) in controls.iter_mut().zip(&considered) {
            control.optimized = Some(Optimized::of(considered.decided.as_ref()));
        }
    }
    if let Some(first) = controls.first_mut().filter(|_| manner == Manner::TooMany) {
        let event = Event::of(now, EventKind::GroupTooLarge, first.id);
        first.events.push(event.with(own.len() as f64));
    }
    controls.into_iter().zip(considered).collect()
}

/// Returns the wishes of the airplanes of a group by a method that gives them headings.
fn reacting(
    world: &AirspaceWorld,
    group: &[Known],
    intruders: &[Intruder],
    memories: &mut [Memory],
) -> Vec<Considered> {
    let take = |memory: &mut Memory| std::mem::take(&mut memory.resolving);
    let mut resolving: Vec<_> = memories.iter_mut().map(take).collect();
    let considered = by_velocity(world, group, intruders, &mut resolving);
    memories.iter_mut().zip(resolving).for_each(|(memory, kept)| memory.resolving = kept);
    considered
}

/// Returns the course of an airplane that flies its first wish.
fn unshielded(own: &Own, considered: &Considered) -> Course {
    let way = considered.ways.first().cloned().unwrap_or_default();
    Course::Way { wish: 0, way, side: own.fallback }
}

/// Returns the courses that the shield allows to the airplanes of a group.
fn shielded(
    world: &AirspaceWorld,
    own: &[Own],
    intruders: &[Intruder],
    all: &[(Control, Considered)],
) -> Vec<Course> {
    let flyers: Vec<Flyer> = own.iter().map(|own| own.flyer(world)).collect();
    let dtau_s = world.timing.dtau_s;
    let allowed = |((own, flyer), (_, one)): ((&Own, &Flyer), &(Control, Considered))| {
        Beset::new(flyer, intruders, dtau_s).allowed(&one.ways, || own.on_orbit(world))
    };
    let allowed: Vec<Vec<usize>> = own.iter().zip(&flyers).zip(all).map(allowed).collect();
    let candidates = |(allowed, (_, one)): (&Vec<usize>, &(Control, Considered))| {
        allowed.iter().map(|&k| one.ways[k].clone()).collect()
    };
    let candidates: Vec<Vec<Way>> = allowed.iter().zip(all).map(candidates).collect();
    let steps = world.timing.points_per_dt();
    let decisions = filter(&flyers, &candidates, steps, dtau_s, Certainty::Sure);
    let decided = decisions.into_iter().zip(&allowed).zip(all);
    decided.map(|((decision, allowed), (_, one))| one.course(decision, allowed)).collect()
}
