//! Macros that a URDF still has: refused where they may change the joints, else left out and said.
//!
//! Published models are often expanded in part: macros of one program stay in shapes and in sections of a simulator,
//! and no longer mean anything there.

use crate::xml::{Element, XmlAttribute};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;

pub(super) const CAUSE: &str = "is xacro, macros that have to become URDF first";
pub(super) const REMEDY: &str = "expand it with ROS: xacro FILE.urdf.xacro > FILE.urdf";

/// The remedy where the rest of the file is URDF: expanding it again does not help with an unknown macro.
const REMEDY_INSIDE: &str = "expand it with ROS: xacro FILE.urdf.xacro > FILE.urdf, or remove it if it is none of the \
                             robot's links and joints";

/// Macros that define something for others, and add nothing where they stand.
pub(super) const DEFINITIONS: [&str; 3] = ["arg", "macro", "property"];

/// Parts of a joint that kinematics reads.
const KINEMATIC_PARTS: [&str; 7] =
    ["axis", "child", "limit", "mimic", "origin", "parent", "safety_controller"];

/// Attributes in these parts that kinematics does not read.
const UNUSED_ATTRIBUTES: [&str; 3] = ["effort", "k_position", "k_velocity"];

/// Attributes of shapes that may stay macros: names mean nothing, and a mesh that is not found is said later.
const UNUSED_SHAPE_ATTRIBUTES: [&str; 2] = ["filename", "name"];

/// Refuses macros that may add links and joints or change them, and records all others.
pub(super) fn check(robot: Element, report: &mut ImportReport) -> Result<(), InputError> {
    refuse_expressions(robot, &[], report)?;
    for element in robot.child_elements() {
        if is_macro(&element) {
            check_macro_of_robot(element, report)?;
            continue;
        }
        match (element.is_of_format(), element.name()) {
            (true, "joint") => check_joint(element, report)?,
            (true, "link") => check_link(element, report)?,
            _ => record_all(element, report),
        }
    }
    Ok(())
}

/// Returns whether an element is a macro: by its prefix, which need not be declared, or by what it stands for.
pub(super) fn is_macro(element: &Element) -> bool {
    let Some(prefix) = element.prefix() else { return false };
    let is_address = element.namespace().is_some_and(|address| address.contains("xacro"));
    prefix == "xacro" || is_address
}

pub(super) fn is_expression(value: &XmlAttribute) -> bool {
    value.text().contains("${") || value.text().contains("$(")
}

fn check_macro_of_robot(element: Element, report: &mut ImportReport) -> Result<(), InputError> {
    if !DEFINITIONS.contains(&element.name()) {
        return Err(element.error(CAUSE, REMEDY_INSIDE));
    }
    let rule = "definitions of xacro, which nothing uses";
    report.record(Treatment::Dropped, rule, element.line(), "");
    Ok(())
}

fn check_joint(joint: Element, report: &mut ImportReport) -> Result<(), InputError> {
    refuse_expressions(joint, &[], report)?;
    for part in joint.child_elements() {
        if is_macro(&part) {
            return Err(part.error(CAUSE, REMEDY_INSIDE));
        }
        if !part.is_of_format() || !KINEMATIC_PARTS.contains(&part.name()) {
            record_all(part, report);
            continue;
        }
        refuse_expressions(part, &UNUSED_ATTRIBUTES, report)?;
    }
    Ok(())
}

fn check_link(link: Element, report: &mut ImportReport) -> Result<(), InputError> {
    refuse_expressions(link, &[], report)?;
    for part in link.child_elements() {
        if !part.is_of_format() || part.name() != "collision" {
            record_all(part, report);
            continue;
        }
        for element in part.descendants() {
            if is_macro(&element) {
                record_macro(&element, report);
            } else {
                refuse_expressions(element, &UNUSED_SHAPE_ATTRIBUTES, report)?;
            }
        }
    }
    Ok(())
}

/// Refuses attributes of an element whose values are still expressions, and records those that are not read.
fn refuse_expressions(
    element: Element,
    unused: &[&str],
    report: &mut ImportReport,
) -> Result<(), InputError> {
    for value in element.attributes().filter(is_expression) {
        if !unused.contains(&value.name()) {
            return Err(value.error(CAUSE, REMEDY));
        }
        record_expression(element, report);
    }
    Ok(())
}

