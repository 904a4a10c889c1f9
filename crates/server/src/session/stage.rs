//! The run of a session, and its origin.

use super::save::{OwnFile, Shown, Wish, own_path, saved, writable};
use super::showing::Showcase;
use crate::encode::problem;
use crate::files::Files;
use crate::keyframes::Budget;
use crate::protocol::{Answer, Problem, Subject};
use crate::screen::Screen;
use sidestep::kernel::{Cycle, Simulation};
use sidestep::scenario::{Meaning, Source, Worlds};
use sidestep_session::{Error, Recorded, read};
use std::path::Path;
use std::sync::Arc;

/// The means that sessions need to begin.
#[derive(Clone)]
pub(crate) struct Means {
    /// The worlds.
    pub(crate) worlds: Worlds,
    /// The files that may be read.
    pub(crate) files: Files,
    /// The number of worker threads of each session.
    pub(crate) workers: usize,
    /// Whether texts of a page are refused.
    pub(crate) read_only: bool,
    /// The memory that the keyframes of all sessions share.
    pub(crate) budget: Arc<Budget>,
    /// The place for viewers beside the page, if they are served.
    pub(crate) showcase: Option<Arc<Showcase>>,
    /// The fleets that are watched.
    pub(crate) screens: Vec<Arc<Screen>>,
}

impl Means {
    /// Returns the screen of a fleet.
    ///
    /// # Errors
    /// When none of this name is watched, or it is not heard now.
    pub(super) fn screen(&self, endpoint: &str) -> Result<Arc<Screen>, Problem> {
        let found = self.screens.iter().find(|screen| screen.endpoint == endpoint);
        let screen = found.cloned().ok_or_else(|| {
            let remedy = format!("start the studio with it: sidestep studio {endpoint}");
            Problem::new(endpoint, "no fleet of this address is watched", remedy)
        })?;
        screen.now().lost.map_or(Ok(screen), Err)
    }
}

/// A run, and where it comes from.
pub(crate) struct Stage {
    /// The run.
    pub(crate) run: Box<dyn Simulation>,
    /// Its last cycle.
    pub(crate) until: Cycle,
    /// The scenario, without the requested seed.
    pub(crate) source: Source,
    /// The recording that is shown, if it is one.
    pub(crate) recorded: Option<Recorded>,
    means: Means,
    seed: Option<u64>,
    own: Option<OwnFile>,
    shown: Shown,
}

impl Stage {
    /// Opens a scenario or a recording.
    ///
    /// # Errors
    /// When it cannot be opened; with place, cause and remedy.
    pub(crate) fn open(means: Means, what: &Subject, seed: Option<u64>) -> Result<Self, Problem> {
        match what {
            Subject::Scenario { path } => {
                let path = means.files.find(path)?;
                let read = read(means.worlds, &path, &[]).map_err(|e| problem(&e))?;
                let own = OwnFile::of(&path, &read.0);
                Self::of_scenario(means, read.0, seed, own)
            }
            Subject::New { world } => {
                let kind = means.worlds.named(world).ok_or_else(|| {
                    let names = means.worlds.names().join(", ");
                    Problem::new(
                        world.as_str(),
                        "no such world is known",
                        format!("name one of {names}"),
                    )
                })?;
                let folder = means.files.first_folder();
                let source = Source::new(format!("{world}.toml"), kind.default_scenario(), folder);
                Self::of_scenario(means, source, seed, None)
            }
            Subject::Recording { path } => Self::of_recording(means, path, seed),
            Subject::Fleet { path } => {
                Err(Problem::new(path.as_str(), "a fleet has no run here", "report this as a bug"))
            }
        }
    }

    /// Shows the scenario to other threads.
    pub(crate) fn shown_by(mut self, shown: Shown) -> Self {
        shown.set(&self.source);
        self.shown = shown;
        self
    }

    fn of_scenario(
        means: Means,
        source: Source,
        seed: Option<u64>,
        own: Option<OwnFile>,
    ) -> Result<Self, Problem> {
        check_names(&means, &source)?;
        let run = started(&means, &source, seed)?;
        let until = run.plan().cycles;
        let shown = Shown::default();
        Ok(Self { run, until, source, recorded: None, means, seed, own, shown })
    }

