//! The experiments of the airspace world's source paper: the super-conflict of 2 to 10 airplanes,
//! optimized by a team of agents and by a migrating coordinator.
//!
//! The paper's figures 5 to 7 show time, messages and bytes against the number of airplanes. Its
//! numbers are those of a Java platform of 2009; its claims say which is more, and those are judged
//! here. Both deployments choose the same controls, so flights are the same.

use crate::cells::{Cell, Columns, Run, Runs, Value, column, figure, series};
use crate::claims::{File, Words, all, listed};
use crate::study::{Progress, Study, finish, known, number, setting, source};
use serde::Serialize;
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::airspace::flight::Point as AirPoint;
use sidestep::worlds::airspace::{AirspaceRun, airspace_run};
use sidestep_document::claim::{Claim, Verdict, tally};
use sidestep_document::figure::Point;
use sidestep_document::{Document, Estimate, Figure, FigureKind, Series, Table};

/// The amount of work to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Numbers of airplanes.
    pub airplanes: Vec<usize>,
    /// Runs of each number, by seed from 1.
    pub seeds: usize,
    /// Most cycles of each run.
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
    /// Returns a rehearsal of minutes at most, long enough for airplanes to meet.
    pub fn quick() -> Self {
        Self { airplanes: vec![2, 3, 5], seeds: 2, cycles: 60, quick: true, ..Self::default() }
    }
}

/// All results of the experiments.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The plan that was run.
    pub plan: Plan,
    /// Results by number of airplanes, the team before the coordinator.
    cells: Vec<Cell>,
    /// The paper's claims and our verdicts.
    pub claims: Vec<Claim>,
    /// Ways of the airplanes of the largest team with the first seed, meters.
    tracks_m: Vec<Vec<AirPoint>>,
}

/// Time between two optimizations, s.
const DT_S: f64 = 5.0;
/// Number of airplanes from which on the paper finds its coordinator slow.
const MANY: u64 = 5;
const BOTH: [&str; 2] = ["team", "pim"];

const SCENARIO: &str = include_str!("../../../scenarios/papers/agentfly/superconflict.toml");
const SWEEP: &str = include_str!("../../../scenarios/papers/agentfly/superconflict.sweep.toml");
const AIRPLANES: &str = "airspace.generator.n";

const COLUMNS: Columns = Columns {
    case: &[],
    came: &[
        column("airplanes", "airplanes", |r| r.set(AIRPLANES)),
        column("deployment", "deployment", |r| r.set("airspace.deployment")),
        column("elapsed_s", "time, s", |r| r.mean_of(|run| elapsed_s(r, run))),
        column("optimization_s", "per optimization, s", |r| {
            r.mean_of(|run| elapsed_s(r, run) / run.or_zero("optimisations"))
        }),
        column("messages", "messages", |r| r.mean("messages")),
        column("bytes", "bytes", |r| r.mean("bytes")),
        column("multicast_bytes", "multicast bytes", |r| r.mean("multicast_bytes")),
        column("rounds", "rounds", |r| r.mean("rounds_mean")),
        column("losses", "losses", |r| r.mean("losses_of_separation")),
        column("delay_percent", "delay, %", |r| r.mean("mean_delay_percent")),
        column("by_seed", "", |r| {
            let flown = |run: Run<'_>| {
                let metric = |name| (name, run.or_zero(name));
                let elapsed = ("elapsed_s", elapsed_s(r, &run));
                vec![elapsed, metric("messages"), metric("bytes"), metric("multicast_bytes")]
            };
            Value::BySeed(r.each().map(flown).collect())
        }),
    ],
};

/// Returns the seconds spent deciding, if every agent has a processor of its own: for a team the
/// time of all agents divided by their number, for a coordinator all of it.
fn elapsed_s(case: &Runs<'_>, run: &Run<'_>) -> f64 {
    let is_team = case.set("airspace.deployment") == Value::Word(BOTH[0].into());
    let processors = if is_team { case.set_number(AIRPLANES) } else { 1.0 };
    run.or_zero("optimise_cpu_s") / processors
}

/// Runs the experiments.
///
/// # Errors
/// When the plan asks for an impossible scenario.
pub fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Report, InputError> {
    let study = Study::of_file(SWEEP, SCENARIO)?.sized(plan.seeds, Some(plan.cycles));
    let study = study.keep(|v| plan.airplanes.contains(&(number(v, AIRPLANES) as usize)));
    let cells = COLUMNS.cells(&study.run((plan.workers, "super-conflicts"), progress)?);
    let claims = judge(&cells);
    let largest = plan.airplanes.iter().copied().max().unwrap_or(0);
    let tracks_m = tracks_m(plan, largest)?;
    Ok(Report { plan: plan.clone(), cells, claims, tracks_m })
}

