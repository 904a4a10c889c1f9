//! Experiments: many runs under controlled differences, compared with confidence intervals.
//!
//! `sweep/` runs many variants of one scenario, each with many seeds, and summarizes the results as
//! tables and figures: plain data of `sidestep_document`, which other crates draw.

pub mod sweep;
