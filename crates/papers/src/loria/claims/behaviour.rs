//! E-8 to E-11: effects of errors on trajectories, contacts, trips, and behaviors.

use super::super::Report;
use super::super::floor::Mind;
use super::super::reliability::{
    CONTACTS, Key, LATERAL, Reliability, STRAIGHTNESS, SweepCase, TRIP, larger,
};
use super::{Claim, Verdict, claim};
use sidestep::worlds::robots::world::Regime::{self, Both, Effectors, Reliable, Sensors};
use sidestep_document::Estimate;

pub(super) fn claims(report: &Report) -> Vec<Claim> {
    let r = &report.reliability;
    vec![zigzag(r), collisions(r), slowest_trips(r), trip_ratios(r), behaviours(r)]
}

fn zigzag(r: &Reliability) -> Claim {
    let bent = r.difference(Key::BASE, [Both, Reliable], STRAIGHTNESS);
    let lateral = r.estimate(Key::BASE, Both, LATERAL);
    let means = by_regime(|regime| r.estimate(Key::BASE, regime, STRAIGHTNESS));
    claim(
        "E-8",
        Verdict::of(bent.is_below(0.0) && lateral.is_above(0.0)),
        format!(
            "Straightness: {means}; both - reliable {bent}. Sideways moves per 1000 actions: \
             both {lateral}, reliable 0."
        ),
    )
}

/// Returns a measure under each regime, in words.
fn by_regime(of: impl Fn(Regime) -> Estimate) -> String {
    Regime::ALL.map(|regime| format!("{} {}", regime.name(), of(regime))).join(", ")
}

fn collisions(r: &Reliability) -> Claim {
    let sensors_more = |key| r.difference(key, [Sensors, Effectors], CONTACTS).is_above(0.0);
    let effectors_harm = |key| r.difference(key, [Effectors, Reliable], CONTACTS).is_above(0.0);
    let places = r.places();
    let above = places.iter().filter(|&&key| sensors_more(key)).count();
    let whole = places.iter().filter(|&&key| sensors_more(key) && effectors_harm(key)).count();
    let swept = SweepCase::all().flat_map(|case| r.levels.iter().map(move |&e| (case, e)));
    let by: Vec<&str> = swept.map(|(case, e)| larger(&r.sensors_less_effectors(case, e))).collect();
    let count = |name| by.iter().filter(|&&b| b == name).count();
    let (sensors, effectors) = (count("sensors"), count("effectors"));
    claim(
        "E-9",
        Verdict::of(whole == places.len() && effectors == 0),
        format!(
            "Presets, rule cut, per 1000 actions: {}; sensors - effectors {}. Sensors are above \
             effectors at {above} of {} places (floors, rules, behaviours), and effectors above \
             reliable too at {whole}. At equal error level, of {} points: sensors more at \
             {sensors}, effectors at {effectors}, not to be told at {}. {}",
            by_regime(|regime| r.estimate(Key::BASE, regime, CONTACTS)),
            r.difference(Key::BASE, [Sensors, Effectors], CONTACTS),
            places.len(),
            by.len(),
            by.len() - sensors - effectors,
            flips(r),
        ),
    )
}

/// Returns the error level from which on sensors cause more contacts, by case of the sweep.
fn flips(r: &Reliability) -> String {
    let sentence = |case: SweepCase| {
        let is_sensors = |e: f64| larger(&r.sensors_less_effectors(case, e)) == "sensors";
        // The first level from which on sensors stay worse.
        let first = r.levels.iter().rev().take_while(|&&e| is_sensors(e)).last();
        let [mind, beams, spread] = case.names();
        let from = first.map_or("at no level".into(), |e| format!("from e = {e} on"));
        format!("{mind}, {beams} beams, {spread}: {from}")
    };
    let cases: Vec<String> = SweepCase::all().map(sentence).collect();
    format!("Sensors cause more, by behaviour, beams and recipe: {}.", cases.join("; "))
}

fn slowest_trips(r: &Reliability) -> Claim {
    let slower = |key, other| r.difference(key, [Both, other], TRIP).is_above(0.0);
    let slowest = |key| [Reliable, Effectors, Sensors].into_iter().all(|other| slower(key, other));
    let places = r.places();
    let held = places.iter().filter(|&&key| slowest(key)).count();
    claim(
        "E-10a",
        Verdict::of(held == places.len()),
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
        Verdict::of(saved(Both).is_above(0.0) && more.is_above(0.0)),
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
