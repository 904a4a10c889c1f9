//! Rollouts: motions tried on a copy of a part of the chain, among the moving obstacles near it.

use super::super::{EscapeMargin, ObstacleEscapeRules};
use super::solve::EscapeSolver;
use super::solve_input::{EscapeSolveInput, ExitDirection, LeadMotion, SoftConstraints};
use super::{PRESSED_SPEED_FRACTION, TOUCH_M};
use sidestep_rods::geometry::{Point, add, distance, norm};
use sidestep_rods::{Chain, MotionRequest, Obstacle, Obstacles, Propagator, ReactionRules};
use std::ops::RangeInclusive;

/// A part of a chain, and the obstacles that may come near it.
pub(super) struct Rollout<'a, const D: usize> {
    rules: &'a ReactionRules,
    chain: Chain<D>,
    obstacles: Obstacles<D>,
    margin: EscapeMargin,
    dt_s: f64,
    max_step_m: f64,
    ticks: usize,
}

/// The motions of a rollout, beside escapes.
#[derive(Clone, Copy)]
pub(super) struct RolloutOptions<const D: usize> {
    through: Option<ExitDirection<D>>,
    lead: Option<LeadMotion<D>>,
    /// Ticks without contact after which the rollout ends.
    clear: usize,
}

/// Factor by which the cost of a choice must be lower than that of the present one: a chain that changes its exit whenever
/// another is a little shorter goes to and fro and leaves by none.
pub(super) const IMPROVEMENT_FACTOR: f64 = 0.8;
/// Ticks inside that a choice must save beside that: where little is at stake, the factor alone would let a leader rest for
/// nothing, or an exit change for depth alone.
pub(super) const MIN_BENEFIT_TICKS: f64 = 0.5;
/// Longest time of a rollout, s: farther ahead obstacles no longer move at constant velocity.
const MAX_HORIZON_S: f64 = 3.0;
/// Most ticks of a rollout, which limits the work where ticks are short.
const MAX_TICKS: usize = 150;
/// Ticks without contact after which an exit has ended: half of a rollout, or tongs that open and close again would look
/// harmless.
const CLEAR_TICKS: usize = 75;
/// Cost of depth, in ticks per meter and tick: it only decides between exits that take as long.
const DEPTH_COST: f64 = 0.2;
/// Work of a tick beside its solve, in corrections: obstacles that advance, and the search for contacts.
const TICK_CORRECTIONS: u64 = 8;
/// Rounds of a solve in a rollout, with margins and without; fewer than in a tick, because rollouts are many.
const ROUNDS: [usize; 2] = [12, 20];

struct RolloutTrial<const D: usize> {
    chain: Chain<D>,
    obstacles: Obstacles<D>,
    propagator: Propagator<D>,
    solver: EscapeSolver<D>,
}

impl<const D: usize> RolloutTrial<D> {
    /// Leads the chain on, unless it needs its speed, of `max_step_m` a tick, to escape. `start` holds the positions at the
    /// start of the tick.
    fn move_leader(&mut self, lead: LeadMotion<D>, start: &[Point<D>], max_step_m: f64) {
        if self.max_displacement_from_m(start) > PRESSED_SPEED_FRACTION * max_step_m {
            return;
        }
        let escaped = self.chain.points().to_vec();
        let to = add(escaped[lead.k], lead.displacement_m);
        let request = MotionRequest::from_operator(lead.k, to);
        // Beyond the range of coordinates nothing is led.
        let went = self.propagator.propagate(&mut self.chain, &self.obstacles, &request);
        if went.is_err() || self.max_displacement_from_m(start) > max_step_m {
            self.chain.points_mut().copy_from_slice(&escaped);
        }
    }

    /// Returns the longest displacement of a connector from its start.
    fn max_displacement_from_m(&self, start: &[Point<D>]) -> f64 {
        let moves = start.iter().zip(self.chain.points());
        moves.map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
    }
}

impl<const D: usize> RolloutOptions<D> {
    /// Returns the options of an exit through an obstacle, or of none, while no connector leads.
    pub(super) fn with_exit(through: Option<ExitDirection<D>>) -> Self {
        Self { through, lead: None, clear: CLEAR_TICKS }
    }

    /// Returns the options of a leader: rolled out to the end, because it may lead the chain inside
    /// later.
    pub(super) fn with_lead(lead: LeadMotion<D>) -> Self {
        Self { through: None, lead: Some(lead), clear: MAX_TICKS }
    }
}

