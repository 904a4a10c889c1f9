//! The run of a session, and where it comes from.

use super::foxglove::FoxgloveHost;
use super::save::{
    SaveOptions, SessionFile, SharedScenarioText, check_savable_text, session_path, write_scenario,
};
use crate::encode::problem;
use crate::files::AllowedFiles;
use crate::fleet_feed::FleetFeed;
use crate::gallery::{ShippedScenario, find_shipped};
use crate::keyframes::MemoryBudget;
use crate::metric_history::MetricWords;
use crate::protocol::{Problem, ReplyBody};
use crate::usage_registry::UsageRegistry;
use sidestep_kernel::shell::shell_quote;
use sidestep_kernel::view::Kinds;
use sidestep_kernel::{Cycle, Simulation};
use sidestep_scenario::{Source, Worlds};
use sidestep_session::{Error, RecordedRun, RecordedSeries, read_scenario};
use std::path::Path;
use std::sync::Arc;

/// What sessions depend on, from the options of the server.
#[derive(Clone)]
pub(crate) struct SessionDeps {
    pub(crate) worlds: Worlds,
    /// The files that pages may read.
    pub(crate) files: AllowedFiles,
    /// The number of worker threads of each session; no result depends on it.
    pub(crate) workers: usize,
    /// Whether texts of pages are refused.
    pub(crate) read_only: bool,
    /// The memory for keyframes, shared by all sessions.
    pub(crate) budget: Arc<MemoryBudget>,
    /// The host of Foxglove viewers, if they are served.
    pub(crate) foxglove: Option<Arc<FoxgloveHost>>,
    /// The feeds of the fleets that are watched.
    pub(crate) fleets: Vec<Arc<FleetFeed>>,
    /// The scenarios that the program carries.
    pub(crate) gallery: &'static [ShippedScenario],
    /// What the open sessions keep.
    pub(crate) usage: UsageRegistry,
}

impl SessionDeps {
    /// Returns the feed of a fleet.
    ///
    /// # Errors
    /// When no fleet of this endpoint is watched, or its views do not arrive.
    pub(super) fn fleet_feed(&self, endpoint: &str) -> Result<Arc<FleetFeed>, Problem> {
        let feed = self.fleets.iter().find(|feed| feed.endpoint == endpoint);
        let feed = feed.cloned().ok_or_else(|| {
            let remedy =
                format!("start the studio with it: `sidestep studio {}`", shell_quote(endpoint));
            Problem::new(endpoint, "no fleet of this address is watched", remedy)
        })?;
        feed.snapshot().lost.map_or(Ok(feed), Err)
    }
}

/// The scenario or recording of a session, with its present run.
pub(crate) struct OpenRun {
    /// The run at its start; the player takes it from there.
    pub(crate) run: Box<dyn Simulation>,
    /// Its last cycle: of a recording, the last recorded one.
    pub(crate) until: Cycle,
    /// The scenario, without the requested seed.
    pub(crate) source: Source,
    /// The recording that is computed again, if it is one.
    pub(crate) recorded: Option<RecordedRun>,
    deps: SessionDeps,
    /// Another seed than the scenario's, if one was requested.
    seed: Option<u64>,
    /// The file of the scenario, if it is in one.
    file: Option<SessionFile>,
    shared_source: SharedScenarioText,
}

impl OpenRun {
    /// Opens a scenario file, or a file of another program that stands for a scenario.
    ///
    /// # Errors
    /// When it cannot be opened; with place, cause and remedy.
    pub(crate) fn from_file(
        deps: SessionDeps,
        path: &str,
        seed: Option<u64>,
    ) -> Result<Self, Problem> {
        let path = deps.files.resolve(path)?;
        let (mut source, _) = read_scenario(&deps.worlds, &path, &[]).map_err(|e| problem(&e))?;
        let mut file = SessionFile::open(&path, &source);
        if deps.files.is_dropped(&path) {
            // The copy is gone with the server, so the scenario is in no file until it is saved.
            file = None;
            source.place = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        }
        Self::from_scenario(deps, source, seed, file)
    }

