//! Reasons for refusing a picture.

/// A picture that cannot be drawn, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// Two lists that belong together differ in length.
    #[error("{what}: {found} given, {expected} needed")]
    Length {
        /// The list that is too short or too long.
        what: &'static str,
        /// Number of entries that the other input requires.
        expected: usize,
        /// Number of entries that it has.
        found: usize,
    },
    /// A number that no picture can be drawn with, such as a box of -1 m.
    #[error("{what} is {value}; it must be {must}")]
    Value {
        /// The quantity, with its unit.
        what: &'static str,
        /// The given value, which may be infinite or no number.
        value: f64,
        /// The condition that a right value meets.
        must: &'static str,
    },
    /// A view of a plane from elsewhere than above.
    #[error("there is no view {0}: everything lies in a plane, which is seen from above")]
    FlatView(String),
    /// A picture that would take too much memory.
    #[error("{what}: {found} asked for, at most {limit} can be drawn")]
    TooLarge {
        /// The part that is too large, e.g. boxes of a map.
        what: &'static str,
        /// The requested amount.
        found: u64,
        /// The largest possible amount.
        limit: u64,
    },
    /// The text given to [`to_png`](crate::to_png) is no SVG.
    #[error("not an SVG picture: {0}")]
    Svg(String),
    /// The PNG encoder failed.
    #[error("the PNG cannot be encoded: {0}")]
    Png(String),
    /// Bytes that are no font.
    #[error("not a font of TrueType or OpenType")]
    Font,
    /// The content of a PDF cannot be compressed.
    #[error("the PDF cannot be written: {0}")]
    Pdf(String),
}

impl DrawError {
    /// Returns `value` if it is finite and above zero.
    pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 {
            return Ok(value);
        }
        Err(Self::Value { what, value, must: "finite and above zero" })
    }

    /// Checks that `found` equals `expected`.
    pub(crate) fn length(what: &'static str, expected: usize, found: usize) -> Result<(), Self> {
        if expected == found { Ok(()) } else { Err(Self::Length { what, expected, found }) }
    }
}
