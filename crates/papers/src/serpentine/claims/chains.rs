//! Claims about chains of any kind: what they keep, who may move them, what they cost.

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

/// Rods keep their limits to this.
const ROD_TOLERANCE_M: f64 = 1e-9;
/// The time per moved connector may grow so much from the shortest chain to the longest.
const GROWTH: f64 = 2.0;
/// With any number of far obstacles a motion may take so much longer.
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
        ("P2", "a chain copes with obstacles that move, at speeds like its own"),
        all(movers.of(ESCAPES[2]), |c| c.number("inside_percent") == 0.0),
        listed(ESCAPES, told),
        "no step with a part inside at any speed and number of discs, for a chain that looks ahead \
         (ours; the slides' parts react when touched) and keeps to a speed limit and out of itself; \
         without these limits parts jump",
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
    claim(
        ("P5, E4", "an agent needs what is near and its two neighbours only, so that it scales"),
        verdict,
        ours,
        "time per moved connector at most doubles from the shortest chain to the longest, far \
         obstacles at most double it, and change no bit; timed on this machine",
    )
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
    claim(
        ("P6", "it scales up to highly redundant systems and serves few degrees of freedom too"),
        verdict,
        ours,
        "all targets reached at every number of links, and chains of 1000 connectors and more moved",
    )
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
    claim(
        ("V5", "the constraints that define the chain are preserved"),
        all(worst, |m| m <= ROD_TOLERANCE_M),
        ours,
        "within 1e-9 m in every step of every run of corridor, rotation, discs, snake and pushing",
    )
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
        ("V6", "with many rods it behaves like a snake that creeps among obstacles"),
        all(snakes.at_rest(), |c| c.count("penetrations") == 0 && c.number("way_percent") > 90.0),
        ours,
        "more than 90 % of the wanted way, and never inside, among balls that stand",
    )
}

fn any_initiator(initiators: &Initiators) -> Claim {
    claim(
        ("R4, R5", "any part may begin a motion; the chain is two sub-chains from there"),
        all([initiators.moved, initiators.halves_alike], |share| share.is_all()),
        format!("moved: {}; halves alike: {}", initiators.moved, initiators.halves_alike),
        "every motion of every connector of a free chain is made, and both halves come to be, to \
         the bit, where they would be alone",
    )
}

fn fixed_bases(initiators: &Initiators) -> Claim {
    claim(
        ("R7", "vetoes allow arms with a fixed base, which always objects to being moved"),
        all([initiators.base_objected, initiators.kept], |share| share.is_all()),
        format!(
            "the base objected: {}; nothing moved: {}",
            initiators.base_objected, initiators.kept
        ),
        "every motion of rods of fixed length is vetoed by the base, as fixed, and leaves all as it \
         was. What the arm does then is F2b",
    )
}

fn failed_parts(initiators: &Initiators) -> Claim {
    claim(
        ("R8", "vetoes tell of a part that is trapped or does not work, so that one can re-plan"),
        all([initiators.failed_objected, initiators.told], |share| share.is_all()),
        format!(
            "the failed one objected: {}; told: {}",
            initiators.failed_objected, initiators.told
        ),
        "whoever begins, the veto names the failed connector and that it has failed; also where it \
         fails while a run goes on",
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
    claim(
        (
            "A7, A8",
            "a rod turned past the obstacle that it hits nearest to its master keeps clear of all",
        ),
        all(rotations.of(RULES[1]), |c| c.count("penetrations") == 0),
        ours,
        "no step inside with the slides' rule (`literal`): one turn leads into the next obstacle. \
         `union`, which turns clear of all at once, is ours",
    )
}

fn bend_limits(initiators: &Initiators) -> Claim {
    let ours = listed(&initiators.bends, |b| {
        let place = if b.in_space { "in space" } else { "in the plane" };
        format!(
            "{}\u{b0} {place}: {} beyond, sharpest {:.3}\u{b0}",
            b.limit_deg, b.exceeded, b.sharpest_deg
        )
    });
    claim(
        ("F1", "limits of angles fit into the same scheme of reactions (future work)"),
        all(&initiators.bends, |b| b.exceeded == 0 && b.moved.hits > 0),
        ours,
        "no bend beyond its limit after any motion, and the chain still moves",
    )
}

fn posture_by_veto(postures: &Postures) -> Claim {
    let veto = || postures.of(Way::Veto);
    let best = |has_slack: bool| {
        let cells = veto().filter(|c| (c.number("slack") > 0.0) == has_slack);
        most(cells.map(|c| c.number("reached")))
    };
    let (fixed, slack) = (best(false), best(true));
    claim(
        (
            "F2a",
            "the rules give inverse kinematics by themselves: an arm's tip is moved, its base objects",
        ),
        all(veto(), |c| c.number("reached") > 99.0),
        format!(
            "rods of fixed length: at most {fixed:.1} %; with 10 % of slack: at most {slack:.1} %"
        ),
        "more than 99 % of targets in one motion at every number of links; with fixed rods every \
         motion displaces the base",
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
    claim(
        ("F2b", "the same rules give inverse kinematics where a base is free, or is brought back"),
        both(&[free, back]),
        ours,
        "all targets: one motion with a free base, and motions of tip and base in turn with a fixed \
         one (which is FABRIK, of 2011)",
    )
}

fn rejoined(broken: &Broken) -> Claim {
    let none_gone = || broken.cells.iter().filter(|c| c.count("gone") == 0);
    let ours = listed(none_gone(), |c| {
        format!("{} thrown by {} m: {}", c.count("scattered"), c.number("by_m"), c.share("whole"))
    });
    claim(
        ("F3a", "a chain broken by hand is joined again, and keeps the shape of its whole ends"),
        all(none_gone(), |c| c.in_all("whole") && c.in_all("ends_kept")),
        ours,
        "every one whole again, ends to the bit where they were",
    )
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
    claim(
        ("F3b", "it is joined even with fewer parts"),
        all(gone(), as_can),
        ours,
        "every one that the parts left can reach across, and all where an end may come; the others \
         are refused with what is missing",
    )
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
    claim(
        (
            "F4",
            "collisions in space need hardly another rule, and no other propagation (future work)",
        ),
        all(snakes.at_rest(), |c| c.count("penetrations") == 0),
        ours,
        "never inside with the propagation of the plane, which is the same code; only the search for \
         free directions is another",
    )
}
