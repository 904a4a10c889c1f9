//! An arm of six joints, with a tool that is sent to places (slides K1 to K4, E3): in the open and between pillars,
//! by local rules alone and with a planner. Every cycle is looked at: whether a joint is outside its limits or too
//! fast.

use super::{DT_S, SerpentineConfig, draws};
use crate::cells::{CaseResults, Columns, Value, column};
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
/// Least distance of a posture at a target from their axes.
const MIN_PILLAR_DISTANCE_M: f64 = 0.15;
/// Least distance between its own parts there: twice the radius of connectors, and as much as half of one more.
const MIN_OWN_DISTANCE_M: f64 = 0.1;
/// Planners of ways.
pub(super) const PLANNERS: [&str; 2] = ["none", "rrt-connect"];

const COLUMNS: Columns = Columns {
    case: &[
        column("pillars", "pillars", |r| r.setting("pillars")),
        column("planner", "planner", |r| r.setting("planner")),
    ],
    results: &[
        column("reached", "all reached", |r| r.proportion(|run| run.is_true("reached"))),
        column("targets", "targets reached", |r| r.sum("targets")),
        column("outside", "cycles outside limits", |r| r.sum("outside")),
        column("too_fast", "cycles too fast", |r| r.sum("too_fast")),
        column("fastest", "fastest joint / its limit", |r| Value::Number(r.max_value("fastest")))
            .with_format(|c| format!("{:.3}", c.number("fastest"))),
        column("off_m", "tool off its joints", |r| Value::Number(r.max_value("off_m")))
            .with_format(|c| format!("{:.1e}", c.number("off_m"))),
        column("penetrations", "steps inside", |r| r.sum("penetrations")),
        column("steps", "steps", |r| r.sum("steps")),
        column("seconds", "median time of a run, s", |r| Value::Number(r.median("seconds")))
            .with_format(|c| format!("{:.1}", c.number("seconds"))),
    ],
};

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ArmResults {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the arm of the scenario.
fn arm() -> Result<SerialChain, InputError> {
    let scenario: toml::Table = toml::from_str(SCENARIO).expect("a scenario of this experiment");
    let text = scenario["chains"][0]["arm"]["urdf_text"].as_str().expect("its arm");
    let model = Model::parse("the arm of this experiment", text)?;
    SerialChain::new(&model, model.root, model.default_tip(), "its tool")
}

fn cases() -> Vec<Vec<Setting>> {
    let case = |pillars: usize, planner: &str| {
        vec![setting("pillars", pillars as i64), setting("planner", planner)]
    };
    [0, PILLARS_M.len()]
        .into_iter()
        .flat_map(|n| PLANNERS.map(|planner| case(n, planner)))
        .collect()
}

/// Returns a place of the tool at joint values at random, at which the arm is above the ground and clear of pillars.
fn target(arm: &SerialChain, draws: &mut Draws) -> Point<3> {
    let skeleton = arm.skeleton();
    loop {
        let value = |limits: Option<_>| {
            let [lower, upper] = limits.unwrap_or([-3.0, 3.0]);
            lower + draws.uniform() * (upper - lower)
        };
        let limits = arm.variables.iter().map(|v| v.limits.map(|l| [l.lower, l.upper]));
        let values: Vec<f64> = limits.map(value).collect();
        let places = arm.connectors(&skeleton, &arm.forward(&values));
        let is_clear = |rod: &[Point<3>]| {
            PILLARS_M.iter().all(|[x, y]| {
                let pillar = [[*x, *y, 0.0], [*x, *y, HEIGHT_M]];
                between_segments([rod[0], rod[1]], pillar).distance_m > MIN_PILLAR_DISTANCE_M
            })
        };
        let is_above = places.iter().all(|p| p[2] > MIN_PILLAR_DISTANCE_M);
        if is_above && is_apart(&places) && places.windows(2).all(is_clear) {
            return places[places.len() - 1];
        }
    }
}

/// Returns whether the arm is clear of itself: connectors of those two and more away, and of rods beyond their
/// neighbors; the only two of its four rods that may touch are clear of each other with their ends.
fn is_apart(places: &[Point<3>]) -> bool {
    let away_m = |a: [Point<3>; 2], b: [Point<3>; 2]| between_segments(a, b).distance_m;
    let connector = |c: usize| [places[c]; 2];
    let rod = |r: usize| [places[r], places[r + 1]];
    (0..places.len()).all(|c| {
        let connectors = (c + 2..places.len()).map(connector);
        let rods = (0..places.len() - 1).filter(|r| c + 1 < *r || c > r + 2).map(rod);
        connectors.chain(rods).all(|part| away_m(connector(c), part) > MIN_OWN_DISTANCE_M)
    })
}

/// Returns the settings of a case with this seed in the scenario: the pillars, the places and the planner.
fn settings(case: &Variant, seed: u64) -> Result<Vec<Setting>, InputError> {
    let (arm, draws) = (arm()?, &mut draws(seed));
    let targets: Vec<_> = (0..TARGETS).map(|_| target(&arm, draws).to_vec()).collect();
    let pillar = |[x, y]: &Point<2>| {
        let mut pillar = toml::Table::new();
        let ends = vec![vec![*x, *y, 0.0], vec![*x, *y, HEIGHT_M]];
        pillar.insert("ends_m".into(), ends.into());
        pillar.insert("radius_m".into(), RADIUS_M.into());
        pillar
    };
    let pillars = &PILLARS_M[..setting_number(case, "pillars") as usize];
    let planner = case.value("planner").and_then(toml::Value::as_str).unwrap_or_default();
    Ok(vec![
        setting("obstacles", pillars.iter().map(pillar).collect::<Vec<_>>()),
        setting("chains.tasks.targets_m", targets),
        setting("chains.tasks.planner", planner),
    ])
}

/// Makes a run, and looks at the joints in each of its cycles.
fn run_checking_joints(source: &Source) -> Result<Json, InputError> {
    let arm = arm()?;
    let mut run = WORLDS.compile(source)?.start(source, 1);
    let joints = |run: &dyn Simulation| {
        let run: &ChainRun<3> = downcast(run);
        let body = run.state().body(0);
        (body.joints.clone().unwrap_or_default(), body.chain.points().last().copied())
    };
    let mut before = joints(&*run).0;
    let (mut outside, mut too_fast, mut fastest, mut off_m) = (0, 0, 0.0_f64, 0.0_f64);
    run_to_end(&mut *run, |run| {
        let (now, tool) = joints(run);
        outside += u64::from(!arm.outside_limits(&now).is_empty());
        let speeds = arm
            .variables
            .iter()
            .zip(before.iter().zip(&now))
            .filter_map(|(v, (a, b))| Some((b - a).abs() / (v.max_speed? * DT_S)));
        let speed = speeds.fold(0.0, f64::max);
        (fastest, too_fast) = (fastest.max(speed), too_fast + u64::from(speed > 1.0 + 1e-9));
        let placed = arm.forward(&now).tip.origin_m;
        let offs = tool.iter().flat_map(|tool| (0..3).map(|i| (tool[i] - placed[i]).abs()));
        off_m = offs.fold(off_m, f64::max);
        before = now;
    });
    let run: &ChainRun<3> = downcast(&*run);
    let came = run.world().chain_metrics(run.state(), 0);
    // The task itself is one of the tasks done, if it ended.
    let targets = TARGETS - came.tally.given_up.len().min(TARGETS);
    let is_over = run.is_over();
    Ok(json!({
        "reached": is_over && targets == TARGETS,
        "targets": if is_over { targets as u64 } else { came.tally.done },
        "outside": outside, "too_fast": too_fast, "fastest": fastest, "off_m": off_m,
        "penetrations": came.tally.penetrations, "steps": came.tally.steps,
        "seconds": run.cycle() as f64 * DT_S,
    }))
}

impl ArmResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let study = Study::from_variants(SCENARIO, cases()).with_size(plan.seeds, None);
        let settings =
            |case: &Variant, seed| settings(case, seed).expect("the arm of this experiment");
        let what = "an arm of joints";
        let results = study.run_with(plan.workers, what, progress, settings, |source, cell| {
            Ok(outcome_from_values(cell, run_checking_joints(source)?))
        })?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    /// Returns the cells with a planner, or those by local rules alone.
    pub(super) fn cells_with_planner(
        &self,
        planner: &'static str,
    ) -> impl Iterator<Item = &CaseResults> {
        self.cells.iter().filter(move |c| c.has_text("planner", planner))
    }

    pub(super) fn table(&self) -> Table {
        let note = "Six joints with limits and greatest speeds, three of them parallel. Each run: four places that the \
                    tool has at joint values at random, 20 s without coming nearer until one is given up. The chain is \
                    the guide, and the joints follow it; tool off its joints: its place in the chain and by forward \
                    kinematics.";
        COLUMNS.table("An arm of joints", note, &self.cells)
    }
}
