//! Alternatives of an autonomous initiator after a veto (slides R8, R9).
//!
//! A ladder with six rungs: shorter steps, other headings, a turn on the spot, waiting, letting the
//! other end of the chain lead for some cycles, and the report that it is stuck. Each rung is tried
//! once in a tick, and the first that works ends the climb. The slides leave open the reaction to a
//! veto; the other end leads because a chain can be pulled out of a fold that it was pushed into. A
//! planner or an operator gets the veto and no ladder: their next request may be another one.

mod memory;
#[cfg(test)]
mod tests;

use super::request::execute_request;
pub(crate) use memory::RecoveryMemory;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};
use sidestep_rods::geometry::{
    Point, add, add_scaled, dot, norm, normalized, perpendicular, scaled, sub, unit_x,
};
use sidestep_rods::{
    Chain, CompletedMotion, MotionOutcome, MotionRequest, Obstacles, Propagator, RequestSource,
    RequestedMotion, Veto, VetoEffect,
};

/// Fractions of a step that are tried when the whole step is vetoed. An eighth is the least worth a cycle; where less
/// is free, another heading leads on sooner.
const STEP_FRACTIONS: [f64; 3] = [0.5, 0.25, 0.125];
/// Other headings that are tried, rad: up to a little more than across, to get away from a flat wall; farther back lies
/// where the chain comes from, and the other end leads there better. With steps finer than 0.4 rad (23 degrees) each veto
/// costs more attempts, with coarser ones gaps are missed; the prototypes had these, and no others were measured.
const FAN_RAD: [f64; 5] = [0.4, 0.8, 1.2, 1.6, 2.0];

/// How long each rung of the ladder is tried before the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecoveryLimits {
    /// Turns on the spot in a row before this rung is given up.
    pub turns: u32,
    /// Ticks of waiting in a row while an obstacle moves nearby.
    pub waits: u32,
    /// Ticks for which the other end leads.
    pub pull_back: u32,
    /// Number of times that the other end may lead without progress before the chain is stuck.
    pub hand_overs: u32,
    /// Number of times that a detour may lead through the same place without progress.
    pub visits: u32,
    /// Straight ticks after which the good side is forgotten.
    pub straight: u32,
}

impl Default for RecoveryLimits {
    /// Returns limits for cycles of 20 ms: a second in which obstacles nearby may go away, a second in which the other end
    /// pulls, half a second of free motion before a side is no longer preferred. In 16 turns on the spot a robot of the
    /// usual size turns by 46 degrees. Three times through the same place are a circle, not a detour.
    fn default() -> Self {
        Self { turns: 16, waits: 50, pull_back: 50, hand_overs: 3, visits: 3, straight: 25 }
    }
}

/// An initiator's knowledge beside its neighborhood.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InitiatorSituation {
    /// Distance of its goal, if it has one, meters. Without a goal there is no progress to miss,
    /// and detours through the same place are not counted.
    pub goal_distance_m: Option<f64>,
    /// Whether an obstacle moves nearby, so that waiting may help.
    pub movers_near: bool,
    /// Whether its drive can turn on the spot.
    pub can_turn: bool,
    /// Whether it moves only along its heading, as robots on wheels do: then no other headings are
    /// tried.
    pub keeps_heading: bool,
}