/// Returns the ways of `n` airplanes with the first seed.
fn tracks_m(plan: &Plan, n: usize) -> Result<Vec<Vec<AirPoint>>, InputError> {
    let settings = [
        setting(AIRPLANES, n as i64),
        setting("airspace.deployment", "direct"),
        setting("cycles", plan.cycles as i64),
    ];
    let mut run = airspace_run(&source(SCENARIO, &settings)?, 1)?;
    let mut tracks = vec![Vec::new(); n];
    let mut note = |run: &dyn Simulation| {
        for (track, cell) in tracks.iter_mut().zip(&known::<AirspaceRun>(run).state().airplanes) {
            let at = cell.pose().at;
            if track.last() != Some(&at) {
                track.push(at);
            }
        }
    };
    note(&run);
    finish(&mut run, note);
    Ok(tracks)
}

/// Returns team and coordinator at each number of airplanes at which either sent any message.
fn pairs(cells: &[Cell]) -> impl Iterator<Item = (&Cell, &Cell)> {
    let talks = |cell: &Cell| cell.number("messages") > 0.0;
    let both = cells.chunks_exact(2).map(|pair| (&pair[0], &pair[1]));
    both.filter(move |(team, pim)| talks(team) && talks(pim))
}

/// Returns a value of the coordinator divided by one of the team, seed by seed, if both are there
/// and not 0.
fn ratios(cells: &[Cell], of_pim: &str, of_team: &str) -> Vec<Estimate> {
    pairs(cells).map(|(team, pim)| ratio((pim, of_pim), (team, of_team))).collect()
}

fn ratio((a, of_a): (&Cell, &str), (b, of_b): (&Cell, &str)) -> Estimate {
    let values = |cell: &Cell, of: &str| -> Vec<Option<f64>> {
        cell.by_seed("by_seed", of).into_iter().map(|v| v.filter(|v| *v > 0.0)).collect()
    };
    Estimate::ratio(&values(a, of_a), &values(b, of_b))
}

/// Returns `Held` if each mean is more than the one before; `Lost` if there are not two.
fn rising(values: &[Estimate]) -> Verdict {
    match values.windows(2).all(|two| two[0].mean < two[1].mean) {
        _ if values.len() < 2 => Verdict::Lost,
        true => Verdict::Held,
        false => Verdict::NotHeld,
    }
}

/// Returns numbers one after the other, or that there are none.
fn each(values: &[Estimate]) -> String {
    listed(values, ToString::to_string)
}

static WORDS: Words = Words::new(|| File::read(include_str!("agentfly.toml")));

/// Returns a claim by its number, its verdict, and our figures.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    WORDS.claim(id, verdict, ours.into())
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
    let ratios = ratios(cells, "elapsed_s", "elapsed_s");
    claim(
        "A-1",
        all(&ratios, |ratio| ratio.is_above(1.0)),
        format!("pim / team: {}", each(&ratios)),
    )
}

fn needs_fewer_messages(cells: &[Cell]) -> Claim {
    let ratios = ratios(cells, "messages", "messages");
    claim(
        "A-2",
        all(&ratios, |ratio| ratio.is_below(1.0)),
        format!("pim / team: {}", each(&ratios)),
    )
}

fn moves_far_more_bytes(cells: &[Cell]) -> Claim {
    let unicast = ratios(cells, "bytes", "bytes");
    let multicast = ratios(cells, "bytes", "multicast_bytes");
    claim(
        "A-3",
        all(&unicast, |ratio| ratio.is_above(2.0)),
        format!(
            "pim / team: {}; against a team that multicasts: {}",
            each(&unicast),
            each(&multicast)
        ),
    )
}

fn bytes_grow_faster(cells: &[Cell]) -> Claim {
    let ends = |ratios: &[Estimate]| match ratios {
        [first, .., last] => vec![*first, *last],
        _ => Vec::new(),
    };
    let unicast = ends(&ratios(cells, "bytes", "bytes"));
    let multicast = ends(&ratios(cells, "bytes", "multicast_bytes"));
    claim(
        "A-4",
        rising(&unicast),
        format!(
            "pim / team with the fewest and the most airplanes: {}; against a team that \
             multicasts: {}",
            each(&unicast),
            each(&multicast)
        ),
    )
}

