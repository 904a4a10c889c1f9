//! The exact Markov chain of a scenario with one robot, and the simulator compared with it.

use crate::RobotsRun;
use crate::purpose;
use crate::scenario::Compiled;
use crate::world::{Body, Door, RobotModel, RobotsWorld, Role};
use sidestep_error_models::RandomPolicy;
use sidestep_exact::{Comparison, GridPose, MarkovModel, SingleRobot};
use sidestep_kernel::distr::Bernoulli;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{EntityId, InputError, Seed, Simulation};
use sidestep_scenario::Source;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Computes the model of a scenario's one robot.
///
/// # Errors
/// Those of [`single_robot`] and [`MarkovModel::new`].
pub fn markov_model(compiled: &Compiled) -> Result<MarkovModel, InputError> {
    MarkovModel::new(single_robot(compiled)?)
}

/// Returns the one robot of a scenario in which nothing else moves; doors that never open are walls of their kind.
///
/// # Errors
/// When there are more robots or none, or other bodies that move.
pub fn single_robot(compiled: &Compiled) -> Result<SingleRobot, InputError> {
    let world = &compiled.world;
    let mut doors = BTreeMap::new();
    let mut robots = Vec::new();
    for &body in &world.bodies {
        let ty = &world.types[usize::from(body.ty)];
        match &ty.role {
            Role::Robot(model) => robots.push((body, model, ty.size.0)),
            Role::Mover(_) => {
                let kind = &world.kinds[usize::from(ty.kind)];
                let cause = format!("body {} (kind `{kind}`) moves by itself", body.id);
                let remedy = "leave out [people]: a chain has one moving body";
                return Err(InputError::new(source_name(compiled), cause, remedy));
            }
            Role::Door(door) if is_always_closed(door) => {
                doors.extend(covered_boxes(compiled, body.id).map(|at| (at, ty.kind)));
            }
            Role::Door(_) => {
                let cause = format!("door {} opens", body.id);
                let remedy = "keep doors closed with periodic = { open = 0, closed = 1 }, or leave out [doors]";
                return Err(InputError::new(source_name(compiled), cause, remedy));
            }
        }
    }
    let [(body, model, size)] = robots[..] else {
        let cause = format!("{} robots", robots.len());
        let remedy = "give one robot: [robots] with count = 1, or --set robots.count=1";
        return Err(InputError::new(source_name(compiled), cause, remedy));
    };
    if !world.planner_teams.is_empty() {
        let cause =
            "a planner leads the robot, and the states of a chain do not say what that remembers";
        let remedy = "leave out `planner` and `team` of the robots";
        return Err(InputError::new(source_name(compiled), cause, remedy));
    }
    if body.action_cycles > 1 {
        let cycles = body.action_cycles;
        let cause = format!(
            "the robot's actions take {cycles} cycles, and the states of a chain do not say how long one goes on"
        );
        let remedy = format!("give period = {cycles} instead of action_cycles = {cycles}");
        return Err(InputError::new(source_name(compiled), cause, remedy));
    }
    if model.body.delays.is_some() {
        let effector = &model.body.effector.name;
        let cause = format!(
            "the robot's effector `{effector}` has delays, and the states of a chain do not say how long one goes on"
        );
        let remedy = format!(
            "set p = 0 in [effectors.{effector}.delays], or --regime sensors, in which effectors do not err at all"
        );
        return Err(InputError::new(source_name(compiled), cause, remedy));
    }
    Ok(robot(compiled, doors, body, model, size))
}

fn is_always_closed(door: &Door) -> bool {
    match *door {
        Door::Periodic { open, .. } => open == 0,
        Door::Random { open, .. } => open == Bernoulli::new(0.0),
    }
}

/// Returns the boxes that a body covers at the start.
fn covered_boxes(compiled: &Compiled, id: EntityId) -> impl Iterator<Item = (i32, i32)> {
    let (width, height) = compiled.world.type_of(id).size;
    let ((col, row), _) = compiled.start[id as usize];
    let boxes = (row..row + height).flat_map(move |r| (col..col + width).map(move |c| (c, r)));
    boxes.map(|(c, r)| (c as i32, r as i32))
}

