//! A table of runs.

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnWithRole;

/// Name of the column of cycles done; failed runs have no value in it.
pub(super) const CYCLES: &str = "cycles_run";

/// The role of a column in a table of runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Number of the trial (the column `cell` of files); runs are in its order.
    #[serde(rename = "cell")]
    Trial,
    /// Name of the variant: runs that differ by their seeds alone.
    Variant,
    /// Number of the replicate: equal ones have the same seed in all variants.
    Replicate,
    /// Seed of the run's random draws.
    Seed,
    /// A parameter, equal in all runs of a variant.
    Parameter,
    /// A result of the run. A column of `Bool` is a share.
    Metric,
    /// Digest of the run's last state, in hexadecimal.
    Digest,
    /// A time that the run took: it differs when the run is made again.
    Cost,
    /// The number of cycles done before a row of metrics over time.
    Cycle,
    /// A metric over time: in the table of runs as text, in one of its own a number for each run and cycle.
    Series,
}

/// A column of a table of runs; the name of a parameter is the path of its key.
pub type RunColumn = ColumnWithRole<Role>;

/// A table of runs, with one row per run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunTable {
    /// All of the same length, as [`Self::check`] makes sure.
    pub columns: Vec<RunColumn>,
}

impl RunTable {
    /// Returns the number of rows; 0 without columns.
    pub fn runs(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }

    /// Returns the columns with this role, in order.
    pub fn columns_with_role(&self, role: Role) -> impl Iterator<Item = &RunColumn> {
        self.columns.iter().filter(move |c| c.role == role)
    }

    /// Returns the first column with this name, which columns of different roles may share.
    pub fn column(&self, name: &str) -> Option<&RunColumn> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// Checks that all columns have the same number of runs, and no two with one role the same
    /// name.
    ///
    /// # Errors
    /// When a column is wrong; the error names the first.
    pub fn check(&self) -> Result<(), InputError> {
        let place = "the table of runs";
        let runs = self.runs();
        for (i, column) in self.columns.iter().enumerate() {
            let name = &column.name;
            let rows = column.values.len();
            if rows != runs {
                let cause = format!("the column `{name}` has {rows} rows, others have {runs}");
                return Err(InputError::new(place, cause, "write one row for every run"));
            }
            if self.columns[..i].iter().any(|c| c.name == *name && c.role == column.role) {
                let cause = format!("there are two columns `{name}`");
                return Err(InputError::new(place, cause, "rename one"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::ColumnValues;

    fn column(name: &str, values: ColumnValues) -> RunColumn {
        RunColumn { name: name.into(), role: Role::Metric, values }
    }

    #[test]
    fn columns_of_different_length_or_the_same_name_are_refused() {
        let a = column("a", ColumnValues::I64([Some(1), None].into_iter().collect()));
        let short = column("b", ColumnValues::Bool(vec![true].into()));
        let error = RunTable { columns: vec![a.clone(), short] }.check().unwrap_err();
        assert_eq!(error.cause(), "the column `b` has 1 rows, others have 2");
        let error = RunTable { columns: vec![a.clone(), a.clone()] }.check().unwrap_err();
        assert_eq!(error.cause(), "there are two columns `a`");
        assert!(RunTable { columns: vec![a] }.check().is_ok());
        assert_eq!(RunTable::default().runs(), 0);
    }
}
