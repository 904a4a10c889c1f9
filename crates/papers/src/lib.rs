//! The experiments of three papers, run again, a study of our own, and the verdicts on their claims.
//!
//! ```text
//! agentfly.rs      the source paper of the airspace world; agentfly/ has its flights over real sockets
//! loria/           the source paper of the robots world
//! serpentine/      the source of the chain world
//! mapf/            a study of planners and of deciding alone, on wheels that err
//! methods.rs       methods of the airspace world on the same traffic
//! study.rs         a sweep file and its scenario -> the table of its runs
//! scene.rs         the content of a picture
//! case_results.rs  the table of runs -> results of every case: as JSON, a table, points of figures
//! claims.rs        verdicts over results
//! trial_file.rs    the trials that have ended, for experiments that go on after an interrupt
//! ```
//!
//! Beside the sources stand the data: `scenarios/` with scenarios and sweeps, `claims/` with the claims of each paper, the rules
//! by which they are judged, and the numbers with which rules compare. Each experiment has one constant table of its columns.
//!
//! Nothing here draws a figure or writes a report: results are data, reports are documents.

pub mod agentfly;
mod case_results;
mod claims;

pub mod loria;
pub mod mapf;
pub mod methods;
mod scene;
pub mod serpentine;
mod study;
mod trial_file;

pub use scene::Scene;
pub use study::Progress;
pub use trial_file::{TrialFile, TrialFileError, TrialFileHead};
