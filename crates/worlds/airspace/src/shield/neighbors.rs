//! Airplanes of a group that are near enough to each other for their plans to matter.

use super::shielded_aircraft::ShieldedAircraft;
use sidestep_kernel::interrupt;

/// Returns for each airplane all others from which it is kept apart and that it may come near, by rising number:
/// `reach_m` is the distance in meters within which an airplane and half of the gap around it stay.
///
/// They are sorted along one direction, so that only neighbors in that order have to be compared.
pub(super) fn neighbors(
    group: &[ShieldedAircraft],
    reach_m: impl Fn(&ShieldedAircraft) -> f64,
) -> Vec<Vec<usize>> {
    let reaches_m: Vec<f64> = group.iter().map(reach_m).collect();
    let max_reach_m = reaches_m.iter().copied().fold(0.0, f64::max);
    let along_m: Vec<f64> =
        group.iter().map(|one| one.frame.surface().sweep_m(one.pose.at)).collect();
    let mut in_order: Vec<usize> = (0..group.len()).collect();
    in_order.sort_unstable_by(|&a, &b| along_m[a].total_cmp(&along_m[b]));
    let mut near = vec![Vec::new(); group.len()];
    for (k, &i) in in_order.iter().enumerate() {
        let next =
            in_order[k + 1..].iter().take_while(|&&j| along_m[j] - along_m[i] < 2.0 * max_reach_m);
        for &j in next {
            interrupt::check();
            let limit_m = reaches_m[i] + reaches_m[j];
            if along_m[j] - along_m[i] < limit_m
                && group[i].is_protected_from(&group[j])
                && group[i].is_within(&group[j], limit_m)
            {
                near[i].push(j);
                near[j].push(i);
            }
        }
    }
    for others in &mut near {
        others.sort_unstable();
    }
    near
}
