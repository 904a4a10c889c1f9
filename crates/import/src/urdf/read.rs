//! URDF text -> [`Model`].

use super::limits::LimitedJoint;
use super::numbers::{MAX_COORDINATE, bounded, bounded_number};
use super::{Collision, Joint, JointKind, Mimic, Model, Shape};
use super::{origin, tree, unused, xacro};
use crate::xml::{Element, XmlAttribute, XmlFile, XmlSource};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// The versions of the format that are known. The second adds quaternions and capsules.
const VERSIONS: [&str; 2] = ["1.0", "1.1"];

/// The joint types by their names in files.
const JOINT_KINDS: [(&str, JointKind); 6] = [
    ("fixed", JointKind::Fixed),
    ("revolute", JointKind::Revolute),
    ("continuous", JointKind::Continuous),
    ("prismatic", JointKind::Prismatic),
    ("floating", JointKind::Floating),
    ("planar", JointKind::Planar),
];

/// The maximum number of links, far above that of any known robot.
const MAX_LINKS: usize = 10_000;

/// The minimum length of an axis; a shorter one has no reliable direction.
const MIN_AXIS: f64 = 1e-6;

/// Largest error of the length of an axis with few digits.
const LENGTH_TOLERANCE: f64 = 1e-2;

pub(super) fn model(place: &str, text: &str) -> Result<Model, InputError> {
    let source = XmlSource::new(place, text)?;
    let file = XmlFile::parse(&source)?;
    let robot = file.root("robot")?;
    let mut report = ImportReport::new("URDF");
    source.record_undeclared(&mut report);
    unused::record_elements_of_robot(robot, &mut report);
    xacro::check(robot, &mut report)?;
    check_version(robot, &mut report);
    let name = robot.required("name")?.text().to_owned();
    let all_links = links(robot)?;
    let elements: Vec<_> = robot.children("joint").collect();
    let mut joints = Vec::with_capacity(elements.len());
    let mut names = tree::Names::default();
    for &element in &elements {
        let joint = joint(element, &all_links, &mut report)?;
        names.add(&joint.name, joints.len()).map_err(|name| {
            element.error(format!("a second joint `{name}`"), "give each joint a name of its own")
        })?;
        joints.push(joint);
    }
    read_mimics(&elements, &mut joints, &names)?;
    let links = all_links.without_separate(&mut joints, &mut report);
    let root = tree::root(&links.elements, &elements, &links.in_order, &joints)?;
    let mut collisions = Vec::with_capacity(links.in_order.len());
    for link in &links.elements {
        collisions.push(link_collisions(*link, &mut report)?);
    }
    report.add_kept("links", links.in_order.len());
    report.add_kept("joints", joints.len());
    let unreported = ImportReport::default();
    let links = links.in_order;
    let mut model = Model { name, links, collisions, joints, root, report: unreported };
    // The last finding is about the model itself.
    model.record_tip(&mut report);
    model.report = report;
    Ok(model)
}

/// Names the version in the report. Files of a version that is not known are read as the latest one that is.
fn check_version(robot: Element, report: &mut ImportReport) {
    let Some(version) = robot.attribute("version") else { return };
    report.format = format!("URDF {}", version.text());
    if !VERSIONS.contains(&version.text()) {
        let rule = format!("version `{}`, read as 1.1", version.text());
        report.record(Treatment::Suspicious, rule, robot.line(), "");
    }
}

/// The links and the positions of their names.
struct Links<'a> {
    in_order: Vec<String>,
    elements: Vec<Element<'a>>,
    names: tree::Names,
}

