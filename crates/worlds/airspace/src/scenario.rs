//! The text of an airspace scenario, and its compiled form.

mod accuracy;
mod airplanes;
mod areas;
mod compile;
mod detours;
mod earth;
mod effectless;
mod generator;
mod gusts;
mod measures;
mod network;
mod optimizer;
mod performance;
mod remarks;
mod rule_changes;
mod start_groups;
mod surveillance;
mod types;
mod winds;

use super::flight::AirplaneStart;
use super::flight_plan::AirplaneSection;
use super::method::Methods;
use super::settings::{
    AltitudeLimit, BuiltInMethod, ChangeWeight, Combinations, Cooling, Decision, Deployment,
    Fading, Gibibytes, Grouping, HeadingNoise, Inflation, LevelGap, LookAhead, RecordSection,
    RightOfWayRule, RoundCount, Step, Tolerance, Weight,
};
use super::shield::Fallback;
use super::state::{AirplaneSnapshot, PackedFlightEnd, Snapshot};
use super::world::AirspaceWorld;
use airplanes::ModelSection;
use areas::{AreaSection, load_areas_file};
use compile::Compiler;
use generator::GeneratorSection;
use gusts::GustsSection;
use measures::{MeasuresSection, NmacSection, WellClearSection};
use network::NetworkSection;
use optimizer::{LegsSection, MvpSection, OnOffSwitch, ReactiveSection, TimeList};
pub(super) use remarks::scenario_remarks;
use rule_changes::RuleChangeSection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sidestep_collectives::{Choice, Estimator, LocalSearch, Update, UpdateOrder, Utility};
use sidestep_import::geojson::GeoAreas;
use sidestep_kernel::network::fingerprint;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_scenario::{
    ByName, Closed, Head, Integer, Number, Point, Rule, Sections, SeedEffect, Source, Spanned,
    schema,
};
use std::sync::Arc;
use surveillance::SurveillanceSection;
use types::TypeTable;
use winds::{WindLayerSection, WindTable, load_wind_file};

