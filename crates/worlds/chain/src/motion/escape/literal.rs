//! Escape by the slides' method: one part after the other becomes the initiator of a motion.
//!
//! Parts of the chain that are too near to an obstacle, the deepest first, go where no part gets
//! deeper, and the chain follows by its rules. The slides set no limit to that. Here no connector,
//! slaves included, is farther from its position at the start of the tick than its speed allows, and a
//! part that only this limit keeps from escaping is reported.

use super::threat::{
    ObstacleProximity, Threat, collect_threats, gap_m, is_among, obstacle_proximity,
};
use super::{
    ChainPart, EscapeMargin, EscapeReport, ObstacleEscapeInput, ObstacleEscapeRules, TrappedPart,
};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::{InputError, interrupt};
use sidestep_rods::geometry::{
    Point, add_scaled, distance, dot, normalized, perpendicular, scaled, sub,
};
use sidestep_rods::{
    Chain, MotionOutcome, MotionRequest, ReachOutcome, ReachRequest, RequestSource,
    RequestedMotion, RodBvh, TOLERANCE_M, Veto, VetoEffect, VetoReason, reach_target,
};
use std::ops::Range;

/// Escapes of one part after the other.
#[derive(Debug, Clone)]
pub(super) struct LiteralEscape<const D: usize> {
    rules: ObstacleEscapeRules,
    body: RodBvh<D>,
    threats: Vec<Threat>,
    vetoes: Vec<(Threat, Veto<D>)>,
    /// The chain as it was before the motion under trial.
    before: Vec<Point<D>>,
}

/// Distance by which a push goes beyond the depth, meters, so that rounding leaves no violation.
const PUSH_MARGIN_M: f64 = 1e-6;
/// Least gain of a helpful motion, as a fraction of its length: a push that is turned by 1.5 rad gains 0.07 of it, one
/// that gains less only slides along the obstacle.
const MIN_GAIN: f64 = 0.05;
/// Least motion of the point of contact, as a fraction of the motion of a rod's end, for a helpful end: with less, the end
/// would have to go more than ten times as far as the contact.
const MIN_LEVER: f64 = 0.1;
/// Fractions of the push that are tried, each in all directions.
const PUSH_FRACTIONS: [f64; 3] = [1.0, 0.5, 0.25];
/// Directions that are tried, rad, from straight away to nearly across; the first of both signs
/// leads away from the obstacle's path.
const PUSH_TURNS_RAD: [f64; 7] = [0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5];

impl<const D: usize> LiteralEscape<D> {
    pub(super) fn new(rules: ObstacleEscapeRules) -> Self {
        Self {
            rules,
            body: RodBvh::default(),
            threats: Vec::new(),
            vetoes: Vec::new(),
            before: Vec::new(),
        }
    }

    /// Moves the parts that are too near to a moving obstacle.
    pub(super) fn escape(
        &mut self,
        tick: &mut ObstacleEscapeInput<'_, D>,
    ) -> Result<EscapeReport<D>, InputError> {
        let ahead = self.rules.look_ahead_margin();
        // No part gets farther from where it is now than from one side of its start to the other.
        let reach_m = 2.0 * self.max_travel_m(tick);
        collect_threats(
            tick.chain,
            tick.obstacles,
            &mut self.body,
            |mover| ahead.required_gap_m(mover) + reach_m,
            &mut self.threats,
        );
        let mut report = EscapeReport::default();
        if self.threats.is_empty() {
            return Ok(report);
        }
        self.before.clear();
        self.before.extend_from_slice(tick.chain.points());
        // The look-ahead gets half of the tries, so that contacts are handled even where many parts are threatened.
        let mut tries = self.rules.most / 2;
        if ahead != EscapeMargin::NONE {
            self.relieve_round(tick, ahead, &mut tries, &mut report)?;
        }
        tries += self.rules.most.div_ceil(2);
        self.relieve_round(tick, EscapeMargin::NONE, &mut tries, &mut report)?;
        self.report_trapped(tick, &mut report);
        Ok(report)
    }

    /// Returns the greatest distance from its start that a connector may have, or already has, meters.
    fn max_travel_m(&self, tick: &ObstacleEscapeInput<'_, D>) -> f64 {
        let distances_m = tick.start.iter().zip(tick.chain.points()).map(|(s, p)| distance(*s, *p));
        distances_m.fold(self.rules.max_step_m(), f64::max)
    }