    /// Opens a scenario that the program carries.
    ///
    /// # Errors
    /// When there is none of this name, or its files cannot be kept anywhere.
    pub(crate) fn from_shipped(
        deps: SessionDeps,
        name: &str,
        seed: Option<u64>,
    ) -> Result<Self, Problem> {
        let shipped = find_shipped(deps.gallery, name)?;
        let mut folder = deps.files.first_root_folder();
        for (file, content) in shipped.files {
            // Its own folder, because files of other scenarios may have the same name.
            let kept = deps.files.drops().store(&format!("{name}/{file}"), content)?;
            folder = kept.parent().map_or(folder, Path::to_path_buf);
        }
        let place = format!("{}.toml", name.rsplit('/').next().unwrap_or(name));
        Self::from_scenario(deps, Source::new(place, shipped.text, folder), seed, None)
    }

    /// Opens the default scenario of a world.
    ///
    /// # Errors
    /// When there is no such world.
    pub(crate) fn from_default_scenario(
        deps: SessionDeps,
        world: &str,
        seed: Option<u64>,
    ) -> Result<Self, Problem> {
        let world_type = deps.worlds.find(world).ok_or_else(|| {
            let names = deps.worlds.names().join(", ");
            Problem::new(world, "no such world", format!("give one of {names}"))
        })?;
        let folder = deps.files.first_root_folder();
        let source = Source::new(format!("{world}.toml"), world_type.default_scenario(), folder);
        Self::from_scenario(deps, source, seed, None)
    }

    /// Lets other threads read the scenario's text, as it is after each restart and save.
    pub(crate) fn with_shared_source(mut self, shared_source: SharedScenarioText) -> Self {
        shared_source.set(&self.source);
        self.shared_source = shared_source;
        self
    }

    fn from_scenario(
        deps: SessionDeps,
        source: Source,
        seed: Option<u64>,
        file: Option<SessionFile>,
    ) -> Result<Self, Problem> {
        check_references(&deps, &source)?;
        let run = start_run(&deps, &source, seed)?;
        Ok(Self {
            until: run.config().cycles,
            run,
            source,
            recorded: None,
            deps,
            seed,
            file,
            shared_source: SharedScenarioText::default(),
        })
    }

