//! What an initiator that moves by itself tries after a veto (slides R8, R9).
//!
//! A ladder with six rungs: shorter steps, other headings, a turn on the spot, waiting, the other
//! end of the chain leads for a while, and the report that it is stuck. Each rung is tried once in
//! a tick, and the first that works ends the climb. The slides leave open what follows a veto;
//! that the other end leads is because a chain can be pulled out of where it was pushed into a
//! fold (design 2.4). A planner or an operator gets the veto and no ladder.

mod memory;
#[cfg(test)]
mod tests;

use super::go::go;
use crate::rods::chain::Chain;
use crate::rods::geometry::{
    Point, add, along, dot, first_axis, norm, perpendicular, scaled, sub, unit,
};
use crate::rods::obstacle::Obstacles;
use crate::rods::propagate::Propagator;
use crate::rods::veto::{Mode, Motion, Moved, Outcome, Request, Source, Veto};
pub(crate) use memory::Memory;
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin};

/// Parts of a step that are tried when all of it is vetoed.
const PARTS: [f64; 3] = [0.5, 0.25, 0.125];
/// Other headings that are tried.
const FAN_RAD: [f64; 5] = [0.4, 0.8, 1.2, 1.6, 2.0];

/// How long the rungs are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rungs {
    /// Turns on the spot in a row before it is given up.
    pub turns: u32,
    /// Ticks in a row that are waited while something moves nearby.
    pub waits: u32,
    /// Ticks that the other end leads.
    pub pull_back: u32,
    /// How often the other end may lead without progress before the chain is stuck.
    pub hand_overs: u32,
    /// How often a detour may lead through the same place without progress.
    pub visits: u32,
    /// Straight ticks after which it is forgotten which side was good.
    pub straight: u32,
}

impl Default for Rungs {
    fn default() -> Self {
        Self { turns: 16, waits: 50, pull_back: 50, hand_overs: 3, visits: 3, straight: 25 }
    }
}

/// What an initiator knows beside its neighborhood.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Situation {
    /// How far its goal is, if it has one. Without there is no progress to miss, and detours
    /// through the same place are not counted.
    pub goal_distance_m: Option<f64>,
    /// Whether something moves nearby, so that waiting may help.
    pub movers_near: bool,
    /// Whether its drive can turn on the spot.
    pub can_turn: bool,
    /// Whether it only goes where it looks, as on wheels: then no other headings are tried.
    pub keeps_heading: bool,
}

/// What a climb came to. The chain has moved where a motion is told, and nowhere else.
#[derive(Debug, Clone, PartialEq)]
pub enum Climbed<const D: usize> {
    /// As wanted.
    Straight(Moved<D>),
    /// A part of the step.
    Shorter {
        /// Which part.
        part: f64,
        /// The motion.
        moved: Moved<D>,
    },
    /// In another direction.
    Sideways {
        /// The turn from the wanted direction; positive to the left, in space towards the axis.
        turn_rad: f64,
        /// In space: 0 where the turn was towards the second axis, 1 towards the third.
        plane: usize,
        /// The motion.
        moved: Moved<D>,
    },
    /// Nothing moved: the drive shall turn.
    TurnOnTheSpot {
        /// 1 to the left, -1 to the right.
        side: i8,
    },
    /// Nothing moved: what is near may go away.
    Waiting {
        /// Ticks waited so far.
        n: u32,
    },
    /// The other end led.
    PulledBack {
        /// That end.
        by: usize,
        /// The motion.
        moved: Moved<D>,
    },
    /// Nothing moved, and no rung is left; all objections, each once.
    Stuck {
        /// From the wanted motion to the last rung; none where the wanted motion would now be free,
        /// and only detours have led here.
        vetoes: Vec<Veto<D>>,
    },
    /// Nothing moved: a planner or an operator wanted it, and is told.
    Vetoed(Veto<D>),
}

/// A ladder, and where on it an initiator stands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ladder {
    /// How long the rungs are.
    pub rungs: Rungs,
    /// What is remembered from tick to tick; part of a checkpoint.
    pub memory: Memory,
}

/// What a climb works on.
struct Climb<'a, const D: usize> {
    chain: &'a mut Chain<D>,
    obstacles: &'a Obstacles<D>,
    propagator: &'a mut Propagator<D>,
    wanted: Request<D>,
    vetoes: Vec<Veto<D>>,
}

