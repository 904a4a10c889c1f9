//! The text of an airspace scenario, and what it compiles to.

mod network;
mod settings;

use super::deploy::{Deployment, refuses};
use super::flight::{Airplane, Legs, Levels, Model, Passing, Point, Pose, Task, Timing, Track};
use super::flight_plan::AirplaneSection;
use super::generate::{GeneratorKind, Order as Wanted, generate};
use super::memory::largest_at_start;
use super::shield::{Flyer, Side, first_fallbacks};
use super::state::{AirplaneRecord, AirspaceState, FLYING, Snapshot};
use super::world::{AirspaceWorld, Disturbance, Method};
use network::NetworkSection;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Choice, Estimator, Order, Update, Utility};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_scenario::{Sections, Source};
use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::sync::Arc;
use toml::Spanned;

/// Levels that are apart by what is asked for may seem nearer by this when they were rounded.
const ROUNDED_M: f64 = 1e-6;
/// A run whose length is not given may take so many cycles,
const FEWEST_CYCLES: u64 = 400;
/// or so many times what the last airplane to come in would need alone, if that is more: room for
/// detours and orbits.
const TIMES_ALONE: f64 = 3.0;
/// Larger errors of known positions than this mean nothing.
const MOST_NOISE_M: f64 = 1e6;
/// Turn rates of airplanes, degrees per second: slower ones would make orbits without end.
const TURNS_DEG_S: RangeInclusive<f64> = 1e-3..=360.0;
/// Most airplanes of a scenario.
const MAX_AIRPLANES: usize = 1_000_000;

/// Sets of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The safe one: exact expectations, hardly any weight on deviations, a margin on the
    /// separation, legs around others.
    #[default]
    Default,
    /// The paper's numbers, sampled.
    Paper,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AirspaceFile {
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
    airspace: AirspaceSection,
    airplane: Option<Spanned<ModelSection>>,
    #[serde(default = "no_airplanes")]
    airplanes: Spanned<Sections<AirplaneSection>>,
    #[serde(default)]
    record: RecordSection,
}

fn one() -> u64 {
    1
}

fn no_airplanes() -> Spanned<Sections<AirplaneSection>> {
    Spanned::new(0..0, Sections::default())
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct AirspaceSection {
    preset: Preset,
    method: Method,
    shield: Option<Spanned<toml::Value>>,
    deployment: Deployment,
    network: Option<Spanned<NetworkSection>>,
    generator: Option<Spanned<GeneratorSection>>,
    dt_s: Option<Spanned<f64>>,
    dtau_s: Option<Spanned<f64>>,
    horizon: Option<Spanned<usize>>,
    tolerance_m: Option<Spanned<f64>>,
    alpha: Option<Spanned<f64>>,
    beta: Option<Spanned<f64>>,
    inflation: Option<Spanned<f64>>,
    holds_s: Vec<f64>,
    legs: Option<Legs>,
    estimator: Option<Spanned<Estimator>>,
    update: Option<Spanned<Update>>,
    order: Option<Order>,
    utility: Option<Utility>,
    cooling: Option<Spanned<f64>>,
    max_rounds: Option<Spanned<u32>>,
    choice: Option<Choice>,
    vertical_m: Option<Spanned<f64>>,
    replay_until_s: Option<Spanned<f64>>,
    group_memory_gib: Option<Spanned<f64>>,
    wind_m_s: Point,
    position_noise_m: f64,
    heading_noise_deg: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GeneratorSection {
    kind: GeneratorKind,
    n: usize,
    radius_m: Option<f64>,
    jitter_m: Option<f64>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ModelSection {
    v_m_s: Option<f64>,
    omega_max_deg_s: Option<f64>,
    separation_m: Option<f64>,
    turns: Option<usize>,
}

/// What a run keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// A row per airplane and cycle.
    pub trajectories: bool,
    /// A row per event, see [`super::events`].
    pub events: bool,
    /// A row per optimization.
    pub optimizations: bool,
    /// Cycles between two checkpoints; 0 for none.
    pub checkpoint_every: u64,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self { trajectories: true, events: true, optimizations: true, checkpoint_every: 1000 }
    }
}

/// What a scenario compiles to.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// The immutable world.
    pub world: Arc<AirspaceWorld>,
    /// Name of the scenario, may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Cycles at most; a run ends when all have arrived.
    pub cycles: u64,
    /// What to keep.
    pub record: RecordSection,
    /// Sides of the first fallbacks.
    pub fallbacks: Vec<Side>,
    /// Pairs whose first fallbacks are not apart: the shield promises nothing for them.
    pub too_close: Vec<(u32, u32)>,
}

