//! Claims of a paper, and what came of them.

use super::Table;
use crate::statistics::Interval;
use serde::Serialize;

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
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["held", "not held", "lost"][self as usize]
    }

    /// Held, or not.
    pub(super) fn of(holds: bool) -> Self {
        if holds { Self::Held } else { Self::NotHeld }
    }

    /// Held where the interval lies above 0, not held where it lies below; where it holds 0,
    /// or there is none, it cannot be judged.
    pub(super) fn by_sign(interval: Option<Interval>) -> Self {
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
    /// Our figures.
    pub ours: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The rule by which it follows, and what limits it.
    pub reason: String,
}

/// The claims as a table.
pub fn table(claims: &[Claim]) -> Table {
    let note = "`lost`: what the paper measured is lost, takes another machine, or a quieter one. \
                Every verdict follows from the figures by the rule in its row; an interval is \
                95 %.";
    let columns = ["claim", "the paper, in our words", "our figures", "verdict", "why"];
    let mut table = Table::new("Claims", note, &columns);
    for c in claims {
        let verdict = c.verdict.name().to_string();
        table.row([c.id.into(), c.paper.into(), c.ours.clone(), verdict, c.reason.clone()]);
    }
    table
}

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
