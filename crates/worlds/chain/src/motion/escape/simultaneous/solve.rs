//! One simultaneous solve: the new places of all parts in a tick.
//!
//! First rounds of corrections with margins around moving obstacles, then rounds without, then only the
//! laws: rods, speed, walls, own parts. A solve whose result breaks a law is given up, so that
//! obstacles may be in conflict with laws, and never the other way round.

use super::super::EscapeMargin;
use super::super::threat::{Threat, gap_m, leftward_direction};
use super::constraints::{BendConstraint, EscapeConstraintChecker};
use super::contacts::{Contacts, fraction_along, nearest_points};
use super::lengths::RodLengthProjector;
use super::odometer::Odometer;
use super::posture::{PartPoint, TrialPosture, ends};
use super::solve_input::{EscapeSolveInput, ExitDirection, SoftConstraints};
use sidestep_rods::geometry::{
    NearestPoints, Point, add_scaled, distance, lerp, normalized, perpendicular, scaled, sub,
    unit_x,
};
use sidestep_rods::{ChainPart, Obstacle};
use std::f64::consts::PI;

/// Finds positions for all connectors. It owns its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct EscapeSolver<const D: usize> {
    pub(super) contacts: Contacts<D>,
    pub(super) points: Vec<Point<D>>,
    inverse_mass: Vec<f64>,
    bends: Vec<BendConstraint>,
    lengths: RodLengthProjector<D>,
    odometer: Odometer<D>,
}

/// Distance around an obstacle in which the chain joins an exit through it, as a multiple of its
/// longest rod.
const EXIT_RANGE_FACTOR: f64 = 2.0;
/// Distance from which on an obstacle is passed, meters: beyond that at which an exit is searched for, or the chain would
/// be caught again at once.
const PASSED_DISTANCE_M: f64 = 0.17;
/// Fraction of a margin's violation that a round corrects. All of it would push a part back and forth between two margins;
/// with 0.3, the 24 rounds leave 0.02 % of a violation where nothing else pushes. Values beside it were not measured.
const SOFT_FRACTION: f64 = 0.3;
/// Most rounds in which only hard constraints count.
const MAX_SETTLE_ROUNDS: usize = 48;
/// Number of those rounds between two checks, which cost more than a round.
const CHECK_INTERVAL: usize = 8;
/// Fractions of the motion that are tried if all of it violates a hard constraint.
const MOTION_FRACTIONS: [f64; 3] = [1.0, 0.5, 0.2];
/// Distance beyond contact that corrections aim at, at most, meters: the corrections that follow take some of it back.
const MAX_SLACK_M: f64 = 1e-4;
/// The same as a fraction of the distance to be kept, so that thin parts are not pushed farther than they are thick.
const SLACK_FRACTION: f64 = 0.01;
/// Correction below which all is settled, meters.
const SETTLE_TOLERANCE_M: f64 = 1e-6;
/// Rounding of distances, meters.
const ROUNDING_M: f64 = 1e-9;
/// Fraction of its longest motion that a connector leaves free for the last corrections, of rods above all: they come
/// after the limit of speed, and would exceed it.
const RESERVE_FRACTION: f64 = 1e-4;

impl<const D: usize> EscapeSolver<D> {
    /// Collects the contacts of a tick; returns whether any moving obstacle is near.
    pub(super) fn find_contacts(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        margin: EscapeMargin,
    ) -> bool {
        let EscapeSolveInput { chain, obstacles, rules, max_step_m, .. } = *input;
        self.contacts.collect_threats(chain, obstacles, margin, max_step_m);
        if self.contacts.threats.is_empty() {
            return false;
        }
        self.contacts.find_nearby(chain, obstacles, rules.self_collision, max_step_m);
        self.odometer.start(chain.points());
        self.inverse_mass.clear();
        let connectors = chain.connectors().iter();
        self.inverse_mass.extend(connectors.map(|c| if c.is_still() { 0.0 } else { 1.0 }));
        self.bends.clear();
        let limited = chain.connectors().iter().enumerate().filter(|(_, c)| c.max_bend_rad < PI);
        self.bends.extend(limited.filter_map(|(k, _)| BendConstraint::from_connector(chain, k)));
        true
    }

    /// Finds positions by soft constraints; returns whether they keep the hard ones.
    pub(super) fn solve(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        constraints: &SoftConstraints<D>,
    ) -> bool {
        self.points.clear();
        self.points.extend_from_slice(input.chain.points());
        self.start_exit(input, constraints.through);
        let [with_margin, without_margin] = constraints.rounds;
        for round in 0..with_margin + without_margin {
            let soft = (round < with_margin)
                .then_some(constraints.margin)
                .filter(|m| *m != EscapeMargin::NONE);
            let mover_correction_m = self.push_from_movers(input, constraints.through, soft);
            let wall_correction_m = self.push_from_walls();
            self.lengths.correct(
                &mut trial_posture(&mut self.points, &self.inverse_mass),
                input.chain.rods(),
            );
            self.limit_travel(input);
            if mover_correction_m.max(wall_correction_m) < SETTLE_TOLERANCE_M {
                break;
            }
        }
        self.settle(input)
    }