impl Compiled {
    /// Compiles a scenario.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        let file: AirspaceFile = source.parse()?;
        Compiler { source, file: &file }.compile()
    }

    /// The state at the start.
    pub fn start_snapshot(&self) -> Snapshot {
        let close: BTreeSet<u32> = self.too_close.iter().flat_map(|&(a, b)| [a, b]).collect();
        let record = |(id, (airplane, &fallback)): (u32, (&Airplane, &Side))| AirplaneRecord {
            pose: airplane.start,
            arrived: FLYING,
            counts: [0; 4],
            fallback,
            came_too_close: close.contains(&id),
            altitude_m: match &airplane.track {
                Some(track) => track.altitude_at_m(airplane.appears_s),
                None => airplane.altitude_m,
            },
            orders: [0; 2],
        };
        let airplanes = (0..).zip(self.world.airplanes.iter().zip(&self.fallbacks)).map(record);
        Snapshot { cycle: 0, airplanes: airplanes.collect(), contacts: Vec::new() }
    }
}

struct Compiler<'a> {
    source: &'a Source,
    file: &'a AirspaceFile,
}

impl Compiler<'_> {
    fn compile(&self) -> Result<Compiled, InputError> {
        let section = &self.file.airspace;
        let streams = Streams::new(Seed(self.file.seed));
        let timing = self.timing()?;
        let replay = self.replay(&timing)?;
        let airplanes = self.airplanes(&streams, replay)?;
        let radius_m = airplanes.iter().map(|a| a.model.separation_m).fold(0.0, f64::max);
        let tolerance_m = self.positive(section.tolerance_m.as_ref(), (radius_m / 5.0).max(1.0))?;
        let vertical_m = self.positive(section.vertical_m.as_ref(), 300.0)? - ROUNDED_M;
        let noise = [section.position_noise_m, section.heading_noise_deg];
        let numbers = noise.into_iter().chain(section.wind_m_s);
        if numbers.clone().any(|v| !v.is_finite()) || noise.iter().any(|v| *v < 0.0) {
            let cause = "a wind or noise that is negative or no number";
            return Err(self.error(None, cause, "give finite values, noise 0 or more"));
        }
        if section.position_noise_m > MOST_NOISE_M {
            let cause = format!("position_noise_m = {}", section.position_noise_m);
            return Err(self.error(None, cause, format!("give 0 to {MOST_NOISE_M}")));
        }
        let slowest = airplanes.iter().flat_map(speeds_m_s).fold(f64::INFINITY, f64::min);
        let wind = sidestep_kernel::math::hypot(section.wind_m_s[0], section.wind_m_s[1]);
        if wind >= slowest {
            let cause = format!("a wind of {wind} m/s, and airplanes of {slowest} m/s");
            return Err(self.error(None, cause, "give a wind that all airplanes can fly against"));
        }
        let network = self.network(&timing, &airplanes)?;
        let group_memory_gib = self.positive(section.group_memory_gib.as_ref(), 2.0)?;
        let mut world = AirspaceWorld {
            airplanes,
            timing,
            network,
            passing: Passing { tolerance_m, passes: true },
            objective: self.objective(vertical_m)?,
            settings: self.settings()?,
            holds_s: self.times(&section.holds_s, "holds_s")?,
            legs: self.legs()?,
            method: section.method,
            deployment: section.deployment,
            group_bytes: (group_memory_gib * f64::from(1 << 30)) as u64,
            shield: self.has_shield()?,
            vertical_m,
            replay_cycles: replay.cycles,
            wind_m_s: section.wind_m_s,
            disturbance: Disturbance {
                position_m: section.position_noise_m,
                heading_rad: section.heading_noise_deg.to_radians(),
            },
            streams,
            actions: Vec::new(),
            later: Vec::new(),
            top_m_s: Vec::new(),
            alone_s: Vec::new(),
            first_fallbacks: Vec::new(),
        }
        .prepared();
        if let Some(reason) = refuses(world.deployment, &world.settings) {
            let cause = format!("deployment {}: {reason}", world.deployment.name());
            let remedy = "set order = \"parallel\" and utility = \"joint\", or estimator = { kind = \"exact\" }";
            return Err(self.error(None, cause, remedy));
        }
        if world.most_samples().is_none_or(|most| most > u64::from(u16::MAX) * 4) {
            let cause = "more samples than a random stream holds";
            let remedy = "give smaller blocks or fewer rounds, or order = \"parallel\": in \
                          sequence each airplane draws a block anew after every other";
            return Err(self.error(None, cause, remedy));
        }
        let (fallbacks, too_close) = first(&world);
        world.first_fallbacks.clone_from(&fallbacks);
        let cycles = self.file.cycles.unwrap_or_else(|| enough_cycles(&world));
        let compiled = Compiled {
            world: Arc::new(world),
            name: self.file.name.clone(),
            seed: self.file.seed,
            cycles,
            record: self.file.record,
            fallbacks,
            too_close,
        };
        self.fits(&compiled)?;
        Ok(compiled)
    }

    /// Whether the groups at the start can be optimized in the memory allowed.
    fn fits(&self, compiled: &Compiled) -> Result<(), InputError> {
        let world = &compiled.world;
        if world.method != Method::Pc {
            return Ok(());
        }
        let state = AirspaceState::restore(world, &compiled.start_snapshot());
        let (airplanes, bytes) = largest_at_start(world, &state);
        if bytes <= world.group_bytes {
            return Ok(());
        }
        let gib = bytes as f64 / f64::from(1 << 30);
        let cause = format!(
            "{airplanes} airplanes near each other need up to {gib:.1} GiB to be optimized together"
        );
        let allowed = world.group_bytes as f64 / f64::from(1 << 30);
        let remedy = format!(
            "give fewer airplanes, a shorter horizon, fewer turns or holds_s, or a group_memory_gib \
             above {allowed}"
        );
        Err(self.error(None, cause, remedy))
    }

    fn is_paper(&self) -> bool {
        self.file.airspace.preset == Preset::Paper
    }

    fn timing(&self) -> Result<Timing, InputError> {
        let section = &self.file.airspace;
        let dt_s = self.positive(section.dt_s.as_ref(), 5.0)?;
        let dtau_s = self.positive(section.dtau_s.as_ref(), 1.0)?;
        let parts = dt_s / dtau_s;
        if (parts - parts.round()).abs() > 1e-9 || parts < 1.0 {
            let cause = format!("dt_s = {dt_s} is no multiple of dtau_s = {dtau_s}");
            let span = section.dtau_s.as_ref().or(section.dt_s.as_ref()).map(Spanned::span);
            return Err(self.error(span, cause, "give a dtau_s that divides dt_s"));
        }
        let preset = if self.is_paper() { 125 } else { 90 };
        let horizon = section.horizon.as_ref().map_or(preset, |h| *h.get_ref());
        if !((parts.round() as usize)..=10_000).contains(&horizon) {
            let cause = format!("a horizon of {horizon} steps");
            let span = section.horizon.as_ref().map(Spanned::span);
            return Err(self.error(span, cause, "give at least dt_s / dtau_s and at most 10000"));
        }
        Ok(Timing { dt_s, dtau_s, horizon })
    }

    fn airplanes(&self, streams: &Streams, replay: Replay) -> Result<Vec<Airplane>, InputError> {
        let (span, common) = match &self.file.airplane {
            Some(model) => (Some(model.span()), model.get_ref().clone()),
            None => (None, ModelSection::default()),
        };
        let model = self.model(&common, span)?;
        let mut all = match &self.file.airspace.generator {
            Some(generator) => self.generated(generator, &model, streams)?,
            None => Vec::new(),
        };
        for section in &self.file.airplanes.get_ref().0 {
            all.push(self.airplane(section, &common, replay)?);
        }
        if all.is_empty() {
            let remedy = "add [airspace.generator] with kind and n, or [[airplanes]]";
            return Err(self.error(None, "the scenario has no airplanes", remedy));
        }
        Ok(all)
    }

    fn generated(
        &self,
        section: &Spanned<GeneratorSection>,
        model: &Model,
        streams: &Streams,
    ) -> Result<Vec<Airplane>, InputError> {
        let s = section.get_ref();
        let at = Some(section.span());
        if !(1..=MAX_AIRPLANES).contains(&s.n) {
            return Err(self.error(at, format!("{} airplanes", s.n), "give 1 to 1000000"));
        }
        // Random traffic is as dense as ten airplanes in the paper's circle, whatever their number.
        let radius_m = s.radius_m.unwrap_or(match s.kind {
            GeneratorKind::Random => 6_500.0 * (s.n as f64 / 5.0).max(1.0).sqrt(),
            _ => 6_500.0,
        });
        let jitter_m = s.jitter_m.unwrap_or(20.0);
        if !(radius_m > 0.0 && radius_m < 1e9 && (0.0..1e6).contains(&jitter_m)) {
            let cause = format!("radius_m = {radius_m}, jitter_m = {jitter_m}");
            return Err(self.error(at, cause, "give a positive radius and a jitter of 0 or more"));
        }
        let order = Wanted { kind: s.kind, n: s.n, radius_m, jitter_m, model };
        generate(&order, streams).map_err(|placed| {
            let cause = format!("no place is left after {placed} of {} airplanes", s.n);
            self.error(at, cause, "give a larger radius_m or a smaller n")
        })
    }

    fn airplane(
        &self,
        section: &Spanned<AirplaneSection>,
        common: &ModelSection,
        replay: Replay,
    ) -> Result<Airplane, InputError> {
        let s = section.get_ref();
        let own = ModelSection {
            v_m_s: s.v_m_s.or(common.v_m_s),
            omega_max_deg_s: s.omega_max_deg_s.or(common.omega_max_deg_s),
            separation_m: s.separation_m.or(common.separation_m),
            turns: s.turns.or(common.turns),
        };
        match s.track(self.source)? {
            Some(track) => {
                let v_m_s =
                    s.v_m_s.unwrap_or_else(|| track.mean_speed_m_s(replay.until_s).max(1.0));
                let own = ModelSection { v_m_s: Some(v_m_s), ..own };
                let model = self.model(&own, Some(section.span()))?;
                Ok(recorded(track, model, replay))
            }
            None => self.planned(section, self.model(&own, Some(section.span()))?),
        }
    }

    /// An airplane with a flight plan of its own.
    fn planned(
        &self,
        section: &Spanned<AirplaneSection>,
        model: Model,
    ) -> Result<Airplane, InputError> {
        let s = section.get_ref();
        let at = Some(section.span());
        let (Some(at_m), Some(heading_deg)) = (s.at_m, s.heading_deg) else {
            let remedy = "add at_m = [x, y] and heading_deg, or a track";
            return Err(self.error(at, "an airplane that begins nowhere", remedy));
        };
        let mission = s.way_points_m.clone().unwrap_or_default();
        let (altitude_m, appears_s) = (s.altitude_m.unwrap_or(0.0), s.appears_s.unwrap_or(0.0));
        let places = mission.iter().chain([&at_m]).flatten();
        let others = [&heading_deg, &altitude_m, &appears_s];
        if appears_s < 0.0 || places.chain(others).any(|v| !v.is_finite() || v.abs() > 1e9) {
            let cause = "a position, heading or time that is no number, or absurd";
            return Err(self.error(at, cause, "give metres and seconds below 1e9, and degrees"));
        }
        if mission.is_empty() {
            let remedy = "add way_points_m = [[x, y], ...]";
            return Err(self.error(at, "an airplane without way-points", remedy));
        }
        let heading_rad = sidestep_kernel::math::wrap_angle(heading_deg.to_radians());
        let start = Pose { at: at_m, heading_rad };
        let (orders, leaves_s) = s.orders(self.source)?;
        Ok(Airplane { model, start, mission, altitude_m, appears_s, leaves_s, orders, track: None })
    }

    /// How long recorded airplanes follow their tracks.
    fn replay(&self, timing: &Timing) -> Result<Replay, InputError> {
        let section = self.file.airspace.replay_until_s.as_ref();
        let until_s = section.map_or(f64::INFINITY, |s| *s.get_ref());
        if until_s.is_nan() || until_s < 0.0 {
            let remedy = "give seconds after the start, 0 to fly all anew, or inf to replay all";
            let span = section.map(Spanned::span);
            return Err(self.error(span, format!("replay_until_s = {until_s}"), remedy));
        }
        // Beyond the largest number of cycles this is that number.
        let cycles = (until_s / timing.dt_s).ceil() as u64;
        Ok(Replay { cycles, until_s: cycles as f64 * timing.dt_s, dt_s: timing.dt_s })
    }

    fn model(
        &self,
        s: &ModelSection,
        span: Option<std::ops::Range<usize>>,
    ) -> Result<Model, InputError> {
        let omega_max_deg_s = s.omega_max_deg_s.unwrap_or(4.0);
        let model = Model {
            v_m_s: s.v_m_s.unwrap_or(35.0),
            omega_max_rad_s: omega_max_deg_s.to_radians(),
            separation_m: s.separation_m.unwrap_or(500.0),
            turns: s.turns.unwrap_or(5),
        };
        let numbers = [("v_m_s", model.v_m_s), ("separation_m", model.separation_m)];
        if let Some((name, v)) = numbers.iter().find(|(_, v)| !(*v > 0.0 && *v < 1e6)) {
            let remedy = "give more than 0 and less than 1e6";
            return Err(self.error(span, format!("{name} = {v}"), remedy));
        }
        if !TURNS_DEG_S.contains(&omega_max_deg_s) {
            let cause = format!("omega_max_deg_s = {omega_max_deg_s}");
            let remedy =
                format!("give {} to {} degrees per second", TURNS_DEG_S.start(), TURNS_DEG_S.end());
            return Err(self.error(span, cause, remedy));
        }
        if model.turns < 3 || model.turns.is_multiple_of(2) || model.turns > 99 {
            let cause = format!("turns = {}", model.turns);
            let remedy = "give an odd number from 3 to 99, so that straight flight is among them";
            return Err(self.error(span, cause, remedy));
        }
        Ok(model)
    }

    fn positive(&self, value: Option<&Spanned<f64>>, preset: f64) -> Result<f64, InputError> {
        match value {
            None => Ok(preset),
            Some(v) if *v.get_ref() > 0.0 && v.get_ref().is_finite() => Ok(*v.get_ref()),
            Some(v) => {
                let cause = format!("{} is not positive", v.get_ref());
                Err(self.error(Some(v.span()), cause, "give a number above 0"))
            }
        }
    }

    fn error(
        &self,
        span: Option<std::ops::Range<usize>>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        self.source.error(span, cause, remedy)
    }
}

