//! The experiments of the airspace world's source paper: the super-conflict of 2 to 10 airplanes,
//! optimized by a team of agents and by a migrating coordinator.
//!
//! The paper's figures 5 to 7 show time, messages and bytes against the number of airplanes. Its
//! numbers are those of a Java platform of 2009; its claims are about which is more, and those
//! are judged here. Both deployments choose the same controls, so flights are the same.

use crate::farm;
use serde::Serialize;
use sidestep::kernel::{InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::airspace::airplane::Point as AirPoint;
use sidestep::worlds::airspace::deploy::Deployment;
use sidestep::worlds::airspace::metrics::Metrics;
use sidestep::worlds::airspace::simulation::AirspaceSimulation;
use sidestep_document::Estimate;
use sidestep_document::claim::{self, Claim, Verdict};
use sidestep_document::document::{Document, Experiment};
use sidestep_document::figure::{Figure, FigureKind, Point, Series, Table};

/// How much to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Numbers of airplanes.
    pub airplanes: Vec<usize>,
    /// Runs of each, by seed from 1.
    pub seeds: usize,
    /// Cycles of each run at most.
    pub cycles: u64,
    /// Workers.
    pub workers: usize,
    /// Whether this is a rehearsal.
    pub quick: bool,
}

impl Default for Plan {
    fn default() -> Self {
        let workers = sidestep::kernel::workers::available();
        Self { airplanes: (2..=10).collect(), seeds: 20, cycles: 400, workers, quick: false }
    }
}

impl Plan {
    /// A rehearsal of minutes at most, long enough for airplanes to meet.
    pub fn quick() -> Self {
        Self { airplanes: vec![2, 3, 5], seeds: 2, cycles: 60, quick: true, ..Self::default() }
    }
}

/// One deployment at one number of airplanes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Airplanes.
    pub airplanes: usize,
    /// Name of the deployment.
    pub deployment: &'static str,
    /// Seconds spent deciding per run, if every agent has a processor of its own: of a team the
    /// time of all agents divided by their number, of a coordinator all of it.
    pub elapsed_s: Estimate,
    /// The same per optimization.
    pub optimization_s: Estimate,
    /// Messages, or migrations, per run.
    pub messages: Estimate,
    /// Bytes per run, one message per receiver,
    pub bytes: Estimate,
    /// and if a message could reach all at once.
    pub multicast_bytes: Estimate,
    /// Rounds per optimization.
    pub rounds: Estimate,
    /// Losses of separation per run.
    pub losses: Estimate,
    /// Mean delay, percent.
    pub delay_percent: Estimate,
    /// What ratios are made of.
    pub by_seed: Vec<Flown>,
}

/// One run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flown {
    /// As in a [`Cell`].
    pub elapsed_s: f64,
    /// Messages, or migrations.
    pub messages: f64,
    /// Bytes, one message per receiver,
    pub bytes: f64,
    /// and if a message could reach all at once.
    pub multicast_bytes: f64,
}

/// What came of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// What was run.
    pub plan: Plan,
    /// Results by number of airplanes, the team before the coordinator.
    pub cells: Vec<Cell>,
    /// The paper's claims and our verdicts.
    pub claims: Vec<Claim>,
    /// Where the airplanes of the largest team flew with the first seed, metres.
    pub tracks_m: Vec<Vec<AirPoint>>,
}

/// Time between two optimizations.
const DT_S: f64 = 5.0;
/// From so many airplanes on the paper finds its coordinator slow.
const MANY: usize = 5;
const BOTH: [Deployment; 2] = [Deployment::Team, Deployment::Pim];

