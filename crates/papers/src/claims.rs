//! What all papers share of claims: their words, and verdicts over all of something.

use serde::Deserialize;
use sidestep_document::claim::{Claim, Verdict};
use std::sync::LazyLock;

/// The claims of a paper, as a file beside its experiments tells them.
pub(crate) type Words = LazyLock<File>;

/// A file of claims.
#[derive(Debug, Deserialize)]
pub(crate) struct File {
    claim: Vec<Told>,
}

/// A claim in words.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Told {
    id: String,
    paper: String,
    papers_figure: Option<String>,
    /// The rule by which it is judged; without one the judgment itself says it.
    #[serde(default)]
    rule: String,
}

impl File {
    /// Reads the claims of a paper.
    pub(crate) fn read(text: &str) -> Self {
        toml::from_str(text).expect("the claims of a paper are right")
    }

    /// A claim by its number, its verdict, and our figures.
    pub(crate) fn claim(&'static self, id: &str, verdict: Verdict, ours: String) -> Claim {
        let told = self.claim.iter().find(|told| told.id == id);
        let told = told.unwrap_or_else(|| panic!("there is no claim `{id}`"));
        let (reason, papers_figure) = (told.rule.clone(), told.papers_figure.as_deref());
        Claim { id: &told.id, paper: &told.paper, papers_figure, ours, verdict, reason }
    }
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
