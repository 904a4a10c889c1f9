//! SRDF text -> [`Semantics`].

use super::super::{JointKind, Model, xacro};
use super::unused::record_unused;
use super::{DisabledCollision, EndEffector, Group, NamedPosture, Semantics};
use crate::xml::{Element, XmlAttribute, XmlFile, XmlSource};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

pub(super) const XACRO_REMEDY: &str = "expand it with ROS: xacro FILE.srdf.xacro > FILE.srdf";

pub(super) fn semantics(place: &str, text: &str, model: &Model) -> Result<Semantics, InputError> {
    let source = XmlSource::new(place, text)?;
    let file = XmlFile::parse(&source)?;
    let robot = file.root("robot")?;
    let mut report = ImportReport::new("SRDF");
    source.record_undeclared(&mut report);
    check_xacro(robot, &mut report)?;
    check_robot_name(robot, model, &mut report);
    record_unused(robot, &mut report);
    let mut reader = SrdfReader { robot, model, report };
    let groups = reader.groups()?;
    let postures = reader.postures(&groups)?;
    let end_effectors = reader.end_effectors(&groups)?;
    let disabled_collisions = reader.disabled_collisions()?;
    let enabled_collisions = reader.pairs("enable_collisions")?;
    let default_disabled_links = reader.default_disabled_links()?;
    let mut report = reader.report;
    report.add_kept("groups", groups.len());
    report.add_kept("postures", postures.len());
    report.add_kept("pairs of links that may touch", disabled_collisions.len());
    report.add_kept("links that may touch by default", default_disabled_links.len());
    Ok(Semantics {
        groups,
        postures,
        end_effectors,
        disabled_collisions,
        default_disabled_links,
        enabled_collisions: enabled_collisions.into_iter().map(|(pair, _)| pair).collect(),
        report,
    })
}

/// Refuses macros, which may add groups and pairs; definitions alone add nothing.
fn check_xacro(robot: Element, report: &mut ImportReport) -> Result<(), InputError> {
    for element in robot.child_elements() {
        if xacro::is_macro(&element) {
            if !xacro::DEFINITIONS.contains(&element.name()) {
                return Err(element.error(xacro::CAUSE, XACRO_REMEDY));
            }
            let rule = "definitions of xacro, which nothing uses";
            report.record(Treatment::Dropped, rule, element.line(), "");
            continue;
        }
        for part in element.descendants() {
            if xacro::is_macro(&part) {
                return Err(part.error(xacro::CAUSE, XACRO_REMEDY));
            }
            if let Some(value) = part.attributes().find(xacro::is_expression) {
                return Err(value.error(xacro::CAUSE, XACRO_REMEDY));
            }
        }
    }
    Ok(())
}

/// Records that the file is of another robot: a mistake, or a robot that was renamed.
fn check_robot_name(robot: Element, model: &Model, report: &mut ImportReport) {
    let Some(name) = robot.attribute("name").filter(|name| name.text() != model.name) else {
        return;
    };
    let rule = format!("the robot is `{}` here, and `{}` in the URDF", name.text(), model.name);
    let remedy = "check that both files are of the same robot";
    report.record(Treatment::Suspicious, rule, robot.line(), remedy);
}

/// Two links, as indices of the model's links, and the reason that is given for them.
type LinkPair = ((usize, usize), String);

struct SrdfReader<'a> {
    robot: Element<'a>,
    model: &'a Model,
    report: ImportReport,
}

impl<'a> SrdfReader<'a> {
    fn record(&mut self, treatment: Treatment, rule: &str, place: String, remedy: &str) {
        self.report.record(treatment, rule, place, remedy);
    }

