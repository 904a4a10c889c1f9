//! Claims about chains of any kind: their invariants, their initiators, their cost.

use super::super::Report;
use super::super::arm::{Arms, PLANNERS};
use super::super::broken::Broken;
use super::super::initiators::Initiators;
use super::super::movers::{ESCAPES, Movers};
use super::super::postures::{Postures, Way};
use super::super::rotation::{RULES, Rotations};
use super::super::scaling::Scaling;
use super::super::snake::Snakes;
use super::{Claim, Comparison, both, claim, every, every_trial, in_every_run, judged, listed};
use crate::cells::{CaseResults, least, mm, most};

/// Tolerance of the rods' limits, meters.
const ROD_TOLERANCE_M: f64 = 1e-9;
/// Largest growth of the time per moved connector from the shortest chain to the longest, as a
/// factor.
const GROWTH: f64 = 2.0;
/// Largest growth of the time of a motion with any number of far obstacles, as a factor.
const FAR_GROWTH: f64 = 2.0;

pub(super) fn claims(report: &Report) -> Vec<Claim> {
    vec![
        moving_obstacles(&report.movers),
        local_cost(&report.scaling),
        few_and_many(report),
        joints(&report.arms),
        structure_kept(report),
        creeps(&report.snakes),
        any_initiator(&report.initiators),
        fixed_bases(&report.initiators),
        failed_parts(&report.initiators),
        one_turn(&report.rotations),
        bend_limits(&report.initiators),
        posture_by_veto(&report.postures),
        posture_there_and_back(&report.postures),
        rejoined(&report.broken),
        rejoined_with_fewer(&report.broken),
        in_space(&report.snakes),
    ]
}

fn moving_obstacles(movers: &Movers) -> Claim {
    let told = |escape: &'static str| {
        let cells: Vec<_> = movers.of(escape).collect();
        let worst = cells.iter().map(|c| c.number("inside_percent")).fold(0.0, f64::max);
        format!("{escape}: up to {worst:.2} % of steps inside")
    };
    claim(
        "P2",
        every(movers.of(ESCAPES[2]), |c| c.number("inside_percent") == 0.0),
        listed(ESCAPES, told),
    )
}

fn local_cost(scaling: &Scaling) -> Claim {
    let (growth, far) = (scaling.growth(), scaling.far_growth());
    let repeats = scaling.far.iter().map(|f| f.us_by_repeat.len()).sum();
    let verdict = both(&[
        judged([Comparison::below(&growth, GROWTH), Comparison::below(&far, FAR_GROWTH)]),
        in_every_run(repeats, scaling.far.iter().all(|f| f.same)),
    ]);
    let ours = format!(
        "per moved connector, longest over shortest chain: {growth}; with most over with fewest far \
         balls: {far}; same bits with them: {}",
        listed(&scaling.far, |f| if f.same { "yes".into() } else { "no".into() }),
    );
    claim("P5, E4", verdict, ours)
}

/// Connectors of a highly redundant chain.
const MANY: usize = 1000;

fn few_and_many(report: &Report) -> Claim {
    let links: Vec<_> = report.postures.of(Way::ThereAndBack).collect();
    let few = links.iter().map(|c| c.count("links")).min();
    let many = report.scaling.sizes.iter().max_by_key(|s| s.connectors);
    let ours = format!(
        "from {} links, {}, to {} connectors, of which a motion of the first moves {}",
        few.map_or("-".into(), |n| n.to_string()),
        listed(links.first(), |c| c.share("reached").to_string()),
        many.map_or("-".into(), |s| s.connectors.to_string()),
        many.map_or("-".into(), |s| format!("{:.0}", s.fixed_moved)),
    );
    let large = || report.scaling.sizes.iter().filter(|s| s.connectors >= MANY);
    let repeats = large().map(|s| s.fixed_us_by_repeat.len()).sum();
    let all_move = large().all(|s| s.fixed_moved > 0.99 * (s.connectors - 1) as f64);
    let verdict = both(&[
        every_trial(links.iter().map(|c| c.share("reached"))),
        in_every_run(repeats, all_move),
    ]);
    claim("P6", verdict, ours)
}

fn joints(arms: &Arms) -> Claim {
    let ours = listed(PLANNERS, |planner| {
        let told = |c: &CaseResults| {
            format!(
                "{} pillars: {} runs reach all, fastest joint at {:.3} of its limit",
                c.count("pillars"),
                c.share("reached"),
                c.number("fastest")
            )
        };
        format!("planner {planner}: {}", listed(arms.with(planner), told))
    });
    let is_kept = |c: &CaseResults| {
        let broken = ["outside", "too_fast", "penetrations"].map(|name| c.count(name));
        broken == [0; 3] && c.number("off_m") <= ROD_TOLERANCE_M
    };
    let verdict = both(&[
        every(PLANNERS.into_iter().flat_map(|planner| arms.with(planner)), is_kept),
        every_trial(arms.with(PLANNERS[1]).map(|c| c.share("reached"))),
    ]);
    claim("K1, K4", verdict, ours)
}

fn structure_kept(report: &Report) -> Claim {
    let all_cells = [
        &report.corridor.cells,
        &report.rotations.cells,
        &report.movers.cells,
        &report.snakes.cells,
        &report.pushing.cells,
    ];
    let cells = || all_cells.into_iter().flatten();
    let worst = most(cells().map(|c| c.number("rod_violation_m")));
    let ours = format!("rods outside their limits by {worst:.1e} m at most");
    claim("V5", every(cells(), |c| c.number("rod_violation_m") <= ROD_TOLERANCE_M), ours)
}

