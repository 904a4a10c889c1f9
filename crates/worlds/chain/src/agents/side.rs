//! The two sides of a connector: below, toward connector 0, and above.

use serde::{Deserialize, Serialize};

/// One of the two directions along a chain, and the neighbor there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum NeighborSide {
    /// Toward connector 0.
    Below,
    /// Toward the last connector.
    Above,
}

impl NeighborSide {
    /// In the order of arrays with a value for each side.
    pub(crate) const ALL: [Self; 2] = [Self::Below, Self::Above];

    pub(crate) fn other(self) -> Self {
        match self {
            Self::Below => Self::Above,
            Self::Above => Self::Below,
        }
    }

    /// Returns the neighbor there of connector `k` of `n`, if there is one.
    pub(crate) fn neighbor(self, k: u32, n: u32) -> Option<u32> {
        match self {
            Self::Below => k.checked_sub(1),
            Self::Above => (k + 1 < n).then_some(k + 1),
        }
    }

    /// Returns whether connector `other` is on this side of connector `k`.
    pub(crate) fn is_toward(self, other: u32, k: u32) -> bool {
        match self {
            Self::Below => other < k,
            Self::Above => other > k,
        }
    }
}

/// One thing for each side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct PerSide<T> {
    below: T,
    above: T,
}

impl<T> PerSide<T> {
    pub(crate) fn new([below, above]: [T; 2]) -> Self {
        Self { below, above }
    }

    /// Makes the value below first.
    pub(crate) fn from_fn(mut make: impl FnMut(NeighborSide) -> T) -> Self {
        Self { below: make(NeighborSide::Below), above: make(NeighborSide::Above) }
    }

    /// Visits the value below first.
    pub(crate) fn for_each(&mut self, mut visit: impl FnMut(NeighborSide, &mut T)) {
        visit(NeighborSide::Below, &mut self.below);
        visit(NeighborSide::Above, &mut self.above);
    }
}

impl<T> std::ops::Index<NeighborSide> for PerSide<T> {
    type Output = T;

    fn index(&self, side: NeighborSide) -> &T {
        match side {
            NeighborSide::Below => &self.below,
            NeighborSide::Above => &self.above,
        }
    }
}

impl<T> std::ops::IndexMut<NeighborSide> for PerSide<T> {
    fn index_mut(&mut self, side: NeighborSide) -> &mut T {
        match side {
            NeighborSide::Below => &mut self.below,
            NeighborSide::Above => &mut self.above,
        }
    }
}
