//! Promises of the library, one module each; every module starts by quoting its promise.

mod airspace;
mod airspace_traffic;
mod batch;
mod chain;
mod chain_distances;
mod chain_input;
mod closed_loop;
mod common;
mod determinism;
mod distributions;
mod exactness;
mod examples;
mod frames;
mod gridlock;
mod inspect;
mod kinds;
mod laws;
mod learned_profiles;
mod obstacle_rule;
mod own_parts;
mod pomdp;
mod radio;
mod recovered_tables;
mod resume;
mod tiles;
