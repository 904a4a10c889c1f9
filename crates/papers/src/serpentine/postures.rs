//! Inverse kinematics by the chain's own rules (slides F2, E3): a tip is pulled to a target while
//! the base objects, while it is free, and there and back; and damped least squares beside it.

use super::{SerpentineConfig, draws};
use crate::case_results::{CaseResults, Columns, Format, Summary, bars, column, figure};
use crate::study::{Progress, Study, outcome_from_values, setting, setting_number};
use cpu_time::ThreadTime;
use serde::Serialize;
use serde_json::{Value as Json, json};
use sidestep::arms::ik::{ChainIkGoal, IkEngine, IkSolver};
use sidestep::experiment::sweep::{Setting, Variant};
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::math::powf;
use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, add_scaled, distance, normalized, scaled};
use sidestep::rods::{
    Chain, Connector, Mobility, MotionRequest, Obstacles, Propagator, ReactionRules, Rod,
};
use sidestep_document::figure::Scale;
use sidestep_document::{Figure, FigureKind, Table};

/// Part of the reach within which targets lie: near its whole, a chain is stretched out, and any method converges slowly.
const TARGET_REACH_FRACTION: f64 = 0.9;
/// Distance at which a target counts as reached, in parts of the reach.
const TOLERANCE_FRACTION: f64 = 1e-4;
/// Largest relative deviations of a rod's length from the mean: rods of the arms with revolute joints, which have one
/// length, and rods like prismatic joints, which slide.
const SLACKS: [f64; 2] = [0.0, 0.1];

/// Ways to bring a tip to a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IkMethod {
    /// One motion of the tip; the base always objects to being moved, as the slides have it.
    Veto,
    /// One motion of the tip, with no connector fixed.
    FreeBase,
    /// The chain's rule there and back until tip and base are where they belong.
    ThereAndBack,
    /// Damped least squares, a usual numeric method, to compare with.
    LeastSquares,
}

impl IkMethod {
    const ALL: [Self; 4] = [Self::Veto, Self::FreeBase, Self::ThereAndBack, Self::LeastSquares];

    /// Returns its name in settings and JSON.
    pub(super) fn key(self) -> &'static str {
        ["veto", "free-base", "there-and-back", "least-squares"][self as usize]
    }

    fn from_key(key: &str) -> Self {
        Self::ALL.into_iter().find(|way| way.key() == key).expect("a way of this key")
    }

    fn name(self) -> &'static str {
        match self {
            Self::Veto => "one pull, base objects",
            Self::FreeBase => "one pull, base free",
            Self::ThereAndBack => "there and back",
            Self::LeastSquares => "damped least squares",
        }
    }
}

const COLUMNS: Columns = Columns {
    case: &[
        column("links", "links", Summary::Setting("links")),
        column("slack", "slack", Summary::Setting("slack"))
            .with_format(Format::Computed(format_slack)),
        column("way", "way", Summary::Setting("way")).with_format(Format::Computed(format_method)),
    ],
    results: &[
        column("reached", "reached", Summary::Share("reached")),
        column("finished", "finished", Summary::Count("finished")),
        column("median_us", "median, us", Summary::Median("us")).with_format(Format::Decimals(1)),
        column("median_iterations", "passes or steps", Summary::Median("iterations")),
    ],
};

fn format_slack(case: &CaseResults) -> String {
    format!("{} %", 100.0 * case.number("slack"))
}

fn format_method(case: &CaseResults) -> String {
    let method = IkMethod::from_key(&case.value("way").to_string());
    method.name().into()
}

#[derive(Debug, Clone, Copy)]
struct PostureCase {
    /// How the tip is brought to its target.
    way: IkMethod,
    /// Number of rods; the tip is the connector behind the last one.
    links: usize,
    /// Largest relative deviation of a rod's length from the mean.
    slack: f64,
}

impl PostureCase {
    fn settings(self) -> Vec<Setting> {
        vec![
            setting("links", self.links as i64),
            setting("slack", self.slack),
            setting("way", self.way.key()),
        ]
    }

