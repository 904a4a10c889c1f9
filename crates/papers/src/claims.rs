//! Claims and experiments as the reports print them, shared by all papers, and verdicts over several results.

use crate::case_results::{CaseResults, Proportion};
use serde::Deserialize;
use sidestep::statistics::{Interval, holm, proportion_p_value};
use sidestep_document::claim::{Claim, Verdict};
use sidestep_document::document;
use sidestep_document::document::{Experiment, Picture};
use sidestep_document::{Document, Estimate, Figure, Table};
use std::sync::LazyLock;

/// The claims of a paper, read from its file in `claims/` when they are first needed.
pub(crate) type PaperClaims = LazyLock<ClaimsFile>;

/// A paper's title, experiments and claims, as a file of `claims/` has them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClaimsFile {
    title: String,
    experiment: Vec<ExperimentText>,
    claim: Vec<ClaimText>,
}

/// An experiment in words: its setup, and the effect to look for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExperimentText {
    title: String,
    about: String,
}

/// The parts of a report, in the order in which they stand there.
pub(crate) struct ReportParts<'a> {
    pub(crate) claims: &'a [Claim],
    pub(crate) pictures: Vec<Picture>,
    pub(crate) experiments: Vec<Experiment>,
}

/// What the paper says, and how it is judged.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimText {
    id: String,
    paper: String,
    papers_figure: Option<String>,
    /// The rule by which it is judged.
    rule: String,
    /// The number with which the rule compares: a factor, a share, a percentage or a tolerance.
    threshold: Option<f64>,
}

impl ClaimsFile {
    /// Panics where the text is wrong, because it is part of the program.
    pub(crate) fn read(text: &str) -> Self {
        toml::from_str(text).expect("the claims of a paper are right")
    }

    /// Returns the experiments, with their figures and tables in the order of the file.
    pub(crate) fn experiments(
        &'static self,
        results: impl IntoIterator<Item = (Vec<Figure>, Vec<Table>)>,
    ) -> Vec<Experiment> {
        let mut experiments = Vec::new();
        for (text, (figures, tables)) in self.experiment.iter().zip(results) {
            let ExperimentText { title, about } = text;
            experiments.push(Experiment { title, about, figures, tables });
        }
        experiments
    }

    /// Returns the report of a paper: its claims, pictures, experiments, and the command that makes
    /// it.
    pub(crate) fn document(
        &self,
        lead: String,
        quick: bool,
        parts: ReportParts<'_>,
        command: String,
    ) -> Document {
        let mut document = document::paper_document(&self.title, lead, quick, parts.claims);
        if !parts.pictures.is_empty() {
            document.section("Pictures").pictures(parts.pictures);
        }
        for experiment in parts.experiments {
            document.experiment(experiment);
        }
        document.section("How to run it again").commands("In a shell", command);
        document
    }

    /// Returns the number with which the rule of a claim compares.
    ///
    /// # Panics
    /// If the file has no such claim, or the claim has no such number.
    pub(crate) fn threshold(&self, id: &str) -> f64 {
        let threshold = self.text(id).threshold;
        threshold.unwrap_or_else(|| panic!("claim `{id}` has no threshold"))
    }

    fn text(&self, id: &str) -> &ClaimText {
        let text = self.claim.iter().find(|claim| claim.id == id);
        text.unwrap_or_else(|| panic!("there is no claim `{id}`"))
    }

    /// Words and rule of the claim are those of the file.
    pub(crate) fn claim(&'static self, id: &str, verdict: Verdict, ours: String) -> Claim {
        let text = self.text(id);
        Claim {
            id: &text.id,
            paper: &text.paper,
            papers_figure: text.papers_figure.as_deref(),
            ours,
            verdict,
            reason: text.rule.clone(),
        }
    }
}

/// Minimum number of runs that decide anything: with fewer, Student's interval should not be trusted, and a rule that held
/// in every run was hardly tried.
pub(crate) const MIN_RUNS: usize = 5;

/// Level of all tests; that of the 95 % intervals.
const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// A quantity compared with a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ThresholdTest {
    /// Whether the quantity is on the side that the claim says.
    agrees: bool,
    /// Two-sided p-value of the quantity being the threshold; `None` with too few runs.
    p: Option<f64>,
}

impl ThresholdTest {
    /// Compares a claim's "more than".
    pub(crate) fn above(estimate: &Estimate, threshold: f64) -> Self {
        Self::new(estimate, threshold, |mean| mean > threshold)
    }

    /// Compares a claim's "less than".
    pub(crate) fn below(estimate: &Estimate, threshold: f64) -> Self {
        Self::new(estimate, threshold, |mean| mean < threshold)
    }

    fn new(estimate: &Estimate, threshold: f64, agrees: impl Fn(f64) -> bool) -> Self {
        let p = estimate.p_value(threshold).filter(|_| estimate.n >= MIN_RUNS);
        // Values that all equal the threshold, but for rounding, have no spread, so a test of the mean is undefined; and they
        // are certainly not on the side of the claim.
        if p.is_some() && estimate.interval.is_some_and(|all| is_exactly(all, threshold)) {
            return Self { agrees: false, p: Some(0.0) };
        }
        Self { agrees: estimate.mean.is_some_and(agrees), p }
    }

