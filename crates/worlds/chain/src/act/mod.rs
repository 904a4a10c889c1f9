//! Phase *act*: the actions of one chain in a cycle.
//!
//! Its inputs are in a [`ChainContext`], a small context that is copied and that nothing changes: the world, the chain's
//! share of it, the cycle and the obstacles around. Everything that it changes is in [`ActState`]: the chain's body,
//! beside the places from which it set out, and the books of events and notes. The parts are functions over these
//! two, or over less where they need less; joints, robots on wheels, agents and escapes have small structs of their
//! own. Decisions go one way, as values: an escape says whether the chain is pressed, a driver has a
//! [`Wish`](wish::Wish), which has an outcome, and the bounds, the answer and the measures go on from there. A part
//! calls only parts to the right of it or below it.
//!
//! ```text
//! broken.rs, gather.rs -> bounds.rs (out of the way) -> drive.rs -> bounds.rs (back into the claim) -> obey.rs
//!                      -> follow.rs -> measure.rs
//! drive.rs -> wish.rs -> wheels.rs, plan.rs, obey.rs     what the initiator wants
//!          -> foresee.rs                                 whether it rests instead
//!          -> wheels.rs -> go.rs -> joints.rs, outcome.rs -> tasks.rs
//! go.rs    -> later.rs                                   where nothing can object
//!          -> talk.rs                                    where each connector has an agent
//! ```

mod bounds;
mod broken;
mod defer;
mod desired_move;
mod drive;
mod event_sink;
mod follow;
mod gather;
mod initiator;
mod joints;
mod lookahead;
mod measure;
mod negotiation;
mod orders;
mod outcome;
mod plan;
mod situation;
mod tasks;
#[cfg(test)]
mod tests;
mod wheels;

use super::deploy::Deployment;
use super::driver::{Task, VetoRecord};
use super::events::{Event, EventKind};
use super::scratch::PositionBuffer;
use super::state::Body;
use super::world::{ChainSpec, ChainWorld};
use bounds::EscapeContext;
use desired_move::{CycleInputs, InitiatorContext};
use event_sink::EventSink;
use negotiation::Negotiation;
use sidestep_kernel::stream::{Draws, Purpose};
use sidestep_kernel::{Cycle, PhaseContext, Slot};
use sidestep_rods::geometry::{Bounds, Point, distance};
use sidestep_rods::{Obstacles, Propagator, Veto};

/// The setting in which a chain acts: nothing changes it during the cycle.
#[derive(Clone, Copy)]
struct ChainContext<'a, const D: usize> {
    world: &'a ChainWorld<D>,
    spec: &'a ChainSpec<D>,
    slot: Slot,
    now: Cycle,
    obstacles: &'a Obstacles<D>,
}

/// The initiator of a chain in a cycle.
#[derive(Clone, Copy)]
struct Initiator<'a, const D: usize> {
    setting: ChainContext<'a, D>,
    task: &'a Task<D>,
    follows: FollowMode,
}

/// Ways in which the rest of a chain follows its initiator.
#[derive(Clone, Copy, PartialEq, Eq)]
enum FollowMode {
    /// At once, moved by one process.
    AtOnce,
    /// At once, each connector moved by its agent.
    AsTeam,
    /// Later, because nothing can object: only the initiator moves for now.
    Deferred,
}

/// A chain as it acts: what its cycle changes.
struct ActState<'a, const D: usize> {
    body: &'a mut Body<D>,
    /// The places where it was before the cycle.
    before: &'a PositionBuffer<D>,
    propagator: &'a mut Propagator<D>,
    talk: Negotiation<'a, D>,
    told: EventSink<'a, D>,
}

/// Lets the chains of one conflict group act, one after the other.
pub(crate) fn act<const D: usize>(turn: &mut PhaseContext<'_, ChainWorld<D>>, group: &mut [Slot]) {
    group.sort_unstable();
    for &slot in &*group {
        act_one(turn, group, slot);
    }
}

/// Lets one chain of a conflict group act.
pub(crate) fn act_one<const D: usize>(
    turn: &mut PhaseContext<'_, ChainWorld<D>>,
    group: &[Slot],
    slot: Slot,
) {
    let &mut PhaseContext { world, state, now, .. } = turn;
    let claim = state.claim(slot as usize);
    let meets = |s: &Slot| *s != slot && state.claim(*s as usize).meets(&claim);
    turn.scratch.around.gather(world, state, now + 1, group.iter().copied().filter(meets));
    run_cycle(turn, slot, claim);
}