impl Links<'_> {
    /// Leaves out links that no joint connects to others, and records them. They are no second robot: drawings and
    /// frames that nobody mounted. A model without joints keeps all.
    fn without_separate(self, joints: &mut [Joint], report: &mut ImportReport) -> Self {
        let mut is_kept = vec![joints.is_empty(); self.in_order.len()];
        for joint in &*joints {
            is_kept[joint.parent] = true;
            is_kept[joint.child] = true;
        }
        let mut kept =
            Self { in_order: Vec::new(), elements: Vec::new(), names: tree::Names::default() };
        let mut new_index = Vec::with_capacity(is_kept.len());
        for (link, name) in self.in_order.into_iter().enumerate() {
            let element = self.elements[link];
            new_index.push(kept.in_order.len());
            if is_kept[link] {
                kept.in_order.push(name);
                kept.elements.push(element);
                continue;
            }
            let rule = "links that no joint connects to the robot";
            let place = format!("`{name}` at {}", element.line());
            report.record(Treatment::Dropped, rule, place, "add a joint with it as the child");
        }
        for joint in joints {
            joint.parent = new_index[joint.parent];
            joint.child = new_index[joint.child];
        }
        kept
    }

    fn link_in_attribute(&self, element: Element) -> Result<usize, InputError> {
        let value = element.required("link")?;
        self.names.get(value.text()).ok_or_else(|| {
            let known: Vec<&str> = self.in_order.iter().map(String::as_str).collect();
            let cause = format!("there is no link `{}`", value.text());
            value.error(cause, suggestion(value.text(), &known))
        })
    }
}

fn links<'a>(robot: Element<'a>) -> Result<Links<'a>, InputError> {
    let mut links =
        Links { in_order: Vec::new(), elements: Vec::new(), names: tree::Names::default() };
    for element in robot.children("link") {
        let name = element.required("name")?.text();
        links.names.add(name, links.in_order.len()).map_err(|name| {
            element.error(format!("a second link `{name}`"), "give each link a name of its own")
        })?;
        links.in_order.push(name.to_owned());
        links.elements.push(element);
    }
    if links.in_order.len() > MAX_LINKS {
        let cause = format!("has {} links, more than {MAX_LINKS}", links.in_order.len());
        return Err(robot.error(cause, "check that this is the right file"));
    }
    if links.in_order.is_empty() {
        return Err(robot.error("the robot has no links", "add <link name=\"...\"/>"));
    }
    Ok(links)
}

/// Reads the shapes of a link that count for collisions.
fn link_collisions(link: Element, report: &mut ImportReport) -> Result<Vec<Collision>, InputError> {
    unused::record_link(link, report);
    let mut collisions = Vec::new();
    for element in link.children("collision") {
        unused::record_collision(element, report);
        // Empty elements, and those of other programs, are no shapes.
        if let Some(kind) = element.child("geometry")?.and_then(Element::first_child) {
            let origin = origin::read(element, report)?;
            let shape = shape(kind)?;
            if let Shape::Other { kind: name } = &shape {
                let rule = format!("collision shapes <{name}>");
                report.record(Treatment::NotUsed, rule, kind.line(), "");
            }
            collisions.push(Collision { origin, shape });
        }
    }
    Ok(collisions)
}

fn shape(element: Element) -> Result<Shape, InputError> {
    Ok(match element.name() {
        "sphere" => Shape::Sphere { radius_m: length_m(element.required("radius")?)? },
        "cylinder" => Shape::Cylinder {
            radius_m: length_m(element.required("radius")?)?,
            length_m: length_m(element.required("length")?)?,
        },
        "box" => {
            let value = element.required("size")?;
            let size_m = value.triple()?;
            size_m.into_iter().try_for_each(|x| check_length(&value, x))?;
            Shape::Box { size_m }
        }
        "mesh" => Shape::Mesh {
            file: element.required("filename")?.text().to_owned(),
            scale: element.attribute("scale").map_or(Ok([1.0; 3]), bounded)?,
        },
        kind => Shape::Other { kind: kind.to_owned() },
    })
}

/// Reads a length, which is not negative.
fn length_m(value: XmlAttribute) -> Result<f64, InputError> {
    let length_m = value.number()?;
    check_length(&value, length_m)?;
    Ok(length_m)
}

