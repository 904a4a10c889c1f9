//! Foreign files read into our own types; a wrong file is an [`InputError`](crate::kernel::InputError), never a panic.

pub mod carmen;
pub mod mrclam;
pub mod table;
