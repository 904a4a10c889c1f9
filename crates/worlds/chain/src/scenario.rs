//! The text of a scenario of chains, and what it compiles to.

mod arms;
mod chains;
mod changes;
mod navigators;
mod obstacles;
mod starts;
mod tasks;

use super::escape::Escape;
use super::geometry::{Point, norm};
use super::ground::Movers;
use super::replan::Rungs;
use super::rules::{Rotation, Rules};
use super::world::{ChainSpec, ChainWorld};
use chains::ChainSection;
use obstacles::{FieldSection, GroundSection, ObstacleSection};
use serde::Deserialize;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_scenario::{Sections, Source};
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;

/// No length, time or coordinate of a scenario is beyond this.
const MOST: f64 = 1e6;
/// Cycles of a run whose scenario does not say it.
const CYCLES: u64 = 2000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChainFile {
    #[serde(rename = "format")]
    _format: u32,
    #[serde(rename = "world")]
    _world: String,
    #[serde(default)]
    name: String,
    #[serde(default = "one")]
    seed: u64,
    cycles: Option<u64>,
    #[serde(default)]
    chain: RulesSection,
    #[serde(default)]
    ground: Option<Spanned<GroundSection>>,
    #[serde(default)]
    obstacles: Sections<ObstacleSection>,
    #[serde(default)]
    fields: Sections<FieldSection>,
    #[serde(default)]
    chains: Sections<ChainSection>,
    record: Option<Spanned<RecordSection>>,
}

fn one() -> u64 {
    1
}

/// What a rod does that hits an obstacle, in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RotationWord {
    #[default]
    Union,
    Literal,
    Never,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RulesSection {
    dimensions: Option<Spanned<usize>>,
    dt_s: Option<Spanned<f64>>,
    rotation: RotationWord,
    self_collision: Option<bool>,
    slave_step_max_m: Option<Spanned<f64>>,
    step_m: Option<Spanned<f64>>,
    backtracks: Option<usize>,
    look_m: Option<Spanned<f64>>,
    escape: EscapeWord,
    escape_speed_m_s: Option<Spanned<f64>>,
    escape_ahead_s: Option<Spanned<f64>>,
    may_start_inside: bool,
}

/// How chains get out of the way of what moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EscapeWord {
    /// Before they are touched.
    #[default]
    LookAhead,
    /// When they are touched.
    Touch,
    /// Not at all.
    Off,
}

/// What a run keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// A row per connector and recorded cycle.
    pub trajectories: bool,
    /// A row per robot of a swarm and recorded cycle.
    pub robots: bool,
    /// A row per obstacle that moves and recorded cycle.
    pub movers: bool,
    /// A row per event, see [`super::events`].
    pub events: bool,
    /// Of how many cycles one is recorded; events are recorded of all.
    pub every: u64,
    /// Cycles between two checkpoints; 0 for none.
    pub checkpoint_every: u64,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self {
            trajectories: true,
            robots: true,
            movers: true,
            events: true,
            every: 1,
            checkpoint_every: 1000,
        }
    }
}

/// What a scenario compiles to.
#[derive(Debug, Clone)]
pub struct Compiled<const D: usize> {
    /// The immutable world.
    pub world: Arc<ChainWorld<D>>,
    /// Name of the scenario, may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Cycles at most; a run ends when all tasks are done.
    pub cycles: u64,
    /// What to keep.
    pub record: RecordSection,
}

/// A compiled scenario of either number of dimensions.
#[derive(Debug, Clone)]
pub enum AnyCompiled {
    /// In the plane.
    Plane(Compiled<2>),
    /// In space.
    Space(Compiled<3>),
}

impl AnyCompiled {
    /// Compiles a scenario.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        let file: ChainFile = source.parse()?;
        let compiler = Compiler { source, file: &file };
        match &file.chain.dimensions {
            None => compiler.compile().map(Self::Plane),
            Some(n) if *n.get_ref() == 2 => compiler.compile().map(Self::Plane),
            Some(n) if *n.get_ref() == 3 => compiler.compile().map(Self::Space),
            Some(n) => {
                let cause = format!("dimensions = {}", n.get_ref());
                Err(source.error(Some(n.span()), cause, "give 2 or 3"))
            }
        }
    }
}

impl<const D: usize> Compiled<D> {
    /// Compiles a scenario that is known to have `D` dimensions.
    ///
    /// # Errors
    /// As [`AnyCompiled::new`]; when it has another number of dimensions.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        let file: ChainFile = source.parse()?;
        let dimensions = file.chain.dimensions.as_ref().map_or(2, |n| *n.get_ref());
        if dimensions != D {
            let cause = format!("the scenario has {dimensions} dimensions");
            return Err(source.error(None, cause, format!("set chain.dimensions to {D}")));
        }
        Compiler { source, file: &file }.compile()
    }
}

struct Compiler<'a> {
    source: &'a Source,
    file: &'a ChainFile,
}