    /// Compares a claim's "in more than this share of all runs".
    pub(crate) fn proportion_above(share: &Proportion, threshold: f64) -> Self {
        let p = (share.n >= MIN_RUNS as u64)
            .then(|| proportion_p_value(share.hits, share.n, threshold));
        Self { agrees: share.percent() > 100.0 * threshold, p }
    }

    /// Compares a claim's "more than" by a 95 % interval of any kind.
    pub(crate) fn interval_above(interval: Option<Interval>, threshold: f64) -> Self {
        // An interval of a fit comes without a p-value. All that the verdict asks of one is whether it is below 0.05, which
        // is whether the interval leaves the threshold out: 0 stands for yes, 1 for no.
        let p = interval.map(|i| f64::from(i.contains(threshold)));
        Self { agrees: interval.is_some_and(|i| i.low > threshold), p }
    }

    /// Returns whether the test tells the quantity from its threshold.
    fn is_significant(self) -> bool {
        is_significant(self.p)
    }
}

fn is_significant(p: Option<f64>) -> bool {
    p.is_some_and(|p| p < SIGNIFICANCE_LEVEL)
}

/// Returns whether an interval is one number, and that number is the threshold but for rounding.
fn is_exactly(interval: Interval, threshold: f64) -> bool {
    interval.low == interval.high && (interval.low - threshold).abs() <= 1e-12 * threshold.abs()
}

/// Judges a claim by all of its comparisons.
///
/// It is held if each of them is on its side: needing all makes that no likelier by chance,
/// however many there are. It is refuted if one is on the other side, which is likelier the more
/// there are: that is by Holm's correction.
pub(crate) fn judge_thresholds(family: impl IntoIterator<Item = ThresholdTest>) -> Verdict {
    let family: Vec<ThresholdTest> = family.into_iter().collect();
    let p_values: Vec<Option<f64>> = family.iter().map(|test| test.p).collect();
    let mut corrected = family.iter().zip(holm(&p_values));
    if corrected.any(|(test, p)| !test.agrees && is_significant(p)) {
        Verdict::Refuted
    } else if !family.is_empty() && family.iter().all(|test| test.agrees && test.is_significant()) {
        Verdict::Held
    } else {
        Verdict::Undecided
    }
}

/// Judges a rule for every one of `runs` runs: a single counterexample refutes it.
pub(crate) fn judge_every_run(runs: usize, holds: bool) -> Verdict {
    if !holds {
        Verdict::Refuted
    } else if runs >= MIN_RUNS {
        Verdict::Held
    } else {
        Verdict::Undecided
    }
}

/// Judges a rule for every run of every case.
pub(crate) fn judge_all_runs<'a>(
    cases: impl IntoIterator<Item = &'a CaseResults>,
    holds: impl Fn(&CaseResults) -> bool,
) -> Verdict {
    let mut runs = 0;
    let mut holds_always = true;
    for case in cases {
        runs += case.runs();
        holds_always &= holds(case);
    }
    judge_every_run(runs, holds_always)
}

/// Judges a rule for every trial of every share.
pub(crate) fn judge_all_trials<'a>(shares: impl IntoIterator<Item = &'a Proportion>) -> Verdict {
    let mut trials = 0;
    let mut hits = 0;
    for share in shares {
        trials += share.n;
        hits += share.hits;
    }
    judge_every_run(trials as usize, hits == trials)
}

/// Returns the verdict on a claim of several parts: `Held` if all are, `Refuted` if one is.
pub(crate) fn combined_verdict(verdicts: &[Verdict]) -> Verdict {
    if verdicts.contains(&Verdict::Refuted) {
        Verdict::Refuted
    } else if verdicts.contains(&Verdict::Undecided) {
        Verdict::Undecided
    } else {
        Verdict::Held
    }
}

