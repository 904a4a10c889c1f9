//! The experiments of the chain world's source, "Multi-agent serpentine motion with reactive
//! obstacle avoidance" (Birbilis and Aspragathos, slides of 2005), rerun.
//!
//! The slides show pictures and no numbers, so their *claims* are examined. Every figure is our
//! own, with the number of runs, and an interval where runs are random. `claims` says of each
//! claim whether it held, is refuted or undecided, or its evidence is lost.
//!
//! ```text
//! corridor.rs, rotation.rs, field.rs    the swarm and its leader
//! pushing.rs, movers.rs, snake.rs       chains among static and moving obstacles
//! scaling.rs, broken_chain.rs, postures.rs, initiators.rs    experiments without a world
//! arm.rs           an arm of joints
//! scenes.rs        pictures of bodies
//! claims/          the verdicts
//! ```

mod arm;
mod broken_chain;
mod claims;
mod corridor;
mod field;
mod initiators;
mod movers;
mod postures;
mod pushing;
mod rotation;
mod scaling;
mod scenes;
mod snake;

use crate::claims::ReportParts;
use crate::study::{Progress, sub_progress};
use serde::Serialize;
use sidestep::kernel::stream::{Draws, Purpose, Streams};
use sidestep::kernel::workers::available_workers;
use sidestep::kernel::{InputError, Seed};
use sidestep_document::claim::{Claim, verdict_summary};
use sidestep_document::document::{Document, Experiment, Picture};

/// Speed of initiators in all scenarios, m/s.
const SPEED_M_S: f64 = 0.5;
/// Duration of a cycle unless an experiment varies it, s.
const DT_S: f64 = 0.02;

/// Returns random draws of an experiment that drives no world.
fn draws(seed: u64) -> Draws {
    Streams::new(Seed(seed)).draws(0, 0, Purpose(1))
}

/// The amount of work to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SerpentineConfig {
    /// Seeds of every case that is random,
    pub seeds: usize,
    /// of cases of the open field,
    pub field_seeds: usize,
    /// and of the snake in space.
    pub snake_seeds: usize,
    /// Widths of the corridor, meters.
    pub widths_m: Vec<f64>,
    /// Numbers of followers in it.
    pub followers: Vec<usize>,
    /// Maximum number of cycles of a run in it.
    pub corridor_cycles: u64,
    /// Steps of its leader, in the comparison of rotation rules, meters.
    pub steps_m: Vec<f64>,
    /// Numbers of discs in the open field, beside none.
    pub discs: Vec<usize>,
    /// Maximum number of cycles of a run in it.
    pub field_cycles: u64,
    /// Speeds of moving obstacles as multiples of the speed of the chain or robot that they meet.
    pub speed_ratios: Vec<f64>,
    /// Numbers of discs that run into a chain.
    pub mover_discs: Vec<usize>,
    /// Cycles of such a run.
    pub mover_cycles: u64,
    /// Numbers of connectors of the snake in space.
    pub snake_connectors: Vec<usize>,
    /// Cycles of its runs.
    pub snake_cycles: u64,
    /// Connectors of chains with timed motions.
    pub sizes: Vec<usize>,
    /// Numbers of far obstacles.
    pub far_balls: Vec<usize>,
    /// Length of a timing, as an approximate number of motions of a single connector.
    pub timed_motions: usize,
    /// Broken chains of each kind.
    pub breaks: usize,
    /// Links of chains that reach for targets,
    pub ik_links: Vec<usize>,
    /// and number of targets for each of them.
    pub ik_targets: usize,
    /// The cycle of the swarm's picture.
    pub pictured_cycles: u64,
    /// Workers; only times depend on them.
    pub workers: usize,
    /// Whether this is a rehearsal.
    pub quick: bool,
}

impl Default for SerpentineConfig {
    /// The full plan: ten minutes on two processors, most of it for discs that move.
    fn default() -> Self {
        Self {
            seeds: 10,
            field_seeds: 30,
            snake_seeds: 5,
            widths_m: vec![1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0],
            followers: vec![15, 40],
            corridor_cycles: 12_000,
            steps_m: vec![0.01, 0.05, 0.1],
            discs: vec![10, 25, 40],
            field_cycles: 15_000,
            speed_ratios: vec![0.25, 0.5, 1.0, 2.0, 4.0],
            mover_discs: vec![8, 16],
            mover_cycles: 4000,
            snake_connectors: vec![450, 1000],
            snake_cycles: 8000,
            sizes: vec![50, 100, 450, 1000, 3000, 10_000],
            far_balls: vec![0, 1000, 10_000, 100_000],
            timed_motions: 1_000_000,
            breaks: 200,
            ik_links: vec![2, 7, 25, 100, 450],
            ik_targets: 500,
            pictured_cycles: 2500,
            workers: available_workers(),
            quick: false,
        }
    }
}

impl SerpentineConfig {
    /// Returns a rehearsal of seconds: everything is run, and nothing is measured well.
    pub fn quick() -> Self {
        Self {
            seeds: 2,
            field_seeds: 2,
            snake_seeds: 2,
            widths_m: vec![1.2, 2.0],
            followers: vec![15],
            steps_m: vec![0.05],
            discs: vec![10],
            field_cycles: 4000,
            speed_ratios: vec![1.0, 4.0],
            mover_discs: vec![16],
            mover_cycles: 400,
            snake_connectors: vec![450],
            snake_cycles: 600,
            sizes: vec![50, 450, 1000],
            far_balls: vec![0, 1000],
            timed_motions: 20_000,
            breaks: 10,
            ik_links: vec![2, 7, 25],
            ik_targets: 20,
            quick: true,
            ..Self::default()
        }
    }