fn record_all(element: Element, report: &mut ImportReport) {
    for element in element.descendants() {
        if is_macro(&element) {
            record_macro(&element, report);
        }
        for _ in element.attributes().filter(is_expression) {
            record_expression(element, report);
        }
    }
}

fn record_macro(element: &Element, report: &mut ImportReport) {
    let rule = "macros of xacro inside other elements, where shapes may be missing now";
    let remedy = "expand the file with xacro if collisions count";
    report.record(Treatment::Dropped, rule, element.line(), remedy);
}

fn record_expression(element: Element, report: &mut ImportReport) {
    let rule = "expressions of xacro in values that are not read";
    report.record(Treatment::Dropped, rule, element.line(), "");
}

#[cfg(test)]
mod tests {
    use crate::urdf::Model;

    const ROBOT: &str = r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<link name="base">LINK</link><link name="hand"/>
<joint name="j" type="prismatic"><parent link="base"/><child link="hand"/>
<origin xyz="1 0 0"/><limit lower="0" upper="1" LIMIT/>JOINT</joint>
ROBOT
</robot>"#;

    fn read(place: &str, text: &str) -> Result<Model, String> {
        let mut robot = ROBOT.to_owned();
        for known in ["LINK", "LIMIT", "JOINT", "ROBOT"] {
            robot = robot.replace(known, if known == place { text } else { "" });
        }
        Model::parse("f", &robot).map_err(|error| error.to_string())
    }

    #[test]
    fn xacro_that_joints_do_not_need_is_left_out_and_said() {
        let plain = read("", "").expect("a model");
        let unused = [
            (
                "LINK",
                "<visual><geometry><box size=\"1 1 1\"/></geometry><xacro:grey/></visual>",
                "macros",
            ),
            ("LINK", "<xacro:inertia m=\"1\"/>", "macros"),
            ("LINK", "<visual><origin xyz=\"${x} 0 0\"/></visual>", "expressions"),
            ("LINK", "<inertial><mass value=\"$(arg m)\"/></inertial>", "expressions"),
            ("LINK", "<collision><geometry><xacro:hull/></geometry></collision>", "macros"),
            ("LIMIT", "effort=\"${e}\"", "expressions"),
            ("JOINT", "<dynamics damping=\"${d}\"/>", "expressions"),
            ("ROBOT", "<gazebo><xacro:sensor/></gazebo>", "macros"),
            ("ROBOT", "<xacro:property name=\"pi\" value=\"3.14\"/>", "definitions"),
            ("ROBOT", "<xacro:macro name=\"m\"><link name=\"${n}\"/></xacro:macro>", "definitions"),
        ];
        for (place, text, rule) in unused {
            let model = read(place, text).expect(text);
            assert_eq!((&model.joints, &model.links), (&plain.joints, &plain.links), "{text}");
            let said = model.report.findings.iter().any(|finding| finding.rule.starts_with(rule));
            assert!(said, "{text}: {:?}", model.report);
        }
        let mesh =
            "<collision><geometry><mesh filename=\"$(find p)/m.stl\"/></geometry></collision>";
        let model = read("LINK", mesh).expect("a model");
        assert_eq!(model.collisions[0].len(), 1);
        assert_eq!(model.report.dropped(), 1);
    }

    #[test]
    fn xacro_that_may_change_joints_is_refused() {
        let needed = [
            ("ROBOT", "<xacro:arm prefix=\"left\"/>"),
            ("ROBOT", "<xacro:include filename=\"arm.xacro\"/>"),
            ("ROBOT", "<xacro:if value=\"1\"><link name=\"x\"/></xacro:if>"),
            ("ROBOT", "<link name=\"${x}\"/>"),
            ("JOINT", "<xacro:axis/>"),
            ("JOINT", "<axis xyz=\"0 0 ${z}\"/>"),
            ("LIMIT", "velocity=\"${v}\""),
            ("LINK", "<collision><origin xyz=\"${x} 0 0\"/></collision>"),
        ];
        for (place, text) in needed {
            let error = read(place, text).expect_err(text);
            assert!(error.contains("is xacro") && error.contains("xacro FILE"), "{error}");
        }
    }
}