/// Lists a text for each item, one after the other.
pub(crate) fn join_texts<T>(
    items: impl IntoIterator<Item = T>,
    text: impl Fn(T) -> String,
) -> String {
    let texts: Vec<String> = items.into_iter().map(text).collect();
    if texts.is_empty() { "nothing measured".into() } else { texts.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "title = \"t\"\n[[experiment]]\ntitle = \"e\"\nabout = \"a\"\n\
                        [[claim]]\nid = \"A-1\"\npaper = \"more\"\nrule = \"above 2\"\nthreshold = 2.0\n";

    #[test]
    fn a_file_has_the_words_and_the_threshold_of_each_claim() {
        let file: &'static ClaimsFile = Box::leak(Box::new(ClaimsFile::read(FILE)));
        let claim = file.claim("A-1", Verdict::Held, "3".into());
        assert_eq!((claim.id, claim.paper, claim.papers_figure), ("A-1", "more", None));
        assert_eq!((claim.ours.as_str(), claim.reason.as_str()), ("3", "above 2"));
        assert_eq!(file.threshold("A-1"), 2.0);
        let experiments = file.experiments([(Vec::new(), Vec::new())]);
        assert_eq!((experiments[0].title, experiments[0].about), ("e", "a"));
    }

    #[test]
    #[should_panic(expected = "unknown field `treshold`")]
    fn a_misspelled_key_of_a_claim_is_refused() {
        ClaimsFile::read(&FILE.replace("threshold", "treshold"));
    }

    #[test]
    fn the_claims_of_the_papers_have_different_numbers() {
        let files = [
            include_str!("../claims/agentfly.toml"),
            include_str!("../claims/loria.toml"),
            include_str!("../claims/mapf.toml"),
            include_str!("../claims/serpentine.toml"),
        ];
        for file in files.map(ClaimsFile::read) {
            let ids: Vec<&str> = file.claim.iter().map(|claim| claim.id.as_str()).collect();
            let different: std::collections::BTreeSet<&str> = ids.iter().copied().collect();
            assert_eq!(ids.len(), different.len(), "{ids:?}");
        }
    }

    fn values(center: f64, spread: f64, n: usize) -> Estimate {
        let value = |k: usize| Some(center + if k.is_multiple_of(2) { spread } else { -spread });
        Estimate::from_values((0..n).map(value))
    }

    #[test]
    fn an_interval_that_spans_the_threshold_or_too_few_runs_decide_nothing() {
        let of = |estimate| judge_thresholds([ThresholdTest::above(&estimate, 1.0)]);
        assert_eq!(of(values(2.0, 0.1, 6)), Verdict::Held);
        assert_eq!(of(values(0.0, 0.1, 6)), Verdict::Refuted);
        assert_eq!(of(values(1.01, 0.1, 6)), Verdict::Undecided);
        assert_eq!(of(values(2.0, 0.1, 4)), Verdict::Undecided);
        assert_eq!(of(values(2.0, 0.0, 6)), Verdict::Held, "always the same");
        assert_eq!(of(values(1.0, 0.0, 6)), Verdict::Refuted, "never more");
        let twice = Estimate::geometric_ratio(&[Some(0.2); 6], &[Some(0.1); 6]);
        assert_eq!(
            judge_thresholds([ThresholdTest::above(&twice, 2.0)]),
            Verdict::Refuted,
            "nor by rounding"
        );
        assert_eq!(
            judge_thresholds([ThresholdTest::below(&values(1.0, 0.0, 6), 1.0)]),
            Verdict::Refuted
        );
        assert_eq!(judge_thresholds([]), Verdict::Undecided);
        let interval = |low, high| ThresholdTest::interval_above(Some(Interval { low, high }), 0.0);
        let of = |low, high| judge_thresholds([interval(low, high)]);
        assert_eq!(of(0.1, 0.2), Verdict::Held);
        assert_eq!(of(-0.2, -0.1), Verdict::Refuted);
        assert_eq!(of(-0.1, 0.1), Verdict::Undecided);
    }

    #[test]
    fn one_of_many_comparisons_refutes_only_by_holms_correction() {
        let wrong = ThresholdTest { agrees: false, p: Some(0.02) };
        let right = ThresholdTest { agrees: true, p: Some(1e-9) };
        let unsure = ThresholdTest { agrees: true, p: Some(0.5) };
        assert_eq!(judge_thresholds([wrong]), Verdict::Refuted);
        assert_eq!(judge_thresholds([wrong, unsure, unsure]), Verdict::Undecided);
        assert_eq!(judge_thresholds([wrong, right, right]), Verdict::Refuted, "the rest is sure");
        assert_eq!(judge_thresholds([right; 20]), Verdict::Held);
        assert_eq!(judge_thresholds([right, unsure]), Verdict::Undecided);
        let unmeasured = ThresholdTest { agrees: true, p: None };
        assert_eq!(judge_thresholds([right, unmeasured]), Verdict::Undecided);
    }

    #[test]
    fn a_single_counterexample_refutes_what_is_to_hold_in_every_run() {
        assert_eq!(judge_every_run(1, false), Verdict::Refuted);
        assert_eq!(judge_every_run(MIN_RUNS - 1, true), Verdict::Undecided);
        assert_eq!(judge_every_run(MIN_RUNS, true), Verdict::Held);
        assert_eq!(
            judge_all_trials(&[Proportion::new(3, 3), Proportion::new(2, 2)]),
            Verdict::Held
        );
        assert_eq!(
            judge_all_trials(&[Proportion::new(3, 3), Proportion::new(1, 2)]),
            Verdict::Refuted
        );
        assert_eq!(judge_all_trials(&[]), Verdict::Undecided);
    }

    #[test]
    fn a_share_of_nearly_all_can_be_shown_with_the_runs_of_a_full_plan() {
        let of = |hits, n| {
            judge_thresholds([ThresholdTest::proportion_above(&Proportion::new(hits, n), 0.99)])
        };
        assert_eq!(of(500, 500), Verdict::Held);
        assert_eq!(of(20, 20), Verdict::Undecided, "too few to tell");
        assert_eq!(of(0, 20), Verdict::Refuted);
    }
}
