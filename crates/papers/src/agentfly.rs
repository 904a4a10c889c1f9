//! The experiments of the airspace world's source paper: the super-conflict of 2 to 10 airplanes,
//! optimized by a team of agents and by a migrating coordinator.
//!
//! The paper's figures 5 to 7 show time, messages and bytes against the number of airplanes. Its
//! numbers are those of a Java platform of 2009; its claims say which is more, and those are judged
//! here. Both deployments choose the same controls, so flights are the same.
//!
//! Time is that of deciding, which is measured, and of transmission, which follows from the messages
//! and bytes that are counted: every airplane has one transmitter of 100 Mbit/s, and a message is
//! under way for 1 ms. A coordinator's hops follow one another; agents of a team send at the same
//! time, each to each of the others in turn.

mod sockets;

use crate::cells::{CaseResults, CaseRun, CaseRuns, Columns, Value, column, figure, series};
use crate::claims::{
    ClaimsFile, PaperClaims, ReportParts, ThresholdTest, combined_verdict, join_texts,
    judge_thresholds,
};
use crate::study::{Progress, Study, downcast, run_to_end, setting, setting_number, source};
use serde::Serialize;
use sidestep::kernel::{InputError, Simulation};
use sidestep::statistics::least_squares::Fit;
use sidestep::worlds::airspace::flight::Point as AirPoint;
use sidestep::worlds::airspace::{AirspaceRun, airspace_run};
use sidestep_document::claim::{Claim, Verdict, verdict_summary};
use sidestep_document::figure::Point;
use sidestep_document::{Document, Estimate, Figure, FigureKind, Series, Table};
pub use sockets::{FleetRunner, FlightMeasurement, SocketCase, SocketMeasurements, measure};

/// The amount of work to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AgentflyConfig {
    /// Numbers of airplanes.
    pub airplanes: Vec<usize>,
    /// Runs of each number, by seed from 1.
    pub seeds: usize,
    /// Maximum number of cycles of each run.
    pub cycles: u64,
    /// Workers.
    pub workers: usize,
    /// The part over real sockets.
    pub sockets: SocketsConfig,
    /// Whether this is a rehearsal.
    pub quick: bool,
}

/// The amount of work of the part over real sockets, with flights one after the other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocketsConfig {
    /// Numbers of airplanes.
    pub airplanes: Vec<usize>,
    /// Runs of each number, by seed from 1.
    pub seeds: usize,
    /// Most cycles of each run.
    pub cycles: u64,
}

impl Default for AgentflyConfig {
    fn default() -> Self {
        let workers = sidestep::kernel::workers::available_workers();
        let sockets = SocketsConfig { airplanes: (2..=10).collect(), seeds: 5, cycles: 400 };
        Self {
            airplanes: (2..=10).collect(),
            seeds: 20,
            cycles: 400,
            workers,
            sockets,
            quick: false,
        }
    }
}

impl AgentflyConfig {
    /// Returns a rehearsal of minutes at most, long enough for airplanes to meet.
    pub fn quick() -> Self {
        let sockets = SocketsConfig { airplanes: vec![3], seeds: 1, cycles: 20 };
        Self {
            airplanes: vec![2, 3, 5],
            seeds: 2,
            cycles: 60,
            sockets,
            quick: true,
            ..Self::default()
        }
    }
}

/// All results of the experiments.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AgentflyReport {
    /// The plan that was run.
    pub plan: AgentflyConfig,
    /// Results by number of airplanes, the team before the coordinator.
    cells: Vec<CaseResults>,
    /// The paper's claims and our verdicts.
    pub claims: Vec<Claim>,
    /// Measurements over real sockets, once there are any.
    sockets: Option<SocketMeasurements>,
    /// Tracks of the airplanes of the largest team with the first seed, meters.
    tracks_m: Vec<Vec<AirPoint>>,
}

