//! Modified voltage potential, after Hoekstra's method in BlueSky's form, heading only: an airplane
//! shifts its velocity so that the predicted closest point of approach moves out of the other's
//! zone.

use super::Moving;
use crate::flight::Point;
use sidestep_kernel::math;

/// Closest approaches nearer than this have no direction of their own, so every airplane gives way
/// to the right.
const HEAD_ON_M: f64 = 10.0;

/// Returns the velocity that airplane `own` should fly: its preferred one, shifted away from all
/// airplanes with which it would lose separation within `look_ahead_s`. `margin` is a factor on
/// separations.
pub(in super::super) fn velocity<'a>(
    own: &Moving,
    others: impl Iterator<Item = &'a Moving>,
    look_ahead_s: f64,
    margin: f64,
) -> Point {
    let shifts = others.filter_map(|other| shift(own, other, look_ahead_s, margin));
    shifts.fold(own.preferred, |v, s| [v[0] - s[0], v[1] - s[1]])
}

/// Returns the change of the other's velocity, seen from `own`, with which it would miss its zone.
fn shift(own: &Moving, other: &Moving, look_ahead_s: f64, margin: f64) -> Option<Point> {
    let zone_m = own.separation_m.max(other.separation_m) * margin;
    let apart = [other.at[0] - own.at[0], other.at[1] - own.at[1]];
    let closing = [other.velocity[0] - own.preferred[0], other.velocity[1] - own.preferred[1]];
    let speed2 = closing[0] * closing[0] + closing[1] * closing[1];
    if speed2 < 1e-9 {
        return None;
    }
    let cpa_s = -(apart[0] * closing[0] + apart[1] * closing[1]) / speed2;
    if !(0.0..look_ahead_s).contains(&cpa_s) {
        return None;
    }
    let mut cpa = [apart[0] + closing[0] * cpa_s, apart[1] + closing[1] * cpa_s];
    let mut miss_m = math::hypot(cpa[0], cpa[1]);
    if miss_m >= zone_m {
        return None;
    }
    let distance_m = math::hypot(apart[0], apart[1]).max(1e-9);
    if miss_m <= HEAD_ON_M {
        // The other should pass to the left of the line of sight.
        miss_m = HEAD_ON_M;
        cpa = [-apart[1] / distance_m * miss_m, apart[0] / distance_m * miss_m];
    }
    let mut size = (zone_m - miss_m) / (cpa_s.max(1.0) * miss_m);
    if zone_m < distance_m && miss_m < distance_m {
        // The shifted closest point lies on the zone's tangent, not on its rim.
        let off = math::asin(zone_m / distance_m) - math::asin(miss_m / distance_m);
        size /= math::cos(off).abs().max(0.1);
    }
    Some([cpa[0] * size, cpa[1] * size])
}

#[cfg(test)]
mod tests {
    use super::super::super::flight::Levels;
    use super::*;

    fn moving(x: f64, y: f64, velocity: Point) -> Moving {
        Moving {
            at: [x, y],
            velocity,
            preferred: velocity,
            separation_m: 500.0,
            levels: Levels::at(0.0),
            yields: true,
        }
    }

    #[test]
    fn two_head_on_turn_to_the_same_side_and_those_apart_do_not_turn() {
        let (a, b) = (moving(0.0, 0.0, [35.0, 0.0]), moving(4000.0, 0.0, [-35.0, 0.0]));
        let va = velocity(&a, [b].iter(), 125.0, 1.0);
        let vb = velocity(&b, [a].iter(), 125.0, 1.0);
        assert!(va[1] < -1.0 && vb[1] > 1.0, "{va:?} {vb:?}");
        let far = moving(0.0, 5000.0, [35.0, 0.0]);
        assert_eq!(velocity(&a, [far].iter(), 125.0, 1.0), a.preferred);
    }
}
