//! Exits for parts that are caught.
//!
//! A part between two obstacles that close like tongs, or of a chain that others hold taut, can
//! leave only through an obstacle, and the sooner the better. Candidates lead through any obstacle that
//! touches the chain, in some directions. Each is rolled out on the connectors around the contact,
//! with obstacles at constant velocity, and the one with the least time inside is taken.

use super::super::ObstacleEscapeRules;
use super::TOUCH_M;
use super::at_risk::{ConnectorAtRisk, connectors_at_risk, group_to_save};
use super::exit_search::ExitSearch;
use super::posture::ends;
use super::rollout::Rollout;
use super::solve::{EscapeSolver, direction_away};
use super::solve_input::{EscapeSolveInput, ExitDirection};
use super::work::WorkReserve;
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
    search: ExitSearch,
    /// The work that rollouts may take.
    pub(super) reserve: WorkReserve,
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
/// The same while rollouts foresee no contact, and little work is left for them.
const SAFE_INTERVAL_TICKS: u32 = 3 * CHOICE_INTERVAL_TICKS;
/// Gap below which a chain is in danger and an exit is searched for, meters: more than the margin of 0.05 m, so that
/// the search begins while tongs still close. An exit ends at a wider gap, so that it does not end and begin by turns.
const DANGER_DISTANCE_M: f64 = 0.12;
/// Least reserve of work with which a choice begins: that of a few whole rollouts of 26 connectors.
const CHOICE_WORK: u64 = 600_000;
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
        *self = Self { rests: self.rests, reserve: self.reserve, ..Self::default() };
    }

    /// Forgets the search for an exit of a chain that is in no danger.
    pub(super) fn reset_search(&mut self) {
        self.search = ExitSearch::default();
    }

    /// Counts a tick of `dt_s`.
    pub(super) fn start_tick(&mut self, dt_s: f64) {
        self.pause = self.pause.saturating_sub(1);
        self.reserve.refill(dt_s);
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
        if gap_m > DANGER_DISTANCE_M {
            self.reset_search();
            return false;
        }
        // Contact that was not foreseen is seen to at once.
        let is_surprised = gap_m < -TOUCH_M && self.search.foresees_no_contact();
        if (self.pause > 0 && !is_surprised) || self.reserve.left() < CHOICE_WORK {
            return false;
        }
        self.pause = CHOICE_INTERVAL_TICKS;
        let now = self.exit_direction();
        let at_risk = connectors_at_risk(input, solver);
        let group = group_to_save(&at_risk, now.map(|exit| exit.obstacle));
        let around = rollout_connectors(group, input.chain.points().len());
        let Some(rollout) = Rollout::from_connector_range(rules, input, around) else {
            return false;
        };
        let candidates = || exit_candidates(input, group);
        let best = self.search.find_exit(&rollout, now, candidates, &mut self.reserve);
        if self.search.foresees_no_contact() && self.reserve.is_low() {
            self.pause = SAFE_INTERVAL_TICKS;
        }
        self.passing = best.map(|exit| ActiveExit {
            obstacle: exit.obstacle,
            toward: convert_dimensions(exit.toward),
        });
        best != now
    }
}

/// Returns the exits through the obstacles near a group of connectors.
fn exit_candidates<const D: usize>(
    input: &EscapeSolveInput<'_, D>,
    group: &[ConnectorAtRisk],
) -> Vec<ExitDirection<D>> {
    let mut exits = Vec::new();
    for mover in input.obstacles.moving() {
        let near = group.iter().filter(|at_risk| at_risk.obstacle == mover.id);
        let Some(nearest) = near.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)) else { continue };
        let nearest = mover.core.nearest_to_segment(ends(input.chain.points(), nearest.part));
        let through = scaled(direction_away(mover, &nearest), -1.0);
        let obstacle = mover.id;
        let directions = exit_directions(through, mover.velocity_m_s).into_iter();
        exits.push(directions.map(move |toward| ExitDirection { obstacle, toward }));
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

/// Returns the connectors that rollouts include to save some: also those to either side.
fn rollout_connectors(group: &[ConnectorAtRisk], connectors: usize) -> RangeInclusive<usize> {
    // Without any in danger the chain's start stands for it.
    let from = group.first().map_or(0, |at_risk| at_risk.k);
    let to = group.last().map_or(0, |at_risk| at_risk.k);
    from.saturating_sub(SIDE_CONNECTORS)..=(to + 1 + SIDE_CONNECTORS).min(connectors - 1)
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
