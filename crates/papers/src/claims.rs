//! Words of the reports, shared by all papers, and verdicts over several results.

use crate::cells::{CaseResults, Share};
use serde::Deserialize;
use sidestep::statistics::{Interval, holm, share_p_value};
use sidestep_document::claim::{Claim, Verdict};
use sidestep_document::document;
use sidestep_document::document::{Experiment, Picture};
use sidestep_document::{Document, Estimate, Figure, Table};
use std::sync::LazyLock;

/// The claims of a paper, read from a file beside its experiments.
pub(crate) type Words = LazyLock<File>;

/// A file of claims.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    title: String,
    experiment: Vec<About>,
    claim: Vec<Told>,
}

/// An experiment in words: its setup, and the effect to look for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    title: String,
    about: String,
}

/// The parts of a report.
pub(crate) struct Parts<'a> {
    pub(crate) claims: &'a [Claim],
    pub(crate) pictures: Vec<Picture>,
    pub(crate) experiments: Vec<Experiment>,
}

/// A claim in words.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Told {
    id: String,
    paper: String,
    papers_figure: Option<String>,
    /// The rule by which it is judged; if empty, the judgment itself states it.
    #[serde(default)]
    rule: String,
}

impl File {
    /// Reads the claims of a paper.
    pub(crate) fn read(text: &str) -> Self {
        toml::from_str(text).expect("the claims of a paper are right")
    }

    /// Returns the experiments, with their figures and tables in the order of the file.
    pub(crate) fn experiments(
        &'static self,
        came: impl IntoIterator<Item = (Vec<Figure>, Vec<Table>)>,
    ) -> Vec<Experiment> {
        let told = |(told, (figures, tables)): (&'static About, _)| {
            let About { title, about } = told;
            Experiment { title, about, figures, tables }
        };
        self.experiment.iter().zip(came).map(told).collect()
    }

    /// Returns the report of a paper: its claims, pictures, experiments, and the command that makes
    /// it.
    pub(crate) fn document(
        &self,
        lead: String,
        quick: bool,
        parts: Parts<'_>,
        command: String,
    ) -> Document {
        let mut document = document::of_paper(&self.title, lead, quick, parts.claims);
        if !parts.pictures.is_empty() {
            document.section("Pictures").pictures(parts.pictures);
        }
        for experiment in parts.experiments {
            document.experiment(experiment);
        }
        document.section("How to run it again").commands("In a shell", command);
        document
    }

    /// Returns a claim by its number, its verdict, and our figures.
    pub(crate) fn claim(&'static self, id: &str, verdict: Verdict, ours: String) -> Claim {
        let told = self.claim.iter().find(|told| told.id == id);
        let told = told.unwrap_or_else(|| panic!("there is no claim `{id}`"));
        let (reason, papers_figure) = (told.rule.clone(), told.papers_figure.as_deref());
        Claim { id: &told.id, paper: &told.paper, papers_figure, ours, verdict, reason }
    }
}

/// Fewest runs that decide anything: below it Student's interval should not be trusted, and a rule
/// that held in every run was hardly tried.
pub(crate) const LEAST_RUNS: usize = 5;

/// Level of all tests; that of the 95 % intervals.
const LEVEL: f64 = 0.05;

/// A quantity compared with a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Comparison {
    /// Whether the quantity is on the side that the claim says.
    agrees: bool,
    /// Two-sided p-value of the quantity being the threshold; `None` with too few runs.
    p: Option<f64>,
}

impl Comparison {
    /// Compares a claim's "more than".
    pub(crate) fn above(estimate: &Estimate, threshold: f64) -> Self {
        Self::of(estimate, threshold, |mean| mean > threshold)
    }

    /// Compares a claim's "less than".
    pub(crate) fn below(estimate: &Estimate, threshold: f64) -> Self {
        Self::of(estimate, threshold, |mean| mean < threshold)
    }

