//! Scenarios: a file, text or dict, compiled once.

use crate::error::{self, argument_error};
use crate::json::{to_list, to_python, to_toml, to_toml_table};
use crate::notebook::to_html;
use crate::watch::run_interruptible;
use crate::worlds;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping};
use sidestep::kernel::InputError;
use sidestep::scenario::{CompiledScenario, ImportOptions, ResolvedScenario, SeedTemplate, Source};
use sidestep_session::GivenScenario;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Number of bodies up to which reseeding takes no interruptible thread. Learning in small worlds reseeds before each
/// episode: starting the thread takes 28 us, and reseeding a few bodies 2 us. With some hundred bodies the thread no
/// longer matters, and Ctrl-C is heeded.
const MAX_UNINTERRUPTED_BODIES: usize = 100;

/// A scenario, read, checked and compiled. It never changes; simulations share it.
///
/// Scenario(scenario=None, *, text=None, base=None, import_options=None): a path (or a file of another program that the
/// command reads, such as BlueSky's .scn or recorded traffic), a dict with the keys of a scenario file, or `text`, the
/// content of one. Paths in a dict or text are relative to `base`, by default the present folder. `import_options` is a
/// dict of what `--set import.KEY=VALUE` gives to the command: {"max_gap_s": 120, "leave_out_suspicious": True}.
///
/// Raises InputError, with the key that is wrong. Examples of its methods continue from here:
///
/// >>> import sidestep
/// >>> scenario = sidestep.Scenario({"world": "robots", "map": {"ascii": "....."}, "robots": [{"count": 2}]})
/// >>> scenario.world, scenario.seed, scenario.agents
/// ('robots', 1, 2)
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Scenario(pub(crate) Arc<LoadedScenario>);

/// A compiled scenario with its text.
pub(crate) struct LoadedScenario {
    pub(crate) compiled: Box<dyn CompiledScenario>,
    text: ScenarioText,
    /// Whether its text was made from a dict, so that users do not know its lines.
    is_dict: bool,
    resolved: OnceLock<Result<ResolvedScenario, InputError>>,
    /// The resolved text without its seed, if it has one.
    seedless: OnceLock<Option<SeedTemplate>>,
    /// Holds its files, if it was unpacked from a bundle.
    unpacked: Option<Arc<tempfile::TempDir>>,
    /// What was not taken as it stood in the file of another program, if it was one.
    import_findings: Vec<String>,
}

/// Where the text of a scenario comes from, and whether it is written yet.
enum ScenarioText {
    /// A text that was read or written.
    Own(Source),
    /// Another scenario with this seed. Its text is written on demand: writing it anew takes longer than starting a
    /// small world.
    Reseeded { of: Arc<LoadedScenario>, seed: u64, source: OnceLock<Result<Source, InputError>> },
}

impl LoadedScenario {
    /// Reads and compiles a scenario while other threads of Python run; Ctrl-C interrupts it.
    fn new(py: Python<'_>, source: Source, is_dict: bool) -> PyResult<Self> {
        let compiled = run_interruptible(py, || worlds::list().compile(&source))?;
        let compiled = compiled.map_err(|e| scenario_error(&e, is_dict))?;
        Ok(Self::from_compiled(compiled, ScenarioText::Own(source), is_dict, None))
    }

    fn from_compiled(
        compiled: Box<dyn CompiledScenario>,
        text: ScenarioText,
        is_dict: bool,
        unpacked: Option<Arc<tempfile::TempDir>>,
    ) -> Self {
        let resolved = OnceLock::new();
        let seedless = OnceLock::new();
        let import_findings = Vec::new();
        Self { compiled, text, is_dict, resolved, seedless, unpacked, import_findings }
    }

    /// Returns the scenario of a bundle, whose files are unpacked to a temporary folder.
    pub(crate) fn from_bundle(py: Python<'_>, resolved: ResolvedScenario) -> PyResult<Self> {
        let unpacked = if resolved.files.is_empty() {
            None
        } else {
            Some(Arc::new(unpack_files(&resolved.files)?))
        };
        let base = unpacked.as_ref().map_or_else(PathBuf::new, |dir| dir.path().to_path_buf());
        let source = Source::new("scenario.toml", resolved.text.clone(), base);
        let loaded = Self::new(py, source, false)?;
        // A bundle is a resolved scenario already; resolving it again would give the paths of its temporary folder.
        let _ = loaded.resolved.set(Ok(resolved));
        Ok(Self { unpacked, ..loaded })
    }

    /// Returns its text with the origin of that.
    pub(crate) fn source(&self) -> PyResult<&Source> {
        self.own_source().map_err(|e| scenario_error(e, self.is_dict))
    }

