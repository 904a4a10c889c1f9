//! The commands of methods, carried out at the start of the cycle after they were given.
//!
//! With the shield they are cleared as orders are. A speed is flown only when the airplane then has a fallback apart from
//! all stored ones; a level is taken up at once, and the way to it cleared in stages (`levels.rs`). So the invariant
//! holds whatever a method commands. Over a network that may lose messages that must be the stored fallback, with which
//! others reckon. What is not cleared the method is told as an override, and the airplane keeps the
//! speed and the level that it has.

use super::orders::fallback_at_speed;
use crate::events::{Event, EventKind};
use crate::flight::CLIMB_M_S;
use crate::flight::{InterOrderSegment, LevelCommand, MethodCommand};
use crate::scratch::PhaseContext;
use crate::state::AirplaneCommand;
use sidestep_kernel::EntitySlot;

/// Lets airplanes that are about to fly a commanded speed keep the present one while orders are executed: of two changes
/// of speed in one cycle only the command's counts.
pub(super) fn hold_speeds(context: &PhaseContext<'_>, group: &[EntitySlot]) {
    let PhaseContext { world, state, .. } = *context;
    if !state.has_commands() {
        return;
    }
    for &slot in group {
        let mut command = state.command(slot);
        if wish(context, slot).v_m_s.is_some() && command.in_force.v_m_s.is_none() {
            command.in_force.v_m_s = Some(state.segment(world, slot).model.v_m_s);
            state.set_command(slot, command);
        }
    }
}

/// Carries out the commands of a group, as far as they are cleared; what a method has given back becomes what is filed.
/// `flown` are the group's airplanes that the method flies, by id.
pub(super) fn carry_out(
    context: &mut PhaseContext<'_>,
    group: &[EntitySlot],
    flown: &[EntitySlot],
) {
    if !context.state.has_commands() {
        return;
    }
    for &slot in group {
        let wish = wish(context, slot);
        let command = context.state.command(slot);
        if wish.is_none() && command.in_force.is_none() {
            continue;
        }
        carry_out_level(context, slot, wish, command);
        carry_out_speed(context, flown, slot, wish);
    }
}

/// Returns the command that the method wishes to be in force in this cycle, within the limits of the airplane.
fn wish(context: &PhaseContext<'_>, slot: EntitySlot) -> MethodCommand {
    let PhaseContext { world, state, now, .. } = *context;
    // Under other rules the method may be another one; and those that avoid nobody fly as filed.
    if world.command_kinds().is_none() || world.is_non_cooperative(slot, now) {
        return MethodCommand::NONE;
    }
    world.airplanes[slot as usize].limited_command(state.command(slot).wish)
}

/// Takes up the commanded level, or goes back to the filed one.
fn carry_out_level(
    context: &PhaseContext<'_>,
    slot: EntitySlot,
    wish: MethodCommand,
    mut command: AirplaneCommand,
) {
    let PhaseContext { world, state, .. } = *context;
    let current = &state.airplanes[slot as usize];
    let filed = world.segment(slot, current.orders.get().into());
    command.in_force.level =
        wish.level.or(level_back(&filed, current.altitude_m.get(), command.in_force.level));
    state.set_command(slot, command);
}

/// Returns the command by which an airplane goes back to its filed level, if it is not there and its flight plan does
/// not lead there: as by an order without a rate, as far as it can fly that. The rate of the command that is given back
/// may be next to nothing.
fn level_back(
    filed: &InterOrderSegment<'_>,
    altitude_m: f64,
    given_back: Option<LevelCommand>,
) -> Option<LevelCommand> {
    let is_led_back = filed.vertical_m_s(altitude_m) > 0.0;
    let is_there = altitude_m == filed.altitude_m;
    given_back
        .filter(|_| !is_there && !is_led_back)
        .map(|_| LevelCommand { altitude_m: filed.altitude_m, vertical_m_s: CLIMB_M_S })
}

/// Changes the speed toward the commanded one, or back to the filed one, by at most as much as the airplane accelerates
/// in a cycle, if that is cleared.
fn carry_out_speed(
    context: &mut PhaseContext<'_>,
    flown: &[EntitySlot],
    slot: EntitySlot,
    wish: MethodCommand,
) {
    let PhaseContext { world, state, now, .. } = *context;
    let airplane = &world.airplanes[slot as usize];
    let current = &state.airplanes[slot as usize];
    let mut command = state.command(slot);
    let Some(present_m_s) = command.in_force.v_m_s else { return };
    let filed = world.segment(slot, current.orders.get().into());
    let goal_m_s = wish.v_m_s.unwrap_or(filed.model.v_m_s);
    let change_m_s = airplane.performance.acceleration_m_s2 * world.timing.dt_s;
    let next_m_s = goal_m_s.clamp(present_m_s - change_m_s, present_m_s + change_m_s);
    let is_filed = next_m_s == filed.model.v_m_s;
    command.in_force.v_m_s = (!is_filed).then_some(next_m_s);
    if next_m_s == present_m_s {
        state.set_command(slot, command);
        return;
    }
    if world.shield && !world.is_non_cooperative(slot, now) {
        let changed = filed.with_command(&command.in_force, &airplane.performance);
        let Some(fallback) = fallback_at_speed(context, flown, slot, &changed.model) else {
            // It keeps its speed, and tries anew in the next cycle.
            context.scratch.events.push(Event::new(now, EventKind::CommandHeld, slot));
            if wish.v_m_s.is_some() {
                state.record_command_override(slot);
            }
            return;
        };
        current.fallback.set(fallback);
    }
    state.set_command(slot, command);
}
