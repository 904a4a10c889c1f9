//! Claims about the swarm and its leader, and about the slides' experiments.

use super::super::Report;
use super::super::corridor::{Corridor, READINGS};
use super::super::field::Fields;
use super::super::snake::Snakes;
use super::{Claim, Verdict, all, both, claim, listed};
use crate::cells::{Cell, mm, most};

/// The slides' swarm.
const FOLLOWERS: u64 = 15;
/// The slides' snake.
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

/// Cells of our reading with the fewest followers.
fn plain(corridor: &Corridor) -> impl Iterator<Item = &Cell> {
    corridor.of_few(READINGS[0])
}

fn band(corridor: &Corridor) -> Claim {
    // In a corridor of up to 1.4 m no place is further than 0.7 m from both walls.
    let wide = || plain(corridor).filter(|c| c.number("width_m") > 1.4);
    let ours = listed(plain(corridor), |c| {
        format!("{} m: {} %", c.number("width_m"), c.estimate("in_band_percent"))
    });
    claim(
        ("N3", "the leader keeps 0.7 to 0.9 m from walls"),
        all(wide(), |c| c.number("in_band_percent") > 90.0),
        format!("time with the nearest wall in the band, {ours}"),
        "more than 90 % of the time in corridors wider than 1.4 m, where there is such a place",
    )
    .with_papers_figure("0.7 to 0.9 m")
}

fn layers_literally(fields: &Fields) -> Claim {
    let ours = listed(fields.at_rest("level", false), |c| {
        format!("{} discs: {}", c.count("discs"), c.share("arrived"))
    });
    claim(
        ("N5a", "six layers, as they are worded, lead a robot to its target in the open"),
        all(fields.at_rest("level", false), |c| c.in_all("arrived")),
        ours,
        "every run arrives, also without obstacles; worded literally, a robot in the open always \
         leaves a wall, and turns for ever",
    )
}

fn layers_latched(fields: &Fields) -> Claim {
    let told = |rule: bool| {
        listed(fields.at_rest("latched", rule), |c| {
            format!("{} discs: {}", c.count("discs"), c.share("arrived"))
        })
    };
    claim(
        ("N5b", "six layers lead a robot to its target, where leaving is an event with a memory"),
        all(fields.at_rest("latched", true), |c| c.in_all("arrived") && c.in_all("untouched")),
        format!("with the leave rule, {}; without it, {}", told(true), told(false)),
        "every run arrives and touches nothing, with the rule (ours) that a free way to the target \
         ends following a wall",
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
        ("N6a", "it passes narrow corridors, even of high curvature"),
        all(plain(corridor), |c| c.in_all("arrived") && c.count("penetrations") == 0),
        ours,
        "every run arrives at every width, with bends of 1.3 m, and nobody is ever inside a wall",
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
    claim(
        ("N6b", "it works among obstacles that move about as fast as the robot"),
        all(near(), |c| c.in_all("arrived") && c.in_all("untouched")),
        ours,
        "every run arrives and touches nothing up to the robot's own speed",
    )
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
    let lowest = |c: &Cell| {
        c.estimate("real_time").interval.map_or(c.number("real_time"), |interval| interval.low)
    };
    claim(
        ("E1", "a snake of 450 and more agents moves in space in real time"),
        all(cells(), |c| lowest(c) > 1.0),
        ours,
        "faster than 50 steps of 1 cm a second on one core, collisions included (the slides' had \
         none); the slides' machine of 2005 is lost",
    )
    .with_papers_figure("450 and more agents, in real time")
}

fn swarm(corridor: &Corridor) -> Claim {
    let cells = || corridor.of(READINGS[0]).filter(|c| c.count("followers") >= FOLLOWERS);
    let is_clean = |c: &Cell| {
        c.in_all("arrived") && c.count("bumper_events") == 0 && c.count("penetrations") == 0
    };
    let sum = |count: fn(&Cell) -> u64| cells().map(count).sum::<u64>();
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
    claim(
        (
            "E2",
            "15 robots with simple sensors follow a wandering leader through curved narrow corridors",
        ),
        all(cells(), is_clean),
        ours,
        "every run at every width arrives, with no bumper pressed and nobody inside a wall",
    )
    .with_papers_figure("15 followers")
}

fn one_master(corridor: &Corridor) -> Claim {
    let cells = || corridor.of(READINGS[0]);
    let vetoes: u64 = cells().map(|c| c.count("vetoes")).sum();
    let steps: u64 = cells().map(|c| c.count("steps")).sum();
    claim(
        ("E3", "planning the motion of a chain is reduced to that of one part"),
        both(&[all(cells(), |c| c.in_all("arrived")), all(cells(), |c| c.count("vetoes") == 0)]),
        format!("{vetoes} vetoes of {steps} motions of leaders that know nothing of who follows"),
        "in the corridor all who follow adapt to every motion of the leader; a leader that goes back \
         is another matter, see the table of pushing",
    )
}

fn best_for() -> Claim {
    claim(
        (
            "E5",
            "it is best for highly redundant and reconfigurable arms, and for large swarms in narrow corridors",
        ),
        Verdict::Lost,
        "no figure",
        "the slides compare it with nothing, and name no measure",
    )
}
