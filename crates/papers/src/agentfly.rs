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

use crate::case_results::{
    CaseResults, CaseRun, CaseRuns, Columns, NamedNumbers, Summary, Value, column, figure, series,
};
use crate::claims::{
    ClaimsFile, PaperClaims, ReportParts, ThresholdTest, combined_verdict, join_texts,
    judge_thresholds,
};
use crate::study::{Progress, Study, downcast, run_to_end, setting, setting_number, source};
use crate::trial_file::TrialFile;
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
    /// Numbers of airplanes that meet, each of them a case.
    pub airplanes: Vec<usize>,
    /// Runs of each number, by seed from 1.
    pub seeds: usize,
    /// Maximum number of cycles of each run.
    pub cycles: u64,
    /// Number of runs at once; only measured times depend on it.
    pub workers: usize,
    /// The part over real sockets.
    pub sockets: SocketsConfig,
    /// Whether this is a rehearsal.
    pub quick: bool,
}

/// The amount of work of the part over real sockets, with flights one after the other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocketsConfig {
    /// Numbers of airplanes that meet, each of them a case.
    pub airplanes: Vec<usize>,
    /// Runs of each number, by seed from 1.
    pub seeds: usize,
    /// Most cycles of each run.
    pub cycles: u64,
}

impl Default for AgentflyConfig {
    /// The paper's experiment (section 7): 2 to 10 airplanes, 20 runs of each. All arrive within 400 cycles.
    fn default() -> Self {
        let workers = sidestep::kernel::workers::available_workers();
        // Five runs are the fewest that decide a claim; over sockets, flights are run one after the other.
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
    #[serde(rename = "cells")]
    cases: Vec<CaseResults>,
    /// The paper's claims and our verdicts.
    pub claims: Vec<Claim>,
    /// Measurements over real sockets, once there are any.
    sockets: Option<SocketMeasurements>,
    /// Tracks of the airplanes of the largest team with the first seed, meters.
    tracks_m: Vec<Vec<AirPoint>>,
}

/// Time between two optimizations, s (section 7: they start regularly each 5 seconds).
const DT_S: f64 = 5.0;
/// Rate of an airplane's transmitter, bits per second. The paper does not state its link, so that times with others are shown
/// beside.
const LINK_BIT_S: f64 = 1e8;
/// Seconds from the end of sending a message to its arrival; the default of `airspace.network`.
const LATENCY_S: f64 = 0.001;
/// Rates for which times are shown beside, bits per second.
const COMPARED_LINKS_BIT_S: [f64; 4] = [1e6, 1e7, LINK_BIT_S, 1e9];
/// Minimum number of airplanes for which the paper finds its coordinator slow (section 7).
const MIN_SLOW_AIRPLANES: u64 = 5;
/// The deployments of the paper: a team of agents (section 4), and a migrating coordinator, its "process integrated
/// mechanism" (section 6).
const COMPARED_DEPLOYMENTS: [&str; 2] = ["team", "pim"];

const SCENARIO: &str = include_str!("../scenarios/agentfly/superconflict.toml");
const SWEEP: &str = include_str!("../scenarios/agentfly/superconflict.sweep.toml");
const AIRPLANES: &str = "airspace.generator.n";

const COLUMNS: Columns = Columns {
    case: &[],
    results: &[
        column("airplanes", "airplanes", Summary::Setting(AIRPLANES)),
        column("deployment", "deployment", Summary::Setting("airspace.deployment")),
        column("deciding_s", "deciding, s", Summary::Computed(mean_deciding_s)),
        column("elapsed_s", "time, s", Summary::Computed(mean_elapsed_s)),
        column("optimization_s", "per optimization, s", Summary::Computed(mean_optimization_s)),
        column("messages", "messages", Summary::Mean("messages")),
        column("bytes", "bytes", Summary::Mean("bytes")),
        column("multicast_bytes", "multicast bytes", Summary::Mean("multicast_bytes")),
        column("rounds", "rounds", Summary::Mean("rounds_mean")),
        column("losses", "losses", Summary::Mean("losses_of_separation")),
        column("delay_percent", "delay, %", Summary::Mean("mean_delay_percent")),
        column("in_flight", "", Summary::Mean("in_flight")),
        column("by_seed", "", Summary::Computed(by_seed)),
    ],
};

fn mean_deciding_s(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| optimization_cost(case, run).deciding_s)
}

