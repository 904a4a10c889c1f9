//! Wishes that a caller has ordered.

use super::velocity::{beside, step};
use super::wishes::{straight, ways};
use crate::Turn;
use crate::flight::{Action, Known};
use crate::shield::Way;
use crate::wish::Wish;
use crate::world::AirspaceWorld;
use sidestep_kernel::{Slot, math};

/// Returns the ways that each airplane of a group may fly in the next `dt`: the one that was ordered,
/// and then the others by rank, or by how little they differ from it. The orders are gone after that;
/// an airplane without one follows its flight plan.
pub(super) fn as_ordered(turn: &mut Turn<'_>, group: &[Known]) -> Vec<Vec<Way>> {
    let &mut Turn { world, state, .. } = turn;
    let slots: Vec<Slot> = group.iter().map(|known| known.slot).collect();
    let ordered = state.take_wishes(&slots);
    if let Some(notes) = &mut turn.scratch.notes {
        let own = |wish: &Option<Wish>, known: &Known| ranked(world, *known, wish.as_ref());
        let wishes: Vec<_> =
            ordered.iter().zip(group).map(|(wish, known)| own(wish, known)).collect();
        notes.wishes = notes.own(&wishes).cloned().flatten().unwrap_or_default();
    }
    group.iter().zip(ordered).map(|(known, wish)| wanted(world, *known, wish.as_ref())).collect()
}

fn wanted(world: &AirspaceWorld, known: Known, wish: Option<&Wish>) -> Vec<Way> {
    match wish {
        Some(&Wish::TurnRate(omega_rad_s)) => {
            let omegas_rad_s = vec![omega_rad_s; world.timing.points_per_dt()];
            beside(world, known, Way { omegas_rad_s })
        }
        Some(&Wish::Velocity([vx, vy])) => {
            beside(world, known, toward(world, known, math::atan2(vy, vx)))
        }
        ranking => ways(world, known, &ranked(world, known, ranking).unwrap_or_default()),
    }
}

/// Returns the actions of an airplane in the order in which it is to want them; `None` where a turn
/// was ordered.
fn ranked(world: &AirspaceWorld, known: Known, wish: Option<&Wish>) -> Option<Vec<Action>> {
    let actions = world.actions_of(known.slot);
    match wish {
        None => Some(straight(world, known)),
        Some(Wish::Ranking(order)) => {
            Some(order.iter().map(|&k| actions[usize::from(k)]).collect())
        }
        Some(Wish::TurnRate(_) | Wish::Velocity(_)) => None,
    }
}

/// Returns the way of one `dt` on which an airplane turns to a heading as fast as it can.
fn toward(world: &AirspaceWorld, mut known: Known, heading_rad: f64) -> Way {
    let turn = |_| step(world, &mut known, Some(heading_rad));
    Way { omegas_rad_s: (0..world.timing.points_per_dt()).map(turn).collect() }
}
