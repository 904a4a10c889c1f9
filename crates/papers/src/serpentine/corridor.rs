//! One robot with a laser finds its way through the winding corridor, others follow as a snake
//! (slides E2, N1 to N6): widths, numbers of followers, and readings of "leaving a wall".

use super::{DT_S, SerpentineConfig};
use crate::case_results::{
    CaseResults, CaseRuns, Column, Columns, Format, Summary, Value, column, figure, series,
};
use crate::study::{Progress, Study, downcast, run_to_end, setting_number};
use serde::Serialize;
use sidestep::experiment::sweep::Outcome;
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::chain::{ChainRun, chain_run};
use sidestep_document::{Figure, Table};

/// The scenario, of which a picture shows a run as well.
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
        column("leaving", "leaving", Summary::Setting(LEAVING)),
        column("width_m", "width, m", Summary::Setting(WIDTH)),
        column("followers", "followers", Summary::Computed(followers)),
    ],
    results: &[
        ARRIVED,
        column("vetoes", "vetoes", Summary::Sum("vetoes")),
        column("penetrations", "steps inside", Summary::Sum("penetrations")),
        column("steps", "", Summary::Sum("steps")),
        CLEARANCE,
        ROD_VIOLATION,
        column("bumper_events", "bumper events", Summary::Sum("robots.bumper_events")),
        column("min_gap_m", "gap, mm", Summary::Computed(min_gap_m))
            .with_format(Format::Millimeters),
        column("mean_lag_m", "mean lag, m", Summary::Mean("robots.mean_lag_m")),
        column("max_lag_m", "max lag, m", Summary::Max("robots.max_lag_m"))
            .with_format(Format::Decimals(3)),
        column("speed_m_s", "speed, m/s", Summary::Computed(mean_speed_m_s)),
        column("in_band_percent", "0.7-0.9 m, %", Summary::SharePercent("in_band")),
    ],
};

fn followers(case: &CaseRuns<'_>) -> Value {
    // The first connector is the leader.
    Value::Count(case.setting_number(CONNECTORS) as u64 - 1)
}

/// Returns the least gap between two robots, 1 m where none was as near.
fn min_gap_m(case: &CaseRuns<'_>) -> Value {
    Value::Number(case.min_value("robots.min_gap_m").unwrap_or(1.0).min(1.0))
}

fn mean_speed_m_s(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| run.number_or_zero("way_m") / (run.number_or_zero("steps") * DT_S))
}

/// Runs in which the chain's only task was done.
pub(super) const ARRIVED: Column = column("arrived", "arrived", Summary::Computed(arrived));

fn arrived(case: &CaseRuns<'_>) -> Value {
    case.proportion(|run| run.number_or_zero("done") == 1.0)
}

/// Least distance of any part from anything that it must not touch.
pub(super) const CLEARANCE: Column =
    column("min_clearance_m", "clearance, mm", Summary::Min("min_clearance_m"))
        .with_format(Format::Millimeters);

/// Least distance between parts of a chain that are no neighbors; below 0 where they crossed.
pub(super) const OWN_GAP: Column =
    column("min_own_gap_m", "own parts, mm", Summary::Min("min_own_gap_m"))
        .with_format(Format::Millimeters);

/// Greatest speed of any connector.
pub(super) const MAX_SPEED: Column =
    column("max_speed_m_s", "fastest part, m/s", Summary::Max("max_speed_m_s"))
        .with_format(Format::Decimals(2));

/// Greatest amount by which a rod was outside its limits.
pub(super) const ROD_VIOLATION: Column =
    column("rod_violation_m", "", Summary::Max("max_rod_violation_m"));

/// Returns whether the leader's nearest wall is in the slides' band.
fn is_in_band(run: &dyn Simulation) -> bool {
    let run = downcast::<ChainRun<2>>(run);
    let leader = run.state().body(0).chain.points()[0];
    let apart_m = run.world().obstacles.clearance_m([leader; 2], 0.0, 1.0);
    (BAND_M[0]..=BAND_M[1]).contains(&apart_m)
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CorridorResults {
    /// Results by case, the fewest followers first.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

/// The sweep's variants that have the plan's widths and numbers of followers.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?.filtered_by_number(WIDTH, &plan.widths_m);
    let study =
        study.filtered(|v| plan.followers.contains(&(setting_number(v, CONNECTORS) as usize - 1)));
    Ok(study.with_size(plan.seeds, Some(plan.corridor_cycles)))
}

impl CorridorResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let what = "swarm in the corridor";
        let results = study(plan)?.run_by(plan.workers, what, progress, |scenario, _, trial| {
            let mut run = chain_run(&scenario()?, 1)?;
            let mut in_band = 0_u64;
            run_to_end(&mut *run, |run| in_band += u64::from(is_in_band(run)));
            let mut outcome = Outcome::from_simulation(*trial, &*run);
            outcome.metrics.insert("in_band".into(), in_band.into());
            let way_m = downcast::<ChainRun<2>>(&*run).state().body(0).tally.way_m;
            outcome.metrics.insert("way_m".into(), way_m.into());
            Ok(outcome)
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    /// Returns the cases of a reading, the fewest followers first.
    pub(super) fn cases_with_reading<'a>(
        &'a self,
        leaving: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cases.iter().filter(move |c| c.has_text("leaving", leaving))
    }

    /// For figures over the width: they are one for each width.
    pub(super) fn cases_with_fewest_followers<'a>(
        &'a self,
        leaving: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        let fewest = self.cases.iter().map(|c| c.count("followers")).min();
        self.cases_with_reading(leaving).filter(move |c| Some(c.count("followers")) == fewest)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Runs differ by the laser's error of 1 cm. Clearance is of connectors and rods, \
                    which keep 8 cm of room for the robots that follow them on wheels; gap, bumpers \
                    and lag are those robots'. `level` is the slides' wording taken literally.";
        COLUMNS.table("A swarm in the winding corridor", note, &self.cases)
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        vec![
            self.figure_by_width("Speed of a leader that wants 0.5 m/s", "m/s", "speed_m_s"),
            self.figure_by_width("Time within the band of 0.7 to 0.9 m", "%", "in_band_percent"),
        ]
    }

    /// Returns a figure of column `y` over the width of the corridor.
    fn figure_by_width(&self, title: &str, y_label: &str, y: &str) -> Figure {
        let lines = READINGS.map(|leaving| {
            series(leaving, self.cases_with_fewest_followers(leaving), ["width_m", y])
        });
        figure(title, ["width of the corridor, m", y_label], lines)
    }
}
