//! A polygon of rods between two points, in closed form.
//!
//! Rods of lengths in intervals reach from one place to another exactly if no side of the polygon
//! that they make with the gap has to be longer than all others together. The gap is the longest
//! side where the rods are stretched out; a rod can be where it has to fold back.

use super::chain::Rod;
use super::geometry::{
    Point, add, add_scaled, distance, lerp, normalized, perpendicular, scaled, sub, unit_x,
};

/// Returns places for the joints of rods from `a` to `b`; rods that cannot span this gap come as near
/// to it as they can. They lie straight if they can be so short, and as a triangle otherwise.
pub(super) fn joint_positions_across_gap<const D: usize>(
    a: Point<D>,
    b: Point<D>,
    rods: &[Rod],
) -> Vec<Point<D>> {
    let gap_m = distance(a, b);
    let sum_min_m: f64 = rods.iter().map(|rod| rod.min_m).sum();
    let sum_max_m: f64 = rods.iter().map(|rod| rod.max_m).sum();
    if gap_m < sum_min_m {
        return triangle_joint_positions(a, b, &folded_rod_lengths_m(rods, gap_m));
    }
    let fraction = (gap_m - sum_min_m) / (sum_max_m - sum_min_m).max(f64::MIN_POSITIVE);
    let lengths_m: Vec<f64> = rods.iter().map(|rod| length_m(rod, fraction)).collect();
    joints_on_line([a, b], &lengths_m)
}

/// Returns a length of a rod: the least for fraction 0, the greatest for fraction 1.
fn length_m(rod: &Rod, fraction: f64) -> f64 {
    rod.min_m + fraction.clamp(0.0, 1.0) * (rod.max_m - rod.min_m)
}

/// Returns lengths for rods that are too long to lie straight: the least, unless one rod is longer
/// than the gap and all others, which then get as long as they must.
fn folded_rod_lengths_m(rods: &[Rod], gap_m: f64) -> Vec<f64> {
    let longest = (0..rods.len()).max_by(|&i, &j| rods[i].min_m.total_cmp(&rods[j].min_m));
    let longest_m = longest.map_or(0.0, |k| rods[k].min_m);
    let mut others_m = 0.0;
    let mut room_m: f64 = 0.0;
    for (i, rod) in rods.iter().enumerate() {
        if Some(i) != longest {
            others_m += rod.min_m;
            room_m += rod.max_m - rod.min_m;
        }
    }
    let lack_m = longest_m - gap_m - others_m;
    let stretch = lack_m / room_m.max(f64::MIN_POSITIVE);
    let mut lengths_m: Vec<f64> = rods.iter().map(|rod| length_m(rod, stretch)).collect();
    if let Some(k) = longest {
        lengths_m[k] = length_m(&rods[k], 0.0);
    }
    lengths_m
}

/// Returns the joints between rods that lie one after the other from one place to the other.
fn joints_on_line<const D: usize>([a, b]: [Point<D>; 2], lengths_m: &[f64]) -> Vec<Point<D>> {
    let whole_m: f64 = lengths_m.iter().sum();
    let ends_m = lengths_m.iter().scan(0.0, |along_m, length_m| {
        *along_m += length_m;
        Some(*along_m)
    });
    let joints = lengths_m.len().saturating_sub(1);
    ends_m.take(joints).map(|along_m| lerp(a, b, along_m / whole_m)).collect()
}