    /// Relieves violations of one margin, the deepest first.
    fn relieve_round(
        &mut self,
        tick: &mut ObstacleEscapeInput<'_, D>,
        margin: EscapeMargin,
        tries: &mut usize,
        report: &mut EscapeReport<D>,
    ) -> Result<(), InputError> {
        self.vetoes.clear();
        self.measure_threats(tick, margin);
        while *tries > 0 {
            let Some(deepest) = self.deepest() else { break };
            *tries -= 1;
            interrupt::check();
            match self.reduce_violation(tick, deepest)? {
                Ok(touched) => {
                    self.update_threat_depths(tick, &touched);
                    report.moves += 1;
                    let Threat { part, mover, .. } = self.threats[deepest];
                    let obstacle = tick.obstacles.moving()[mover].id;
                    report.first = report.first.or(Some((part.connector(), obstacle)));
                }
                Err(veto) => {
                    report.vetoes += 1;
                    report.capped += usize::from(veto.reason == VetoReason::StepLimit);
                    self.threats[deepest].given_up = true;
                    self.vetoes.push((self.threats[deepest], veto));
                }
            }
        }
        Ok(())
    }

    /// Measures all threats in a margin; none counts as given up after that.
    fn measure_threats(&mut self, tick: &ObstacleEscapeInput<'_, D>, margin: EscapeMargin) {
        for threat in &mut self.threats {
            threat.given_up = false;
            threat.margin_m = margin.required_gap_m(&tick.obstacles.moving()[threat.mover]);
            threat.depth_m = threat_depth(tick, threat);
        }
    }

    /// Measures the threats of some connectors and their rods again; all others are as deep as before.
    fn update_threat_depths(&mut self, tick: &ObstacleEscapeInput<'_, D>, touched: &Range<usize>) {
        for threat in self.threats.iter_mut().filter(|t| is_among(t.part, touched)) {
            threat.depth_m = threat_depth(tick, threat);
        }
    }

    /// Returns the deepest violation; of equals the first by part and obstacle, so that the order of the list does not
    /// matter.
    fn deepest(&self) -> Option<usize> {
        let violations = self.threats.iter().enumerate();
        let violations = violations.filter(|(_, t)| !t.given_up && t.depth_m > TOLERANCE_M);
        let deepest = violations.max_by(|(_, a), (_, b)| {
            let by_depth = a.depth_m.total_cmp(&b.depth_m);
            by_depth.then((b.part, b.mover).cmp(&(a.part, a.mover)))
        });
        deepest.map(|(k, _)| k)
    }

    /// Tries to reduce one violation; returns the connectors that may have moved, or the objection if no motion
    /// works: then every bit is as before. A base that vetoes is led back to its position by a return pass, so that
    /// the elbows of an arm escape, too.
    fn reduce_violation(
        &mut self,
        tick: &mut ObstacleEscapeInput<'_, D>,
        which: usize,
    ) -> Result<Result<Range<usize>, Veto<D>>, InputError> {
        let threat = self.threats[which];
        let mover = tick.obstacles.moving()[threat.mover];
        let near = obstacle_proximity(tick.chain, threat.part, &mover);
        let mut best_veto = immovable_part_veto(tick.chain, threat.part, mover.id);
        for (k, lever) in movable_connectors(tick.chain, threat.part, &near).into_iter().flatten() {
            let push_m =
                ((threat.depth_m + PUSH_MARGIN_M) / lever).min(self.max_distance_m(tick, k));
            for direction in push_directions(near.away, mover.velocity_m_s) {
                let to = add_scaled(tick.chain.points()[k], direction, push_m);
                match self.attempt(tick, which, k, to)? {
                    Ok(touched) => return Ok(Ok(touched)),
                    // A veto by the speed limit is kept: it is more informative than any other
                    // reason.
                    Err(veto) if best_veto.reason != VetoReason::StepLimit => best_veto = veto,
                    Err(_) => (),
                }
            }
        }
        Ok(Err(best_veto))
    }

