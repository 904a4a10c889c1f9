//! Sparse rows, one after the other in memory.

/// A matrix by rows; an entry is any type that holds its column and value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SparseMatrix<T> {
    ends: Vec<usize>,
    entries: Vec<T>,
}

impl<T> Default for SparseMatrix<T> {
    fn default() -> Self {
        Self { ends: Vec::new(), entries: Vec::new() }
    }
}

impl<T> SparseMatrix<T> {
    /// Appends a row.
    pub(super) fn push(&mut self, row: impl IntoIterator<Item = T>) {
        self.entries.extend(row);
        self.ends.push(self.entries.len());
    }

    pub(super) fn row(&self, index: usize) -> &[T] {
        let begin = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.entries[begin..self.ends[index]]
    }

    /// Returns all rows in order.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[T]> {
        (0..self.ends.len()).map(|index| self.row(index))
    }

    /// Returns the number of entries of all rows.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were_pushed() {
        let mut sparse = SparseMatrix::default();
        sparse.push([1, 2]);
        sparse.push([]);
        sparse.push([3]);
        assert_eq!(sparse.rows().collect::<Vec<_>>(), [&[1, 2][..], &[], &[3]]);
        assert_eq!(sparse.len(), 3);
    }
}
