//! Verdicts on the questions of the study.

use super::{
    ALL_WHEELS, ALONE, ALONE_WITH_ERRORS, METHODS, MapResults, PIBT, PIBT_BY_REPORTS,
    SLIPPING_WHEELS, THROUGHPUT,
};
use crate::claims::{ClaimsFile, PaperClaims, ThresholdTest, join_texts, judge_thresholds};
use sidestep_document::Estimate;
use sidestep_document::claim::Claim;

pub(super) static CLAIMS: PaperClaims =
    PaperClaims::new(|| ClaimsFile::read(include_str!("../../claims/mapf.toml")));

const ORDERED: &str = "lacam, adg";
const ANEW: &str = "lacam, replan";
const BLIND: &str = "lacam, blind";

const NOMAD: &str = "nomad";

/// Wheels that err in any way.
const ERRING_WHEELS: [&str; 3] = ["late", "nomad", "mrclam"];

/// A ratio in one crowd, seed by seed.
struct Comparison {
    /// The map, the number of robots, and the wheels.
    crowd: String,
    ratio: Estimate,
}

/// The side of the threshold on which a claim sees a ratio.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Above,
    Below,
}

pub(super) fn judge(maps: &[MapResults]) -> Vec<Claim> {
    vec![
        judge_ratios("M-1", Side::Above, &best_kept(maps)),
        judge_ratios("M-2", Side::Above, &ratios(maps, &SLIPPING_WHEELS, [ORDERED, PIBT])),
        judge_ratios("M-3", Side::Below, &kept_shares(maps)),
        judge_ratios("M-4", Side::Above, &ratios(maps, &ERRING_WHEELS, [ORDERED, BLIND])),
        judge_ratios("M-5", Side::Above, &ratios(maps, &ERRING_WHEELS, [ANEW, ORDERED])),
        judge_ratios("M-6", Side::Above, &ratios(maps, &ALL_WHEELS, [PIBT, ALONE])),
        judge_ratios("M-7", Side::Below, &ratios(maps, &ALL_WHEELS, [ALONE_WITH_ERRORS, ALONE])),
        judge_ratios("M-8", Side::Above, &ratios(maps, &ALL_WHEELS, [PIBT_BY_REPORTS, ALONE])),
    ]
}

/// Each ratio has to pass by itself, see [`judge_thresholds`].
fn judge_ratios(id: &str, side: Side, comparisons: &[Comparison]) -> Claim {
    let threshold = CLAIMS.threshold(id);
    let test = |comparison: &Comparison| match side {
        Side::Above => ThresholdTest::above(&comparison.ratio, threshold),
        Side::Below => ThresholdTest::below(&comparison.ratio, threshold),
    };
    let verdict = judge_thresholds(comparisons.iter().map(test));
    CLAIMS.claim(id, verdict, summary(side, threshold, comparisons))
}

/// Returns how many ratios are on the claim's side by their intervals, which are surely on the other one, and the extremes.
fn summary(side: Side, threshold: f64, comparisons: &[Comparison]) -> String {
    let is_above = |c: &&Comparison| c.ratio.interval.is_some_and(|i| i.low > threshold);
    let is_below = |c: &&Comparison| c.ratio.interval.is_some_and(|i| i.high < threshold);
    let above: Vec<&Comparison> = comparisons.iter().filter(is_above).collect();
    let below: Vec<&Comparison> = comparisons.iter().filter(is_below).collect();
    let [agree, disagree] = if side == Side::Above { [above, below] } else { [below, above] };
    let word = if side == Side::Above { "above" } else { "below" };
    let mut by_mean: Vec<&Comparison> =
        comparisons.iter().filter(|comparison| comparison.ratio.mean.is_some()).collect();
    by_mean.sort_by(|a, b| a.ratio.mean_or_zero().total_cmp(&b.ratio.mean_or_zero()));
    let text = |comparison: &Comparison| format!("{} {}", comparison.crowd, comparison.ratio);
    let extremes =
        by_mean.first().into_iter().chain(by_mean.last()).map(|comparison| text(comparison));
    let others = if disagree.is_empty() {
        "none surely on the other side".into()
    } else {
        let names = join_texts(&disagree, |comparison| comparison.crowd.clone());
        format!("{} surely on the other side ({names})", disagree.len())
    };
    format!(
        "{word} {threshold} in {} of {} crowds, {others}; least and most: {}",
        agree.len(),
        comparisons.len(),
        join_texts(extremes, |text| text),
    )
}

/// Calls `add` for each crowd with some wheels.
fn for_each_crowd(
    maps: &[MapResults],
    wheels: &[&str],
    mut add: impl FnMut(&MapResults, u64, &str),
) {
    for map in maps {
        for robots in map.robots() {
            wheels.iter().for_each(|wheels| add(map, robots, wheels));
        }
    }
}

/// Returns the throughput of a case seed by seed; those of 0, which have no ratio, are left out.
fn throughputs(map: &MapResults, robots: u64, wheels: &str, method: &str) -> Vec<Option<f64>> {
    let case = map.case(robots, wheels, method);
    let values = case.map_or(Vec::new(), |case| case.by_seed("by_seed", THROUGHPUT));
    values.into_iter().map(|value| value.filter(|trips| *trips > 0.0)).collect()
}

