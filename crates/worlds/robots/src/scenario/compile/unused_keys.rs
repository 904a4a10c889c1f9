//! Keys that are given and do nothing, or lists that are given and empty: refused, because their
//! author expects something of them.

use super::super::{DoorSection, MoverSection, PeriodicSection, RobotSection, RobotsFile};
use super::*;

/// The built-in behaviors, and the keys that each reads beside `kind`.
pub(in crate::scenario) const BEHAVIOURS: [(&str, &[&str]); 7] = [
    ("wander", &["turn_every"]),
    ("announce", &["turn_every"]),
    ("shuttle", &["a", "b", "avoidance"]),
    ("goto", &["goals", "repeat", "avoidance"]),
    ("replay", &["actions", "repeat"]),
    ("random", &["weights", "weights_after_contact"]),
    ("external", &[]),
];

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
    if !file.kind_order.is_empty() && file.conflict_policy != ConflictPolicy::ByKind {
        return Err(source.unused_key("kind_order", "unless conflict_policy is \"by_kind\""));
    }
    for (k, kind) in file.kind_order.iter().enumerate() {
        let is_twice = file.kind_order[..k].iter().any(|other| other.get_ref() == kind.get_ref());
        if is_twice {
            let cause = format!("`{}` stands twice in kind_order", kind.get_ref());
            return Err(source.error(kind.span(), cause, "name each kind once"));
        }
    }
    // By its text, because a value that is not given is the default.
    let has_unknown = source.keys("map").iter().any(|key| key.name == "unknown");
    if has_unknown && file.map.get_ref().office.is_some() {
        let because = "beside `office`, in which nothing is unknown";
        return Err(source.unused_key("map.unknown", because));
    }
    for (k, section) in file.robots.0.iter().enumerate() {
        check_robots(source, &format!("robots.{k}."), section, own)?;
    }
    for (k, section) in file.people.0.iter().enumerate() {
        check_people(source, &format!("people.{k}."), section)?;
    }
    for section in &file.doors.0 {
        check_doors(source, section, has_doors)?;
    }
    Ok(())
}

fn check_robots(
    source: &Source,
    path: &str,
    section: &Spanned<RobotSection>,
    own: &Behaviours,
) -> Result<(), InputError> {
    let s = section.get_ref();
    let has_places = !s.at.is_empty();
    let has_list = s.scen.is_some();
    let beside_list = [
        ("at", has_places, !has_list),
        ("region", s.region.is_some(), !has_list),
        ("behaviour", s.behaviour.is_some(), !has_list),
    ];
    let because = "beside `scen`, which lists starts and goals";
    source.refuse_unused_keys(section.span(), &beside_list, because)?;
    let beside_places = [("region", s.region.is_some(), !has_places)];
    source.refuse_unused_keys(section.span(), &beside_places, "beside `at`")?;
    let has_tasks = s.tasks.is_some();
    let beside_tasks =
        [("scen", has_list, !has_tasks), ("behaviour", s.behaviour.is_some(), !has_tasks)];
    let because = "beside `tasks`, which say where the robots go";
    source.refuse_unused_keys(section.span(), &beside_tasks, because)?;
    check_phase(source, path, s.period, s.phase)?;
    check_action_cycles(source, path, s)?;
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

fn check_people(
    source: &Source,
    path: &str,
    section: &Spanned<MoverSection>,
) -> Result<(), InputError> {
    let s = section.get_ref();
    let beside_places = [("region", s.region.is_some(), s.at.is_empty())];
    source.refuse_unused_keys(section.span(), &beside_places, "beside `at`")?;
    check_phase(source, path, s.period, s.phase)
}

fn check_doors(
    source: &Source,
    section: &Spanned<DoorSection>,
    has_doors: bool,
) -> Result<(), InputError> {
    let s = section.get_ref();
    let without_doors = [("office", s.office, has_doors)];
    let because = "on a map without doors of its own";
    source.refuse_unused_keys(section.span(), &without_doors, because)?;
    let sizes_places = !s.office || !s.at.is_empty();
    let beside_office = [("size", s.size.is_some(), sizes_places)];
    let because = "beside `office`, whose doors have sizes";
    source.refuse_unused_keys(section.span(), &beside_office, because)?;
    let Some(periodic) = &s.periodic else { return Ok(()) };
    let PeriodicSection { open, closed, phase } = *periodic.get_ref();
    let total = open.saturating_add(closed);
    match phase {
        Some(phase) if total > 0 && phase >= total => {
            let cause = format!("phase = {phase}, with a period of {total}");
            let remedy = format!("give 0 to {}, the cycles of the period that are over", total - 1);
            Err(source.error(periodic.span(), cause, remedy))
        }
        _ => Ok(()),
    }
}

/// Refuses a period beside actions of several cycles: such robots begin the next action when the last one has ended.
fn check_action_cycles(source: &Source, path: &str, s: &RobotSection) -> Result<(), InputError> {
    let cycles = super::bodies::action_cycles(s);
    let period = super::bodies::period_cycles(s.period);
    if cycles == 1 || period == 1 {
        return Ok(());
    }
    let cause = format!("action_cycles = {cycles} beside a period of {period}");
    let remedy = "leave out `period`: the next action begins when the last one has ended";
    Err(source.error_at(&format!("{path}action_cycles"), cause, remedy))
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
