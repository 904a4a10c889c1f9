//! Airplanes near each other.

use crate::flight::{Point, Surface};
use sidestep_kernel::{AtomicColumn, Cycle, EntitySlot};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const NO_SLOT: u32 = u32::MAX;

/// The airplanes near each other: lists of airplanes by square of the plane, or by cube of space where they fly over the
/// earth, built anew each cycle. In space no place is special, neither the poles nor the date line.
#[derive(Debug)]
pub(crate) struct SpatialIndex {
    surface: Surface,
    side_m: f64,
    /// Cycle (upper half) and last airplane listed (lower half) of each bucket.
    first: Box<[AtomicU64]>,
    /// The airplane listed before each one.
    next: AtomicColumn<u32>,
}

impl SpatialIndex {
    /// Returns lists for `n` airplanes that consider each other up to `side_m` meters away.
    pub(super) fn new(surface: Surface, n: usize, side_m: f64) -> Self {
        // Twice as many as airplanes, so that few squares share one.
        let buckets = (2 * n).next_power_of_two();
        Self {
            surface,
            side_m,
            first: (0..buckets).map(|_| AtomicU64::new(u64::MAX)).collect(),
            next: AtomicColumn::filled(n, NO_SLOT),
        }
    }

    /// Returns the cube that a place lies in; in a plane all lie in one layer.
    fn cube(&self, at: Point) -> [i64; 3] {
        self.surface.in_space_m(at).map(|v| (v / self.side_m).floor() as i64)
    }

    fn bucket(&self, [x, y, z]: [i64; 3]) -> &AtomicU64 {
        // Large odd factors (of the golden ratio, of xxHash, and of MurmurHash) spread neighboring cubes over all buckets.
        let mixed = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ (z as u64).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        &self.first[(mixed >> 32) as usize & (self.first.len() - 1)]
    }

    /// Lists an airplane for this cycle.
    pub(crate) fn insert(&self, slot: EntitySlot, at: Point, now: Cycle) {
        let stamp = u64::from(now as u32) << 32;
        let before = self.bucket(self.cube(at)).swap(stamp | u64::from(slot), Relaxed);
        let listed = before >> 32 == stamp >> 32;
        self.next.set(slot as usize, if listed { before as u32 } else { NO_SLOT });
    }

    /// Calls `meet` for every airplane listed in this cycle in the squares or cubes around `at`, and
    /// possibly for others.
    pub(crate) fn for_each_near(&self, at: Point, now: Cycle, mut meet: impl FnMut(EntitySlot)) {
        let [x, y, z] = self.cube(at);
        let layers = match self.surface {
            Surface::Plane => 0..=0,
            Surface::Earth => -1..=1,
        };
        let squares = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let cubes = layers.flat_map(|dz| squares.clone().map(move |[x, y]| [x, y, z + dz]));
        for cube in cubes {
            let first = self.bucket(cube).load(Relaxed);
            let mut slot =
                if first >> 32 == u64::from(now as u32) { first as u32 } else { NO_SLOT };
            while slot != NO_SLOT {
                meet(slot);
                slot = self.next.get(slot as usize);
            }
        }
    }
}
