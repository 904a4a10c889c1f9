//! What a URDF says that is neither kinematics nor a collision shape: named, with its places.

use super::JointKind;
use super::numbers::MAX_COORDINATE;
use super::xacro;
use crate::xml::Element;
use crate::{ImportReport, Treatment};

/// Attributes of the elements whose numbers are read, and those that mean nothing for kinematics.
const KNOWN_ATTRIBUTES: [(&str, &[&str]); 7] = [
    ("axis", &["xyz"]),
    ("child", &["link"]),
    ("limit", &["lower", "upper", "velocity", "effort"]),
    ("mimic", &["joint", "multiplier", "offset"]),
    ("origin", &["xyz", "rpy", "quat_xyzw"]),
    ("parent", &["link"]),
    ("safety_controller", &["soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"]),
];

/// Elements of a joint that are read.
const JOINT_PARTS: [&str; 7] =
    ["axis", "child", "limit", "mimic", "origin", "parent", "safety_controller"];

/// Elements of a link that are read, or that the whole report speaks of.
const LINK_PARTS: [&str; 3] = ["collision", "inertial", "visual"];

/// Elements of a collision shape that are read; a name or a color means nothing.
const COLLISION_PARTS: [&str; 4] = ["geometry", "material", "name", "origin"];

/// Records the parts of a robot that are neither links nor joints: simulators, controllers and sensors. Colors are no
/// news.
pub(super) fn record_elements_of_robot(robot: Element, report: &mut ImportReport) {
    record_parts(robot, &["link", "joint", "material"], "", report);
    report.add_fact("not read", "visual shapes, masses and inertias");
}

/// Records what a joint says in elements and attributes that are not read.
pub(super) fn record_joint(joint: Element, kind: JointKind, report: &mut ImportReport) {
    record_attributes(joint, report);
    record_parts(joint, &JOINT_PARTS, " of joints", report);
    let word = match kind {
        JointKind::Floating => "floating",
        JointKind::Planar => "planar",
        JointKind::Fixed | JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => {
            return;
        }
    };
    let rule = format!("the motion of {word} joints: what they carry stands at their origin");
    report.record(Treatment::NotUsed, rule, joint.line(), "");
}

/// Records what a link says in elements that are not read, and masses that none can have.
pub(super) fn record_link(link: Element, report: &mut ImportReport) {
    record_parts(link, &LINK_PARTS, " of links", report);
    for inertial in link.children("inertial") {
        for value in inertial.children("mass").filter_map(|mass| mass.attribute("value")) {
            match value.number() {
                Ok(mass_kg) if mass_kg > 0.0 => continue,
                Ok(0.0) => {
                    let rule = "masses of 0, which simulators of forces refuse";
                    report.record(Treatment::Suspicious, rule, value.line(), "");
                }
                _ => {
                    let rule = format!("a mass of `{}` kg", value.text());
                    report.record(Treatment::Suspicious, rule, value.line(), "");
                }
            }
        }
    }
}

/// Records what a collision shape says in elements and attributes that are not read.
pub(super) fn record_collision(collision: Element, report: &mut ImportReport) {
    record_attributes(collision, report);
    record_parts(collision, &COLLISION_PARTS, " of collision shapes", report);
    for geometry in collision.children("geometry") {
        let mut shapes = geometry.child_elements().filter(Element::is_of_format);
        let first = shapes.next();
        for second in shapes {
            let rule = "a second shape in one <geometry>";
            let remedy = "give each shape a <collision> of its own";
            report.record(Treatment::Dropped, rule, second.line(), remedy);
        }
        for foreign in geometry.child_elements().filter(|shape| !shape.is_of_format()) {
            if !xacro::is_macro(&foreign) {
                let rule = format!("collision shapes <{}>", full_name(&foreign));
                report.record(Treatment::NotUsed, rule, foreign.line(), "");
            }
        }
        if first.is_none() && geometry.child_elements().next().is_none() {
            let rule = "collision shapes that are empty";
            report.record(Treatment::Dropped, rule, geometry.line(), "");
        }
    }
}

fn record_parts(parent: Element, read: &[&str], whose: &str, report: &mut ImportReport) {
    for element in parent.child_elements() {
        let is_read = element.is_of_format() && read.contains(&element.name());
        if !is_read && !xacro::is_macro(&element) {
            let rule = format!("elements <{}>{whose}", full_name(&element));
            report.record(Treatment::NotUsed, rule, element.line(), "");
        }
    }
}

fn full_name(element: &Element) -> String {
    let prefix = element.prefix().map_or(String::new(), |prefix| format!("{prefix}:"));
    format!("{prefix}{}", element.name())
}

fn record_attributes(parent: Element, report: &mut ImportReport) {
    for (name, known) in KNOWN_ATTRIBUTES {
        for element in parent.children(name) {
            for value in element.attributes().filter(|value| !known.contains(&value.name())) {
                let rule = format!("`{}` of <{name}>", value.name());
                report.record(Treatment::NotUsed, rule, element.line(), "");
            }
        }
    }
}

/// The largest angle of an origin, with room for rounding.
const MAX_ANGLE_RAD: f64 = std::f64::consts::TAU + 1e-3;

/// Ten turns: the largest limit of a joint that turns and is not given in degrees.
const MAX_LIMIT_RAD: f64 = 10.0 * std::f64::consts::TAU;

/// A length of the parts of a robot beyond which its file is in millimeters.
const MAX_LENGTH_M: f64 = 100.0;

/// Records lengths and angles that no robot has in the units of the format.
pub(super) fn record_units_of_origin(
    origin: Element,
    [xyz_m, rpy_rad]: [[f64; 3]; 2],
    report: &mut ImportReport,
) {
    if xyz_m.iter().any(|x| x.abs() > MAX_LENGTH_M) {
        let rule = format!("origins beyond {MAX_LENGTH_M} m, which look like millimeters");
        report.record(Treatment::Suspicious, rule, origin.line(), "URDF has meters");
    }
    if rpy_rad.iter().any(|angle| angle.abs() > MAX_ANGLE_RAD) {
        let rule = "angles of more than a turn, which look like degrees";
        report.record(Treatment::Suspicious, rule, origin.line(), "URDF has radians");
    }
}

/// Records limits that no joint has in the units of the format.
pub(super) fn record_units_of_limits(
    limit: Element,
    kind: JointKind,
    bounds: [f64; 2],
    report: &mut ImportReport,
) {
    let is_beyond = |most: f64| {
        bounds.iter().any(|bound| (most..=MAX_COORDINATE).contains(&bound.abs()) && *bound != most)
    };
    if kind == JointKind::Revolute && is_beyond(MAX_LIMIT_RAD) {
        let rule = "limits of more than ten turns, which look like degrees";
        report.record(Treatment::Suspicious, rule, limit.line(), "URDF has radians");
    }
    if kind == JointKind::Prismatic && is_beyond(MAX_LENGTH_M) {
        let rule = format!("limits beyond {MAX_LENGTH_M} m, which look like millimeters");
        report.record(Treatment::Suspicious, rule, limit.line(), "URDF has meters");
    }
}
