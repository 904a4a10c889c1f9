//! What became of a file that was read: the import report, which every reader returns beside its data.
//!
//! A reader keeps what it understands, and records here what it did not take as it stood: nothing of a file is dropped,
//! repaired or guessed in silence. The same report is what people see of a file.

use crate::{Remark, Severity};
use serde::Serialize;
use sidestep_kernel::terminal::escape_controls;
use sidestep_kernel::text::{KeyValues, group_thousands};

/// Number of places that a finding names: enough to look at a few by hand.
pub const MAX_PLACES: usize = 3;

/// The report of one file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ImportReport {
    /// The format of the file, with its variant: `ROS map (map_server)`.
    pub format: String,
    /// What was found in it, in the order in which people read it: origin, units, extent in space and time.
    pub facts: Vec<ImportFact>,
    /// What was kept.
    pub kept: Vec<ItemCount>,
    /// What was not taken as it stood, in the order in which it was found first.
    pub findings: Vec<Finding>,
}

/// A property of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ImportFact {
    /// Its name for people: `extent`.
    pub name: &'static str,
    /// Its value with its unit.
    pub value: String,
}

/// A number of items of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ItemCount {
    /// The noun in the plural: `rows`.
    pub noun: String,
    /// The number of items.
    pub count: u64,
}

/// Something that a reader did not take as it stood, by rule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What the reader did about it.
    pub treatment: Treatment,
    /// The rule, as the subject of a sentence: `rows without a position`.
    pub rule: String,
    /// How often it applied.
    pub count: u64,
    /// The first places, at most [`MAX_PLACES`]: `line 7`.
    pub places: Vec<String>,
    /// What to do for another result; empty where nothing can be done.
    pub remedy: String,
}

/// What a reader did about something that it could not take as it stood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Treatment {
    /// It was left out.
    Dropped,
    /// It was replaced with what it can only mean.
    Repaired,
    /// A choice that changes the outcome and is not in the file.
    Guessed,
    /// It has a meaning that this program does not use.
    NotUsed,
    /// It was kept, but can hardly be right.
    Suspicious,
    /// It was kept as it stands, and has an effect that its author may not expect.
    Noted,
}

impl Treatment {
    /// Returns the word that a report prints before the rule.
    pub fn word(self) -> &'static str {
        match self {
            Self::Dropped => "dropped",
            Self::Repaired => "repaired",
            Self::Guessed => "guessed",
            Self::NotUsed => "not used",
            Self::Suspicious => "suspicious",
            Self::Noted => "note",
        }
    }
}

impl ImportReport {
    /// Returns the report of a file of this format, in which nothing was found yet.
    pub fn new(format: impl Into<String>) -> Self {
        Self { format: format.into(), ..Self::default() }
    }

    /// Adds a property of the file.
    pub fn add_fact(&mut self, name: &'static str, value: impl Into<String>) {
        self.facts.push(ImportFact { name, value: value.into() });
    }

    /// Adds a number of items that were kept.
    pub fn add_kept(&mut self, noun: impl Into<String>, count: usize) {
        self.kept.push(ItemCount { noun: noun.into(), count: count as u64 });
    }

    /// Adds one to a number of items that were kept.
    pub fn count_kept(&mut self, noun: &'static str) {
        match self.kept.iter_mut().find(|kept| kept.noun == noun) {
            Some(kept) => kept.count += 1,
            None => self.add_kept(noun, 1),
        }
    }

    /// Records that a rule applied at a place; an empty place is not shown.
    pub fn record(
        &mut self,
        treatment: Treatment,
        rule: impl Into<String>,
        place: impl Into<String>,
        remedy: &str,
    ) {
        let rule = rule.into();
        let place = place.into();
        let known = self
            .findings
            .iter_mut()
            .find(|finding| finding.treatment == treatment && finding.rule == rule);
        let places = if place.is_empty() { Vec::new() } else { vec![place] };
        let Some(finding) = known else {
            let remedy = remedy.to_string();
            self.findings.push(Finding { treatment, rule, count: 1, places, remedy });
            return;
        };
        finding.count += 1;
        // A place that is used again and again, such as a definition, is named once.
        let new = places.into_iter().find(|place| !finding.places.contains(place));
        if finding.places.len() < MAX_PLACES {
            finding.places.extend(new);
        }
    }

