//! Remarks on what is given and changes nothing, but may be meant so: sections that nobody uses, tables that another
//! one replaces, behaviors that cannot do what they are for.

use super::super::{
    AvoidanceSection, EffectorSection, PlannerMethod, RobotSection, RobotsFile, TransitionSection,
};
use super::known_tables::{PRESETS, Shadowed};
use super::*;
use crate::effector::STANDARD_ACTIONS;
use std::collections::BTreeSet;

/// The sections of a scenario, with the tables that they may name.
pub(super) struct Given<'a> {
    pub(super) source: &'a Source,
    pub(super) file: &'a RobotsFile,
    pub(super) sensors: &'a Sensors,
    pub(super) effectors: &'a Effectors,
    pub(super) shadowed: &'a [Shadowed],
    pub(super) own: &'a Behaviours,
}

/// Returns the remarks on a scenario, in the order of its sections.
pub(super) fn effectless_remarks(given: &Given<'_>) -> Vec<Remark> {
    let mut remarks = profile_remarks(given);
    remarks.extend(unknown_box_remark(given));
    remarks.extend(kind_remarks(given));
    remarks.extend(unused_tables(given));
    for name in given.effector_names() {
        if let Some(at) = given.effectors.get(name) {
            remarks.extend(action_remarks(given, name, at));
        }
    }
    for name in given.sensor_names() {
        if let Some(at) = given.sensors.get(name) {
            remarks.extend(row_remarks(name, at));
        }
    }
    for (k, section) in given.file.robots.0.iter().enumerate() {
        remarks.extend(behaviour_remarks(given, k, section.get_ref()));
    }
    remarks
}

impl Given<'_> {
    fn robots(&self) -> impl Iterator<Item = &RobotSection> {
        self.file.robots.0.iter().map(Spanned::get_ref)
    }

    /// Returns the effectors that robots have, each once.
    fn effector_names(&self) -> BTreeSet<&str> {
        self.robots().filter_map(|s| Some(s.effector.as_ref()?.get_ref().as_str())).collect()
    }

    /// Returns the sensors that robots have, each once.
    fn sensor_names(&self) -> BTreeSet<&str> {
        self.robots().flat_map(|s| &s.sensors).map(|name| name.get_ref().as_str()).collect()
    }

    /// Returns whether a table stands in the presets, which are for all scenarios.
    fn is_preset<T>(at: &LocatedSection<T>) -> bool {
        at.source.place == PRESETS
    }
}

/// Returns notes on profiles of which nothing is used, and warnings of tables in use that another one replaces.
fn profile_remarks(given: &Given<'_>) -> Vec<Remark> {
    let sensors = given.sensor_names();
    let effectors = given.effector_names();
    let mut used: BTreeSet<&str> = BTreeSet::new();
    used.extend(sensors.iter().filter_map(|name| Some(&*given.sensors.get(*name)?.source.place)));
    used.extend(
        effectors.iter().filter_map(|name| Some(&*given.effectors.get(*name)?.source.place)),
    );
    let mut remarks = Vec::new();
    for (k, profile) in given.file.profiles.iter().enumerate() {
        let place = given.source.path(profile.get_ref()).display().to_string();
        if !used.contains(place.as_str()) {
            let words = "has no effect: no robot has a sensor or an effector of this profile";
            remarks.push(Remark::note(format!("profiles.{k}"), words));
        }
    }
    for Shadowed { profile, what, name, by } in given.shadowed {
        let names = if *what == "sensor" { &sensors } else { &effectors };
        if names.contains(name.as_str()) {
            let words = format!(
                "its {what} `{name}` is not used: {by} has another one of this name, which comes later"
            );
            remarks.push(Remark::warning(format!("profiles.{profile}"), words));
        }
    }
    remarks
}

/// Returns a warning of each effector of a profile that does not say for which boxes it was learned.
fn unknown_box_remark(given: &Given<'_>) -> Vec<Remark> {
    let mut remarks = Vec::new();
    for (k, section) in given.file.robots.0.iter().enumerate() {
        let Some(name) = &section.get_ref().effector else { continue };
        let Some(at) = given.effectors.get(name.get_ref()) else { continue };
        let is_own = at.source.place == given.source.place;
        if is_own || Given::is_preset(at) || at.section.get_ref().box_m.is_some() {
            continue;
        }
        let words = format!(
            "`{}` of {} does not say for which boxes it was learned, and its slips are taken for those of this map: \
             learn it again with --box, or add box_m to it",
            name.get_ref(),
            at.source.place
        );
        remarks.push(Remark::warning(format!("robots.{k}.effector"), words));
    }
    remarks
}

