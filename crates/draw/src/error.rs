//! What a picture can be refused for.

/// A picture that cannot be drawn, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// Two lists that belong together differ in length.
    #[error("{what}: {found} given, {expected} needed")]
    Length {
        /// The list that is too short or too long.
        what: &'static str,
        /// How many entries the other input asks for.
        expected: usize,
        /// How many entries it has.
        found: usize,
    },
    /// A number that no picture can be drawn with, such as a box of -1 m.
    #[error("{what} is {value}; it must be {must}")]
    Value {
        /// The quantity, with its unit.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What would be right.
        must: &'static str,
    },
    /// A picture larger than memory should be spent on.
    #[error("{what}: {found} asked for, at most {limit} can be drawn")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much was asked for.
        found: u64,
        /// How much is possible.
        limit: u64,
    },
    /// The text given to [`to_png`](crate::to_png) is no SVG.
    #[error("not an SVG picture: {0}")]
    Svg(String),
    /// The PNG encoder failed.
    #[error("the PNG cannot be encoded: {0}")]
    Png(String),
}

impl DrawError {
    /// Passes `value` on if it is finite and above zero.
    pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 {
            return Ok(value);
        }
        Err(Self::Value { what, value, must: "finite and above zero" })
    }

    /// Passes if there is at least one of `what`.
    pub(crate) fn some(what: &'static str, count: usize) -> Result<(), Self> {
        Self::positive(what, count as f64).map(drop)
    }

    /// Passes if `found` equals `expected`.
    pub(crate) fn length(what: &'static str, expected: usize, found: usize) -> Result<(), Self> {
        if expected == found { Ok(()) } else { Err(Self::Length { what, expected, found }) }
    }
}