    /// Returns how far from its start a connector may be, meters: as far as its speed allows, or as
    /// far as it already is.
    fn max_distance_m(&self, tick: &ObstacleEscapeInput<'_, D>, k: usize) -> f64 {
        self.rules.max_step_m().max(distance(tick.start[k], self.before[k]))
    }

    /// Moves one connector, if that helps; otherwise every bit is as before. Returns the connectors that may have moved.
    fn attempt(
        &mut self,
        tick: &mut ObstacleEscapeInput<'_, D>,
        which: usize,
        k: usize,
        to: Point<D>,
    ) -> Result<Result<Range<usize>, Veto<D>>, InputError> {
        let at = tick.chain.points()[k];
        let to = clamp_to_ball(tick.start[k], to, self.max_distance_m(tick, k));
        if distance(to, at) <= TOLERANCE_M {
            return Ok(Err(make_veto(tick.chain, k, VetoReason::StepLimit, None)));
        }
        let request = MotionRequest {
            motion: RequestedMotion::Connector { k, to },
            source: RequestSource::Autonomous,
            mode: VetoEffect::AsFarAsPossible,
        };
        let touched = match tick.propagator.propagate(tick.chain, tick.obstacles, &request)? {
            MotionOutcome::Moved(moved) => moved.touched,
            MotionOutcome::Vetoed(veto)
                if veto.by != k && tick.chain.connectors()[veto.by].is_still() =>
            {
                let order =
                    // A reach may end short of its target, but by less than the push goes beyond
                    // the depth.
                    ReachRequest { k, target: to, base: veto.by, tolerance_m: 0.5 * PUSH_MARGIN_M };
                match reach_target(tick.propagator, tick.chain, tick.obstacles, &order)? {
                    ReachOutcome::There { .. } => 0..tick.start.len(),
                    ReachOutcome::Short { .. } => return Ok(Err(veto)),
                }
            }
            MotionOutcome::Vetoed(veto) => return Ok(Err(veto)),
        };
        let refused = if let Some(by) = self.first_too_fast_connector(tick, touched.clone()) {
            Some(Veto { by, ..make_veto(tick.chain, k, VetoReason::StepLimit, None) })
        } else {
            let deeper_in = self.find_worsened_obstacle(tick, &touched, which, distance(to, at));
            deeper_in.map(|id| make_veto(tick.chain, k, VetoReason::TargetBlocked, id))
        };
        let run = touched.clone();
        if let Some(veto) = refused {
            tick.chain.points_mut()[run.clone()].copy_from_slice(&self.before[run]);
            return Ok(Err(veto));
        }
        self.before[run.clone()].copy_from_slice(&tick.chain.points()[run]);
        Ok(Ok(touched))
    }

    /// Returns the first connector that went farther than its speed allows.
    fn first_too_fast_connector(
        &self,
        tick: &ObstacleEscapeInput<'_, D>,
        touched: Range<usize>,
    ) -> Option<usize> {
        touched.into_iter().find(|&i| {
            distance(tick.start[i], tick.chain.points()[i]) > self.max_distance_m(tick, i) + 1e-12
        })
    }

    /// Returns the obstacle in which a motion left a part too deep: the part itself, if it did not get farther away, or
    /// another that is as deep now.
    fn find_worsened_obstacle(
        &self,
        tick: &ObstacleEscapeInput<'_, D>,
        touched: &Range<usize>,
        which: usize,
        distance_m: f64,
    ) -> Option<u32> {
        let depth_m = self.threats[which].depth_m;
        let bound_m = depth_m - MIN_GAIN * distance_m.min(depth_m);
        // Untouched parts are as deep as before.
        let all = self.threats.iter().enumerate();
        let mut changed = all.filter(|(i, threat)| *i == which || is_among(threat.part, touched));
        let (_, worse) = changed.find(|(i, threat)| {
            let allowed_m = if *i == which { bound_m } else { threat.depth_m.max(bound_m) };
            threat_depth(tick, threat) > allowed_m
        })?;
        Some(tick.obstacles.moving()[worse.mover].id)
    }