    fn of(estimate: &Estimate, threshold: f64, agrees: impl Fn(f64) -> bool) -> Self {
        let p = estimate.p_value(threshold).filter(|_| estimate.n >= LEAST_RUNS);
        // Values that are all the threshold itself, but for rounding, are surely not on the side of
        // the claim.
        let is_threshold =
            |i: &Interval| i.low == i.high && (i.low - threshold).abs() <= 1e-12 * threshold.abs();
        if p.is_some() && estimate.interval.as_ref().is_some_and(is_threshold) {
            return Self { agrees: false, p: Some(0.0) };
        }
        Self { agrees: estimate.mean.is_some_and(agrees), p }
    }

    /// Compares a claim's "in more than this share of all runs".
    pub(crate) fn share_above(share: &Share, threshold: f64) -> Self {
        let p =
            (share.n >= LEAST_RUNS as u64).then(|| share_p_value(share.hits, share.n, threshold));
        Self { agrees: share.percent() > 100.0 * threshold, p }
    }

    /// Compares a claim's "more than" by a 95 % interval of any kind.
    pub(crate) fn interval_above(interval: Option<Interval>, threshold: f64) -> Self {
        let p = interval.map(|i| f64::from(i.contains(threshold)));
        Self { agrees: interval.is_some_and(|i| i.low > threshold), p }
    }
}

/// Judges a claim by all of its comparisons.
///
/// It is held if each of them is on its side: needing all makes that no likelier by chance,
/// however many there are. It is refuted if one is on the other side, which is likelier the more
/// there are: that is by Holm's correction.
pub(crate) fn judged(family: impl IntoIterator<Item = Comparison>) -> Verdict {
    let family: Vec<Comparison> = family.into_iter().collect();
    let p_values: Vec<Option<f64>> = family.iter().map(|c| c.p).collect();
    let is_sure = |p: Option<f64>| p.is_some_and(|p| p < LEVEL);
    let contradicts = |(c, p): (&Comparison, Option<f64>)| !c.agrees && is_sure(p);
    if family.iter().zip(holm(&p_values)).any(contradicts) {
        Verdict::Refuted
    } else if !family.is_empty() && family.iter().all(|c| c.agrees && is_sure(c.p)) {
        Verdict::Held
    } else {
        Verdict::Undecided
    }
}

/// Judges a rule for every one of `runs` runs: a single counterexample refutes it.
pub(crate) fn in_every_run(runs: usize, holds: bool) -> Verdict {
    match holds {
        false => Verdict::Refuted,
        true if runs >= LEAST_RUNS => Verdict::Held,
        true => Verdict::Undecided,
    }
}

/// Judges a rule for every run of every cell.
pub(crate) fn every<'a>(
    cells: impl IntoIterator<Item = &'a CaseResults>,
    holds: impl Fn(&CaseResults) -> bool,
) -> Verdict {
    let (mut runs, mut all) = (0, true);
    for cell in cells {
        runs += cell.runs();
        all &= holds(cell);
    }
    in_every_run(runs, all)
}

/// Judges a rule for every trial of every share.
pub(crate) fn every_trial<'a>(shares: impl IntoIterator<Item = &'a Share>) -> Verdict {
    let (trials, hits) = shares.into_iter().fold((0, 0), |(n, hits), s| (n + s.n, hits + s.hits));
    in_every_run(trials as usize, hits == trials)
}

/// Returns the verdict on a claim of several parts: `Held` if all are, `Refuted` if one is.
pub(crate) fn both(verdicts: &[Verdict]) -> Verdict {
    if verdicts.contains(&Verdict::Refuted) {
        Verdict::Refuted
    } else if verdicts.contains(&Verdict::Undecided) {
        Verdict::Undecided
    } else {
        Verdict::Held
    }
}