    fn from_variant(variant: &Variant) -> Self {
        let way = variant.value("way").and_then(toml::Value::as_str).unwrap_or_default();
        Self {
            way: IkMethod::from_key(way),
            links: setting_number(variant, "links") as usize,
            slack: setting_number(variant, "slack"),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct PostureResults {
    /// By number of links, then by slack, then by method.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

fn direction(draws: &mut Draws) -> Point<3> {
    normalized([0; 3].map(|_: u8| normal(draws))).unwrap_or([1.0, 0.0, 0.0])
}

/// Returns a random chain of rods that are as long as on average.
fn chain(case: &PostureCase, draws: &mut Draws) -> Result<Chain<3>, InputError> {
    let mut points = vec![[0.0; 3]];
    let mut u = direction(draws);
    for i in 0..case.links {
        let turned = add_scaled(u, direction(draws), 0.5);
        u = normalized(turned).unwrap_or(u);
        points.push(add_scaled(points[i], u, 1.0));
    }
    let mut connectors = vec![Connector::free(0.02); case.links + 1];
    if case.way == IkMethod::Veto {
        connectors[0].mobility = Mobility::Fixed;
    }
    let rods = points.windows(2).map(|ends| rod(case.slack, ends)).collect();
    Chain::new(points, connectors, rods)
}

fn rod(slack: f64, ends: &[Point<3>]) -> Rod {
    if slack == 0.0 {
        // Rods of fixed length take exactly the lengths that the points gave, to the bit.
        Rod::with_fixed_length(distance(ends[0], ends[1]), 0.01)
    } else {
        Rod { min_m: 1.0 - slack, max_m: 1.0 + slack, radius_m: 0.01 }
    }
}

fn solve(case: &PostureCase, seed: u64) -> Result<Json, InputError> {
    let draws = &mut draws(seed);
    let mut chain = chain(case, draws)?;
    let tip = case.links;
    // Rods are 1 m long on average.
    let reach_m = case.links as f64;
    // The volume of a ball grows with the third power of its radius, so that targets are uniform in it.
    let radius_fraction = powf(draws.uniform(), 1.0 / 3.0);
    let target = scaled(direction(draws), TARGET_REACH_FRACTION * reach_m * radius_fraction);
    let engine = match case.way {
        IkMethod::Veto | IkMethod::FreeBase => return pull(&mut chain, tip, target),
        IkMethod::ThereAndBack => IkEngine::Chain,
        IkMethod::LeastSquares => IkEngine::Dls,
    };
    let goal = ChainIkGoal {
        engine,
        tolerance_m: TOLERANCE_FRACTION * reach_m,
        ..ChainIkGoal::new(tip, 0, target)
    };
    let mut solver = IkSolver::new(ReactionRules::default());
    let began = ThreadTime::now();
    let answer = solver.solve(&chain, &Obstacles::default(), &goal)?;
    let us = 1e6 * began.elapsed().as_secs_f64();
    Ok(json!({
        "reached": answer.reached,
        "finished": answer.engine == IkEngine::Direct,
        "us": us,
        "iterations": answer.iterations,
    }))
}

fn pull(chain: &mut Chain<3>, tip: usize, target: Point<3>) -> Result<Json, InputError> {
    let request = MotionRequest::from_operator(tip, target);
    let began = ThreadTime::now();
    let outcome = Propagator::default().propagate(chain, &Obstacles::default(), &request)?;
    let us = 1e6 * began.elapsed().as_secs_f64();
    let reached = outcome.motion().is_some();
    Ok(json!({ "reached": reached, "finished": false, "us": us, "iterations": 1 }))
}

impl PostureResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for &links in &plan.ik_links {
            for slack in SLACKS {
                cases.extend(IkMethod::ALL.map(|way| PostureCase { way, links, slack }.settings()));
            }
        }
        let study = Study::from_variants("", cases).with_size(plan.ik_targets, None);
        let what = "targets of tips";
        let results = study.run_by(plan.workers, what, progress, |_, case, trial| {
            Ok(outcome_from_values(trial, solve(&PostureCase::from_variant(case), trial.seed)?))
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// By number of links, then by slack.
    pub(super) fn cases_with_method(&self, way: IkMethod) -> impl Iterator<Item = &CaseResults> {
        self.cases.iter().filter(move |c| c.has_text("way", way.key()))
    }

    pub(super) fn table(&self) -> Table {
        let note = "Targets uniform within 0.9 of the reach in space, to 1e-4 of it, from a posture at \
                    random; nothing in the way. `finished`: not reached by the way itself, but in \
                    closed form. With a free base one motion always is enough.";
        COLUMNS.table("Inverse kinematics", note, &self.cases)
    }

    pub(super) fn figure(&self) -> Figure {
        let mut links: Vec<String> =
            self.cases.iter().map(|c| c.value("links").to_string()).collect();
        links.dedup();
        let mut series = Vec::new();
        // One pull of the tip is one motion, the time of which is shown with the cost of a motion.
        for way in [IkMethod::ThereAndBack, IkMethod::LeastSquares] {
            for slack in SLACKS {
                let cases = self.cases_with_method(way).filter(|c| c.number("slack") == slack);
                let rods = if slack == 0.0 {
                    "fixed rods".into()
                } else {
                    format!("\u{b1}{} %", 100.0 * slack)
                };
                series.push(bars(format!("{}, {rods}", way.name()), cases, "median_us"));
            }
        }
        let labels = ["links", "median, microseconds"];
        let figure = figure("Time to bring a tip to its target", labels, series);
        Figure { y_scale: Scale::Log, kind: FigureKind::Bars { categories: links }, ..figure }
    }
}