    fn check(&self) -> Result<(), InputError> {
        match self.seeds {
            1..=10_000 => Ok(()),
            n => Err(InputError::new("plan.seeds", format!("is {n}"), "give 1 to 10000 seeds")),
        }
    }
}

/// All results of the experiments.
#[derive(Debug, Clone, Serialize)]
pub struct SerpentineReport {
    /// The plan that was run.
    pub plan: SerpentineConfig,
    /// Version of the program that made the report.
    pub program_version: String,
    corridor: corridor::CorridorResults,
    rotations: rotation::RotationResults,
    fields: field::FieldResults,
    pushing: pushing::PushingResults,
    movers: movers::MoverResults,
    snakes: snake::SnakeResults,
    scaling: scaling::ScalingResults,
    broken: broken_chain::BreakResults,
    postures: postures::PostureResults,
    initiators: initiators::InitiatorResults,
    arms: arm::ArmResults,
    /// The slides' claims and our verdicts.
    pub claims: Vec<Claim>,
    /// Pictures of bodies: no numbers are taken from them.
    #[serde(skip)]
    pub scenes: Vec<crate::Scene>,
}

/// Runs all experiments.
///
/// `progress` is called with the current activity and the finished share of the whole.
///
/// # Errors
/// When the plan asks for an impossible scenario.
pub fn run(
    plan: &SerpentineConfig,
    progress: &mut Progress<'_>,
) -> Result<SerpentineReport, InputError> {
    plan.check()?;
    // Shares of the whole by the time they take on two processors. Timings come first, when the
    // machine is quiet.
    let scaling = scaling::ScalingResults::run(plan, &mut sub_progress(progress, 0.0, 0.05))?;
    let corridor = corridor::CorridorResults::run(plan, &mut sub_progress(progress, 0.05, 0.25))?;
    let rotations = rotation::RotationResults::run(plan, &mut sub_progress(progress, 0.25, 0.35))?;
    let fields = field::FieldResults::run(plan, &mut sub_progress(progress, 0.35, 0.55))?;
    let pushing = pushing::PushingResults::run(plan, &mut sub_progress(progress, 0.55, 0.6))?;
    let movers = movers::MoverResults::run(plan, &mut sub_progress(progress, 0.6, 0.8))?;
    let snakes = snake::SnakeResults::run(plan, &mut sub_progress(progress, 0.8, 0.93))?;
    let broken = broken_chain::BreakResults::run(plan, &mut sub_progress(progress, 0.93, 0.94))?;
    let postures = postures::PostureResults::run(plan, &mut sub_progress(progress, 0.94, 0.97))?;
    let initiators =
        initiators::InitiatorResults::run(plan, &mut sub_progress(progress, 0.97, 0.98))?;
    let arms = arm::ArmResults::run(plan, &mut sub_progress(progress, 0.98, 0.99))?;
    let scenes = scenes::all(plan)?;
    let mut report = SerpentineReport {
        plan: plan.clone(),
        program_version: env!("CARGO_PKG_VERSION").into(),
        corridor,
        rotations,
        fields,
        pushing,
        movers,
        snakes,
        scaling,
        broken,
        postures,
        initiators,
        arms,
        claims: Vec::new(),
        scenes,
    };
    report.claims = claims::judge(&report);
    progress("done", 1.0);
    Ok(report)
}

impl SerpentineReport {
    /// In the order of the file of claims, which has their words.
    fn experiments(&self) -> Vec<Experiment> {
        let scaling = &self.scaling;
        let corridor = &self.corridor;
        claims::CLAIMS.experiments([
            (corridor.figures(), vec![corridor.table()]),
            (vec![self.rotations.figure()], vec![self.rotations.table()]),
            (vec![self.fields.figure()], vec![self.fields.table()]),
            (vec![self.pushing.figure()], vec![self.pushing.table()]),
            (vec![self.movers.figure()], vec![self.movers.table()]),
            (Vec::new(), vec![self.snakes.table()]),
            (vec![scaling.figure()], scaling.tables().into()),
            (Vec::new(), vec![self.broken.table()]),
            (vec![self.postures.figure()], vec![self.postures.table()]),
            (Vec::new(), self.initiators.tables().into()),
            (Vec::new(), vec![self.arms.table()]),
        ])
    }

    /// Returns the report, the claims first; `pictures` are those of the [scenes](Self::scenes),
    /// drawn.
    pub fn document(&self, pictures: Vec<Picture>) -> Document {
        let plan = &self.plan;
        let lead = format!(
            "{} The slides show pictures and hardly a number; every figure here is ours. Version \
             {}; seeds 1 to {} ({} in the open field, {} of the snake), {} workers.",
            verdict_summary(&self.claims),
            self.program_version,
            plan.seeds,
            plan.field_seeds,
            plan.snake_seeds,
            plan.workers,
        );
        let quick = if plan.quick { " --quick" } else { "" };
        let seeds = plan.seeds;
        let command = format!("sidestep reproduce serpentine{quick} --seeds {seeds} --out DIR");
        let experiments = self.experiments();
        let parts = ReportParts { claims: &self.claims, pictures, experiments };
        claims::CLAIMS.document(lead, plan.quick, parts, command)
    }
}