fn creeps(snakes: &Snakes) -> Claim {
    let ours = listed(snakes.at_rest(), |c| {
        format!(
            "{} connectors, {} % filled: {} % of the wanted way, {} of {} steps inside",
            c.count("connectors"),
            100.0 * c.number("filled"),
            c.estimate("way_percent"),
            c.count("penetrations"),
            c.count("steps")
        )
    });
    let on_the_way = |c: &CaseResults| Comparison::above(c.estimate("way_percent"), 90.0);
    let verdict = both(&[
        judged(snakes.at_rest().map(on_the_way)),
        every(snakes.at_rest(), |c| c.count("penetrations") == 0),
    ]);
    claim("V6", verdict, ours)
}

fn any_initiator(initiators: &Initiators) -> Claim {
    claim(
        "R4, R5",
        every_trial([&initiators.moved, &initiators.halves_alike]),
        format!("moved: {}; halves alike: {}", initiators.moved, initiators.halves_alike),
    )
}

fn fixed_bases(initiators: &Initiators) -> Claim {
    claim(
        "R7",
        every_trial([&initiators.base_objected, &initiators.kept]),
        format!(
            "the base objected: {}; nothing moved: {}",
            initiators.base_objected, initiators.kept
        ),
    )
}

fn failed_parts(initiators: &Initiators) -> Claim {
    claim(
        "R8",
        every_trial([&initiators.failed_objected, &initiators.told]),
        format!(
            "the failed one objected: {}; told: {}",
            initiators.failed_objected, initiators.told
        ),
    )
}

fn one_turn(rotations: &Rotations) -> Claim {
    let ours = listed(RULES, |rule| {
        let cells: Vec<_> = rotations.of(rule).collect();
        let inside: u64 = cells.iter().map(|c| c.count("penetrations")).sum();
        let steps: u64 = cells.iter().map(|c| c.count("steps")).sum();
        let clearance_m = least(cells.iter().map(|c| c.maybe("min_clearance_m")));
        format!("{rule}: {inside} of {steps} steps inside, clearance {} mm", mm(clearance_m))
    });
    claim("A7, A8", every(rotations.of(RULES[1]), |c| c.count("penetrations") == 0), ours)
}

fn bend_limits(initiators: &Initiators) -> Claim {
    let ours = listed(&initiators.bends, |b| {
        let place = if b.in_space { "in space" } else { "in the plane" };
        format!(
            "{}\u{b0} {place}: {} beyond, sharpest {:.3}\u{b0}",
            b.limit_deg, b.exceeded, b.sharpest_deg
        )
    });
    let motions = initiators.bends.iter().map(|b| b.moved.hits as usize).sum();
    let kept = initiators.bends.iter().all(|b| b.exceeded == 0 && b.moved.hits > 0);
    claim("F1", in_every_run(motions, kept), ours)
}

fn posture_by_veto(postures: &Postures) -> Claim {
    // A motion of fixed rods always displaces the base, which objects: there is nothing to judge.
    let slack = || postures.of(Way::Veto).filter(|c| c.number("slack") > 0.0);
    let fixed = most(
        postures.of(Way::Veto).filter(|c| c.number("slack") == 0.0).map(|c| c.number("reached")),
    );
    claim(
        "F2a",
        judged(slack().map(|c| Comparison::share_above(c.share("reached"), 0.99))),
        format!(
            "with 10 % of slack, {}; rods of fixed length: at most {fixed:.1} %",
            listed(slack(), |c| format!("{} links: {}", c.count("links"), c.share("reached")))
        ),
    )
}

fn posture_there_and_back(postures: &Postures) -> Claim {
    let [free, back] = [Way::FreeBase, Way::ThereAndBack]
        .map(|way| every_trial(postures.of(way).map(|c| c.share("reached"))));
    let ours = listed(postures.of(Way::ThereAndBack).filter(|c| c.number("slack") == 0.0), |c| {
        format!(
            "{} links: {}, {:.0} us",
            c.count("links"),
            c.share("reached"),
            c.number("median_us")
        )
    });
    claim("F2b", both(&[free, back]), ours)
}

fn rejoined(broken: &Broken) -> Claim {
    let none_gone = || broken.cells.iter().filter(|c| c.count("gone") == 0);
    let ours = listed(none_gone(), |c| {
        format!("{} thrown by {} m: {}", c.count("scattered"), c.number("by_m"), c.share("whole"))
    });
    claim("F3a", every(none_gone(), |c| c.in_all("whole") && c.in_all("ends_kept")), ours)
}

fn rejoined_with_fewer(broken: &Broken) -> Claim {
    let gone = || broken.cells.iter().filter(|c| c.count("gone") > 0);
    let ours = listed(gone(), |c| {
        let who = if c.is("may_come") { "an end may come" } else { "nobody may come" };
        format!(
            "{} less {}, {who}: {} whole, {} refused",
            c.count("scattered"),
            c.count("gone"),
            c.share("whole"),
            c.count("too_long")
        )
    });
    let as_can = |c: &CaseResults| {
        let whole = if c.is("may_come") { c.share("whole").n } else { c.share("can").hits };
        c.share("whole").hits == whole && c.in_all("ends_kept")
    };
    claim("F3b", every(gone(), as_can), ours)
}

fn in_space(snakes: &Snakes) -> Claim {
    let ours = listed(snakes.at_rest(), |c| {
        format!(
            "{} % filled: clearance {} mm, vetoes {} %",
            100.0 * c.number("filled"),
            c.mm("min_clearance_m"),
            c.estimate("veto_percent")
        )
    });
    claim("F4", every(snakes.at_rest(), |c| c.count("penetrations") == 0), ours)
}