/// How long recorded airplanes follow their tracks.
#[derive(Debug, Clone, Copy)]
struct Replay {
    cycles: u64,
    /// The end of these cycles.
    until_s: f64,
    dt_s: f64,
}

/// An airplane that follows its track, and then flies on along what is left of it.
fn recorded(track: Track, model: Model, replay: Replay) -> Airplane {
    let begins_s = track.begins_s();
    // One that appears later comes in at the start of a cycle.
    let appears_s = if (begins_s / replay.dt_s).floor() < replay.cycles as f64 {
        begins_s
    } else {
        (begins_s / replay.dt_s).ceil() * replay.dt_s
    };
    let joins_s = replay.until_s.max(appears_s);
    Airplane {
        model,
        start: track.pose_at(appears_s),
        mission: track.rest(joins_s),
        altitude_m: track.altitude_at_m(joins_s),
        appears_s,
        leaves_s: f64::INFINITY,
        orders: Vec::new(),
        track: Some(track),
    }
}

/// All speeds that an airplane is to fly with.
fn speeds_m_s(airplane: &Airplane) -> impl Iterator<Item = f64> {
    let told = airplane.orders.iter().filter_map(|order| match order.task {
        Task::Speed(v_m_s) => Some(v_m_s),
        _ => None,
    });
    told.chain([airplane.model.v_m_s])
}