/// Time between two optimizations, s.
const DT_S: f64 = 5.0;
/// Rate of an airplane's transmitter, bits per second.
const LINK_BIT_S: f64 = 1e8;
/// Seconds from the end of sending a message to its arrival; the default of `airspace.network`.
const LATENCY_S: f64 = 0.001;
/// Rates for which times are shown beside, bits per second.
const COMPARED_LINKS_BIT_S: [f64; 4] = [1e6, 1e7, LINK_BIT_S, 1e9];
/// Minimum number of airplanes for which the paper finds its coordinator slow.
const MIN_SLOW_AIRPLANES: u64 = 5;
const COMPARED_DEPLOYMENTS: [&str; 2] = ["team", "pim"];

const SCENARIO: &str = include_str!("../scenarios/agentfly/superconflict.toml");
const SWEEP: &str = include_str!("../scenarios/agentfly/superconflict.sweep.toml");
const AIRPLANES: &str = "airspace.generator.n";

const COLUMNS: Columns = Columns {
    case: &[],
    results: &[
        column("airplanes", "airplanes", |r| r.setting(AIRPLANES)),
        column("deployment", "deployment", |r| r.setting("airspace.deployment")),
        column("deciding_s", "deciding, s", |r| {
            r.mean_of(|run| optimization_cost(r, run).deciding_s)
        }),
        column("elapsed_s", "time, s", |r| {
            r.mean_of(|run| optimization_cost(r, run).elapsed_s(LINK_BIT_S))
        }),
        column("optimization_s", "per optimization, s", |r| {
            let optimization_s =
                |run: CaseRun<'_>| Some(optimization_cost(r, &run).optimization_s(LINK_BIT_S));
            Value::Estimate(Estimate::from_values(r.iter_runs().map(optimization_s)))
        }),
        column("messages", "messages", |r| r.mean("messages")),
        column("bytes", "bytes", |r| r.mean("bytes")),
        column("multicast_bytes", "multicast bytes", |r| r.mean("multicast_bytes")),
        column("rounds", "rounds", |r| r.mean("rounds_mean")),
        column("losses", "losses", |r| r.mean("losses_of_separation")),
        column("delay_percent", "delay, %", |r| r.mean("mean_delay_percent")),
        column("by_seed", "", |r| {
            let flown = |run: CaseRun<'_>| {
                let metric = |name| (name, run.number_or_zero(name));
                let spent = optimization_cost(r, &run);
                let elapsed = ("elapsed_s", spent.elapsed_s(LINK_BIT_S));
                let counted = ["messages", "bytes", "multicast_bytes"].map(metric);
                let by_link = TIME_BY_LINK.iter().zip(COMPARED_LINKS_BIT_S);
                let times = by_link.map(|(name, link)| (*name, spent.optimization_s(link)));
                [elapsed].into_iter().chain(counted).chain(times).collect()
            };
            Value::BySeed(r.iter_runs().map(flown).collect())
        }),
    ],
};

/// Names of the times of an optimization by link, in results by seed.
const TIME_BY_LINK: [&str; 4] = [
    "optimization_s_1_mbit_s",
    "optimization_s_10_mbit_s",
    "optimization_s_100_mbit_s",
    "optimization_s_1_gbit_s",
];

/// The effort of a run on all of its optimizations.
#[derive(Debug, Clone, Copy)]
struct OptimizationCost {
    /// Seconds of deciding, if every agent has a processor of its own: for a team the time of all
    /// agents divided by their number, for a coordinator all of it.
    deciding_s: f64,
    /// Bits that the busiest transmitters send one after the other.
    bits_in_turn: f64,
    /// Messages that wait for each other.
    messages_in_turn: f64,
    optimizations: f64,
}

impl OptimizationCost {
    /// Returns the seconds of deciding and of transmission.
    fn elapsed_s(self, link_bit_s: f64) -> f64 {
        self.deciding_s + self.bits_in_turn / link_bit_s + self.messages_in_turn * LATENCY_S
    }

