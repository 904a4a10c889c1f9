//! The run of a session, and its origin.

use super::foxglove::FoxgloveHost;
use super::save::{
    SaveOptions, SessionFile, SharedSource, check_writable, session_path, write_scenario,
};
use crate::encode::problem;
use crate::files::AllowedFiles;
use crate::fleet_feed::FleetFeed;
use crate::keyframes::MemoryBudget;
use crate::protocol::{OpenTarget, Problem, ReplyBody};
use sidestep_kernel::{Cycle, Simulation};
use sidestep_scenario::{MetricInfo, Source, Worlds};
use sidestep_session::{Error, RecordedRun, read_scenario};
use std::path::Path;
use std::sync::Arc;

/// The means that sessions need to begin.
#[derive(Clone)]
pub(crate) struct SessionDeps {
    /// The worlds.
    pub(crate) worlds: Worlds,
    /// The files that may be read.
    pub(crate) files: AllowedFiles,
    /// The number of worker threads of each session.
    pub(crate) workers: usize,
    /// Whether texts of a page are refused.
    pub(crate) read_only: bool,
    /// The memory that the keyframes of all sessions share.
    pub(crate) budget: Arc<MemoryBudget>,
    /// The place for viewers beside the page, if they are served.
    pub(crate) showcase: Option<Arc<FoxgloveHost>>,
    /// The fleets that are watched.
    pub(crate) screens: Vec<Arc<FleetFeed>>,
}

impl SessionDeps {
    /// Returns the screen of a fleet.
    ///
    /// # Errors
    /// When none of this name is watched, or it is not heard now.
    pub(super) fn fleet_feed(&self, endpoint: &str) -> Result<Arc<FleetFeed>, Problem> {
        let found = self.screens.iter().find(|screen| screen.endpoint == endpoint);
        let screen = found.cloned().ok_or_else(|| {
            let remedy = format!("start the studio with it: sidestep studio {endpoint}");
            Problem::new(endpoint, "no fleet of this address is watched", remedy)
        })?;
        screen.snapshot().lost.map_or(Ok(screen), Err)
    }
}

/// A run, and where it comes from.
pub(crate) struct OpenRun {
    /// The run.
    pub(crate) run: Box<dyn Simulation>,
    /// Its last cycle.
    pub(crate) until: Cycle,
    /// The scenario, without the requested seed.
    pub(crate) source: Source,
    /// The recording that is shown, if it is one.
    pub(crate) recorded: Option<RecordedRun>,
    means: SessionDeps,
    seed: Option<u64>,
    own: Option<SessionFile>,
    shown: SharedSource,
}

impl OpenRun {
    /// Opens a scenario or a recording.
    ///
    /// # Errors
    /// When it cannot be opened; with place, cause and remedy.
    pub(crate) fn open(
        means: SessionDeps,
        what: &OpenTarget,
        seed: Option<u64>,
    ) -> Result<Self, Problem> {
        match what {
            OpenTarget::Scenario { path } => {
                let path = means.files.resolve(path)?;
                let read = read_scenario(&means.worlds, &path, &[]).map_err(|e| problem(&e))?;
                let own = SessionFile::open(&path, &read.0);
                Self::from_scenario(means, read.0, seed, own)
            }
            OpenTarget::New { world } => {
                let kind = means.worlds.find(world).ok_or_else(|| {
                    let names = means.worlds.names().join(", ");
                    Problem::new(
                        world.as_str(),
                        "no such world is known",
                        format!("name one of {names}"),
                    )
                })?;
                let folder = means.files.first_root_folder();
                let source = Source::new(format!("{world}.toml"), kind.default_scenario(), folder);
                Self::from_scenario(means, source, seed, None)
            }
            OpenTarget::Recording { path } => Self::from_recording(means, path, seed),
            OpenTarget::Fleet { path } => {
                Err(Problem::new(path.as_str(), "a fleet has no run here", "report this as a bug"))
            }
        }
    }

    /// Shows the scenario to other threads.
    pub(crate) fn with_shared_source(mut self, shown: SharedSource) -> Self {
        shown.set(&self.source);
        self.shown = shown;
        self
    }

    fn from_scenario(
        means: SessionDeps,
        source: Source,
        seed: Option<u64>,
        own: Option<SessionFile>,
    ) -> Result<Self, Problem> {
        check_names(&means, &source)?;
        let run = start_run(&means, &source, seed)?;
        let until = run.config().cycles;
        let shown = SharedSource::default();
        Ok(Self { run, until, source, recorded: None, means, seed, own, shown })
    }

