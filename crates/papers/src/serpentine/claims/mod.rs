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
pub use sidestep_document::claim::{Claim, Verdict};

/// All claims, judged.
pub fn judge(report: &Report) -> Vec<Claim> {
    let mut claims = chains::claims(report);
    claims.extend(swarms::claims(report));
    claims
}

/// A claim by its verdict.
fn claim(
    (id, paper): (&'static str, &'static str),
    verdict: Verdict,
    ours: String,
    reason: &str,
) -> Claim {
    Claim { id, paper, papers_figure: None, ours, verdict, reason: reason.into() }
}

/// Held if it is so in all of them; lost where there is none.
fn all<T>(them: impl IntoIterator<Item = T>, holds: impl Fn(T) -> bool) -> Verdict {
    let verdicts: Vec<bool> = them.into_iter().map(holds).collect();
    if verdicts.is_empty() { Verdict::Lost } else { Verdict::of(verdicts.iter().all(|&it| it)) }
}

/// Held where all of them are.
fn both(verdicts: &[Verdict]) -> Verdict {
    if verdicts.contains(&Verdict::NotHeld) {
        Verdict::NotHeld
    } else if verdicts.contains(&Verdict::Lost) {
        Verdict::Lost
    } else {
        Verdict::Held
    }
}

/// What there is of each, one after the other.
fn listed<T>(them: impl IntoIterator<Item = T>, told: impl Fn(T) -> String) -> String {
    let words: Vec<String> = them.into_iter().map(told).collect();
    if words.is_empty() { "nothing measured".into() } else { words.join("; ") }
}
