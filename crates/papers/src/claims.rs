//! What all papers share of claims: a claim, and verdicts over all of something.

use sidestep_document::claim::{Claim, Verdict};

/// A claim by its number and words, its verdict, our figures, and the rule.
pub(crate) fn claim(
    (id, paper): (&'static str, &'static str),
    verdict: Verdict,
    ours: impl Into<String>,
    reason: impl Into<String>,
) -> Claim {
    Claim { id, paper, papers_figure: None, ours: ours.into(), verdict, reason: reason.into() }
}

/// Held if it is so in all of them; lost where there is none.
pub(crate) fn all<T>(them: impl IntoIterator<Item = T>, holds: impl Fn(T) -> bool) -> Verdict {
    let verdicts: Vec<bool> = them.into_iter().map(holds).collect();
    if verdicts.is_empty() { Verdict::Lost } else { Verdict::of(verdicts.iter().all(|&it| it)) }
}

/// Held where all of them are.
pub(crate) fn both(verdicts: &[Verdict]) -> Verdict {
    if verdicts.contains(&Verdict::NotHeld) {
        Verdict::NotHeld
    } else if verdicts.contains(&Verdict::Lost) {
        Verdict::Lost
    } else {
        Verdict::Held
    }
}

/// What there is of each, one after the other.
pub(crate) fn listed<T>(them: impl IntoIterator<Item = T>, told: impl Fn(T) -> String) -> String {
    let words: Vec<String> = them.into_iter().map(told).collect();
    if words.is_empty() { "nothing measured".into() } else { words.join("; ") }
}