    fn of_recording(means: Means, path: &str, seed: Option<u64>) -> Result<Self, Problem> {
        if seed.is_some() {
            return Err(fixed(path));
        }
        let path = means.files.find(path)?;
        let recorded = Recorded::open(means.worlds, &path).map_err(|e| stopped(&e))?;
        let resolved = recorded.resolved().map_err(|e| problem(&e))?;
        let run = recorded.shown(means.workers).map_err(|e| problem(&e))?;
        let until = recorded.cycles_done;
        let source =
            Source::new(path.join("scenario.toml").display().to_string(), resolved.text, path);
        let (own, shown) = (None, Shown::default());
        Ok(Self { run, until, source, recorded: Some(recorded), means, seed, own, shown })
    }

    /// Starts again. Without a text the scenario stays the same, including its seed unless another is given.
    ///
    /// # Errors
    /// When the seed or the text is wrong; then everything stays the same.
    pub(crate) fn restart(
        &mut self,
        seed: Option<u64>,
        text: Option<String>,
    ) -> Result<(), Problem> {
        if let Some(recorded) = &self.recorded {
            if seed.is_some() || text.is_some() {
                return Err(fixed(&self.source.place));
            }
            self.run = recorded.shown(self.means.workers).map_err(|e| problem(&e))?;
            return Ok(());
        }
        let (source, seed) = match text {
            Some(text) => (other_text(&self.means, &self.source, text)?, seed),
            None => {
                // Saving it elsewhere has changed the targets of its paths.
                check_names(&self.means, &self.source)?;
                (self.source.clone(), seed.or(self.seed))
            }
        };
        self.run = started(&self.means, &source, seed)?;
        (self.until, self.source, self.seed) = (self.run.plan().cycles, source, seed);
        Ok(())
    }

    /// Writes a text into a file, the session's own if none is named; it is the session's own from then on.
    ///
    /// # Errors
    /// When it is not written.
    pub(crate) fn save(
        &mut self,
        text: String,
        to: Option<String>,
        wish: Wish,
    ) -> Result<Answer, Problem> {
        if self.means.read_only {
            let remedy = "start the studio without --read-only";
            return Err(Problem::new(
                self.source.place.as_str(),
                "nothing is written here",
                remedy,
            ));
        }
        if self.recorded.is_some() {
            return Err(fixed(&self.source.place));
        }
        let is_toml = |path: &str| path.to_ascii_lowercase().ends_with(".toml");
        let path = match to {
            Some(to) if !is_toml(&to) => {
                return Err(Problem::new(to, "is no name of a scenario", "end it in .toml"));
            }
            Some(to) => to,
            None => own_path(self.own.as_ref(), &self.source.place)?,
        };
        let target = self.means.files.target(&path)?;
        let folder = target.path.parent().map(Path::to_path_buf).unwrap_or_default();
        let source = Source::new(path, text, folder);
        writable(&self.means.files, &self.means.worlds, &source)?;
        let Source { text, folder, .. } = source;
        let answer = saved(&target, self.own.as_ref(), &text, &wish)?;
        if let Answer::Saved { place } = &answer {
            (self.source.place, self.source.folder) = (place.clone(), folder);
            self.own = Some(OwnFile { path: target.path, text });
            self.shown.set(&self.source);
        }
        Ok(answer)
    }

    /// Returns the same run at its start once more, if it is a recording.
    pub(crate) fn again(&self) -> Option<Box<dyn Simulation>> {
        // It could be started before: if it cannot now, nothing is computed ahead.
        self.recorded.as_ref()?.shown(self.means.workers).ok()
    }

    /// Returns the result of comparing the end of a recorded run with the recording; `None` before the end.
    pub(crate) fn verdict(&self, run: &dyn Simulation) -> Option<String> {
        let recorded = self.recorded.as_ref()?;
        if let Some(maker) = recorded.other_maker() {
            return Some(format!(
                "Recorded by sidestep {maker}, which is not this one: shown from its own {}, not computed again, without \
                 inspection.",
                if recorded.folder.is_some() { "tables" } else { "messages" }
            ));
        }
        let (done, of) = (run.cycle(), recorded.cycles_done);
        if run.is_over() && done < of {
            let words = format!("it is over after {done} cycles, recorded are {of}");
            return Some(format!("Computed again, but it differs: {words}."));
        }
        if done != of {
            return None;
        }
        Some(match recorded.confirm(run) {
            Ok(true) => "Computed again: the digest at the end is the recorded one.".into(),
            Ok(false) => "Computed again: no digest was recorded to compare with.".into(),
            Err(error) => format!("Computed again, but it differs: {error}"),
        })
    }

