#![deny(clippy::disallowed_methods)]
//! Scenario files: TOML text with overrides -> typed sections, and errors that point to their cause.
//!
//! This crate knows the file format that all worlds share; each world defines its own keys. The steps of reading:
//! [`Source`] reads the text and applies overrides (`overrides.rs`) and edits (`edit/`), serde turns it into sections
//! ([`Sections`]) with numbers that check themselves ([`Number`], [`Integer`],
//! [`Point`]), errors of the TOML reader get cause and remedy (`explain.rs`), and a [`Bundle`]
//! collects a scenario with all the files that it refers to. The same sections give JSON Schemas for
//! editors and forms ([`schema`]).
//!
//! A world is a [`WorldType`]. With [`facts`] and [`editing`] it declares what programs ask of a world that they do not
//! know: orders and rewards of learning agents, recorded positions, and the tools of the studio's page.

mod bundle;
mod by_name;
mod edit;
pub mod editing;
mod explain;
pub mod facts;
pub mod file;
pub mod import_report;
mod keys;
mod locate;
mod metric_info;
pub mod network;
mod number;
mod overrides;
mod remark;
pub mod schema;
mod sections;
mod source;
mod spanned;
pub mod world_type;

pub use bundle::{Bundle, ResolvedScenario, SeedTemplate};
pub use by_name::ByName;
pub use edit::{CharEdit, Edit};
pub use editing::Editing;
pub use explain::suggestion;
pub use facts::WorldFacts;
pub use import_report::{ImportReport, Treatment};
pub use keys::Key;
pub use metric_info::{MetricInfo, MetricLabel, metric_label};
#[doc(hidden)]
pub use metric_info::{phrase, phrase_len};
pub use number::{
    AboveZero, AnyFinite, AtLeastZero, Closed, FixedList, Fraction, Integer, Interval, LeftOpen,
    NonNegative, Number, NumberRange, Open, Point, Positive, RightOpen, Rule, invalid_value,
};
pub use remark::{Remark, Severity};
pub use sections::Sections;
pub use source::{FORMAT, Head, Preamble, Source};
pub use spanned::Spanned;
pub use world_type::{
    CompiledScenario, ImportOptions, ImportedScenario, SeedEffect, WorldType, Worlds,
};
