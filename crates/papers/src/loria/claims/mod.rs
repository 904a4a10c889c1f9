//! The paper's claims, each with our figures and a verdict that follows from them by rule.
//!
//! The claims are numbered E-1 to E-15 (experiments) and P-3 (parallelization); a letter separates
//! several claims of one sentence.

mod behaviour;
mod setting;
#[cfg(test)]
mod tests;
mod time;

use super::Report;
use crate::claims::{Comparison, File, Words, in_every_run, judged};
use sidestep_document::claim::{Claim, Verdict};

/// Judges all claims.
pub(super) fn judge(report: &Report) -> Vec<Claim> {
    let mut claims = setting::claims(report);
    claims.extend(behaviour::claims(report));
    claims.extend(time::claims(report));
    claims
}

/// The words of the report.
pub(super) static WORDS: Words = Words::new(|| File::read(include_str!("../report.toml")));

/// Returns a claim by its number, its verdict, and our figures.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    WORDS.claim(id, verdict, ours.into())
}
