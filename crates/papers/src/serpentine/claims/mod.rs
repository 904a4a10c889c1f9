//! The slides' claims, each with our figures and a verdict that follows from them by rule.
//!
//! Numbers are those of the study of the slides: P problem, V virtual model, R relations, A
//! reactions, N navigation, E experiments and conclusions, F what they leave for the future. A
//! letter tells apart what one statement claims at once.

mod chains;
mod swarms;
#[cfg(test)]
mod tests;

use super::Report;
use crate::claims::{File, Words, all, both, listed};
use sidestep_document::claim::{Claim, Verdict};

/// All claims, judged.
pub(super) fn judge(report: &Report) -> Vec<Claim> {
    let mut claims = chains::claims(report);
    claims.extend(swarms::claims(report));
    claims
}

/// The words of the report.
pub(super) static WORDS: Words = Words::new(|| File::read(include_str!("../report.toml")));

/// A claim by its number, its verdict, and our figures.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    WORDS.claim(id, verdict, ours.into())
}