    /// Returns whether its states are computed, so that they have digests.
    pub(crate) fn is_computed(&self) -> bool {
        self.recorded.as_ref().is_none_or(|recorded| recorded.other_maker().is_none())
    }

    /// Returns the memory that keyframes of all sessions share.
    pub(crate) fn budget(&self) -> &Arc<Budget> {
        &self.means.budget
    }

    /// Returns the place for viewers beside the page.
    pub(crate) fn showcase(&self) -> Option<Arc<Showcase>> {
        self.means.showcase.clone()
    }

    /// Returns the metrics of its world in words.
    pub(crate) fn meanings(&self) -> &'static [Meaning] {
        self.means.worlds.named(self.run.world()).map_or(&[], |kind| kind.meanings())
    }

    /// Returns the names of the recorded tables; none if it has no tables.
    ///
    /// # Errors
    /// When the folder can no longer be read.
    pub(crate) fn tables(&self) -> Result<Vec<String>, Problem> {
        let recorded = self.recorded.as_ref();
        recorded.map_or(Ok(Vec::new()), |recorded| recorded.tables().map_err(|e| problem(&e)))
    }

    /// Returns whether its text cannot be replaced.
    pub(crate) fn is_fixed(&self) -> bool {
        self.means.read_only || self.recorded.is_some()
    }
}

/// Returns the problems of a text that stands for a scenario.
///
/// # Errors
/// When texts are refused.
pub(crate) fn checked(
    means: &Means,
    source: &Source,
    text: String,
) -> Result<Vec<Problem>, Problem> {
    let syntax = Source { text: text.clone(), ..source.clone() }.syntax_errors();
    if !means.read_only && !syntax.is_empty() {
        return Ok(syntax.iter().map(problem).collect());
    }
    let source = match other_text(means, source, text) {
        Err(problem) if means.read_only => return Err(problem),
        Err(problem) => return Ok(vec![problem]),
        Ok(source) => source,
    };
    Ok(match means.worlds.compile(&source) {
        Err(_) => {
            let errors = sidestep::problems(means.worlds, &source);
            errors.iter().map(|error| problem(&source.told(error))).collect()
        }
        Ok(compiled) => {
            let remarks = compiled.remarks().into_iter();
            let told = remarks.map(|remark| Problem {
                is_warning: true,
                key: Some(remark.key.as_str().into()),
                ..Problem::new(remark.key, remark.words, "")
            });
            told.collect()
        }
    })
}

/// Returns a scenario with another text.
///
/// # Errors
/// When texts are refused, or this one names a file that may not be read.
pub(super) fn other_text(means: &Means, source: &Source, text: String) -> Result<Source, Problem> {
    if means.read_only {
        let remedy = "change the file, or start the studio without --read-only";
        return Err(Problem::new(source.place.as_str(), "texts are not taken here", remedy));
    }
    let other = Source { text, ..source.clone() };
    means.files.check_text(&other)?;
    Ok(other)
}

/// Refuses a scenario that names files elsewhere: where pages may write, one of them may have written it.
///
/// # Errors
/// With the file.
fn check_names(means: &Means, source: &Source) -> Result<(), Problem> {
    if means.read_only { Ok(()) } else { means.files.check_text(source) }
}

fn started(
    means: &Means,
    source: &Source,
    seed: Option<u64>,
) -> Result<Box<dyn Simulation>, Problem> {
    let seed = seed.map(|seed| format!("seed={seed}"));
    let source = source.clone().with(seed.as_slice()).map_err(|e| problem(&e))?;
    let compiled = means.worlds.compile(&source).map_err(|e| problem(&e))?;
    Ok(compiled.start(&source, means.workers))
}

fn fixed(place: &str) -> Problem {
    let remedy = "open the scenario.toml of the recording to run it with another seed or text";
    Problem::new(place, "a recording is computed again as it was", remedy)
}

/// Returns an error of a session in the words of the protocol.
pub(crate) fn stopped(error: &Error) -> Problem {
    match error {
        Error::Input(error) => problem(error),
        Error::Stopped { cause, remedy } => Problem::new("", cause.as_str(), remedy.as_str()),
        other => Problem::new("", other.to_string(), "check the file, and the space on the disk"),
    }
}