/// Sets of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The safe set: exact expectations, hardly any weight on deviations, a margin on the
    /// separation, legs around others.
    #[default]
    Default,
    /// The paper's numbers, sampled.
    Paper,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AirspaceFile {
    /// Methods by which airplanes avoid each other, and the air that they fly in.
    #[serde(default)]
    airspace: AirspaceSection,
    airplane: Option<ModelSection>,
    #[serde(default)]
    airplanes: Sections<AirplaneSection>,
    /// Tables that a run keeps.
    #[serde(default)]
    record: RecordSection,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct AirspaceSection {
    preset: Preset,
    method: ByName<BuiltInMethod>,
    shield: OnOffSwitch,
    deployment: Deployment,
    groups: Option<Spanned<Grouping>>,
    /// The rule by which airplanes of one priority give way to each other.
    #[serde(default)]
    right_of_way: RightOfWayRule,
    network: Option<Spanned<NetworkSection>>,
    generator: Option<Spanned<GeneratorSection>>,
    dt_s: Option<Spanned<Number<Decision>>>,
    dtau_s: Option<Spanned<Number<Step>>>,
    /// Seconds between two looks of mvp, orca, bands and none, in place of dt_s and dtau_s.
    look_every_s: Option<Spanned<Number<Step>>>,
    horizon_s: Option<Spanned<Number<LookAhead>>>,
    /// The former key, which counted points; only its error is left.
    #[schemars(skip)]
    horizon: Option<Spanned<toml::Value>>,
    tolerance_m: Option<Number<Tolerance>>,
    /// Whether an airplane is done with a way-point that it has abeam, unless that is its last.
    passes_abeam: bool,
    alpha: Option<Number<Weight>>,
    beta: Option<Number<Fading>>,
    inflation: Option<Number<Inflation>>,
    holds_s: TimeList,
    /// Which changes of heading, level and speed an action of method pc may have together.
    combinations: Combinations,
    /// Weight of a square meter of altitude against one of place, in the deviation of method pc.
    level_weight: Option<Number<ChangeWeight>>,
    /// Weight of the square of the way that a change of speed makes longer or shorter, beside that of the place.
    speed_weight: Option<Number<ChangeWeight>>,
    legs: Option<Spanned<LegsSection>>,
    /// File of areas in GeoJSON, beside those that are given here.
    areas_file: Option<Spanned<String>>,
    /// Areas to stay out of, or inside of.
    areas: Vec<Spanned<AreaSection>>,
    /// Rules that change on the way.
    changes: Vec<Spanned<RuleChangeSection>>,
    mvp: MvpSection,
    orca: ReactiveSection,
    bands: ReactiveSection,
    estimator: Option<Spanned<Estimator>>,
    update: Option<Spanned<Update>>,
    order: Option<UpdateOrder>,
    utility: Option<Spanned<Utility>>,
    cooling: Option<Number<Cooling>>,
    max_rounds: Option<RoundCount>,
    choice: Option<Choice>,
    local_search: Option<Spanned<LocalSearch>>,
    /// Number of random starts of the local search.
    random_starts: Option<Spanned<Integer<0, 100>>>,
    /// The true minimum of the objective is recorded for groups of up to this many airplanes.
    minimum_up_to: Option<Integer<0, 100>>,
    vertical_m: Option<Number<LevelGap>>,
    /// Altitude below which an airplane that the shield holds is in danger: a minimum sector altitude.
    safe_altitude_m: Option<AltitudeLimit>,
    /// File of types of airplanes: [types.NAME] with the keys of [airplane] for each.
    types_file: Option<Spanned<String>>,
    /// Folder openap/data of an installed OpenAP, with types of airliners by their ICAO designators.
    openap_folder: Option<Spanned<String>>,
    replay_until_s: Option<Number<ReplayUntilRange>>,
    group_memory_gib: Option<Number<Gibibytes>>,
    wind_m_s: Option<Spanned<Point<2>>>,
    /// Winds by altitude, in place of wind_m_s: between two altitudes the wind changes steadily.
    winds: Vec<Spanned<WindLayerSection>>,
    /// File of winds by altitude and place in CSV, in place of wind_m_s.
    wind_file: Option<Spanned<String>>,
    gusts: Option<Spanned<GustsSection>>,
    /// Latitude and longitude of the origin.
    origin_deg: Option<Spanned<Point<2, Closed<-360, 360>>>>,
    /// Time of the start, in seconds since 1970, UTC.
    start_utc_s: Option<Number<Closed<-1_000_000_000_000, 1_000_000_000_000>>>,
    /// Standard deviation in meters; larger errors of known positions make no sense.
    position_noise_m: Option<Number<Closed<0, 1_000_000>>>,
    heading_noise_deg: Option<Number<HeadingNoise>>,
    error_sigmas: Option<Number<Closed<0, 100>>>,
    /// How airplanes receive each other's reports; without it all see all others at once.
    surveillance: Option<Spanned<SurveillanceSection>>,
    measures: MeasuresSection,
    well_clear: Option<WellClearSection>,
    nmac: Option<NmacSection>,
}

/// Returns the JSON Schema of a scenario's sections; `own` are methods beside the built-in ones.
pub(super) fn sections_schema(own: &Methods) -> Value {
    let mut sections = schema::for_type::<AirspaceFile>();
    schema::add_names(&mut sections, "Method", own.keys().map(String::as_str));
    sections
}

/// The times until which tracks may be replayed, infinity included.
#[derive(Debug, Clone, Copy)]
struct ReplayUntilRange;

impl Rule for ReplayUntilRange {
    fn allows(number: f64) -> bool {
        number >= 0.0
    }

    fn description() -> String {
        "seconds after the start, 0 to fly all of them by the method, or inf to replay all".into()
    }

    fn limits() -> Value {
        schema::with_infinity(json!({ "minimum": 0 }))
    }
}

/// A scenario from which runs can start.
#[derive(Debug, Clone)]
pub struct CompiledAirspace {
    /// The world, which all runs of the scenario share.
    pub world: Arc<AirspaceWorld>,
    /// Name of the scenario; may be empty.
    pub name: String,
    /// The seed in the text, or that of [`Self::reseeded`].
    pub seed: u64,
    /// Largest number of cycles; a run ends when all have arrived.
    pub cycles: u64,
    /// Whether another seed would change results.
    pub seeds: SeedEffect,
    /// The tables that a run keeps, and the interval of its checkpoints.
    pub record: RecordSection,
    /// Sides of the first fallbacks, by id.
    pub fallbacks: Arc<Vec<Fallback>>,
    /// Pairs with first fallbacks that are not apart: the shield promises nothing for them.
    pub too_close: Vec<(u32, u32)>,
    /// Number of those of them for which the search for others has come to its limit.
    pub unproved_pairs: u64,
    /// The text that it was compiled from.
    recipe: Arc<ParsedScenario>,
}

/// The text of a scenario and its sections, so that another seed reads nothing again.
#[derive(Debug)]
struct ParsedScenario {
    source: Source,
    head: Head,
    file: AirspaceFile,
    /// The types of airplanes that it names.
    types: TypeTable,
    /// The content of its file of areas.
    areas_file: Option<GeoAreas>,
    /// The content of its file of winds.
    wind_file: Option<WindTable>,
    /// Methods beside the built-in ones.
    own: Methods,
}

impl ParsedScenario {
    /// Returns the digest by which agents recognize those of the same scenario: of all that decides how airplanes fly, the
    /// text, the seed, and what other files say of types, areas and winds.
    fn fingerprint(&self, seed: u64) -> u64 {
        let mut text = self.source.text.clone();
        if !self.types.is_empty() {
            text += &self.types.text();
        }
        if let Some(found) = &self.areas_file {
            text += &format!("{:?}", found.areas);
        }
        if let Some(found) = &self.wind_file {
            text += &format!("{:?}", found.rows);
        }
        fingerprint(&text, seed)
    }
}

impl CompiledAirspace {
    /// Compiles a scenario.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        Self::with_methods(source, &Methods::new())
    }

    /// Compiles a scenario that may name methods beside the built-in ones.
    ///
    /// # Errors
    /// The same.
    pub fn with_methods(source: &Source, own: &Methods) -> Result<Self, InputError> {
        let (head, file) = source.parse_world::<AirspaceFile>()?;
        let types = TypeTable::load(source, &file)?;
        let areas_file = load_areas_file(source, file.airspace.areas_file.as_ref())?;
        let wind_file = load_wind_file(source, file.airspace.wind_file.as_ref())?;
        let own = own.clone();
        let source = source.clone();
        let recipe = ParsedScenario { source, head, file, types, areas_file, wind_file, own };
        Compiler::new(&Arc::new(recipe)).compile()
    }

    /// Returns the same scenario with another seed, as if compiled with that seed. Traffic that is drawn, and
    /// everything that depends on positions with errors, is computed anew; all else is shared.
    ///
    /// # Errors
    /// When generated airplanes find no place with this seed, or come too near to be optimized together.
    pub fn reseeded(&self, seed: u64) -> Result<Self, InputError> {
        let streams = Streams::new(Seed(seed));
        let is_drawn = self.recipe.file.airspace.generator.is_some();
        if is_drawn || self.world.has_position_errors {
            return Compiler::with_seed(&self.recipe, seed, &self.world).compile();
        }
        let fingerprint = self.recipe.fingerprint(seed);
        let reseeded =
            |world: &AirspaceWorld| AirspaceWorld { streams, fingerprint, ..world.clone() };
        let later = self.world.later_rules.iter().map(|(from, later)| (*from, reseeded(later)));
        let later_rules = Arc::new(later.collect());
        let world = Arc::new(AirspaceWorld { later_rules, ..reseeded(&self.world) });
        Ok(Self { world, seed, ..self.clone() })
    }

    /// Returns a file with the types of airplanes that it names; `None` if it names none.
    pub(super) fn types_text(&self) -> Option<String> {
        let types = &self.recipe.types;
        (!types.is_empty()).then(|| types.text())
    }

    /// Returns the path of the file of its areas, if it names one.
    pub(crate) fn areas_file(&self) -> Option<&str> {
        self.recipe.file.airspace.areas_file.as_ref().map(|file| &file.get_ref()[..])
    }

    /// Returns the path of the file of its winds, if it names one.
    pub(crate) fn wind_file(&self) -> Option<&str> {
        self.recipe.file.airspace.wind_file.as_ref().map(|file| &file.get_ref()[..])
    }

    /// Returns the state at the start.
    pub fn start_snapshot(&self) -> Snapshot {
        let airplanes = self
            .world
            .airplanes
            .iter()
            .zip(&*self.fallbacks)
            // First fallbacks follow from what is filed and seen.
            .map(|(airplane, &fallback)| {
                initial_airplane_record(airplane, fallback, self.world.has_common_plans())
            })
            .collect();
        Snapshot {
            cycle: 0,
            airplanes,
            contacts: Vec::new(),
            resolving: Vec::new(),
            exempt: self.too_close.clone(),
            orbit_poses: Vec::new(),
            commands: Vec::new(),
            external_actions: Vec::new(),
            controls: None,
            efforts: Vec::new(),
            holds: Vec::new(),
            state_vectors: Vec::new(),
        }
    }
}