impl Compiler<'_> {
    fn compile<const D: usize>(&self) -> Result<Compiled<D>, InputError> {
        let section = &self.file.chain;
        let dt_s = self.positive(section.dt_s.as_ref(), "dt_s", 0.02)?;
        let streams = Streams::new(Seed(self.file.seed));
        let site = self.site()?;
        let chains = self.chains::<D>(dt_s, site.as_ref())?;
        let ground = self.ground(site.as_ref(), &chains)?;
        self.starts(&chains, &ground)?;
        let radius_m = chains.iter().flat_map(|spec| spec.start.connectors()).map(|c| c.radius_m);
        let look_m = 4.0 * radius_m.fold(0.05, f64::max);
        let escape = self.escape(&chains, &ground.movers, dt_s)?;
        let world = ChainWorld {
            chains,
            cycles: self.file.cycles.unwrap_or(CYCLES),
            escape,
            rungs: Rungs::default(),
            obstacles: ground.obstacles,
            movers: ground.movers,
            dt_s,
            rules: self.rules(escape.as_ref())?,
            look_m: self.positive(section.look_m.as_ref(), "look_m", look_m)?,
            streams,
        };
        let record = self.file.record.as_ref();
        if let Some(record) = record.filter(|record| record.get_ref().every == 0) {
            return Err(self.error(Some(record.span()), "record.every = 0", "give 1 or more"));
        }
        let compiled = Compiled {
            world: Arc::new(world),
            name: self.file.name.clone(),
            seed: self.file.seed,
            cycles: self.file.cycles.unwrap_or(CYCLES),
            record: record.map_or(RecordSection::default(), |record| *record.get_ref()),
        };
        self.try_out(&compiled)?;
        Ok(compiled)
    }

    /// Whether the scripts come to motions, so that they cannot fail while a run goes on.
    fn try_out<const D: usize>(&self, compiled: &Compiled<D>) -> Result<(), InputError> {
        super::state::ChainState::new(&compiled.world).map(drop)
    }

    /// How chains escape; not at all where nothing moves. Unless it is said, they may do so twice
    /// as fast as they are led, or as the fastest that moves.
    fn escape<const D: usize>(
        &self,
        chains: &[ChainSpec<D>],
        movers: &Movers<D>,
        dt_s: f64,
    ) -> Result<Option<Escape>, InputError> {
        let section = &self.file.chain;
        if section.escape == EscapeWord::Off || movers.is_empty() {
            return Ok(None);
        }
        let led = chains.iter().flat_map(|spec| &spec.tasks).map(|task| task.speed_m_s);
        let fastest = movers.at(0.0).map(|mover| norm(mover.velocity_m_s)).fold(0.0, f64::max);
        let usual_m_s = 2.0 * led.fold(fastest, f64::max);
        let given = section.escape_speed_m_s.as_ref();
        let speed_max_m_s = self.positive(given, "escape_speed_m_s", usual_m_s)?;
        let look_ahead = section.escape == EscapeWord::LookAhead;
        let usual = Escape::new(dt_s, speed_max_m_s);
        let usual_s = usual.ticks_ahead * dt_s;
        let ahead_s = self.positive(section.escape_ahead_s.as_ref(), "escape_ahead_s", usual_s)?;
        let ticks_ahead = if look_ahead { ahead_s / dt_s } else { 0.0 };
        Ok(Some(Escape { ticks_ahead, ..usual }))
    }

    fn rules(&self, escape: Option<&Escape>) -> Result<Rules, InputError> {
        let section = &self.file.chain;
        let step_m = match &section.step_m {
            None => None,
            given => Some(self.positive(given.as_ref(), "step_m", 1.0)?),
        };
        let slave_step_max_m = match &section.slave_step_max_m {
            Some(given) if *given.get_ref() == f64::INFINITY => f64::INFINITY,
            given => self.positive(given.as_ref(), "slave_step_max_m", f64::INFINITY)?,
        };
        Ok(Rules {
            rotation: match section.rotation {
                RotationWord::Union => Rotation::Union,
                RotationWord::Literal => Rotation::Literal,
                RotationWord::Never => Rotation::Never,
            },
            self_collision: section.self_collision.unwrap_or(true),
            // Who escapes is no faster than it may be, and neither is who is led.
            slave_step_max_m: escape.map_or(slave_step_max_m, |escape| {
                slave_step_max_m.min(escape.speed_max_m_s * escape.dt_s)
            }),
            backtracks: section.backtracks.unwrap_or(Rules::default().backtracks),
            step_m,
        })
    }

    /// A number above 0; `preset` where none is given.
    fn positive(
        &self,
        value: Option<&Spanned<f64>>,
        key: &str,
        preset: f64,
    ) -> Result<f64, InputError> {
        match value {
            None => Ok(preset),
            Some(v) if *v.get_ref() > 0.0 && *v.get_ref() <= MOST => Ok(*v.get_ref()),
            Some(v) => {
                let cause = format!("{key} = {}", v.get_ref());
                Err(self.error(Some(v.span()), cause, "give a number above 0, at most 1e6"))
            }
        }
    }

    /// A point with as many coordinates as there are dimensions.
    fn point<const D: usize>(
        &self,
        value: &[f64],
        key: &str,
        at: Range<usize>,
    ) -> Result<Point<D>, InputError> {
        let is_right = value.len() == D && value.iter().all(|x| x.is_finite() && x.abs() <= MOST);
        if is_right {
            return Ok(std::array::from_fn(|i| value[i]));
        }
        let remedy = format!("give {D} finite numbers, up to 1e6; chain.dimensions is {D}");
        Err(self.error(Some(at), format!("{key} = {value:?}"), remedy))
    }

    fn error(
        &self,
        span: Option<Range<usize>>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        self.source.error(span, cause, remedy)
    }

    /// An error of a part, told where its section stands.
    fn at(&self, span: Range<usize>, error: &InputError) -> InputError {
        let cause = format!("{}: {}", error.place(), error.cause());
        self.error(Some(span), cause, error.remedy())
    }
}