/// Returns the throughput of one method over that of another, in all crowds.
fn ratios(maps: &[MapResults], wheels: &[&str], methods: [&str; 2]) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for_each_crowd(maps, wheels, |map, robots, wheels| {
        let [a, b] = methods.map(|method| throughputs(map, robots, wheels, method));
        let crowd = format!("{} {robots} {wheels}", map.map);
        comparisons.push(Comparison { crowd, ratio: Estimate::geometric_ratio(&a, &b) });
    });
    comparisons
}

/// Returns what robots that are led keep of their throughput on wheels that slip, over what those alone keep.
fn kept_shares(maps: &[MapResults]) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for_each_crowd(maps, &[NOMAD], |map, robots, wheels| {
        let [led, alone] = [ORDERED, ALONE].map(|method| {
            let [slipping, perfect] =
                [wheels, ALL_WHEELS[0]].map(|wheels| throughputs(map, robots, wheels, method));
            let pairs = slipping.into_iter().zip(perfect);
            pairs.map(|(slipping, perfect)| Some(slipping? / perfect?)).collect::<Vec<_>>()
        });
        let crowd = format!("{} {robots}", map.map);
        comparisons.push(Comparison { crowd, ratio: Estimate::geometric_ratio(&led, &alone) });
    });
    comparisons
}

/// Returns the throughput of the method that is best on perfect wheels over that of the one that is best on wheels that
/// slip.
fn best_kept(maps: &[MapResults]) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for_each_crowd(maps, &SLIPPING_WHEELS, |map, robots, wheels| {
        let best = best_method(map, robots, ALL_WHEELS[0]);
        let best_here = best_method(map, robots, wheels);
        let [a, b] = [best, best_here].map(|method| throughputs(map, robots, wheels, method));
        let crowd = format!("{} {robots} {wheels} ({best} over {best_here})", map.map);
        comparisons.push(Comparison { crowd, ratio: Estimate::geometric_ratio(&a, &b) });
    });
    comparisons
}

/// Returns the method with the highest mean throughput. Sensors that err are another case, and no other method.
fn best_method(map: &MapResults, robots: u64, wheels: &str) -> &'static str {
    let mean = |method: &str| {
        map.case(robots, wheels, method).map_or(0.0, |case| case.number("throughput"))
    };
    let methods = METHODS.iter().copied().filter(|method| *method != ALONE_WITH_ERRORS);
    methods.max_by(|a, b| mean(a).total_cmp(&mean(b))).unwrap_or(ALONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_results::{CaseResults, Value};
    use sidestep_document::claim::Verdict;

    /// Results in which methods have these throughputs on perfect wheels, and on all others.
    fn results(throughput: impl Fn(&str, &str) -> f64) -> MapResults {
        let mut cases = Vec::new();
        for wheels in ALL_WHEELS {
            for method in METHODS {
                let trips = throughput(wheels, method);
                let by_seed = |seed: usize| vec![(THROUGHPUT, trips * (1.0 + 0.001 * seed as f64))];
                let case = [
                    ("robots", Value::Count(20)),
                    ("wheels", Value::Word(wheels.into())),
                    ("method", Value::Word(method.into())),
                ];
                let of_case = [
                    ("throughput", Value::Number(trips)),
                    ("by_seed", Value::BySeed((0..10).map(by_seed).collect())),
                ];
                cases.push(CaseResults::new(case, of_case));
            }
        }
        MapResults { map: "room", cases }
    }

    fn verdicts(throughput: impl Fn(&str, &str) -> f64) -> Vec<Verdict> {
        judge(&[results(throughput)]).iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn every_claim_can_be_held_and_can_be_refuted() {
        let held = verdicts(|wheels, method| match (wheels, method) {
            ("nomad", ALONE) => 4.5,
            (_, ALONE) => 5.0,
            (_, ALONE_WITH_ERRORS) => 4.0,
            (_, PIBT | PIBT_BY_REPORTS) => 6.0,
            ("perfect", ORDERED) => 9.0,
            (_, ORDERED) => 7.0,
            (_, ANEW) => 8.0,
            _ => 2.0,
        });
        // Who is best on perfect wheels is another one than on those that slip.
        assert_eq!(held[0], Verdict::Refuted);
        assert_eq!(held[1..], [Verdict::Held; 7]);
        let refuted = verdicts(|wheels, method| match (wheels, method) {
            ("nomad", ALONE) => 2.0,
            (_, ALONE) => 9.0,
            (_, ALONE_WITH_ERRORS) => 9.5,
            (_, PIBT) => 8.0,
            (_, BLIND) => 7.0,
            (_, ORDERED) => 6.0,
            (_, ANEW) => 5.0,
            _ => 1.0,
        });
        assert_eq!(refuted[1..], [Verdict::Refuted; 7]);
        let same = verdicts(|_, method| {
            METHODS.iter().position(|m| *m == method).unwrap_or(0) as f64 + 1.0
        });
        assert_eq!(same[0], Verdict::Held);
    }

    #[test]
    fn a_summary_counts_crowds_on_either_side_and_names_the_extremes() {
        let claims = judge(&[results(|_, method| if method == PIBT { 3.0 } else { 2.0 })]);
        let ours = &claims[5].ours;
        assert!(ours.starts_with("above 1 in 4 of 4 crowds, none surely"), "{ours}");
        let ours = &claims[1].ours;
        assert!(
            ours.contains("2 surely on the other side (room 20 nomad; room 20 mrclam)"),
            "{ours}"
        );
    }

    #[test]
    fn what_made_no_trip_decides_nothing() {
        assert_eq!(verdicts(|_, _| 0.0), [Verdict::Undecided; 8]);
    }
}
