//! Keys that are given and do nothing, or lists that are given and empty: refused, because their
//! author expects something of them.

use super::super::{DoorSection, MoverSection, RobotSection, RobotsFile};
use super::*;

/// The built-in behaviors, and the keys of each.
pub(in crate::scenario) const BEHAVIOURS: [(&str, &[&str]); 7] = [
    ("wander", &["turn_every"]),
    ("announce", &["turn_every"]),
    ("shuttle", &["a", "b", "avoidance"]),
    ("goto", &["goals", "repeat", "avoidance"]),
    ("replay", &["actions", "repeat"]),
    ("random", &["weights", "weights_after_contact"]),
    ("external", &[]),
];

/// A key, whether it is given and does nothing, and the reason.
struct UnusedKeyRule(&'static str, bool, &'static str);

/// Refuses keys that do nothing in a scenario; `own` are behaviors beside the built-in ones,
/// and `has_doors` says whether its map brings doors.
///
/// # Errors
/// At the first such key.
pub(super) fn refuse_unused(
    source: &Source,
    file: &RobotsFile,
    own: &Behaviours,
    has_doors: bool,
) -> Result<(), InputError> {
    let by_kind = file.conflict_policy == ConflictPolicy::ByKind;
    let is_ordered = !file.kind_order.is_empty();
    let map = file.map.get_ref();
    let unknown = map.office.is_some() && source.keys("map").iter().any(|k| k.name == "unknown");
    let rules = [
        UnusedKeyRule(
            "kind_order",
            is_ordered && !by_kind,
            "unless conflict_policy is \"by_kind\"",
        ),
        UnusedKeyRule("map.unknown", unknown, "beside `office`, in which nothing is unknown"),
    ];
    apply(source, "", &rules)?;
    for (k, section) in file.robots.0.iter().enumerate() {
        check_robots(source, &format!("robots.{k}."), section.get_ref(), own)?;
    }
    for (k, section) in file.people.0.iter().enumerate() {
        check_people(source, &format!("people.{k}."), section.get_ref())?;
    }
    for (k, section) in file.doors.0.iter().enumerate() {
        check_doors(source, &format!("doors.{k}."), section.get_ref(), has_doors)?;
    }
    Ok(())
}

fn apply(source: &Source, path: &str, rules: &[UnusedKeyRule]) -> Result<(), InputError> {
    match rules.iter().find(|UnusedKeyRule(_, does_nothing, _)| *does_nothing) {
        Some(UnusedKeyRule(key, _, because)) => {
            Err(source.unused_key(&format!("{path}{key}"), because))
        }
        None => Ok(()),
    }
}

fn check_robots(
    source: &Source,
    path: &str,
    s: &RobotSection,
    own: &Behaviours,
) -> Result<(), InputError> {
    let scen = s.scen.is_some();
    let at = !s.at.is_empty();
    let listed = "beside `scen`, which lists starts and goals";
    let rules = [
        UnusedKeyRule("at", at && scen, listed),
        UnusedKeyRule("region", s.region.is_some() && scen, listed),
        UnusedKeyRule("behaviour", s.behaviour.is_some() && scen, listed),
        UnusedKeyRule("region", s.region.is_some() && at, "beside `at`"),
    ];
    apply(source, path, &rules)?;
    check_phase(source, path, s.period, s.phase)?;
    match &s.behaviour {
        Some(section) => {
            check_behaviour(source, &format!("{path}behaviour."), section.get_ref(), own)
        }
        None => Ok(()),
    }
}

fn check_behaviour(
    source: &Source,
    path: &str,
    s: &BehaviourSection,
    own: &Behaviours,
) -> Result<(), InputError> {
    let own_kind = s.kind.get_ref().as_str();
    let known = match BEHAVIOURS.iter().find(|(kind, _)| *kind == own_kind) {
        Some((_, keys)) => *keys,
        None if own.contains_key(own_kind) => &[],
        // Its name is wrong, and that error is the one to report.
        None => return Ok(()),
    };
    let foreign =
        s.given_keys().into_iter().find(|(key, is_given)| *is_given && !known.contains(key));
    if let Some((key, _)) = foreign {
        let remedy = match BEHAVIOURS.iter().find(|(_, keys)| keys.contains(&key)) {
            Some((other, _)) => format!("leave it out: it is a key of `{other}`"),
            None => "leave it out".into(),
        };
        let cause = format!("`{key}` does nothing in the behaviour `{own_kind}`");
        return Err(source.error_at(&format!("{path}{key}"), cause, remedy));
    }
    let lists = [
        ("goals", s.goals.as_ref().is_some_and(Vec::is_empty), "[col, row]"),
        ("actions", s.actions.as_ref().is_some_and(Vec::is_empty), "action, e.g. \"forward\""),
    ];
    if let Some((key, _, one)) = lists.into_iter().find(|(_, is_empty, _)| *is_empty) {
        let cause = format!("`{key}` is empty");
        let remedy = format!("give at least one {one}");
        return Err(source.error_at(&format!("{path}{key}"), cause, remedy));
    }
    if s.turn_every == Some(0) {
        let key = format!("{path}turn_every");
        return Err(source.error_at(&key, "turn_every = 0", "give 1 or more actions"));
    }
    Ok(())
}

fn check_people(source: &Source, path: &str, s: &MoverSection) -> Result<(), InputError> {
    let beside = s.region.is_some() && !s.at.is_empty();
    apply(source, path, &[UnusedKeyRule("region", beside, "beside `at`")])?;
    check_phase(source, path, s.period, s.phase)
}

fn check_doors(
    source: &Source,
    path: &str,
    s: &DoorSection,
    has_doors: bool,
) -> Result<(), InputError> {
    let unsized_doors = s.office && s.at.is_empty();
    let rules = [
        UnusedKeyRule("office", s.office && !has_doors, "on a map without doors of its own"),
        UnusedKeyRule(
            "size",
            s.size.is_some() && unsized_doors,
            "beside `office`, whose doors have sizes",
        ),
    ];
    apply(source, path, &rules)
}

/// Refuses a phase beyond the period, which would be another one.
fn check_phase(
    source: &Source,
    path: &str,
    period: Option<super::super::Period>,
    phase: Option<u32>,
) -> Result<(), InputError> {
    let period = super::bodies::period_cycles(period);
    match phase {
        Some(phase) if phase >= period => {
            let cause = format!("phase = {phase}, with a period of {period}");
            let remedy = format!("give 0 to {}, the cycle in which it acts", period - 1);
            Err(source.error_at(&format!("{path}phase"), cause, remedy))
        }
        _ => Ok(()),
    }
}
