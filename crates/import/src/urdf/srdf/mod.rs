//! SRDF: the data about a robot that a URDF lacks. Groups of joints, named postures, end effectors
//! and the pairs of links that need no collision check.
//!
//! Read as `MoveIt` reads it (`srdfdom`): where that warns and goes on, it is in [`Semantics::report`], with all that
//! has no meaning here; where it leaves out a group, a posture or an end effector, that is an error.

mod read;
#[cfg(test)]
mod tests;
mod unused;

use std::collections::BTreeSet;
use std::path::Path;

use super::{MAX_URDF_BYTES, Model};
use crate::ImportReport;
use crate::xml::read_xml_text;
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
    /// Links that may touch all others but those of [`Self::enabled_collisions`], as indices of [`Model::links`].
    pub default_disabled_links: Vec<usize>,
    /// Pairs of links that must not touch although one of them may touch the others.
    pub enabled_collisions: Vec<(usize, usize)>,
    /// What of the file was not taken as it stood.
    pub report: ImportReport,
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
    /// When the file cannot be read, is not SRDF, still has xacro, or refers to a link, joint or group that does not
    /// exist; with file, line, column and the nearest name.
    pub fn load(path: &Path, model: &Model) -> Result<Self, InputError> {
        let place = path.display().to_string();
        if place.trim_end_matches(".gz").ends_with(".xacro") {
            return Err(InputError::new(place, super::xacro::CAUSE, read::XACRO_REMEDY));
        }
        Self::parse(&place, &read_xml_text(path, MAX_URDF_BYTES)?, model)
    }

    /// Reads the text of an SRDF file; `place` is its name in errors.
    ///
    /// # Errors
    /// Those of [`Semantics::load`], except for reading.
    pub fn parse(place: &str, text: &str, model: &Model) -> Result<Self, InputError> {
        read::semantics(place, text, model)
    }

    /// Returns the pairs among these links that may touch, each once: those that the file disables, and those of a link
    /// whose collisions it disables by default, unless it enables them again.
    pub fn may_touch(&self, links: &BTreeSet<usize>) -> Vec<(usize, usize)> {
        let ordered = |(a, b): (usize, usize)| (a.min(b), a.max(b));
        let mut pairs = BTreeSet::new();
        for &link in self.default_disabled_links.iter().filter(|link| links.contains(link)) {
            pairs.extend(
                links.iter().filter(|other| **other != link).map(|&other| ordered((link, other))),
            );
        }
        for &pair in &self.enabled_collisions {
            pairs.remove(&ordered(pair));
        }
        // Last, as in MoveIt: what is disabled by name stays so.
        let disabled = self.disabled_collisions.iter().map(|pair| ordered(pair.links));
        pairs.extend(disabled.filter(|(a, b)| links.contains(a) && links.contains(b)));
        pairs.into_iter().collect()
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