/// Lists a text for each of them, one after the other.
pub(crate) fn listed<T>(them: impl IntoIterator<Item = T>, told: impl Fn(T) -> String) -> String {
    let words: Vec<String> = them.into_iter().map(told).collect();
    if words.is_empty() { "nothing measured".into() } else { words.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(center: f64, spread: f64, n: usize) -> Estimate {
        let value = |k: usize| Some(center + if k.is_multiple_of(2) { spread } else { -spread });
        Estimate::of((0..n).map(value))
    }

    #[test]
    fn an_interval_that_spans_the_threshold_or_too_few_runs_decide_nothing() {
        let of = |estimate| judged([Comparison::above(&estimate, 1.0)]);
        assert_eq!(of(values(2.0, 0.1, 6)), Verdict::Held);
        assert_eq!(of(values(0.0, 0.1, 6)), Verdict::Refuted);
        assert_eq!(of(values(1.01, 0.1, 6)), Verdict::Undecided);
        assert_eq!(of(values(2.0, 0.1, 4)), Verdict::Undecided);
        assert_eq!(of(values(2.0, 0.0, 6)), Verdict::Held, "always the same");
        assert_eq!(of(values(1.0, 0.0, 6)), Verdict::Refuted, "never more");
        let twice = Estimate::ratio(&[Some(0.2); 6], &[Some(0.1); 6]);
        assert_eq!(judged([Comparison::above(&twice, 2.0)]), Verdict::Refuted, "nor by rounding");
        assert_eq!(judged([Comparison::below(&values(1.0, 0.0, 6), 1.0)]), Verdict::Refuted);
        assert_eq!(judged([]), Verdict::Undecided);
        let interval = |low, high| Comparison::interval_above(Some(Interval { low, high }), 0.0);
        let of = |low, high| judged([interval(low, high)]);
        assert_eq!(of(0.1, 0.2), Verdict::Held);
        assert_eq!(of(-0.2, -0.1), Verdict::Refuted);
        assert_eq!(of(-0.1, 0.1), Verdict::Undecided);
    }

    #[test]
    fn one_of_many_comparisons_refutes_only_by_holms_correction() {
        let wrong = Comparison { agrees: false, p: Some(0.02) };
        let right = Comparison { agrees: true, p: Some(1e-9) };
        let unsure = Comparison { agrees: true, p: Some(0.5) };
        assert_eq!(judged([wrong]), Verdict::Refuted);
        assert_eq!(judged([wrong, unsure, unsure]), Verdict::Undecided);
        assert_eq!(judged([wrong, right, right]), Verdict::Refuted, "the rest is sure");
        assert_eq!(judged([right; 20]), Verdict::Held);
        assert_eq!(judged([right, unsure]), Verdict::Undecided);
        let unmeasured = Comparison { agrees: true, p: None };
        assert_eq!(judged([right, unmeasured]), Verdict::Undecided);
    }

    #[test]
    fn a_single_counterexample_refutes_what_is_to_hold_in_every_run() {
        assert_eq!(in_every_run(1, false), Verdict::Refuted);
        assert_eq!(in_every_run(LEAST_RUNS - 1, true), Verdict::Undecided);
        assert_eq!(in_every_run(LEAST_RUNS, true), Verdict::Held);
        assert_eq!(every_trial(&[Share::new(3, 3), Share::new(2, 2)]), Verdict::Held);
        assert_eq!(every_trial(&[Share::new(3, 3), Share::new(1, 2)]), Verdict::Refuted);
        assert_eq!(every_trial(&[]), Verdict::Undecided);
    }

    #[test]
    fn a_share_of_nearly_all_can_be_shown_with_the_runs_of_a_full_plan() {
        let of = |hits, n| judged([Comparison::share_above(&Share::new(hits, n), 0.99)]);
        assert_eq!(of(500, 500), Verdict::Held);
        assert_eq!(of(20, 20), Verdict::Undecided, "too few to tell");
        assert_eq!(of(0, 20), Verdict::Refuted);
    }
}