    fn groups(&mut self) -> Result<Vec<Group>, InputError> {
        let elements: Vec<_> = self.robot.children("group").collect();
        let mut groups: Vec<Group> = Vec::with_capacity(elements.len());
        for element in &elements {
            let group = self.group(*element)?;
            if groups.iter().any(|earlier| earlier.name == group.name) {
                let cause = format!("a second group `{}`", group.name);
                return Err(element.error(cause, "give each group a name of its own"));
            }
            groups.push(group);
        }
        for part in elements.into_iter().flat_map(|element| element.children("group")) {
            known_group(part.required("name")?, &groups)?;
        }
        Ok(groups)
    }

    fn group(&mut self, element: Element<'a>) -> Result<Group, InputError> {
        let mut group = Group {
            name: element.required("name")?.text().to_owned(),
            joints: Vec::new(),
            links: Vec::new(),
            chains: Vec::new(),
            groups: Vec::new(),
        };
        for joint in element.children("joint") {
            if self.is_virtual(joint) {
                let rule = "virtual joints in groups";
                self.record(Treatment::NotUsed, rule, joint.line(), "");
                continue;
            }
            group.joints.push(self.joint(joint.required("name")?)?);
        }
        for link in element.children("link") {
            group.links.push(self.link(link.required("name")?)?);
        }
        for chain in element.children("chain") {
            group.chains.extend(self.chain(chain)?);
        }
        for part in element.children("group") {
            group.groups.push(part.required("name")?.text().to_owned());
        }
        if element.child_elements().next().is_none() {
            let rule = format!("the group `{}` is empty", group.name);
            self.record(Treatment::Suspicious, &rule, element.line(), "");
        }
        Ok(group)
    }

    /// Reads a chain; `MoveIt` knows chains that go up to a common link and down again, which are none of one arm.
    fn chain(&mut self, element: Element<'a>) -> Result<Option<(usize, usize)>, InputError> {
        let base = self.link(element.required("base_link")?)?;
        let tip = self.link(element.required("tip_link")?)?;
        if self.model.joint_path(base, tip).is_some() {
            return Ok(Some((base, tip)));
        }
        let links = &self.model.links;
        let rule = format!(
            "the chain from `{}` to `{}`, which does not lead outward from its base",
            links[base], links[tip]
        );
        let remedy = "write the link nearer to the root as base_link";
        self.record(Treatment::NotUsed, &rule, element.line(), remedy);
        Ok(None)
    }

    fn postures(&mut self, groups: &[Group]) -> Result<Vec<NamedPosture>, InputError> {
        let mut postures: Vec<NamedPosture> = Vec::new();
        for element in self.robot.children("group_state").collect::<Vec<_>>() {
            let posture = self.posture(element, groups)?;
            let is_same = |p: &NamedPosture| p.name == posture.name && p.group == posture.group;
            if postures.iter().any(is_same) {
                let rule = format!(
                    "a second posture `{}` of the group `{}`, whose values replace those of the first",
                    posture.name, posture.group
                );
                self.record(Treatment::Suspicious, &rule, element.line(), "keep one of the two");
            }
            postures.push(posture);
        }
        Ok(postures)
    }

    fn posture(
        &mut self,
        element: Element<'a>,
        groups: &[Group],
    ) -> Result<NamedPosture, InputError> {
        let group = element.required("group")?;
        known_group(group, groups)?;
        let name = element.required("name")?.text().to_owned();
        let mut values = Vec::new();
        for joint in element.children("joint") {
            if self.is_virtual(joint) {
                let rule = "values of virtual joints in postures";
                self.record(Treatment::NotUsed, rule, joint.line(), "");
                continue;
            }
            let index = self.joint(joint.required("name")?)?;
            let Some(word) = joint_kind_without_value(self.model.joints[index].kind) else {
                values.push((index, joint.required("value")?.number()?));
                continue;
            };
            let rule = format!("values of {word} joints in postures");
            self.record(Treatment::NotUsed, &rule, joint.line(), "");
        }
        Ok(NamedPosture { name, group: group.text().to_owned(), values })
    }