/// Makes one cycle of a chain, which stays in its claim.
fn run_cycle<const D: usize>(
    turn: &mut PhaseContext<'_, ChainWorld<D>>,
    slot: Slot,
    claim: Bounds<D>,
) {
    let &mut PhaseContext { world, state, now, .. } = turn;
    let scratch = &mut *turn.scratch;
    let spec = &world.chains[slot as usize];
    let setting = ChainContext { world, spec, slot, now, obstacles: &scratch.around.all };
    let notes = scratch.notes.as_deref_mut().filter(|notes| notes.slot == slot);
    let mut told = EventSink { slot, now, events: &mut scratch.events, notes };
    let mut body = state.body_mut(slot as usize);
    let body = &mut *body;
    broken::apply_changes(setting, body, &mut told);
    let heard =
        CycleInputs { decision: state.decision(slot as usize), orders: orders::take_orders(body) };
    let follows = FollowMode::choose(setting, body);
    if follows != FollowMode::Deferred {
        body.catch_up();
        scratch.before.record(body);
        scratch.escaped.record(body);
    }
    let (escaper, escaped) = (scratch.escaper.as_mut(), &mut scratch.escaped);
    let mut escaping = EscapeContext { escaper, escaped, claim };
    let (before, propagator) = (&scratch.before, &mut scratch.propagator);
    let talk = Negotiation::new(scratch.shown.as_mut());
    let mut acting = ActState { body, before, propagator, talk, told };
    if follows == FollowMode::Deferred {
        let guide = InitiatorContext { heard, follows, escaping: &escaping, is_pressed: false };
        drive::run_task(setting, &mut acting, &guide);
        acting.body.tally.steps += 1;
        return;
    }
    match acting.body.scattered {
        Some(_) => gather::gather_parts(setting, acting.body, &mut acting.told),
        None => act_whole_chain(setting, &mut acting, &mut escaping, heard, follows),
    }
    let (solid, seen) = (scratch.around.solid(), &mut scratch.seen);
    let robots_gap_m = follow::follow(setting, &mut acting, solid, seen);
    measure::measure(setting, &mut acting, &mut scratch.own, robots_gap_m);
}

/// Lets a whole chain get out of the way, carry out its task, and stay in its claim.
fn act_whole_chain<const D: usize>(
    setting: ChainContext<'_, D>,
    acting: &mut ActState<'_, D>,
    escaping: &mut EscapeContext<'_, D>,
    heard: CycleInputs,
    follows: FollowMode,
) {
    let is_pressed = escaping.escape(setting, acting);
    let guide = InitiatorContext { heard, follows, escaping, is_pressed };
    let driven = drive::run_task(setting, acting, &guide);
    if follows == FollowMode::AsTeam {
        negotiation::negotiate_rest(setting, acting);
    }
    let veto = escaping.enforce_claim(setting, acting.body, acting.before);
    if let Some(veto) = &veto {
        acting.record_veto(veto);
    }
    let Some(errand) = driven.errand else { return };
    if let Some(veto) = &veto {
        orders::record_result_veto(acting.body, veto);
    }
    orders::complete_result(acting.body, &errand, driven.gives_way);
}

impl<'a, const D: usize> ChainContext<'a, D> {
    /// Returns the present task; none after the last.
    fn task(self, body: &Body<D>) -> Option<&'a Task<D>> {
        self.spec.tasks.get(body.driving.task as usize)
    }

    /// Returns the chain's random draws of this cycle for a purpose.
    fn draws(self, purpose: Purpose) -> Draws {
        self.world.streams.draws(self.slot, self.now, purpose)
    }
}

impl<const D: usize> Initiator<'_, D> {
    /// Returns the place of the initiator.
    fn position(self, body: &Body<D>) -> Point<D> {
        body.chain.points()[self.task.agent]
    }

    /// Returns the way that it goes in a cycle at its speed, meters.
    fn step_m(self) -> f64 {
        self.task.speed_m_s * self.setting.world.dt_s
    }
}

impl FollowMode {
    /// Returns how a chain follows its initiator in this cycle.
    fn choose<const D: usize>(setting: ChainContext<'_, D>, body: &Body<D>) -> Self {
        match setting.world.deployment {
            Deployment::Team => Self::AsTeam,
            Deployment::Direct if defer::may_defer(setting, body) => Self::Deferred,
            Deployment::Direct => Self::AtOnce,
        }
    }
}

impl<const D: usize> ActState<'_, D> {
    /// Counts a veto; of several in a row by one connector for one reason only the first is an
    /// event.
    fn record_veto(&mut self, veto: &Veto<D>) {
        let Self { body, before, told, .. } = self;
        body.tally.add_veto(veto.reason);
        told.trace(|notes| notes.vetoes.push(*veto));
        let objection = Some(VetoRecord { by: veto.by as u32, reason: veto.reason });
        let driving = &mut body.driving;
        if driving.told.is_none() || driving.objection != objection {
            let way_m = distance(veto.reached, before.points[veto.from]);
            let event = told.event(&body.chain, EventKind::Veto, veto.by, way_m);
            let (reason, obstacle) = (Some(veto.reason), veto.obstacle);
            told.events.push(Event { reason, obstacle, ..event });
            driving.told = driving.told.or(Some(EventKind::Veto));
        }
        driving.objection = objection;
    }
}
