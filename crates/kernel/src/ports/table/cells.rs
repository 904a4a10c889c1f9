//! ColumnValues side by side, and a mask of the missing ones.

use std::ops::Deref;

/// A mask of the cells that have a value; without a mask all have one, which is the common case and then costs no
/// memory.
#[derive(Debug, Clone, PartialEq, Default)]
struct ValidityMask(Option<Vec<bool>>);

impl ValidityMask {
    /// Drops the mask where nothing is missing, so that equal cells have equal masks.
    fn from_valid_flags(valid: Vec<bool>) -> Self {
        Self((!valid.iter().all(|valid| *valid)).then_some(valid))
    }

    fn is_valid(&self, row: usize) -> bool {
        self.0.as_ref().is_none_or(|valid| valid[row])
    }

    /// Appends `more` entries, all `valid`, to `rows`.
    fn extend(&mut self, rows: usize, more: usize, valid: bool) {
        if self.0.is_none() && (valid || more == 0) {
            return;
        }
        self.0.get_or_insert_with(|| vec![true; rows]).resize(rows + more, valid);
    }

    /// Makes it `rows` long instead of `before`; new cells are missing.
    fn resize(&mut self, before: usize, rows: usize) {
        if rows >= before {
            self.extend(before, rows - before, false);
        } else if let Some(mut valid) = self.0.take() {
            valid.truncate(rows);
            *self = Self::from_valid_flags(valid);
        }
    }

    /// Appends the entries of another mask, which has `more` rows, to `rows`.
    fn append(&mut self, rows: usize, other: &Self, more: usize) {
        match &other.0 {
            None => self.extend(rows, more, true),
            Some(other) => self.0.get_or_insert_with(|| vec![true; rows]).extend(other),
        }
    }

    fn retain(&mut self, keep: &[bool]) {
        if let Some(mut valid) = self.0.take() {
            retain(&mut valid, keep);
            *self = Self::from_valid_flags(valid);
        }
    }

    fn gather_rows(&self, order: &[usize]) -> Self {
        match &self.0 {
            Some(valid) => Self::from_valid_flags(order.iter().map(|&row| valid[row]).collect()),
            None => Self::default(),
        }
    }
}

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next().copied().unwrap_or(false));
}

/// The cells of a column of numbers or truth values, some of which may be missing.
///
/// Dereferences to the values as they lie in memory, where a missing one is the type's default;
/// [`get`](Self::get) distinguishes missing ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells<T> {
    values: Vec<T>,
    mask: ValidityMask,
}

impl<T> Cells<T> {
    /// Returns the value in `row`; `None` where it is missing or there is no such row.
    pub fn get(&self, row: usize) -> Option<&T> {
        self.values.get(row).filter(|_| self.mask.is_valid(row))
    }

    /// Iterates over all cells; `None` stands for a missing value.
    pub fn iter_with_missing(&self) -> impl Iterator<Item = Option<&T>> {
        (0..self.values.len()).map(|row| self.get(row))
    }

    /// Returns a mask of the cells that have a value; `None` where all have one.
    pub fn valid(&self) -> Option<&[bool]> {
        self.mask.0.as_deref()
    }

    /// Returns the values as they lie in memory, and the mask of those that are not missing, without a copy.
    pub fn into_parts(self) -> (Vec<T>, Option<Vec<bool>>) {
        (self.values, self.mask.0)
    }

    /// Keeps the cells at which `keep` (of the same length) is true.
    pub fn retain_rows(&mut self, keep: &[bool]) {
        retain(&mut self.values, keep);
        self.mask.retain(keep);
    }
}

impl<T: Clone + Default> Cells<T> {
    /// Appends a cell; `None` is a missing value.
    pub fn push(&mut self, value: Option<T>) {
        self.mask.extend(self.values.len(), 1, value.is_some());
        self.values.push(value.unwrap_or_default());
    }

    /// Makes the column `rows` long; new cells are missing.
    pub fn resize(&mut self, rows: usize) {
        self.mask.resize(self.values.len(), rows);
        self.values.resize(rows, T::default());
    }

    /// Appends the cells of `more`; missing ones stay missing.
    pub fn append(&mut self, more: &Self) {
        self.mask.append(self.values.len(), &more.mask, more.values.len());
        self.values.extend_from_slice(&more.values);
    }

    /// Returns the cells of these rows, in this order; a row may occur several times.
    #[must_use]
    pub fn gather_rows(&self, order: &[usize]) -> Self {
        let values = order.iter().map(|&row| self.values[row].clone()).collect();
        Self { values, mask: self.mask.gather_rows(order) }
    }
}

impl<T> Default for Cells<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> Deref for Cells<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

impl<'a, T> IntoIterator for &'a Cells<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.iter()
    }
}

impl<T> From<Vec<T>> for Cells<T> {
    fn from(values: Vec<T>) -> Self {
        Self { values, mask: ValidityMask::default() }
    }
}

impl<T> FromIterator<T> for Cells<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        values.into_iter().collect::<Vec<T>>().into()
    }
}

impl<T: Clone + Default> FromIterator<Option<T>> for Cells<T> {
    fn from_iter<I: IntoIterator<Item = Option<T>>>(values: I) -> Self {
        let values = values.into_iter();
        let mut cells = Self::default();
        cells.values.reserve(values.size_hint().0);
        values.for_each(|value| cells.push(value));
        cells
    }
}

