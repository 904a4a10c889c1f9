//! Claims of a paper, and what came of them.

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
    /// It cannot be judged: what the paper measured is lost, takes another machine, or a
    /// quieter one.
    Lost,
}

impl Verdict {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Held, Self::NotHeld, Self::Lost];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["held", "not held", "lost"][self as usize]
    }

    /// Held, or not.
    pub fn of(holds: bool) -> Self {
        if holds { Self::Held } else { Self::NotHeld }
    }

    /// Held where the interval lies above 0, not held where it lies below; where it holds 0,
    /// or there is none, it cannot be judged.
    pub fn by_sign(interval: Option<Interval>) -> Self {
        match interval {
            Some(i) if i.low > 0.0 => Self::Held,
            Some(i) if i.high < 0.0 => Self::NotHeld,
            _ => Self::Lost,
        }
    }
}

/// A claim of the paper and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Number; a letter where one sentence of the paper makes several claims.
    pub id: &'static str,
    /// What the paper says, in our words.
    pub paper: &'static str,
    /// The paper's own figure, where it states one. None of the three papers gives an interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub papers_figure: Option<&'static str>,
    /// Our figures.
    pub ours: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The rule by which it follows, and what limits it.
    pub reason: String,
}

impl Claim {
    /// The same claim beside the figure that the paper states.
    #[must_use]
    pub fn with_papers_figure(self, figure: &'static str) -> Self {
        Self { papers_figure: Some(figure), ..self }
    }
}

/// How many of the claims have this verdict.
pub fn count(claims: &[Claim], verdict: Verdict) -> usize {
    claims.iter().filter(|claim| claim.verdict == verdict).count()
}

/// What came of all the claims, in a sentence.
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
