//! Experiments: many runs under controlled differences, told apart with intervals.
//!
//! `sweep/` runs many variants of one scenario, each with many seeds, and sums up what came of them
//! as tables and figures: plain data of `sidestep_document`, which others draw.

pub mod sweep;