/// Outcome of a climb. The chain has moved only in the variants that hold a motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum RecoveryOutcome<const D: usize> {
    /// The motion as wanted.
    Straight(CompletedMotion<D>),
    /// A fraction of the step.
    Shorter {
        /// The fraction of the step that was free.
        part: f64,
        /// Counts of the shorter motion.
        moved: CompletedMotion<D>,
    },
    /// A motion in another direction.
    Sideways {
        /// The turn from the wanted direction, rad; positive to the left, in space toward the axis.
        turn_rad: f64,
        /// The plane of the turn in space: 0 if it was toward the second axis, 1 if toward the third.
        plane: usize,
        /// Counts of the motion aside.
        moved: CompletedMotion<D>,
    },
    /// Nothing moved: the drive shall turn.
    TurnOnTheSpot {
        /// 1 to the left, -1 to the right.
        side: i8,
    },
    /// Nothing moved: the obstacle nearby may go away.
    Waiting {
        /// Ticks waited so far.
        n: u32,
    },
    /// The other end led.
    PulledBack {
        /// The end that led: connector 0 or the last one.
        by: usize,
        /// Counts of the motion that it led.
        moved: CompletedMotion<D>,
    },
    /// Nothing moved, and no rung is left; all vetoes, each once.
    Stuck {
        /// Vetoes from the wanted motion to the last rung; empty if the wanted motion would now be free
        /// and only detours have led here.
        vetoes: Vec<Veto<D>>,
    },
    /// Nothing moved: a planner or an operator wanted the motion, and gets the veto.
    Vetoed(Veto<D>),
}

/// A ladder, and an initiator's position on it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecoveryLadder {
    /// How often each rung may be tried.
    pub rungs: RecoveryLimits,
    /// Memory from tick to tick; part of a checkpoint.
    pub memory: RecoveryMemory,
}

/// The chain, as its initiator moves it: all of it at once, or by asking its neighbors.
pub(crate) trait ChainMover<const D: usize> {
    /// Reason for which a request has no outcome.
    type Failure;

    /// Returns the position of a connector that leads.
    fn position(&self, k: usize) -> Point<D>;

    /// Carries out a motion: all of it, or nothing moves.
    fn request(&mut self, request: &MotionRequest<D>) -> Result<MotionOutcome<D>, Self::Failure>;

    /// Returns the veto of a motion, if there is one; nothing moves.
    fn find_veto(&mut self, request: &MotionRequest<D>) -> Result<Option<Veto<D>>, Self::Failure>;

    /// Returns the end farther from an initiator; `None` if there is none that could lead.
    fn farther_end(&mut self, k: usize) -> Result<Option<ChainEnd<D>>, Self::Failure>;
}

/// An end of a chain that may lead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChainEnd<const D: usize> {
    /// The connector at the end: the first or the last.
    pub(crate) by: usize,
    pub(crate) at: Point<D>,
    /// The direction in which its rod points out of the chain, a unit vector.
    pub(crate) ahead: Point<D>,
}

/// A chain that is moved as a whole, in one process.
#[derive(Debug)]
pub struct DirectMover<'a, const D: usize> {
    /// The chain, which moves only where nothing vetoes.
    pub chain: &'a mut Chain<D>,
    /// What may veto, beside the chain itself.
    pub obstacles: &'a Obstacles<D>,
    /// Moves the chain, by the rules that it was made with.
    pub propagator: &'a mut Propagator<D>,
}

impl<const D: usize> ChainMover<D> for DirectMover<'_, D> {
    type Failure = InputError;

    fn position(&self, k: usize) -> Point<D> {
        self.chain.points()[k]
    }

    fn request(&mut self, request: &MotionRequest<D>) -> Result<MotionOutcome<D>, InputError> {
        execute_request(self.propagator, self.chain, self.obstacles, request)
    }

    fn find_veto(&mut self, request: &MotionRequest<D>) -> Result<Option<Veto<D>>, InputError> {
        let mut copy = self.chain.clone();
        let attempted = execute_request(self.propagator, &mut copy, self.obstacles, request)?;
        Ok(attempted.veto().copied())
    }

    fn farther_end(&mut self, k: usize) -> Result<Option<ChainEnd<D>>, InputError> {
        let points = self.chain.points();
        let by = farther_end(k, points.len());
        let neighbor = if by == 0 { points.get(1) } else { points.get(by - 1) };
        let ahead = neighbor.and_then(|neighbor| normalized(sub(points[by], *neighbor)));
        Ok(ahead.map(|ahead| ChainEnd { by, at: points[by], ahead }))
    }
}

struct VetoRecoveryAttempt<'a, M, const D: usize> {
    by: &'a mut M,
    wanted: MotionRequest<D>,
    vetoes: Vec<Veto<D>>,
}