impl<const D: usize> Climb<'_, D> {
    /// All of a motion, or none.
    fn attempt(&mut self, motion: Motion<D>) -> Result<Option<Moved<D>>, InputError> {
        let request = Request { motion, mode: Mode::Exact, ..self.wanted };
        Ok(match go(self.propagator, self.chain, self.obstacles, &request)? {
            Outcome::Moved(moved) => Some(moved),
            Outcome::Vetoed(veto) => {
                self.note(veto);
                None
            }
        })
    }

    fn note(&mut self, veto: Veto<D>) {
        let what = |v: &Veto<D>| (v.from, v.by, v.reason, v.obstacle);
        if !self.vetoes.iter().any(|v| what(v) == what(&veto)) {
            self.vetoes.push(veto);
        }
    }

    /// The wanted motion with another way from where the initiator is.
    fn varied(&self, way: impl Fn(Point<D>) -> Point<D>) -> Motion<D> {
        let at = self.chain.points();
        let to = |k: usize, to: Point<D>| add(at[k], way(sub(to, at[k])));
        match self.wanted.motion {
            Motion::Connector { k, to: t } => Motion::Connector { k, to: to(k, t) },
            Motion::Rod { i, to: t } => Motion::Rod { i, to: [to(i, t[0]), to(i + 1, t[1])] },
        }
    }

    /// The initiator and its wanted way.
    fn wanted_way(&self) -> (usize, Point<D>) {
        let (k, to) = head(&self.wanted.motion);
        (k, sub(to, self.chain.points()[k]))
    }
}

impl Ladder {
    /// A ladder whose initiator has met nothing yet.
    pub fn new(rungs: Rungs) -> Self {
        Self { rungs, memory: Memory::default() }
    }

    /// Moves as wanted, or as near to it as a rung allows. The wanted motion is asked for exactly,
    /// whatever its mode: part of the way is a rung of its own.
    ///
    /// # Errors
    /// As [`Propagator::propagate`].
    pub fn climb<const D: usize>(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        propagator: &mut Propagator<D>,
        wanted: &Request<D>,
        situation: &Situation,
    ) -> Result<Climbed<D>, InputError> {
        let told = self.climb_told(chain, obstacles, propagator, wanted, situation);
        told.map(|(climbed, _)| climbed)
    }

    /// The same, and the objection to the wanted motion itself, if there was one.
    ///
    /// # Errors
    /// As [`Propagator::propagate`].
    pub fn climb_told<const D: usize>(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        propagator: &mut Propagator<D>,
        wanted: &Request<D>,
        situation: &Situation,
    ) -> Result<(Climbed<D>, Option<Veto<D>>), InputError> {
        if wanted.source != Source::Autonomous {
            return Ok(match go(propagator, chain, obstacles, wanted)? {
                Outcome::Moved(moved) => (Climbed::Straight(moved), None),
                Outcome::Vetoed(veto) => (Climbed::Vetoed(veto), Some(veto)),
            });
        }
        let vetoes = Vec::new();
        let mut climb = Climb { chain, obstacles, propagator, wanted: *wanted, vetoes };
        self.memory.note_goal(situation.goal_distance_m);
        if self.memory.pulling_back > 0 {
            return Ok((self.pull_back(&mut climb)?, None));
        }
        if let Some(moved) = climb.attempt(wanted.motion)? {
            self.memory.went_straight(self.rungs.straight);
            return Ok((Climbed::Straight(moved), None));
        }
        let objection = climb.vetoes.first().copied();
        Ok((self.after_a_veto(&mut climb, situation)?, objection))
    }

    /// The rungs one after the other.
    fn after_a_veto<const D: usize>(
        &mut self,
        climb: &mut Climb<'_, D>,
        situation: &Situation,
    ) -> Result<Climbed<D>, InputError> {
        if let Some(came) = shorter(climb)? {
            self.memory.moved_on();
            return Ok(came);
        }
        match self.sideways(climb, situation)? {
            Some(came) => Ok(came),
            None => self.without_a_way(climb, situation),
        }
    }

    /// Other headings, first those on the side where one was good.
    fn sideways<const D: usize>(
        &mut self,
        climb: &mut Climb<'_, D>,
        situation: &Situation,
    ) -> Result<Option<Climbed<D>>, InputError> {
        let (k, way) = climb.wanted_way();
        let Some(u) = unit(way).filter(|_| !situation.keeps_heading) else { return Ok(None) };
        let axes = axes_across(u);
        for (plane, turn_rad) in fan(&self.memory, D - 1) {
            let turn = |v| turned(v, u, axes[plane], turn_rad);
            let Some(moved) = climb.attempt(climb.varied(turn))? else { continue };
            self.memory.went_sideways(plane, turn_rad);
            let place = memory::place(climb.chain.points()[k], u);
            if self.memory.visit(place, situation.goal_distance_m) > self.rungs.visits {
                self.memory.pulling_back = self.rungs.pull_back;
            }
            return Ok(Some(Climbed::Sideways { turn_rad, plane, moved }));
        }
        Ok(None)
    }

    /// The rungs for an initiator that cannot move at all.
    fn without_a_way<const D: usize>(
        &mut self,
        climb: &mut Climb<'_, D>,
        situation: &Situation,
    ) -> Result<Climbed<D>, InputError> {
        let memory = &mut self.memory;
        if situation.can_turn && memory.turns < self.rungs.turns {
            memory.turns += 1;
            return Ok(Climbed::TurnOnTheSpot { side: memory.side_or_left() });
        }
        if situation.movers_near && memory.waits < self.rungs.waits {
            memory.waits += 1;
            return Ok(Climbed::Waiting { n: memory.waits });
        }
        memory.pulling_back = self.rungs.pull_back;
        self.pull_back(climb)
    }