    fn report_trapped(&mut self, tick: &ObstacleEscapeInput<'_, D>, report: &mut EscapeReport<D>) {
        self.measure_threats(tick, EscapeMargin::NONE);
        let Some(deepest) = self.deepest() else { return };
        let threat = self.threats[deepest];
        report.deepest_m = threat.depth_m;
        let mut vetoes = self.vetoes.iter();
        let veto = vetoes.find(|(t, _)| t.part == threat.part && t.mover == threat.mover);
        let veto = veto.map(|(_, veto)| *veto);
        let obstacle = tick.obstacles.moving()[threat.mover].id;
        report.left = Some(TrappedPart { part: threat.part, obstacle, veto });
    }
}

fn threat_depth<const D: usize>(tick: &ObstacleEscapeInput<'_, D>, threat: &Threat) -> f64 {
    threat.margin_m - gap_m(tick.chain, threat.part, &tick.obstacles.moving()[threat.mover])
}

/// Returns the connectors that may move for a part, and the fraction of their motion that the point of
/// contact makes: for a rod the end nearer to the contact, then the other.
fn movable_connectors<const D: usize>(
    chain: &Chain<D>,
    part: ChainPart,
    near: &ObstacleProximity<D>,
) -> [Option<(usize, f64)>; 2] {
    let a = near.along_rod;
    let ends = match part {
        ChainPart::Connector(i) => [Some((i, 1.0)), None],
        ChainPart::Rod(i) if a < 0.5 => [Some((i, 1.0 - a)), Some((i + 1, a))],
        ChainPart::Rod(i) => [Some((i + 1, a)), Some((i, 1.0 - a))],
    };
    ends.map(|end| {
        let (k, lever) = end?;
        let may_help = lever >= MIN_LEVER && !chain.connectors()[k].is_still();
        may_help.then_some((k, lever))
    })
}

/// Returns the veto of a part without a connector that may move.
fn immovable_part_veto<const D: usize>(
    chain: &Chain<D>,
    part: ChainPart,
    obstacle: u32,
) -> Veto<D> {
    let (ChainPart::Connector(k) | ChainPart::Rod(k)) = part;
    let reason = if chain.connectors()[k].failed { VetoReason::Failed } else { VetoReason::Fixed };
    make_veto(chain, k, reason, obstacle)
}

/// Returns the displacements that are tried, as fractions of the push: all of it in every direction, then half.
fn push_directions<const D: usize>(
    away: Point<D>,
    velocity: Point<D>,
) -> impl Iterator<Item = Point<D>> {
    let planes = turn_planes(away, velocity);
    PUSH_FRACTIONS.into_iter().flat_map(move |fraction| {
        PUSH_TURNS_RAD.into_iter().flat_map(move |turn_rad| {
            // Straight away is the same in all planes.
            let n = if turn_rad == 0.0 { 1 } else { D - 1 };
            planes.into_iter().take(n).map(move |across| {
                let u = add_scaled(scaled(away, cos(turn_rad)), across, sin(turn_rad));
                scaled(u, fraction)
            })
        })
    })
}

/// Returns directions perpendicular to `away` to turn it toward: the first away from the obstacle's path.
fn turn_planes<const D: usize>(away: Point<D>, velocity: Point<D>) -> [Point<D>; 2] {
    let first = away_from_path(away, velocity).unwrap_or_else(|| perpendicular(away));
    [first, cross_product(away, first)]
}

/// Returns the unit vector across `away` that leads off the line on which the obstacle moves; none if `away` is along it.
fn away_from_path<const D: usize>(away: Point<D>, velocity: Point<D>) -> Option<Point<D>> {
    let v = normalized(velocity)?;
    let off = add_scaled(away, v, -dot(away, v));
    normalized(add_scaled(off, away, -dot(off, away)))
}

/// Returns the vector across two that are perpendicular; in the plane there is none, and the result
/// is not used.
fn cross_product<const D: usize>(u: Point<D>, v: Point<D>) -> Point<D> {
    std::array::from_fn(|i| u[(i + 1) % D] * v[(i + 2) % D] - u[(i + 2) % D] * v[(i + 1) % D])
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

fn make_veto<const D: usize>(
    chain: &Chain<D>,
    from: usize,
    reason: VetoReason,
    obstacle: impl Into<Option<u32>>,
) -> Veto<D> {
    let obstacle = obstacle.into();
    Veto { by: from, from, reason, obstacle, reached: chain.points()[from] }
}
