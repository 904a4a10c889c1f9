//! Claims of a paper, and our verdicts on them.

use serde::Serialize;
use sidestep_statistics::Interval;

/// What we say of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Our figures agree.
    Held,
    /// Our figures disagree, or agree under some conditions only.
    NotHeld,
    /// It cannot be judged: the paper's measurements are lost, or need another machine, or a
    /// quieter one.
    Lost,
}

impl Verdict {
    /// All verdicts.
    pub const ALL: [Self; 3] = [Self::Held, Self::NotHeld, Self::Lost];

    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        ["held", "not held", "lost"][self as usize]
    }

    /// Returns `Held` or `NotHeld`.
    pub fn of(holds: bool) -> Self {
        if holds { Self::Held } else { Self::NotHeld }
    }

    /// Returns `Held` if the interval lies above 0 and `NotHeld` if it lies below; if it contains
    /// 0, or there is none, the claim cannot be judged.
    pub fn by_sign(interval: Option<Interval>) -> Self {
        match interval {
            Some(i) if i.low > 0.0 => Self::Held,
            Some(i) if i.high < 0.0 => Self::NotHeld,
            _ => Self::Lost,
        }
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
    /// Our figures.
    pub ours: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The rule by which the verdict follows, and its limits.
    pub reason: String,
}

impl Claim {
    /// Adds the figure that the paper states.
    #[must_use]
    pub fn with_papers_figure(self, figure: &'static str) -> Self {
        Self { papers_figure: Some(figure), ..self }
    }
}

/// Returns the number of claims with this verdict.
pub fn count(claims: &[Claim], verdict: Verdict) -> usize {
    claims.iter().filter(|claim| claim.verdict == verdict).count()
}

/// Summarizes the verdicts on all claims in a sentence.
pub fn tally(claims: &[Claim]) -> String {
    format!(
        "Of {} claims {} held, {} did not hold, and {} cannot be judged.",
        claims.len(),
        count(claims, Verdict::Held),
        count(claims, Verdict::NotHeld),
        count(claims, Verdict::Lost),
    )
}

/// How to read a list of claims.
pub const NOTE: &str = "Every verdict follows from the figures by the rule in its row; intervals are \
                        95 %. `lost`: what the paper measured is lost, takes another machine, or a \
                        quieter one.";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_that_holds_zero_is_no_verdict() {
        let of = |low, high| Verdict::by_sign(Some(Interval { low, high }));
        assert_eq!(of(0.1, 0.2), Verdict::Held);
        assert_eq!(of(-0.2, -0.1), Verdict::NotHeld);
        assert_eq!(of(-0.1, 0.1), Verdict::Lost);
        assert_eq!(Verdict::by_sign(None), Verdict::Lost);
    }
}
