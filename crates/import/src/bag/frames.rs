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

/// Returns the trajectory of the frames of `source`, from the poses on its topic; transforms that never change, `statics`,
/// lead on where they do not.
///
/// # Errors
/// When the frames are missing, or `source` gives none and there are several.
pub(super) fn trajectory(
    bag: &str,
    source: &PoseTopic,
    all: &[StampedPose],
    statics: &[StampedPose],
) -> Result<Trajectory, InputError> {
    let place = format!("{bag}: {}", source.topic);
    let pairs: BTreeSet<(&str, &str)> =
        all.iter().map(|pose| (&*pose.parent, &*pose.child)).collect();
    let Some(first) = pairs.first() else {
        let cause = "its messages hold no transforms";
        return Err(InputError::new(place, cause, "give another topic"));
    };
    let edges = Edges::of(all, statics);
    let chain = match &source.frames {
        Some((parent, child)) => edges.chain(frame(parent), frame(child)).ok_or_else(|| {
            let wanted = match child.as_str() {
                "" => format!("it has no poses in the frame `{parent}` alone"),
                _ => format!("no transforms lead from `{parent}` to `{child}`"),
            };
            InputError::new(&place, wanted, format!("it has {}", describe_pairs(&pairs)))
        })?,
        None if pairs.len() == 1 => vec![*first],
        None => {
            let cause = format!("it has several frames: {}", describe_pairs(&pairs));
            let remedy = format!("give one of them: {}", topic_with_frames(&source.topic, *first));
            return Err(InputError::new(place, cause, remedy));
        }
    };
    let links: Vec<Link<'_>> = chain.iter().map(|pair| edges.link(pair)).collect();
    let child = chain.last().map_or_else(String::new, |(_, child)| (*child).to_owned());
    Ok(Trajectory { poses: compose_chain(&links), child })
}

/// Returns a topic with two frames as an option has them; messages may give the outer frame alone.
fn topic_with_frames(topic: &str, (parent, child): (&str, &str)) -> String {
    if child.is_empty() { format!("{topic}:{parent}") } else { format!("{topic}:{parent}:{child}") }
}

/// The transforms between two frames.
#[derive(Debug, Clone)]
struct Link<'a> {
    /// By their stamps: messages on a network overtake each other.
    poses: Vec<&'a StampedPose>,
    /// Whether the last holds for all times.
    is_static: bool,
}

impl<'a> Link<'a> {
    /// Returns the transform that was reported last at a time, as those of a localization program stay in force.
    fn at(&self, t_secs: f64) -> Option<&'a StampedPose> {
        let reported = if self.is_static {
            self.poses.len()
        } else {
            self.poses.partition_point(|pose| pose.t_secs <= t_secs)
        };
        self.poses.get(reported.checked_sub(1)?).copied()
    }
}

/// Transforms by the frames that they lead to and from.
struct Edges<'a> {
    links: BTreeMap<(&'a str, &'a str), Link<'a>>,
}

impl<'a> Edges<'a> {
    fn of(all: &'a [StampedPose], statics: &'a [StampedPose]) -> Self {
        let mut links: BTreeMap<(&str, &str), Link<'_>> = BTreeMap::new();
        let pairs = |poses: &'a [StampedPose], is_static: bool| {
            poses.iter().map(move |pose| (pose, is_static))
        };
        for (pose, is_static) in pairs(all, false).chain(pairs(statics, true)) {
            let empty = Link { poses: Vec::new(), is_static };
            let link = links.entry((&pose.parent, &pose.child)).or_insert(empty);
            // A transform that changes is not static, whatever repeats it.
            if link.is_static == is_static {
                link.poses.push(pose);
            }
        }
        for link in links.values_mut() {
            link.poses.sort_by(|a, b| a.t_secs.total_cmp(&b.t_secs));
        }
        Self { links }
    }

    /// Returns the pairs of frames that lead from `parent` to `child`, the shortest way; where `child` is empty, to the only
    /// one that has it as parent.
    fn chain(&self, parent: &str, child: &str) -> Option<Vec<(&'a str, &'a str)>> {
        if child.is_empty() {
            let mut own =
                self.links.keys().filter(|(outer, inner)| *outer == parent && inner.is_empty());
            return Some(vec![*own.next()?]);
        }
        let mut by_inner: BTreeMap<&str, Vec<(&str, &str)>> = BTreeMap::new();
        for pair in self.links.keys() {
            by_inner.entry(pair.1).or_default().push(*pair);
        }
        // From the inner frame outward, breadth first: each frame has the pair that leads from it toward `child`.
        let mut inward: BTreeMap<&str, (&str, &str)> = BTreeMap::new();
        let mut frontier = vec![child];
        for _ in 0..MAX_DEPTH {
            let mut next = Vec::new();
            for inner in frontier {
                for pair in by_inner.get(inner).into_iter().flatten() {
                    let (outer, _) = *pair;
                    if outer == child || inward.contains_key(outer) {
                        continue;
                    }
                    inward.insert(outer, *pair);
                    next.push(outer);
                }
            }
            if inward.contains_key(parent) {
                return Some(way_inward(&inward, parent));
            }
            frontier = next;
        }
        None
    }

    fn link(&self, pair: &(&'a str, &'a str)) -> Link<'a> {
        self.links[pair].clone()
    }
}

/// Returns the pairs of frames from one inward, as far as they lead.
fn way_inward<'a>(
    inward: &BTreeMap<&'a str, (&'a str, &'a str)>,
    from: &str,
) -> Vec<(&'a str, &'a str)> {
    let mut way: Vec<(&str, &str)> = Vec::new();
    let mut at = from;
    while let Some(pair) = inward.get(at) {
        way.push(*pair);
        at = pair.1;
    }
    way
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

fn by_child(all: &[StampedPose]) -> BTreeMap<&str, Vec<&StampedPose>> {
    let mut edges: BTreeMap<&str, Vec<&StampedPose>> = BTreeMap::new();
    for pose in all {
        edges.entry(&pose.child).or_default().push(pose);
    }
    edges
}

/// Returns the poses of the last link's child in the first link's parent, at the times of the last link that changes; the
/// others stay as they were last reported.
fn compose_chain(links: &[Link<'_>]) -> Vec<StampedPose2> {
    let Some(timed) = links.iter().rposition(|link| !link.is_static) else { return Vec::new() };
    let compose = |pose: &&StampedPose| compose_at(pose, &links[..timed], &links[timed + 1..]);
    links[timed].poses.iter().filter_map(compose).collect()
}

/// Returns a pose in the frame of the first outer link's parent, of the last inner link's child; `None` before the first
/// pose of a link.
fn compose_at(
    timed: &StampedPose,
    outer_links: &[Link<'_>],
    inner_links: &[Link<'_>],
) -> Option<StampedPose2> {
    let mut stamped = timed.clone();
    for link in inner_links {
        stamped.pose = compose(&stamped.pose, &link.at(timed.t_secs)?.pose);
    }
    for link in outer_links.iter().rev() {
        stamped.pose = compose(&link.at(timed.t_secs)?.pose, &stamped.pose);
    }
    Some(stamped.to_planar())
}

fn describe_pairs(pairs: &BTreeSet<(&str, &str)>) -> String {
    let listed = pairs.iter().take(MAX_LISTED).map(|(parent, child)| format!("{parent} > {child}"));
    let more = if pairs.len() > MAX_LISTED { ", ..." } else { "" };
    listed.collect::<Vec<_>>().join(", ") + more
}
