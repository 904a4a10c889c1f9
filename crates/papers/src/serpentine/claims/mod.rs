//! The slides' claims, each with our figures and a verdict that follows from them by rule.
//!
//! The letters stand for parts of the slides: P problem, V virtual model, R relations, A reactions,
//! N navigation, E experiments and conclusions, F future work. A small letter separates several
//! claims of one statement.

mod chains;
mod swarms;
#[cfg(test)]
mod tests;

use super::SerpentineReport;
use crate::claims::{
    ClaimsFile, PaperClaims, ThresholdTest, combined_verdict, join_texts, judge_all_runs,
    judge_all_trials, judge_every_run, judge_thresholds,
};
use sidestep_document::claim::{Claim, Verdict};

/// Claims about all chains first, then those about swarms.
pub(super) fn judge(report: &SerpentineReport) -> Vec<Claim> {
    let mut claims = chains::claims(report);
    claims.extend(swarms::claims(report));
    claims
}

/// Words, rules and thresholds of the claims.
pub(super) static CLAIMS: PaperClaims =
    PaperClaims::new(|| ClaimsFile::read(include_str!("../../../claims/serpentine.toml")));

/// Words and rule of the claim are those of its file.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    CLAIMS.claim(id, verdict, ours.into())
}