/// Runs the experiments.
///
/// # Errors
/// When the plan asks for what no scenario can be.
pub fn run(plan: &Plan, progress: &mut farm::Progress<'_>) -> Result<Report, InputError> {
    let cases = plan.airplanes.iter().flat_map(|&n| BOTH.map(|deployment| (n, deployment)));
    let cases: Vec<(usize, Deployment)> = cases.collect();
    // Seed by seed, so that what else the machine does meets all cases alike.
    let run = |i: usize| {
        let (n, deployment) = cases[i % cases.len()];
        flown(plan, n, deployment, (i / cases.len()) as u64 + 1)
    };
    let total = cases.len() * plan.seeds;
    let report = |share| progress("super-conflicts", share);
    let runs = farm::in_batches(plan.workers, total, report, run);
    let runs: Vec<Metrics> = runs.into_iter().collect::<Result<_, InputError>>()?;
    let of_case = |(k, &(n, deployment)): (usize, &(usize, Deployment))| {
        let all: Vec<&Metrics> = runs.iter().skip(k).step_by(cases.len()).collect();
        cell(n, deployment, &all)
    };
    let cells: Vec<Cell> = cases.iter().enumerate().map(of_case).collect();
    let claims = judge(&cells);
    let largest = plan.airplanes.iter().copied().max().unwrap_or(0);
    let tracks_m = tracks_m(plan, largest)?;
    Ok(Report { plan: plan.clone(), cells, claims, tracks_m })
}

/// Where `n` airplanes fly with the first seed.
fn tracks_m(plan: &Plan, n: usize) -> Result<Vec<Vec<AirPoint>>, InputError> {
    let mut run = begun(plan, n, Deployment::Direct, 1)?;
    let mut tracks = vec![Vec::new(); n];
    loop {
        for (track, cell) in tracks.iter_mut().zip(&run.state().airplanes) {
            let at = cell.pose().at;
            if track.last() != Some(&at) {
                track.push(at);
            }
        }
        if run.cycle() >= plan.cycles || run.is_over() {
            return Ok(tracks);
        }
        run.advance(1);
    }
}

fn flown(plan: &Plan, n: usize, deployment: Deployment, seed: u64) -> Result<Metrics, InputError> {
    let mut run = begun(plan, n, deployment, seed)?;
    while run.cycle() < plan.cycles && !run.is_over() {
        run.advance(plan.cycles - run.cycle());
    }
    Ok(run.airspace_metrics())
}

/// The paper's numbers: its preset, and no shield.
fn begun(
    plan: &Plan,
    n: usize,
    deployment: Deployment,
    seed: u64,
) -> Result<AirspaceSimulation, InputError> {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nname = \"Super-conflict\"\nseed = {seed}\n\
         cycles = {}\n[airspace]\npreset = \"paper\"\nshield = \"off\"\ndeployment = \"{}\"\n\
         dt_s = {DT_S:?}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\njitter_m = 0.0\n",
        plan.cycles,
        deployment.name(),
    );
    AirspaceSimulation::new(&Source::new("agentfly", text, ""), 1)
}

fn cell(airplanes: usize, deployment: Deployment, all: &[&Metrics]) -> Cell {
    let of = |value: &dyn Fn(&Metrics) -> Option<f64>| Estimate::of(all.iter().map(|m| value(m)));
    let processors = if deployment == Deployment::Team { airplanes as f64 } else { 1.0 };
    let elapsed_s = |m: &Metrics| Some(m.optimise_cpu_s / processors);
    let flown = |m: &&Metrics| Flown {
        elapsed_s: m.optimise_cpu_s / processors,
        messages: m.messages as f64,
        bytes: m.bytes as f64,
        multicast_bytes: m.multicast_bytes as f64,
    };
    Cell {
        airplanes,
        deployment: deployment.name(),
        elapsed_s: of(&elapsed_s),
        optimization_s: of(&|m| Some(elapsed_s(m)? / m.optimisations as f64)),
        messages: of(&|m| Some(m.messages as f64)),
        bytes: of(&|m| Some(m.bytes as f64)),
        multicast_bytes: of(&|m| Some(m.multicast_bytes as f64)),
        rounds: of(&|m| m.rounds_mean),
        losses: of(&|m| Some(m.losses_of_separation as f64)),
        delay_percent: of(&|m| m.mean_delay_percent),
        by_seed: all.iter().map(flown).collect(),
    }
}

/// Team and coordinator at each number of airplanes at which either had anything to say.
fn pairs(cells: &[Cell]) -> impl Iterator<Item = (&Cell, &Cell)> {
    let talks = |cell: &Cell| cell.messages.or_zero() > 0.0;
    let both = cells.chunks_exact(2).map(|pair| (&pair[0], &pair[1]));
    both.filter(move |(team, pim)| talks(team) && talks(pim))
}