    /// Opens a recording, to be computed again.
    ///
    /// # Errors
    /// When it cannot be opened, or another seed is requested.
    pub(crate) fn from_recording(
        deps: SessionDeps,
        path: &str,
        seed: Option<u64>,
    ) -> Result<Self, Problem> {
        if seed.is_some() {
            return Err(recording_is_read_only(path));
        }
        let path = deps.files.resolve(path)?;
        let recorded = RecordedRun::open(&deps.worlds, &path).map_err(|e| problem_of(&e))?;
        let resolved = recorded.resolved_scenario().map_err(|e| problem(&e))?;
        let run = recorded.start_for_viewing(deps.workers).map_err(|e| problem(&e))?;
        let place = path.join("scenario.toml").display().to_string();
        Ok(Self {
            run,
            until: recorded.cycles_done,
            source: Source::new(place, resolved.text, path),
            recorded: Some(recorded),
            deps,
            seed,
            file: None,
            shared_source: SharedScenarioText::default(),
        })
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
            self.run = recorded.start_for_viewing(self.deps.workers).map_err(|e| problem(&e))?;
            return Ok(());
        }
        let (source, seed) = match text {
            Some(text) => (source_with_text(&self.deps, &self.source, text)?, seed),
            None => {
                // If it was saved elsewhere meanwhile, its relative paths lead to other files.
                check_references(&self.deps, &self.source)?;
                (self.source.clone(), seed.or(self.seed))
            }
        };
        self.run = start_run(&self.deps, &source, seed)?;
        self.until = self.run.config().cycles;
        self.source = source;
        self.seed = seed;
        Ok(())
    }

    /// Writes a text into a file, the session's own if none is given, which is the session's own from then on.
    ///
    /// # Errors
    /// When it is not written.
    pub(crate) fn save(
        &mut self,
        text: String,
        to: Option<String>,
        options: SaveOptions,
    ) -> Result<ReplyBody, Problem> {
        if self.deps.read_only {
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
        let path = match to {
            // Other endings could replace files that are no scenarios.
            Some(to) if !to.to_ascii_lowercase().ends_with(".toml") => {
                return Err(Problem::new(to, "is no name of a scenario", "end it in .toml"));
            }
            Some(to) => to,
            None => session_path(self.file.as_ref(), &self.source.place)?,
        };
        let target = self.deps.files.write_target(&path)?;
        let folder = target.path.parent().map(Path::to_path_buf).unwrap_or_default();
        let source = Source::new(path, text, folder);
        check_savable_text(&self.deps.files, &self.deps.worlds, &source)?;
        let Source { text, folder, .. } = source;
        let reply = write_scenario(&target, self.file.as_ref(), &text, &options)?;
        if let ReplyBody::Saved { place } = &reply {
            self.source.place.clone_from(place);
            self.source.folder = folder;
            self.file = Some(SessionFile { path: target.path, text });
            self.shared_source.set(&self.source);
        }
        Ok(reply)
    }

    /// Starts a recording once more, to be computed ahead; none if the run is no recording.
    pub(crate) fn start_prefetch_replay(&self) -> Option<Box<dyn Simulation>> {
        // It could be started before. If it cannot now, because its file was deleted for instance, nothing is computed ahead.
        self.recorded.as_ref()?.start_for_viewing(self.deps.workers).ok()
    }

    /// Compares the end of a recorded run with the recording, in a sentence; `None` before the end.
    pub(crate) fn replay_verdict(&self, run: &dyn Simulation) -> Option<String> {
        let recorded = self.recorded.as_ref()?;
        if let Some(build) = recorded.other_build() {
            return Some(format!(
                "Recorded by sidestep {build}, which is not this one: shown from its own {}, not computed again, without \
                 inspection.",
                if recorded.folder.is_some() { "tables" } else { "messages" }
            ));
        }
        let done = run.cycle();
        let planned = recorded.cycles_done;
        if run.is_over() && done < planned {
            return Some(format!(
                "Computed again, but it differs: it is over after {done} cycles, recorded are {planned}."
            ));
        }
        if done != planned {
            return None;
        }
        Some(match recorded.verify_digest(run) {
            Ok(true) => "Computed again: the digest at the end is the recorded one.".into(),
            Ok(false) => "Computed again: no digest was recorded to compare with.".into(),
            Err(error) => format!("Computed again, but it differs: {error}"),
        })
    }

    /// Returns whether its states are computed, so that they have digests.
    pub(crate) fn is_simulated(&self) -> bool {
        self.recorded.as_ref().is_none_or(|recorded| recorded.other_build().is_none())
    }

    /// Returns what the open sessions keep.
    pub(crate) fn usage(&self) -> &UsageRegistry {
        &self.deps.usage
    }

    pub(crate) fn keyframe_budget(&self) -> &Arc<MemoryBudget> {
        &self.deps.budget
    }

    pub(crate) fn foxglove_host(&self) -> Option<Arc<FoxgloveHost>> {
        self.deps.foxglove.clone()
    }

    /// Returns the kinds of bodies that pages may ask for.
    pub(crate) fn kinds(&self) -> Kinds {
        self.deps.worlds.kinds()
    }

    /// Returns the world's words for its metrics.
    pub(crate) fn metric_words(&self) -> MetricWords {
        let world_type = self.deps.worlds.find(self.run.world_name());
        world_type.map_or_else(MetricWords::default, MetricWords::from_world)
    }

    /// Returns the metrics over time of a recording that has some.
    ///
    /// # Errors
    /// When they can no longer be read.
    pub(crate) fn recorded_series(&self) -> Result<Option<RecordedSeries>, Problem> {
        let recorded = self.recorded.as_ref();
        recorded.map_or(Ok(None), |recorded| recorded.series().map_err(|e| problem(&e)))
    }

    /// Returns the names of the recorded tables; none if it has no tables.
    ///
    /// # Errors
    /// When the folder can no longer be read.
    pub(crate) fn table_names(&self) -> Result<Vec<String>, Problem> {
        let recorded = self.recorded.as_ref();
        recorded.map_or(Ok(Vec::new()), |recorded| recorded.tables().map_err(|e| problem(&e)))
    }

    pub(crate) fn is_read_only(&self) -> bool {
        self.deps.read_only || self.recorded.is_some()
    }
}

