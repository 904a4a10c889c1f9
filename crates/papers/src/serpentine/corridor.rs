//! One robot with a laser finds its way through the winding corridor, others follow as a snake
//! (slides E2, N1 to N6): widths, numbers of followers, and readings of "leaving a wall".

use super::{DT_S, SerpentineConfig};
use crate::cells::{CaseResults, Column, Columns, Value, column, figure, series};
use crate::study::{Progress, Study, downcast, run_to_end, setting_number};
use serde::Serialize;
use sidestep::experiment::sweep::{Outcome, Variant};
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::chain::{ChainRun, chain_run};
use sidestep_document::{Figure, Table};

/// The scenario.
pub(super) const SCENARIO: &str = include_str!("../../scenarios/serpentine/corridor.toml");
const SWEEP: &str = include_str!("../../scenarios/serpentine/corridor.sweep.toml");

/// Keys that are varied.
pub(super) const WIDTH: &str = "ground.corridor.width_m";
const CONNECTORS: &str = "chains.connectors";
const LEAVING: &str = "chains.tasks.navigator.leaving";

/// The slides' band of distances from walls, meters from the robot's middle.
const BAND_M: [f64; 2] = [0.7, 0.9];
/// The readings of "leaving a wall"; the first is ours, the last the slides' words.
pub(super) const READINGS: [&str; 3] = ["latched", "range", "level"];

const COLUMNS: Columns = Columns {
    case: &[
        column("leaving", "leaving", |r| r.setting(LEAVING)),
        column("width_m", "width, m", |r| r.setting(WIDTH)),
        column("followers", "followers", |r| Value::Count(r.setting_number(CONNECTORS) as u64 - 1)),
    ],
    results: &[
        column("arrived", "arrived", |r| r.proportion(|run| run.number_or_zero("done") == 1.0)),
        column("vetoes", "vetoes", |r| r.sum("vetoes")),
        column("penetrations", "steps inside", |r| r.sum("penetrations")),
        column("steps", "", |r| r.sum("steps")),
        CLEARANCE,
        ROD_VIOLATION,
        column("bumper_events", "bumper events", |r| r.sum("robots.bumper_events")),
        column("min_gap_m", "gap, mm", |r| {
            Value::Number(r.min_value("robots.min_gap_m").unwrap_or(1.0).min(1.0))
        })
        .with_format(|c| c.format_mm("min_gap_m")),
        column("mean_lag_m", "mean lag, m", |r| r.mean("robots.mean_lag_m")),
        column("max_lag_m", "max lag, m", |r| Value::Number(r.max_value("robots.max_lag_m")))
            .with_format(|c| format!("{:.3}", c.number("max_lag_m"))),
        column("speed_m_s", "speed, m/s", |r| {
            r.mean_of(|run| run.number_or_zero("way_m") / (run.number_or_zero("steps") * DT_S))
        }),
        column("in_band_percent", "0.7-0.9 m, %", |r| {
            r.mean_proportion(|run| run.percent_of_steps("in_band"))
        }),
    ],
};

/// Least distance of any part from anything that it must not touch.
pub(super) const CLEARANCE: Column =
    column("min_clearance_m", "clearance, mm", |r| Value::Maybe(r.min_value("min_clearance_m")))
        .with_format(|c| c.format_mm("min_clearance_m"));

/// Least distance between parts of a chain that are no neighbors; below 0 where they crossed.
pub(super) const OWN_GAP: Column =
    column("min_own_gap_m", "own parts, mm", |r| Value::Maybe(r.min_value("min_own_gap_m")))
        .with_format(|c| c.format_mm("min_own_gap_m"));

/// Greatest speed of any connector.
pub(super) const MAX_SPEED: Column =
    column("max_speed_m_s", "fastest part, m/s", |r| Value::Number(r.max_value("max_speed_m_s")))
        .with_format(|c| format!("{:.2}", c.number("max_speed_m_s")));

/// Greatest amount by which a rod was outside its limits.
pub(super) const ROD_VIOLATION: Column =
    column("rod_violation_m", "", |r| Value::Number(r.max_value("max_rod_violation_m")));

/// Returns whether the leader's nearest wall is in the slides' band.
fn is_in_band(run: &dyn Simulation) -> bool {
    let run = downcast::<ChainRun<2>>(run);
    let leader = run.state().body(0).chain.points()[0];
    let apart_m = run.world().obstacles.clearance_m([leader; 2], 0.0, 1.0);
    (BAND_M[0]..=BAND_M[1]).contains(&apart_m)
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CorridorResults {
    /// Results by case, the fewest followers first.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the sweep of a plan.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let followers =
        |v: &Variant| plan.followers.contains(&(setting_number(v, CONNECTORS) as usize - 1));
    let study = Study::from_file(SWEEP, SCENARIO)?.filtered_by_number(WIDTH, &plan.widths_m);
    Ok(study.filtered(followers).with_size(plan.seeds, Some(plan.corridor_cycles)))
}

impl CorridorResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let what = "swarm in the corridor";
        let results = study(plan)?.run_by(plan.workers, what, progress, |scenario, _, cell| {
            let mut run = chain_run(&scenario()?, 1)?;
            let mut in_band = 0_u64;
            run_to_end(&mut *run, |run| in_band += u64::from(is_in_band(run)));
            let mut outcome = Outcome::from_simulation(*cell, &*run);
            outcome.metrics.insert("in_band".into(), in_band.into());
            let way_m = downcast::<ChainRun<2>>(&*run).state().body(0).tally.way_m;
            outcome.metrics.insert("way_m".into(), way_m.into());
            Ok(outcome)
        })?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    /// Returns the cells of a reading, the fewest followers first.
    pub(super) fn cells_with_reading<'a>(
        &'a self,
        leaving: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cells.iter().filter(move |c| c.has_text("leaving", leaving))
    }

    /// Returns the cells of a reading with the fewest followers.
    pub(super) fn cells_with_fewest_followers<'a>(
        &'a self,
        leaving: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        let fewest = self.cells.iter().map(|c| c.count("followers")).min();
        self.cells_with_reading(leaving).filter(move |c| Some(c.count("followers")) == fewest)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Runs differ by the laser's error of 1 cm. Clearance is of connectors and rods, \
                    which keep 8 cm of room for the robots that follow them on wheels; gap, bumpers \
                    and lag are those robots'. `level` is the slides' wording taken literally.";
        COLUMNS.table("A swarm in the winding corridor", note, &self.cells)
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        let over_width = |title, y_label, y| {
            let lines =
                READINGS.map(|of| series(of, self.cells_with_fewest_followers(of), ["width_m", y]));
            figure(title, ["width of the corridor, m", y_label], lines)
        };
        vec![
            over_width("Speed of a leader that wants 0.5 m/s", "m/s", "speed_m_s"),
            over_width("Time within the band of 0.7 to 0.9 m", "%", "in_band_percent"),
        ]
    }
}
