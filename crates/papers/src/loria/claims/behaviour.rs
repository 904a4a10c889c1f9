//! E-8 to E-11: effects of errors on trajectories, contacts, trips, and behaviors.

use super::super::LoriaReport;
use super::super::floor::AvoidancePolicy;
use super::super::measure::Measure;
use super::super::reliability::{
    CONTACTS, DominantError, EFFECTORS, INCONCLUSIVE, LATERAL, ReliabilityResults, SENSORS,
    STRAIGHTNESS, SweepCase, TRIP, VariantKey,
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
    claim(
        "E-8",
        judge_thresholds([ThresholdTest::below(&bent, 0.0), ThresholdTest::above(&lateral, 0.0)]),
        format!(
            "Straightness: {}; both - reliable {bent}. Sideways moves per 1000 actions: {}; both - \
             reliable {lateral}.",
            by_regime(r, STRAIGHTNESS),
            by_regime(r, LATERAL),
        ),
    )
}

/// Returns a measure of the base variant under each regime, in words.
fn by_regime(r: &ReliabilityResults, measure: Measure) -> String {
    let texts = Regime::ALL.map(|regime| {
        let mean = r.estimate(VariantKey::BASE, regime, measure);
        format!("{} {mean}", regime.name())
    });
    texts.join(", ")
}

fn collisions(r: &ReliabilityResults) -> Claim {
    let places = r.base_keys();
    let mut tests = Vec::new();
    // How many places have the sensors above the effectors, and the effectors above none.
    let mut places_above = [0, 0];
    for &place in &places {
        for (k, pair) in [[Sensors, Effectors], [Effectors, Reliable]].into_iter().enumerate() {
            let difference = r.difference(place, pair, CONTACTS);
            tests.push(ThresholdTest::above(&difference, 0.0));
            places_above[k] += usize::from(difference.is_above(0.0));
        }
    }
    let points = r.dominant_errors();
    tests.extend(points.iter().map(|p| ThresholdTest::above(&p.sensors_less_effectors, 0.0)));
    let [sensors_more, effectors_more, inconclusive] = [SENSORS, EFFECTORS, INCONCLUSIVE]
        .map(|errors| points.iter().filter(|point| point.by == errors).count());
    claim(
        "E-9",
        judge_thresholds(tests),
        format!(
            "Presets, rule cut, per 1000 actions: {}; sensors - effectors {}. Sensors are above \
             effectors at {} of {} places (floors, rules, behaviors), and effectors above \
             reliable at {}. At equal error level, of {} points: sensors more at {}, effectors at {}, \
             not to be told at {} (by Holm). {}",
            by_regime(r, CONTACTS),
            r.difference(VariantKey::BASE, [Sensors, Effectors], CONTACTS),
            places_above[0],
            places.len(),
            places_above[1],
            points.len(),
            sensors_more,
            effectors_more,
            inconclusive,
            flips(&points),
        ),
    )
}

/// Returns the error level from which on sensors cause more contacts, by case of the sweep.
fn flips(points: &[DominantError]) -> String {
    let mut texts = Vec::new();
    for case in SweepCase::all() {
        // From the highest level down, so that sensors stay worse from the level found on.
        let downward = points.iter().rev().filter(|point| point.case == case);
        let first = downward.take_while(|point| point.by == SENSORS).last();
        let from = match first {
            None => "at no level".into(),
            Some(point) => format!("from e = {} on", point.level),
        };
        let [mind, beams, spread] = case.names();
        texts.push(format!("{mind}, {beams} beams, {spread}: {from}"));
    }
    format!("Sensors cause more, by behavior, beams and recipe: {}.", texts.join("; "))
}

fn slowest_trips(r: &ReliabilityResults) -> Claim {
    let places = r.base_keys();
    let mut tests = Vec::new();
    let mut held = 0;
    for &place in &places {
        let longer =
            [Reliable, Effectors, Sensors].map(|other| r.difference(place, [Both, other], TRIP));
        tests.extend(longer.iter().map(|longer| ThresholdTest::above(longer, 0.0)));
        held += usize::from(longer.iter().all(|longer| longer.is_above(0.0)));
    }
    claim(
        "E-10a",
        judge_thresholds(tests),
        format!(
            "Cycles per trip: {}. Both are slowest at {held} of {} places.",
            by_regime(r, TRIP),
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
    let ratios = pairs.map(|[a, b]| {
        format!("{} / {} {}", a.name(), b.name(), r.ratio(VariantKey::BASE, [a, b], TRIP))
    });
    claim("E-10b", Verdict::Lost, format!("Seed by seed: {}.", ratios.join("; ")))
}

fn behaviours(r: &ReliabilityResults) -> Claim {
    let plain_less_filtered = [AvoidancePolicy::Avoid, AvoidancePolicy::Filter];
    let filtered_less_plain = [AvoidancePolicy::Filter, AvoidancePolicy::Avoid];
    let [saved_reliable, saved_both] =
        [Reliable, Both].map(|regime| r.between_policies(plain_less_filtered, regime, TRIP));
    let [contacts_reliable, contacts_both] =
        [Reliable, Both].map(|regime| r.between_policies(filtered_less_plain, regime, CONTACTS));
    let more = difference_of_savings(r);
    claim(
        "E-11",
        judge_thresholds([saved_both, more].map(|saved| ThresholdTest::above(&saved, 0.0))),
        format!(
            "A filter (two reports before a robot believes its side beams) saves cycles per \
             trip: reliable {saved_reliable}, both {saved_both}, the second less the first {more}. It costs contacts per \
             1000 actions: reliable {contacts_reliable}, both {contacts_both}.",
        ),
    )
}

/// Returns the cycles that the filter saves under both errors, minus those that it saves without
/// any.
fn difference_of_savings(r: &ReliabilityResults) -> Estimate {
    Estimate::paired_difference(&saved_by_filter(r, Both), &saved_by_filter(r, Reliable))
}

/// Returns the cycles of a trip that the filter saves under a regime, by seed.
fn saved_by_filter(r: &ReliabilityResults, regime: Regime) -> Vec<Option<f64>> {
    let [plain, filtered] = [AvoidancePolicy::Avoid, AvoidancePolicy::Filter]
        .map(|mind| r.values(VariantKey { mind, ..VariantKey::BASE }, regime, TRIP));
    plain.iter().zip(&filtered).map(|(a, b)| Some((*a)? - (*b)?)).collect()
}