fn multicast_saves(cells: &[Cell]) -> Claim {
    let saved = |(team, _): (&Cell, &Cell)| ratio((team, "bytes"), (team, "multicast_bytes"));
    let saved: Vec<Estimate> = pairs(cells).map(saved).collect();
    claim("A-5", rising(&saved), format!("unicast / multicast: {}", each(&saved)))
}

fn hardly_in_time(cells: &[Cell]) -> Claim {
    let coordinators =
        pairs(cells).map(|(_, pim)| pim).filter(|pim| pim.count("airplanes") >= MANY);
    let times_s =
        coordinators.map(|pim| *pim.estimate("optimization_s")).filter(|s| s.mean.is_some());
    let longest_s = times_s.max_by(|a, b| a.or_zero().total_cmp(&b.or_zero()));
    let (verdict, ours) = match longest_s {
        None => (Verdict::Lost, each(&[])),
        Some(s) => {
            let verdict = Verdict::of(s.or_zero() > DT_S);
            (verdict, format!("the longest on average, in seconds of {DT_S}: {s}"))
        }
    };
    claim("A-6", verdict, ours)
}

impl Report {
    /// Returns figures 4 to 7.
    fn figures(&self) -> Vec<Figure> {
        let over = |title: &str, y_label: &str, y: &str| {
            let of = |deployment: &str| {
                let cells = self.cells.iter().filter(|c| c.says("deployment", deployment));
                series(deployment, cells, ["airplanes", y])
            };
            figure(title, ["airplanes", y_label], BOTH.map(of))
        };
        let title = format!("Flights of {} airplanes", self.tracks_m.len());
        let flown: Vec<Series> = self.tracks_m.iter().map(|track| flight(track)).collect();
        let flights = figure(&title, ["east, km", "north, km"], flown);
        vec![
            Figure { kind: FigureKind::Ways, ..flights },
            over("Time spent in all optimizations", "seconds", "elapsed_s"),
            over("Messages of a whole flight", "messages", "messages"),
            over("Bytes of a whole flight", "bytes", "bytes"),
        ]
    }

    /// Returns all numbers.
    fn table(&self) -> Table {
        let note = "Per run, with 95 % intervals. Time is what deciding takes if every agent has \
                    a processor of its own, without transmission.";
        COLUMNS.table("Team and migrating coordinator", note, &self.cells)
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
        let lead = format!("{} {setting}", tally(&self.claims));
        let quick = if plan.quick { " --quick" } else { "" };
        let command =
            format!("sidestep reproduce agentfly{quick} --seeds {} --out DIR", plan.seeds);
        let experiments = WORDS.experiments([(self.figures(), vec![self.table()])]);
        WORDS.document(lead, plan.quick, (&self.claims, Vec::new(), experiments), command)
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
        // Up to the first cycles in which they must avoid each other.
        let short = Plan { seeds: 1, cycles: 16, ..Plan::quick() };
        let report = run(&short, &mut |_, _| ()).expect("a valid plan");
        assert_eq!((report.cells.len(), report.claims.len()), (6, 6));
        assert!(report.cells.iter().all(|cell| cell.number("messages") > 0.0), "all have talked");
        assert!(report.claims.iter().all(|claim| claim.verdict != Verdict::Lost));
        let document = report.document();
        assert!(document.blocks.contains(&Block::Claims(report.claims.clone())));
        let figures = document.blocks.iter().filter(|block| matches!(block, Block::Figure(_)));
        assert_eq!(figures.count(), 4);
        assert_eq!(report.figures()[0].series.len(), 5);
    }

    /// Team and coordinator with the same value everywhere.
    fn alike(airplanes: u64, value: f64) -> [Cell; 2] {
        BOTH.map(|deployment| {
            let same = Value::Estimate(Estimate::of([Some(value), Some(value)]));
            let of_run: Vec<_> =
                ["elapsed_s", "messages", "bytes", "multicast_bytes"].map(|of| (of, value)).into();
            let came = [
                ("airplanes", Value::Count(airplanes)),
                ("deployment", Value::Word(deployment.into())),
                ("optimization_s", same.clone()),
                ("messages", same),
                ("by_seed", Value::BySeed(vec![of_run; 2])),
            ];
            Cell::new([], came)
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