/// The cells of a column of text, some of which may be missing: one string, and the end of each
/// cell in it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextCells {
    text: String,
    ends: Vec<usize>,
    mask: ValidityMask,
}

impl TextCells {
    /// Returns the text in `row`; `None` where it is missing or there is no such row.
    pub fn get(&self, row: usize) -> Option<&str> {
        let end = *self.ends.get(row).filter(|_| self.mask.is_valid(row))?;
        Some(&self.text[self.start_offset(row)..end])
    }

    fn start_offset(&self, row: usize) -> usize {
        row.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    /// Iterates over all cells; `None` stands for a missing text.
    pub fn iter_with_missing(&self) -> impl Iterator<Item = Option<&str>> {
        (0..self.ends.len()).map(|row| self.get(row))
    }

    /// Returns all texts without separators; [`end_offsets`](Self::end_offsets) divides them.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the end of each text, in bytes of [`text`](Self::text); a text starts where the
    /// previous one ends.
    pub fn end_offsets(&self) -> &[usize] {
        &self.ends
    }

    /// Returns a mask of the cells that have a text; `None` where all have one.
    pub fn valid(&self) -> Option<&[bool]> {
        self.mask.0.as_deref()
    }

    /// Number of cells, missing ones included.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Appends a cell; `None` is a missing text, unlike an empty one.
    pub fn push(&mut self, text: Option<&str>) {
        self.mask.extend(self.ends.len(), 1, text.is_some());
        self.text.push_str(text.unwrap_or_default());
        self.ends.push(self.text.len());
    }

    /// Makes the column `rows` long; new cells are missing.
    pub fn resize(&mut self, rows: usize) {
        self.mask.resize(self.ends.len(), rows);
        self.ends.resize(rows, self.text.len());
        self.text.truncate(self.start_offset(rows));
    }

    /// Appends the cells of `more`; missing ones stay missing.
    pub fn append(&mut self, more: &Self) {
        more.iter_with_missing().for_each(|text| self.push(text));
    }

    /// Keeps the cells at which `keep` (of the same length) is true.
    pub fn retain_rows(&mut self, keep: &[bool]) {
        *self = self
            .iter_with_missing()
            .zip(keep)
            .filter(|(_, keep)| **keep)
            .map(|(text, _)| text)
            .collect();
    }

    /// Returns the cells of these rows, in this order; a row may occur several times.
    #[must_use]
    pub fn gather_rows(&self, order: &[usize]) -> Self {
        order.iter().map(|&row| self.get(row)).collect()
    }
}

impl<S: AsRef<str>> FromIterator<Option<S>> for TextCells {
    fn from_iter<I: IntoIterator<Item = Option<S>>>(texts: I) -> Self {
        let mut cells = Self::default();
        texts.into_iter().for_each(|text| cells.push(text.as_ref().map(AsRef::as_ref)));
        cells
    }
}

impl FromIterator<String> for TextCells {
    fn from_iter<I: IntoIterator<Item = String>>(texts: I) -> Self {
        texts.into_iter().map(Some).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn cells_are_a_list_of_options(
            a in proptest::collection::vec(any::<Option<i64>>(), 0..9),
            b in proptest::collection::vec(any::<Option<i64>>(), 0..9),
            keep in proptest::collection::vec(any::<bool>(), 18),
        ) {
            let mut list: Vec<Option<i64>> = [&a[..], &b[..], &[None; 2]].concat();
            let words = |list: &[Option<i64>]| -> TextCells {
                list.iter().map(|v| v.map(|v| v.to_string())).collect()
            };
            let mut cells: Cells<i64> = a.iter().copied().collect();
            let mut texts = words(&a);
            cells.append(&b.iter().copied().collect());
            texts.append(&words(&b));
            for rows in [list.len(), list.len() - list.len() / 3] {
                cells.resize(rows);
                texts.resize(rows);
                list.truncate(rows);
                prop_assert_eq!(&cells, &list.iter().copied().collect());
                prop_assert_eq!(&texts, &words(&list));
            }

            let order: Vec<usize> = (0..list.len()).rev().collect();
            list.reverse();
            (cells, texts) = (cells.gather_rows(&order), texts.gather_rows(&order));
            retain(&mut list, &keep[..order.len()]);
            cells.retain_rows(&keep[..order.len()]);
            texts.retain_rows(&keep[..order.len()]);
            prop_assert_eq!(cells.iter_with_missing().map(Option::<&i64>::copied).collect::<Vec<_>>(), list.clone());
            prop_assert_eq!(cells.valid().is_some(), list.contains(&None));
            prop_assert_eq!(texts, words(&list));
        }
    }

    #[test]
    fn nothing_is_masked_where_nothing_is_missing() {
        let cells: Cells<u32> = [Some(1), None, Some(3)].into_iter().collect();
        assert_eq!((&cells[..], cells.valid()), (&[1, 0, 3][..], Some(&[true, false, true][..])));
        assert_eq!((cells.get(1), cells.get(2), cells.get(3)), (None, Some(&3), None));
        assert_eq!(cells.gather_rows(&[2, 0]), vec![3, 1].into());
        assert_eq!([Some(1), Some(2)].into_iter().collect::<Cells<u32>>().valid(), None);
    }
}
