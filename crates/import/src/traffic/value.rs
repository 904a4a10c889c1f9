//! Cells of any source.

/// A cell as its file holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    /// An empty cell, or one that says that it has no value.
    Missing,
    Number(f64),
    Flag(bool),
    Text(&'a str),
}

/// Words that stand for no value.
const NO_VALUE: [&str; 8] = ["nan", "null", "none", "n/a", "na", "nat", "<na>", "-"];

impl<'a> Value<'a> {
    /// Returns a cell of a text file.
    pub(super) fn from_text(text: &'a str) -> Self {
        let text = text.trim();
        let is_word =
            text.len() <= 4 && NO_VALUE.iter().any(|word| text.eq_ignore_ascii_case(word));
        if text.is_empty() || is_word { Self::Missing } else { Self::Text(text) }
    }

    /// Returns the cell as a finite number; `None` where there is no value.
    ///
    /// # Errors
    /// When it is something else.
    pub(super) fn number(self) -> Result<Option<f64>, NotANumber> {
        match self {
            Self::Missing => Ok(None),
            Self::Number(value) if value.is_nan() => Ok(None),
            Self::Number(value) if value.is_finite() => Ok(Some(value)),
            Self::Text(text) => match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(NotANumber),
            },
            Self::Number(_) | Self::Flag(_) => Err(NotANumber),
        }
    }

    /// Returns the cell as yes or no, where it is that.
    pub(super) fn flag(self) -> Option<bool> {
        match self {
            Self::Flag(flag) => Some(flag),
            Self::Number(0.0) => Some(false),
            Self::Number(1.0 | -1.0) => Some(true),
            Self::Text(text) => match text.to_ascii_lowercase().as_str() {
                "true" | "t" | "yes" | "y" | "1" | "1.0" | "-1" => Some(true),
                "ground" | "on ground" | "gnd" => Some(true),
                "false" | "f" | "no" | "n" | "0" | "0.0" => Some(false),
                "air" | "in air" | "airborne" => Some(false),
                _ => None,
            },
            Self::Missing | Self::Number(_) => None,
        }
    }

    /// Returns the cell as a name; empty where there is none.
    pub(super) fn name(self) -> String {
        match self {
            Self::Missing | Self::Flag(_) => String::new(),
            Self::Number(value) => value.to_string(),
            Self::Text(text) => text.trim().to_owned(),
        }
    }
}

/// A cell that should be a number and is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NotANumber;