    /// Returns the mean of an optimization; no number where there was none.
    fn optimization_s(self, link_bit_s: f64) -> f64 {
        self.elapsed_s(link_bit_s) / self.optimizations
    }
}

fn optimization_cost(case: &CaseRuns<'_>, run: &CaseRun<'_>) -> OptimizationCost {
    let is_team =
        case.setting("airspace.deployment") == Value::Word(COMPARED_DEPLOYMENTS[0].into());
    let n = case.setting_number(AIRPLANES);
    // All agents of a team send at once, each to all others; the messages leave in turn, but
    // arrive at the same time.
    let (senders, receivers) = if is_team { (n, n - 1.0) } else { (1.0, 1.0) };
    OptimizationCost {
        deciding_s: run.number_or_zero("optimize_cpu_s") / senders,
        bits_in_turn: 8.0 * run.number_or_zero("bytes") / senders,
        messages_in_turn: run.number_or_zero("messages") / (senders * receivers),
        optimizations: run.number_or_zero("optimizations"),
    }
}

/// Runs the experiments.
///
/// # Errors
/// When the plan asks for an impossible scenario.
pub fn run(
    plan: &AgentflyConfig,
    progress: &mut Progress<'_>,
) -> Result<AgentflyReport, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?.with_size(plan.seeds, Some(plan.cycles));
    let study =
        study.filtered(|v| plan.airplanes.contains(&(setting_number(v, AIRPLANES) as usize)));
    let cells = COLUMNS.cells(&study.run(plan.workers, "super-conflicts", progress)?);
    let claims = judge(&cells);
    let largest = plan.airplanes.iter().copied().max().unwrap_or(0);
    let tracks_m = tracks_m(plan, largest)?;
    Ok(AgentflyReport { plan: plan.clone(), cells, claims, sockets: None, tracks_m })
}

/// Returns the tracks of `n` airplanes with the first seed.
fn tracks_m(plan: &AgentflyConfig, n: usize) -> Result<Vec<Vec<AirPoint>>, InputError> {
    let settings = [
        setting(AIRPLANES, n as i64),
        setting("airspace.deployment", "direct"),
        setting("cycles", plan.cycles as i64),
    ];
    let mut run = airspace_run(&source(SCENARIO, &settings)?, 1)?;
    let mut tracks = vec![Vec::new(); n];
    let mut record = |run: &dyn Simulation| {
        for (track, cell) in tracks.iter_mut().zip(&downcast::<AirspaceRun>(run).state().airplanes)
        {
            let at = cell.pose().at;
            if track.last() != Some(&at) {
                track.push(at);
            }
        }
    };
    record(&run);
    run_to_end(&mut run, record);
    Ok(tracks)
}

/// Returns team and coordinator at each number of airplanes at which either sent any message.
fn deployment_pairs(cells: &[CaseResults]) -> impl Iterator<Item = (&CaseResults, &CaseResults)> {
    let has_messages = |cell: &CaseResults| cell.number("messages") > 0.0;
    let both = cells.chunks_exact(2).map(|pair| (&pair[0], &pair[1]));
    both.filter(move |(team, pim)| has_messages(team) && has_messages(pim))
}

/// A quantity of the flights of one case.
#[derive(Clone, Copy)]
struct CaseMetric<'a> {
    of: &'a CaseResults,
    name: &'a str,
}

impl CaseMetric<'_> {
    fn by_seed(&self) -> Vec<Option<f64>> {
        self.of.by_seed("by_seed", self.name)
    }
}

/// Returns a quantity of the coordinator above one of the team, at each number of airplanes.
fn fractions<'a>(
    cells: &'a [CaseResults],
    of_pim: &'a str,
    of_team: &'a str,
) -> Vec<[CaseMetric<'a>; 2]> {
    let pim_over_team = |(team, pim)| {
        [CaseMetric { of: pim, name: of_pim }, CaseMetric { of: team, name: of_team }]
    };
    deployment_pairs(cells).map(pim_over_team).collect()
}

