//! Trajectories of one frame in another, through the frames between them.

use std::collections::{BTreeMap, BTreeSet};

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

use super::PoseTopic;
use super::poses::{StampedPose, compose};
use crate::track::StampedPose2;

/// Maximum number of frames between two frames: more than any robot has, so more are a cycle.
const MAX_DEPTH: usize = 64;
/// Maximum number of pairs of frames that an error lists.
const MAX_LISTED: usize = 12;

/// A frame in another over time.
#[derive(Debug)]
pub(super) struct Trajectory {
    pub(super) poses: Vec<StampedPose2>,
    /// The frame whose poses these are; empty where messages do not give it.
    pub(super) child: String,
}

/// Returns the trajectory of the frames of `source`, from the poses on its topic.
///
/// # Errors
/// When the frames are missing, or `source` gives none and there are several.
pub(super) fn trajectory(
    bag: &str,
    source: &PoseTopic,
    all: &[StampedPose],
) -> Result<Trajectory, InputError> {
    let place = format!("{bag}: {}", source.topic);
    let edges = by_child(all);
    let pairs: BTreeSet<(&str, &str)> =
        all.iter().map(|pose| (&*pose.parent, &*pose.child)).collect();
    if pairs.is_empty() {
        let cause = "its messages hold no transforms";
        return Err(InputError::new(place, cause, "give another topic"));
    }
    let chain = match &source.frames {
        Some((parent, child)) => chain(&edges, frame(parent), frame(child)).ok_or_else(|| {
            let cause = format!("no transforms lead from `{parent}` to `{child}`");
            InputError::new(&place, cause, format!("it has {}", describe_pairs(&pairs)))
        })?,
        None if pairs.len() == 1 => pairs.iter().map(|(_, child)| *child).collect(),
        None => {
            let cause = format!("it has several frames: {}", describe_pairs(&pairs));
            let remedy = format!("give two of them: {}:map:base_link", source.topic);
            return Err(InputError::new(place, cause, remedy));
        }
    };
    let links: Vec<Vec<&StampedPose>> =
        chain.iter().map(|child| by_stamp(edges[child].clone())).collect();
    let child = chain.last().map_or_else(String::new, |child| (*child).to_owned());
    Ok(Trajectory { poses: compose_chain(&links), child })
}

/// Returns the pose of frame `child` in the outermost frame that static transforms lead to, or in the first of
/// `ends` on that chain; `None` where no transform has the frame.
pub(super) fn mount(statics: &[StampedPose], child: &str, ends: &[&str]) -> Option<Pose> {
    if ends.contains(&child) {
        return Some(Pose::from_position([0.0; 3]));
    }
    let edges = by_child(statics);
    let mut link = edges.get(child)?.last()?;
    let mut pose = link.pose;
    for _ in 0..MAX_DEPTH {
        let parent = &*link.parent;
        if ends.contains(&parent) {
            break;
        }
        // The last transform of a frame is in force.
        let Some(next) = edges.get(parent).and_then(|transforms| transforms.last()) else { break };
        pose = compose(&next.pose, &pose);
        link = next;
    }
    Some(pose)
}

/// Returns the name of a frame as it is compared, see [`frame_name`](super::poses::frame_name).
fn frame(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

/// Returns poses by their stamps: messages on a network overtake each other.
fn by_stamp(mut poses: Vec<&StampedPose>) -> Vec<&StampedPose> {
    poses.sort_by(|a, b| a.t_secs.total_cmp(&b.t_secs));
    poses
}

fn by_child(all: &[StampedPose]) -> BTreeMap<&str, Vec<&StampedPose>> {
    let mut edges: BTreeMap<&str, Vec<&StampedPose>> = BTreeMap::new();
    for pose in all {
        edges.entry(&pose.child).or_default().push(pose);
    }
    edges
}

/// Returns the frames from `parent`, which is left out, down to `child`, which is last.
fn chain<'a>(
    edges: &BTreeMap<&'a str, Vec<&'a StampedPose>>,
    parent: &str,
    child: &str,
) -> Option<Vec<&'a str>> {
    let mut chain = Vec::new();
    let mut frame = child;
    while frame != parent && chain.len() < MAX_DEPTH {
        let (name, transforms) = edges.get_key_value(frame)?;
        chain.push(*name);
        frame = &transforms.first()?.parent;
    }
    chain.reverse();
    (frame == parent && !chain.is_empty()).then_some(chain)
}

/// Returns the poses of the last link's child in the first link's parent, at the times of the last; the
/// others stay as they were last reported, as those of a localization program do.
fn compose_chain(links: &[Vec<&StampedPose>]) -> Vec<StampedPose2> {
    let Some((last, outer_links)) = links.split_last() else { return Vec::new() };
    last.iter().filter_map(|pose| compose_at(pose, outer_links)).collect()
}

/// Returns a pose in the frame of the first link's parent; `None` before the first pose of a link.
fn compose_at(inner: &StampedPose, outer_links: &[Vec<&StampedPose>]) -> Option<StampedPose2> {
    let mut stamped = inner.clone();
    for link in outer_links.iter().rev() {
        let reported = link.partition_point(|outer| outer.t_secs <= inner.t_secs);
        let outer = link.get(reported.checked_sub(1)?)?;
        stamped.pose = compose(&outer.pose, &stamped.pose);
    }
    Some(stamped.to_planar())
}

fn describe_pairs(pairs: &BTreeSet<(&str, &str)>) -> String {
    let listed = pairs.iter().take(MAX_LISTED).map(|(parent, child)| format!("{parent} > {child}"));
    let more = if pairs.len() > MAX_LISTED { ", ..." } else { "" };
    listed.collect::<Vec<_>>().join(", ") + more
}
