//! Experiments: many runs under controlled differences, told apart with intervals.
//!
//! ```text
//! farm.rs            runs over workers, results by index
//! estimate.rs        a mean with its 95 % interval and the number of runs behind it
//! claim.rs           a paper's claims, each with a verdict
//! figure.rs          what to draw and what to print, as plain data
//! document.rs        a report: text, tables, figures, pictures and claims in their order
//! scene.rs           what a picture shows, as plain data
//! methods.rs         methods of the airspace world on the same traffic
//! agentfly.rs        the experiments of the airspace world's source paper
//! loria/             the experiments of the robots world's source paper
//! serpentine/        the experiments of the chain world's source
//! sweep/             many variants of one scenario, each with many seeds
//! ```
//!
//! Nothing here draws a figure or writes a file: results are data, reports are documents.

pub mod agentfly;
pub mod claim;
pub mod document;
pub mod estimate;
pub mod farm;
pub mod figure;
pub mod loria;
pub mod methods;
pub mod scene;
pub mod serpentine;
pub mod sweep;

pub use document::Document;
pub use estimate::Estimate;
pub use figure::{Figure, FigureKind, Series, Table};
pub use scene::Scene;
