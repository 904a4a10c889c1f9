//! The two sides of a connector: below, toward connector 0, and above.

use serde::{Deserialize, Serialize};

/// One of the two directions along a chain, and the neighbor there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum ChainSide {
    /// Toward connector 0.
    Below,
    /// Toward the last connector.
    Above,
}

impl ChainSide {
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
    pub(crate) fn is_side_of(self, other: u32, k: u32) -> bool {
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
    pub(crate) fn from_fn(mut make: impl FnMut(ChainSide) -> T) -> Self {
        Self { below: make(ChainSide::Below), above: make(ChainSide::Above) }
    }

    /// Visits the value below first.
    pub(crate) fn for_each(&mut self, mut visit: impl FnMut(ChainSide, &mut T)) {
        visit(ChainSide::Below, &mut self.below);
        visit(ChainSide::Above, &mut self.above);
    }
}

impl<T> std::ops::Index<ChainSide> for PerSide<T> {
    type Output = T;

    fn index(&self, side: ChainSide) -> &T {
        match side {
            ChainSide::Below => &self.below,
            ChainSide::Above => &self.above,
        }
    }
}

impl<T> std::ops::IndexMut<ChainSide> for PerSide<T> {
    fn index_mut(&mut self, side: ChainSide) -> &mut T {
        match side {
            ChainSide::Below => &mut self.below,
            ChainSide::Above => &mut self.above,
        }
    }
}
