//! Tracks of one frame in another, through the frames between them.

use std::collections::{BTreeMap, BTreeSet};

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

use super::PoseTopic;
use super::clock::sort_by_stamp;
use super::poses::{StampedPose, compose};
use crate::mrclam::StampedPose2;

/// Most frames between two frames; more are a circle.
const MAX_DEPTH: usize = 64;
/// Most pairs of frames that an error lists.
const MAX_LISTED: usize = 12;

/// A frame in another over time.
#[derive(Debug)]
pub(super) struct Trajectory {
    pub(super) poses: Vec<StampedPose2>,
    /// The frame that is placed; empty where messages do not say.
    pub(super) child: String,
}

/// Returns the track that `source` asks for, out of the poses on its topic in the order of the recording.
///
/// # Errors
/// When the frames are not there or several are and none is named, or the clock jumps.
pub(super) fn trajectory(
    bag: &str,
    source: &PoseTopic,
    all: &[StampedPose],
) -> Result<Trajectory, InputError> {
    let edges = by_child(all);
    let pairs: BTreeSet<(&str, &str)> =
        all.iter().map(|placed| (placed.parent.as_str(), placed.child.as_str())).collect();
    let refuse = |cause: String, remedy: String| {
        Err(InputError::new(format!("{bag}: {}", source.topic), cause, remedy))
    };
    if pairs.is_empty() {
        return refuse("its messages hold no transforms".into(), "give another topic".into());
    }
    let chain = match &source.frames {
        Some((parent, child)) => chain(&edges, parent, child),
        None if pairs.len() == 1 => pairs.first().map(|(_, child)| vec![*child]),
        None => {
            let cause = format!("it places several frames: {}", describe_pairs(&pairs));
            let remedy = format!("name two of them: {}:map:base_link", source.topic);
            return refuse(cause, remedy);
        }
    };
    let Some(chain) = chain else {
        let (parent, child) = source.frames.clone().unwrap_or_default();
        let cause = format!("no transforms lead from `{parent}` to `{child}`");
        return refuse(cause, format!("it has {}", describe_pairs(&pairs)));
    };
    let place = format!("{bag}: {}", source.topic);
    let links: Vec<Vec<&StampedPose>> = chain
        .iter()
        .map(|child| sort_by_stamp(&place, edges[child].clone()))
        .collect::<Result<_, _>>()?;
    let child = chain.last().map_or_else(String::new, |child| (*child).to_owned());
    Ok(Trajectory { poses: compose_chain(&links), child })
}

/// Returns the pose of frame `child` in the farthest frame that static transforms lead up to, or in one of
/// `ends` where they pass one; `None` where they do not name the frame.
pub(super) fn mount(statics: &[StampedPose], child: &str, ends: &[&str]) -> Option<Pose> {
    if ends.contains(&child) {
        return Some(Pose::from_position([0.0; 3]));
    }
    let edges = by_child(statics);
    let mut link = edges.get(child)?.last()?;
    let mut pose = link.pose;
    for _ in 0..MAX_DEPTH {
        let next =
            edges.get(link.parent.as_str()).filter(|_| !ends.contains(&link.parent.as_str()));
        let Some(next) = next.and_then(|found| found.last()) else { break };
        (link, pose) = (next, compose(&next.pose, &pose));
    }
    Some(pose)
}

fn by_child(all: &[StampedPose]) -> BTreeMap<&str, Vec<&StampedPose>> {
    let mut edges: BTreeMap<&str, Vec<&StampedPose>> = BTreeMap::new();
    for placed in all {
        edges.entry(&placed.child).or_default().push(placed);
    }
    edges
}

/// Returns the frames on the way from `parent` down to `child`, which comes last.
fn chain<'a>(
    edges: &BTreeMap<&'a str, Vec<&'a StampedPose>>,
    parent: &str,
    child: &str,
) -> Option<Vec<&'a str>> {
    let (mut chain, mut at) = (Vec::new(), child);
    while at != parent && chain.len() < MAX_DEPTH {
        let (own, links) = edges.get_key_value(at)?;
        chain.push(*own);
        at = &links.first()?.parent;
    }
    chain.reverse();
    (at == parent && !chain.is_empty()).then_some(chain)
}

/// Returns the poses of the last link's child in the first link's parent, at the times of the last; the
/// others stay as they were last reported, as those of a localization program do.
fn compose_chain(links: &[Vec<&StampedPose>]) -> Vec<StampedPose2> {
    let Some((last, before)) = links.split_last() else { return Vec::new() };
    let at = |placed: &&StampedPose| {
        let mut whole = (*placed).clone();
        for link in before.iter().rev() {
            let known = link.partition_point(|outer| outer.t_secs <= placed.t_secs);
            whole.pose = compose(&link.get(known.checked_sub(1)?)?.pose, &whole.pose);
        }
        Some(whole.to_planar())
    };
    last.iter().filter_map(at).collect()
}

fn describe_pairs(pairs: &BTreeSet<(&str, &str)>) -> String {
    let some = pairs.iter().take(MAX_LISTED).map(|(parent, child)| format!("{parent} > {child}"));
    let more = if pairs.len() > MAX_LISTED { ", ..." } else { "" };
    some.collect::<Vec<_>>().join(", ") + more
}
