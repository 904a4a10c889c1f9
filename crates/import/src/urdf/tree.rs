//! Links and joints as a tree: names, the root, paths from link to link.

use std::collections::BTreeMap;

use super::{Joint, Model};
use crate::xml::Element;
use sidestep_kernel::InputError;

/// The maximum number of names that an error lists.
const MAX_LISTED: usize = 8;

/// Names and their indices.
#[derive(Default)]
pub(super) struct Names(BTreeMap<String, usize>);

impl Names {
    /// Adds a name, or returns it as an error where it is taken.
    pub(super) fn add(&mut self, name: &str, index: usize) -> Result<(), String> {
        match self.0.insert(name.to_owned(), index) {
            None => Ok(()),
            Some(_) => Err(name.to_owned()),
        }
    }

    pub(super) fn get(&self, name: &str) -> Option<usize> {
        self.0.get(name).copied()
    }
}

/// Returns whether the value of `joint` follows from itself, by the joints that it mimics.
pub(super) fn has_mimic_cycle(joints: &[Joint], joint: usize) -> bool {
    let mut next = joint;
    // A chain without a cycle has each joint at most once.
    for _ in 0..=joints.len() {
        match &joints[next].mimic {
            None => return false,
            Some(mimic) => next = mimic.joint,
        }
    }
    true
}

/// Returns the one link without a joint above it, from which all others are reached.
pub(super) fn root(
    link_elements: &[Element],
    elements: &[Element],
    links: &[String],
    joints: &[Joint],
) -> Result<usize, InputError> {
    let above = parent_joints(elements, links, joints)?;
    let roots: Vec<usize> = (0..links.len()).filter(|&link| above[link].is_none()).collect();
    match roots[..] {
        [root] => check_connected(root, &above, elements, links, joints).map(|()| root),
        [] => {
            let cause = "every link hangs on another: the joints form a loop";
            // Joints are in the order of the file, and the last one may be what closed the loop.
            let last = elements.last().expect("links hang on joints");
            Err(last.error(cause, "a URDF is a tree: remove the joint that closes the loop"))
        }
        [_, second, ..] => {
            let names = roots.iter().map(|&link| format!("`{}`", links[link]));
            let cause = format!("{} links hang on nothing: {}", roots.len(), quote_names(names));
            let remedy = "connect all but one to the others with joints";
            Err(link_elements[second].error(cause, remedy))
        }
    }
}

/// Returns names as a list for people.
pub(super) fn quote_names(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = if names.len() > MAX_LISTED { ", ..." } else { "" };
    names.take(MAX_LISTED).collect::<Vec<_>>().join(", ") + more
}

/// Returns for each link the joint that carries it, `None` for roots; a second one is an error.
fn parent_joints(
    elements: &[Element],
    links: &[String],
    joints: &[Joint],
) -> Result<Vec<Option<usize>>, InputError> {
    let mut above = vec![None; links.len()];
    for (i, joint) in joints.iter().enumerate() {
        if let Some(first) = above[joint.child].replace(i) {
            let first: &Joint = &joints[first];
            let cause = format!(
                "`{}` already hangs on joint `{}`: the joints form a loop",
                links[joint.child], first.name
            );
            let remedy = "a URDF is a tree: each link is the child of one joint";
            return Err(elements[i].error(cause, remedy));
        }
    }
    Ok(above)
}

/// Checks that all links are reached from the root; a link that is not is in a loop or below one.
fn check_connected(
    root: usize,
    above: &[Option<usize>],
    elements: &[Element],
    links: &[String],
    joints: &[Joint],
) -> Result<(), InputError> {
    let mut children = vec![Vec::new(); links.len()];
    for joint in joints {
        children[joint.parent].push(joint.child);
    }
    let mut reached = vec![false; links.len()];
    let mut open = vec![root];
    while let Some(link) = open.pop() {
        reached[link] = true;
        open.extend(&children[link]);
    }
    let Some(lost) = reached.iter().position(|reached| !reached) else { return Ok(()) };
    let joint = above[lost].expect("all but the root have a joint above them");
    let cause = format!("`{}` is in a loop of joints or hangs on one", links[lost]);
    let remedy = format!("connect it to `{}`, from which the tree grows", links[root]);
    Err(elements[joint].error(cause, remedy))
}

impl Model {
    /// Returns the joints from `base` out to `tip`, in this order; empty where they are the same
    /// link, `None` where `tip` is not a descendant of `base`.
    pub fn joint_path(&self, base: usize, tip: usize) -> Option<Vec<usize>> {
        let mut above = vec![None; self.links.len()];
        for (i, joint) in self.joints.iter().enumerate() {
            above[joint.child] = Some(i);
        }
        let mut path = Vec::new();
        let mut link = tip;
        while link != base {
            let joint = above[link]?;
            path.push(joint);
            link = self.joints[joint].parent;
        }
        path.reverse();
        Some(path)
    }

    /// Returns the links that carry no other, in the order of the file.
    pub fn leaves(&self) -> Vec<usize> {
        let mut is_parent = vec![false; self.links.len()];
        for joint in &self.joints {
            is_parent[joint.parent] = true;
        }
        (0..self.links.len()).filter(|&link| !is_parent[link]).collect()
    }
}