    /// Moves all connectors around an obstacle that the chain leaves through at once, because parts that are only
    /// dragged would lag.
    fn start_exit(&mut self, input: &EscapeSolveInput<'_, D>, through: Option<ExitDirection<D>>) {
        let Some(through) = through else { return };
        let moving = input.obstacles.moving();
        let Some(mover) = moving.iter().find(|o| o.id == through.obstacle) else { return };
        let longest_m = input.chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
        for (point, inverse_mass) in self.points.iter_mut().zip(&self.inverse_mass) {
            let apart_m = mover.core.nearest_to_point(*point).distance_m - mover.radius_m;
            if apart_m < EXIT_RANGE_FACTOR * longest_m {
                *point = add_scaled(*point, through.toward, inverse_mass * input.max_step_m);
            }
        }
    }

    /// Pushes parts away from moving obstacles; returns the greatest correction, meters.
    fn push_from_movers(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        through: Option<ExitDirection<D>>,
        soft: Option<EscapeMargin>,
    ) -> f64 {
        let Self { contacts, points, inverse_mass, .. } = self;
        let mut posture = trial_posture(points, inverse_mass);
        let mut greatest_m = 0.0_f64;
        for threat in &contacts.threats {
            let mover = &input.obstacles.moving()[threat.mover];
            let ends = posture.ends(threat.part);
            let nearest = mover.core.nearest_to_segment(ends);
            let gap_m =
                nearest.distance_m - mover.radius_m - input.chain.part_radius_m(threat.part);
            let through = through.filter(|through| through.obstacle == mover.id);
            let keep_m = match (through, soft) {
                (None, Some(margin)) => margin.required_gap_m(mover),
                _ => MAX_SLACK_M,
            };
            if gap_m >= keep_m {
                continue;
            }
            let by = if let Some(through) = through {
                scaled(through.toward, input.max_step_m)
            } else {
                let fraction = if soft.is_some() { SOFT_FRACTION } else { 1.0 };
                scaled(direction_away(mover, &nearest), fraction * (keep_m - gap_m))
            };
            posture.shift(threat.part, fraction_along(ends, nearest.on_body), by);
            greatest_m = greatest_m.max(keep_m - gap_m);
        }
        greatest_m
    }

    /// Pushes parts out of walls and apart, and corrects bends; returns the greatest correction,
    /// meters.
    fn push_from_walls(&mut self) -> f64 {
        let Self { contacts, points, inverse_mass, bends, odometer, .. } = self;
        let mut posture = trial_posture(points, inverse_mass);
        let mut greatest_m = 0.0_f64;
        odometer.advance_to(posture.points);
        for wall in &mut contacts.walls {
            if odometer.reading_m() < wall.clear_until_m {
                continue;
            }
            let ends = posture.ends(wall.part);
            let nearest = wall.core.nearest_to_segment(ends);
            let short_m = wall.keep_m + extra_clearance_m(wall.keep_m) - nearest.distance_m;
            if short_m <= 0.0 {
                wall.clear_until_m = odometer.reading_m() - short_m - ROUNDING_M;
                continue;
            }
            let Some(away) = normalized(sub(nearest.on_body, nearest.on_core)) else { continue };
            let along_rod = fraction_along(ends, nearest.on_body);
            posture.shift(wall.part, along_rod, scaled(away, short_m));
            odometer.advance_part(posture.points, wall.part);
            greatest_m = greatest_m.max(short_m);
        }
        for pair in &mut contacts.pairs {
            if odometer.reading_m() < pair.clear_until_m {
                continue;
            }
            let keep_m = pair.keep_m + extra_clearance_m(pair.keep_m);
            let spare_m = pair.bound_m(posture.points) - keep_m;
            if spare_m > 0.0 {
                // Either part may use up half of it.
                pair.clear_until_m = odometer.reading_m() + 0.5 * spare_m;
                continue;
            }
            let nearest = nearest_points(posture.points, pair.parts);
            let short_m = keep_m - nearest.distance_m;
            if short_m > 0.0 {
                let [one, other] = pair.parts;
                let one = part_point(&posture, one, nearest.on_body);
                let other = part_point(&posture, other, nearest.on_core);
                let away = normalized(sub(nearest.on_core, nearest.on_body))
                    .unwrap_or_else(|| perpendicular(unit_x()));
                posture.separate(one, other, away, short_m);
                pair.parts.into_iter().for_each(|part| odometer.advance_part(posture.points, part));
                greatest_m = greatest_m.max(short_m);
            }
        }
        bends.iter().fold(greatest_m, |greatest_m, bend| greatest_m.max(bend.correct(&mut posture)))
    }

