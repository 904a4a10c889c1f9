//! The columns of a table: name, type, unit and meaning.

use super::column_type::ColumnType;
use super::unit::split_unit;
use super::values::ColumnValues;

/// One column: name with its unit (`distance_m`), type and meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnSpec {
    /// Name; ends in the unit where the quantity has one.
    pub name: String,
    /// Type of its values, which blocks have to match.
    pub ty: ColumnType,
    /// One sentence for the reader of the file.
    pub meaning: String,
    /// The vocabulary of a [`ColumnType::Label`] column, empty for others.
    pub labels: Vec<String>,
    /// Whether values may be missing; a block with a missing one is refused otherwise.
    pub is_nullable: bool,
}

impl ColumnSpec {
    /// Creates a column without labels and without missing values.
    pub fn new(name: &str, ty: ColumnType, meaning: &str) -> Self {
        let (name, meaning) = (name.into(), meaning.into());
        Self { name, ty, meaning, labels: Vec::new(), is_nullable: false }
    }

    /// Creates a column of labels, without missing values.
    pub fn label<L: Into<String>>(
        name: &str,
        meaning: &str,
        labels: impl IntoIterator<Item = L>,
    ) -> Self {
        let labels = labels.into_iter().map(Into::into).collect();
        Self { labels, ..Self::new(name, ColumnType::Label, meaning) }
    }

    /// Returns the value in `row` as text, as [`ColumnValues::write`] writes it.
    pub fn text(&self, values: &ColumnValues, row: usize) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = values.write(row, &self.labels, &mut text);
        text
    }

    /// Returns the unit of its values, where its name ends in one.
    pub fn unit(&self) -> Option<&'static str> {
        split_unit(&self.name).1
    }
}

/// One table: name, columns, and facts about all of its rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableSchema {
    /// File stem, e.g. `trajectories`.
    pub name: String,
    /// The columns, in the order of the values of a block.
    pub columns: Vec<ColumnSpec>,
    /// Facts without which the rows cannot be read in full, by name: the side of a box, the kinds of
    /// bodies. A name ends in the unit where the fact has one.
    pub about: Vec<(String, String)>,
}

impl TableSchema {
    /// Creates a table without further facts.
    pub fn new(name: impl Into<String>, columns: Vec<ColumnSpec>) -> Self {
        Self { name: name.into(), columns, about: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_survive_their_names_and_units_are_those_of_names() {
        for ty in ColumnType::ALL {
            assert_eq!(ColumnType::from_name(ty.name()), Some(ty));
        }
        assert_eq!(ColumnType::from_name("complex"), None);
        let unit = |name| ColumnSpec::new(name, ColumnType::F64, "").unit();
        assert_eq!((unit("x_m"), unit("max_speed_m_s")), (Some("m"), Some("m/s")));
        assert_eq!((unit("entity"), unit("bytes")), (None, None));
    }
}