/// Returns the joints of rods that lie as a triangle. Its first side is the gap, extended beyond `a`
/// by as many rods as half of the perimeter has room for; its second is the next rod; the others
/// make the third. So none is longer than the two others together.
fn triangle_joint_positions<const D: usize>(
    a: Point<D>,
    b: Point<D>,
    lengths_m: &[f64],
) -> Vec<Point<D>> {
    let gap_m = distance(a, b);
    let half_m = 0.5 * (gap_m + lengths_m.iter().sum::<f64>());
    let ahead = normalized(sub(b, a)).unwrap_or(unit_x());
    let mut joints = Vec::with_capacity(lengths_m.len());
    let mut back_m = 0.0;
    for length_m in lengths_m {
        if gap_m + back_m + length_m > half_m {
            break;
        }
        back_m += length_m;
        joints.push(add_scaled(a, ahead, -back_m));
    }
    let corner = joints.last().copied().unwrap_or(a);
    let Some((second_m, rest)) = lengths_m[joints.len()..].split_first() else { return joints };
    if rest.is_empty() {
        return joints;
    }
    let first_m = gap_m + back_m;
    let third_m = rest.iter().sum::<f64>();
    // The foot of the apex on the first side, by the law of cosines.
    let foot_m = (second_m - third_m) * (second_m + third_m) / first_m.max(f64::MIN_POSITIVE);
    let foot_m = (0.5 * (foot_m + first_m)).clamp(-second_m, *second_m);
    let side_m = (second_m * second_m - foot_m * foot_m).max(0.0).sqrt();
    let apex = add(add_scaled(corner, ahead, foot_m), scaled(perpendicular(ahead), side_m));
    joints.push(apex);
    joints.extend(joints_on_line([apex, b], rest));
    joints
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::math;

    /// Returns the least and the greatest distance that rods span, meters.
    fn annulus_m(rods: &[Rod]) -> [f64; 2] {
        let most_m: f64 = rods.iter().map(|rod| rod.max_m).sum();
        let folded_m = |rod: &Rod| rod.min_m - (most_m - rod.max_m);
        [rods.iter().map(folded_m).fold(0.0, f64::max), most_m]
    }

    /// The same in another way: rod after rod, the nearest and farthest place of the last end.
    fn rod_by_rod_m(rods: &[Rod]) -> [f64; 2] {
        rods.iter().fold([0.0, 0.0], |[near_m, far_m], rod| {
            let folded_m = (near_m - rod.max_m).max(rod.min_m - far_m).max(0.0);
            [folded_m, far_m + rod.max_m]
        })
    }

    fn rods() -> impl Strategy<Value = Vec<Rod>> {
        let rod = (0.1..3.0f64, prop_oneof![Just(0.0), 0.0..1.0f64]);
        let rod =
            rod.prop_map(|(min_m, more_m)| Rod { min_m, max_m: min_m + more_m, radius_m: 0.0 });
        let long = Rod { min_m: 9.0, max_m: 9.5, radius_m: 0.0 };
        (prop::collection::vec(rod, 1..9), prop::option::of(0usize..9)).prop_map(
            move |(mut rods, at)| {
                if let Some(at) = at {
                    rods.insert(at.min(rods.len()), long);
                }
                rods
            },
        )
    }

    fn worst_m<const D: usize>(a: Point<D>, b: Point<D>, rods: &[Rod]) -> f64 {
        let mut points = vec![a];
        points.extend(joint_positions_across_gap(a, b, rods));
        points.push(b);
        assert_eq!(points.len(), rods.len() + 1);
        let outside_m = |(ends, rod): (&[Point<D>], &Rod)| {
            let length_m = distance(ends[0], ends[1]);
            (length_m - rod.max_m).max(rod.min_m - length_m)
        };
        points.windows(2).zip(rods).map(outside_m).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn rods_span_exactly_the_distances_of_their_annulus(
            rods in rods(), part in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0f64],
            turn_rad in 0.0..6.0f64,
        ) {
            let [near_m, far_m] = annulus_m(&rods);
            let [n_m, f_m] = rod_by_rod_m(&rods);
            prop_assert!((near_m - n_m).abs() < 1e-12 && (far_m - f_m).abs() < 1e-12);
            let gap_m = near_m + part * (far_m - near_m);
            let (s, c) = (math::sin(turn_rad), math::cos(turn_rad));
            let plane_m = worst_m([1.0, 2.0], [1.0 + gap_m * c, 2.0 + gap_m * s], &rods);
            let space_m = worst_m([0.0; 3], [0.0, gap_m * s, gap_m * c], &rods);
            prop_assert!(plane_m.max(space_m) < 1e-9, "{plane_m} {space_m}, {gap_m} m");
        }

        #[test]
        fn no_rods_span_another_distance(rods in rods(), by_m in 1e-6..1.0f64) {
            let [near_m, far_m] = annulus_m(&rods);
            prop_assert!(worst_m([0.0; 2], [far_m + by_m, 0.0], &rods) > 1e-8);
            if near_m > by_m {
                prop_assert!(worst_m([0.0; 2], [near_m - by_m, 0.0], &rods) > 1e-8);
            }
        }
    }
}
