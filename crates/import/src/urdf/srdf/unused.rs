//! Elements and attributes of an SRDF that are not read: named, with their places.

use crate::xml::Element;
use crate::{ImportReport, Treatment};

/// An element that is read: its name, its attributes and the elements in it.
struct KnownElement {
    name: &'static str,
    attributes: &'static [&'static str],
    parts: &'static [KnownElement],
}

const fn known(
    name: &'static str,
    attributes: &'static [&'static str],
    parts: &'static [KnownElement],
) -> KnownElement {
    KnownElement { name, attributes, parts }
}

const KNOWN: [KnownElement; 6] = [
    known(
        "group",
        &["name"],
        &[
            known("chain", &["base_link", "tip_link"], &[]),
            known("group", &["name"], &[]),
            known("joint", &["name"], &[]),
            known("link", &["name"], &[]),
        ],
    ),
    known("group_state", &["name", "group"], &[known("joint", &["name", "value"], &[])]),
    known("end_effector", &["name", "parent_link", "group"], &[]),
    known("disable_collisions", &["link1", "link2", "reason"], &[]),
    known("enable_collisions", &["link1", "link2", "reason"], &[]),
    known("disable_default_collisions", &["link"], &[]),
];

/// Elements that mean something to `MoveIt`, and what is done instead.
const MEANINGS: [(&str, &str); 4] = [
    ("joint_property", ""),
    ("link_sphere_approximation", ", in place of which the shapes of the URDF count"),
    ("passive_joint", ", whose joints move like all others"),
    ("virtual_joint", ": the robot stands where its base is placed"),
];

/// Records all elements and attributes that are not read.
pub(super) fn record_unused(robot: Element, report: &mut ImportReport) {
    record_parts(robot, &KNOWN, report);
}

fn record_parts(parent: Element, known: &[KnownElement], report: &mut ImportReport) {
    for element in parent.child_elements() {
        if super::super::xacro::is_macro(&element) {
            continue;
        }
        let of_this_name =
            known.iter().find(|it| it.name == element.name() && element.is_of_format());
        let Some(it) = of_this_name else {
            record_element(element, report);
            continue;
        };
        for value in element.attributes().filter(|value| !it.attributes.contains(&value.name())) {
            let rule = format!("`{}` of <{}>", value.name(), it.name);
            report.record(Treatment::NotUsed, rule, element.line(), "");
        }
        record_parts(element, it.parts, report);
    }
}

fn record_element(element: Element, report: &mut ImportReport) {
    let prefix = element.prefix().map_or(String::new(), |prefix| format!("{prefix}:"));
    let name = element.name();
    let meaning = MEANINGS.iter().find(|(known, _)| *known == name && element.is_of_format());
    let meaning = meaning.map_or("", |(_, meaning)| meaning);
    let rule = format!("elements <{prefix}{name}>{meaning}");
    report.record(Treatment::NotUsed, rule, element.line(), "");
}
