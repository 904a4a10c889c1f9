//! Promises of the whole library, seen from outside: one module per promise.

mod closed_loop;
mod common;
mod crowd;
mod determinism;
mod distributions;
mod exactness;
mod laws;
mod obstacle_rule;
mod pomdp;
