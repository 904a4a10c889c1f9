//! Claims about the swarm and its leader, and about the slides' experiments.

use super::super::SerpentineReport;
use super::super::corridor::{CorridorResults, READINGS};
use super::super::field::FieldResults;
use super::super::snake::SnakeResults;
use super::{Claim, ThresholdTest, Verdict, claim, join_texts, judge_all_runs, judge_thresholds};
use crate::cells::{CaseResults, format_mm, max_value};

/// Number of followers in the slides' swarm.
const FOLLOWERS: u64 = 15;
/// Number of agents in the slides' snake.
const AGENTS: u64 = 450;

pub(super) fn claims(report: &SerpentineReport) -> Vec<Claim> {
    let corridor = &report.corridor;
    vec![
        band(corridor),
        layers_literally(&report.fields),
        layers_latched(&report.fields),
        narrow_corridors(corridor),
        moving_discs(&report.fields),
        snake_in_real_time(&report.snakes),
        swarm(corridor),
        one_master(corridor),
        best_for(),
    ]
}

/// Returns cells of our reading with the fewest followers.
fn plain(corridor: &CorridorResults) -> impl Iterator<Item = &CaseResults> {
    corridor.cells_with_fewest_followers(READINGS[0])
}

fn band(corridor: &CorridorResults) -> Claim {
    // In a corridor of up to 1.4 m no place is farther than 0.7 m from both walls.
    let wide = || plain(corridor).filter(|c| c.number("width_m") > 1.4);
    let ours = join_texts(plain(corridor), |c| {
        format!("{} m: {} %", c.number("width_m"), c.estimate("in_band_percent"))
    });
    claim(
        "N3",
        judge_thresholds(wide().map(|c| ThresholdTest::above(c.estimate("in_band_percent"), 90.0))),
        format!("time with the nearest wall in the band, {ours}"),
    )
}

fn layers_literally(fields: &FieldResults) -> Claim {
    let ours = join_texts(fields.at_rest("level", false), |c| {
        format!("{} discs: {}", c.count("discs"), c.proportion("arrived"))
    });
    claim(
        "N5a",
        judge_all_runs(fields.at_rest("level", false), |c| c.is_true_in_all_runs("arrived")),
        ours,
    )
}

fn layers_latched(fields: &FieldResults) -> Claim {
    let told = |rule: bool| {
        join_texts(fields.at_rest("latched", rule), |c| {
            format!("{} discs: {}", c.count("discs"), c.proportion("arrived"))
        })
    };
    claim(
        "N5b",
        judge_all_runs(fields.at_rest("latched", true), |c| {
            c.is_true_in_all_runs("arrived") && c.is_true_in_all_runs("untouched")
        }),
        format!("with the leave rule, {}; without it, {}", told(true), told(false)),
    )
}

fn narrow_corridors(corridor: &CorridorResults) -> Claim {
    let ours = join_texts(plain(corridor), |c| {
        format!(
            "{} m: {}, {} m/s",
            c.number("width_m"),
            c.proportion("arrived"),
            c.estimate("speed_m_s")
        )
    });
    claim(
        "N6a",
        judge_all_runs(plain(corridor), |c| {
            c.is_true_in_all_runs("arrived") && c.count("penetrations") == 0
        }),
        ours,
    )
}

fn moving_discs(fields: &FieldResults) -> Claim {
    let near = || fields.moving().filter(|c| c.number("speed_ratio") <= 1.0);
    let ours = join_texts(fields.moving(), |c| {
        format!(
            "{} times as fast: {} arrived, {} untouched, {} mm",
            c.number("speed_ratio"),
            c.proportion("arrived"),
            c.proportion("untouched"),
            c.format_mm("min_clearance_m")
        )
    });
    claim(
        "N6b",
        judge_all_runs(near(), |c| {
            c.is_true_in_all_runs("arrived") && c.is_true_in_all_runs("untouched")
        }),
        ours,
    )
}

fn snake_in_real_time(snakes: &SnakeResults) -> Claim {
    let cells = || snakes.cells.iter().filter(|c| c.count("connectors") >= AGENTS);
    let ours = join_texts(cells(), |c| {
        format!(
            "{} connectors, {} % filled, {} flying: {} times",
            c.count("connectors"),
            100.0 * c.number("filled"),
            c.count("movers"),
            c.estimate("real_time")
        )
    });
    let faster = |c: &CaseResults| ThresholdTest::above(c.estimate("real_time"), 1.0);
    claim("E1", judge_thresholds(cells().map(faster)), ours)
}

fn swarm(corridor: &CorridorResults) -> Claim {
    let cells =
        || corridor.cells_with_reading(READINGS[0]).filter(|c| c.count("followers") >= FOLLOWERS);
    let is_clean = |c: &CaseResults| {
        c.is_true_in_all_runs("arrived")
            && c.count("bumper_events") == 0
            && c.count("penetrations") == 0
    };
    let sum = |count: fn(&CaseResults) -> u64| cells().map(count).sum::<u64>();
    let ours = format!(
        "{} of {} runs arrive; {} bumper events, {} of {} steps inside, gap {} mm, lag up to {:.3} m",
        sum(|c| c.proportion("arrived").hits),
        sum(|c| c.proportion("arrived").n),
        sum(|c| c.count("bumper_events")),
        sum(|c| c.count("penetrations")),
        sum(|c| c.count("steps")),
        format_mm(cells().map(|c| c.number("min_gap_m")).reduce(f64::min)),
        max_value(cells().map(|c| c.number("max_lag_m"))),
    );
    claim("E2", judge_all_runs(cells(), is_clean), ours)
}

fn one_master(corridor: &CorridorResults) -> Claim {
    let cells = || corridor.cells_with_reading(READINGS[0]);
    let vetoes: u64 = cells().map(|c| c.count("vetoes")).sum();
    let steps: u64 = cells().map(|c| c.count("steps")).sum();
    claim(
        "E3",
        judge_all_runs(cells(), |c| c.is_true_in_all_runs("arrived") && c.count("vetoes") == 0),
        format!("{vetoes} vetoes of {steps} motions of leaders that know nothing of who follows"),
    )
}

fn best_for() -> Claim {
    claim("E5", Verdict::Lost, "no figure")
}