/// Returns notes on observations of kinds that no sensor looks up.
fn kind_remarks(given: &Given<'_>) -> Vec<Remark> {
    let names = given.sensor_names();
    let mut remarks = Vec::new();
    for (kind, section) in &given.file.kinds {
        let mut in_use = names.iter().filter_map(|name| given.sensors.get(*name));
        let is_looked_up = in_use.any(|at| {
            let own = &at.section.get_ref().designates;
            !own.keys().any(|known| known.get_ref() == kind.get_ref())
        });
        if section.observation.is_some() && !is_looked_up {
            let words = if names.is_empty() {
                "has no effect: no robot has a sensor"
            } else {
                "has no effect: each sensor says itself what it takes this kind for (designates)"
            };
            remarks.push(Remark::note(format!("kinds.{}.observation", kind.get_ref()), words));
        }
    }
    remarks
}

/// Returns notes on the scenario's own sensors and effectors that no robot has.
fn unused_tables(given: &Given<'_>) -> Vec<Remark> {
    let sensors = given.sensor_names();
    let effectors = given.effector_names();
    let sensors = given.file.sensors.keys().filter(|name| !sensors.contains(name.as_str()));
    let effectors = given.file.effectors.keys().filter(|name| !effectors.contains(name.as_str()));
    let sensors = sensors.map(|name| format!("sensors.{name}"));
    let keys = sensors.chain(effectors.map(|name| format!("effectors.{name}")));
    keys.map(|key| Remark::note(key, "has no effect: no robot has it")).collect()
}

/// Returns remarks on turns that an effector leaves out, and on actions of its own that nobody takes.
fn action_remarks(
    given: &Given<'_>,
    name: &str,
    at: &LocatedSection<EffectorSection>,
) -> Vec<Remark> {
    if Given::is_preset(at) {
        return Vec::new();
    }
    let actions = &at.section.get_ref().actions;
    let key = format!("effectors.{name}");
    let mut remarks = Vec::new();
    for action in actions.keys().filter(|action| !STANDARD_ACTIONS.contains(&action.as_str())) {
        if !given.robots().any(|s| may_take(given, s, name, action)) {
            let words = format!(
                "`{action}` has no effect: it is an action of its own, and no behavior takes it; {}",
                suggestion(action, &STANDARD_ACTIONS)
            );
            remarks.push(Remark::warning(&key, words));
        }
    }
    let left_out = |action: &str| !actions.contains_key(action);
    match (left_out("left"), left_out("right")) {
        (false, true) => remarks.push(one_sided("right", "left", &key)),
        (true, false) => remarks.push(one_sided("left", "right", &key)),
        (true, true) if errs(actions) => {
            remarks
                .push(Remark::note(&key, "it gives no `left` and no `right`: its turns never err"));
        }
        (true, true) | (false, false) => {}
    }
    remarks
}

/// Returns whether some action may end in several ways.
fn errs(actions: &BTreeMap<String, Spanned<Vec<TransitionSection>>>) -> bool {
    actions.values().any(|transitions| transitions.get_ref().len() > 1)
}

fn one_sided(missing: &str, given: &str, key: &str) -> Remark {
    let words = format!(
        "it gives `{given}` and no `{missing}`, so that turns to this side never err: add {missing} = \
         [{{ p = 1.0, turn = {} }}] if that is meant",
        if missing == "left" { 90 } else { -90 }
    );
    Remark::warning(key, words)
}

/// Returns whether robots of a section have the effector and a behavior that may take the action.
fn may_take(given: &Given<'_>, s: &RobotSection, effector: &str, action: &str) -> bool {
    if s.effector.as_ref().is_none_or(|name| name.get_ref() != effector) {
        return false;
    }
    let Some(behaviour) = s.behaviour.as_ref().map(Spanned::get_ref) else { return false };
    let weights = [&behaviour.weights, &behaviour.weights_after_contact];
    match behaviour.kind.get_ref().as_str() {
        "replay" => behaviour.actions.as_ref().is_some_and(|list| list.iter().any(|a| a == action)),
        "random" => weights.into_iter().flatten().any(|weights| weights.contains_key(action)),
        "external" => true,
        other => given.own.contains_key(other),
    }
}

/// Returns notes on rows of a sensor that no true reading ever has: nothing is never in a class, and things never
/// beyond all of them.
fn row_remarks(name: &str, at: &LocatedSection<SensorSection>) -> Vec<Remark> {
    if Given::is_preset(at) {
        return Vec::new();
    }
    let mut remarks = Vec::new();
    for (class, rows) in &at.section.get_ref().confusion_by_class {
        let is_beyond = class.get_ref() == "beyond";
        let unused = rows.get_ref().keys().find(|row| (row.get_ref() == "nothing") != is_beyond);
        if let Some(row) = unused {
            let words = format!(
                "its row `{}` has no effect: what is truly there is `nothing` beyond all classes, and never elsewhere",
                row.get_ref()
            );
            let key = format!("sensors.{name}.confusion_by_class.{}", class.get_ref());
            remarks.push(Remark::note(key, words));
        }
    }
    remarks
}