fn mean_elapsed_s(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| optimization_cost(case, run).elapsed_s(LINK_BIT_S))
}

fn mean_optimization_s(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| optimization_cost(case, run).optimization_s(LINK_BIT_S))
}

/// Returns the numbers of each run that claims pair by seed.
fn by_seed(case: &CaseRuns<'_>) -> Value {
    Value::BySeed(case.iter_runs().map(|run| numbers_of_run(case, &run)).collect())
}

fn numbers_of_run(case: &CaseRuns<'_>, run: &CaseRun<'_>) -> NamedNumbers {
    let cost = optimization_cost(case, run);
    let mut numbers = vec![("elapsed_s", cost.elapsed_s(LINK_BIT_S))];
    for metric in ["messages", "bytes", "multicast_bytes", "rounds_mean"] {
        numbers.push((metric, run.number_or_zero(metric)));
    }
    for (name, link_bit_s) in TIME_BY_LINK.into_iter().zip(COMPARED_LINKS_BIT_S) {
        numbers.push((name, cost.optimization_s(link_bit_s)));
    }
    numbers
}

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
    let mut senders = 1.0;
    let mut receivers = 1.0;
    if is_team {
        // All agents of a team send at once, each to all others (algorithm 1, lines 9 and 17); the
        // messages leave in turn, but arrive at the same time.
        senders = n;
        receivers = n - 1.0;
    }
    OptimizationCost {
        deciding_s: run.number_or_zero("optimize_cpu_s") / senders,
        bits_in_turn: 8.0 * run.number_or_zero("bytes") / senders,
        messages_in_turn: run.number_or_zero("messages") / (senders * receivers),
        optimizations: run.number_or_zero("optimizations"),
    }
}

/// Runs the experiments, except for trials that are kept.
///
/// # Errors
/// When the plan asks for an impossible scenario.
pub fn run(
    plan: &AgentflyConfig,
    kept: &TrialFile,
    progress: &mut Progress<'_>,
) -> Result<AgentflyReport, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?.with_size(plan.seeds, Some(plan.cycles));
    let study =
        study.filtered(|v| plan.airplanes.contains(&(setting_number(v, AIRPLANES) as usize)));
    let cases = COLUMNS.cases(&study.run(plan.workers, "super-conflicts", kept, progress)?);
    let claims = judge(&cases);
    let largest = plan.airplanes.iter().copied().max().unwrap_or(0);
    let tracks_m = tracks_m(plan, largest)?;
    Ok(AgentflyReport { plan: plan.clone(), cases, claims, sockets: None, tracks_m })
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
    append_positions(&mut tracks, &run);
    run_to_end(&mut run, |run| append_positions(&mut tracks, run));
    Ok(tracks)
}

fn append_positions(tracks: &mut [Vec<AirPoint>], run: &dyn Simulation) {
    let airplanes = &downcast::<AirspaceRun>(run).state().airplanes;
    for (track, airplane) in tracks.iter_mut().zip(airplanes) {
        let at = airplane.pose().at;
        // An airplane that has arrived keeps its place: one point of it is enough.
        if track.last() != Some(&at) {
            track.push(at);
        }
    }
}

/// Returns team and coordinator at each number of airplanes at which both sent messages: where no conflict came up, there is
/// nothing to compare.
fn deployment_pairs(cases: &[CaseResults]) -> impl Iterator<Item = (&CaseResults, &CaseResults)> {
    // The sweep file varies the deployment within each number of airplanes, the team first.
    let pairs = cases.chunks_exact(2).map(|pair| (&pair[0], &pair[1]));
    pairs.filter(|(team, pim)| has_messages(team) && has_messages(pim))
}

fn has_messages(case: &CaseResults) -> bool {
    case.number("messages") > 0.0
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

    /// Returns the values above 0: the others have no logarithm, which a geometric mean takes.
    fn positive_by_seed(&self) -> Vec<Option<f64>> {
        self.by_seed().into_iter().map(|value| value.filter(|value| *value > 0.0)).collect()
    }

    fn of_seed(&self, seed: usize) -> Option<f64> {
        self.by_seed().get(seed).copied().flatten()
    }
}

