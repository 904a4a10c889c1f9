//! Claims of many chains by where they begin, so that a chain is compared with its neighbors only.

use sidestep_kernel::EntitySlot;
use sidestep_rods::geometry::Aabb;

/// The claims of one cycle along the axis on which they are spread farthest.
#[derive(Debug, Clone)]
pub(crate) struct ClaimIndex<const D: usize> {
    /// The number of claims ever made up to those that are sorted.
    made: u64,
    axis: usize,
    /// The claims by their lower end.
    sorted: Vec<(Aabb<D>, EntitySlot)>,
    /// The place of each slot among them.
    places: Vec<u32>,
}

impl<const D: usize> Default for ClaimIndex<D> {
    fn default() -> Self {
        Self { made: u64::MAX, axis: 0, sorted: Vec::new(), places: Vec::new() }
    }
}

impl<const D: usize> ClaimIndex<D> {
    /// Returns whether these are the claims after `made` claims.
    pub(crate) fn is_current(&self, made: u64) -> bool {
        self.made == made
    }

    /// Sorts the claims of all slots, after `made` claims.
    pub(crate) fn sort(&mut self, made: u64, claims: impl Iterator<Item = Aabb<D>>) {
        self.made = made;
        self.sorted.clear();
        self.sorted.extend(claims.zip(0..));
        self.axis = widest_axis(&self.sorted);
        let axis = self.axis;
        self.sorted
            .sort_unstable_by(|(a, i), (b, j)| a.lo[axis].total_cmp(&b.lo[axis]).then(i.cmp(j)));
        self.places.resize(self.sorted.len(), 0);
        for (place, (_, slot)) in (0..).zip(&self.sorted) {
            self.places[*slot as usize] = place;
        }
    }

    /// Visits those whose claims meet that of a slot and begin after it: of two that meet, one visits the other.
    pub(crate) fn visit(&self, slot: usize, mut look: impl FnMut(EntitySlot)) {
        let place = self.places[slot] as usize;
        let claim = &self.sorted[place].0;
        let behind = self.sorted[place + 1..].iter();
        for (other, at) in
            behind.take_while(|(other, _)| other.lo[self.axis] <= claim.hi[self.axis])
        {
            if other.intersects(claim) {
                look(*at);
            }
        }
    }
}

/// Returns the axis on which the lower ends of boxes are spread farthest.
fn widest_axis<const D: usize>(boxes: &[(Aabb<D>, EntitySlot)]) -> usize {
    let mut widest = 0;
    let mut widest_m = spread_m(boxes, 0);
    for axis in 1..D {
        let axis_m = spread_m(boxes, axis);
        if axis_m > widest_m {
            widest = axis;
            widest_m = axis_m;
        }
    }
    widest
}

/// Returns the distance on an axis from the least lower end of a box to the greatest.
fn spread_m<const D: usize>(boxes: &[(Aabb<D>, EntitySlot)], axis: usize) -> f64 {
    let mut lo = f64::INFINITY;
    let mut hi = f64::NEG_INFINITY;
    for (claim, _) in boxes {
        lo = lo.min(claim.lo[axis]);
        hi = hi.max(claim.lo[axis]);
    }
    hi - lo
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_pair_of_claims_that_meet_is_visited_once_and_no_other(
            boxes in prop::collection::vec((prop::array::uniform2(-9.0..9.0f64), 0.0..2.0f64), 0..80),
            stretch in prop::array::uniform2(0.0..3.0f64),
        ) {
            let claims: Vec<_> = boxes
                .iter()
                .map(|(at, half_m)| {
                    let at = [0, 1].map(|i| (at[i] * stretch[i]).round());
                    Aabb { lo: at, hi: at }.grown(*half_m)
                })
                .collect();
            let mut neighbors = ClaimIndex::default();
            neighbors.sort(1, claims.iter().copied());
            let mut found = Vec::new();
            for slot in 0..claims.len() {
                neighbors.visit(slot, |other| {
                    found.push((slot.min(other as usize), slot.max(other as usize)));
                });
            }
            found.sort_unstable();
            let pairs = (0..claims.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
            let mut expected: Vec<_> = pairs.filter(|(a, b)| claims[*a].intersects(&claims[*b])).collect();
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn chains_in_a_row_are_compared_with_those_beside_them_only() {
        let mut neighbors = ClaimIndex::default();
        let row =
            (0..10_000).map(|k| Aabb { lo: [0.0, f64::from(k)], hi: [9.0, f64::from(k) + 1.5] });
        neighbors.sort(1, row);
        let mut met = 0;
        (0..10_000).for_each(|slot| neighbors.visit(slot, |_| met += 1));
        assert_eq!((neighbors.axis, met), (1, 9_999));
    }
}
