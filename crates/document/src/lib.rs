//! A report as plain data; other crates draw figures and write pages.
//!
//! ```text
//! estimate.rs   a mean with its 95 % interval and the number of runs behind it
//! figure.rs     figures and tables
//! claim.rs      a paper's claims, each with a verdict
//! document.rs   a report: text, tables, figures, pictures and claims in their order
//! ```
//!
//! It depends on no world, file or markup, and has neither font nor rasterizer, because both
//! the library that summarizes runs and the crate that writes pages depend on it.

pub mod claim;
pub mod document;
pub mod estimate;
pub mod figure;

pub use document::Document;
pub use estimate::Estimate;
pub use figure::{Figure, FigureKind, Series, Table};
