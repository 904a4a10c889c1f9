//! Exits for parts that are caught.
//!
//! A part between two obstacles that close like tongs, or of a chain that others hold taut, can
//! leave only through an obstacle, and the sooner the better. Candidates lead through any obstacle that
//! touches the chain, in some directions. Each is rolled out on the connectors around the contact,
//! with obstacles at constant velocity, and the one with the least time inside is taken.

use super::super::ObstacleEscapeRules;
use super::super::threat::gap_m;
use super::posture::ends;
use super::rollout::{IMPROVEMENT_FACTOR, MIN_BENEFIT_TICKS, Rollout, RolloutOptions};
use super::solve::{EscapeSolver, direction_away};
use super::solve_input::{EscapeSolveInput, ExitDirection};
use serde::{Deserialize, Serialize};
use sidestep_kernel::math::{cos, sin};
use sidestep_rods::geometry::{
    Point, add, add_scaled, convert_dimensions, cross, normalized, perpendicular, scaled,
};
use std::f64::consts::FRAC_PI_6;
use std::ops::RangeInclusive;

/// A chain's plan to leave an obstacle that caught a part of it, and its leader's choice to rest.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EscapePlan {
    passing: Option<ActiveExit>,
    /// Ticks until the next search for an exit.
    pause: u32,
    /// Whether its leader rests.
    rests: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct ActiveExit {
    obstacle: u32,
    toward: [f64; 3],
}

/// Ticks from one choice of an exit to the next: rollouts in every tick would take too long.
const CHOICE_INTERVAL_TICKS: u32 = 4;
/// Gap below which a chain is in danger and an exit is searched for, meters: more than the margin of 0.05 m, so that
/// the search begins while tongs still close. An exit ends at a wider gap, so that it does not end and begin by turns.
const DANGER_DISTANCE_M: f64 = 0.12;
/// Limit on the work of a choice: ticks of rollouts times connectors in them. It suffices for some 25 whole rollouts of 26
/// connectors; most end early.
const MAX_WORK: usize = 100_000;
/// Connectors to either side of those in contact that rollouts include: those farther away hardly move while a part leaves
/// an obstacle.
const SIDE_CONNECTORS: usize = 12;

impl EscapePlan {
    /// Returns whether nothing is remembered.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns whether the chain is leaving through an obstacle.
    pub(super) fn is_exiting(&self) -> bool {
        self.passing.is_some()
    }

    /// Returns whether the chain's leader rests, to keep the chain outside obstacles.
    pub(crate) fn is_resting(&self) -> bool {
        self.rests
    }

    pub(crate) fn set_resting(&mut self, rests: bool) {
        self.rests = rests;
    }

    /// Forgets the exit of a chain with no obstacle near.
    pub(super) fn reset_exit(&mut self) {
        *self = Self { rests: self.rests, ..Self::default() };
    }

    pub(super) fn count_down_pause(&mut self) {
        self.pause = self.pause.saturating_sub(1);
    }

    pub(super) fn exit_direction<const D: usize>(&self) -> Option<ExitDirection<D>> {
        self.passing
            .map(|p| ExitDirection { obstacle: p.obstacle, toward: convert_dimensions(p.toward) })
    }

    /// Ends an exit once no part is near the obstacle.
    pub(super) fn clear_if_passed<const D: usize>(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        solver: &EscapeSolver<D>,
    ) {
        if self.exit_direction().is_some_and(|through| solver.has_passed(input, &through)) {
            self.passing = None;
        }
    }

    /// Searches for the best exit; returns whether it is another than before.
    pub(super) fn plan_exit<const D: usize>(
        &mut self,
        rules: &ObstacleEscapeRules,
        input: &EscapeSolveInput<'_, D>,
        solver: &EscapeSolver<D>,
        gap_m: f64,
    ) -> bool {
        if self.pause > 0 || gap_m > DANGER_DISTANCE_M {
            return false;
        }
        self.pause = CHOICE_INTERVAL_TICKS;
        let around = endangered_connectors(input, solver);
        let Some(rollout) = Rollout::from_connector_range(rules, input, around) else {
            return false;
        };
        let now = self.exit_direction();
        let mut left = rollout.affordable_ticks(MAX_WORK);
        let cost_now = rollout.cost(&RolloutOptions::with_exit(now), f64::INFINITY, &mut left);
        // Another exit must be clearly better, or the chain would alternate between two and leave by neither.
        let mut best = (IMPROVEMENT_FACTOR * cost_now - MIN_BENEFIT_TICKS, now);
        for exit in
            std::iter::once(None).chain(exit_candidates(input, solver).into_iter().map(Some))
        {
            if left == 0 {
                break;
            }
            let cost = rollout.cost(&RolloutOptions::with_exit(exit), best.0, &mut left);
            if cost < best.0 {
                best = (cost, exit);
            }
        }
        self.passing = best.1.map(|exit| ActiveExit {
            obstacle: exit.obstacle,
            toward: convert_dimensions(exit.toward),
        });
        best.1 != now
    }
}

