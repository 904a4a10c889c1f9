//! Phase *act*: the actions of one chain in a cycle.
//!
//! Its inputs are in a [`ChainContext`], which is copied and never changes: the world, the chain's share of it, the
//! cycle and the nearby obstacles. Everything that it changes is in [`ChainCycleState`]: the chain's body, beside the
//! positions before the cycle, and the sink of events. The parts are functions over these two, or over less where
//! they need less; joints, robots on wheels, agents and escapes have small structs of their own. Decisions are
//! values that are passed on in one direction: an escape returns whether the chain is pressed, a driver returns a
//! [`DesiredMove`](desired_move::DesiredMove), whose outcome the claim, the result of orders and the measures use.
//! A part calls only parts to the right of it or below it.
//!
//! ```text
//! broken.rs, gather.rs -> part_ways.rs
//! broken.rs, gather.rs -> bounds.rs (escape) -> drive.rs -> bounds.rs (back into the claim) -> orders.rs
//!                      -> joint_motion.rs -> follow.rs -> measure.rs
//! drive.rs     -> task_moves.rs -> wheels.rs, plan.rs, orders.rs   what the initiator wants
//!              -> joint_goals.rs -> plan.rs                          ... of an arm's tool and joints
//!              -> own_driver.rs                                      ... by a driver of the program's own
//!              -> lookahead.rs                                       whether it rests instead
//!              -> wheels.rs -> initiator.rs -> joints.rs, outcome.rs -> tasks.rs
//! initiator.rs -> defer.rs                                           where nothing can veto
//!              -> negotiation.rs                                     where each connector has an agent
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
mod joint_goals;
mod joint_motion;
mod joints;
mod lookahead;
mod measure;
mod negotiation;
mod orders;
mod outcome;
mod own_driver;
mod part_ways;
mod plan;
mod situation;
mod task_moves;
mod tasks;
#[cfg(test)]
mod tests;
mod wheels;

use super::deploy::Deployment;
use super::driver::{Task, VetoRecord};
use super::events::{Event, EventKind};
use super::scratch::PositionBuffer;
use super::state::ChainBodyState;
use super::world::{ChainSpec, ChainWorld};
use bounds::EscapeContext;
use event_sink::EventSink;
use negotiation::Negotiation;
use sidestep_kernel::stream::{Draws, Purpose};
use sidestep_kernel::{Cycle, EntitySlot, PhaseContext};
use sidestep_rods::geometry::{Aabb, Point, distance};
use sidestep_rods::{Obstacles, Propagator, Veto};
use task_moves::{CycleInputs, InitiatorContext};

/// The circumstances in which a chain acts, constant during the cycle.
#[derive(Clone, Copy)]
struct ChainContext<'a, const D: usize> {
    world: &'a ChainWorld<D>,
    spec: &'a ChainSpec<D>,
    slot: EntitySlot,
    now: Cycle,
    obstacles: &'a Obstacles<D>,
}

/// The initiator of a chain in a cycle.
#[derive(Clone, Copy)]
struct Initiator<'a, const D: usize> {
    context: ChainContext<'a, D>,
    task: &'a Task<D>,
}

/// How the rest of a chain follows its initiator.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ChainFollowMode {
    /// At once, moved by one process.
    AtOnce,
    /// At once, each connector moved by its agent.
    AsTeam,
    /// Later, because nothing can veto: only the initiator moves for now.
    Deferred,
}

/// A chain as it acts: what its cycle changes.
struct ChainCycleState<'a, const D: usize> {
    body: &'a mut ChainBodyState<D>,
    follows: ChainFollowMode,
    /// Its positions before the cycle; of an arm those of its reference. Of a chain that follows later they are not
    /// recorded.
    before: &'a mut PositionBuffer<D>,
    /// Where an arm was before the cycle; of other chains the same positions.
    actual: &'a mut PositionBuffer<D>,
    propagator: &'a mut Propagator<D>,
    negotiation: Negotiation<'a, D>,
    sink: EventSink<'a, D>,
}

/// Lets the chains of one conflict group act, one after the other.
pub(crate) fn act<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    group: &mut [EntitySlot],
) {
    // The order of a group depends on the workers that joined it; results must not.
    group.sort_unstable();
    for &slot in &*group {
        act_one(phase, group, slot);
    }
}

/// Lets one chain of a conflict group act.
pub(crate) fn act_one<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    group: &[EntitySlot],
    slot: EntitySlot,
) {
    let &mut PhaseContext { world, state, now, .. } = phase;
    let claim = state.claim(slot as usize);
    let others = group.iter().copied();
    let others = others.filter(|s| *s != slot && state.claim(*s as usize).intersects(&claim));
    // Movers stand where they will be at the end of the cycle, because that is where the chain's motions lead.
    phase.scratch.nearby.gather(world, state, now + 1, others);
    run_cycle(phase, slot, claim);
}