    /// Returns whether a joint exists in the SRDF only, and places the robot in the world.
    fn is_virtual(&self, joint: Element<'a>) -> bool {
        let Some(name) = joint.attribute("name") else { return false };
        self.robot.children("virtual_joint").any(|virtual_joint| {
            virtual_joint.attribute("name").is_some_and(|other| other.text() == name.text())
        })
    }

    fn end_effectors(&mut self, groups: &[Group]) -> Result<Vec<EndEffector>, InputError> {
        let mut end_effectors = Vec::new();
        for element in self.robot.children("end_effector").collect::<Vec<_>>() {
            let group = element.attribute("group");
            if let Some(group) = group {
                known_group(group, groups)?;
            }
            let parent_link = self.link(element.required("parent_link")?)?;
            let rule = "end effectors, from which no tip is taken";
            let link = &self.model.links[parent_link];
            let remedy = format!("give their link as the tip: {link}");
            self.record(Treatment::NotUsed, rule, element.line(), &remedy);
            end_effectors.push(EndEffector {
                name: element.required("name")?.text().to_owned(),
                parent_link,
                group: group.map_or("", |value| value.text()).to_owned(),
            });
        }
        Ok(end_effectors)
    }

    fn disabled_collisions(&mut self) -> Result<Vec<DisabledCollision>, InputError> {
        let pairs = self.pairs("disable_collisions")?.into_iter();
        Ok(pairs.map(|(links, reason)| DisabledCollision { links, reason }).collect())
    }

    /// Reads all elements that name a pair of links, each with its reason. Those with a link that the model does not
    /// have are left out, as by `MoveIt`: they are remains of tools that were taken off.
    fn pairs(&mut self, name: &'static str) -> Result<Vec<LinkPair>, InputError> {
        let mut pairs = Vec::new();
        for element in self.robot.children(name).collect::<Vec<_>>() {
            let names = [element.required("link1")?, element.required("link2")?];
            if let [Some(first), Some(second)] = names.map(|name| self.known_link(name)) {
                let reason = element.attribute("reason").map_or("", |v| v.text()).to_owned();
                pairs.push(((first, second), reason));
            }
        }
        Ok(pairs)
    }

    fn default_disabled_links(&mut self) -> Result<Vec<usize>, InputError> {
        let mut links = Vec::new();
        for element in self.robot.children("disable_default_collisions").collect::<Vec<_>>() {
            let name = element.required("link")?;
            links.extend(self.known_link(name));
        }
        Ok(links)
    }

    /// Returns the link that an attribute names, or records that there is none.
    fn known_link(&mut self, value: XmlAttribute) -> Option<usize> {
        let Ok(link) = self.model.link("", value.text()) else {
            let rule =
                format!("collisions of the link `{}`, which the URDF does not have", value.text());
            self.record(Treatment::Dropped, &rule, value.line(), "");
            return None;
        };
        Some(link)
    }

    fn link(&self, value: XmlAttribute) -> Result<usize, InputError> {
        let link = self.model.link("", value.text());
        link.map_err(|error| value.error(error.cause(), error.remedy()))
    }

    fn joint(&self, value: XmlAttribute) -> Result<usize, InputError> {
        let joint = self.model.joint("", value.text());
        joint.map_err(|error| value.error(error.cause(), error.remedy()))
    }
}

/// Returns the word for joints that have no one value.
fn joint_kind_without_value(kind: JointKind) -> Option<&'static str> {
    match kind {
        JointKind::Fixed => Some("fixed"),
        JointKind::Floating => Some("floating"),
        JointKind::Planar => Some("planar"),
        JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => None,
    }
}

fn known_group(value: XmlAttribute, groups: &[Group]) -> Result<(), InputError> {
    if groups.iter().any(|group| group.name == value.text()) {
        return Ok(());
    }
    let known: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    let cause = format!("there is no group `{}`", value.text());
    Err(value.error(cause, suggestion(value.text(), &known)))
}
