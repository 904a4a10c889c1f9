//! The simulator against the exact chain: a test of the distribution of final poses.

use super::MarkovModel;
use super::markov_chain::total_variation;
use super::obstacle::GridPose;
use crate::RobotsRun;
use crate::decide::RandomPolicy;
use crate::purpose;
use crate::scenario::Compiled;
use crate::world::{RobotsWorld, Role};
use serde::Serialize;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed, Simulation, math};
use sidestep_scenario::Source;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Chance that a simulator without fault is reported to disagree.
pub const SIGNIFICANCE: f64 = 1e-4;

/// The final poses of independent runs, compared with the exact distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// Length of each run in cycles.
    pub cycles: u64,
    /// Number of runs, each with a seed of its own.
    pub runs: u32,
    /// Total variation between the runs' final poses and the exact distribution.
    pub total_variation: f64,
    /// Limit that sampling alone exceeds with a probability of at most `significance`.
    pub limit: f64,
    /// See [`SIGNIFICANCE`].
    pub significance: f64,
    /// Number of runs from which on a simulator could be found to disagree: the limit is below 1 then, which no total
    /// variation exceeds.
    pub runs_to_tell: u64,
    /// Whether the total variation is within the limit; none where the runs are too few to tell.
    pub agrees: Option<bool>,
}

/// Runs the scenario's robot `runs` times for `cycles` cycles from its start under `policy`
/// (each run with a seed that is drawn from the scenario's) and compares where it ends with
/// [`Chain::distribution_after`](super::Chain::distribution_after).
///
/// The runs are independent, so the limit holds whether or not the chain mixes.
///
/// # Errors
/// When the scenario is not a chain, see [`MarkovModel::new`], or `runs` is 0.
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
    let model = MarkovModel::new(compiled)?;
    let chain = model.chain(policy)?;
    let exact = chain.pose_distribution(&chain.distribution_after(model.actions_in(cycles)));
    let counts = count_final_poses(compiled, source, policy, cycles, runs);
    Ok(Comparison::new(&exact, &counts, cycles, runs))
}

impl Comparison {
    fn new(
        exact: &BTreeMap<GridPose, f64>,
        counts: &BTreeMap<GridPose, u32>,
        cycles: u64,
        runs: u32,
    ) -> Self {
        // Poses that the model does not know count in full, because their exact probability is 0.
        let unknown = counts.keys().filter(|pose| !exact.contains_key(pose));
        let poses: Vec<GridPose> = exact.keys().chain(unknown).copied().collect();
        let expected: Vec<f64> =
            poses.iter().map(|p| exact.get(p).copied().unwrap_or(0.0)).collect();
        let share = |pose| f64::from(counts.get(pose).copied().unwrap_or(0)) / f64::from(runs);
        let observed: Vec<f64> = poses.iter().map(share).collect();
        let total_variation = total_variation(&expected, &observed);
        let limit = sampling_limit(&expected, f64::from(runs), SIGNIFICANCE);
        // The limit falls with the square root of the number of runs.
        let runs_to_tell = (limit * limit * f64::from(runs)).floor() as u64 + 1;
        let agrees = (limit < 1.0).then_some(total_variation <= limit);
        let significance = SIGNIFICANCE;
        Self { cycles, runs, total_variation, limit, significance, runs_to_tell, agrees }
    }
}

/// Returns the total variation that the shares of `samples` independent samples of `distribution`
/// exceed with a probability of at most `significance`.
///
/// The mean is at most half the sum of the shares' standard deviations; one sample more or
/// less changes the total variation by at most 1 / `samples`, so that McDiarmid's inequality
/// bounds how far above its mean it lies.
pub fn sampling_limit(distribution: &[f64], samples: f64, significance: f64) -> f64 {
    let deviation = |p: &f64| (p * (1.0 - p).max(0.0) / samples).sqrt();
    let mean = 0.5 * distribution.iter().map(deviation).sum::<f64>();
    mean + (math::ln(1.0 / significance) / (2.0 * samples)).sqrt()
}

/// Counts how often each pose is the final one.
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

/// Gives the robots another behavior.
fn set_policy(world: &mut RobotsWorld, policy: &RandomPolicy) {
    for ty in &mut world.types {
        if let Role::Robot(model) = &mut ty.role {
            model.behaviour = Arc::new(policy.clone());
        }
    }
}

fn robot_pose(simulation: &RobotsRun) -> GridPose {
    let (world, state) = (simulation.world(), simulation.state());
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
