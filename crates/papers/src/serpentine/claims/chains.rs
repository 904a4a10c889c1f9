//! Claims about chains of any kind: their invariants, their initiators, their cost.

use super::super::Report;
use super::super::broken::Broken;
use super::super::initiators::Initiators;
use super::super::movers::{ESCAPES, Movers};
use super::super::postures::{Postures, Way};
use super::super::rotation::{RULES, Rotations};
use super::super::scaling::{Scaling, Size};
use super::super::snake::Snakes;
use super::{Claim, all, both, claim, listed};
use crate::cells::{Cell, least, mm, most};

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
        all(movers.of(ESCAPES[2]), |c| c.number("inside_percent") == 0.0),
        listed(ESCAPES, told),
    )
}

fn local_cost(scaling: &Scaling) -> Claim {
    let each = |k: Option<&Size>| k.map(|s| s.fixed_us * 1e3 / s.fixed_moved.max(1.0));
    let ends = each(scaling.sizes.first()).zip(each(scaling.sizes.last()));
    let growth = ends.map(|(first, last)| last / first);
    let least_us = least(scaling.far.iter().map(|f| Some(f.us)));
    let most_us = most(scaling.far.iter().map(|f| f.us));
    let far = least_us.map(|least| most_us / least);
    let verdict = both(&[
        all(growth, |growth| growth <= GROWTH),
        all(far, |far| far <= FAR_GROWTH),
        all(&scaling.far, |f| f.same),
    ]);
    let ours = format!(
        "per moved connector, longest over shortest chain: {}; with most over with fewest far \
         balls: {}; same bits with them: {}",
        growth.map_or("-".into(), |x| format!("{x:.2}")),
        far.map_or("-".into(), |x| format!("{x:.2}")),
        listed(&scaling.far, |f| if f.same { "yes".into() } else { "no".into() }),
    );
    claim("P5, E4", verdict, ours)
}

fn few_and_many(report: &Report) -> Claim {
    let links: Vec<_> = report.postures.of(Way::ThereAndBack).collect();
    let few = links.iter().map(|c| c.count("links")).min();
    let many = report.scaling.sizes.iter().map(|s| s.connectors).max();
    let ours = format!(
        "from {} links, {}, to {} connectors",
        few.map_or("-".into(), |n| n.to_string()),
        listed(links.first(), |c| c.share("reached").to_string()),
        many.map_or("-".into(), |n| n.to_string()),
    );
    let verdict = both(&[all(&links, |c| c.in_all("reached")), all(many, |n| n >= 1000)]);
    claim("P6", verdict, ours)
}

fn structure_kept(report: &Report) -> Claim {
    let all_cells = [
        &report.corridor.cells,
        &report.rotations.cells,
        &report.movers.cells,
        &report.snakes.cells,
        &report.pushing.cells,
    ];
    let worst: Vec<f64> =
        all_cells.into_iter().flatten().map(|c| c.number("rod_violation_m")).collect();
    let ours = format!("rods outside their limits by {:.1e} m at most", most(worst.clone()));
    claim("V5", all(worst, |m| m <= ROD_TOLERANCE_M), ours)
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
    claim(
        "V6",
        all(snakes.at_rest(), |c| c.count("penetrations") == 0 && c.number("way_percent") > 90.0),
        ours,
    )
}

fn any_initiator(initiators: &Initiators) -> Claim {
    claim(
        "R4, R5",
        all([initiators.moved, initiators.halves_alike], |share| share.is_all()),
        format!("moved: {}; halves alike: {}", initiators.moved, initiators.halves_alike),
    )
}

fn fixed_bases(initiators: &Initiators) -> Claim {
    claim(
        "R7",
        all([initiators.base_objected, initiators.kept], |share| share.is_all()),
        format!(
            "the base objected: {}; nothing moved: {}",
            initiators.base_objected, initiators.kept
        ),
    )
}

fn failed_parts(initiators: &Initiators) -> Claim {
    claim(
        "R8",
        all([initiators.failed_objected, initiators.told], |share| share.is_all()),
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
    claim("A7, A8", all(rotations.of(RULES[1]), |c| c.count("penetrations") == 0), ours)
}

fn bend_limits(initiators: &Initiators) -> Claim {
    let ours = listed(&initiators.bends, |b| {
        let place = if b.in_space { "in space" } else { "in the plane" };
        format!(
            "{}\u{b0} {place}: {} beyond, sharpest {:.3}\u{b0}",
            b.limit_deg, b.exceeded, b.sharpest_deg
        )
    });
    claim("F1", all(&initiators.bends, |b| b.exceeded == 0 && b.moved.hits > 0), ours)
}

fn posture_by_veto(postures: &Postures) -> Claim {
    let veto = || postures.of(Way::Veto);
    let best = |has_slack: bool| {
        let cells = veto().filter(|c| (c.number("slack") > 0.0) == has_slack);
        most(cells.map(|c| c.number("reached")))
    };
    let (fixed, slack) = (best(false), best(true));
    claim(
        "F2a",
        all(veto(), |c| c.number("reached") > 99.0),
        format!(
            "rods of fixed length: at most {fixed:.1} %; with 10 % of slack: at most {slack:.1} %"
        ),
    )
}

fn posture_there_and_back(postures: &Postures) -> Claim {
    let free = all(postures.of(Way::FreeBase), |c| c.in_all("reached"));
    let back = all(postures.of(Way::ThereAndBack), |c| c.in_all("reached"));
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
    claim("F3a", all(none_gone(), |c| c.in_all("whole") && c.in_all("ends_kept")), ours)
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
    let as_can = |c: &Cell| {
        let whole = if c.is("may_come") { c.share("whole").n } else { c.share("can").hits };
        c.share("whole").hits == whole && c.in_all("ends_kept")
    };
    claim("F3b", all(gone(), as_can), ours)
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
    claim("F4", all(snakes.at_rest(), |c| c.count("penetrations") == 0), ours)
}