    /// Keeps every connector within its speed, and at a position that its mobility allows.
    fn limit_travel(&mut self, input: &EscapeSolveInput<'_, D>) {
        for (k, point) in self.points.iter_mut().enumerate() {
            if self.inverse_mass[k] > 0.0 {
                let room_m = input.max_travel_m(k) * (1.0 - RESERVE_FRACTION);
                let connector = &input.chain.connectors()[k];
                let allowed = connector.mobility.project(*point, input.chain.points()[k]);
                *point = clamp_to_ball(input.start[k], allowed, room_m);
            }
        }
    }

    /// Corrects until the hard constraints hold, if necessary for a fraction of the motion; returns whether they do.
    fn settle(&mut self, input: &EscapeSolveInput<'_, D>) -> bool {
        MOTION_FRACTIONS.iter().any(|&part| {
            if part < 1.0 {
                for (point, from) in self.points.iter_mut().zip(input.chain.points()) {
                    *point = lerp(*from, *point, part);
                }
            }
            (0..MAX_SETTLE_ROUNDS).any(|round| {
                self.push_from_walls();
                self.limit_travel(input);
                let mut posture = trial_posture(&mut self.points, &self.inverse_mass);
                self.lengths.restore_lengths(&mut posture, input.chain.rods());
                round % CHECK_INTERVAL == 0 && self.meets_constraints(input)
            })
        })
    }

    fn meets_constraints(&self, input: &EscapeSolveInput<'_, D>) -> bool {
        let Self { contacts, points, bends, .. } = self;
        EscapeConstraintChecker { input, points }.are_met(contacts, bends)
    }

    /// Returns the corrections of all rods so far: most of the work of solves goes with them.
    pub(super) fn corrections(&self) -> u64 {
        self.lengths.corrections
    }

    /// Returns whether all parts are farther from an obstacle than it takes to have passed it.
    pub(super) fn has_passed(
        &self,
        input: &EscapeSolveInput<'_, D>,
        through: &ExitDirection<D>,
    ) -> bool {
        let moving = input.obstacles.moving();
        let threats = self.contacts.threats.iter();
        threats.filter(|t| moving[t.mover].id == through.obstacle).all(|threat| {
            gap_m(input.chain, threat.part, &moving[threat.mover]) > PASSED_DISTANCE_M
        })
    }

    /// Returns the least gap between the chain at some positions and moving obstacles, meters, and the
    /// threat that has it.
    pub(super) fn min_gap(
        &self,
        input: &EscapeSolveInput<'_, D>,
        points: &[Point<D>],
    ) -> (f64, Option<Threat>) {
        let mut least = (f64::INFINITY, None);
        for threat in &self.contacts.threats {
            let mover = &input.obstacles.moving()[threat.mover];
            let apart_m = mover.core.nearest_to_segment(ends(points, threat.part)).distance_m;
            let gap_m = apart_m - mover.radius_m - input.chain.part_radius_m(threat.part);
            if gap_m < least.0 {
                least = (gap_m, Some(*threat));
            }
        }
        least
    }
}

fn trial_posture<'a, const D: usize>(
    points: &'a mut [Point<D>],
    inverse_mass: &'a [f64],
) -> TrialPosture<'a, D> {
    TrialPosture { points, inverse_mass }
}

#[inline]
fn part_point<const D: usize>(
    posture: &TrialPosture<'_, D>,
    part: ChainPart,
    at: Point<D>,
) -> PartPoint {
    PartPoint { part, along_rod: fraction_along(posture.ends(part), at) }
}

/// Returns the direction from an obstacle to the nearest point of a part.
pub(super) fn direction_away<const D: usize>(
    mover: &Obstacle<D>,
    nearest: &NearestPoints<D>,
) -> Point<D> {
    normalized(sub(nearest.on_body, nearest.on_core)).unwrap_or_else(|| leftward_direction(mover))
}

fn extra_clearance_m(keep_m: f64) -> f64 {
    MAX_SLACK_M.min(SLACK_FRACTION * keep_m)
}

/// Returns the point of a ball around `center` that is nearest to `to`.
fn clamp_to_ball<const D: usize>(center: Point<D>, to: Point<D>, radius_m: f64) -> Point<D> {
    let distance_m = distance(center, to);
    if distance_m <= radius_m {
        to
    } else {
        add_scaled(center, sub(to, center), radius_m / distance_m)
    }
}
