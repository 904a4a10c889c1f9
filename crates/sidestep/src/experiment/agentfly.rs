//! The experiments of the airspace world's source paper: the super-conflict of 2 to 10 airplanes,
//! optimized by a team of agents and by a migrating coordinator.
//!
//! The paper's figures 5 to 7 show time, messages and bytes against the number of airplanes. Its
//! numbers are those of a Java platform of 2009; its claims are about which is more, and those
//! are judged here. Both deployments choose the same controls, so flights are the same.

use super::figure::{Figure, FigureKind, Series, Table};
use super::loria::claims::{Claim, Verdict};
use super::{Estimate, farm};
use crate::scenario::Source;
use crate::worlds::airspace::airplane::Point as AirPoint;
use crate::worlds::airspace::deploy::Deployment;
use crate::worlds::airspace::metrics::Metrics;
use crate::worlds::airspace::simulation::AirspaceSimulation;
use serde::Serialize;
use sidestep_kernel::{InputError, Simulation};

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
        let workers = sidestep_kernel::workers::available();
        Self { airplanes: (2..=10).collect(), seeds: 20, cycles: 400, workers, quick: false }
    }
}

impl Plan {
    /// A rehearsal of seconds.
    pub fn quick() -> Self {
        Self { airplanes: vec![2, 3, 5], seeds: 2, cycles: 10, quick: true, ..Self::default() }
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

const BOTH: [Deployment; 2] = [Deployment::Team, Deployment::Pim];

/// Runs the experiments.
///
/// # Errors
/// When the plan asks for what no scenario can be.
pub fn run(plan: &Plan, progress: &mut farm::Progress<'_>) -> Result<Report, InputError> {
    let mut cells = Vec::new();
    for &n in &plan.airplanes {
        for deployment in BOTH {
            let what = format!("{n} airplanes, {}", deployment.name());
            let all = farm::in_batches(
                plan.workers,
                plan.seeds,
                |share| progress(&what, share),
                |k| flown(plan, n, deployment, k as u64 + 1),
            );
            let all: Vec<Metrics> = all.into_iter().collect::<Result<_, InputError>>()?;
            cells.push(cell(n, deployment, &all));
        }
    }
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
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\njitter_m = 0.0\n",
        plan.cycles,
        deployment.name(),
    );
    AirspaceSimulation::new(&Source::new("agentfly", text, ""), 1)
}

fn cell(airplanes: usize, deployment: Deployment, all: &[Metrics]) -> Cell {
    let of = |value: &dyn Fn(&Metrics) -> Option<f64>| Estimate::of(all.iter().map(value));
    let processors = if deployment == Deployment::Team { airplanes as f64 } else { 1.0 };
    Cell {
        airplanes,
        deployment: deployment.name(),
        elapsed_s: of(&|m| Some(m.optimise_cpu_s / processors)),
        messages: of(&|m| Some(m.messages as f64)),
        bytes: of(&|m| Some(m.bytes as f64)),
        multicast_bytes: of(&|m| Some(m.multicast_bytes as f64)),
        rounds: of(&|m| m.rounds_mean),
        losses: of(&|m| Some(m.losses_of_separation as f64)),
        delay_percent: of(&|m| m.mean_delay_percent),
    }
}

/// Team and coordinator at each number of airplanes.
fn pairs(cells: &[Cell]) -> impl Iterator<Item = (&Cell, &Cell)> {
    cells.chunks_exact(2).map(|pair| (&pair[0], &pair[1]))
}

fn judge(cells: &[Cell]) -> Vec<Claim> {
    let everywhere = |value: fn(&Cell) -> f64, more: bool| {
        let holds = |(team, pim): &(&Cell, &Cell)| (value(pim) > value(team)) == more;
        let holding = pairs(cells).filter(holds).count();
        let all = pairs(cells).count();
        let ratios: Vec<String> =
            pairs(cells).map(|(t, p)| format!("{:.2}", value(p) / value(t))).collect();
        let verdict = if holding == all { Verdict::Held } else { Verdict::NotHeld };
        (
            verdict,
            format!("pim / team: {}", ratios.join(", ")),
            format!("{holding} of {all} numbers of airplanes"),
        )
    };
    let claim = |id, paper, (verdict, ours, reason): (Verdict, String, String)| Claim {
        id,
        paper,
        ours,
        verdict,
        reason,
    };
    let bytes = |cell: &Cell| cell.bytes.or_zero();
    let ratios = |team_bytes: fn(&Cell) -> f64| {
        let ratio = |(team, pim): (&Cell, &Cell)| bytes(pim) / team_bytes(team);
        (pairs(cells).next().map_or(0.0, ratio), pairs(cells).last().map_or(0.0, ratio))
    };
    let (first, last) = ratios(|cell| cell.bytes.or_zero());
    let (first_multi, last_multi) = ratios(|cell| cell.multicast_bytes.or_zero());
    let grows = if last > first { Verdict::Held } else { Verdict::NotHeld };
    vec![
        claim(
            "A-1",
            "pim takes more time than the team (figure 5)",
            everywhere(|c| c.elapsed_s.or_zero(), true),
        ),
        claim(
            "A-2",
            "pim needs fewer messages than the team (figure 6)",
            everywhere(|c| c.messages.or_zero(), false),
        ),
        claim("A-3", "pim moves far more bytes than the team (figure 7)", {
            let twice = |(team, pim): (&Cell, &Cell)| bytes(pim) >= 2.0 * bytes(team);
            let (_, ours, _) = everywhere(bytes, true);
            let multicast = pairs(cells)
                .map(|(team, pim)| format!("{:.2}", bytes(pim) / team.multicast_bytes.or_zero()));
            let multicast = multicast.collect::<Vec<_>>().join(", ");
            let ours = format!("{ours}; against a team that multicasts: {multicast}");
            let verdict = if pairs(cells).all(twice) { Verdict::Held } else { Verdict::NotHeld };
            (verdict, ours, "far more: at least twice, at every number of airplanes".into())
        }),
        claim(
            "A-4",
            "pim's bytes grow faster with the number of airplanes (figure 7)",
            (
                grows,
                format!(
                    "pim / team: {first:.2} at first, {last:.2} at last; against a team that \
                     multicasts {first_multi:.2} and {last_multi:.2}"
                ),
                "the first ratio rises; the paper does not say which team it counts".into(),
            ),
        ),
        claim("A-5", "multicast saves the team further bandwidth, most with many airplanes", {
            let saved = |cell: &Cell| cell.bytes.or_zero() / cell.multicast_bytes.or_zero();
            let teams: Vec<f64> = pairs(cells).map(|(team, _)| saved(team)).collect();
            let rises = teams.is_sorted() && teams.last() > teams.first();
            let ours = teams.iter().map(|s| format!("{s:.1}")).collect::<Vec<_>>().join(", ");
            let verdict = if rises { Verdict::Held } else { Verdict::NotHeld };
            (verdict, format!("unicast / multicast: {ours}"), "the ratio rises".into())
        }),
    ]
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
        };
        let flights = Figure {
            title: format!("Flights of {} airplanes", self.tracks_m.len()),
            x_label: "east, km".into(),
            y_label: "north, km".into(),
            kind: FigureKind::Lines,
            series: self.tracks_m.iter().map(|track| flight(track)).collect(),
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

    /// The report as Markdown.
    pub fn to_markdown(&self) -> String {
        let rehearsal = if self.plan.quick { " A rehearsal: without weight." } else { "" };
        let seeds = self.plan.seeds;
        let mut claims =
            Table::new("Claims of the paper", "", &["claim", "paper", "ours", "verdict", "rule"]);
        for c in &self.claims {
            let cells = [c.id, c.paper, &c.ours, c.verdict.name(), &c.reason];
            claims.row(cells.map(String::from));
        }
        format!(
            "# Probability collectives in AGENTFLY, run anew\n\nSuper-conflict, the paper's numbers, \
             {seeds} seeds each, no shield.{rehearsal}\n\n{claims}\n{}",
            self.table()
        )
    }
}

fn flight(track_m: &[AirPoint]) -> Series {
    let km = |at: &AirPoint| (at[0] / 1000.0, at[1] / 1000.0, None);
    Series { name: String::new(), points: track_m.iter().map(km).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rehearsal_judges_every_claim() {
        let report = run(&Plan::quick(), &mut |_, _| ()).expect("a valid plan");
        assert_eq!((report.cells.len(), report.claims.len()), (6, 5));
        assert!(report.to_markdown().contains("| A-2 |"));
        assert_eq!(report.figures().len(), 4);
        assert_eq!(report.figures()[0].series.len(), 5);
    }
}