impl<M: ChainMover<D>, const D: usize> VetoRecoveryAttempt<'_, M, D> {
    /// Tries all of a motion, or none.
    fn attempt(
        &mut self,
        motion: RequestedMotion<D>,
    ) -> Result<Option<CompletedMotion<D>>, M::Failure> {
        let request = MotionRequest { motion, mode: VetoEffect::Exact, ..self.wanted };
        Ok(match self.by.request(&request)? {
            MotionOutcome::Moved(moved) => Some(moved),
            MotionOutcome::Vetoed(veto) => {
                self.record_veto(veto);
                None
            }
        })
    }

    /// Records a veto, unless one differs only in the position that the initiator could have reached.
    fn record_veto(&mut self, veto: Veto<D>) {
        let is_known = self.vetoes.iter().any(|known| {
            known.from == veto.from
                && known.by == veto.by
                && known.reason == veto.reason
                && known.obstacle == veto.obstacle
        });
        if !is_known {
            self.vetoes.push(veto);
        }
    }

    /// Returns the wanted motion with another displacement of the initiator.
    fn with_displacement(&self, change: impl Fn(Point<D>) -> Point<D>) -> RequestedMotion<D> {
        match self.wanted.motion {
            RequestedMotion::Connector { k, to } => {
                RequestedMotion::Connector { k, to: self.target_with_displacement(k, to, change) }
            }
            RequestedMotion::Rod { i, to: [first, second] } => RequestedMotion::Rod {
                i,
                to: [
                    self.target_with_displacement(i, first, &change),
                    self.target_with_displacement(i + 1, second, &change),
                ],
            },
        }
    }

    /// Returns the target of a connector with another displacement than to `to`.
    fn target_with_displacement(
        &self,
        k: usize,
        to: Point<D>,
        change: impl Fn(Point<D>) -> Point<D>,
    ) -> Point<D> {
        let at = self.by.position(k);
        add(at, change(sub(to, at)))
    }

    /// Returns the initiator and the displacement that it wants.
    fn wanted_displacement(&self) -> (usize, Point<D>) {
        let (k, to) = connector_and_target(&self.wanted.motion);
        (k, sub(to, self.by.position(k)))
    }
}

impl RecoveryLadder {
    /// Returns a ladder whose initiator has met no veto yet.
    pub fn new(rungs: RecoveryLimits) -> Self {
        Self { rungs, memory: RecoveryMemory::default() }
    }

    /// Moves as wanted, or as near to it as a rung allows. The wanted motion is requested exactly,
    /// whatever its mode, because a fraction of the step is a rung of its own.
    ///
    /// # Errors
    /// As [`Propagator::propagate`].
    pub fn move_or_recover<const D: usize>(
        &mut self,
        by: &mut DirectMover<'_, D>,
        wanted: &MotionRequest<D>,
        situation: &InitiatorSituation,
    ) -> Result<RecoveryOutcome<D>, InputError> {
        let (climbed, _) = self.move_or_recover_with(by, wanted, situation)?;
        Ok(climbed)
    }

    /// Climbs with any kind of mover, and also returns the veto of the wanted motion itself, if there was one.
    pub(crate) fn move_or_recover_with<M: ChainMover<D>, const D: usize>(
        &mut self,
        by: &mut M,
        wanted: &MotionRequest<D>,
        situation: &InitiatorSituation,
    ) -> Result<(RecoveryOutcome<D>, Option<Veto<D>>), M::Failure> {
        if wanted.source != RequestSource::Autonomous {
            return Ok(match by.request(wanted)? {
                MotionOutcome::Moved(moved) => (RecoveryOutcome::Straight(moved), None),
                MotionOutcome::Vetoed(veto) => (RecoveryOutcome::Vetoed(veto), Some(veto)),
            });
        }
        let mut climb = VetoRecoveryAttempt { by, wanted: *wanted, vetoes: Vec::new() };
        self.memory.record_goal_distance(situation.goal_distance_m);
        if self.memory.pulling_back > 0 {
            return Ok((self.pull_from_other_end(&mut climb)?, None));
        }
        if let Some(moved) = climb.attempt(wanted.motion)? {
            self.memory.record_straight_tick(self.rungs.straight);
            return Ok((RecoveryOutcome::Straight(moved), None));
        }
        let objection = climb.vetoes.first().copied();
        Ok((self.try_rungs(&mut climb, situation)?, objection))
    }

