//! What is counted, one file per measure.

pub(crate) mod circles;
pub(crate) mod clones;
pub(crate) mod comments;
pub(crate) mod functions;
pub(crate) mod long;
pub(crate) mod public;
pub(crate) mod size;
pub(crate) mod tuples;