/// Returns remarks on a section of robots whose behavior lacks what it needs, or does not use what it has.
fn behaviour_remarks(given: &Given<'_>, k: usize, s: &RobotSection) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let is_joined =
        |other: &RobotSection| other.team.as_ref().is_some_and(|team| *team.get_ref() == s.name);
    let leads_others =
        s.planner.is_some() && given.file.robots.0.iter().any(|other| is_joined(other.get_ref()));
    if s.count.as_ref().is_some_and(|count| *count.get_ref() == 0) && !leads_others {
        remarks.push(Remark::note(format!("robots.{k}"), "has no effect: count = 0"));
        return remarks;
    }
    let behaviour = s.behaviour.as_ref().map(Spanned::get_ref);
    let kind = behaviour.map_or("wander", |b| b.kind.get_ref().as_str());
    let avoidance = behaviour.and_then(|b| b.avoidance);
    let key = format!("robots.{k}.behaviour");
    if kind == "announce" && given.file.radio.is_none() {
        let words = "nobody hears what it announces: add [radio] with range_m = 5.0";
        remarks.push(Remark::warning(&key, words));
    }
    if kind == "external" && !given.own.contains_key(kind) {
        let words = "its robots stand still in a run of the command: their actions come from a program that \
                     uses the library";
        remarks.push(Remark::warning(&key, words));
    }
    let method = s.planner.as_ref().map(|planner| planner.get_ref().method);
    if method == Some(PlannerMethod::External) {
        let words = "its robots stand still in a run of the command: their actions come from a program that \
                     uses the library";
        remarks.push(Remark::warning(format!("robots.{k}.planner.method"), words));
    }
    let goals = behaviour.and_then(|b| b.goals.as_ref()).map_or(0, Vec::len);
    if kind == "goto" && goals == 1 && behaviour.and_then(|b| b.repeat) == Some(true) {
        let words = "a robot at its only goal completes a trip in each cycle, and stays there: give several goals";
        remarks.push(Remark::warning(format!("{key}.repeat"), words));
    }
    let senses = matches!(avoidance, Some(AvoidanceSection::Avoid | AvoidanceSection::Filter));
    if senses && s.sensors.is_empty() {
        let words = "has no effect: it avoids what sensors report, and the robots have none";
        remarks.push(Remark::warning(format!("{key}.avoidance"), words));
    }
    let is_led = s.planner.is_some() || s.team.is_some();
    if is_led && !s.sensors.is_empty() && !given.file.record.calibration {
        let words = "no effect on what the robots do: their planner asks no sensor";
        remarks.push(Remark::note(format!("robots.{k}.sensors"), words));
        return remarks;
    }
    let is_blind =
        ["replay", "random"].contains(&kind) || avoidance == Some(AvoidanceSection::Touch);
    if is_blind && !s.sensors.is_empty() && !given.file.record.calibration {
        let words = format!("no effect on what the robots do: `{kind}` asks no sensor");
        remarks.push(Remark::note(format!("robots.{k}.sensors"), words));
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::StorageOrder;

    /// Compiles a scenario of a small map with these lines, beside the profiles `one.toml` and `two.toml`.
    fn remarks(lines: &str) -> Vec<Remark> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let wheels = "forward = [{ p = 0.9, path = \"F\" }, { p = 0.1 }]\n\
            left = [{ p = 1.0, turn = 90 }]\nright = [{ p = 1.0, turn = -90 }]\n";
        for (name, box_m) in [("one", ""), ("two", "box_m = 0.25\n")] {
            let text = format!(
                "format = 1\nprofile = \"{name}\"\n[effectors.wheels]\n{box_m}{wheels}[effectors.{name}]\n{wheels}"
            );
            std::fs::write(folder.path().join(format!("{name}.toml")), text).expect("writes");
        }
        let text = format!("format = 1\nworld = \"robots\"\n{lines}");
        let source = Source::new("s.toml", text, folder.path());
        let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
        compiled.unwrap_or_else(|e| panic!("{lines}: {e}")).remarks
    }

    fn assert_remark(lines: &str, key: &str, words: &str) {
        let all = remarks(lines);
        let found = all.iter().any(|r| r.key == key && r.words.contains(words));
        assert!(found, "{lines}: {all:?}");
    }

    const MAP: &str = "map.ascii = \"......\"\n";
    const TURNS: &str = "left = [{ p = 1.0, turn = 90 }]\nright = [{ p = 1.0, turn = -90 }]\n";

    #[test]
    fn behaviors_that_cannot_do_what_they_are_for_are_warned_of() {
        let robots =
            |behaviour: &str| format!("{MAP}[robots]\ncount = 2\nbehaviour = {{ {behaviour} }}\n");
        assert_remark(&robots("kind = \"announce\""), "robots.0.behaviour", "[radio]");
        assert_remark(&robots("kind = \"external\""), "robots.0.behaviour", "stand still");
        let goes = "kind = \"goto\", goals = [[0, 0]], avoidance = \"avoid\"";
        assert_remark(&robots(goes), "robots.0.behaviour.avoidance", "have none");
        let random = format!("{}sensors = [\"bumper-4\"]\n", robots("kind = \"random\""));
        assert_remark(&random, "robots.0.sensors", "asks no sensor");
        let once =
            |more: &str| robots(&format!("kind = \"goto\", goals = [[5, 0]{more}], repeat = true"));
        assert_remark(&once(""), "robots.0.behaviour.repeat", "completes a trip in each cycle");
        assert_eq!(remarks(&once(", [0, 0]")), []);
        let radio = format!("{}[radio]\nrange_m = 2.0\n", robots("kind = \"announce\""));
        assert_eq!(remarks(&radio), []);
        assert_eq!(remarks(&robots("kind = \"wander\"")), []);
    }

    #[test]
    fn an_effector_that_lacks_a_side_and_an_action_that_nobody_takes_are_warned_of() {
        let wheels = |actions: &str| {
            format!(
                "{MAP}[robots]\ncount = 1\neffector = \"w\"\n[effectors.w]\n\
                 forward = [{{ p = 0.9, path = \"F\" }}, {{ p = 0.1 }}]\n{actions}"
            )
        };
        let left = "left = [{ p = 0.9, turn = 90 }, { p = 0.1 }]\n";
        assert_remark(&wheels(left), "effectors.w", "no `right`");
        assert_remark(&wheels(""), "effectors.w", "its turns never err");
        let slip = format!("{left}rigth = [{{ p = 1.0, turn = -90 }}]\n");
        assert_remark(&wheels(&slip), "effectors.w", "did you mean `right`?");
        assert_eq!(remarks(&wheels(TURNS)), []);
    }

    #[test]
    fn tables_that_nobody_uses_or_that_another_replaces_are_named() {
        let robots = format!("{MAP}[robots]\ncount = 1\neffector = \"wheels\"\n");
        let with = |profiles: &str| format!("profiles = [{profiles}]\n{robots}");
        assert_remark(&with("\"one.toml\""), "robots.0.effector", "does not say for which boxes");
        assert_eq!(remarks(&with("\"two.toml\"")), []);
        assert_remark(&with("\"one.toml\", \"two.toml\""), "profiles.0", "which comes later");
        assert_remark(&with("\"one.toml\", \"two.toml\""), "profiles.0", "no robot has a sensor");
        let own = format!(
            "{MAP}[robots]\ncount = 1\n[effectors.spare]\nforward = [{{ p = 1.0, path = \"F\" }}]\n"
        );
        assert_remark(&own, "effectors.spare", "no robot has it");
        let kind = format!(
            "{MAP}[kinds.cart]\nobservation = \"robot\"\n[robots]\ncount = 1\nkind = \"cart\"\n"
        );
        assert_remark(&kind, "kinds.cart.observation", "no robot has a sensor");
    }

    #[test]
    fn a_rule_about_unknown_boxes_of_a_map_that_is_known_is_named() {
        let map = |art: &str| {
            format!("map.ascii = \"{art}\"\nmap.unknown = \"free\"\n[robots]\ncount = 1\n")
        };
        assert_remark(&map("......"), "map.unknown", "nothing of the map is unknown");
        assert_eq!(remarks(&map("....?.")), []);
    }

    #[test]
    fn rows_that_no_true_reading_has_are_named() {
        let eye = "bearings_deg = [0]\nrange_m = 2.0\nobservations = [\"nothing\", \"wall\"]\n\
            designates = { door = \"wall\", person = \"wall\", robot = \"wall\" }\n\
            distance_edges_m = [1.0]\ndistance_classes = [\"near\", \"far\"]\n\
            confusion = { nothing = [1.0, 0.0], wall = [0.0, 1.0] }\n";
        let by_class = |class: &str, row: &str| {
            format!(
                "{MAP}[robots]\ncount = 1\nsensors = [\"eye\"]\n[sensors.eye]\n{eye}\
                 [sensors.eye.confusion_by_class.{class}]\n{row} = [0.5, 0.5]\n"
            )
        };
        let key = |class: &str| format!("sensors.eye.confusion_by_class.{class}");
        assert_remark(&by_class("near", "nothing"), &key("near"), "`nothing` has no effect");
        assert_remark(&by_class("beyond", "wall"), &key("beyond"), "`wall` has no effect");
        assert_eq!(remarks(&by_class("near", "wall")), []);
    }
}
