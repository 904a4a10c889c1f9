//! Pairs of parts that must not touch.

use super::mount::Mounts;
use sidestep_import::urdf::{JointKind, Model};
use std::collections::BTreeSet;

/// Returns the pairs of parts that can move against each other, are not connected by a joint, and
/// may not touch. `links` are the links of the parts, by their index in the model.
pub(super) fn collision_pairs(
    model: &Model,
    mounts: &Mounts,
    links: &[usize],
    may_touch: &[(usize, usize)],
) -> Vec<(usize, usize)> {
    let rigid: Vec<usize> = (0..model.links.len()).map(|link| rigid_leader(model, link)).collect();
    let joined: BTreeSet<_> =
        model.joints.iter().map(|joint| sorted(rigid[joint.parent], rigid[joint.child])).collect();
    let masked: BTreeSet<_> = may_touch.iter().map(|&(a, b)| sorted(a, b)).collect();
    let all = (0..links.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    all.filter(|&(a, b)| {
        let a = links[a];
        let b = links[b];
        let ra = rigid[a];
        let rb = rigid[b];
        ra != rb
            && move_against_each_other(mounts, a, b)
            && !joined.contains(&sorted(ra, rb))
            && !masked.contains(&sorted(a, b))
    })
    .collect()
}

/// Returns a pair in the order in which pairs are compared.
fn sorted(a: usize, b: usize) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Returns whether two links of the model ever move against each other.
fn move_against_each_other(mounts: &Mounts, a: usize, b: usize) -> bool {
    let a = mounts.link(a);
    let b = mounts.link(b);
    a.link != b.link || !a.is_rigid() || !b.is_rigid()
}

/// Returns the first of the links that fixed joints connect a link with.
fn rigid_leader(model: &Model, link: usize) -> usize {
    let mut at = link;
    while let Some(joint) = model.parent_joint(at).map(|joint| &model.joints[joint]) {
        if joint.kind != JointKind::Fixed {
            break;
        }
        at = joint.parent;
    }
    at
}