/// Returns the problems of a text that stands for a scenario.
///
/// # Errors
/// When texts are refused.
pub(crate) fn text_problems(
    deps: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<Vec<Problem>, Problem> {
    let syntax = Source { text: text.clone(), ..source.clone() }.syntax_errors();
    if !deps.read_only && !syntax.is_empty() {
        return Ok(syntax.iter().map(problem).collect());
    }
    let source = match source_with_text(deps, source, text) {
        Err(problem) if deps.read_only => return Err(problem),
        Err(problem) => return Ok(vec![problem]),
        Ok(source) => source,
    };
    Ok(match deps.worlds.compile(&source) {
        Err(_) => {
            let errors = sidestep_experiment::problems(&deps.worlds, &source);
            errors.iter().map(|error| problem(&source.error_at_reference(error))).collect()
        }
        Ok(compiled) => {
            let remarks = compiled.remarks().into_iter();
            remarks
                .map(|remark| Problem {
                    is_warning: true,
                    key: Some(remark.key.as_str().into()),
                    ..Problem::new(remark.key, remark.words, "")
                })
                .collect()
        }
    })
}

/// Returns a scenario with another text.
///
/// # Errors
/// When texts are refused, or this one refers to a file that may not be read.
pub(super) fn source_with_text(
    deps: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<Source, Problem> {
    if deps.read_only {
        let remedy = "change the file, or start the studio without --read-only";
        return Err(Problem::new(source.place.as_str(), "texts are not taken here", remedy));
    }
    let source = Source { text, ..source.clone() };
    deps.files.check_referenced_files(&source)?;
    Ok(source)
}

/// Refuses a scenario that refers to files elsewhere: where pages may write, one of them may have written it.
///
/// # Errors
/// With the file.
fn check_references(deps: &SessionDeps, source: &Source) -> Result<(), Problem> {
    if deps.read_only { Ok(()) } else { deps.files.check_referenced_files(source) }
}

fn start_run(
    deps: &SessionDeps,
    source: &Source,
    seed: Option<u64>,
) -> Result<Box<dyn Simulation>, Problem> {
    let seed = seed.map(|seed| format!("seed={seed}"));
    let source = source.clone().with_overrides(seed.as_slice()).map_err(|e| problem(&e))?;
    let compiled = deps.worlds.compile(&source).map_err(|e| problem(&e))?;
    Ok(compiled.start(&source, deps.workers))
}

fn recording_is_read_only(place: &str) -> Problem {
    let remedy = "open the scenario.toml of the recording to run it with another seed or text";
    Problem::new(place, "a recording is computed again as it was", remedy)
}

/// The remedy of what cannot be stored: the page has no option --out, which that of the command names.
const STORAGE_REMEDY: &str = "check the file, and the space on the disk";

/// Converts an error of a session.
pub(crate) fn problem_of(error: &Error) -> Problem {
    match error {
        Error::Input(error) => problem(error),
        Error::Other { cause, remedy } => Problem::new("", cause.as_str(), remedy.as_str()),
        Error::Record(error) => Problem::new("", error.to_string(), STORAGE_REMEDY),
        other => Problem::new("", other.to_string(), STORAGE_REMEDY),
    }
}