    /// The other end goes on along its rod, or beside it; the initiator is dragged.
    fn pull_back<const D: usize>(
        &mut self,
        climb: &mut Climb<'_, D>,
    ) -> Result<Climbed<D>, InputError> {
        let (k, way) = climb.wanted_way();
        let begins = self.memory.pulling_back == self.rungs.pull_back;
        if begins && self.memory.hand_overs >= self.rungs.hand_overs {
            return self.stuck(climb);
        }
        self.memory.hand_overs += u32::from(begins);
        let Some((by, u)) = other_end(climb.chain, k) else { return self.stuck(climb) };
        let at = climb.chain.points()[by];
        let axes = axes_across(u);
        let step = scaled(u, norm(way));
        let ways = fan(&Memory::default(), D - 1);
        for (plane, turn_rad) in std::iter::once((0, 0.0)).chain(ways) {
            let to = add(at, turned(step, u, axes[plane], turn_rad));
            if let Some(moved) = climb.attempt(Motion::Connector { k: by, to })? {
                self.memory.pulled_back();
                return Ok(Climbed::PulledBack { by, moved });
            }
        }
        self.stuck(climb)
    }

    fn stuck<const D: usize>(
        &mut self,
        climb: &mut Climb<'_, D>,
    ) -> Result<Climbed<D>, InputError> {
        self.memory.starts_afresh();
        if climb.vetoes.is_empty() {
            // Its detours have led nowhere, and it has tried nothing since: what is in the way?
            let request = Request { mode: Mode::Exact, ..climb.wanted };
            let mut chain = climb.chain.clone();
            let tried = go(climb.propagator, &mut chain, climb.obstacles, &request)?;
            tried.veto().into_iter().for_each(|veto| climb.note(*veto));
        }
        Ok(Climbed::Stuck { vetoes: std::mem::take(&mut climb.vetoes) })
    }
}

fn shorter<const D: usize>(climb: &mut Climb<'_, D>) -> Result<Option<Climbed<D>>, InputError> {
    for part in PARTS {
        if let Some(moved) = climb.attempt(climb.varied(|way| scaled(way, part)))? {
            return Ok(Some(Climbed::Shorter { part, moved }));
        }
    }
    Ok(None)
}

fn head<const D: usize>(motion: &Motion<D>) -> (usize, Point<D>) {
    match *motion {
        Motion::Connector { k, to } => (k, to),
        Motion::Rod { i, to } => (i, to[0]),
    }
}

/// The end further from an initiator, and the direction in which its rod points out of the chain;
/// `None` for a chain of one connector.
fn other_end<const D: usize>(chain: &Chain<D>, k: usize) -> Option<(usize, Point<D>)> {
    let last = chain.points().len() - 1;
    let (by, neighbor) = if 2 * k <= last { (last, last.checked_sub(1)?) } else { (0, 1) };
    let u = unit(sub(chain.points()[by], chain.points()[neighbor]))?;
    Some((by, u))
}

/// Planes and turns in the order in which they are tried. Where no side is known to be good, the
/// least turn first; otherwise all of that side before the other, so that two ways round do not
/// take turns.
fn fan(memory: &Memory, planes: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
    let side = f64::from(memory.side_or_left());
    let keeps_side = memory.side != 0;
    let first = memory.plane.min(planes - 1);
    let tries = 2 * FAN_RAD.len();
    (0..planes).flat_map(move |p| {
        let plane = (first + p) % planes;
        (0..tries).map(move |t| {
            let (angle, is_other) =
                if keeps_side { (t % FAN_RAD.len(), t / FAN_RAD.len()) } else { (t / 2, t % 2) };
            let sign = if is_other == 0 { side } else { -side };
            (plane, sign * FAN_RAD[angle])
        })
    })
}

/// Unit vectors across a direction: in the plane to its left, in space towards the second and the
/// third axis.
fn axes_across<const D: usize>(u: Point<D>) -> [Point<D>; 2] {
    if D == 2 {
        return [perpendicular(u); 2];
    }
    [1, 2].map(|axis| {
        let e: Point<D> = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
        let across = along(e, u, -dot(e, u));
        // Along an axis there is no turn towards it, and any other does.
        if norm(across) > 1e-6 { unit(across).unwrap_or(first_axis()) } else { perpendicular(u) }
    })
}

/// A vector, turned in the plane of two unit vectors from the first towards the second.
fn turned<const D: usize>(v: Point<D>, u: Point<D>, across: Point<D>, turn_rad: f64) -> Point<D> {
    let (x, y) = (dot(v, u), dot(v, across));
    let (c, s) = (cos(turn_rad), sin(turn_rad));
    let rest = along(along(v, u, -x), across, -y);
    along(along(rest, u, c * x - s * y), across, s * x + c * y)
}
