//! Fallbacks of airplanes that enter, or that are about to change speed or level, and how far they may change that.

use super::orbit::OrbitSide;
use super::shielded_aircraft::{MARGIN_M, ShieldedAircraft};
use crate::flight::FlightLevelRange;
use sidestep_kernel::interrupt;

/// Meters by which an airplane may climb or descend farther than was computed, by what is rounded. The difference of
/// altitude that keeps levels apart is less than the scenario's by twice as much, so that levels that are apart
/// nominally do not meet.
const CLIMB_ROUNDING_M: f64 = 5e-7;

/// Returns sides for first fallbacks that are pairwise apart, as far as there are any, and the
/// pairs that are not: they start too close.
pub(crate) fn first_fallbacks(group: &[ShieldedAircraft]) -> (Vec<OrbitSide>, Vec<(usize, usize)>) {
    entry_fallbacks(group, |_| true)
}

/// Returns the same for airplanes some of which keep the fallbacks that they have: only the
/// airplanes in `enters` choose, and only pairs with one of them are reported.
pub(crate) fn entry_fallbacks(
    group: &[ShieldedAircraft],
    enters: impl Fn(usize) -> bool,
) -> (Vec<OrbitSide>, Vec<(usize, usize)>) {
    let near = neighbors(group);
    let mut sides: Vec<OrbitSide> = group.iter().map(|aircraft| aircraft.fallback).collect();
    let count_conflicts = |sides: &[OrbitSide], i: usize, side: OrbitSide| {
        near[i].iter().filter(|&&j| !orbits_stay_apart(group, (i, side), (j, sides[j]))).count()
    };
    // An airplane with fewer conflicts on the other side changes over. Conflicts only decrease, so this
    // ends.
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for i in (0..sides.len()).filter(|&i| enters(i)) {
            let best =
                OrbitSide::BOTH.into_iter().min_by_key(|&side| count_conflicts(&sides, i, side));
            if let Some(best) = best
                && count_conflicts(&sides, i, best) < count_conflicts(&sides, i, sides[i])
            {
                sides[i] = best;
                has_changed = true;
            }
        }
    }
    let mut too_close = Vec::new();
    for (i, others) in near.iter().enumerate() {
        for &j in others.iter().filter(|&&j| i < j && (enters(i) || enters(j))) {
            if !orbits_stay_apart(group, (i, sides[i]), (j, sides[j])) {
                too_close.push((i, j));
            }
        }
    }
    (sides, too_close)
}

/// Returns whether the orbits of two airplanes of a group, each to a side, stay apart.
fn orbits_stay_apart(
    group: &[ShieldedAircraft],
    (i, side_i): (usize, OrbitSide),
    (j, side_j): (usize, OrbitSide),
) -> bool {
    group[i].do_orbits_stay_apart(side_i, &group[j], side_j)
}

/// Returns the side on which an airplane that is about to fly as `changed` has an orbit apart from
/// the stored fallbacks of others, if there is one; preferably the stored side.
pub(crate) fn safe_orbit_side(
    changed: &ShieldedAircraft,
    others: impl Iterator<Item = ShieldedAircraft>,
) -> Option<OrbitSide> {
    let others: Vec<ShieldedAircraft> =
        others.filter(|other| changed.is_protected_from(other)).collect();
    let other_sides = OrbitSide::BOTH.into_iter().filter(|&side| side != changed.fallback);
    [changed.fallback].into_iter().chain(other_sides).find(|&side| {
        others.iter().all(|other| changed.do_orbits_stay_apart(side, other, other.fallback))
    })
}

