//! Airplanes near each other.

use crate::flight::Point;
use sidestep_kernel::{AtomicColumn, Cycle, EntitySlot};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const NO_SLOT: u32 = u32::MAX;

/// The airplanes near each other: lists of airplanes by square of the plane, built anew each cycle.
#[derive(Debug)]
pub(crate) struct SpatialIndex {
    side_m: f64,
    /// Cycle (upper half) and last airplane listed (lower half) of each bucket.
    first: Box<[AtomicU64]>,
    /// The airplane listed before each one.
    next: AtomicColumn<u32>,
}

impl SpatialIndex {
    /// Returns lists for `n` airplanes that consider each other up to `side_m` meters away.
    pub(super) fn new(n: usize, side_m: f64) -> Self {
        // Twice as many as airplanes, so that few squares share one.
        let buckets = (2 * n).next_power_of_two();
        Self {
            side_m,
            first: (0..buckets).map(|_| AtomicU64::new(u64::MAX)).collect(),
            next: AtomicColumn::filled(n, NO_SLOT),
        }
    }

    fn grid_square(&self, at: Point) -> [i64; 2] {
        at.map(|v| (v / self.side_m).floor() as i64)
    }

    fn bucket(&self, [x, y]: [i64; 2]) -> &AtomicU64 {
        // Large odd factors (of the golden ratio, and of xxHash) spread neighboring squares over all buckets.
        let mixed = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        &self.first[(mixed >> 32) as usize & (self.first.len() - 1)]
    }

    /// Lists an airplane for this cycle.
    pub(crate) fn insert(&self, slot: EntitySlot, at: Point, now: Cycle) {
        let stamp = u64::from(now as u32) << 32;
        let before = self.bucket(self.grid_square(at)).swap(stamp | u64::from(slot), Relaxed);
        let listed = before >> 32 == stamp >> 32;
        self.next.set(slot as usize, if listed { before as u32 } else { NO_SLOT });
    }

    /// Calls `meet` for every airplane listed in this cycle in the squares around `at`, and
    /// possibly for others.
    pub(crate) fn for_each_near(&self, at: Point, now: Cycle, mut meet: impl FnMut(EntitySlot)) {
        let [x, y] = self.grid_square(at);
        for square in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy])) {
            let first = self.bucket(square).load(Relaxed);
            let mut slot =
                if first >> 32 == u64::from(now as u32) { first as u32 } else { NO_SLOT };
            while slot != NO_SLOT {
                meet(slot);
                slot = self.next.get(slot as usize);
            }
        }
    }
}