fn check_length(value: &XmlAttribute, length_m: f64) -> Result<(), InputError> {
    if (0.0..=MAX_COORDINATE).contains(&length_m) {
        return Ok(());
    }
    let cause = format!("{length_m} m is no length");
    Err(value.error(cause, format!("give meters from 0 to {MAX_COORDINATE:e}")))
}

fn joint(element: Element, links: &Links, report: &mut ImportReport) -> Result<Joint, InputError> {
    let name = element.required("name")?.text().to_owned();
    let kind = kind(element.required("type")?)?;
    let limited = LimitedJoint { element, kind };
    unused::record_joint(element, kind, report);
    Ok(Joint {
        name,
        kind,
        parent: links.link_in_attribute(element.required_child("parent")?)?,
        child: links.link_in_attribute(element.required_child("child")?)?,
        origin: origin::read(element, report)?,
        axis: axis(element, kind, report)?,
        limits: limited.range(report)?,
        max_speed: limited.max_speed(report)?,
        mimic: None,
    })
}

fn kind(value: XmlAttribute) -> Result<JointKind, InputError> {
    let entry = JOINT_KINDS.iter().find(|(name, _)| *name == value.text());
    entry.map(|(_, kind)| *kind).ok_or_else(|| {
        let cause = format!("there are no `{}` joints", value.text());
        value.error(cause, suggestion(value.text(), &JOINT_KINDS.map(|(name, _)| name)))
    })
}

/// Reads the axis of a joint. Files give fixed joints a zero axis, which means nothing and is not
/// read.
fn axis(
    joint: Element,
    kind: JointKind,
    report: &mut ImportReport,
) -> Result<[f64; 3], InputError> {
    const DEFAULT: [f64; 3] = [1.0, 0.0, 0.0];
    if !kind.has_one_value() && kind != JointKind::Planar {
        return Ok(DEFAULT);
    }
    let Some(element) = joint.child("axis")? else { return Ok(DEFAULT) };
    let value = element.required("xyz")?;
    let [x, y, z] = bounded(value)?;
    let length = (x * x + y * y + z * z).sqrt();
    if length < MIN_AXIS {
        let cause = "the axis has no direction";
        return Err(value.error(cause, "write a vector that is not zero, e.g. \"0 0 1\""));
    }
    if (length - 1.0).abs() > LENGTH_TOLERANCE {
        let rule = "axes whose length is not 1, of which the direction counts";
        report.record(Treatment::Repaired, rule, element.line(), "");
    }
    Ok([x / length, y / length, z / length])
}

fn read_mimics(
    elements: &[Element],
    joints: &mut [Joint],
    names: &tree::Names,
) -> Result<(), InputError> {
    for (i, &joint) in elements.iter().enumerate() {
        let Some(element) = joint.child("mimic")? else { continue };
        let value = element.required("joint")?;
        let driver = names.get(value.text()).ok_or_else(|| {
            let known: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
            let cause = format!("there is no joint `{}`", value.text());
            value.error(cause, suggestion(value.text(), &known))
        })?;
        if !joints[i].kind.has_one_value() || !joints[driver].kind.has_one_value() {
            let cause = "a joint that cannot move takes part in a mimicry";
            return Err(value.error(cause, "give joints with one value each"));
        }
        let number = |name, default| element.attribute(name).map_or(Ok(default), bounded_number);
        joints[i].mimic = Some(Mimic {
            joint: driver,
            multiplier: number("multiplier", 1.0)?,
            offset: number("offset", 0.0)?,
        });
    }
    for i in 0..joints.len() {
        if tree::has_mimic_cycle(joints, i) {
            let cause = format!("`{}` mimics itself in a circle", joints[i].name);
            return Err(elements[i].error(cause, "remove one <mimic> of the circle"));
        }
    }
    Ok(())
}
