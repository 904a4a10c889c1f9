//! Ways of a chain to get somewhere, made of motions of its rods.
//!
//! ```text
//! go.rs:     one motion; a base that is fixed is answered by a reach
//! replan.rs: after a veto, rung by rung: shorter, sideways, pulled back, stuck
//! escape.rs: out of the way of what comes too near
//! ```

pub(crate) mod escape;
mod go;
pub(crate) mod replan;
