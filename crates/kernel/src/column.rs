//! A column of a state that workers share: one plain value per slot.
//!
//! The kernel's phases guarantee one writer per slot and phase, and a barrier between phases. A
//! relaxed load or store, an ordinary `mov` on every machine, is therefore enough, and no code is
//! `unsafe`. A broken guarantee would show as a wrong value (and in the determinism tests), never
//! as undefined behavior.

use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicU64, Ordering::Relaxed};

/// A plain value that fits into an atomic.
pub trait AtomicValue: Copy + Default + Send + Sync + 'static {
    /// The atomic that holds it.
    type Cell: Send + Sync;
    /// Returns the atomic of a new cell.
    fn into_atomic(self) -> Self::Cell;
    /// Reads a cell in relaxed order, see the module.
    fn load(cell: &Self::Cell) -> Self;
    /// Writes a cell in relaxed order, see the module.
    fn store(cell: &Self::Cell, value: Self);
}

macro_rules! word {
    ($($t:ty, $atomic:ty;)*) => {$(
        impl AtomicValue for $t {
            type Cell = $atomic;
            #[inline(always)]
            fn into_atomic(self) -> $atomic { <$atomic>::new(self) }
            #[inline(always)]
            fn load(cell: &$atomic) -> Self { cell.load(Relaxed) }
            #[inline(always)]
            fn store(cell: &$atomic, value: Self) { cell.store(value, Relaxed) }
        }
    )*};
}
word! { u8, AtomicU8; u16, AtomicU16; u32, AtomicU32; u64, AtomicU64; }

impl AtomicValue for f64 {
    type Cell = AtomicU64;
    #[inline(always)]
    fn into_atomic(self) -> AtomicU64 {
        AtomicU64::new(self.to_bits())
    }
    #[inline(always)]
    fn load(cell: &AtomicU64) -> Self {
        Self::from_bits(cell.load(Relaxed))
    }
    #[inline(always)]
    fn store(cell: &AtomicU64, value: Self) {
        cell.store(value.to_bits(), Relaxed);
    }
}

/// A value that is kept as a number which stands for it.
pub trait Packed: Copy + Default + Send + Sync + 'static {
    /// The integer that lies in memory in place of the value.
    type Bits: AtomicValue;
    /// Returns the number that stands for this value.
    fn to_bits(self) -> Self::Bits;
    /// Returns the value that a number from [`Self::to_bits`] stands for.
    fn from_bits(code: Self::Bits) -> Self;
}

impl<T: Packed> AtomicValue for T {
    type Cell = <T::Bits as AtomicValue>::Cell;
    #[inline(always)]
    fn into_atomic(self) -> Self::Cell {
        self.to_bits().into_atomic()
    }
    #[inline(always)]
    fn load(cell: &Self::Cell) -> Self {
        Self::from_bits(T::Bits::load(cell))
    }
    #[inline(always)]
    fn store(cell: &Self::Cell, value: Self) {
        T::Bits::store(cell, value.to_bits());
    }
}

/// One value that workers share; see the module.
pub struct AtomicCell<T: AtomicValue>(T::Cell);

impl<T: AtomicValue> AtomicCell<T> {
    /// Creates a cell, before any worker can read it.
    #[inline(always)]
    pub fn new(value: T) -> Self {
        Self(value.into_atomic())
    }

    /// Returns the value of before the last barrier, unless the cell has a writer in the present phase.
    #[inline(always)]
    pub fn get(&self) -> T {
        T::load(&self.0)
    }

    /// Sets the value; allowed only to the cell's one writer of the phase.
    #[inline(always)]
    pub fn set(&self, value: T) {
        T::store(&self.0, value);
    }
}

impl AtomicCell<u32> {
    /// Raises the value to `value` if it is smaller; several writers of a phase may do so, because
    /// the outcome is the same in every order.
    #[inline]
    pub fn raise_to(&self, value: u32) {
        self.0.fetch_max(value, Relaxed);
    }
}

impl<T: AtomicValue> Clone for AtomicCell<T> {
    fn clone(&self) -> Self {
        Self::new(self.get())
    }
}

impl<T: AtomicValue> Default for AtomicCell<T> {
    fn default() -> Self {
        Self::new(T::default())
    }
}

impl<T: AtomicValue + std::fmt::Debug> std::fmt::Debug for AtomicCell<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.get().fmt(f)
    }
}

/// One value per slot, shared by the workers.
pub struct AtomicColumn<T: AtomicValue>(Box<[T::Cell]>);

impl<T: AtomicValue> AtomicColumn<T> {
    /// Creates `n` slots that hold `value`.
    pub fn filled(n: usize, value: T) -> Self {
        (0..n).map(|_| value).collect()
    }

    /// Returns the value of a slot, with the same caveat as [`AtomicCell::get`].
    #[inline(always)]
    pub fn get(&self, slot: usize) -> T {
        T::load(&self.0[slot])
    }

    /// Sets a slot; allowed only to its one writer of the phase.
    #[inline(always)]
    pub fn set(&self, slot: usize, value: T) {
        T::store(&self.0[slot], value);
    }

    /// All cells, for loops without bounds checks.
    #[inline(always)]
    pub fn cells(&self) -> &[T::Cell] {
        &self.0
    }

    /// Number of slots.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether there are no slots.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All values in slot order.
    pub fn iter(&self) -> impl Iterator<Item = T> + '_ {
        self.0.iter().map(T::load)
    }

    /// Bytes on the heap: those of the atomics, one per slot.
    pub fn heap_bytes(&self) -> usize {
        std::mem::size_of_val(&*self.0)
    }
}

impl<T: AtomicValue> FromIterator<T> for AtomicColumn<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self(values.into_iter().map(T::into_atomic).collect())
    }
}

impl<T: AtomicValue> Clone for AtomicColumn<T> {
    fn clone(&self) -> Self {
        self.iter().collect()
    }
}

impl<T: AtomicValue + std::fmt::Debug> std::fmt::Debug for AtomicColumn<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl AtomicColumn<u32> {
    /// Adds to a slot's counter, which in practice never wraps (2^32 events).
    #[inline(always)]
    pub fn add(&self, slot: usize, by: u32) {
        self.set(slot, self.get(slot).wrapping_add(by));
    }
}

impl AtomicColumn<u64> {
    /// Adds to a slot's counter; no atomic addition, so allowed only to the slot's one writer of the phase.
    #[inline(always)]
    pub fn add(&self, slot: usize, by: u64) {
        self.set(slot, self.get(slot).wrapping_add(by));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_what_is_set() {
        let column: AtomicColumn<u32> = [1, 2, 3].into_iter().collect();
        column.set(1, 9);
        column.add(2, 4);
        assert_eq!(column.iter().collect::<Vec<_>>(), [1, 9, 7]);
        assert_eq!((column.len(), column.heap_bytes()), (3, 12));
        assert_eq!(format!("{:?}", column.clone()), "[1, 9, 7]");
    }
}