/// Returns the altitude in meters, between its own and `to_m`, to which an airplane may change its level, and the side
/// on which it then has an orbit apart from the stored fallbacks of all others whose levels it meets. Of two sides it
/// takes the one that lets it go farther, preferably the stored one. `limit_m` is how far it may go on a side whatever
/// these others do.
///
/// The shield keeps it apart from those whose levels it is on already, so it can always stay where it is.
pub(crate) fn next_altitude(
    changing: &ShieldedAircraft,
    to_m: f64,
    others: &[ShieldedAircraft],
    limit_m: impl Fn(OrbitSide) -> f64,
) -> (f64, OrbitSide) {
    // Between two `dt` it is on one level.
    let from_m = changing.levels.low_m;
    // In steps of `dtau` it may come out beyond `to_m` by what is rounded.
    let beyond_m = to_m + CLIMB_ROUNDING_M * (to_m - from_m).signum();
    let passing = ShieldedAircraft {
        levels: FlightLevelRange::between(from_m, beyond_m),
        ..changing.clone()
    };
    let met: Vec<&ShieldedAircraft> =
        others.iter().filter(|other| passing.is_protected_from(other)).collect();
    // `None` where it would lose the fallback that keeps it apart from those on its own level.
    let altitude_m = |side: OrbitSide| {
        let mut free_m = limit_m(side);
        for &other in &met {
            let is_met_now = changing.is_protected_from(other);
            // By the invariant; with errors of position the two need not be seen apart anew.
            let is_kept_apart = is_met_now && side == changing.fallback;
            if is_kept_apart || passing.do_orbits_stay_apart(side, other, other.fallback) {
                continue;
            }
            if is_met_now {
                return None;
            }
            let vertical_m = passing.vertical_m.max(other.vertical_m);
            free_m = altitude_short_of(other.levels, vertical_m, from_m, free_m);
        }
        Some(free_m)
    };
    let stored_m = altitude_m(changing.fallback).unwrap_or(from_m);
    if stored_m == to_m {
        return (stored_m, changing.fallback);
    }
    let other_side = changing.fallback.opposite();
    match altitude_m(other_side) {
        Some(other_m) if (other_m - from_m).abs() > (stored_m - from_m).abs() + MARGIN_M => {
            (other_m, other_side)
        }
        _ => (stored_m, changing.fallback),
    }
}

/// Returns the altitude in meters, between `from_m` and `to_m`, up to which a change of level stays off the levels of
/// another airplane: `vertical_m` from them.
pub(crate) fn altitude_short_of(
    levels: FlightLevelRange,
    vertical_m: f64,
    from_m: f64,
    to_m: f64,
) -> f64 {
    // By a margin, so that rounding never makes them meet.
    let gap_m = vertical_m + MARGIN_M;
    if to_m >= from_m {
        (levels.low_m - gap_m).clamp(from_m, to_m)
    } else {
        (levels.high_m + gap_m).clamp(to_m, from_m)
    }
}

/// Returns for each airplane all others whose orbits might come too near its own, by rising number.
/// They are sorted along one direction, so that only neighbors in that order have to be compared.
fn neighbors(group: &[ShieldedAircraft]) -> Vec<Vec<usize>> {
    let max_reach_m = group.iter().map(orbit_reach_m).fold(0.0, f64::max);
    let x = |i: usize| group[i].frame.surface().sweep_m(group[i].orbit_pose.at);
    let mut by_x: Vec<usize> = (0..group.len()).collect();
    by_x.sort_unstable_by(|&a, &b| x(a).total_cmp(&x(b)));
    let mut near = vec![Vec::new(); group.len()];
    for (k, &i) in by_x.iter().enumerate() {
        let next = by_x[k + 1..].iter().take_while(|&&j| x(j) - x(i) < 2.0 * max_reach_m);
        for &j in next {
            interrupt::check();
            let reach_m = orbit_reach_m(&group[i]) + orbit_reach_m(&group[j]);
            let surface = group[i].frame.surface();
            let at = group[i].orbit_pose.at;
            let other_at = group[j].orbit_pose.at;
            if group[i].is_protected_from(&group[j])
                && !surface.is_surely_beyond(at, other_at, reach_m)
                && surface.distance_m(at, other_at) < reach_m
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

/// Returns the distance from an airplane within which its orbits, and the separation around them, lie, in meters.
fn orbit_reach_m(aircraft: &ShieldedAircraft) -> f64 {
    2.0 * aircraft.v_m_s / aircraft.orbit_rad_s
        + aircraft.separation_m
        + aircraft.error_m
        + MARGIN_M
}