/// Returns a quantity of the coordinator above one of the team, at each number of airplanes.
fn fractions<'a>(
    cases: &'a [CaseResults],
    of_pim: &'a str,
    of_team: &'a str,
) -> Vec<[CaseMetric<'a>; 2]> {
    let mut fractions = Vec::new();
    for (team, pim) in deployment_pairs(cases) {
        let numerator = CaseMetric { of: pim, name: of_pim };
        let denominator = CaseMetric { of: team, name: of_team };
        fractions.push([numerator, denominator]);
    }
    fractions
}

/// Returns a value of the coordinator divided by one of the team, seed by seed, if both are there
/// and not 0.
fn ratios(cases: &[CaseResults], of_pim: &str, of_team: &str) -> Vec<Estimate> {
    fractions(cases, of_pim, of_team).into_iter().map(ratio).collect()
}

fn ratio([a, b]: [CaseMetric<'_>; 2]) -> Estimate {
    Estimate::geometric_ratio(&a.positive_by_seed(), &b.positive_by_seed())
}

/// Returns the power of the number of airplanes with which a ratio grows: its slope over that number,
/// both on logarithmic scales, seed by seed. Nothing with fewer than two numbers of airplanes.
fn power(fractions: &[[CaseMetric<'_>; 2]]) -> Estimate {
    let seeds = fractions.iter().map(|[a, _]| a.of.runs()).max().unwrap_or(0);
    Estimate::from_values((0..seeds).map(|seed| log_slope(fractions, seed)))
}

/// Returns the slope of a ratio over the number of airplanes, on logarithmic scales, in the runs of one seed.
fn log_slope(fractions: &[[CaseMetric<'_>; 2]], seed: usize) -> Option<f64> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut log_ratios = Vec::new();
    for fraction in fractions {
        let Some(ratio) = ratio_of_seed(fraction, seed) else { continue };
        let airplanes = fraction[0].of.count("airplanes") as f64;
        rows.push(vec![1.0, airplanes.ln()]);
        log_ratios.push(ratio.ln());
    }
    Fit::new(&rows, &log_ratios).map(|fit| fit.coefficients[1])
}

/// Returns the ratio in the runs of one seed, if it has a logarithm.
fn ratio_of_seed([a, b]: &[CaseMetric<'_>; 2], seed: usize) -> Option<f64> {
    let ratio = a.of_seed(seed)? / b.of_seed(seed)?;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

/// Returns numbers one after the other, or that there are none.
fn join_estimates(values: &[Estimate]) -> String {
    join_texts(values, ToString::to_string)
}

static CLAIMS: PaperClaims =
    PaperClaims::new(|| ClaimsFile::read(include_str!("../claims/agentfly.toml")));

/// Words and rule of the claim are those of its file.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    CLAIMS.claim(id, verdict, ours.into())
}

fn judge(cases: &[CaseResults]) -> Vec<Claim> {
    vec![
        judge_more_time(cases),
        judge_fewer_messages(cases),
        judge_more_bytes(cases, "A-3a", "bytes"),
        judge_more_bytes(cases, "A-3b", "multicast_bytes"),
        judge_byte_growth(cases, "A-4a", "bytes"),
        judge_byte_growth(cases, "A-4b", "multicast_bytes"),
        judge_multicast(cases),
        judge_in_time(cases),
        judge_dip(cases, "A-8a", "elapsed_s"),
        judge_dip(cases, "A-8b", "rounds_mean"),
    ]
}

fn judge_more_time(cases: &[CaseResults]) -> Claim {
    let ratios = ratios(cases, "elapsed_s", "elapsed_s");
    let verdict = judge_all_above(&ratios, CLAIMS.threshold("A-1"));
    claim("A-1", verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

fn judge_fewer_messages(cases: &[CaseResults]) -> Claim {
    let ratios = ratios(cases, "messages", "messages");
    let threshold = CLAIMS.threshold("A-2");
    let tests = ratios.iter().map(|ratio| ThresholdTest::below(ratio, threshold));
    let verdict = judge_thresholds(tests);
    claim("A-2", verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

/// Each of the ratios has to pass by itself, see [`judge_thresholds`].
fn judge_all_above(ratios: &[Estimate], threshold: f64) -> Verdict {
    judge_thresholds(ratios.iter().map(|ratio| ThresholdTest::above(ratio, threshold)))
}

/// Judges the bytes of the coordinator beside those of a team, `of_team`: each message to each
/// receiver, or once to all.
fn judge_more_bytes(cases: &[CaseResults], id: &str, of_team: &str) -> Claim {
    let ratios = ratios(cases, "bytes", of_team);
    let verdict = judge_all_above(&ratios, CLAIMS.threshold(id));
    claim(id, verdict, format!("pim / team: {}", join_estimates(&ratios)))
}

fn judge_byte_growth(cases: &[CaseResults], id: &str, of_team: &str) -> Claim {
    let power = power(&fractions(cases, "bytes", of_team));
    let ends = first_and_last(&ratios(cases, "bytes", of_team));
    let ours = format!(
        "pim / team grows with the power {power} of the number of airplanes; with the fewest and the most: {}",
        join_estimates(&ends)
    );
    claim(id, judge_all_above(&[power], CLAIMS.threshold(id)), ours)
}

/// Nothing of fewer than two, which show no growth.
fn first_and_last(ratios: &[Estimate]) -> Vec<Estimate> {
    match ratios {
        [first, .., last] => vec![*first, *last],
        _ => Vec::new(),
    }
}

fn judge_multicast(cases: &[CaseResults]) -> Claim {
    let teams = deployment_pairs(cases).map(|(team, _)| team);
    let mut fractions = Vec::new();
    // To the only other one of two, a multicast is an ordinary message.
    for of in teams.filter(|team| team.count("airplanes") > 2) {
        fractions.push(["bytes", "multicast_bytes"].map(|name| CaseMetric { of, name }));
    }
    let saved: Vec<Estimate> = fractions.iter().copied().map(ratio).collect();
    let power = power(&fractions);
    // Saved at all is a ratio above 1; "most with many airplanes" is a ratio that grows: a power above 0.
    let verdict = combined_verdict(&[judge_all_above(&saved, 1.0), judge_all_above(&[power], 0.0)]);
    let ours = format!(
        "unicast / multicast: {}; it grows with the power {power} of the number of airplanes",
        join_estimates(&saved)
    );
    claim("A-5", verdict, ours)
}

fn judge_in_time(cases: &[CaseResults]) -> Claim {
    let coordinators = deployment_pairs(cases).map(|(_, pim)| pim);
    let mut texts = Vec::new();
    let mut times_s = Vec::new();
    for pim in coordinators.filter(|pim| pim.count("airplanes") >= MIN_SLOW_AIRPLANES) {
        let optimization_s = pim.estimate("optimization_s");
        texts.push(format!("{} airplanes: {optimization_s} s", pim.count("airplanes")));
        times_s.push(*optimization_s);
    }
    let ours = format!(
        "{}; {:.0} Mbit/s, an optimization every {DT_S} s",
        join_texts(texts, |text| text),
        1e-6 * LINK_BIT_S
    );
    // An optimization is too late when the next is due before it ends.
    claim("A-6", judge_all_above(&times_s, DT_S), ours)
}

/// Numbers of airplanes at which the paper's times dip, and the number before them.
const DIP_AIRPLANES: [u64; 2] = [5, 6];
const BEFORE_DIP_AIRPLANES: u64 = 4;

/// Judges whether a quantity is smaller in the dip than before it, with both deployments.
fn judge_dip(cases: &[CaseResults], id: &str, name: &'static str) -> Claim {
    let mut ratios = Vec::new();
    let mut texts = Vec::new();
    for deployment in COMPARED_DEPLOYMENTS {
        let metric_at = |airplanes: u64| {
            let mut of_deployment = cases.iter().filter(|c| c.has_text("deployment", deployment));
            let of = of_deployment.find(|case| case.count("airplanes") == airplanes)?;
            Some(CaseMetric { of, name })
        };
        for airplanes in DIP_AIRPLANES {
            if let (Some(dip), Some(before)) =
                (metric_at(airplanes), metric_at(BEFORE_DIP_AIRPLANES))
            {
                let dip_ratio = ratio([dip, before]);
                texts.push(format!("{deployment}, {airplanes} airplanes: {dip_ratio}"));
                ratios.push(dip_ratio);
            }
        }
    }
    let threshold = CLAIMS.threshold(id);
    let tests = ratios.iter().map(|ratio| ThresholdTest::below(ratio, threshold));
    let ours = join_texts(texts, |text| text);
    let verdict = judge_thresholds(tests);
    claim(id, verdict, format!("over {BEFORE_DIP_AIRPLANES} airplanes: {ours}"))
}

impl AgentflyReport {
    /// Returns the report with the measurements over real sockets.
    #[must_use]
    pub fn with_sockets(mut self, sockets: SocketMeasurements) -> Self {
        self.claims.extend(sockets.claim());
        self.sockets = Some(sockets);
        self
    }

    /// The paper's figures 4 to 7 in order: flights, time, messages, bytes.
    fn figures(&self) -> Vec<Figure> {
        let title = format!("Flights of {} airplanes", self.tracks_m.len());
        let tracks = (0..).zip(&self.tracks_m);
        let flights: Vec<Series> = tracks.map(|(id, track_m)| flight(id, track_m)).collect();
        let flights = figure(&title, ["east, km", "north, km"], flights);
        let time_title = "Time of all optimizations, with transmission";
        let span = self.flight_span();
        vec![
            Figure { kind: FigureKind::Ways, note: self.track_note(), ..flights },
            self.figure_by_airplanes(time_title, "seconds", "elapsed_s"),
            self.figure_by_airplanes(&format!("Messages of {span}"), "messages", "messages"),
            self.figure_by_airplanes(&format!("Bytes of {span}"), "bytes", "bytes"),
        ]
    }

    /// Returns whether all airplanes of all runs have arrived; in a rehearsal the cycles end before.
    fn are_flights_whole(&self) -> bool {
        self.cases.iter().all(|case| case.number("in_flight") == 0.0)
    }

    /// Returns the words for what sums are over.
    fn flight_span(&self) -> String {
        if self.are_flights_whole() {
            "a whole flight".into()
        } else {
            format!("the first {:.0} s of a flight", self.plan.cycles as f64 * DT_S)
        }
    }

    fn track_note(&self) -> String {
        let end = if self.are_flights_whole() { "it arrives" } else { "it is at the end" };
        format!("A ring is where an airplane starts, an arrowhead where {end}.")
    }

    /// Returns a figure of column `y` over the number of airplanes.
    fn figure_by_airplanes(&self, title: &str, y_label: &str, y: &str) -> Figure {
        let lines = COMPARED_DEPLOYMENTS.map(|deployment| {
            let cases = self.cases.iter().filter(|c| c.has_text("deployment", deployment));
            series(deployment, cases, ["airplanes", y])
        });
        figure(title, ["airplanes", y_label], lines)
    }

    /// One row for each case, with all its numbers.
    fn table(&self) -> Table {
        let note = format!(
            "Per run of {}, with 95 % intervals. Deciding is measured, as if every agent had a processor of \
             its own. Time adds transmission, which follows from the messages and bytes counted: one \
             transmitter of {:.0} Mbit/s for each airplane, and {} ms from sender to receiver.",
            self.flight_span(),
            1e-6 * LINK_BIT_S,
            1e3 * LATENCY_S
        );
        COLUMNS.table("Team and migrating coordinator", &note, &self.cases)
    }

    /// Returns the time of an optimization by rate of the link.
    fn link_table(&self) -> Table {
        let note = format!(
            "Mean seconds of deciding and transmission, with 95 % intervals; the next optimization is \
             due after {DT_S} s."
        );
        let rates = COMPARED_LINKS_BIT_S.map(|link| format!("{} Mbit/s", 1e-6 * link));
        let mut heads = vec!["airplanes", "deployment"];
        heads.extend(rates.iter().map(String::as_str));
        let mut table = Table::new("Time of one optimization by link", &note, &heads);
        for case in &self.cases {
            let mut row =
                vec![case.value("airplanes").to_string(), case.value("deployment").to_string()];
            for name in TIME_BY_LINK {
                row.push(Estimate::from_values(case.by_seed("by_seed", name)).to_string());
            }
            table.push_row(row);
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
        let mut results = vec![(self.figures(), vec![self.table(), self.link_table()])];
        if let Some(sockets) = &self.sockets {
            results.push((Vec::new(), vec![sockets.table(&plan.sockets)]));
        }
        let experiments = CLAIMS.experiments(results);
        let parts = ReportParts { claims: &self.claims, pictures: Vec::new(), experiments };
        CLAIMS.document(lead, plan.quick, parts, command)
    }
}

fn flight(id: u32, track_m: &[AirPoint]) -> Series {
    let points_km = track_m.iter().map(|at| Point::new(at[0] / 1000.0, at[1] / 1000.0));
    Series { name: format!("airplane {id}"), points: points_km.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::document::Block;

    #[test]
    fn a_rehearsal_judges_every_claim() {
        // Up to the first cycles in which they must avoid each other.
        let short = AgentflyConfig { seeds: 1, cycles: 16, ..AgentflyConfig::quick() };
        let report = run(&short, &TrialFile::none(), &mut |_, _| ()).expect("a valid plan");
        assert_eq!((report.cases.len(), report.claims.len()), (6, 10));
        assert!(report.cases.iter().all(|case| case.number("messages") > 0.0), "all have talked");
        assert!(report.claims.iter().all(|claim| claim.verdict == Verdict::Undecided), "one run");
        let document = report.document();
        assert!(document.blocks.contains(&Block::Claims(report.claims.clone())));
        let figures = document.blocks.iter().filter(|block| matches!(block, Block::Figure(_)));
        assert_eq!(figures.count(), 4);
        assert_eq!(report.figures()[0].series.len(), 5);
        // Nobody has arrived, so that no caption speaks of a whole flight.
        let titles: Vec<String> = report.figures().into_iter().map(|figure| figure.title).collect();
        assert_eq!(titles[2], "Messages of the first 80 s of a flight");
        assert!(!report.figures()[0].note.contains("arrives"), "{titles:?}");
        assert!(report.table().note.contains("the first 80 s"), "{}", report.table().note);
    }

    /// Numbers of one deployment with some airplanes.
    struct Numbers {
        elapsed_s: f64,
        rounds: f64,
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
                ("rounds_mean", of.rounds),
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
        let dip = if is_right && DIP_AIRPLANES.contains(&airplanes) { 0.5 } else { 1.0 };
        let growth = dip * n;
        let team = Numbers {
            elapsed_s: growth,
            rounds: growth,
            optimization_s: 0.1,
            messages: n * n,
            bytes: n * n,
            multicast_bytes,
        };
        let pim = if is_right {
            Numbers {
                elapsed_s: 2.0 * growth,
                optimization_s: 6.0,
                messages: n,
                bytes: 9.0 * n * n * n,
                ..team
            }
        } else {
            Numbers {
                elapsed_s: 0.5 * growth,
                optimization_s: 4.0,
                messages: 2.0 * n * n,
                bytes: n,
                ..team
            }
        };
        [
            results(airplanes, COMPARED_DEPLOYMENTS[0], &team),
            results(airplanes, COMPARED_DEPLOYMENTS[1], &pim),
        ]
    }

    fn verdicts(cases: &[[CaseResults; 2]]) -> Vec<Verdict> {
        judge(&cases.concat()).iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn every_claim_can_be_held_and_can_be_refuted_by_the_runs_of_a_full_plan() {
        let all = |is_right| verdicts(&[3, 4, 5, 6, 10].map(|n| paper(is_right, n)));
        assert_eq!(all(true), [Verdict::Held; 10]);
        assert_eq!(all(false), [Verdict::Refuted; 10]);
    }

    #[test]
    fn what_is_not_there_decides_nothing() {
        let nobody = Numbers {
            elapsed_s: 0.0,
            rounds: f64::NAN,
            optimization_s: f64::NAN,
            messages: 0.0,
            bytes: 0.0,
            multicast_bytes: 0.0,
        };
        let silent = |n| COMPARED_DEPLOYMENTS.map(|deployment| results(n, deployment, &nobody));
        assert_eq!(verdicts(&[silent(5), silent(6)]), [Verdict::Undecided; 10]);
        // Numbers of airplanes that never met are left out of all ratios; one number shows no growth.
        let some = judge(&[silent(2), paper(true, 5)].concat());
        assert_eq!(some[0].ours, "pim / team: 2.00 [2.00, 2.00] n=20");
        let undecided = |claim: &&Claim| claim.verdict == Verdict::Undecided;
        let ids: Vec<&str> = some.iter().filter(undecided).map(|claim| claim.id).collect();
        assert_eq!(ids, ["A-4a", "A-4b", "A-5", "A-8a", "A-8b"]);
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
