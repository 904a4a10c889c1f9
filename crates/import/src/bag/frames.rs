//! Tracks of one frame in another, through the frames between them.

use std::collections::{BTreeMap, BTreeSet};

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

use super::Source;
use super::clock::in_order;
use super::poses::{Placed, compose};
use crate::mrclam::TruePose;

/// Most frames between two frames; more are a circle.
const DEPTH_MAX: usize = 64;
/// Most pairs of frames that an error lists.
const LISTED_MAX: usize = 12;

/// A frame in another over time.
#[derive(Debug)]
pub(super) struct Track {
    pub(super) poses: Vec<TruePose>,
    /// The frame that is placed; empty where messages do not say.
    pub(super) child: String,
}

/// Returns the track that `source` asks for, out of the poses on its topic in the order of the recording.
///
/// # Errors
/// When the frames are not there or several are and none is named, or the clock jumps.
pub(super) fn track(bag: &str, source: &Source, all: &[Placed]) -> Result<Track, InputError> {
    let edges = by_child(all);
    let pairs: BTreeSet<(&str, &str)> =
        all.iter().map(|placed| (placed.parent.as_str(), placed.child.as_str())).collect();
    let refuse = |cause: String, remedy: String| {
        Err(InputError::new(format!("{bag}: {}", source.topic), cause, remedy))
    };
    if pairs.is_empty() {
        return refuse("its messages hold no transforms".into(), "name another topic".into());
    }
    let chain = match &source.frames {
        Some((parent, child)) => chain(&edges, parent, child),
        None if pairs.len() == 1 => pairs.first().map(|(_, child)| vec![*child]),
        None => {
            let cause = format!("it places several frames: {}", listed(&pairs));
            let remedy = format!("name two of them: {}:map:base_link", source.topic);
            return refuse(cause, remedy);
        }
    };
    let Some(chain) = chain else {
        let (parent, child) = source.frames.clone().unwrap_or_default();
        let cause = format!("no transforms lead from `{parent}` to `{child}`");
        return refuse(cause, format!("it has {}", listed(&pairs)));
    };
    let place = format!("{bag}: {}", source.topic);
    let links: Vec<Vec<&Placed>> = chain
        .iter()
        .map(|child| in_order(&place, edges[child].clone()))
        .collect::<Result<_, _>>()?;
    let child = chain.last().map_or_else(String::new, |child| (*child).to_owned());
    Ok(Track { poses: joined(&links), child })
}

/// Returns the pose of frame `child` in the farthest frame that static transforms lead up to, or in one of
/// `ends` where they pass one; `None` where they do not name the frame.
pub(super) fn mount(statics: &[Placed], child: &str, ends: &[&str]) -> Option<Pose> {
    if ends.contains(&child) {
        return Some(Pose::at([0.0; 3]));
    }
    let edges = by_child(statics);
    let mut link = edges.get(child)?.last()?;
    let mut pose = link.pose;
    for _ in 0..DEPTH_MAX {
        let next =
            edges.get(link.parent.as_str()).filter(|_| !ends.contains(&link.parent.as_str()));
        let Some(next) = next.and_then(|found| found.last()) else { break };
        (link, pose) = (next, compose(&next.pose, &pose));
    }
    Some(pose)
}

fn by_child(all: &[Placed]) -> BTreeMap<&str, Vec<&Placed>> {
    let mut edges: BTreeMap<&str, Vec<&Placed>> = BTreeMap::new();
    for placed in all {
        edges.entry(&placed.child).or_default().push(placed);
    }
    edges
}

/// Returns the frames on the way from `parent` down to `child`, which comes last.
fn chain<'a>(
    edges: &BTreeMap<&'a str, Vec<&'a Placed>>,
    parent: &str,
    child: &str,
) -> Option<Vec<&'a str>> {
    let (mut chain, mut at) = (Vec::new(), child);
    while at != parent && chain.len() < DEPTH_MAX {
        let (own, links) = edges.get_key_value(at)?;
        chain.push(*own);
        at = &links.first()?.parent;
    }
    chain.reverse();
    (at == parent && !chain.is_empty()).then_some(chain)
}

/// Returns the poses of the last link's child in the first link's parent, at the times of the last; the
/// others stay as they were last reported, as those of a localization program do.
fn joined(links: &[Vec<&Placed>]) -> Vec<TruePose> {
    let Some((last, before)) = links.split_last() else { return Vec::new() };
    let at = |placed: &&Placed| {
        let mut whole = (*placed).clone();
        for link in before.iter().rev() {
            let known = link.partition_point(|outer| outer.t_secs <= placed.t_secs);
            whole.pose = compose(&link.get(known.checked_sub(1)?)?.pose, &whole.pose);
        }
        Some(whole.planar())
    };
    last.iter().filter_map(at).collect()
}

fn listed(pairs: &BTreeSet<(&str, &str)>) -> String {
    let some = pairs.iter().take(LISTED_MAX).map(|(parent, child)| format!("{parent} > {child}"));
    let more = if pairs.len() > LISTED_MAX { ", ..." } else { "" };
    some.collect::<Vec<_>>().join(", ") + more
}
