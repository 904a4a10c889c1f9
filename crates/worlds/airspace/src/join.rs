//! Groups: airplanes that have to mind each other decide together.

use super::flight::{FlightTask, Levels, distance_m};
use super::non_cooperative::NonCooperative;
use super::perceive::{claim, ownship_state, surveillance_report};
use super::pilot::{Percept, SurveillanceReport};
use super::scratch::PhaseContext;
use super::settings::Grouping;
use sidestep_kernel::Slot;
use sidestep_kernel::conflict::ConflictGroups;
use std::ops::Range;

/// The airplanes of a group that the method flies, and which of the group are near each other.
#[derive(Debug, Default)]
pub(super) struct ControlledGroup {
    /// Their ids, rising.
    pub(super) ids: Vec<Slot>,
    /// Slots near each airplane, itself and those that mind no other among them, rising; empty where groups are
    /// announced, and all see all.
    near: Vec<Vec<Slot>>,
}

impl ControlledGroup {
    /// Returns the airplanes of a group that the method flies; `group` are all in the air, by id.
    pub(super) fn from_group(turn: &PhaseContext<'_>, group: &[Slot]) -> Self {
        let PhaseContext { world, now, .. } = *turn;
        let is_flown = |&slot: &Slot| !world.is_non_cooperative(slot, now);
        let ids: Vec<Slot> = group.iter().copied().filter(is_flown).collect();
        let near = match world.groups {
            Grouping::Announced => Vec::new(),
            Grouping::Heard => ids.iter().map(|&slot| nearby(turn, group, slot)).collect(),
        };
        Self { ids, near }
    }

    /// Returns the percept of each of them; `intruders` are those of the group that are not cooperative.
    pub(super) fn percepts(
        &self,
        turn: &PhaseContext<'_>,
        intruders: &[NonCooperative],
    ) -> Vec<Percept> {
        let group: Vec<SurveillanceReport> =
            self.ids.iter().map(|&slot| surveillance_report(turn, slot)).collect();
        let percept = |(k, &slot): (usize, &Slot)| {
            let is_visible = |id: Slot| self.can_see(k, id);
            Percept {
                cycle: turn.now,
                own: ownship_state(turn, slot),
                group: group.iter().filter(|one| is_visible(one.id)).copied().collect(),
                intruders: intruders.iter().filter(|one| is_visible(one.slot)).cloned().collect(),
            }
        };
        self.ids.iter().enumerate().map(percept).collect()
    }

    /// Returns whether the `k`-th of them sees another airplane of the group.
    fn can_see(&self, k: usize, other: Slot) -> bool {
        self.near.get(k).is_none_or(|near| near.binary_search(&other).is_ok())
    }
}

/// Returns those of a group that are near an airplane, itself among them, by id. An airplane near the same intruder
/// is near, too: it has to mind the maneuver by which the other avoids the intruder.
fn nearby(turn: &PhaseContext<'_>, group: &[Slot], own: Slot) -> Vec<Slot> {
    let PhaseContext { world, now, .. } = *turn;
    let (mut near, mut due) = (vec![own], vec![own]);
    while let Some(from) = due.pop() {
        for &other in group.iter().filter(|&&other| is_near(turn, from, other)) {
            if !near.contains(&other) {
                near.push(other);
                due.extend(world.is_non_cooperative(other, now).then_some(other));
            }
        }
    }
    near.sort_unstable();
    near
}

/// Begins a cycle for all: returns the groups that airplanes form in it.
pub(super) fn groups(turn: &mut PhaseContext<'_>) -> ConflictGroups {
    let (all, groups) =
        (0..turn.world.airplanes.len(), ConflictGroups::new(turn.world.airplanes.len()));
    claim(turn, all.clone());
    join(turn, all, &groups);
    groups
}

/// Joins each of `bodies` with those before it that it has to mind.
pub(super) fn join(turn: &mut PhaseContext<'_>, bodies: Range<usize>, groups: &ConflictGroups) {
    let PhaseContext { world, state, now, .. } = *turn;
    for slot in bodies.map(|slot| slot as Slot) {
        if !state.is_active(world, slot, now) {
            continue;
        }
        let at = state.airplanes[slot as usize].pose().at;
        state.neighborhood.for_each_near(at, now, |other| {
            if other < slot && is_near(turn, slot, other) {
                groups.join(slot, other);
            }
        });
    }
}

/// Returns whether two airplanes have to mind each other.
fn is_near(turn: &PhaseContext<'_>, a: Slot, b: Slot) -> bool {
    let PhaseContext { world, state, .. } = turn;
    let at = |slot: Slot| state.airplanes[slot as usize].pose().at;
    distance_m(at(a), at(b)) <= world.interaction_range_m(a as usize, b as usize)
        && levels(turn, a).overlaps(&levels(turn, b), world.vertical_m)
}

/// Returns all levels that an airplane is on, or has been ordered to change to by now.
fn levels(turn: &PhaseContext<'_>, slot: Slot) -> Levels {
    let PhaseContext { world, state, now, .. } = turn;
    if world.is_replayed(slot, *now) {
        return Levels::ALL;
    }
    let cell = &state.airplanes[slot as usize];
    let done = cell.orders.get();
    let mut levels =
        Levels::between(cell.altitude_m.get(), world.segment(slot, done.into()).altitude_m);
    let orders = &world.airplanes[slot as usize].orders;
    let due = orders.iter().skip(done.into()).take_while(|o| o.at_s <= world.cycle_start_s(*now));
    for order in due {
        if let FlightTask::Altitude { altitude_m, .. } = order.task {
            levels = levels.including(altitude_m);
        }
    }
    levels
}
