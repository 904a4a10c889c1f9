//! The measures that are counted, one file each.

pub(crate) mod circles;
pub(crate) mod clones;
pub(crate) mod comments;
pub(crate) mod functions;
pub(crate) mod long;
pub(crate) mod public;
pub(crate) mod size;
pub(crate) mod tuples;