/// Returns a value of the coordinator divided by one of the team, seed by seed, if both are there
/// and not 0.
fn ratios(cells: &[CaseResults], of_pim: &str, of_team: &str) -> Vec<Estimate> {
    fractions(cells, of_pim, of_team).into_iter().map(ratio).collect()
}

fn ratio([a, b]: [CaseMetric<'_>; 2]) -> Estimate {
    let values = |of: CaseMetric<'_>| -> Vec<Option<f64>> {
        of.by_seed().into_iter().map(|v| v.filter(|v| *v > 0.0)).collect()
    };
    Estimate::geometric_ratio(&values(a), &values(b))
}

/// Returns the power of the number of airplanes with which a ratio grows: its slope over that number,
/// both on logarithmic scales, seed by seed. Nothing with fewer than two numbers of airplanes.
fn power(fractions: &[[CaseMetric<'_>; 2]]) -> Estimate {
    let seeds = fractions.iter().map(|[a, _]| a.of.runs()).max().unwrap_or(0);
    let slope = |seed: usize| {
        let point = |[a, b]: &[CaseMetric<'_>; 2]| {
            let value = |of: &CaseMetric<'_>| of.by_seed().get(seed).copied().flatten();
            let ratio = value(a)? / value(b)?;
            (ratio.is_finite() && ratio > 0.0)
                .then(|| ((a.of.count("airplanes") as f64).ln(), ratio.ln()))
        };
        let (x, y): (Vec<f64>, Vec<f64>) = fractions.iter().filter_map(point).unzip();
        let rows: Vec<Vec<f64>> = x.iter().map(|x| vec![1.0, *x]).collect();
        Fit::new(&rows, &y).map(|fit| fit.coefficients[1])
    };
    Estimate::from_values((0..seeds).map(slope))
}

/// Returns numbers one after the other, or that there are none.
fn join_estimates(values: &[Estimate]) -> String {
    join_texts(values, ToString::to_string)
}

static CLAIMS: PaperClaims = PaperClaims::new(|| ClaimsFile::read(include_str!("agentfly.toml")));

/// Returns a claim by its number, its verdict, and our figures.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    CLAIMS.claim(id, verdict, ours.into())
}

fn judge(cells: &[CaseResults]) -> Vec<Claim> {
    vec![
        judge_more_time(cells),
        judge_fewer_messages(cells),
        judge_more_bytes(cells, "A-3a", "bytes"),
        judge_more_bytes(cells, "A-3b", "multicast_bytes"),
        judge_byte_growth(cells, "A-4a", "bytes"),
        judge_byte_growth(cells, "A-4b", "multicast_bytes"),
        judge_multicast(cells),
        judge_in_time(cells),
    ]
}

fn judge_more_time(cells: &[CaseResults]) -> Claim {
    let ratios = ratios(cells, "elapsed_s", "elapsed_s");
    let verdict = judge_thresholds(ratios.iter().map(|ratio| ThresholdTest::above(ratio, 1.0)));
    claim("A-1", verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

fn judge_fewer_messages(cells: &[CaseResults]) -> Claim {
    let ratios = ratios(cells, "messages", "messages");
    let verdict = judge_thresholds(ratios.iter().map(|ratio| ThresholdTest::below(ratio, 1.0)));
    claim("A-2", verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

/// Judges the bytes of the coordinator beside those of a team, `of_team`: each message to each
/// receiver, or once to all.
fn judge_more_bytes(cells: &[CaseResults], id: &str, of_team: &str) -> Claim {
    let ratios = ratios(cells, "bytes", of_team);
    let verdict = judge_thresholds(ratios.iter().map(|ratio| ThresholdTest::above(ratio, 2.0)));
    claim(id, verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

fn judge_byte_growth(cells: &[CaseResults], id: &str, of_team: &str) -> Claim {
    let power = power(&fractions(cells, "bytes", of_team));
    let ends = first_and_last(&ratios(cells, "bytes", of_team));
    let ours = format!(
        "pim / team grows with the power {power} of the number of airplanes; with the fewest and the most: {}",
        join_estimates(&ends)
    );
    claim(id, judge_thresholds([ThresholdTest::above(&power, 0.0)]), ours)
}

/// Returns the first and the last of several.
fn first_and_last(ratios: &[Estimate]) -> Vec<Estimate> {
    match ratios {
        [first, .., last] => vec![*first, *last],
        _ => Vec::new(),
    }
}

fn judge_multicast(cells: &[CaseResults]) -> Claim {
    // To the only other one of two, a multicast is an ordinary message.
    let teams =
        deployment_pairs(cells).map(|(team, _)| team).filter(|team| team.count("airplanes") > 2);
    let saved = |of| ["bytes", "multicast_bytes"].map(|name| CaseMetric { of, name });
    let fractions: Vec<_> = teams.map(saved).collect();
    let saved: Vec<Estimate> = fractions.iter().copied().map(ratio).collect();
    let power = power(&fractions);
    let verdict = combined_verdict(&[
        judge_thresholds(saved.iter().map(|saved| ThresholdTest::above(saved, 1.0))),
        judge_thresholds([ThresholdTest::above(&power, 0.0)]),
    ]);
    let ours = format!(
        "unicast / multicast: {}; it grows with the power {power} of the number of airplanes",
        join_estimates(&saved)
    );
    claim("A-5", verdict, ours)
}

fn judge_in_time(cells: &[CaseResults]) -> Claim {
    let coordinators = || {
        deployment_pairs(cells)
            .map(|(_, pim)| pim)
            .filter(|pim| pim.count("airplanes") >= MIN_SLOW_AIRPLANES)
    };
    let slow = |pim: &CaseResults| ThresholdTest::above(pim.estimate("optimization_s"), DT_S);
    let ours = join_texts(coordinators(), |pim| {
        format!("{} airplanes: {} s", pim.count("airplanes"), pim.estimate("optimization_s"))
    });
    let ours = format!("{ours}; {:.0} Mbit/s, an optimization every {DT_S} s", 1e-6 * LINK_BIT_S);
    claim("A-6", judge_thresholds(coordinators().map(slow)), ours)
}

impl AgentflyReport {
    /// Returns the report with the measurements over real sockets.
    #[must_use]
    pub fn with_sockets(mut self, sockets: SocketMeasurements) -> Self {
        self.claims.extend(sockets.claim());
        self.sockets = Some(sockets);
        self
    }

    /// Returns figures 4 to 7.
    fn figures(&self) -> Vec<Figure> {
        let over = |title: &str, y_label: &str, y: &str| {
            let of = |deployment: &str| {
                let cells = self.cells.iter().filter(|c| c.has_text("deployment", deployment));
                series(deployment, cells, ["airplanes", y])
            };
            figure(title, ["airplanes", y_label], COMPARED_DEPLOYMENTS.map(of))
        };
        let title = format!("Flights of {} airplanes", self.tracks_m.len());
        let flown =
            (0..).zip(&self.tracks_m).map(|(id, track)| flight(id, track)).collect::<Vec<_>>();
        let flights = figure(&title, ["east, km", "north, km"], flown);
        vec![
            Figure { kind: FigureKind::Ways, note: TRACK_NOTE.into(), ..flights },
            over("Time of all optimizations, with transmission", "seconds", "elapsed_s"),
            over("Messages of a whole flight", "messages", "messages"),
            over("Bytes of a whole flight", "bytes", "bytes"),
        ]
    }

    /// Returns all numbers.
    fn table(&self) -> Table {
        let note = format!(
            "Per run, with 95 % intervals. Deciding is measured, as if every agent had a processor of \
             its own. Time adds transmission, which follows from the messages and bytes counted: one \
             transmitter of {:.0} Mbit/s for each airplane, and {} ms from sender to receiver.",
            1e-6 * LINK_BIT_S,
            1e3 * LATENCY_S
        );
        COLUMNS.table("Team and migrating coordinator", &note, &self.cells)
    }

    /// Returns the time of an optimization by rate of the link.
    fn link_table(&self) -> Table {
        let note = format!(
            "Mean seconds of deciding and transmission, with 95 % intervals; the next optimization is \
             due after {DT_S} s."
        );
        let rates = COMPARED_LINKS_BIT_S.map(|link| format!("{} Mbit/s", 1e-6 * link));
        let heads = ["airplanes", "deployment"].into_iter().chain(rates.iter().map(String::as_str));
        let mut table =
            Table::new("Time of one optimization by link", &note, &heads.collect::<Vec<_>>());
        for cell in &self.cells {
            let time =
                |name: &&str| Estimate::from_values(cell.by_seed("by_seed", name)).to_string();
            let case = ["airplanes", "deployment"].map(|name| cell.value(name).to_string());
            table.push_row(case.into_iter().chain(TIME_BY_LINK.iter().map(time)));
        }
        table
    }

    /// Returns the report, the claims first.
    pub fn document(&self) -> Document {
        let plan = &self.plan;
        let setting = format!(
            "The super-conflict with the paper's numbers, {} seeds for each number of airplanes, up \
             to {} cycles of {DT_S} s, no shield. Version {}.",
            plan.seeds,
            plan.cycles,
            env!("CARGO_PKG_VERSION"),
        );
        let lead = format!("{} {setting}", verdict_summary(&self.claims));
        let quick = if plan.quick { " --quick" } else { "" };
        let command =
            format!("sidestep reproduce agentfly{quick} --seeds {} --out DIR", plan.seeds);
        let results = (self.figures(), vec![self.table(), self.link_table()]);
        let sockets = self.sockets.iter().map(|sockets| (Vec::new(), vec![sockets.table()]));
        let experiments = CLAIMS.experiments([results].into_iter().chain(sockets));
        let parts = ReportParts { claims: &self.claims, pictures: Vec::new(), experiments };
        CLAIMS.document(lead, plan.quick, parts, command)
    }
}

/// The words of the marks of flights.
const TRACK_NOTE: &str = "A ring is where an airplane starts, an arrowhead where it arrives.";

fn flight(id: u32, track_m: &[AirPoint]) -> Series {
    let km = |at: &AirPoint| Point::new(at[0] / 1000.0, at[1] / 1000.0);
    Series { name: format!("airplane {id}"), points: track_m.iter().map(km).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::document::Block;

    #[test]
    fn a_rehearsal_judges_every_claim() {
        // Up to the first cycles in which they must avoid each other.
        let short = AgentflyConfig { seeds: 1, cycles: 16, ..AgentflyConfig::quick() };
        let report = run(&short, &mut |_, _| ()).expect("a valid plan");
        assert_eq!((report.cells.len(), report.claims.len()), (6, 8));
        assert!(report.cells.iter().all(|cell| cell.number("messages") > 0.0), "all have talked");
        assert!(report.claims.iter().all(|claim| claim.verdict == Verdict::Undecided), "one run");
        let document = report.document();
        assert!(document.blocks.contains(&Block::Claims(report.claims.clone())));
        let figures = document.blocks.iter().filter(|block| matches!(block, Block::Figure(_)));
        assert_eq!(figures.count(), 4);
        assert_eq!(report.figures()[0].series.len(), 5);
    }

    /// Numbers of one deployment with some airplanes.
    struct Numbers {
        elapsed_s: f64,
        optimization_s: f64,
        messages: f64,
        bytes: f64,
        multicast_bytes: f64,
    }

    fn results(airplanes: u64, deployment: &str, of: &Numbers) -> CaseResults {
        // As they differ by seed in a real experiment, but little.
        let spread = |value: f64, seed: usize| value * (1.0 + 0.001 * seed as f64);
        let seeds = AgentflyConfig::default().seeds;
        let estimate = |value| {
            Value::Estimate(Estimate::from_values((0..seeds).map(|s| Some(spread(value, s)))))
        };
        let of_run = |seed: usize| {
            [
                ("elapsed_s", of.elapsed_s),
                ("messages", of.messages),
                ("bytes", of.bytes),
                ("multicast_bytes", of.multicast_bytes),
            ]
            .map(|(name, value)| (name, spread(value, seed)))
            .into()
        };
        let columns = [
            ("airplanes", Value::Count(airplanes)),
            ("deployment", Value::Word(deployment.into())),
            ("optimization_s", estimate(of.optimization_s)),
            ("messages", estimate(of.messages)),
            ("by_seed", Value::BySeed((0..seeds).map(of_run).collect())),
        ];
        CaseResults::new([], columns)
    }

    /// Team and coordinator with numbers that the paper would be right with, or wrong.
    fn paper(is_right: bool, airplanes: u64) -> [CaseResults; 2] {
        let n = airplanes as f64;
        let multicast_bytes = if is_right { n } else { n * n };
        let team = Numbers {
            elapsed_s: 1.0,
            optimization_s: 0.1,
            messages: n * n,
            bytes: n * n,
            multicast_bytes,
        };
        let pim = if is_right {
            Numbers {
                elapsed_s: 2.0,
                optimization_s: 6.0,
                messages: n,
                bytes: 9.0 * n * n * n,
                ..team
            }
        } else {
            Numbers { elapsed_s: 0.5, optimization_s: 4.0, messages: 2.0 * n * n, bytes: n, ..team }
        };
        [
            results(airplanes, COMPARED_DEPLOYMENTS[0], &team),
            results(airplanes, COMPARED_DEPLOYMENTS[1], &pim),
        ]
    }

    fn verdicts(cells: &[[CaseResults; 2]]) -> Vec<Verdict> {
        judge(&cells.concat()).iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn every_claim_can_be_held_and_can_be_refuted_by_the_runs_of_a_full_plan() {
        let all = |is_right| verdicts(&[3, 5, 10].map(|n| paper(is_right, n)));
        assert_eq!(all(true), [Verdict::Held; 8]);
        assert_eq!(all(false), [Verdict::Refuted; 8]);
    }

    #[test]
    fn what_is_not_there_decides_nothing() {
        let nobody = Numbers {
            elapsed_s: 0.0,
            optimization_s: f64::NAN,
            messages: 0.0,
            bytes: 0.0,
            multicast_bytes: 0.0,
        };
        let silent = |n| COMPARED_DEPLOYMENTS.map(|deployment| results(n, deployment, &nobody));
        assert_eq!(verdicts(&[silent(5), silent(6)]), [Verdict::Undecided; 8]);
        // Numbers of airplanes that never met are left out of all ratios; one number shows no growth.
        let some = judge(&[silent(2), paper(true, 5)].concat());
        assert_eq!(some[0].ours, "pim / team: 2.00 [2.00, 2.00] n=20");
        let undecided = |claim: &&Claim| claim.verdict == Verdict::Undecided;
        let ids: Vec<&str> = some.iter().filter(undecided).map(|claim| claim.id).collect();
        assert_eq!(ids, ["A-4a", "A-4b", "A-5"]);
    }

    #[test]
    fn a_slower_link_takes_longer_and_hurts_the_coordinator_most() {
        let spent = OptimizationCost {
            deciding_s: 1.0,
            bits_in_turn: 1e9,
            messages_in_turn: 1e3,
            optimizations: 4.0,
        };
        assert_eq!(spent.elapsed_s(1e8), 1.0 + 10.0 + 1.0);
        assert_eq!(spent.optimization_s(1e9), 0.75);
    }
}
