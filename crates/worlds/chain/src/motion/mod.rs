//! Paths of a chain to a place, made of motions of its rods.
//!
//! ```text
//! request.rs:  one motion; the objection of a fixed base is answered by a reach
//! recovery.rs: after a veto, rung by rung: shorter, sideways, pulled back, stuck
//! escape.rs:   evasion of obstacles that come too near
//! ```

pub(crate) mod escape;
pub(crate) mod recovery;
pub(crate) mod request;
