//! Claims of a paper, and our verdicts on them.

use serde::Serialize;

/// Our verdict on a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Our figures agree.
    Held,
    /// Our figures disagree, or agree under some conditions only.
    Refuted,
    /// Our figures decide nothing: an interval contains the threshold, there were too few runs, or the
    /// machine was not quiet or large enough.
    Undecided,
    /// It can no longer be judged: the quantities that the paper measured or compared are lost.
    Lost,
    /// It only describes the runs, so there is nothing to judge.
    Setting,
}

impl Verdict {
    /// All verdicts, those that are counted first.
    pub const ALL: [Self; 5] =
        [Self::Held, Self::Refuted, Self::Undecided, Self::Lost, Self::Setting];

    /// Returns its word, as reports and their JSON have it.
    pub fn name(self) -> &'static str {
        ["held", "refuted", "undecided", "lost", "setting"][self as usize]
    }
}

/// A claim of the paper, with our figures and verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Number, with a letter if one sentence of the paper makes several claims.
    pub id: &'static str,
    /// The paper's statement, in our words.
    pub paper: &'static str,
    /// The paper's own figure, if it states one. None of the three papers gives an interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub papers_figure: Option<&'static str>,
    /// Our figures, with intervals and numbers of runs.
    pub ours: String,
    /// The verdict, by the rule in `reason`.
    pub verdict: Verdict,
    /// The rule by which the verdict follows, and its limits.
    pub reason: String,
}

impl Claim {
    /// Adds the figure that the paper states.
    #[must_use]
    pub fn with_paper_figure(self, figure: &'static str) -> Self {
        Self { papers_figure: Some(figure), ..self }
    }
}

/// Returns the number of claims with this verdict, for the summary above them.
pub fn count(claims: &[Claim], verdict: Verdict) -> usize {
    claims.iter().filter(|claim| claim.verdict == verdict).count()
}

/// Summarizes the verdicts on all claims in a sentence, with the words of [`Verdict::name`].
pub fn verdict_summary(claims: &[Claim]) -> String {
    let judged: Vec<String> = Verdict::ALL
        .iter()
        .filter(|verdict| **verdict != Verdict::Setting)
        .map(|verdict| format!("{} {}", count(claims, *verdict), verdict.name()))
        .collect();
    let settings = count(claims, Verdict::Setting);
    let mut summary = format!("Of {} claims: {}.", claims.len() - settings, judged.join(", "));
    if settings > 0 {
        summary += &format!(" Not counted: {settings} {}.", Verdict::Setting.name());
    }
    summary
}

/// An explanation of a list of claims.
pub const READING_NOTE: &str = "Every verdict follows from the figures by the rule in its row; intervals are \
                        95 %, and fewer than 5 runs decide nothing but a counterexample. `held`: each \
                        comparison of the claim is on its side of the threshold. `refuted`: one is \
                        on the other side (of several by Holm's correction), or a run breaks what \
                        was to hold in every run. `undecided`: neither. `lost`: what the paper \
                        measured is lost. `setting`: says what was run; not counted.";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_headline_counts_every_verdict_once_by_its_own_word() {
        let claim = |verdict| Claim {
            id: "C",
            paper: "",
            papers_figure: None,
            ours: String::new(),
            verdict,
            reason: String::new(),
        };
        let mut claims: Vec<Claim> = Verdict::ALL.map(claim).into();
        claims.push(claim(Verdict::Undecided));
        let told = verdict_summary(&claims);
        assert_eq!(
            told,
            "Of 5 claims: 1 held, 1 refuted, 2 undecided, 1 lost. Not counted: 1 setting."
        );
        for verdict in Verdict::ALL {
            let word = serde_json::to_value(verdict).expect("a word");
            assert_eq!(word, verdict.name(), "JSON says the same");
        }
        assert_eq!(verdict_summary(&[]), "Of 0 claims: 0 held, 0 refuted, 0 undecided, 0 lost.");
    }
}
