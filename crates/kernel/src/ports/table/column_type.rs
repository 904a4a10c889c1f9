//! The types that a column can have.

/// The type of all values of a column, which recordings keep exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnType {
    /// Unsigned 32-bit integers.
    U32,
    /// Unsigned 64-bit integers.
    U64,
    /// Signed 32-bit integers.
    I32,
    /// Signed 64-bit integers.
    I64,
    /// Double precision floats.
    F64,
    /// Truth values.
    Bool,
    /// Short text from a small vocabulary, stored as an index into `labels`.
    Label,
    /// Text of any length, stored as it is.
    Text,
}

impl ColumnType {
    /// Every type once, in the order of declaration.
    pub const ALL: [Self; 8] = [
        Self::U32,
        Self::U64,
        Self::I32,
        Self::I64,
        Self::F64,
        Self::Bool,
        Self::Label,
        Self::Text,
    ];

    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::I32 => "i32",
            Self::I64 => "i64",
            Self::F64 => "f64",
            Self::Bool => "bool",
            Self::Label => "label",
            Self::Text => "text",
        }
    }

    /// The type of this [name](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ty| ty.name() == name)
    }
}
