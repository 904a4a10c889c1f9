//! Promises of the library, one module each; every module begins by quoting its promise.

mod airspace;
mod airspace_traffic;
mod chain_distances;
mod chain;
mod chain_input;
mod closed_loop;
mod common;
mod determinism;
mod distributions;
mod exactness;
mod laws;
mod obstacle_rule;
mod pomdp;
mod tiles;
