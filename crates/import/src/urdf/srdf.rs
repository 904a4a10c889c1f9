//! SRDF: the data about a robot that a URDF lacks. Groups of joints, named postures, end effectors
//! and the pairs of links that need no collision check.

use std::path::Path;

use super::{MAX_URDF_BYTES, Model};
use crate::xml::{Element, XmlAttribute, XmlFile, XmlSource, read_xml_text};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

/// The content of an SRDF file for a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Semantics {
    /// Groups, in the order of the file.
    pub groups: Vec<Group>,
    /// Named postures, in the order of the file.
    pub postures: Vec<NamedPosture>,
    /// End effectors, in the order of the file.
    pub end_effectors: Vec<EndEffector>,
    /// Pairs of links that may touch.
    pub disabled_collisions: Vec<DisabledCollision>,
}

/// A part of a robot, given in one or several ways.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Its name, which is unique among groups.
    pub name: String,
    /// The listed joints, as indices of [`Model::joints`].
    pub joints: Vec<usize>,
    /// The listed links, as indices of [`Model::links`].
    pub links: Vec<usize>,
    /// Chains: base and tip, as indices of [`Model::links`]. The tip is a descendant of the base.
    pub chains: Vec<(usize, usize)>,
    /// Names of its subgroups.
    pub groups: Vec<String>,
}

/// Values of joints under a name (`group_state`).
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPosture {
    /// Its name. Postures of several groups may share one.
    pub name: String,
    /// The group of the joints that it sets.
    pub group: String,
    /// Index of a joint in [`Model::joints`], and its value in rad or m.
    pub values: Vec<(usize, f64)>,
}

/// A tool at the end of an arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EndEffector {
    /// Its name, as the file gives it.
    pub name: String,
    /// The link that it is mounted on, as an index of [`Model::links`].
    pub parent_link: usize,
    /// The group that it consists of, by its name in the file.
    pub group: String,
}

/// Two links that may touch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisabledCollision {
    /// The two links, as indices of [`Model::links`].
    pub links: (usize, usize),
    /// The reason, such as `Adjacent`, `Never` or `Default`; empty where the file gives none.
    pub reason: String,
}

impl Semantics {
    /// Reads the SRDF file at `path` for `model`, plain or compressed with gzip.
    ///
    /// # Errors
    /// When the file cannot be read, is not SRDF, or refers to a link, joint or group that does not
    /// exist; with file, line, column and the nearest name.
    pub fn load(path: &Path, model: &Model) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &read_xml_text(path, MAX_URDF_BYTES)?, model)
    }

    /// Reads the text of an SRDF file; `place` is its name in errors.
    ///
    /// # Errors
    /// Those of [`Semantics::load`], except for reading.
    pub fn parse(place: &str, text: &str, model: &Model) -> Result<Self, InputError> {
        let source = XmlSource::new(place, text)?;
        let file = XmlFile::parse(&source)?;
        let reader = SrdfReader { robot: file.root("robot")?, model };
        let groups = reader.groups()?;
        Ok(Self {
            postures: reader.read_all("group_state", |e| reader.posture(e, &groups))?,
            end_effectors: reader.read_all("end_effector", |e| reader.end_effector(e))?,
            disabled_collisions: reader.read_all("disable_collisions", |e| reader.disabled(e))?,
            groups,
        })
    }

    /// Returns the values of all postures called `name`; later ones replace earlier ones. `place`
    /// is the option with the name.
    ///
    /// # Errors
    /// When there is none; the error lists the existing names.
    pub fn posture(&self, place: &str, name: &str) -> Result<Vec<(usize, f64)>, InputError> {
        let postures: Vec<_> = self.postures.iter().filter(|p| p.name == name).collect();
        if postures.is_empty() {
            let known: Vec<&str> = self.postures.iter().map(|p| p.name.as_str()).collect();
            let cause = format!("there is no posture `{name}`");
            return Err(InputError::new(place, cause, suggestion(name, &known)));
        }
        Ok(postures.iter().flat_map(|posture| posture.values.iter().copied()).collect())
    }

    /// Returns the group called `name`. `place` is the option with the name.
    ///
    /// # Errors
    /// When there is none; the error suggests the nearest name.
    pub fn group(&self, place: &str, name: &str) -> Result<&Group, InputError> {
        self.groups.iter().find(|group| group.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.groups.iter().map(|g| g.name.as_str()).collect();
            InputError::new(place, format!("there is no group `{name}`"), suggestion(name, &known))
        })
    }

    /// Returns the first and the last link of the group `name`: those of its chain, or the ends of
    /// the path on which its joints and those of its subgroups lie. `place` is the option with the
    /// name.
    ///
    /// # Errors
    /// When there is no such group, or it is not a single path.
    pub fn ends(
        &self,
        place: &str,
        name: &str,
        model: &Model,
    ) -> Result<(usize, usize), InputError> {
        if let [chain] = self.group(place, name)?.chains[..] {
            return Ok(chain);
        }
        let mut names = vec![name];
        let mut joints = Vec::new();
        // Breadth first, with the list as the queue; groups that contain each other are each visited once.
        let mut next = 0;
        while let Some(name) = names.get(next) {
            let group = self.group(place, name)?;
            joints.extend(group.joints.iter().copied());
            // A listed link stands for the joint that carries it.
            joints.extend(group.links.iter().filter_map(|&link| model.parent_joint(link)));
            for part in &group.groups {
                if !names.contains(&part.as_str()) {
                    names.push(part);
                }
            }
            next += 1;
        }
        path_ends(&joints, model).ok_or_else(|| {
            let cause = format!("the joints of group `{name}` are not on one path");
            InputError::new(place, cause, "give base and tip with --base and --tip")
        })
    }
}

