//! Pairs of parts that must not touch.

use super::mount::LinkMountsOnArm;
use sidestep_import::urdf::{JointKind, Model};
use std::collections::BTreeSet;

/// Returns the pairs of parts that can move against each other, are not connected by a joint, and
/// may not touch. `links` are the links of the parts, by their index in the model.
pub(super) fn collision_candidate_pairs(
    model: &Model,
    mounts: &LinkMountsOnArm,
    links: &[usize],
    may_touch: &[(usize, usize)],
) -> Vec<(usize, usize)> {
    let rigid: Vec<usize> =
        (0..model.links.len()).map(|link| rigid_group_root(model, link)).collect();
    let joined: BTreeSet<_> = model
        .joints
        .iter()
        .map(|joint| ordered_pair(rigid[joint.parent], rigid[joint.child]))
        .collect();
    let masked: BTreeSet<_> = may_touch.iter().map(|&(a, b)| ordered_pair(a, b)).collect();
    let all = (0..links.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    all.filter(|&(a, b)| {
        let a = links[a];
        let b = links[b];
        let ra = rigid[a];
        let rb = rigid[b];
        ra != rb
            && can_links_move_relatively(mounts, a, b)
            && !joined.contains(&ordered_pair(ra, rb))
            && !masked.contains(&ordered_pair(a, b))
    })
    .collect()
}

/// Returns a pair in the order in which pairs are compared.
fn ordered_pair(a: usize, b: usize) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Returns whether two links of the model ever move against each other.
fn can_links_move_relatively(mounts: &LinkMountsOnArm, a: usize, b: usize) -> bool {
    let a = mounts.link(a);
    let b = mounts.link(b);
    a.link != b.link || !a.is_rigid() || !b.is_rigid()
}

/// Returns the first of the links that fixed joints connect a link with.
fn rigid_group_root(model: &Model, link: usize) -> usize {
    let mut at = link;
    while let Some(joint) = model.parent_joint(at).map(|joint| &model.joints[joint]) {
        if joint.kind != JointKind::Fixed {
            break;
        }
        at = joint.parent;
    }
    at
}
