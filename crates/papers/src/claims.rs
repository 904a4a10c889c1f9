//! What all papers share of reports: their words, and verdicts over all of something.

use serde::Deserialize;
use sidestep_document::claim::{Claim, Verdict};
use sidestep_document::document;
use sidestep_document::document::{Experiment, Picture};
use sidestep_document::{Document, Figure, Table};
use std::sync::LazyLock;

/// The claims of a paper, as a file beside its experiments tells them.
pub(crate) type Words = LazyLock<File>;

/// A file of claims.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    title: String,
    experiment: Vec<About>,
    claim: Vec<Told>,
}

/// An experiment in words: what was run, and what to look for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    title: String,
    about: String,
}

/// Claims, pictures and experiments of a report.
pub(crate) type Parts<'a> = (&'a [Claim], Vec<Picture>, Vec<Experiment>);

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

    /// The experiments, with their figures and tables in the order of the file.
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

    /// The report of a paper: its claims, pictures, experiments, and the command that makes it.
    pub(crate) fn document(
        &self,
        lead: String,
        quick: bool,
        (claims, pictures, experiments): Parts<'_>,
        command: String,
    ) -> Document {
        let mut document = document::of_paper(&self.title, lead, quick, claims);
        if !pictures.is_empty() {
            document.section("Pictures").pictures(pictures);
        }
        for experiment in experiments {
            document.experiment(experiment);
        }
        document.section("How to run it again").commands("In a shell", command);
        document
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