type Value = fn(&Flown) -> f64;

/// A value of the coordinator over one of the team, seed by seed, wherever there are both and any.
fn ratios(cells: &[Cell], of_pim: Value, of_team: Value) -> Vec<Estimate> {
    pairs(cells)
        .map(|(team, pim)| ratio((&pim.by_seed, of_pim), (&team.by_seed, of_team)))
        .collect()
}

fn ratio((a, of_a): (&[Flown], Value), (b, of_b): (&[Flown], Value)) -> Estimate {
    let values = |all: &[Flown], of: Value| -> Vec<Option<f64>> {
        all.iter().map(|flown| Some(of(flown)).filter(|v| *v > 0.0)).collect()
    };
    Estimate::ratio(&values(a, of_a), &values(b, of_b))
}

/// Held if it is so at every number of airplanes; lost if nothing was measured at any.
fn everywhere(ratios: &[Estimate], holds: impl Fn(&Estimate) -> bool) -> Verdict {
    match ratios.iter().all(holds) {
        _ if ratios.is_empty() => Verdict::Lost,
        true => Verdict::Held,
        false => Verdict::NotHeld,
    }
}

/// Held if each mean is more than the one before; lost if there are no two.
fn rising(values: &[Estimate]) -> Verdict {
    match values.windows(2).all(|two| two[0].mean < two[1].mean) {
        _ if values.len() < 2 => Verdict::Lost,
        true => Verdict::Held,
        false => Verdict::NotHeld,
    }
}

/// Numbers one after the other, or that there are none.
fn listed(values: &[Estimate]) -> String {
    match values {
        [] => "nothing measured".into(),
        _ => values.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
    }
}

fn judge(cells: &[Cell]) -> Vec<Claim> {
    vec![
        takes_more_time(cells),
        needs_fewer_messages(cells),
        moves_far_more_bytes(cells),
        bytes_grow_faster(cells),
        multicast_saves(cells),
        hardly_in_time(cells),
    ]
}

fn takes_more_time(cells: &[Cell]) -> Claim {
    let ratios = ratios(cells, |f| f.elapsed_s, |f| f.elapsed_s);
    Claim {
        id: "A-1",
        paper: "pim takes more time than the team (figure 5)",
        papers_figure: None,
        ours: format!("pim / team: {}", listed(&ratios)),
        verdict: everywhere(&ratios, |ratio| ratio.is_above(1.0)),
        reason: "above 1 at every number of airplanes, by its interval".into(),
    }
}

fn needs_fewer_messages(cells: &[Cell]) -> Claim {
    let ratios = ratios(cells, |f| f.messages, |f| f.messages);
    Claim {
        id: "A-2",
        paper: "pim needs fewer messages than the team (figure 6)",
        papers_figure: None,
        ours: format!("pim / team: {}", listed(&ratios)),
        verdict: everywhere(&ratios, |ratio| ratio.is_below(1.0)),
        reason: "below 1 at every number of airplanes, by its interval".into(),
    }
}

fn moves_far_more_bytes(cells: &[Cell]) -> Claim {
    let unicast = ratios(cells, |f| f.bytes, |f| f.bytes);
    let multicast = ratios(cells, |f| f.bytes, |f| f.multicast_bytes);
    Claim {
        id: "A-3",
        paper: "pim moves far more bytes than the team (figure 7)",
        papers_figure: None,
        ours: format!(
            "pim / team: {}; against a team that multicasts: {}",
            listed(&unicast),
            listed(&multicast)
        ),
        verdict: everywhere(&unicast, |ratio| ratio.is_above(2.0)),
        reason: "far more: more than twice, by its interval at every number of airplanes".into(),
    }
}

fn bytes_grow_faster(cells: &[Cell]) -> Claim {
    let ends = |ratios: &[Estimate]| match ratios {
        [first, .., last] => vec![*first, *last],
        _ => Vec::new(),
    };
    let unicast = ends(&ratios(cells, |f| f.bytes, |f| f.bytes));
    let multicast = ends(&ratios(cells, |f| f.bytes, |f| f.multicast_bytes));
    Claim {
        id: "A-4",
        paper: "pim's bytes grow faster with the number of airplanes (figure 7)",
        papers_figure: None,
        ours: format!(
            "pim / team with the fewest and the most airplanes: {}; against a team that \
             multicasts: {}",
            listed(&unicast),
            listed(&multicast)
        ),
        verdict: rising(&unicast),
        reason: "the first mean ratio rises; the paper does not say which team it counts".into(),
    }
}

