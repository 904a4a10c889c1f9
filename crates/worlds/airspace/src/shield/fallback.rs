//! Fallbacks of airplanes that come in, or that are about to change speed or level.

use super::orbit::Side;
use super::shielded_aircraft::{MARGIN_M, ShieldedAircraft};
use crate::flight::distance_m;
use sidestep_kernel::interrupt;

/// Returns sides for first fallbacks that are pairwise apart, as far as there are any, and the
/// pairs that are not: they start too close.
pub(crate) fn first_fallbacks(flyers: &[ShieldedAircraft]) -> (Vec<Side>, Vec<(usize, usize)>) {
    entry_fallbacks(flyers, |_| true)
}

/// Returns the same for airplanes some of which keep the fallbacks that they have: only the
/// airplanes in `enters` choose, and only pairs with one of them are named.
pub(crate) fn entry_fallbacks(
    flyers: &[ShieldedAircraft],
    enters: impl Fn(usize) -> bool,
) -> (Vec<Side>, Vec<(usize, usize)>) {
    let clash = |i: usize, a: Side, j: usize, b: Side| {
        !flyers[i].orbit(a).stays_apart(&flyers[j].orbit(b), flyers[i].gap_m(&flyers[j]))
    };
    let near = neighbors(flyers);
    let mut sides: Vec<Side> = flyers.iter().map(|flyer| flyer.fallback).collect();
    let clashes = |sides: &[Side], i: usize, side: Side| {
        near[i].iter().filter(|&&j| clash(i, side, j, sides[j])).count()
    };
    // An airplane with fewer clashes on the other side changes over. Clashes only decrease, so this
    // ends.
    let mut changed = true;
    while changed {
        changed = false;
        for i in (0..sides.len()).filter(|&i| enters(i)) {
            let better = Side::BOTH.into_iter().min_by_key(|&side| clashes(&sides, i, side));
            if let Some(better) = better
                && clashes(&sides, i, better) < clashes(&sides, i, sides[i])
            {
                sides[i] = better;
                changed = true;
            }
        }
    }
    let pairs = near.iter().enumerate().flat_map(|(i, near)| near.iter().map(move |&j| (i, j)));
    let left = pairs
        .filter(|&(i, j)| i < j && (enters(i) || enters(j)) && clash(i, sides[i], j, sides[j]))
        .collect();
    (sides, left)
}

/// Returns the side on which an airplane that is about to fly as `changed` has an orbit apart from
/// the stored fallbacks of others, if there is one; preferably the stored side.
pub(crate) fn safe_side(
    changed: &ShieldedAircraft,
    others: impl Iterator<Item = ShieldedAircraft>,
) -> Option<Side> {
    let minded: Vec<ShieldedAircraft> =
        others.filter(|other| changed.is_protected_from(other)).collect();
    let is_apart = |side: &Side| {
        minded.iter().all(|other| {
            let theirs = other.orbit(other.fallback);
            changed.orbit(*side).stays_apart(&theirs, changed.gap_m(other))
        })
    };
    let sides = Side::BOTH.into_iter().filter(|&side| side != changed.fallback);
    [changed.fallback].into_iter().chain(sides).find(is_apart)
}

/// Returns for each airplane all others whose orbits might come too near its own, by rising number.
/// They are sorted by x, so that only neighbors in that order have to be compared.
fn neighbors(flyers: &[ShieldedAircraft]) -> Vec<Vec<usize>> {
    let reach_m = |f: &ShieldedAircraft| {
        2.0 * f.v_m_s / f.orbit_rad_s + f.separation_m + f.error_m + MARGIN_M
    };
    let widest_m = flyers.iter().map(reach_m).fold(0.0, f64::max);
    let x = |i: usize| flyers[i].orbit_pose.at[0];
    let mut by_x: Vec<usize> = (0..flyers.len()).collect();
    by_x.sort_unstable_by(|&a, &b| x(a).total_cmp(&x(b)));
    let mut near = vec![Vec::new(); flyers.len()];
    for (k, &i) in by_x.iter().enumerate() {
        let beside = by_x[k + 1..].iter().take_while(|&&j| x(j) - x(i) < 2.0 * widest_m);
        for &j in beside {
            interrupt::check();
            let apart_m = distance_m(flyers[i].orbit_pose.at, flyers[j].orbit_pose.at);
            if flyers[i].is_protected_from(&flyers[j])
                && apart_m < reach_m(&flyers[i]) + reach_m(&flyers[j])
            {
                near[i].push(j);
                near[j].push(i);
            }
        }
    }
    near.iter_mut().for_each(|all| all.sort_unstable());
    near
}
