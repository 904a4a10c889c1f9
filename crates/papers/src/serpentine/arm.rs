//! An arm of six joints, with a tool that is sent to places (slides K1 to K4, E3): in the open and between pillars,
//! by local rules alone and with a planner. Every cycle is looked at: whether a joint is outside its limits or too
//! fast.

use super::{DT_S, SerpentineConfig, draws};
use crate::case_results::{CaseResults, Columns, Format, Summary, column};
use crate::study::{
    Progress, Study, downcast, outcome_from_values, run_to_end, setting, setting_number,
};
use serde::Serialize;
use serde_json::{Value as Json, json};
use sidestep::arms::kinematics::SerialChain;
use sidestep::experiment::sweep::{Setting, Variant};
use sidestep::import::urdf::Model;
use sidestep::kernel::stream::Draws;
use sidestep::kernel::{InputError, Simulation};
use sidestep::rods::geometry::{Point, between_segments};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep::worlds::chain::ChainRun;
use sidestep_document::Table;

const SCENARIO: &str = include_str!("../../scenarios/serpentine/arm.toml");
/// Places that the tool of a run visits.
const TARGETS: usize = 4;
/// Pillars: their feet, height and radius.
const PILLARS_M: [Point<2>; 3] = [[0.45, 0.0], [-0.25, 0.42], [-0.25, -0.42]];
const HEIGHT_M: f64 = 0.7;
const RADIUS_M: f64 = 0.05;
/// Least distance of a posture at a target from their axes: three radii, so that a target leaves room to get there.
const MIN_PILLAR_DISTANCE_M: f64 = 0.15;
/// Least distance between its own parts there: twice the radius of connectors, and as much as half of one more.
const MIN_OWN_DISTANCE_M: f64 = 0.1;
/// Planners of ways.
pub(super) const PLANNERS: [&str; 2] = ["none", "rrt-connect"];