    fn try_rungs<M: ChainMover<D>, const D: usize>(
        &mut self,
        climb: &mut VetoRecoveryAttempt<'_, M, D>,
        situation: &InitiatorSituation,
    ) -> Result<RecoveryOutcome<D>, M::Failure> {
        if let Some(recovery) = try_shorter(climb)? {
            self.memory.reset_failures();
            return Ok(recovery);
        }
        match self.try_sideways(climb, situation)? {
            Some(recovery) => Ok(recovery),
            None => self.try_stationary_rungs(climb, situation),
        }
    }

    /// Tries other headings, first those on the side where one was good.
    fn try_sideways<M: ChainMover<D>, const D: usize>(
        &mut self,
        climb: &mut VetoRecoveryAttempt<'_, M, D>,
        situation: &InitiatorSituation,
    ) -> Result<Option<RecoveryOutcome<D>>, M::Failure> {
        let (k, displacement) = climb.wanted_displacement();
        let Some(u) = normalized(displacement).filter(|_| !situation.keeps_heading) else {
            return Ok(None);
        };
        let axes = axes_across(u);
        for (plane, turn_rad) in turn_sequence(&self.memory, D - 1) {
            let turn = |v| turn_toward(v, u, axes[plane], turn_rad);
            let Some(moved) = climb.attempt(climb.with_displacement(turn))? else { continue };
            self.memory.record_sideways(plane, turn_rad);
            let place = memory::visit_key(climb.by.position(k), u);
            if self.memory.record_visit(place, situation.goal_distance_m) > self.rungs.visits {
                self.memory.pulling_back = self.rungs.pull_back;
            }
            return Ok(Some(RecoveryOutcome::Sideways { turn_rad, plane, moved }));
        }
        Ok(None)
    }

    /// Tries the rungs for an initiator that cannot move at all.
    fn try_stationary_rungs<M: ChainMover<D>, const D: usize>(
        &mut self,
        climb: &mut VetoRecoveryAttempt<'_, M, D>,
        situation: &InitiatorSituation,
    ) -> Result<RecoveryOutcome<D>, M::Failure> {
        let memory = &mut self.memory;
        if situation.can_turn && memory.turns < self.rungs.turns {
            memory.turns += 1;
            return Ok(RecoveryOutcome::TurnOnTheSpot { side: memory.side_or_left() });
        }
        if situation.movers_near && memory.waits < self.rungs.waits {
            memory.waits += 1;
            return Ok(RecoveryOutcome::Waiting { n: memory.waits });
        }
        memory.pulling_back = self.rungs.pull_back;
        self.pull_from_other_end(climb)
    }

    /// Lets the other end lead along its rod, or beside it; the initiator is dragged.
    fn pull_from_other_end<M: ChainMover<D>, const D: usize>(
        &mut self,
        climb: &mut VetoRecoveryAttempt<'_, M, D>,
    ) -> Result<RecoveryOutcome<D>, M::Failure> {
        let (k, displacement) = climb.wanted_displacement();
        let begins = self.memory.pulling_back == self.rungs.pull_back;
        if begins && self.memory.hand_overs >= self.rungs.hand_overs {
            return self.report_stuck(climb);
        }
        self.memory.hand_overs += u32::from(begins);
        let Some(ChainEnd { by, at, ahead: u }) = climb.by.farther_end(k)? else {
            return self.report_stuck(climb);
        };
        let axes = axes_across(u);
        let step = scaled(u, norm(displacement));
        // The good side is the initiator's, and means nothing at the other end.
        let turns = turn_sequence(&RecoveryMemory::default(), D - 1);
        for (plane, turn_rad) in std::iter::once((0, 0.0)).chain(turns) {
            let to = add(at, turn_toward(step, u, axes[plane], turn_rad));
            if let Some(moved) = climb.attempt(RequestedMotion::Connector { k: by, to })? {
                self.memory.record_pull_back();
                return Ok(RecoveryOutcome::PulledBack { by, moved });
            }
        }
        self.report_stuck(climb)
    }

