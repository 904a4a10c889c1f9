//! Claims about the swarm and its leader, and about the slides' experiments.

use super::super::Report;
use super::super::corridor::{Corridor, READINGS};
use super::super::field::Fields;
use super::super::snake::Snakes;
use super::{Claim, Comparison, Verdict, claim, every, judged, listed};
use crate::cells::{CaseResults, mm, most};

/// Number of followers in the slides' swarm.
const FOLLOWERS: u64 = 15;
/// Number of agents in the slides' snake.
const AGENTS: u64 = 450;

pub(super) fn claims(report: &Report) -> Vec<Claim> {
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
fn plain(corridor: &Corridor) -> impl Iterator<Item = &CaseResults> {
    corridor.of_few(READINGS[0])
}

fn band(corridor: &Corridor) -> Claim {
    // In a corridor of up to 1.4 m no place is farther than 0.7 m from both walls.
    let wide = || plain(corridor).filter(|c| c.number("width_m") > 1.4);
    let ours = listed(plain(corridor), |c| {
        format!("{} m: {} %", c.number("width_m"), c.estimate("in_band_percent"))
    });
    claim(
        "N3",
        judged(wide().map(|c| Comparison::above(c.estimate("in_band_percent"), 90.0))),
        format!("time with the nearest wall in the band, {ours}"),
    )
}

fn layers_literally(fields: &Fields) -> Claim {
    let ours = listed(fields.at_rest("level", false), |c| {
        format!("{} discs: {}", c.count("discs"), c.share("arrived"))
    });
    claim("N5a", every(fields.at_rest("level", false), |c| c.in_all("arrived")), ours)
}

fn layers_latched(fields: &Fields) -> Claim {
    let told = |rule: bool| {
        listed(fields.at_rest("latched", rule), |c| {
            format!("{} discs: {}", c.count("discs"), c.share("arrived"))
        })
    };
    claim(
        "N5b",
        every(fields.at_rest("latched", true), |c| c.in_all("arrived") && c.in_all("untouched")),
        format!("with the leave rule, {}; without it, {}", told(true), told(false)),
    )
}

fn narrow_corridors(corridor: &Corridor) -> Claim {
    let ours = listed(plain(corridor), |c| {
        format!(
            "{} m: {}, {} m/s",
            c.number("width_m"),
            c.share("arrived"),
            c.estimate("speed_m_s")
        )
    });
    claim(
        "N6a",
        every(plain(corridor), |c| c.in_all("arrived") && c.count("penetrations") == 0),
        ours,
    )
}

fn moving_discs(fields: &Fields) -> Claim {
    let near = || fields.moving().filter(|c| c.number("speed_ratio") <= 1.0);
    let ours = listed(fields.moving(), |c| {
        format!(
            "{} times as fast: {} arrived, {} untouched, {} mm",
            c.number("speed_ratio"),
            c.share("arrived"),
            c.share("untouched"),
            c.mm("min_clearance_m")
        )
    });
    claim("N6b", every(near(), |c| c.in_all("arrived") && c.in_all("untouched")), ours)
}

fn snake_in_real_time(snakes: &Snakes) -> Claim {
    let cells = || snakes.cells.iter().filter(|c| c.count("connectors") >= AGENTS);
    let ours = listed(cells(), |c| {
        format!(
            "{} connectors, {} % filled, {} flying: {} times",
            c.count("connectors"),
            100.0 * c.number("filled"),
            c.count("movers"),
            c.estimate("real_time")
        )
    });
    let faster = |c: &CaseResults| Comparison::above(c.estimate("real_time"), 1.0);
    claim("E1", judged(cells().map(faster)), ours)
}

fn swarm(corridor: &Corridor) -> Claim {
    let cells = || corridor.of(READINGS[0]).filter(|c| c.count("followers") >= FOLLOWERS);
    let is_clean = |c: &CaseResults| {
        c.in_all("arrived") && c.count("bumper_events") == 0 && c.count("penetrations") == 0
    };
    let sum = |count: fn(&CaseResults) -> u64| cells().map(count).sum::<u64>();
    let ours = format!(
        "{} of {} runs arrive; {} bumper events, {} of {} steps inside, gap {} mm, lag up to {:.3} m",
        sum(|c| c.share("arrived").hits),
        sum(|c| c.share("arrived").n),
        sum(|c| c.count("bumper_events")),
        sum(|c| c.count("penetrations")),
        sum(|c| c.count("steps")),
        mm(cells().map(|c| c.number("min_gap_m")).reduce(f64::min)),
        most(cells().map(|c| c.number("max_lag_m"))),
    );
    claim("E2", every(cells(), is_clean), ours)
}

fn one_master(corridor: &Corridor) -> Claim {
    let cells = || corridor.of(READINGS[0]);
    let vetoes: u64 = cells().map(|c| c.count("vetoes")).sum();
    let steps: u64 = cells().map(|c| c.count("steps")).sum();
    claim(
        "E3",
        every(cells(), |c| c.in_all("arrived") && c.count("vetoes") == 0),
        format!("{vetoes} vetoes of {steps} motions of leaders that know nothing of who follows"),
    )
}

fn best_for() -> Claim {
    claim("E5", Verdict::Lost, "no figure")
}