/// Returns the exits through the obstacles that touch the chain.
fn exit_candidates<const D: usize>(
    input: &EscapeSolveInput<'_, D>,
    solver: &EscapeSolver<D>,
) -> Vec<ExitDirection<D>> {
    let mut exits = Vec::new();
    let threats = &solver.contacts.threats;
    for (k, mover) in input.obstacles.moving().iter().enumerate() {
        let near = threats.iter().filter(|t| t.mover == k);
        let gaps = near.map(|t| (gap_m(input.chain, t.part, mover), t.part));
        let Some((gap_m, part)) = gaps.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        // Twice as far as danger begins: an obstacle that is not in contact yet may be the better
        // exit.
        if gap_m < 2.0 * DANGER_DISTANCE_M {
            let nearest = mover.core.nearest_to_segment(ends(input.chain.points(), part));
            let through = scaled(direction_away(mover, &nearest), -1.0);
            let obstacle = mover.id;
            let directions = exit_directions(through, mover.velocity_m_s).into_iter();
            exits.push(directions.map(move |toward| ExitDirection { obstacle, toward }));
        }
    }
    // In turn of each obstacle, because the limit on the work may end the search before the last candidate.
    let mut all = Vec::new();
    while exits.iter().any(|exits| exits.len() > 0) {
        all.extend(exits.iter_mut().filter_map(Iterator::next));
    }
    all
}

/// Returns the directions that are tried: straight through, against the obstacle's velocity, between
/// the two, and around.
fn exit_directions<const D: usize>(through: Point<D>, velocity_m_s: Point<D>) -> Vec<Point<D>> {
    let mut all = vec![through];
    if let Some(against) = normalized(scaled(velocity_m_s, -1.0)) {
        all.push(against);
        all.extend(normalized(add(against, through)));
    }
    let first = perpendicular(through);
    let mut axes = vec![first];
    if D == 3 {
        let normal = cross(through, first);
        axes.extend(normalized(convert_dimensions::<3, D>([normal[0], normal[1], normal[2]])));
    }
    for axis in axes {
        // All around in steps of 30 degrees; straight through is there already.
        for k in 1..12 {
            let turn_rad = f64::from(k) * FRAC_PI_6;
            all.push(add_scaled(scaled(through, cos(turn_rad)), axis, sin(turn_rad)));
        }
    }
    all
}

/// Returns the connectors of the chain around those in danger.
fn endangered_connectors<const D: usize>(
    input: &EscapeSolveInput<'_, D>,
    solver: &EscapeSolver<D>,
) -> RangeInclusive<usize> {
    let EscapeSolveInput { chain, obstacles, .. } = *input;
    let mut from = usize::MAX;
    let mut to = 0;
    for threat in &solver.contacts.threats {
        let mover = &obstacles.moving()[threat.mover];
        if gap_m(chain, threat.part, mover) < 2.0 * DANGER_DISTANCE_M {
            let k = threat.part.connector();
            from = from.min(k);
            to = to.max(k);
        }
    }
    let last = chain.points().len() - 1;
    // The minimum of the two is 0 if no part is in danger.
    from.min(to).saturating_sub(SIDE_CONNECTORS)..=(to + 1 + SIDE_CONNECTORS).min(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::geometry::{dot, norm};

    #[test]
    fn ways_are_unit_vectors_that_differ() {
        fn check<const D: usize>(n: usize) {
            let mut up = [0.0; D];
            up[1] = 1.0;
            let mut velocity = [0.1; D];
            velocity[0] = 0.4;
            let all = exit_directions(up, velocity);
            assert_eq!(all.len(), n);
            for (k, u) in all.iter().enumerate() {
                assert!((norm(*u) - 1.0).abs() < 1e-12);
                assert!(all[..k].iter().filter(|v| dot(**v, *u) > 1.0 - 1e-9).count() <= 1);
            }
        }
        check::<2>(3 + 11);
        check::<3>(3 + 22);
    }
}