fn multicast_saves(cells: &[Cell]) -> Claim {
    let saved = |(team, _): (&Cell, &Cell)| {
        ratio((&team.by_seed, |f| f.bytes), (&team.by_seed, |f| f.multicast_bytes))
    };
    let saved: Vec<Estimate> = pairs(cells).map(saved).collect();
    Claim {
        id: "A-5",
        paper: "multicast saves the team further bandwidth, most with many airplanes",
        papers_figure: None,
        ours: format!("unicast / multicast: {}", listed(&saved)),
        verdict: rising(&saved),
        reason: "the mean ratio rises with every airplane".into(),
    }
}

fn hardly_in_time(cells: &[Cell]) -> Claim {
    let coordinators = pairs(cells).map(|(_, pim)| pim).filter(|pim| pim.airplanes >= MANY);
    let times_s = coordinators.map(|pim| pim.optimization_s).filter(|s| s.mean.is_some());
    let longest_s = times_s.max_by(|a, b| a.or_zero().total_cmp(&b.or_zero()));
    let (verdict, ours) = match longest_s {
        None => (Verdict::Lost, listed(&[])),
        Some(s) => {
            let verdict = Verdict::of(s.or_zero() > DT_S);
            (verdict, format!("the longest on average, in seconds of {DT_S}: {s}"))
        }
    };
    Claim {
        id: "A-6",
        paper: "with five and more airplanes pim can hardly compute the optimum in reasonable time",
        papers_figure: Some("from 5 airplanes on; one optimization every 5 s"),
        ours,
        verdict,
        reason: "an optimization takes longer than the time between two, with any such number"
            .into(),
    }
}

impl Report {
    /// Figures 4 to 7.
    pub fn figures(&self) -> Vec<Figure> {
        let figure = |title: &str, y_label: &str, value: fn(&Cell) -> &Estimate| Figure {
            title: title.into(),
            x_label: "airplanes".into(),
            y_label: y_label.into(),
            kind: FigureKind::Lines,
            series: BOTH
                .map(|deployment| Series {
                    name: deployment.name().into(),
                    points: self
                        .cells
                        .iter()
                        .filter(|cell| cell.deployment == deployment.name())
                        .filter_map(|cell| value(cell).point(cell.airplanes as f64))
                        .collect(),
                })
                .into(),
            ..Figure::default()
        };
        let flights = Figure {
            title: format!("Flights of {} airplanes", self.tracks_m.len()),
            x_label: "east, km".into(),
            y_label: "north, km".into(),
            kind: FigureKind::Ways,
            series: self.tracks_m.iter().map(|track| flight(track)).collect(),
            ..Figure::default()
        };
        vec![
            flights,
            figure("Time spent in all optimizations", "seconds", |c| &c.elapsed_s),
            figure("Messages of a whole flight", "messages", |c| &c.messages),
            figure("Bytes of a whole flight", "bytes", |c| &c.bytes),
        ]
    }

    /// All numbers.
    pub fn table(&self) -> Table {
        let note = "Per run, with 95 % intervals. Time is what deciding takes if every agent has \
                    a processor of its own, without transmission.";
        let columns = [
            "airplanes",
            "deployment",
            "time, s",
            "per optimization, s",
            "messages",
            "bytes",
            "multicast bytes",
            "rounds",
            "losses",
            "delay, %",
        ];
        let mut table = Table::new("Team and migrating coordinator", note, &columns);
        for c in &self.cells {
            let numbers = [
                &c.elapsed_s,
                &c.optimization_s,
                &c.messages,
                &c.bytes,
                &c.multicast_bytes,
                &c.rounds,
                &c.losses,
                &c.delay_percent,
            ];
            let head = [c.airplanes.to_string(), c.deployment.to_string()];
            table.row(head.into_iter().chain(numbers.iter().map(ToString::to_string)));
        }
        table
    }