/// Returns the state of an airplane at the start of its flight.
fn initial_airplane_record(
    airplane: &AirplaneStart,
    fallback: Fallback,
    is_tracked: bool,
) -> AirplaneSnapshot {
    AirplaneSnapshot {
        pose: airplane.start,
        ended: PackedFlightEnd::NONE,
        counts: [0; 4],
        fallback,
        is_tracked,
        altitude_m: match &airplane.track {
            Some(track) => track.altitude_at_m(airplane.appears_s),
            None => airplane.altitude_m,
        },
        orders: [0; 2],
        turn_rate_rad_s: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compiled(more: &str) -> CompiledAirspace {
        let text = format!("format = 1\nworld = \"airspace\"\n{more}");
        CompiledAirspace::new(&Source::new("test", text, "")).expect("a scenario")
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
        // One that comes in late, and one that is told something late, and neither ever ends.
        for late in [
            "appears_s = 4000.0\norders = [{ at_s = 10.0, heading_deg = 90.0 }]\n",
            "orders = [{ at_s = 10.0, heading_deg = 90.0 }, { at_s = 4000.0, heading_deg = 0.0 }]\n",
        ] {
            let late = format!(
                "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[7000, 0]]\n{late}"
            );
            assert_eq!(compiled(&late).cycles, 2400, "{late}");
        }
        let track = "[[airplanes]]\ntrack = [[0, 0, 0, 0], [3000, 100000, 0, 0]]\n";
        assert_eq!(compiled(track).cycles, 1800);
    }

    #[test]
    fn halving_the_steps_of_a_prediction_halves_neither_the_look_ahead_nor_what_lies_in_it() {
        let world = |dtau_s: f64, preset: &str| {
            compiled(&format!(
                "[airspace]\npreset = \"{preset}\"\ndtau_s = {dtau_s:?}\n\
                 [airspace.generator]\nkind = \"superconflict\"\nn = 2\n"
            ))
            .world
        };
        for preset in ["default", "paper"] {
            let (one, half) = (world(1.0, preset), world(0.5, preset));
            assert_eq!(one.timing.horizon_s(), half.timing.horizon_s());
            assert_eq!(one.interaction_range_m(0, 1), half.interaction_range_m(0, 1));
            // Two head-on airplanes, against the price of one that has left its way by 700 m.
            let price = |world: &AirspaceWorld| {
                let straight = |from_m: f64, v_m_s: f64| {
                    let at =
                        |k: usize| [from_m + v_m_s * world.timing.dtau_s * (k + 1) as f64, 0.0];
                    let points: Vec<_> = (0..world.timing.horizon).map(at).collect();
                    crate::flight::Prediction { counted: points.len(), points }
                };
                let a = straight(-2000.0, 35.0);
                let b = straight(2000.0, -35.0);
                let [cost, _] = world.objective.collision_costs(
                    &crate::flight::PairPlane::ONE_FRAME,
                    &a,
                    &b,
                    [500.0; 2],
                );
                cost / world.objective.deviation_cost(&a, &straight(-1300.0, 35.0))
                    / world.objective.alpha
            };
            let ratio = price(&half) / price(&one);
            assert!((ratio - 1.0).abs() < 0.01, "{preset}: {ratio}");
        }
    }
}