fn robot(
    compiled: &Compiled,
    doors: BTreeMap<(i32, i32), u8>,
    timing: Body,
    model: &RobotModel,
    size: u32,
) -> SingleRobot {
    let world = &compiled.world;
    let ((col, row), heading) = compiled.start[timing.id as usize];
    SingleRobot {
        place: source_name(compiled),
        map: Arc::clone(&world.map),
        doors,
        kinds: world.kinds.clone(),
        obstacle_rule: world.obstacle_rule,
        start: GridPose { col: col as i32, row: row as i32, heading },
        size,
        period: timing.period,
        phase: timing.phase,
        sensors: model.body.sensors.iter().map(|sensor| sensor.model.clone()).collect(),
        has_reliable_sensors: world.regime.has_reliable_sensors(),
        effector: model.body.effector.clone(),
        has_reliable_effector: world.regime.has_reliable_effectors(),
    }
}

/// Returns the name of the scenario in errors.
fn source_name(compiled: &Compiled) -> String {
    if compiled.name.is_empty() {
        "the scenario".into()
    } else {
        format!("scenario `{}`", compiled.name)
    }
}

/// Runs the scenario's robot `runs` times for `cycles` cycles from its start under `policy`
/// (each run with a seed that is drawn from the scenario's) and compares where it ends with
/// [`MarkovChain::distribution_after`](sidestep_exact::MarkovChain::distribution_after).
///
/// # Errors
/// When the scenario is not a chain, see [`markov_model`], or `runs` is 0.
pub fn compare(
    compiled: &Compiled,
    source: &Source,
    policy: &RandomPolicy,
    cycles: u64,
    runs: u32,
) -> Result<Comparison, InputError> {
    if runs == 0 {
        return Err(InputError::new("--runs", "no run at all", "give 1000 or more"));
    }
    let model = markov_model(compiled)?;
    let chain = model.chain(policy)?;
    let exact = chain.pose_distribution(&chain.distribution_after(model.actions_in(cycles)));
    let counts = count_final_poses(compiled, source, policy, cycles, runs);
    Ok(Comparison::new(&exact, &counts, cycles, runs))
}

/// Each run has a seed of its own; all share the tables of sensors and effectors.
fn count_final_poses(
    compiled: &Compiled,
    source: &Source,
    policy: &RandomPolicy,
    cycles: u64,
    runs: u32,
) -> BTreeMap<GridPose, u32> {
    let mut world = (*compiled.world).clone();
    set_policy(&mut world, policy);
    let mut counts = BTreeMap::new();
    for run in 0..u64::from(runs) {
        world.streams = Streams::new(run_seed(compiled.seed, run));
        let compiled = Compiled { world: Arc::new(world.clone()), ..compiled.clone() };
        let mut simulation = compiled.start(source, 1);
        simulation.advance(cycles);
        *counts.entry(robot_pose(&simulation)).or_insert(0) += 1;
    }
    counts
}

/// Returns the seed of a run. It is drawn, because scenarios with neighboring seeds would share
/// runs if it were counted up from theirs.
fn run_seed(seed: u64, run: u64) -> Seed {
    Seed(Streams::new(Seed(seed)).draws(0, run, purpose::RUN).next_u64())
}

/// Gives the robots another behavior. All else of them stays, so that sensors and effectors are tabulated once.
fn set_policy(world: &mut RobotsWorld, policy: &RandomPolicy) {
    for ty in &mut world.types {
        if let Role::Robot(model) = &mut ty.role {
            model.behaviour = Arc::new(policy.clone());
        }
    }
}

fn robot_pose(simulation: &RobotsRun) -> GridPose {
    let world = simulation.world();
    let state = simulation.state();
    let slot = world.robots()[0];
    let (col, row) = world.map_position(state.position(slot));
    let heading = state.bodies[slot as usize].facing.get().heading();
    GridPose { col: col as i32, row: row as i32, heading }
}

#[cfg(test)]
mod tests {
    use super::run_seed;
    use std::collections::BTreeSet;

    #[test]
    fn scenarios_with_neighboring_seeds_share_no_run() {
        let runs = |seed| (0..2000).map(move |run| run_seed(seed, run).0);
        let all: BTreeSet<u64> = (1..=3).flat_map(runs).collect();
        assert_eq!(all.len(), 3 * 2000);
    }
}
