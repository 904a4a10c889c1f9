//! Candidates that a caller has ordered.

use super::ManeuverCandidates;
use super::preferences::rank_straight_first;
use super::velocity::{rank_by_similarity, step};
use crate::external_action::ExternalAction;
use crate::flight::KnownAircraft;
use crate::method::Steering;
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;
use sidestep_kernel::math;

/// Returns the candidates of an airplane: the ordered one, and then the others by rank, or by how little they
/// differ from it. Without an order it follows its flight plan.
pub(super) fn candidates_for_external_action(
    world: &AirspaceWorld,
    known: KnownAircraft,
    external_action: Option<&ExternalAction>,
) -> ManeuverCandidates {
    match external_action {
        Some(&ExternalAction::TurnRate(omega_rad_s)) => {
            // Its bank may allow less at the speed that it has by now than at its start.
            let max_rad_s = world.known_segment(known).model.omega_max_rad_s;
            let omega_rad_s = omega_rad_s.clamp(-max_rad_s, max_rad_s);
            let omegas_rad_s = vec![omega_rad_s; world.timing.points_per_dt()];
            ManeuverCandidates::from_profiles(rank_by_similarity(
                world,
                known,
                TurnProfile { omegas_rad_s },
            ))
        }
        Some(&ExternalAction::Velocity([vx, vy])) => {
            let profile = turn_profile_toward(world, known, math::atan2(vy, vx));
            ManeuverCandidates::from_profiles(rank_by_similarity(world, known, profile))
        }
        Some(ExternalAction::Ranking(order)) => {
            let actions = world.present_actions(known);
            let ranked = order.iter().map(|&k| actions[usize::from(k)]).collect();
            ManeuverCandidates::from_actions(world, known, ranked)
        }
        None => ManeuverCandidates::from_actions(world, known, rank_straight_first(world, known)),
    }
}

/// Returns the turn profile of one `dt` with which an airplane turns to a heading as fast as it can.
fn turn_profile_toward(
    world: &AirspaceWorld,
    mut known: KnownAircraft,
    heading_rad: f64,
) -> TurnProfile {
    let steps = 0..world.timing.points_per_dt();
    TurnProfile {
        omegas_rad_s: steps
            .map(|_| step(world, &mut known, Steering::Heading(heading_rad)))
            .collect(),
    }
}
