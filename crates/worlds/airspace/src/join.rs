//! Groups: airplanes that have to avoid each other decide together.

use super::flight::{FlightLevelRange, FlightTask};
use super::non_cooperative::NonCooperativeAircraft;
use super::perceive::{claim, ownship_state, surveillance_report};
use super::pilot::{Percept, SurveillanceReport};
use super::scratch::PhaseContext;
use super::settings::Grouping;
use super::state::AirplaneCommand;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::conflict::ConflictGroups;
use std::ops::Range;

/// The airplanes of a group that the method flies, and which of the group are near each other.
#[derive(Debug, Default)]
pub(super) struct CooperativeGroup {
    /// Their ids, rising.
    pub(super) ids: Vec<EntitySlot>,
    /// Slots near each airplane, rising, itself and non-cooperative ones among them; empty where groups are announced,
    /// and all see all.
    near: Vec<Vec<EntitySlot>>,
}

impl CooperativeGroup {
    /// Returns the airplanes of a group that the method flies; `group` are all in the air, by id.
    pub(super) fn from_group(context: &PhaseContext<'_>, group: &[EntitySlot]) -> Self {
        let PhaseContext { world, now, .. } = *context;
        let ids: Vec<EntitySlot> =
            group.iter().copied().filter(|&slot| !world.is_non_cooperative(slot, now)).collect();
        let near = match world.groups {
            Grouping::Announced => Vec::new(),
            Grouping::Heard => ids.iter().map(|&slot| nearby(context, group, slot)).collect(),
        };
        Self { ids, near }
    }

    /// Returns the percept of each of them; `non_cooperative` are the others of the group.
    pub(super) fn percepts(
        &self,
        context: &PhaseContext<'_>,
        non_cooperative: &[NonCooperativeAircraft],
    ) -> Vec<Percept> {
        let group: Vec<SurveillanceReport> =
            self.ids.iter().map(|&slot| surveillance_report(context, slot)).collect();
        self.ids
            .iter()
            .enumerate()
            .map(|(k, &slot)| Percept {
                cycle: context.now,
                own: ownship_state(context, slot),
                group: group.iter().filter(|one| self.can_see(k, one.id)).copied().collect(),
                non_cooperative: non_cooperative
                    .iter()
                    .filter(|one| self.can_see(k, one.slot))
                    .cloned()
                    .collect(),
                exempt_pairs: self.exempt_pairs(context),
            })
            .collect()
    }

    /// Returns the exempt pairs among them, where all see all.
    fn exempt_pairs(&self, context: &PhaseContext<'_>) -> Vec<[EntitySlot; 2]> {
        if !context.world.has_common_plans() {
            return Vec::new();
        }
        let mut pairs = Vec::new();
        for &a in &self.ids {
            let exempt = context.state.exempt_ids(a);
            pairs.extend(exempt.iter().filter(|&&b| a < b).map(|&b| [a, b]));
        }
        pairs
    }

    /// Returns whether the `k`-th of them sees another airplane of the group.
    fn can_see(&self, k: usize, other: EntitySlot) -> bool {
        self.near.get(k).is_none_or(|near| near.binary_search(&other).is_ok())
    }
}

/// Returns those of a group that are near an airplane, itself among them, by id. An airplane near the same
/// non-cooperative one is near, too: it has to expect the maneuver by which the other avoids that one.
fn nearby(context: &PhaseContext<'_>, group: &[EntitySlot], own: EntitySlot) -> Vec<EntitySlot> {
    let PhaseContext { world, now, .. } = *context;
    let mut near = vec![own];
    let mut due = vec![own];
    while let Some(from) = due.pop() {
        for &other in group.iter().filter(|&&other| have_to_avoid_each_other(context, from, other))
        {
            if !near.contains(&other) {
                near.push(other);
                if world.is_non_cooperative(other, now) {
                    due.push(other);
                }
            }
        }
    }
    near.sort_unstable();
    near
}

/// Starts a cycle for all: returns the groups that airplanes form in it.
pub(super) fn form_groups(context: &mut PhaseContext<'_>) -> ConflictGroups {
    let n = context.world.airplanes.len();
    let groups = ConflictGroups::new(n);
    claim(context, 0..n);
    join(context, 0..n, &groups);
    groups
}

/// Joins each of `bodies` with those before it that it has to avoid.
pub(super) fn join(context: &mut PhaseContext<'_>, bodies: Range<usize>, groups: &ConflictGroups) {
    let PhaseContext { world, state, now, .. } = *context;
    for slot in bodies.map(|slot| slot as EntitySlot) {
        if !state.is_active(world, slot, now) {
            continue;
        }
        let at = state.airplanes[slot as usize].pose().at;
        state.neighborhood.for_each_near(at, now, |other| {
            if other < slot && have_to_avoid_each_other(context, slot, other) {
                groups.join_groups(slot, other);
            }
        });
    }
}

/// Returns whether two airplanes have to avoid each other.
pub(super) fn have_to_avoid_each_other(
    context: &PhaseContext<'_>,
    a: EntitySlot,
    b: EntitySlot,
) -> bool {
    let PhaseContext { world, state, .. } = context;
    let at_a = state.airplanes[a as usize].pose().at;
    let at_b = state.airplanes[b as usize].pose().at;
    world.surface.is_within(at_a, at_b, world.interaction_range_m(a as usize, b as usize))
        && levels(context, a).overlaps(&levels(context, b), world.vertical_m)
}

/// Returns all levels that an airplane is on, or has been ordered to change to by now.
fn levels(context: &PhaseContext<'_>, slot: EntitySlot) -> FlightLevelRange {
    let PhaseContext { world, state, now, .. } = context;
    if world.is_replayed(slot, *now) {
        return FlightLevelRange::ALL;
    }
    let current = &state.airplanes[slot as usize];
    let done = current.orders.get();
    let mut levels = FlightLevelRange::between(
        current.altitude_m.get(),
        world.segment(slot, done.into()).altitude_m,
    );
    if state.has_commands() {
        // Commands are carried out in this cycle, or given back.
        let airplane = &world.airplanes[slot as usize];
        let AirplaneCommand { wish, in_force } = state.command(slot);
        for level in [airplane.limited_command(wish).level, in_force.level].into_iter().flatten() {
            levels = levels.extended_by_level(level.altitude_m);
        }
        // What it may choose is of no use if those that are there are not considered.
        let filed_m = world.segment(slot, done.into()).altitude_m;
        for change_m in airplane.changes.levels_m.iter().filter(|_| world.changes.levels) {
            levels = levels.extended_by_level(filed_m + change_m);
        }
    }
    let orders = &world.airplanes[slot as usize].orders;
    let now_s = world.cycle_start_s(*now);
    let due = orders.iter().skip(done.into()).take_while(|order| order.at_s <= now_s);
    for order in due {
        if let FlightTask::Altitude { altitude_m, .. } = order.task {
            levels = levels.extended_by_level(altitude_m);
        }
    }
    levels
}
