//! Promises of the library, one module each; every module begins by quoting its promise.

mod common;
mod determinism;
mod laws;
