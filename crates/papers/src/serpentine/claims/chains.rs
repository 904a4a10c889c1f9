//! Claims about chains of any kind: their invariants, their initiators, their cost.

use super::super::SerpentineReport;
use super::super::arm::{ArmResults, PLANNERS};
use super::super::broken_chain::BreakResults;
use super::super::initiators::InitiatorResults;
use super::super::movers::{ESCAPES, MoverResults};
use super::super::postures::{IkMethod, PostureResults};
use super::super::rotation::{RULES, RotationResults};
use super::super::scaling::ScalingResults;
use super::super::snake::SnakeResults;
use super::{
    CLAIMS, Claim, ThresholdTest, claim, combined_verdict, join_texts, judge_all_runs,
    judge_all_trials, judge_every_run, judge_thresholds,
};
use crate::case_results::{CaseResults, format_mm, max_value, min_value};

pub(super) fn claims(report: &SerpentineReport) -> Vec<Claim> {
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

fn moving_obstacles(movers: &MoverResults) -> Claim {
    let ours = join_texts(ESCAPES, |escape| {
        let cases = movers.cases_with_escape(escape);
        let worst = cases.map(|c| c.number("inside_percent")).fold(0.0, f64::max);
        format!("{escape}: up to {worst:.2} % of steps inside")
    });
    let looking_ahead = movers.cases_with_escape(ESCAPES[2]);
    let verdict = judge_all_runs(looking_ahead, |c| c.number("inside_percent") == 0.0);
    claim("P2", verdict, ours)
}

fn local_cost(scaling: &ScalingResults) -> Claim {
    let growth = scaling.growth();
    let far = scaling.far_growth();
    let max_growth = CLAIMS.threshold("P5, E4");
    let repeats = scaling.far.iter().map(|f| f.us_by_repeat.len()).sum();
    let verdict = combined_verdict(&[
        judge_thresholds([
            ThresholdTest::below(&growth, max_growth),
            ThresholdTest::below(&far, max_growth),
        ]),
        judge_every_run(repeats, scaling.far.iter().all(|f| f.same)),
    ]);
    let ours = format!(
        "per moved connector, longest over shortest chain: {growth}; with most over with fewest far \
         balls: {far}; same bits with them: {}",
        join_texts(&scaling.far, |f| if f.same { "yes".into() } else { "no".into() }),
    );
    claim("P5, E4", verdict, ours)
}

/// Connectors of a highly redundant chain.
const MANY: usize = 1000;

fn few_and_many(report: &SerpentineReport) -> Claim {
    let links: Vec<_> = report.postures.cases_with_method(IkMethod::ThereAndBack).collect();
    let few = links.iter().map(|c| c.count("links")).min();
    let many = report.scaling.sizes.iter().max_by_key(|s| s.connectors);
    let ours = format!(
        "from {} links, {}, to {} connectors, of which a motion of the first moves {}",
        few.map_or("-".into(), |n| n.to_string()),
        join_texts(links.first(), |c| c.proportion("reached").to_string()),
        many.map_or("-".into(), |s| s.connectors.to_string()),
        many.map_or("-".into(), |s| format!("{:.0}", s.fixed_moved)),
    );
    let min_moved = CLAIMS.threshold("P6");
    let large: Vec<_> = report.scaling.sizes.iter().filter(|s| s.connectors >= MANY).collect();
    let repeats = large.iter().map(|s| s.fixed_us_by_repeat.len()).sum();
    let all_move = large.iter().all(|s| s.fixed_moved > min_moved * (s.connectors - 1) as f64);
    let verdict = combined_verdict(&[
        judge_all_trials(links.iter().map(|c| c.proportion("reached"))),
        judge_every_run(repeats, all_move),
    ]);
    claim("P6", verdict, ours)
}

fn joints(arms: &ArmResults) -> Claim {
    let ours = join_texts(PLANNERS, |planner| {
        let cases = join_texts(arms.cases_with_planner(planner), arm_text);
        format!("planner {planner}: {cases}")
    });
    let tolerance_m = CLAIMS.threshold("K1, K4");
    let cases = PLANNERS.into_iter().flat_map(|planner| arms.cases_with_planner(planner));
    let limits_kept = judge_all_runs(cases, |c| {
        let broken = ["outside", "too_fast", "penetrations"].map(|name| c.count(name));
        broken == [0; 3] && c.number("off_m") <= tolerance_m
    });
    // Local rules alone get stuck before pillars, which the slides leave to a planner.
    let planned = arms.cases_with_planner(PLANNERS[1]);
    let reached = judge_all_trials(planned.map(|c| c.proportion("reached")));
    claim("K1, K4", combined_verdict(&[limits_kept, reached]), ours)
}

fn arm_text(case: &CaseResults) -> String {
    format!(
        "{} pillars: {} runs reach all, fastest joint at {:.3} of its limit",
        case.count("pillars"),
        case.proportion("reached"),
        case.number("fastest")
    )
}

fn structure_kept(report: &SerpentineReport) -> Claim {
    let all_cases = [
        &report.corridor.cases,
        &report.rotations.cases,
        &report.movers.cases,
        &report.snakes.cases,
        &report.pushing.cases,
    ];
    let cases: Vec<&CaseResults> = all_cases.into_iter().flatten().collect();
    let worst = max_value(cases.iter().map(|c| c.number("rod_violation_m")));
    let ours = format!("rods outside their limits by {worst:.1e} m at most");
    let tolerance_m = CLAIMS.threshold("V5");
    let verdict = judge_all_runs(cases, |c| c.number("rod_violation_m") <= tolerance_m);
    claim("V5", verdict, ours)
}

fn creeps(snakes: &SnakeResults) -> Claim {
    let ours = join_texts(snakes.at_rest(), |c| {
        format!(
            "{} connectors, {} % filled: {} % of the wanted way, {} of {} steps inside",
            c.count("connectors"),
            100.0 * c.number("filled"),
            c.estimate("way_percent"),
            c.count("penetrations"),
            c.count("steps")
        )
    });
    let min_percent = CLAIMS.threshold("V6");
    let ways = snakes.at_rest().map(|c| c.estimate("way_percent"));
    let verdict = combined_verdict(&[
        judge_thresholds(ways.map(|way| ThresholdTest::above(way, min_percent))),
        judge_all_runs(snakes.at_rest(), |c| c.count("penetrations") == 0),
    ]);
    claim("V6", verdict, ours)
}

fn any_initiator(initiators: &InitiatorResults) -> Claim {
    claim(
        "R4, R5",
        judge_all_trials([&initiators.moved, &initiators.halves_alike]),
        format!("moved: {}; halves alike: {}", initiators.moved, initiators.halves_alike),
    )
}

fn fixed_bases(initiators: &InitiatorResults) -> Claim {
    claim(
        "R7",
        judge_all_trials([&initiators.base_objected, &initiators.kept]),
        format!(
            "the base objected: {}; nothing moved: {}",
            initiators.base_objected, initiators.kept
        ),
    )
}

fn failed_parts(initiators: &InitiatorResults) -> Claim {
    claim(
        "R8",
        judge_all_trials([&initiators.failed_objected, &initiators.told]),
        format!(
            "the failed one objected: {}; told: {}",
            initiators.failed_objected, initiators.told
        ),
    )
}

fn one_turn(rotations: &RotationResults) -> Claim {
    let ours = join_texts(RULES, |rule| {
        let cases: Vec<_> = rotations.cases_with_rule(rule).collect();
        let inside: u64 = cases.iter().map(|c| c.count("penetrations")).sum();
        let steps: u64 = cases.iter().map(|c| c.count("steps")).sum();
        let clearance_m = min_value(cases.iter().map(|c| c.optional_number("min_clearance_m")));
        format!("{rule}: {inside} of {steps} steps inside, clearance {} mm", format_mm(clearance_m))
    });
    let literally = rotations.cases_with_rule(RULES[1]);
    claim("A7, A8", judge_all_runs(literally, |c| c.count("penetrations") == 0), ours)
}

fn bend_limits(initiators: &InitiatorResults) -> Claim {
    let ours = join_texts(&initiators.bends, |b| {
        let place = if b.in_space { "in space" } else { "in the plane" };
        format!(
            "{}\u{b0} {place}: {} beyond, sharpest {:.3}\u{b0}",
            b.limit_deg, b.exceeded, b.sharpest_deg
        )
    });
    let motions = initiators.bends.iter().map(|b| b.moved.hits as usize).sum();
    let kept = initiators.bends.iter().all(|b| b.exceeded == 0 && b.moved.hits > 0);
    claim("F1", judge_every_run(motions, kept), ours)
}

fn posture_by_veto(postures: &PostureResults) -> Claim {
    let cases: Vec<&CaseResults> = postures.cases_with_method(IkMethod::Veto).collect();
    let fixed = cases.iter().filter(|c| c.number("slack") == 0.0);
    let fixed_percent = max_value(fixed.map(|c| c.number("reached")));
    let min_share = CLAIMS.threshold("F2a");
    let mut tests = Vec::new();
    let mut texts = Vec::new();
    // A motion of fixed rods always displaces the base, which objects: there is nothing to judge.
    for case in cases.iter().filter(|c| c.number("slack") > 0.0) {
        let reached = case.proportion("reached");
        tests.push(ThresholdTest::proportion_above(reached, min_share));
        texts.push(format!("{} links: {reached}", case.count("links")));
    }
    let ours = format!(
        "with 10 % of slack, {}; rods of fixed length: at most {fixed_percent:.1} %",
        join_texts(texts, |text| text)
    );
    claim("F2a", judge_thresholds(tests), ours)
}

fn posture_there_and_back(postures: &PostureResults) -> Claim {
    let [free, back] = [IkMethod::FreeBase, IkMethod::ThereAndBack].map(|way| {
        judge_all_trials(postures.cases_with_method(way).map(|c| c.proportion("reached")))
    });
    let ours = join_texts(
        postures.cases_with_method(IkMethod::ThereAndBack).filter(|c| c.number("slack") == 0.0),
        |c| {
            format!(
                "{} links: {}, {:.0} us",
                c.count("links"),
                c.proportion("reached"),
                c.number("median_us")
            )
        },
    );
    claim("F2b", combined_verdict(&[free, back]), ours)
}

fn rejoined(broken: &BreakResults) -> Claim {
    let none_gone: Vec<_> = broken.cases.iter().filter(|c| c.count("gone") == 0).collect();
    let ours = join_texts(&none_gone, |c| {
        format!(
            "{} thrown by {} m: {}",
            c.count("scattered"),
            c.number("by_m"),
            c.proportion("whole")
        )
    });
    let verdict = judge_all_runs(none_gone, |c| {
        c.is_true_in_all_runs("whole") && c.is_true_in_all_runs("ends_kept")
    });
    claim("F3a", verdict, ours)
}

fn rejoined_with_fewer(broken: &BreakResults) -> Claim {
    let gone: Vec<_> = broken.cases.iter().filter(|c| c.count("gone") > 0).collect();
    let ours = join_texts(&gone, |c| {
        let who = if c.is_true("may_come") { "an end may come" } else { "nobody may come" };
        format!(
            "{} less {}, {who}: {} whole, {} refused",
            c.count("scattered"),
            c.count("gone"),
            c.proportion("whole"),
            c.count("too_long")
        )
    });
    let verdict = judge_all_runs(gone, |c| {
        // An end that may come closes every gap; otherwise the rods that are left must reach across.
        let possible =
            if c.is_true("may_come") { c.proportion("whole").n } else { c.proportion("can").hits };
        c.proportion("whole").hits == possible && c.is_true_in_all_runs("ends_kept")
    });
    claim("F3b", verdict, ours)
}

fn in_space(snakes: &SnakeResults) -> Claim {
    let ours = join_texts(snakes.at_rest(), |c| {
        format!(
            "{} % filled: clearance {} mm, vetoes {} %",
            100.0 * c.number("filled"),
            c.format_mm("min_clearance_m"),
            c.estimate("veto_percent")
        )
    });
    claim("F4", judge_all_runs(snakes.at_rest(), |c| c.count("penetrations") == 0), ours)
}
