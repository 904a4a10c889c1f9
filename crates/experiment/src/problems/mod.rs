//! All that is wrong with a scenario, instead of the first thing alone.
//!
//! Readers and compilers stop at the first error. So it is reported, repaired in a draft of the
//! text, and the draft is compiled again, until nothing is wrong. A draft is never shown: places
//! and quoted lines are those of the text as it was given. An error that may only follow from the
//! repair is not reported; it will be once its cause is gone, if it is a mistake of its own.
//!
//! ```text
//!         ┌─────────────────── draft, with the repaired text ◄──────────┐
//!         ▼                                                             │
//!     compile ──error──> reported, at its place in the given text ──> repairs, the likeliest first
//! ```

mod draft;
mod repair;
mod tree;

use draft::Draft;
use repair::{Guess, Repair, repairs};
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_scenario::{Source, Worlds};

/// Largest number of errors that are reported: a screen full.
pub const MAX_PROBLEMS: usize = 20;
/// Largest number of compilations of drafts, because some take long.
const MAX_DRAFTS: usize = 150;

/// Returns the errors of a scenario, in the order of its text and at most [`MAX_PROBLEMS`]; none if it
/// compiles. Errors of syntax are reported alone, because nothing else is known before they are
/// repaired.
pub fn problems(worlds: &Worlds, source: &Source) -> Vec<InputError> {
    let Err(first) = worlds.compile(source) else { return Vec::new() };
    let mut errors = source.syntax_errors();
    if errors.is_empty() {
        let mut recovery = ErrorRecovery::new(worlds, source);
        recovery.run(first);
        errors = recovery.reported;
    }
    errors.sort_by_key(|error| error.line_and_column());
    errors.truncate(MAX_PROBLEMS);
    errors
}

/// The search for further errors.
struct ErrorRecovery<'a> {
    worlds: &'a Worlds,
    source: &'a Source,
    reported: Vec<InputError>,
    /// Keys to which drafts give values, or none, that their author did not mean.
    guessed: Vec<Guess>,
    drafts: usize,
}

/// A draft, and the error of compiling it; none where it compiles.
struct DraftStep {
    draft: Draft,
    error: Option<InputError>,
}

impl<'a> ErrorRecovery<'a> {
    fn new(worlds: &'a Worlds, source: &'a Source) -> Self {
        Self { worlds, source, reported: Vec::new(), guessed: Vec::new(), drafts: 0 }
    }

    fn run(&mut self, first: InputError) {
        let draft = Draft::new(self.source.clone());
        let mut step = DraftStep { draft, error: Some(first) };
        while let Some(error) = step.error.take()
            && self.reported.len() < MAX_PROBLEMS
        {
            self.report(&step.draft, &error);
            match self.repair(&step.draft, &error) {
                Some(next) => step = next,
                None => return,
            }
        }
    }

    /// Reports an error, unless it was reported before or may follow from a guess in a draft.
    fn report(&mut self, draft: &Draft, error: &InputError) {
        if self.guessed.iter().any(|guess| guess.may_lead_to(error)) {
            return;
        }
        let error = draft.map_error_back(self.source, error);
        let is_known =
            self.reported.iter().any(|one| *one == error || is_at_same_place(one, &error));
        if !is_known {
            self.reported.push(error);
        }
    }

    /// Returns a draft in which an error is repaired; none if there is no such draft. Of all repairs
    /// the first is taken from which nothing seems to follow.
    fn repair(&mut self, draft: &Draft, error: &InputError) -> Option<DraftStep> {
        // The first repair that does remove the error, though another one may follow from it: the last resort.
        let mut forced: Option<(Repair, DraftStep)> = None;
        for repair in repairs(draft, error, &self.schema(draft)) {
            let Some(draft) = repair.applied_to(draft) else { continue };
            if self.drafts == MAX_DRAFTS {
                return None;
            }
            self.drafts += 1;
            let next = self.worlds.compile(draft.source()).err();
            let may_follow = next.as_ref().is_some_and(|next| repair.may_lead_to(next));
            let is_same = next.as_ref().is_some_and(|next| is_same_error(next, error));
            let step = DraftStep { draft, error: next };
            if !may_follow && !is_same {
                self.guessed.extend(repair.guess());
                return Some(step);
            }
            if !is_same && forced.is_none() {
                forced = Some((repair, step));
            }
        }
        let (repair, step) = forced?;
        self.guessed.push(repair.into());
        Some(step)
    }

    /// Null where the draft has no known world: then there are no examples.
    fn schema(&self, draft: &Draft) -> Value {
        let world = draft.source().value("world");
        let world = world.as_ref().and_then(toml::Value::as_str);
        world.and_then(|name| self.worlds.schema(Some(name))).unwrap_or_default()
    }
}

/// Returns whether two drafts have the same error, wherever it stands.
fn is_same_error(one: &InputError, other: &InputError) -> bool {
    one.key() == other.key() && one.cause() == other.cause()
}

/// Returns whether two errors with a position are about the same part of the text: the second one of a value is of its
/// repair.
fn is_at_same_place(one: &InputError, other: &InputError) -> bool {
    other.line_and_column().is_some()
        && one.place() == other.place()
        && one.line_and_column() == other.line_and_column()
        && one.end_line_and_column() == other.end_line_and_column()
}
