//! E-8 to E-11: effects of errors on trajectories, contacts, trips, and behaviors.

use super::super::Report;
use super::super::floor::Mind;
use super::super::reliability::{
    CONTACTS, EFFECTORS, Key, LATERAL, NOBODY, Reliability, SENSORS, STRAIGHTNESS, SweepCase, TRIP,
};
use super::{Claim, Comparison, Verdict, claim, judged};
use sidestep::worlds::robots::world::Regime::{self, Both, Effectors, Reliable, Sensors};
use sidestep_document::Estimate;

pub(super) fn claims(report: &Report) -> Vec<Claim> {
    let r = &report.reliability;
    vec![zigzag(r), collisions(r), slowest_trips(r), trip_ratios(r), behaviours(r)]
}

fn zigzag(r: &Reliability) -> Claim {
    let bent = r.difference(Key::BASE, [Both, Reliable], STRAIGHTNESS);
    let lateral = r.difference(Key::BASE, [Both, Reliable], LATERAL);
    let means = |measure| by_regime(|regime| r.estimate(Key::BASE, regime, measure));
    claim(
        "E-8",
        judged([Comparison::below(&bent, 0.0), Comparison::above(&lateral, 0.0)]),
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

fn collisions(r: &Reliability) -> Claim {
    let places = r.places();
    let more = |key, pair| Comparison::above(&r.difference(key, pair, CONTACTS), 0.0);
    let orders =
        |&key: &Key<'static>| [[Sensors, Effectors], [Effectors, Reliable]].map(|p| more(key, p));
    let at_places = places.iter().flat_map(orders);
    let larger = r.larger();
    let at_levels = larger.iter().map(|l| Comparison::above(&l.sensors_less_effectors, 0.0));
    let count = |name| larger.iter().filter(|l| l.by == name).count();
    let above = |pair| {
        let is = |key: &&Key<'static>| r.difference(**key, pair, CONTACTS).is_above(0.0);
        places.iter().filter(is).count()
    };
    claim(
        "E-9",
        judged(at_places.chain(at_levels)),
        format!(
            "Presets, rule cut, per 1000 actions: {}; sensors - effectors {}. Sensors are above \
             effectors at {} of {} places (floors, rules, behaviors), and effectors above \
             reliable at {}. At equal error level, of {} points: sensors more at {}, effectors at {}, \
             not to be told at {} (by Holm). {}",
            by_regime(|regime| r.estimate(Key::BASE, regime, CONTACTS)),
            r.difference(Key::BASE, [Sensors, Effectors], CONTACTS),
            above([Sensors, Effectors]),
            places.len(),
            above([Effectors, Reliable]),
            larger.len(),
            count(SENSORS),
            count(EFFECTORS),
            count(NOBODY),
            flips(r),
        ),
    )
}

/// Returns the error level from which on sensors cause more contacts, by case of the sweep.
fn flips(r: &Reliability) -> String {
    let larger = r.larger();
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

fn slowest_trips(r: &Reliability) -> Claim {
    let longer = |key, other| r.difference(key, [Both, other], TRIP);
    let others = [Reliable, Effectors, Sensors];
    let places = r.places();
    let each = places.iter().flat_map(|&key| others.map(|other| longer(key, other)));
    let slowest =
        |&key: &Key<'static>| others.iter().all(|other| longer(key, *other).is_above(0.0));
    let held = places.iter().filter(|key| slowest(key)).count();
    claim(
        "E-10a",
        judged(each.map(|longer| Comparison::above(&longer, 0.0))),
        format!(
            "Cycles per trip: {}. Both are slowest at {held} of {} places.",
            by_regime(|regime| r.estimate(Key::BASE, regime, TRIP)),
            places.len()
        ),
    )
}

fn trip_ratios(r: &Reliability) -> Claim {
    let pairs = [
        [Effectors, Reliable],
        [Sensors, Reliable],
        [Both, Reliable],
        [Both, Sensors],
        [Both, Effectors],
    ];
    let ratio = |[a, b]: [Regime; 2]| {
        format!("{} / {} {}", a.name(), b.name(), r.ratio(Key::BASE, [a, b], TRIP))
    };
    claim("E-10b", Verdict::Lost, format!("Seed by seed: {}.", pairs.map(ratio).join("; ")))
}

fn behaviours(r: &Reliability) -> Claim {
    let saved = |regime| r.between_minds([Mind::Avoid, Mind::Filter], regime, TRIP);
    let contacts = |regime| r.between_minds([Mind::Filter, Mind::Avoid], regime, CONTACTS);
    let more = difference_of_savings(r);
    claim(
        "E-11",
        judged([saved(Both), more].map(|saved| Comparison::above(&saved, 0.0))),
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
fn difference_of_savings(r: &Reliability) -> Estimate {
    let of = |mind, regime| r.values(Key { mind, ..Key::BASE }, regime, TRIP);
    let saved = |regime| -> Vec<Option<f64>> {
        let (plain, filtered) = (of(Mind::Avoid, regime), of(Mind::Filter, regime));
        plain.iter().zip(&filtered).map(|(a, b)| Some((*a)? - (*b)?)).collect()
    };
    Estimate::paired(&saved(Both), &saved(Reliable))
}