    fn report_stuck<M: ChainMover<D>, const D: usize>(
        &mut self,
        climb: &mut VetoRecoveryAttempt<'_, M, D>,
    ) -> Result<RecoveryOutcome<D>, M::Failure> {
        self.memory.forget_failures();
        if climb.vetoes.is_empty() {
            // It is stuck in detours without a veto in this tick, so the wanted motion is tried for its veto.
            let request = MotionRequest { mode: VetoEffect::Exact, ..climb.wanted };
            if let Some(veto) = climb.by.find_veto(&request)? {
                climb.record_veto(veto);
            }
        }
        Ok(RecoveryOutcome::Stuck { vetoes: std::mem::take(&mut climb.vetoes) })
    }
}

fn try_shorter<M: ChainMover<D>, const D: usize>(
    climb: &mut VetoRecoveryAttempt<'_, M, D>,
) -> Result<Option<RecoveryOutcome<D>>, M::Failure> {
    for part in STEP_FRACTIONS {
        if let Some(moved) =
            climb.attempt(climb.with_displacement(|displacement| scaled(displacement, part)))?
        {
            return Ok(Some(RecoveryOutcome::Shorter { part, moved }));
        }
    }
    Ok(None)
}

fn connector_and_target<const D: usize>(motion: &RequestedMotion<D>) -> (usize, Point<D>) {
    match *motion {
        RequestedMotion::Connector { k, to } => (k, to),
        RequestedMotion::Rod { i, to } => (i, to[0]),
    }
}

/// Returns the end of a chain of `n` connectors that is farther from connector `k`.
pub(crate) fn farther_end(k: usize, n: usize) -> usize {
    if 2 * k < n { n - 1 } else { 0 }
}

/// Returns planes and turns in the order in which they are tried. If no side is known to be good,
/// the least turn comes first; otherwise all of that side before the other, so that the chain does
/// not alternate between two detours.
fn turn_sequence(
    memory: &RecoveryMemory,
    planes: usize,
) -> impl Iterator<Item = (usize, f64)> + use<> {
    let side = f64::from(memory.side_or_left());
    let keeps_side = memory.side != 0;
    let first = memory.plane.min(planes - 1);
    let tries = 2 * FAN_RAD.len();
    (0..planes).flat_map(move |p| {
        let plane = (first + p) % planes;
        (0..tries).map(move |t| {
            let is_other_side = if keeps_side { t >= FAN_RAD.len() } else { t % 2 == 1 };
            let angle = if keeps_side { t % FAN_RAD.len() } else { t / 2 };
            let sign = if is_other_side { -side } else { side };
            (plane, sign * FAN_RAD[angle])
        })
    })
}

/// Returns unit vectors across a direction: in the plane to its left, in space toward the second
/// and the third axis.
fn axes_across<const D: usize>(u: Point<D>) -> [Point<D>; 2] {
    if D == 2 {
        return [perpendicular(u); 2];
    }
    [1, 2].map(|axis| {
        let e: Point<D> = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
        let across = add_scaled(e, u, -dot(e, u));
        // A direction along an axis cannot turn toward that axis; any other perpendicular does.
        if norm(across) > 1e-6 { normalized(across).unwrap_or(unit_x()) } else { perpendicular(u) }
    })
}

/// Returns a vector, turned in the plane of two unit vectors from the first toward the second.
fn turn_toward<const D: usize>(
    v: Point<D>,
    u: Point<D>,
    across: Point<D>,
    turn_rad: f64,
) -> Point<D> {
    let x = dot(v, u);
    let y = dot(v, across);
    let c = cos(turn_rad);
    let s = sin(turn_rad);
    let rest = add_scaled(add_scaled(v, u, -x), across, -y);
    add_scaled(add_scaled(rest, u, c * x - s * y), across, s * x + c * y)
}
