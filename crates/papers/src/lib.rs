//! The experiments of three papers, run anew, and what came of their claims.
//!
//! ```text
//! agentfly.rs   the source paper of the airspace world
//! loria/        the source paper of the robots world
//! serpentine/   the source of the chain world
//! methods.rs    methods of the airspace world on the same traffic
//! farm.rs       runs over workers, results by index
//! ```
//!
//! Nothing here draws a figure or writes a file: results are data, reports are documents.

pub mod agentfly;
pub mod farm;
pub mod loria;
pub mod methods;
pub mod serpentine;