impl<'a, const D: usize> Rollout<'a, D> {
    /// Returns a rollout of the connectors between two; none if there are none.
    pub(super) fn from_connector_range(
        rules: &ObstacleEscapeRules,
        input: &EscapeSolveInput<'a, D>,
        between: RangeInclusive<usize>,
    ) -> Option<Self> {
        let (from, to) = between.into_inner();
        let EscapeSolveInput { chain, obstacles, max_step_m, .. } = *input;
        let cut = chain.part(from..to + 1);
        let horizon_s = MAX_HORIZON_S.min(MAX_TICKS as f64 * rules.dt_s);
        let middle = chain.points()[usize::midpoint(from, to)];
        let reach_m: f64 = chain.rods()[from..to].iter().map(|rod| rod.max_m).sum();
        let mut moving = Vec::new();
        for mover in obstacles.moving() {
            let gap_m = mover.core.nearest_to_point(middle).distance_m - mover.radius_m;
            let approach_m = horizon_s * (norm(mover.velocity_m_s) + rules.speed_max_m_s);
            if gap_m < reach_m + approach_m {
                moving.push(*mover);
            }
        }
        let mut near = obstacles.clone();
        near.replace_moving(&moving).ok()?;
        Some(Self {
            rules: input.rules,
            chain: cut.ok()?,
            obstacles: near,
            margin: rules.look_ahead_margin(),
            dt_s: rules.dt_s,
            max_step_m,
            ticks: (horizon_s / rules.dt_s).ceil() as usize,
        })
    }

    /// Returns whether a moving obstacle may come near it.
    pub(super) fn is_approached(&self) -> bool {
        self.obstacles.moving().iter().any(Obstacle::is_moving)
    }

    /// Returns the time inside by some motions, ticks, with a surcharge for depth; it may end early at
    /// `enough`. If no work is `left`, it is infinite.
    pub(super) fn cost(&self, tried: &RolloutOptions<D>, enough: f64, left: &mut u64) -> f64 {
        let mut trial = self.start_trial();
        let RolloutOptions { mut through, lead, clear: clear_ticks } = *tried;
        let mut cost = 0.0;
        let mut clear = 0;
        if let Some(lead) = lead {
            // The leader chooses after the escape of this cycle, so its motion comes first.
            let start = trial.chain.points().to_vec();
            trial.move_leader(lead, &start, self.max_step_m);
            trial.obstacles.advance(self.dt_s);
        }
        for _ in 0..self.ticks {
            if *left == 0 {
                return f64::INFINITY;
            }
            let corrections_before = trial.solver.corrections();
            let start = trial.chain.points().to_vec();
            let gap_m = self.escape(&mut trial, &start, &mut through);
            let corrections = TICK_CORRECTIONS + trial.solver.corrections() - corrections_before;
            *left = left.saturating_sub(corrections * start.len() as u64);
            clear = if gap_m < -TOUCH_M { 0 } else { clear + 1 };
            if clear == 0 {
                cost += 1.0 - DEPTH_COST * gap_m;
            }
            if clear > clear_ticks || cost >= enough {
                break;
            }
            // As in the run itself, a leader gives way while parts are inside.
            if let Some(lead) = lead.filter(|_| clear > 0) {
                trial.move_leader(lead, &start, self.max_step_m);
            }
            trial.obstacles.advance(self.dt_s);
        }
        cost
    }

    fn start_trial(&self) -> RolloutTrial<D> {
        // Slaves of the leader are no faster than escapes may be.
        let slave_step_max_m = self.rules.slave_step_max_m.min(self.max_step_m);
        RolloutTrial {
            chain: self.chain.clone(),
            obstacles: self.obstacles.clone(),
            propagator: Propagator::new(ReactionRules { slave_step_max_m, ..*self.rules }),
            solver: EscapeSolver::default(),
        }
    }

    /// Moves the chain under trial out of the way in one tick, at whose start its connectors are at `start`; returns the
    /// least gap then, meters.
    fn escape(
        &self,
        trial: &mut RolloutTrial<D>,
        start: &[Point<D>],
        through: &mut Option<ExitDirection<D>>,
    ) -> f64 {
        let RolloutTrial { chain, obstacles, solver, .. } = trial;
        let input = EscapeSolveInput {
            chain,
            obstacles,
            rules: self.rules,
            start,
            max_step_m: self.max_step_m,
        };
        let gap_m = self.find_positions(&input, solver, through);
        chain.points_mut().copy_from_slice(&solver.points);
        gap_m
    }

    /// Solves for the positions at the end of a tick, which the solver has then. Returns the least gap, meters.
    fn find_positions(
        &self,
        input: &EscapeSolveInput<'_, D>,
        solver: &mut EscapeSolver<D>,
        through: &mut Option<ExitDirection<D>>,
    ) -> f64 {
        if !solver.find_contacts(input, self.margin) {
            solver.points.clear();
            solver.points.extend_from_slice(input.chain.points());
            return f64::INFINITY;
        }
        if through.is_some_and(|through| solver.has_passed(input, &through)) {
            *through = None;
        }
        let (before_m, _) = solver.min_gap(input, input.chain.points());
        let soft = SoftConstraints { margin: self.margin, through: *through, rounds: ROUNDS };
        if solver.solve(input, &soft) {
            let (gap_m, _) = solver.min_gap(input, &solver.points);
            // On an exit a part gets deeper first; otherwise a solve that makes it deeper is dropped.
            if through.is_some() || gap_m >= before_m.min(0.0) {
                return gap_m;
            }
        }
        solver.points.clear();
        solver.points.extend_from_slice(input.chain.points());
        before_m
    }
}