    fn from_recording(means: SessionDeps, path: &str, seed: Option<u64>) -> Result<Self, Problem> {
        if seed.is_some() {
            return Err(recording_is_read_only(path));
        }
        let path = means.files.resolve(path)?;
        let recorded = RecordedRun::open(&means.worlds, &path).map_err(|e| problem_of(&e))?;
        let resolved = recorded.resolved_scenario().map_err(|e| problem(&e))?;
        let run = recorded.start_for_viewing(means.workers).map_err(|e| problem(&e))?;
        let until = recorded.cycles_done;
        let source =
            Source::new(path.join("scenario.toml").display().to_string(), resolved.text, path);
        let (own, shown) = (None, SharedSource::default());
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
                return Err(recording_is_read_only(&self.source.place));
            }
            self.run = recorded.start_for_viewing(self.means.workers).map_err(|e| problem(&e))?;
            return Ok(());
        }
        let (source, seed) = match text {
            Some(text) => (source_with_text(&self.means, &self.source, text)?, seed),
            None => {
                // Saving it elsewhere has changed the targets of its paths.
                check_names(&self.means, &self.source)?;
                (self.source.clone(), seed.or(self.seed))
            }
        };
        self.run = start_run(&self.means, &source, seed)?;
        (self.until, self.source, self.seed) = (self.run.config().cycles, source, seed);
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
        wish: SaveOptions,
    ) -> Result<ReplyBody, Problem> {
        if self.means.read_only {
            let remedy = "start the studio without --read-only";
            return Err(Problem::new(
                self.source.place.as_str(),
                "nothing is written here",
                remedy,
            ));
        }
        if self.recorded.is_some() {
            return Err(recording_is_read_only(&self.source.place));
        }
        let is_toml = |path: &str| path.to_ascii_lowercase().ends_with(".toml");
        let path = match to {
            Some(to) if !is_toml(&to) => {
                return Err(Problem::new(to, "is no name of a scenario", "end it in .toml"));
            }
            Some(to) => to,
            None => session_path(self.own.as_ref(), &self.source.place)?,
        };
        let target = self.means.files.target(&path)?;
        let folder = target.path.parent().map(Path::to_path_buf).unwrap_or_default();
        let source = Source::new(path, text, folder);
        check_writable(&self.means.files, &self.means.worlds, &source)?;
        let Source { text, folder, .. } = source;
        let answer = write_scenario(&target, self.own.as_ref(), &text, &wish)?;
        if let ReplyBody::Saved { place } = &answer {
            (self.source.place, self.source.folder) = (place.clone(), folder);
            self.own = Some(SessionFile { path: target.path, text });
            self.shown.set(&self.source);
        }
        Ok(answer)
    }

    /// Returns the same run at its start once more, if it is a recording.
    pub(crate) fn recorded_run_again(&self) -> Option<Box<dyn Simulation>> {
        // It could be started before: if it cannot now, nothing is computed ahead.
        self.recorded.as_ref()?.start_for_viewing(self.means.workers).ok()
    }

    /// Returns the result of comparing the end of a recorded run with the recording; `None` before the end.
    pub(crate) fn verdict(&self, run: &dyn Simulation) -> Option<String> {
        let recorded = self.recorded.as_ref()?;
        if let Some(maker) = recorded.other_build() {
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
        Some(match recorded.verify_digest(run) {
            Ok(true) => "Computed again: the digest at the end is the recorded one.".into(),
            Ok(false) => "Computed again: no digest was recorded to compare with.".into(),
            Err(error) => format!("Computed again, but it differs: {error}"),
        })
    }

    /// Returns whether its states are computed, so that they have digests.
    pub(crate) fn is_computed(&self) -> bool {
        self.recorded.as_ref().is_none_or(|recorded| recorded.other_build().is_none())
    }

    /// Returns the memory that keyframes of all sessions share.
    pub(crate) fn budget(&self) -> &Arc<MemoryBudget> {
        &self.means.budget
    }

    /// Returns the place for viewers beside the page.
    pub(crate) fn foxglove_host(&self) -> Option<Arc<FoxgloveHost>> {
        self.means.showcase.clone()
    }

    /// Returns the metrics of its world in words.
    pub(crate) fn metric_infos(&self) -> &'static [MetricInfo] {
        self.means.worlds.find(self.run.world()).map_or(&[], |kind| kind.metric_infos())
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
    pub(crate) fn is_read_only(&self) -> bool {
        self.means.read_only || self.recorded.is_some()
    }
}

/// Returns the problems of a text that stands for a scenario.
///
/// # Errors
/// When texts are refused.
pub(crate) fn text_problems(
    means: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<Vec<Problem>, Problem> {
    let syntax = Source { text: text.clone(), ..source.clone() }.syntax_errors();
    if !means.read_only && !syntax.is_empty() {
        return Ok(syntax.iter().map(problem).collect());
    }
    let source = match source_with_text(means, source, text) {
        Err(problem) if means.read_only => return Err(problem),
        Err(problem) => return Ok(vec![problem]),
        Ok(source) => source,
    };
    Ok(match means.worlds.compile(&source) {
        Err(_) => {
            let errors = sidestep_experiment::problems(&means.worlds, &source);
            errors.iter().map(|error| problem(&source.error_at_reference(error))).collect()
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
pub(super) fn source_with_text(
    means: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<Source, Problem> {
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
fn check_names(means: &SessionDeps, source: &Source) -> Result<(), Problem> {
    if means.read_only { Ok(()) } else { means.files.check_text(source) }
}

fn start_run(
    means: &SessionDeps,
    source: &Source,
    seed: Option<u64>,
) -> Result<Box<dyn Simulation>, Problem> {
    let seed = seed.map(|seed| format!("seed={seed}"));
    let source = source.clone().with_overrides(seed.as_slice()).map_err(|e| problem(&e))?;
    let compiled = means.worlds.compile(&source).map_err(|e| problem(&e))?;
    Ok(compiled.start(&source, means.workers))
}

fn recording_is_read_only(place: &str) -> Problem {
    let remedy = "open the scenario.toml of the recording to run it with another seed or text";
    Problem::new(place, "a recording is computed again as it was", remedy)
}

/// Returns an error of a session in the words of the protocol.
pub(crate) fn problem_of(error: &Error) -> Problem {
    match error {
        Error::Input(error) => problem(error),
        Error::Other { cause, remedy } => Problem::new("", cause.as_str(), remedy.as_str()),
        other => Problem::new("", other.to_string(), "check the file, and the space on the disk"),
    }
}
