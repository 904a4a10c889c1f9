//! E-8 to E-11: effects of errors on trajectories, contacts, trips, and behaviors.

use super::super::LoriaReport;
use super::super::floor::AvoidancePolicy;
use super::super::reliability::{
    CONTACTS, EFFECTORS, INCONCLUSIVE, LATERAL, ReliabilityResults, SENSORS, STRAIGHTNESS,
    SweepCase, TRIP, VariantKey,
};
use super::{Claim, ThresholdTest, Verdict, claim, judge_thresholds};
use sidestep::worlds::robots::world::Regime::{self, Both, Effectors, Reliable, Sensors};
use sidestep_document::Estimate;

pub(super) fn claims(report: &LoriaReport) -> Vec<Claim> {
    let r = &report.reliability;
    vec![zigzag(r), collisions(r), slowest_trips(r), trip_ratios(r), behaviours(r)]
}

fn zigzag(r: &ReliabilityResults) -> Claim {
    let bent = r.difference(VariantKey::BASE, [Both, Reliable], STRAIGHTNESS);
    let lateral = r.difference(VariantKey::BASE, [Both, Reliable], LATERAL);
    let means = |measure| by_regime(|regime| r.estimate(VariantKey::BASE, regime, measure));
    claim(
        "E-8",
        judge_thresholds([ThresholdTest::below(&bent, 0.0), ThresholdTest::above(&lateral, 0.0)]),
        format!(
            "Straightness: {}; both - reliable {bent}. Sideways moves per 1000 actions: {}; both - \
             reliable {lateral}.",
            means(STRAIGHTNESS),
            means(LATERAL),
        ),
    )
}

/// Returns a measure under each regime, in words.
fn by_regime(of: impl Fn(Regime) -> Estimate) -> String {
    Regime::ALL.map(|regime| format!("{} {}", regime.name(), of(regime))).join(", ")
}

fn collisions(r: &ReliabilityResults) -> Claim {
    let places = r.base_keys();
    let more = |key, pair| ThresholdTest::above(&r.difference(key, pair, CONTACTS), 0.0);
    let orders = |&key: &VariantKey<'static>| {
        [[Sensors, Effectors], [Effectors, Reliable]].map(|p| more(key, p))
    };
    let at_places = places.iter().flat_map(orders);
    let larger = r.dominant_errors();
    let at_levels = larger.iter().map(|l| ThresholdTest::above(&l.sensors_less_effectors, 0.0));
    let count = |name| larger.iter().filter(|l| l.by == name).count();
    let above = |pair| {
        let is = |key: &&VariantKey<'static>| r.difference(**key, pair, CONTACTS).is_above(0.0);
        places.iter().filter(is).count()
    };
    claim(
        "E-9",
        judge_thresholds(at_places.chain(at_levels)),
        format!(
            "Presets, rule cut, per 1000 actions: {}; sensors - effectors {}. Sensors are above \
             effectors at {} of {} places (floors, rules, behaviors), and effectors above \
             reliable at {}. At equal error level, of {} points: sensors more at {}, effectors at {}, \
             not to be told at {} (by Holm). {}",
            by_regime(|regime| r.estimate(VariantKey::BASE, regime, CONTACTS)),
            r.difference(VariantKey::BASE, [Sensors, Effectors], CONTACTS),
            above([Sensors, Effectors]),
            places.len(),
            above([Effectors, Reliable]),
            larger.len(),
            count(SENSORS),
            count(EFFECTORS),
            count(INCONCLUSIVE),
            flips(r),
        ),
    )
}

/// Returns the error level from which on sensors cause more contacts, by case of the sweep.
fn flips(r: &ReliabilityResults) -> String {
    let larger = r.dominant_errors();
    let sentence = |case: SweepCase| {
        let levels = larger.iter().rev().filter(|l| l.case == case);
        // The first level from which on sensors stay worse.
        let first = levels.take_while(|l| l.by == SENSORS).last();
        let [mind, beams, spread] = case.names();
        let from = first.map_or("at no level".into(), |l| format!("from e = {} on", l.level));
        format!("{mind}, {beams} beams, {spread}: {from}")
    };
    let cases: Vec<String> = SweepCase::all().map(sentence).collect();
    format!("Sensors cause more, by behavior, beams and recipe: {}.", cases.join("; "))
}

fn slowest_trips(r: &ReliabilityResults) -> Claim {
    let longer = |key, other| r.difference(key, [Both, other], TRIP);
    let others = [Reliable, Effectors, Sensors];
    let places = r.base_keys();
    let each = places.iter().flat_map(|&key| others.map(|other| longer(key, other)));
    let slowest =
        |&key: &VariantKey<'static>| others.iter().all(|other| longer(key, *other).is_above(0.0));
    let held = places.iter().filter(|key| slowest(key)).count();
    claim(
        "E-10a",
        judge_thresholds(each.map(|longer| ThresholdTest::above(&longer, 0.0))),
        format!(
            "Cycles per trip: {}. Both are slowest at {held} of {} places.",
            by_regime(|regime| r.estimate(VariantKey::BASE, regime, TRIP)),
            places.len()
        ),
    )
}

fn trip_ratios(r: &ReliabilityResults) -> Claim {
    let pairs = [
        [Effectors, Reliable],
        [Sensors, Reliable],
        [Both, Reliable],
        [Both, Sensors],
        [Both, Effectors],
    ];
    let ratio = |[a, b]: [Regime; 2]| {
        format!("{} / {} {}", a.name(), b.name(), r.ratio(VariantKey::BASE, [a, b], TRIP))
    };
    claim("E-10b", Verdict::Lost, format!("Seed by seed: {}.", pairs.map(ratio).join("; ")))
}

fn behaviours(r: &ReliabilityResults) -> Claim {
    let saved = |regime| {
        r.between_policies([AvoidancePolicy::Avoid, AvoidancePolicy::Filter], regime, TRIP)
    };
    let contacts = |regime| {
        r.between_policies([AvoidancePolicy::Filter, AvoidancePolicy::Avoid], regime, CONTACTS)
    };
    let more = difference_of_savings(r);
    claim(
        "E-11",
        judge_thresholds([saved(Both), more].map(|saved| ThresholdTest::above(&saved, 0.0))),
        format!(
            "A filter (two reports before a robot believes its side beams) saves cycles per \
             trip: reliable {}, both {}, the second less the first {more}. It costs contacts per \
             1000 actions: reliable {}, both {}.",
            saved(Reliable),
            saved(Both),
            contacts(Reliable),
            contacts(Both),
        ),
    )
}

/// Returns the cycles that the filter saves under both errors, minus those that it saves without
/// any.
fn difference_of_savings(r: &ReliabilityResults) -> Estimate {
    let of = |mind, regime| r.values(VariantKey { mind, ..VariantKey::BASE }, regime, TRIP);
    let saved = |regime| -> Vec<Option<f64>> {
        let (plain, filtered) =
            (of(AvoidancePolicy::Avoid, regime), of(AvoidancePolicy::Filter, regime));
        plain.iter().zip(&filtered).map(|(a, b)| Some((*a)? - (*b)?)).collect()
    };
    Estimate::paired_difference(&saved(Both), &saved(Reliable))
}
