#![deny(clippy::disallowed_methods)]
//! Scenario files: TOML text with overrides -> typed sections, and errors that point to their cause.
//!
//! This crate knows the file format that all worlds share; each world defines its own keys. The steps of reading:
//! [`Source`] reads the text and applies overrides (`overrides.rs`) and edits (`edit/`), serde turns it into sections
//! ([`Sections`]) with numbers that check themselves ([`Number`], [`Whole`],
//! [`Point`]), errors of the TOML reader get cause and remedy (`explain.rs`), and a [`Bundle`]
//! gathers a scenario with all the files that it names. The same sections give JSON Schemas for
//! editors and forms ([`schema`]).

mod bundle;
mod checked;
mod edit;
mod explain;
pub mod file;
mod keys;
pub mod kind;
mod locate;
mod meaning;
pub mod network;
mod overrides;
mod remark;
pub mod schema;
mod sections;
mod source;
mod spanned;

pub use bundle::{Bundle, Resolved, Seedless};
pub use checked::{
    AboveBelow, AboveTo, AboveZero, Any, Between, FromBelow, FromTo, FromZero, Limits, NonNegative,
    Number, Point, Positive, Rule, Share, Whole, refused,
};
pub use edit::{Cell, Edit};
pub use explain::nearest;
pub use keys::Key;
pub use kind::{Compiled, Foreign, Kind, Seeds, Worlds};
pub use meaning::{Meaning, Told, told};
pub use remark::{Remark, Severity};
pub use sections::Sections;
pub use source::{FORMAT, Head, Preamble, Source};
pub use spanned::Spanned;
