//! Phase *claim*: a navigator looks around and decides, and every chain claims the box that it may
//! enter during the cycle.

use super::perceive::Perceiver;
use super::state::ChainBodyState;
use super::world::{ChainSpec, ChainWorld};
use sidestep_kernel::{Cycle, EntitySlot, PhaseContext};
use sidestep_rods::geometry::{Aabb, convert_dimensions};

/// Claims the box of one chain, and keeps its navigator's decision, which is made before anything
/// moves.
pub(crate) fn claim_box_and_decide<const D: usize>(
    phase: &mut PhaseContext<'_, ChainWorld<D>>,
    slot: usize,
) {
    claim_box(phase, slot);
    let &mut PhaseContext { world, state, now, .. } = phase;
    let decision =
        Perceiver { world, state, now, scratch: phase.scratch }.decide(slot as EntitySlot);
    state.set_decision(slot, decision);
}

/// Claims the box that a chain may enter.
pub(crate) fn claim_box<const D: usize>(phase: &mut PhaseContext<'_, ChainWorld<D>>, slot: usize) {
    let &mut PhaseContext { world, state, now, .. } = phase;
    // A chain alone is in no other's way, wherever it goes; and to read it would make a copy of it.
    if !world.has_lone_chain() {
        state.set_claim(slot, cycle_reach_box(world, &world.chains[slot], &state.body(slot), now));
    }
}

/// Returns the box that a chain may enter during one cycle; no part of the chain leaves that box.
fn cycle_reach_box<const D: usize>(
    world: &ChainWorld<D>,
    spec: &ChainSpec<D>,
    body: &ChainBodyState<D>,
    now: Cycle,
) -> Aabb<D> {
    let chain = &body.chain;
    let radius_m = chain.connectors().iter().map(|c| c.radius_m).fold(0.0, f64::max);
    let longest_m = chain.rods().iter().map(|r| r.max_m).fold(0.0, f64::max);
    let gathering_m_s = body.scattered.as_ref().map_or(0.0, |scattered| scattered.speed_m_s);
    let changes = spec.changes.iter();
    let back_m_s = changes.map(|change| change.gather_speed_m_s(now)).fold(gathering_m_s, f64::max);
    // An end that comes back is led as a chain is.
    let fastest_m_s = spec.tasks.iter().map(|t| t.speed_m_s).fold(back_m_s, f64::max);
    let moved_m = match &world.escape {
        Some(escape) => escape.speed_max_m_s * world.dt_s,
        // A rod that turns aside for an obstacle can swing as far as its length to either side.
        None => {
            let led_m = fastest_m_s * world.dt_s;
            let step_m = world.rules.step_m.unwrap_or(chain.step_m());
            let slave_m = (led_m / step_m).ceil().max(1.0) * world.rules.slave_step_max_m;
            2.0 * longest_m.min(slave_m) + led_m
        }
    };
    // Changes take effect in the cycle that follows the claim.
    let thrown_m = spec.changes.iter().map(|change| change.max_scatter_m(now)).fold(0.0, f64::max);
    let chain_box = Aabb::from_points(chain.points())
        .joined(&reference_box(spec, body))
        .grown(radius_m + moved_m + thrown_m + back_m_s * world.dt_s);
    chain_box
        .joined(&robots_reach_box(spec, body, world.dt_s))
        .joined(&links_reach_box(spec, body, world.dt_s))
}

/// Returns the box that the links of an arm with shapes may enter during one cycle, also on their way to its reference;
/// none of other chains.
fn links_reach_box<const D: usize>(
    spec: &ChainSpec<D>,
    body: &ChainBodyState<D>,
    dt_s: f64,
) -> Aabb<D> {
    let (Some(arm), Some(joints)) = (&spec.arm, &body.joints) else { return Aabb::empty() };
    let Some(shapes) = &arm.body else { return Aabb::empty() };
    let reference = body.motion.reference(joints).iter().zip(joints);
    // What is left of the way to the reference, and how far that goes in this cycle.
    let changes: Vec<f64> = reference
        .zip(arm.motion.reference_speeds())
        .map(|((to, from), speed)| (to - from).abs() + speed * dt_s)
        .collect();
    let reach = shapes.reach_box(&arm.travel, arm.posture(joints), &changes);
    Aabb { lo: convert_dimensions(reach.lo), hi: convert_dimensions(reach.hi) }
}

/// Returns the box of the places that an arm's joints may take on their way to their reference; none of other chains,
/// or while they rest.
fn reference_box<const D: usize>(spec: &ChainSpec<D>, body: &ChainBodyState<D>) -> Aabb<D> {
    let (Some(arm), Some(joints)) = (&spec.arm, &body.joints) else { return Aabb::empty() };
    if body.motion.is_at_rest() {
        return Aabb::empty();
    }
    let reference = body.motion.reference(joints);
    let turns = reference.iter().zip(joints).map(|(to, from)| (to - from).abs());
    // A bound on the distance from where the joints are, whatever lies between.
    let way_m: f64 = turns.zip(arm.follower.levers_m()).map(|(turn, lever_m)| turn * lever_m).sum();
    Aabb::from_points(&arm.connector_positions(reference)).grown(way_m)
}

/// Returns the box that the robots of a chain may enter during one cycle. A robot that lags is far from its connector.
fn robots_reach_box<const D: usize>(
    spec: &ChainSpec<D>,
    body: &ChainBodyState<D>,
    dt_s: f64,
) -> Aabb<D> {
    let Some(robots) = &spec.robots else { return Aabb::empty() };
    let reach_m = robots.follower.max_reach_m(dt_s);
    let places = body.robots.iter().map(|robot| convert_dimensions(robot.pose.at));
    places.fold(Aabb::empty(), |all, at| all.joined(&Aabb::from_points(&[at]).grown(reach_m)))
}