const COLUMNS: Columns = Columns {
    case: &[
        column("pillars", "pillars", Summary::Setting("pillars")),
        column("planner", "planner", Summary::Setting("planner")),
    ],
    results: &[
        column("reached", "all reached", Summary::Share("reached")),
        column("targets", "targets reached", Summary::Sum("targets")),
        column("outside", "cycles outside limits", Summary::Sum("outside")),
        column("too_fast", "cycles too fast", Summary::Sum("too_fast")),
        column("fastest", "fastest joint / its limit", Summary::Max("fastest"))
            .with_format(Format::Decimals(3)),
        column("off_m", "tool off its joints", Summary::Max("off_m"))
            .with_format(Format::Exponent(1)),
        column("penetrations", "steps inside", Summary::Sum("penetrations")),
        column("steps", "steps", Summary::Sum("steps")),
        column("seconds", "median time of a run, s", Summary::Median("seconds"))
            .with_format(Format::Decimals(1)),
    ],
};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ArmResults {
    /// Those without pillars first, each without a planner and then with one.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

fn arm() -> Result<SerialChain, InputError> {
    let scenario: toml::Table = toml::from_str(SCENARIO).expect("a scenario of this experiment");
    let text = scenario["chains"][0]["arm"]["urdf_text"].as_str().expect("its arm");
    let model = Model::parse("the arm of this experiment", text)?;
    SerialChain::new(&model, model.root, model.default_tip(), "its tool")
}

fn cases() -> Vec<Vec<Setting>> {
    let mut cases = Vec::new();
    for pillars in [0, PILLARS_M.len()] {
        for planner in PLANNERS {
            let pillars = setting("pillars", pillars as i64);
            cases.push(vec![pillars, setting("planner", planner)]);
        }
    }
    cases
}

/// Returns a place of the tool at joint values at random, at which the arm is above the ground and clear of pillars: a
/// place at random could be out of reach, and a run that cannot succeed would test nothing.
fn target(arm: &SerialChain, draws: &mut Draws) -> Point<3> {
    let skeleton = arm.skeleton();
    loop {
        let values = joint_values_at_random(arm, draws);
        let places = arm.connector_positions(&skeleton, &arm.forward_kinematics(&values));
        let is_above = places.iter().all(|p| p[2] > MIN_PILLAR_DISTANCE_M);
        if is_above && is_apart(&places) && places.windows(2).all(is_clear_of_pillars) {
            return places[places.len() - 1];
        }
    }
}

fn joint_values_at_random(arm: &SerialChain, draws: &mut Draws) -> Vec<f64> {
    let mut values = Vec::new();
    for variable in &arm.variables {
        // A joint without limits may turn nearly all around.
        let [lower, upper] = variable.limits.map_or([-3.0, 3.0], |l| [l.lower, l.upper]);
        values.push(lower + draws.uniform() * (upper - lower));
    }
    values
}

fn is_clear_of_pillars(rod: &[Point<3>]) -> bool {
    PILLARS_M.iter().all(|[x, y]| {
        let pillar = [[*x, *y, 0.0], [*x, *y, HEIGHT_M]];
        between_segments([rod[0], rod[1]], pillar).distance_m > MIN_PILLAR_DISTANCE_M
    })
}

/// Returns whether the arm is clear of itself: connectors of those two and more away, and of rods beyond their
/// neighbors; the only two of its four rods that may touch are clear of each other with their ends.
fn is_apart(places: &[Point<3>]) -> bool {
    for (c, connector) in places.iter().enumerate() {
        let connectors = places.iter().skip(c + 2).map(|other| [*other; 2]);
        let rods = places.windows(2).enumerate().filter(|(r, _)| c + 1 < *r || c > r + 2);
        let parts = connectors.chain(rods.map(|(_, rod)| [rod[0], rod[1]]));
        for part in parts {
            if between_segments([*connector; 2], part).distance_m <= MIN_OWN_DISTANCE_M {
                return false;
            }
        }
    }
    true
}

/// Returns the settings of a case with this seed in the scenario: the pillars, the places and the planner.
fn settings(case: &Variant, seed: u64) -> Result<Vec<Setting>, InputError> {
    let arm = arm()?;
    let draws = &mut draws(seed);
    let targets: Vec<_> = (0..TARGETS).map(|_| target(&arm, draws).to_vec()).collect();
    let pillars = &PILLARS_M[..setting_number(case, "pillars") as usize];
    let planner = case.value("planner").and_then(toml::Value::as_str).unwrap_or_default();
    Ok(vec![
        setting("obstacles", pillars.iter().map(pillar).collect::<Vec<_>>()),
        setting("chains.tasks.targets_m", targets),
        setting("chains.tasks.planner", planner),
    ])
}

fn pillar([x, y]: &Point<2>) -> toml::Table {
    let ends = vec![vec![*x, *y, 0.0], vec![*x, *y, HEIGHT_M]];
    let mut pillar = toml::Table::new();
    pillar.insert("ends_m".into(), ends.into());
    pillar.insert("radius_m".into(), RADIUS_M.into());
    pillar
}

/// Measures of the joints over the cycles of a run.
struct JointMeasures {
    /// Joint values of the cycle before.
    before: Vec<f64>,
    /// Cycles with a joint outside its limits.
    outside: u64,
    /// Cycles with a joint over its greatest speed.
    too_fast: u64,
    /// Greatest speed of a joint divided by its limit.
    fastest: f64,
    /// Greatest distance, along an axis, of the tool in the chain from the tool of the joints.
    off_m: f64,
}

impl JointMeasures {
    fn new(run: &dyn Simulation) -> Self {
        let before = joint_values(downcast(run));
        Self { before, outside: 0, too_fast: 0, fastest: 0.0, off_m: 0.0 }
    }

    fn add_cycle(&mut self, arm: &SerialChain, run: &ChainRun<3>) {
        let now = joint_values(run);
        if !arm.outside_limits(&now).is_empty() {
            self.outside += 1;
        }
        let mut speed = 0.0_f64;
        for (variable, (before, now)) in arm.variables.iter().zip(self.before.iter().zip(&now)) {
            if let Some(max_speed) = variable.max_speed {
                speed = speed.max((now - before).abs() / (max_speed * DT_S));
            }
        }
        self.fastest = self.fastest.max(speed);
        // A joint at its greatest speed may exceed it by rounding.
        if speed > 1.0 + 1e-9 {
            self.too_fast += 1;
        }
        let placed = arm.forward_kinematics(&now).tip.origin_m;
        if let Some(tool) = run.state().body(0).chain.points().last() {
            for axis in 0..3 {
                self.off_m = self.off_m.max((tool[axis] - placed[axis]).abs());
            }
        }
        self.before = now;
    }
}

fn joint_values(run: &ChainRun<3>) -> Vec<f64> {
    run.state().body(0).joints.clone().unwrap_or_default()
}

/// Makes a run, and looks at the joints in each of its cycles.
fn run_checking_joints(source: &Source) -> Result<Json, InputError> {
    let arm = arm()?;
    let mut run = WORLDS.compile(source)?.start(source, 1);
    let mut joints = JointMeasures::new(&*run);
    run_to_end(&mut *run, |run| joints.add_cycle(&arm, downcast(run)));
    let run: &ChainRun<3> = downcast(&*run);
    let came = run.world().chain_metrics(run.state(), 0);
    // The task itself is one of the tasks done, if it ended.
    let targets = TARGETS - came.tally.given_up.len().min(TARGETS);
    let is_over = run.is_over();
    Ok(json!({
        "reached": is_over && targets == TARGETS,
        "targets": if is_over { targets as u64 } else { came.tally.done },
        "outside": joints.outside,
        "too_fast": joints.too_fast,
        "fastest": joints.fastest,
        "off_m": joints.off_m,
        "penetrations": came.tally.penetrations,
        "steps": came.tally.steps,
        "seconds": run.cycle() as f64 * DT_S,
    }))
}

impl ArmResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let study = Study::from_variants(SCENARIO, cases()).with_size(plan.seeds, None);
        let what = "an arm of joints";
        let results = study.run_by(plan.workers, what, progress, |_, case, trial| {
            let source = study.scenario_with(&settings(case, trial.seed)?)?;
            Ok(outcome_from_values(trial, run_checking_joints(&source)?))
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// Returns the cases with a planner, or those by local rules alone.
    pub(super) fn cases_with_planner(
        &self,
        planner: &'static str,
    ) -> impl Iterator<Item = &CaseResults> {
        self.cases.iter().filter(move |c| c.has_text("planner", planner))
    }

    pub(super) fn table(&self) -> Table {
        let note = "Six joints with limits and greatest speeds, three of them parallel. Each run: four places that the \
                    tool has at joint values at random, 20 s without coming nearer until one is given up. The chain is \
                    the guide, and the joints follow it; tool off its joints: its place in the chain and by forward \
                    kinematics.";
        COLUMNS.table("An arm of joints", note, &self.cases)
    }
}