    /// Adds the remarks on a valid scenario.
    pub fn add_remarks(&mut self, remarks: &[Remark]) {
        for Remark { severity, key, words, .. } in remarks {
            let treatment = match severity {
                Severity::Warning => Treatment::Suspicious,
                Severity::Note => Treatment::Noted,
            };
            self.record(treatment, format!("{key}: {words}"), "", "");
        }
    }

    /// Returns what the author of a scenario has to know of the file that it names under `key`.
    pub fn remarks(&self, key: &str) -> Vec<Remark> {
        self.findings.iter().map(|finding| finding.remark(key)).collect()
    }

    /// Returns format, properties and counts as lines of text, without the findings.
    pub fn lines(&self) -> KeyValues {
        let mut lines = vec![("format".to_string(), escape_controls(&self.format).into_owned())];
        for fact in &self.facts {
            lines.push((fact.name.to_string(), escape_controls(&fact.value).into_owned()));
        }
        for item in &self.kept {
            lines.push((escape_controls(&item.noun).into_owned(), group_thousands(item.count)));
        }
        lines
    }

    /// Returns the number of items that were left out.
    pub fn dropped(&self) -> u64 {
        let dropped = self.findings.iter().filter(|found| found.treatment == Treatment::Dropped);
        dropped.map(|found| found.count).sum()
    }
}

impl Finding {
    /// Returns it as a line of a command's report: what was done as the name, the rest as the value. All readers whose
    /// findings are told by `check` and `run` use it.
    pub fn line(&self) -> (String, String) {
        let name = self.treatment.word();
        let text = self.to_string();
        let rest = text.strip_prefix(name).and_then(|rest| rest.strip_prefix(": "));
        (name.to_string(), rest.unwrap_or(&text).to_string())
    }

    /// Returns it as a remark on a scenario whose `key` names the file: a warning where the file may be another than
    /// meant.
    pub fn remark(&self, key: &str) -> Remark {
        let words = self.to_string();
        match self.treatment {
            Treatment::Guessed | Treatment::Suspicious => Remark::warning(key, words),
            Treatment::Dropped | Treatment::Repaired | Treatment::NotUsed | Treatment::Noted => {
                Remark::note(key, words)
            }
        }
    }
}

/// One line for each finding, as commands print them.
impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.treatment.word(), escape_controls(&self.rule))?;
        if self.count > 1 {
            write!(f, " ({} times)", group_thousands(self.count))?;
        }
        if !self.places.is_empty() {
            write!(f, ", {}", escape_controls(&self.places.join(", ")))?;
            // Fewer places are all that there are, however often the rule applied there.
            if self.places.len() == MAX_PLACES && self.count > MAX_PLACES as u64 {
                write!(f, ", ...")?;
            }
        }
        if !self.remedy.is_empty() {
            write!(f, "; {}", escape_controls(&self.remedy))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_counted_and_names_its_first_places() {
        let mut report = ImportReport::new("CSV");
        for line in 7..12 {
            report.record(
                Treatment::Dropped,
                "rows without a position",
                format!("line {line}"),
                "",
            );
        }
        report.record(Treatment::Guessed, "the delimiter is `;`", "", "give --delimiter");
        assert_eq!(report.dropped(), 5);
        let lines: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines[0],
            "dropped: rows without a position (5 times), line 7, line 8, line 9, ..."
        );
        assert_eq!(lines[1], "guessed: the delimiter is `;`; give --delimiter");
    }

    #[test]
    fn a_place_where_a_rule_applied_several_times_is_named_once() {
        let mut report = ImportReport::new("CSV");
        for line in [7, 7, 7, 9, 9] {
            report.record(Treatment::NotUsed, "notes", format!("line {line}"), "");
        }
        assert_eq!(report.findings[0].to_string(), "not used: notes (5 times), line 7, line 9");
    }

    #[test]
    fn control_characters_of_a_file_are_shown_and_not_executed() {
        let mut report = ImportReport::new("URDF");
        report.record(Treatment::Guessed, "the tip is `\u{1b}[31mhand`", "", "");
        let line = report.findings[0].to_string();
        assert_eq!(line, "guessed: the tip is `\\u{1b}[31mhand`");
    }
}
