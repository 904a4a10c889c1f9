//! A chain in a straight corridor is pushed back by its head until somebody objects, and pulled
//! back by its tail (slides A3, A4, R4).

use super::Plan;
use super::runs::{draws, grid, most};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::worlds::chain::geometry::along;
use sidestep::worlds::chain::ground::{Corridor, Leg};
use sidestep::worlds::chain::{
    Chain, Connector, Obstacles, Outcome, Propagator, Reason, Request, Rod, Rules,
};
use sidestep_document::{Estimate, Figure, FigureKind, Series, Table};

/// Standard deviation across the corridor of where the head is told to go: pushing a straight
/// chain exactly along itself would never fold it.
const NOISE_M: f64 = 0.001;
const STEP_M: f64 = 0.01;
/// How far it is to go.
const WAY_M: f64 = 12.0;
const WIDTH_M: f64 = 2.0;

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Whether the chain's own parts are obstacles to it.
    pub self_collision: bool,
    /// The greatest angle between two rods; 180 for none.
    pub max_bend_deg: f64,
    /// Whether the head leads, and pushes; or the tail, and pulls.
    pub by_head: bool,
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// How far it went until somebody objected, of 12 m.
    pub way_m: Estimate,
    /// Runs that were ended by a veto.
    pub vetoed: usize,
    /// Runs.
    pub runs: usize,
    /// The reasons.
    pub reasons: Vec<&'static str>,
    /// The sharpest bend at any time.
    pub sharpest_deg: f64,
    /// The greatest amount by which a rod was outside its limits.
    pub rod_violation_m: f64,
}

struct Pushed {
    way_m: f64,
    veto: Option<Reason>,
    sharpest_rad: f64,
    rod_violation_m: f64,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pushing {
    /// Results by case.
    pub cells: Vec<Cell>,
}

fn chain(case: &Case) -> Result<Chain<2>, InputError> {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    let connector =
        Connector { max_bend_rad: case.max_bend_deg.to_radians(), ..Connector::free(0.25) };
    // The head is at the far end.
    Chain::straight([30.0, 0.0], [-1.0, 0.0], 15, rod, connector)
}

fn pushed(case: &Case, seed: u64) -> Result<Pushed, InputError> {
    let walls = Corridor::new(vec![Leg::Straight { length_m: 40.0 }], WIDTH_M)?.walls(0);
    let obstacles = Obstacles::new(walls, 1.3)?;
    let mut chain = chain(case)?;
    let rules = Rules { self_collision: case.self_collision, ..Rules::default() };
    let mut propagator = Propagator::new(rules);
    let (draws, k) = (&mut draws(seed), if case.by_head { 0 } else { 15 });
    let start = chain.points()[k];
    let mut came = Pushed { way_m: 0.0, veto: None, sharpest_rad: 0.0, rod_violation_m: 0.0 };
    for step in 1..=(WAY_M / STEP_M) as usize {
        let way_m = STEP_M * step as f64;
        let to = along(along(start, [-1.0, 0.0], way_m), [0.0, 1.0], NOISE_M * normal(draws));
        if let Outcome::Vetoed(veto) =
            propagator.propagate(&mut chain, &obstacles, &Request::exact(k, to))?
        {
            came.veto = Some(veto.reason);
            break;
        }
        came.way_m = way_m;
        let bends = (0..chain.points().len()).filter_map(|i| chain.bend_rad(i));
        came.sharpest_rad = bends.fold(came.sharpest_rad, f64::max);
        came.rod_violation_m = came.rod_violation_m.max(chain.max_rod_violation_m());
    }
    Ok(came)
}

impl Pushing {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for by_head in [true, false] {
            for (self_collision, max_bend_deg) in
                [(false, 180.0), (true, 180.0), (true, 60.0), (true, 30.0)]
            {
                cases.push(Case { self_collision, max_bend_deg, by_head });
            }
        }
        let all = grid((plan, plan.seeds), "pushed and pulled", &cases, progress, pushed)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    /// Cells of pushing, or of pulling.
    pub(super) fn of(&self, by_head: bool) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |c| c.case.by_head == by_head)
    }

    pub(super) fn table(&self) -> Table {
        let note = "16 connectors in a straight corridor of 2 m; where the head is told to go errs \
                    by 1 mm across, 12 m in all. Without self-collision a pushed chain folds onto \
                    itself, which no robots can.";
        let columns = [
            "back by",
            "self-collision",
            "bend limit, deg",
            "way, m",
            "vetoed",
            "reasons",
            "sharpest bend, deg",
        ];
        let mut table = Table::new("Pushed by the head, pulled by the tail", note, &columns);
        for c in &self.cells {
            table.row([
                if c.case.by_head { "head (push)" } else { "tail (pull)" }.into(),
                if c.case.self_collision { "yes" } else { "no" }.into(),
                c.case.max_bend_deg.to_string(),
                c.way_m.to_string(),
                format!("{}/{}", c.vetoed, c.runs),
                c.reasons.join(", "),
                format!("{:.0}", c.sharpest_deg),
            ]);
        }
        table
    }

    pub(super) fn figure(&self) -> Figure {
        let category = |c: &Cell| match (c.case.self_collision, c.case.max_bend_deg) {
            (false, _) => "no self-collision".to_string(),
            (true, 180.0) => "self-collision".to_string(),
            (true, deg) => format!("bends up to {deg}\u{b0}"),
        };
        let series = |name: &str, by_head: bool| Series {
            name: name.into(),
            points: (0..)
                .zip(self.of(by_head))
                .filter_map(|(k, c)| c.way_m.point(f64::from(k)))
                .collect(),
        };
        Figure {
            title: "How far a chain goes back until somebody objects".into(),
            x_label: String::new(),
            y_label: "way of 12 m, m".into(),
            kind: FigureKind::Bars { categories: self.of(true).map(category).collect() },
            series: vec![series("pushed by the head", true), series("pulled by the tail", false)],
            ..Figure::default()
        }
    }
}

fn cell(case: Case, runs: &[Pushed]) -> Cell {
    let mut reasons: Vec<&'static str> =
        runs.iter().filter_map(|r| r.veto).map(Reason::name).collect();
    reasons.sort_unstable();
    reasons.dedup();
    Cell {
        case,
        way_m: Estimate::of(runs.iter().map(|r| Some(r.way_m))),
        vetoed: runs.iter().filter(|r| r.veto.is_some()).count(),
        runs: runs.len(),
        reasons,
        sharpest_deg: most(runs.iter().map(|r| r.sharpest_rad)).to_degrees(),
        rod_violation_m: most(runs.iter().map(|r| r.rod_violation_m)),
    }
}
