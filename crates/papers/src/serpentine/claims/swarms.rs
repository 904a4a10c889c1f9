//! Claims about the swarm and its leader, and about the slides' experiments.

use super::super::SerpentineReport;
use super::super::corridor::{CorridorResults, READINGS};
use super::super::field::FieldResults;
use super::super::snake::SnakeResults;
use super::{
    CLAIMS, Claim, ThresholdTest, Verdict, claim, join_texts, judge_all_runs, judge_thresholds,
};
use crate::case_results::{CaseResults, format_mm, max_value};

/// Number of followers in the slides' swarm ("Experiments").
const FOLLOWERS: u64 = 15;
/// Number of agents in the slides' snake ("Experiments").
const AGENTS: u64 = 450;
/// Width up to which no place of a corridor is farther from both walls than the slides' least distance, 0.7 m.
const NARROW_M: f64 = 1.4;

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

/// Returns cases of our reading with the fewest followers.
fn plain(corridor: &CorridorResults) -> impl Iterator<Item = &CaseResults> {
    corridor.cases_with_fewest_followers(READINGS[0])
}

fn band(corridor: &CorridorResults) -> Claim {
    let ours = join_texts(plain(corridor), |c| {
        format!("{} m: {} %", c.number("width_m"), c.estimate("in_band_percent"))
    });
    let min_percent = CLAIMS.threshold("N3");
    let wide = plain(corridor).filter(|c| c.number("width_m") > NARROW_M);
    let times = wide.map(|c| c.estimate("in_band_percent"));
    let verdict = judge_thresholds(times.map(|time| ThresholdTest::above(time, min_percent)));
    claim("N3", verdict, format!("time with the nearest wall in the band, {ours}"))
}

fn layers_literally(fields: &FieldResults) -> Claim {
    let ours = join_texts(fields.at_rest("level", false), |c| {
        format!("{} discs: {}", c.count("discs"), c.proportion("arrived"))
    });
    let literally = fields.at_rest("level", false);
    claim("N5a", judge_all_runs(literally, |c| c.is_true_in_all_runs("arrived")), ours)
}

fn layers_latched(fields: &FieldResults) -> Claim {
    let [with_rule, without_rule] = [true, false].map(|leave_rule| {
        join_texts(fields.at_rest("latched", leave_rule), |c| {
            format!("{} discs: {}", c.count("discs"), c.proportion("arrived"))
        })
    });
    let ours = format!("with the leave rule, {with_rule}; without it, {without_rule}");
    claim("N5b", judge_all_runs(fields.at_rest("latched", true), arrives_untouched), ours)
}

fn arrives_untouched(case: &CaseResults) -> bool {
    case.is_true_in_all_runs("arrived") && case.is_true_in_all_runs("untouched")
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
    let verdict = judge_all_runs(plain(corridor), |c| {
        c.is_true_in_all_runs("arrived") && c.count("penetrations") == 0
    });
    claim("N6a", verdict, ours)
}

fn moving_discs(fields: &FieldResults) -> Claim {
    let ours = join_texts(fields.moving(), |c| {
        format!(
            "{} times as fast: {} arrived, {} untouched, {} mm",
            c.number("speed_ratio"),
            c.proportion("arrived"),
            c.proportion("untouched"),
            c.format_mm("min_clearance_m")
        )
    });
    // The slides speak of obstacles with speeds comparable to the robot's; faster ones are shown, and not judged.
    let max_ratio = CLAIMS.threshold("N6b");
    let comparable = fields.moving().filter(|c| c.number("speed_ratio") <= max_ratio);
    claim("N6b", judge_all_runs(comparable, arrives_untouched), ours)
}

fn snake_in_real_time(snakes: &SnakeResults) -> Claim {
    let cases: Vec<_> = snakes.cases.iter().filter(|c| c.count("connectors") >= AGENTS).collect();
    let ours = join_texts(&cases, |c| {
        format!(
            "{} connectors, {} % filled, {} flying: {} times",
            c.count("connectors"),
            100.0 * c.number("filled"),
            c.count("movers"),
            c.estimate("real_time")
        )
    });
    let min_speed = CLAIMS.threshold("E1");
    let speeds = cases.iter().map(|c| c.estimate("real_time"));
    let verdict = judge_thresholds(speeds.map(|speed| ThresholdTest::above(speed, min_speed)));
    claim("E1", verdict, ours)
}

fn swarm(corridor: &CorridorResults) -> Claim {
    let cases = corridor.cases_with_reading(READINGS[0]);
    let cases: Vec<&CaseResults> = cases.filter(|c| c.count("followers") >= FOLLOWERS).collect();
    let ours = format!(
        "{} of {} runs arrive; {} bumper events, {} of {} steps inside, gap {} mm, lag up to {:.3} m",
        sum(&cases, |c| c.proportion("arrived").hits),
        sum(&cases, |c| c.proportion("arrived").n),
        sum(&cases, |c| c.count("bumper_events")),
        sum(&cases, |c| c.count("penetrations")),
        sum(&cases, |c| c.count("steps")),
        format_mm(cases.iter().map(|c| c.number("min_gap_m")).reduce(f64::min)),
        max_value(cases.iter().map(|c| c.number("max_lag_m"))),
    );
    let verdict = judge_all_runs(cases, |c| {
        c.is_true_in_all_runs("arrived")
            && c.count("bumper_events") == 0
            && c.count("penetrations") == 0
    });
    claim("E2", verdict, ours)
}

fn sum(cases: &[&CaseResults], count: fn(&CaseResults) -> u64) -> u64 {
    cases.iter().map(|case| count(case)).sum()
}

fn one_master(corridor: &CorridorResults) -> Claim {
    let cases: Vec<&CaseResults> = corridor.cases_with_reading(READINGS[0]).collect();
    let vetoes = sum(&cases, |c| c.count("vetoes"));
    let steps = sum(&cases, |c| c.count("steps"));
    let ours =
        format!("{vetoes} vetoes of {steps} motions of leaders that know nothing of who follows");
    let verdict =
        judge_all_runs(cases, |c| c.is_true_in_all_runs("arrived") && c.count("vetoes") == 0);
    claim("E3", verdict, ours)
}

fn best_for() -> Claim {
    claim("E5", Verdict::Lost, "no figure")
}