/// Returns the ends of the path that holds all of these joints; `None` if they branch.
fn path_ends(joints: &[usize], model: &Model) -> Option<(usize, usize)> {
    let depth = |joint: usize| {
        let path = model.joint_path(model.root, model.joints[joint].child);
        path.map(|path| path.len())
    };
    let first = *joints.iter().min_by_key(|joint| depth(**joint))?;
    let last = *joints.iter().max_by_key(|joint| depth(**joint))?;
    let base = model.joints[first].parent;
    let tip = model.joints[last].child;
    let path = model.joint_path(base, tip)?;
    joints.iter().all(|joint| path.contains(joint)).then_some((base, tip))
}

struct SrdfReader<'a> {
    robot: Element<'a>,
    model: &'a Model,
}

impl<'a> SrdfReader<'a> {
    /// Returns the result of `read` for each element called `name`.
    fn read_all<T>(
        &self,
        name: &'a str,
        read: impl Fn(Element<'a>) -> Result<T, InputError>,
    ) -> Result<Vec<T>, InputError> {
        self.robot.children(name).map(read).collect()
    }

    fn groups(&self) -> Result<Vec<Group>, InputError> {
        let groups = self.read_all("group", |element| self.group(element))?;
        for (i, element) in self.robot.children("group").enumerate() {
            if groups[..i].iter().any(|earlier| earlier.name == groups[i].name) {
                let cause = format!("a second group `{}`", groups[i].name);
                return Err(element.error(cause, "give each group a name of its own"));
            }
            for part in element.children("group") {
                known_group(part.required("name")?, &groups)?;
            }
        }
        Ok(groups)
    }

    fn group(&self, element: Element<'a>) -> Result<Group, InputError> {
        let mut group = Group {
            name: element.required("name")?.text().to_owned(),
            joints: Vec::new(),
            links: Vec::new(),
            chains: Vec::new(),
            groups: Vec::new(),
        };
        for joint in element.children("joint") {
            group.joints.push(self.joint(joint.required("name")?)?);
        }
        for link in element.children("link") {
            group.links.push(self.link(link.required("name")?)?);
        }
        for chain in element.children("chain") {
            group.chains.push(self.chain(chain)?);
        }
        for part in element.children("group") {
            group.groups.push(part.required("name")?.text().to_owned());
        }
        Ok(group)
    }

    fn chain(&self, element: Element<'a>) -> Result<(usize, usize), InputError> {
        let base = self.link(element.required("base_link")?)?;
        let tip_link = element.required("tip_link")?;
        let tip = self.link(tip_link)?;
        if self.model.joint_path(base, tip).is_none() {
            let links = &self.model.links;
            let cause = format!("`{}` does not hang on `{}`", links[tip], links[base]);
            return Err(tip_link.error(cause, "write the link nearer to the root as base_link"));
        }
        Ok((base, tip))
    }

    fn posture(&self, element: Element<'a>, groups: &[Group]) -> Result<NamedPosture, InputError> {
        let group = element.required("group")?;
        known_group(group, groups)?;
        let name = element.required("name")?.text().to_owned();
        let mut values = Vec::new();
        for joint in element.children("joint") {
            // The model has no virtual joints, so their values are left out.
            if !self.is_virtual(joint) {
                let index = self.joint(joint.required("name")?)?;
                values.push((index, joint.required("value")?.number()?));
            }
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

    fn end_effector(&self, element: Element<'a>) -> Result<EndEffector, InputError> {
        Ok(EndEffector {
            name: element.required("name")?.text().to_owned(),
            parent_link: self.link(element.required("parent_link")?)?,
            group: element.attribute("group").map_or("", |v| v.text()).to_owned(),
        })
    }

    fn disabled(&self, element: Element<'a>) -> Result<DisabledCollision, InputError> {
        let first = self.link(element.required("link1")?)?;
        let second = self.link(element.required("link2")?)?;
        Ok(DisabledCollision {
            links: (first, second),
            reason: element.attribute("reason").map_or("", |v| v.text()).to_owned(),
        })
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

fn known_group(value: XmlAttribute, groups: &[Group]) -> Result<(), InputError> {
    if groups.iter().any(|group| group.name == value.text()) {
        return Ok(());
    }
    let known: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    let cause = format!("there is no group `{}`", value.text());
    Err(value.error(cause, suggestion(value.text(), &known)))
}