    fn own_source(&self) -> Result<&Source, &InputError> {
        match &self.text {
            ScenarioText::Own(source) => Ok(source),
            ScenarioText::Reseeded { of, seed, source } => {
                source.get_or_init(|| reseeded_source(of, *seed)).as_ref()
            }
        }
    }

    /// Returns the scenario with all its files, as kept in run folders; checkpoints belong to this text.
    pub(crate) fn resolved(&self) -> PyResult<&ResolvedScenario> {
        let resolved = self.resolved.get_or_init(|| {
            let source = self.own_source().map_err(InputError::clone)?;
            self.compiled.resolve(source)
        });
        resolved.as_ref().map_err(|e| scenario_error(e, self.is_dict))
    }

    /// Returns the text to which checkpoints belong: the resolved one.
    pub(crate) fn identity(&self) -> PyResult<String> {
        if let ScenarioText::Reseeded { of, seed, .. } = &self.text {
            let resolved = of.resolved()?;
            if let Some(seedless) = of.seedless.get_or_init(|| resolved.seed_template()) {
                return Ok(seedless.with_seed(*seed));
            }
        }
        Ok(self.resolved()?.text.clone())
    }

    /// Returns the same scenario with another seed, recompiled only if its world needs that.
    pub(crate) fn reseeded(self: &Arc<Self>, py: Python<'_>, seed: u64) -> PyResult<Self> {
        if i64::try_from(seed).is_err() {
            let remedy = "give at most 2^63 - 1: scenario files have no larger numbers";
            return Err(argument_error("seed", format!("{seed} is too large"), remedy));
        }
        // A reseeded text never refers to another reseeded one: repeated reseeding keeps one scenario alive, not a
        // chain of them.
        let of = match &self.text {
            ScenarioText::Own(_) => self,
            ScenarioText::Reseeded { of, .. } => of,
        };
        let reseeded = if self.compiled.body_count() > MAX_UNINTERRUPTED_BODIES {
            run_interruptible(py, || self.compiled.reseeded(seed))?
        } else {
            py.detach(|| self.compiled.reseeded(seed))
        };
        let compiled = match reseeded {
            Some(compiled) => compiled,
            None => run_interruptible(py, || self.compiled_with(seed))?,
        };
        let compiled = compiled.map_err(|e| scenario_error(&e, self.is_dict))?;
        let text = ScenarioText::Reseeded { of: Arc::clone(of), seed, source: OnceLock::new() };
        let import_findings = self.import_findings.clone();
        let reseeded = Self::from_compiled(compiled, text, self.is_dict, self.unpacked.clone());
        Ok(Self { import_findings, ..reseeded })
    }

    /// Returns the same scenario with another seed, read and compiled anew.
    pub(crate) fn compiled_with(&self, seed: u64) -> Result<Box<dyn CompiledScenario>, InputError> {
        let source = self.own_source().map_err(InputError::clone)?;
        worlds::list().compile(&source.clone().with_overrides(&[format!("seed={seed}")])?)
    }

    /// Returns the same scenario with other values.
    pub(crate) fn with(&self, py: Python<'_>, overrides: &[String]) -> PyResult<Self> {
        let source = self
            .source()?
            .clone()
            .with_overrides(overrides)
            .map_err(|e| scenario_error(&e, self.is_dict))?;
        Ok(Self {
            unpacked: self.unpacked.clone(),
            import_findings: self.import_findings.clone(),
            ..Self::new(py, source, self.is_dict)?
        })
    }
}

/// Returns the text of a scenario with another seed.
fn reseeded_source(of: &LoadedScenario, seed: u64) -> Result<Source, InputError> {
    let source = of.own_source().map_err(InputError::clone)?;
    source.clone().with_overrides(&[format!("seed={seed}")])
}

fn scenario_error(error: &InputError, is_dict: bool) -> PyErr {
    if is_dict { error::dict_input_error(error) } else { error::input_error(error) }
}

fn unpack_files(files: &[(String, Vec<u8>)]) -> PyResult<tempfile::TempDir> {
    write_files(files).map_err(|e| error::RecordError::new_err(format!("cannot unpack: {e}")))
}

fn write_files(files: &[(String, Vec<u8>)]) -> std::io::Result<tempfile::TempDir> {
    let dir = tempfile::tempdir()?;
    for (name, bytes) in files {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(dir.path()))?;
        std::fs::write(path, bytes)?;
    }
    Ok(dir)
}

/// Returns a scenario from anything that represents one: a path, a dict, or a scenario.
pub(crate) fn load(scenario: &Bound<'_, PyAny>) -> PyResult<Arc<LoadedScenario>> {
    if let Ok(scenario) = scenario.cast::<Scenario>() {
        return Ok(Arc::clone(&scenario.get().0));
    }
    load_any(scenario.py(), Some(scenario), ScenarioOrigin::default()).map(Arc::new)
}

