//! Promises of the whole library, seen from outside: one module per promise.

mod closed_loop;
mod common;
mod distributions;
mod exactness;
mod obstacle_rule;
mod pomdp;
