//! The paper's claims, each with our figures and a verdict that follows from them by rule.
//!
//! The claims are numbered E-1 to E-15 (experiments) and P-3 (parallelization); a letter separates
//! several claims of one sentence.

mod behaviour;
mod setting;
#[cfg(test)]
mod tests;
mod time;

use super::LoriaReport;
use super::performance::PerformanceResults;
use crate::claims::{ClaimsFile, PaperClaims, ThresholdTest, judge_every_run, judge_thresholds};
use sidestep_document::claim::{Claim, Verdict};

/// In the order of the paper.
pub(super) fn judge(report: &LoriaReport) -> Vec<Claim> {
    let mut claims = setting::claims(report);
    claims.extend(behaviour::claims(report));
    claims.extend(time::claims(report));
    claims
}

/// Words, rules and thresholds of the claims.
pub(super) static CLAIMS: PaperClaims =
    PaperClaims::new(|| ClaimsFile::read(include_str!("../../../claims/loria.toml")));

/// Words and rule of the claim are those of its file.
fn claim(id: &str, verdict: Verdict, ours: impl Into<String>) -> Claim {
    CLAIMS.claim(id, verdict, ours.into())
}

/// Returns a claim whose rule states the number of processors of the machine at hand.
fn with_processors(performance: &PerformanceResults, claim: Claim) -> Claim {
    let reason = claim.reason.replace("{processors}", &performance.processors.to_string());
    Claim { reason, ..claim }
}