    /// The report, the claims first.
    pub fn document(&self) -> Document {
        let plan = &self.plan;
        let setting = format!(
            "The super-conflict with the paper's numbers, {} seeds for each number of airplanes, up \
             to {} cycles of {DT_S} s, no shield. Version {}.",
            plan.seeds,
            plan.cycles,
            env!("CARGO_PKG_VERSION"),
        );
        let lead = format!("{} {setting}", claim::tally(&self.claims));
        let title = "Probability collectives in AGENTFLY, run anew";
        let mut document = claim::document(title, lead, plan.quick, &self.claims);
        document.experiment(Experiment {
            title: "Results",
            about: "Airplanes on a circle fly towards its other side and would all meet in the \
                    middle. They choose how to turn by probability collectives, every time anew: \
                    as a team of agents that send messages (`team`), or by one coordinator that \
                    migrates from airplane to airplane (`pim`). Both choose the same, so flights are \
                    the same, and time, messages and bytes tell them apart.",
            figures: self.figures(),
            tables: vec![self.table()],
        });
        let quick = if plan.quick { " --quick" } else { "" };
        let command =
            format!("sidestep reproduce agentfly{quick} --seeds {} --out DIR", plan.seeds);
        document.section("How to run it again").commands("In a shell", command);
        document
    }
}

fn flight(track_m: &[AirPoint]) -> Series {
    let km = |at: &AirPoint| Point::new(at[0] / 1000.0, at[1] / 1000.0);
    Series { name: String::new(), points: track_m.iter().map(km).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::document::Block;

    #[test]
    fn a_rehearsal_judges_every_claim() {
        // As far as to the first cycles in which they must mind each other.
        let short = Plan { seeds: 1, cycles: 16, ..Plan::quick() };
        let report = run(&short, &mut |_, _| ()).expect("a valid plan");
        assert_eq!((report.cells.len(), report.claims.len()), (6, 6));
        assert!(report.cells.iter().all(|cell| cell.messages.or_zero() > 0.0), "all have talked");
        assert!(report.claims.iter().all(|claim| claim.verdict != Verdict::Lost));
        let document = report.document();
        assert!(document.blocks.contains(&Block::Claims(report.claims.clone())));
        let figures = document.blocks.iter().filter(|block| matches!(block, Block::Figure(_)));
        assert_eq!(figures.count(), 4);
        assert_eq!(report.figures()[0].series.len(), 5);
    }

    /// Team and coordinator with the same value everywhere.
    fn alike(airplanes: usize, value: f64) -> [Cell; 2] {
        BOTH.map(|deployment| {
            let same = || Estimate::of([Some(value), Some(value)]);
            Cell {
                airplanes,
                deployment: deployment.name(),
                elapsed_s: same(),
                optimization_s: same(),
                messages: same(),
                bytes: same(),
                multicast_bytes: same(),
                rounds: same(),
                losses: same(),
                delay_percent: same(),
                by_seed: vec![
                    Flown {
                        elapsed_s: value,
                        messages: value,
                        bytes: value,
                        multicast_bytes: value
                    };
                    2
                ],
            }
        })
    }

    fn verdicts(cells: &[[Cell; 2]]) -> Vec<Verdict> {
        judge(&cells.concat()).iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn what_is_equal_is_not_held_and_what_is_not_there_is_lost() {
        assert_eq!(verdicts(&[alike(5, 5.0), alike(6, 5.0)]), [Verdict::NotHeld; 6]);
        assert_eq!(verdicts(&[alike(5, 0.0), alike(6, 0.0)]), [Verdict::Lost; 6]);
        // Numbers of airplanes that never met are left out of all ratios.
        let some = judge(&[alike(2, 0.0), alike(5, 6.0)].concat());
        assert_eq!(some[0].ours, "pim / team: 1.00 [1.00, 1.00] n=2");
        let verdicts: Vec<Verdict> = some.iter().map(|claim| claim.verdict).collect();
        use Verdict::{Held, Lost, NotHeld};
        assert_eq!(verdicts, [NotHeld, NotHeld, NotHeld, Lost, Lost, Held]);
    }
}