/// Returns the options of an import: the keys and values that follow `--set import.` in the command.
pub(crate) fn import_options(given: Option<&Bound<'_, PyMapping>>) -> PyResult<ImportOptions> {
    Ok(ImportOptions::from_overrides(&import_overrides(given)?))
}

fn import_overrides(given: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<String>> {
    let mut overrides = Vec::new();
    for (key, value) in
        given.map(|given| to_toml_table(given, "import_options")).transpose()?.unwrap_or_default()
    {
        let key = key.strip_prefix("import.").unwrap_or(&key);
        overrides.push(format!("import.{key}={value}"));
    }
    Ok(overrides)
}

/// What belongs to a scenario beside the scenario itself.
#[derive(Default)]
struct ScenarioOrigin<'a, 'py> {
    text: Option<&'a str>,
    base: Option<PathBuf>,
    import_options: Option<&'a Bound<'py, PyMapping>>,
}

fn load_any(
    py: Python<'_>,
    scenario: Option<&Bound<'_, PyAny>>,
    origin: ScenarioOrigin<'_, '_>,
) -> PyResult<LoadedScenario> {
    let ScenarioOrigin { text, base, import_options } = origin;
    let base = base.unwrap_or_default();
    let overrides = import_overrides(import_options)?;
    let is_file = scenario.is_some_and(|given| given.cast::<PyMapping>().is_err());
    if !is_file && !overrides.is_empty() {
        let cause = "these are choices about a file of another program, and none is given";
        return Err(argument_error("import_options", cause, "leave it out, or give a path"));
    }
    match (scenario, text) {
        (None, Some(text)) => LoadedScenario::new(py, Source::new("text", text, base), false),
        (Some(given), None) => match given.cast::<PyMapping>() {
            Ok(mapping) => LoadedScenario::new(py, source_of_dict(mapping, &base)?, true),
            Err(_) => {
                let path: PathBuf = given.extract().map_err(|_| {
                    let cause = format!("{given} is no path, dict or Scenario");
                    argument_error("scenario", cause, "give a path or a dict, or text=...")
                })?;
                refuse_text_as_path(&path)?;
                let read = run_interruptible(py, || {
                    let given = GivenScenario::read(worlds::list(), &path, &overrides)?;
                    let compiled = given.compile(worlds::list(), &overrides)?;
                    Ok::<_, InputError>((given, compiled))
                })?;
                let (given, (source, compiled)) = read.map_err(|e| error::input_error(&e))?;
                let text = ScenarioText::Own(source);
                let loaded = LoadedScenario::from_compiled(compiled, text, false, None);
                let imported = given.import_report().map(|imported| &imported.report.findings);
                let import_findings = imported.into_iter().flatten().map(ToString::to_string);
                Ok(LoadedScenario { import_findings: import_findings.collect(), ..loaded })
            }
        },
        _ => {
            let remedy = "give a path, a dict or a Scenario, or text=...";
            Err(argument_error("Scenario", "it needs one scenario", remedy))
        }
    }
}

/// Refuses a path of several lines, which is the content of a file, in words that do not repeat all of it.
fn refuse_text_as_path(path: &Path) -> PyResult<()> {
    let text = path.to_string_lossy();
    let lines = text.lines().count();
    if lines < 2 {
        return Ok(());
    }
    let cause = format!("a text of {lines} lines was given where a path belongs");
    Err(argument_error(
        "scenario",
        cause,
        "pass the content of a file as text=...: sidestep.Scenario(text=...)",
    ))
}

/// Returns the scenario of a dict, in which `format` may be left out.
fn source_of_dict(mapping: &Bound<'_, PyMapping>, base: &Path) -> PyResult<Source> {
    let mut table = to_toml_table(mapping, "")?;
    table.entry("format").or_insert(toml::Value::Integer(1));
    let text = toml::to_string(&table).map_err(|e| {
        argument_error("scenario", e.to_string(), "give what a scenario file may hold")
    })?;
    Ok(Source::new("scenario", text, base))
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (scenario=None, *, text=None, base=None, import_options=None))]
    fn new(
        py: Python<'_>,
        scenario: Option<&Bound<'_, PyAny>>,
        text: Option<&str>,
        base: Option<PathBuf>,
        import_options: Option<&Bound<'_, PyMapping>>,
    ) -> PyResult<Self> {
        let origin = ScenarioOrigin { text, base, import_options };
        load_any(py, scenario, origin).map(|loaded| Self(Arc::new(loaded)))
    }

    /// Returns the same scenario with other values: `set(seed=3)`, `set({"robots.0.count": 5})`. A dotted key goes by tables and
    /// by the numbers of arrays, like `--set` of the command.
    ///
    /// Raises InputError, with the key that is wrong.
    ///
    /// >>> scenario.set({"robots.0.count": 4}, seed=9).agents
    /// 4
    #[pyo3(signature = (values=None, /, **keys))]
    fn set(
        &self,
        py: Python<'_>,
        values: Option<&Bound<'_, PyMapping>>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut overrides = Vec::new();
        let keys = keys.map(|keys| keys.as_any().cast::<PyMapping>()).transpose()?;
        for mapping in values.into_iter().chain(keys) {
            for entry in mapping.items()?.iter() {
                let (key, value): (String, Bound<'_, PyAny>) = entry.extract()?;
                overrides.push(format!("{key}={}", to_toml(&value, &key)?));
            }
        }
        self.0.with(py, &overrides).map(|loaded| Self(Arc::new(loaded)))
    }

    /// Returns the surprises for its author: of a file of another program first what was not taken as it stood, then
    /// `key: words`, the weightiest first.
    ///
    /// >>> scenario.check()
    /// []
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let remarks = self.0.compiled.remarks();
        let remarks = remarks.into_iter().map(|remark| format!("{}: {}", remark.key, remark.words));
        to_list(py, self.0.import_findings.iter().cloned().chain(remarks))
    }

    /// Name of its world.
    #[getter]
    fn world(&self) -> &'static str {
        self.0.compiled.world()
    }

    /// Its name; may be empty.
    #[getter]
    fn name(&self) -> String {
        self.0.compiled.plan().name
    }

    /// Its seed, from which all randomness grows.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.compiled.plan().seed
    }

    /// Number of planned cycles.
    #[getter]
    fn cycles(&self) -> u64 {
        self.0.compiled.plan().cycles
    }

    /// Number of simulated bodies.
    #[getter]
    fn agents(&self) -> usize {
        self.0.compiled.body_count()
    }

    /// The text of its file, with all values set.
    #[getter]
    fn text(&self) -> PyResult<&str> {
        Ok(&self.0.source()?.text)
    }

    /// Returns its keys with all values that are set, as a dict: what `Scenario` takes.
    ///
    /// Raises InputError when its text cannot be written.
    ///
    /// >>> scenario.to_dict()["robots"]
    /// [{'count': 2}]
    fn to_dict(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let text = self.text()?;
        let keys: serde_json::Value = toml::from_str(text).map_err(|e| {
            argument_error("scenario", e.to_string(), "this is a bug; please report it")
        })?;
        to_python(py, &keys)
    }

    /// Returns the JSON Schema of the scenarios of its world, as a dict.
    ///
    /// >>> "robots" in scenario.schema()["properties"]
    /// True
    fn schema(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        schema(py, Some(self.world()))
    }

    /// Returns a picture of the start and the facts, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_html(slf.as_any(), "scenario")
    }

    /// Pickles the scenario with all files that it names.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bundle)> {
        let maker = slf.py().import("sidestep._native")?.getattr("unpack_scenario")?;
        let ResolvedScenario { text, files } = slf.get().0.resolved()?.clone();
        Ok((maker, (text, files)))
    }

    fn __repr__(&self) -> String {
        let plan = self.0.compiled.plan();
        let world = self.0.compiled.world();
        let n = self.0.compiled.body_count();
        let name =
            if plan.name.is_empty() { world.into() } else { format!("{world} {}", plan.name) };
        format!("Scenario({name}, {n} bodies, seed {}, {} cycles)", plan.seed, plan.cycles)
    }
}

/// A scenario's text, and its files by name.
pub(crate) type Bundle = (String, Vec<(String, Vec<u8>)>);

/// Returns a pickled scenario.
#[pyfunction]
pub(crate) fn unpack_scenario(
    py: Python<'_>,
    text: String,
    files: Vec<(String, Vec<u8>)>,
) -> PyResult<Scenario> {
    LoadedScenario::from_bundle(py, ResolvedScenario { text, files })
        .map(|loaded| Scenario(Arc::new(loaded)))
}

/// Returns the JSON Schema of the scenarios of a world, or of any, as a dict.
///
/// Raises InputError when there is no such world.
///
/// >>> import sidestep
/// >>> "airspace" in sidestep.schema("airspace")["properties"]
/// True
#[pyfunction]
#[pyo3(signature = (world=None))]
pub(crate) fn schema(py: Python<'_>, world: Option<&str>) -> PyResult<Py<PyAny>> {
    match worlds::list().schema(world) {
        Some(schema) => to_python(py, &schema),
        None => {
            let names = worlds::list().names().join(", ");
            let world = world.unwrap_or_default();
            Err(argument_error(
                "schema",
                format!("there is no world `{world}`"),
                format!("it is one of {names}"),
            ))
        }
    }
}
