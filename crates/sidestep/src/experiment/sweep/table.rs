//! A table of runs.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sidestep_kernel::InputError;

/// What a column is to the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Number of the cell; runs are taken in its order.
    Cell,
    /// Name of the variant: runs that differ by their seeds alone.
    Variant,
    /// Number of the replicate: the same one has the same seed in all variants.
    Replicate,
    /// The seed.
    Seed,
    /// A parameter, equal in all runs of a variant.
    Parameter,
    /// What came of the run. A column of `Bool` is a share.
    Metric,
    /// Digest of the run.
    Digest,
    /// What the run took, by a clock: not the same when it is made again.
    Cost,
}

/// The values of a column, one a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunValues {
    /// Whole numbers.
    Int(Vec<Option<i64>>),
    /// Numbers.
    Float(Vec<Option<f64>>),
    /// Whether something happened: summed up as a share, with Wilson's interval.
    Bool(Vec<Option<bool>>),
    /// Words.
    Text(Vec<Option<String>>),
}

impl RunValues {
    /// Number of runs.
    pub fn len(&self) -> usize {
        match self {
            Self::Int(values) => values.len(),
            Self::Float(values) => values.len(),
            Self::Bool(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are no runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the values are numbers.
    pub fn is_numeric(&self) -> bool {
        matches!(self, Self::Int(_) | Self::Float(_))
    }

    /// The value of a run as a number; true is 1, false 0, words are none.
    pub fn number(&self, run: usize) -> Option<f64> {
        match self {
            Self::Int(values) => values.get(run).copied().flatten().map(|v| v as f64),
            Self::Float(values) => values.get(run).copied().flatten(),
            Self::Bool(values) => values.get(run).copied().flatten().map(f64::from),
            Self::Text(_) => None,
        }
    }

    /// The value of a run.
    pub fn json(&self, run: usize) -> Value {
        match self {
            Self::Int(values) => values.get(run).copied().flatten().into(),
            Self::Float(values) => values.get(run).copied().flatten().into(),
            Self::Bool(values) => values.get(run).copied().flatten().into(),
            Self::Text(values) => values.get(run).cloned().flatten().into(),
        }
    }

    /// The value of a run in words; what is missing is empty.
    pub fn text(&self, run: usize) -> String {
        let text = match self {
            Self::Int(values) => values.get(run).copied().flatten().map(|v| v.to_string()),
            Self::Float(values) => values.get(run).copied().flatten().map(|v| v.to_string()),
            Self::Bool(values) => values.get(run).copied().flatten().map(|v| v.to_string()),
            Self::Text(values) => values.get(run).cloned().flatten(),
        };
        text.unwrap_or_default()
    }
}

/// A column of a table of runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunColumn {
    /// Its name; of a parameter the path of its key.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// Its values.
    pub values: RunValues,
}

/// A table of runs: a row a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RunTable {
    /// The columns.
    pub columns: Vec<RunColumn>,
}

impl RunTable {
    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }

    /// The columns of this role, in their order.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &RunColumn> {
        self.columns.iter().filter(move |c| c.role == role)
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&RunColumn> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// That all columns have the same number of runs, and no two of a kind the same name.
    ///
    /// # Errors
    /// Names the first column that is wrong.
    pub fn check(&self) -> Result<(), InputError> {
        let wrong =
            |cause: String, remedy: &str| Err(InputError::new("the table of runs", cause, remedy));
        let runs = self.runs();
        for (i, column) in self.columns.iter().enumerate() {
            let (name, rows) = (&column.name, column.values.len());
            if rows != runs {
                let cause = format!("the column `{name}` has {rows} rows, others have {runs}");
                return wrong(cause, "write one row for every run");
            }
            if self.columns[..i].iter().any(|c| c.name == *name && c.role == column.role) {
                return wrong(format!("there are two columns `{name}`"), "rename one");
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, values: RunValues) -> RunColumn {
        RunColumn { name: name.into(), role: Role::Metric, values }
    }

    #[test]
    fn columns_of_different_length_or_the_same_name_are_refused() {
        let a = column("a", RunValues::Int(vec![Some(1), None]));
        let short = column("b", RunValues::Bool(vec![Some(true)]));
        let error = RunTable { columns: vec![a.clone(), short] }.check().unwrap_err();
        assert_eq!(error.cause(), "the column `b` has 1 rows, others have 2");
        let error = RunTable { columns: vec![a.clone(), a.clone()] }.check().unwrap_err();
        assert_eq!(error.cause(), "there are two columns `a`");
        assert!(RunTable { columns: vec![a] }.check().is_ok());
        assert_eq!(RunTable::default().runs(), 0);
    }

    #[test]
    fn values_are_numbers_and_words() {
        let values = RunValues::Bool(vec![Some(true), None]);
        assert_eq!((values.number(0), values.number(1), values.number(9)), (Some(1.0), None, None));
        assert_eq!((values.text(0).as_str(), values.text(1).as_str()), ("true", ""));
        assert_eq!(RunValues::Float(vec![Some(0.5)]).text(0), "0.5");
    }
}
