//! The run of a session, and its origin.

use crate::encode::problem;
use crate::files::Files;
use crate::protocol::{Problem, Subject};
use sidestep::kernel::{Cycle, Simulation};
use sidestep::scenario::{Meaning, Source, Worlds};
use sidestep_session::{Error, Recorded, read};

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
}

/// A run, and where it comes from.
pub(crate) struct Stage {
    /// The run.
    pub(crate) run: Box<dyn Simulation>,
    /// Its last cycle.
    pub(crate) until: Cycle,
    /// The scenario, without the seed that was asked for.
    pub(crate) source: Source,
    /// The recording that is computed again, if it is one.
    pub(crate) recorded: Option<Recorded>,
    means: Means,
    seed: Option<u64>,
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
                Self::of_scenario(means, read.0, seed)
            }
            Subject::New { world } => {
                let kind = means.worlds.named(world).ok_or_else(|| {
                    let names = means.worlds.names().join(", ");
                    Problem::new(world, "no such world is known", format!("name one of {names}"))
                })?;
                let folder = means.files.first_folder();
                let source = Source::new(format!("{world}.toml"), kind.default_scenario(), folder);
                Self::of_scenario(means, source, seed)
            }
            Subject::Recording { path } => Self::of_recording(means, path, seed),
        }
    }

    fn of_scenario(means: Means, source: Source, seed: Option<u64>) -> Result<Self, Problem> {
        let run = started(&means, &source, seed)?;
        let until = run.plan().cycles;
        Ok(Self { run, until, source, recorded: None, means, seed })
    }

    fn of_recording(means: Means, path: &str, seed: Option<u64>) -> Result<Self, Problem> {
        if seed.is_some() {
            return Err(fixed(path));
        }
        let path = means.files.find(path)?;
        let recorded = Recorded::open(means.worlds, &path).map_err(|e| stopped(&e))?;
        let resolved = recorded.resolved().map_err(|e| problem(&e))?;
        let run = recorded.start(means.workers).map_err(|e| problem(&e))?;
        let until = recorded.cycles_done;
        let source =
            Source::new(path.join("scenario.toml").display().to_string(), resolved.text, path);
        Ok(Self { run, until, source, recorded: Some(recorded), means, seed })
    }

    /// Starts anew. Without a text it stays the same, also in its seed unless another is given.
    ///
    /// # Errors
    /// When the seed or the text is wrong; then everything stays as it is.
    pub(crate) fn restart(
        &mut self,
        seed: Option<u64>,
        text: Option<String>,
    ) -> Result<(), Problem> {
        if let Some(recorded) = &self.recorded {
            if seed.is_some() || text.is_some() {
                return Err(fixed(&self.source.place));
            }
            self.run = recorded.start(self.means.workers).map_err(|e| problem(&e))?;
            return Ok(());
        }
        let (source, seed) = match text {
            Some(text) => (other_text(&self.means, &self.source, text)?, seed),
            None => (self.source.clone(), seed.or(self.seed)),
        };
        self.run = started(&self.means, &source, seed)?;
        (self.until, self.source, self.seed) = (self.run.plan().cycles, source, seed);
        Ok(())
    }

    /// Returns the same run at its start once more, of a recording.
    pub(crate) fn again(&self) -> Option<Box<dyn Simulation>> {
        // It could be started before: where it cannot now, nothing is known ahead.
        self.recorded.as_ref()?.start(self.means.workers).ok()
    }

    /// Returns what comes of comparing the end of a recorded run with what is recorded; `None` before.
    pub(crate) fn verdict(&self, run: &dyn Simulation) -> Option<String> {
        let recorded = self.recorded.as_ref()?;
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

    /// Returns the metrics of its world in words.
    pub(crate) fn meanings(&self) -> &'static [Meaning] {
        self.means.worlds.named(self.run.world()).map_or(&[], |kind| kind.meanings())
    }

    /// Whether its text cannot be replaced.
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
        Err(_) => sidestep::problems(means.worlds, &source).iter().map(problem).collect(),
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
fn other_text(means: &Means, source: &Source, text: String) -> Result<Source, Problem> {
    if means.read_only {
        let remedy = "change the file, or start the studio without --read-only";
        return Err(Problem::new(&source.place, "texts are not taken here", remedy));
    }
    let other = Source { text, ..source.clone() };
    means.files.check_text(&other)?;
    Ok(other)
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

fn stopped(error: &Error) -> Problem {
    match error {
        Error::Input(error) => problem(error),
        Error::Stopped { cause, remedy } => Problem::new("", cause, remedy.as_str()),
        other => Problem::new("", other.to_string(), "check the file, and the space on the disk"),
    }
}