/// Cycles in which everybody should arrive. Flights that never end do not count.
fn enough_cycles(world: &AirspaceWorld) -> u64 {
    let ends = (0..world.airplanes.len()).map(|i| world.ends_alone_s(i));
    let longest_s = ends.filter(|s| s.is_finite()).fold(0.0, f64::max);
    FEWEST_CYCLES.max((TIMES_ALONE * longest_s / world.timing.dt_s).ceil() as u64)
}

/// First fallbacks that are apart as far as there are any, and the pairs that are not.
fn first(world: &AirspaceWorld) -> (Vec<Side>, Vec<(u32, u32)>) {
    let mut sides = vec![Side::default(); world.airplanes.len()];
    // Airplanes that come in at other times do not meet at the start.
    let starts: Vec<usize> = (0..sides.len()).filter(|&i| world.joins_in(i) == 0).collect();
    let flyer = |(rank, &i): (usize, &usize)| {
        let airplane = &world.airplanes[i];
        Flyer {
            pose: airplane.start,
            v_m_s: airplane.model.v_m_s,
            omega_max_rad_s: airplane.model.omega_max_rad_s,
            separation_m: airplane.model.separation_m,
            levels: Levels::at(airplane.altitude_m),
            vertical_m: world.vertical_m,
            fallback: Side::Left,
            came_too_close: false,
            rank: rank as u64,
            id: i as u32,
        }
    };
    let flyers: Vec<Flyer> = starts.iter().enumerate().map(flyer).collect();
    let (chosen, pairs) = first_fallbacks(&flyers);
    starts.iter().zip(chosen).for_each(|(&i, side)| sides[i] = side);
    (sides, pairs.into_iter().map(|(i, j)| (starts[i] as u32, starts[j] as u32)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compiled(more: &str) -> Compiled {
        let text = format!("format = 1\nworld = \"airspace\"\n{more}");
        Compiled::new(&Source::new("test", text, "")).expect("a scenario")
    }

    #[test]
    fn without_a_number_of_cycles_there_are_enough_for_everybody_to_arrive() {
        let short = "[airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
        assert_eq!(compiled(short).cycles, 400);
        assert_eq!(compiled(&format!("cycles = 7\n{short}")).cycles, 7);
        // 70 km at 35 m/s from 500 s on.
        let long = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[70000, 0]]\n\
                    appears_s = 500.0\n";
        let cycles = compiled(long).cycles;
        assert!((1495..=1500).contains(&cycles), "{cycles}");
        let endless = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[7000, 0]]\n\
                       orders = [{ at_s = 10.0, heading_deg = 90.0 }]\n";
        assert_eq!(compiled(endless).cycles, 400);
        let track = "[[airplanes]]\ntrack = [[0, 0, 0, 0], [3000, 100000, 0, 0]]\n";
        assert_eq!(compiled(track).cycles, 1800);
    }
}