/// Runs one cycle of a chain, which stays in its claim.
fn run_cycle<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    slot: EntitySlot,
    claim: Aabb<D>,
) {
    let &mut PhaseContext { world, state, now, .. } = phase;
    let scratch = &mut *phase.scratch;
    let spec = &world.chains[slot as usize];
    let context = ChainContext { world, spec, slot, now, obstacles: &scratch.nearby.all };
    let trace = scratch.trace.as_deref_mut().filter(|trace| trace.slot == slot);
    let mut sink = EventSink { slot, now, events: &mut scratch.events, trace };
    let mut body = state.body_mut(slot as usize);
    let body = &mut *body;
    broken::apply_changes(context, body, &mut sink);
    let inputs =
        CycleInputs { decision: state.decision(slot as usize), orders: orders::take_orders(body) };
    let follows = ChainFollowMode::choose_follow_mode(context, body);
    if follows != ChainFollowMode::Deferred {
        body.apply_deferred_motions();
        scratch.actual.record(body);
    }
    let joints = joint_motion::start_cycle(context, body);
    if follows != ChainFollowMode::Deferred {
        scratch.before.record(body);
        // Only what escapes, or has neighbors, is ever put back there.
        if world.escape.is_some() || world.chains.len() > 1 {
            scratch.escaped.record(body);
        } else {
            scratch.escaped.points.clear();
        }
    }
    let mut escaping =
        EscapeContext { escaper: scratch.escaper.as_mut(), escaped: &mut scratch.escaped, claim };
    let before = &mut scratch.before;
    let actual = &mut scratch.actual;
    let propagator = &mut scratch.propagator;
    let negotiation = Negotiation::new(scratch.percept_log.as_mut());
    let mut acting =
        ChainCycleState { body, follows, before, actual, propagator, negotiation, sink };
    if follows == ChainFollowMode::Deferred {
        let lead_context = InitiatorContext { inputs, escaping: &escaping, is_pressed: false };
        drive::run_task_cycle(context, &mut acting, &lead_context);
        if acting.follows == ChainFollowMode::Deferred {
            // Its measures are taken when the chain follows: no obstacle is there to measure a distance to.
            acting.body.tally.steps += 1;
        } else {
            measure::measure_chain(context, &mut acting, &mut scratch.own_rods, f64::INFINITY);
        }
        return;
    }
    if acting.body.scattered.is_some() {
        gather::gather_parts(context, &mut acting, claim);
    } else {
        act_whole_chain(context, &mut acting, &mut escaping, inputs);
    }
    joint_motion::finish_cycle(context, acting.body, joints);
    let solid = scratch.nearby.obstacles_solid_to_robots();
    let robots_gap_m =
        follow::move_swarm_robots(context, &mut acting, solid, &mut scratch.robot_bodies);
    measure::measure_chain(context, &mut acting, &mut scratch.own_rods, robots_gap_m);
}

/// Lets a whole chain escape from obstacles, carry out its task, and stay in its claim. Escapes come first, because
/// they may use up the speed that the task would need.
fn act_whole_chain<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    escaping: &mut EscapeContext<'_, D>,
    inputs: CycleInputs,
) {
    let is_pressed = escaping.escape(context, acting);
    let lead_context = InitiatorContext { inputs, escaping, is_pressed };
    let outcome = drive::run_task_cycle(context, acting, &lead_context);
    if acting.follows == ChainFollowMode::AsTeam {
        negotiation::negotiate_without_motion(context, acting);
    }
    let veto = escaping.enforce_claim(context, acting.body, acting.before);
    if let Some(veto) = &veto {
        acting.record_veto(veto);
    }
    let Some(step) = outcome.step else { return };
    if let Some(veto) = &veto {
        orders::record_order_veto(acting.body, veto);
    }
    orders::complete_result(acting.body, &step, outcome.gives_way);
}

impl<'a, const D: usize> ChainContext<'a, D> {
    /// Returns the present task; none after the last.
    fn task(self, body: &ChainBodyState<D>) -> Option<&'a Task<D>> {
        self.spec.tasks.get(body.driving.task as usize)
    }

    /// Returns the chain's random draws of this cycle for a purpose.
    fn random_draws(self, purpose: Purpose) -> Draws {
        self.world.streams.draws(self.slot, self.now, purpose)
    }
}

impl<const D: usize> Initiator<'_, D> {
    fn position(self, body: &ChainBodyState<D>) -> Point<D> {
        body.chain.points()[self.task.agent]
    }

    /// Returns the distance that it travels in a cycle at its speed, meters.
    fn step_m(self) -> f64 {
        self.task.speed_m_s * self.context.world.dt_s
    }
}

impl ChainFollowMode {
    /// Returns how a chain follows its initiator in this cycle.
    fn choose_follow_mode<const D: usize>(
        context: ChainContext<'_, D>,
        body: &ChainBodyState<D>,
    ) -> Self {
        match context.world.deployment {
            Deployment::Team => Self::AsTeam,
            Deployment::Direct if defer::may_defer(context, body) => Self::Deferred,
            Deployment::Direct => Self::AtOnce,
        }
    }
}

impl<const D: usize> ChainCycleState<'_, D> {
    /// Lets a chain follow its initiator at once where it was to follow later, before anything moves in this cycle.
    fn follow_at_once(&mut self) {
        if self.follows != ChainFollowMode::Deferred {
            return;
        }
        self.follows = ChainFollowMode::AtOnce;
        self.body.apply_deferred_motions();
        self.actual.record(self.body);
        self.before.record(self.body);
    }

    /// Counts a veto; of several in a row by one connector for one reason only the first is an
    /// event, because a chain that is blocked meets the same veto in every cycle.
    fn record_veto(&mut self, veto: &Veto<D>) {
        let Self { body, before, sink, .. } = self;
        body.tally.add_veto(veto.reason);
        sink.record_in_trace(|trace| trace.vetoes.push(*veto));
        let objection = Some(VetoRecord { by: veto.by as u32, reason: veto.reason });
        let driving = &mut body.driving;
        if driving.last_event.is_none() || driving.objection != objection {
            let traveled_m = distance(veto.reached, before.points[veto.from]);
            let event = sink.new_event(&body.chain, EventKind::Veto, veto.by, traveled_m);
            sink.events.push(Event { reason: Some(veto.reason), obstacle: veto.obstacle, ..event });
            driving.last_event = driving.last_event.or(Some(EventKind::Veto));
        }
        driving.objection = objection;
    }
}
