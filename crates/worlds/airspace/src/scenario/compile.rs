//! Compilation of a scenario's sections to an immutable world.

use super::detours::DetourRules;
use super::start_groups::largest_start_group;
use super::{AirspaceFile, CompiledAirspace, ParsedScenario, Preset};
use crate::baseline::mvp::ResolutionSettings;
use crate::flight::{AirplaneStart, CommandKinds, SpeedFactors};
use crate::flight::{FlightLevelRange, MAX_STEPS_PER_DT};
use crate::flight::{TimeDiscretization, WaypointRule};
use crate::method::{MethodKind, OwnMethod};
use crate::perceive::observed_pose;
use crate::settings::{
    BuiltInMethod, Deployment, Disturbance, Grouping, ReactiveSettings, Resolution,
};
use crate::shield::{ErrorBounds, ExemptIds, Fallback, ShieldedAircraft, first_fallbacks};
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_collectives::LocalSearch;
use sidestep_import::geojson::GeoAreas;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_scenario::{ByName, SeedEffect, Source, Spanned};
use std::sync::Arc;

/// Meters by which levels that are far enough apart may seem nearer because they were rounded.
const ROUNDING_M: f64 = 1e-6;
/// Smallest limit on the cycles of a run, unless its length is given. It costs nothing: a run ends when all have
/// arrived.
const MIN_CYCLE_LIMIT: u64 = 400;
/// Factor on the time that the last airplane to enter would need alone, for a larger limit: it leaves room for detours
/// and orbits.
const CYCLE_LIMIT_FACTOR: f64 = 3.0;
/// Largest number of steps of a horizon: every action is predicted in all of them.
const MAX_HORIZON_STEPS: f64 = 10_000.0;
/// Largest number of actions of an airplane: the work for a pair grows with its square.
const MAX_ACTIONS: usize = 1000;
/// Largest number of pairs of points of two airplanes' actions: a tenth of a second's work.
const MAX_PAIR_STEPS: usize = 100_000_000;
/// Settings with which MVP loses no separation in super-conflicts of up to 20 airplanes, at the
/// smallest delay; the margin is BlueSky's own.
const MVP: ReactiveSettings =
    ReactiveSettings { look_ahead_s: 90.0, margin: 1.05, resolution_factor: 1.05 };
/// MVP by heading alone, and what holds where other resolutions are chosen: the vertical factor as the horizontal one, and
/// speeds that any airplane can fly.
const MVP_RESOLUTION: ResolutionSettings = ResolutionSettings {
    resolution: Resolution::Heading,
    vertical_factor: 1.05,
    vertical_lead_s: 0.0,
    speeds: SpeedFactors { least: 0.8, largest: 1.2 },
};
/// Settings with which ORCA loses no separation there, at the smallest delay.
const ORCA: ReactiveSettings =
    ReactiveSettings { look_ahead_s: 45.0, margin: 1.05, resolution_factor: 1.0 };
/// Settings with which track bands lose no separation there, at the smallest delay.
const BANDS: ReactiveSettings =
    ReactiveSettings { look_ahead_s: 90.0, margin: 1.05, resolution_factor: 1.0 };
/// Standard deviations of errors for which the shield allows, unless the scenario gives a number: of normal errors one
/// in 1.7 million is larger.
const DEFAULT_SIGMAS: f64 = 5.0;
const GIB: f64 = (1_u64 << 30) as f64;

pub(super) struct Compiler<'a> {
    pub(super) recipe: &'a Arc<ParsedScenario>,
    pub(super) source: &'a Source,
    pub(super) file: &'a AirspaceFile,
    seed: u64,
    /// The same world with another seed, if there is one already.
    known: Option<&'a AirspaceWorld>,
}

impl<'a> Compiler<'a> {
    /// Returns the compiler of a scenario, with its own seed.
    pub(super) fn new(recipe: &'a Arc<ParsedScenario>) -> Self {
        let ParsedScenario { source, head, file, .. } = &**recipe;
        Self { recipe, source, file, seed: head.seed, known: None }
    }

    /// Returns the compiler of a scenario with another seed than that of a known world.
    pub(super) fn with_seed(
        recipe: &'a Arc<ParsedScenario>,
        seed: u64,
        known: &'a AirspaceWorld,
    ) -> Self {
        Self { seed, known: Some(known), ..Self::new(recipe) }
    }

    /// Returns the content of the file of areas.
    pub(super) fn areas_of_file(&self) -> Option<&GeoAreas> {
        self.recipe.areas_file.as_ref()
    }

    pub(super) fn compile(&self) -> Result<CompiledAirspace, InputError> {
        let mut world = self.world()?;
        self.check_deployment(&world)?;
        self.check_action_set_sizes(&world)?;
        self.check_heading_noise(&world)?;
        let first = first_fallbacks_of(&world);
        let fallbacks = Arc::new(first.fallbacks);
        world.first_fallbacks = Arc::clone(&fallbacks);
        let mut later = self.later_rules(&world)?;
        self.complete_surveillance(&mut world, &mut later)?;
        world.later_rules = Arc::new(later);
        self.check_wind_field(&world)?;
        self.check_earth(&world)?;
        let head = &self.recipe.head;
        let cycles = head.cycles.unwrap_or_else(|| cycle_limit(&world));
        let compiled = CompiledAirspace {
            seeds: self.seed_effect(&world),
            world: Arc::new(world),
            name: head.name.clone(),
            seed: self.seed,
            cycles,
            record: self.file.record,
            fallbacks,
            too_close: first.too_close,
            unproved_pairs: first.unproved_pairs,
            recipe: Arc::clone(self.recipe),
        };
        self.check_group_memory(&compiled)?;
        Ok(compiled)
    }

    /// Returns the effect of another seed: traffic, errors and faults of messages are drawn;
    /// samples of the optimizer only guide its search.
    fn seed_effect(&self, world: &AirspaceWorld) -> SeedEffect {
        let Disturbance { heading_rad, .. } = world.disturbance;
        let is_drawn = self.file.airspace.generator.is_some()
            || world.has_position_errors
            || heading_rad > 0.0
            || world.gusts.is_some()
            || world.surveillance.is_some()
            || world.network.is_some();
        if is_drawn {
            return SeedEffect::Decide;
        }
        // A method of the program's own may draw: runs show it.
        let may_draw = world
            .all_rules()
            .any(|rules| matches!(rules.method, MethodKind::Pc | MethodKind::Own(_)));
        if may_draw { SeedEffect::Perhaps } else { SeedEffect::Nothing }
    }

    fn world(&self) -> Result<AirspaceWorld, InputError> {
        let section = &self.file.airspace;
        let method = self.method()?;
        let streams = Streams::new(Seed(self.seed));
        let timing = self.timing()?;
        let replay = self.replay_period(&timing);
        let mut airplanes = self.airplanes(&streams, replay)?;
        let vertical_m = section.vertical_m.map_or(300.0, f64::from) - ROUNDING_M;
        let surface = self.surface()?;
        let origin_deg = self.origin_deg(surface, &airplanes)?;
        let areas = self.areas(surface)?;
        let passing = self.waypoint_rule(&airplanes);
        let position_errors = self.position_errors(airplanes.len());
        let detours = DetourRules {
            surface,
            areas: &areas,
            tolerance_m: passing.tolerance_m,
            error_m: position_errors.bound_m.iter().copied().fold(0.0, f64::max),
        };
        detours.apply(&mut airplanes);
        let mvp = section.mvp.or_default(MVP);
        let mvp_resolution = section.mvp.resolution_or_default(MVP_RESOLUTION);
        let commands = self.command_kinds(&method, mvp_resolution);
        airplanes.iter_mut().for_each(|airplane| airplane.allow_commands(commands));
        let changes = self.change_kinds(&method, &airplanes);
        if !changes.is_none() {
            airplanes.iter_mut().for_each(AirplaneStart::allow_changes);
        }
        let orca = section.orca.or_default(ORCA);
        let bands = section.bands.or_default(BANDS);
        // The same for all methods that fly the scenario, so that their conflicts can be compared.
        let look_ahead_s = [mvp, orca, bands]
            .iter()
            .map(|settings| settings.look_ahead_s)
            .fold(timing.horizon_s(), f64::max);
        let wind = self.wind(surface, &airplanes)?;
        let world = AirspaceWorld {
            network: self.network(&timing, &airplanes)?,
            wind_m_s: wind.wind_m_s,
            wind_field: wind.field,
            gusts: self.gusts(&timing, &airplanes)?,
            surveillance: self.surveillance(&timing)?,
            velocity_noise_m_s: self.velocity_noises_m_s(airplanes.len()).into(),
            passing,
            airplanes: Arc::new(airplanes),
            timing,
            objective: self.objective(vertical_m, timing.dtau_s),
            settings: self.settings()?,
            holds_s: section.holds_s.0.clone(),
            legs: self.detour_legs()?,
            method,
            mvp,
            mvp_resolution,
            changes,
            orca,
            bands,
            deployment: section.deployment,
            groups: section.groups.as_ref().map(|given| *given.get_ref()).unwrap_or_default(),
            minimum_up_to: section.minimum_up_to.map_or(0, |airplanes| airplanes.get() as usize),
            group_bytes: (section.group_memory_gib.map_or(2.0, f64::from) * GIB) as u64,
            shield: section.shield.0,
            right_of_way: section.right_of_way,
            uses_right_of_way: false,
            vertical_m,
            safe_altitude_m: section.safe_altitude_m.map(f64::from),
            origin_deg,
            surface,
            curvature_m: 0.0,
            start_utc_s: section.start_utc_s.map(f64::from),
            replay_cycles: replay.cycles,
            areas,
            disturbance: self.disturbance(),
            has_position_errors: position_errors.noise_m.iter().any(|noise_m| *noise_m > 0.0),
            position_noise_m: position_errors.noise_m.into(),
            position_bound_m: position_errors.bound_m.into(),
            bounds: self.error_bounds(),
            measures: self.measures(look_ahead_s),
            fingerprint: self.recipe.fingerprint(self.seed),
            streams,
            actions: Arc::default(),
            later: Arc::default(),
            orbit_rad_s: Arc::default(),
            command_limits: Arc::default(),
            top_m_s: Arc::default(),
            alone_s: Arc::default(),
            alone_efforts: Arc::default(),
            fallbacks: Arc::default(),
            first_fallbacks: Arc::default(),
            teams: Arc::default(),
            later_rules: Arc::default(),
            rules_since: 0,
        };
        let mut world = world.with_derived_fields(self.known);
        world.teams = match self.known {
            // Teams follow from models alone, which no seed draws.
            Some(known) => Arc::clone(&known.teams),
            None => Arc::new(world.teams_by_action_space()),
        };
        Ok(world)
    }

    /// Returns the kinds of changes among which a method of the scenario chooses at some time.
    fn change_kinds(&self, method: &MethodKind, airplanes: &[AirplaneStart]) -> CommandKinds {
        let later =
            self.file.airspace.changes.iter().filter_map(|change| change.get_ref().method());
        let is_used = matches!(method, MethodKind::Pc | MethodKind::External)
            || later.into_iter().any(|word| word == BuiltInMethod::Pc);
        if !is_used {
            return CommandKinds::NONE;
        }
        let of_any = |has: fn(&AirplaneStart) -> bool| airplanes.iter().any(has);
        // Which speeds there are each airplane knows by itself.
        let as_filed = SpeedFactors { least: 1.0, largest: 1.0 };
        CommandKinds {
            levels: of_any(|airplane| !airplane.changes.levels_m.is_empty()),
            speeds: of_any(|airplane| !airplane.changes.speeds_m_s.is_empty()).then_some(as_filed),
        }
    }

    /// Returns what the methods of a scenario may command of airplanes at any time.
    fn command_kinds(&self, method: &MethodKind, start: ResolutionSettings) -> CommandKinds {
        let mut kinds = match method {
            MethodKind::Own(own) => own.command_kinds(),
            _ => CommandKinds::NONE,
        };
        let mut uses_mvp = matches!(method, MethodKind::Mvp);
        let mut resolution = start;
        if uses_mvp {
            kinds = kinds.or(resolution.command_kinds());
        }
        for change in &self.file.airspace.changes {
            let change = change.get_ref();
            if let Some(word) = change.method() {
                uses_mvp = word == BuiltInMethod::Mvp;
            }
            if let Some(section) = change.mvp() {
                resolution = section.resolution_or_default(resolution);
            }
            if uses_mvp {
                kinds = kinds.or(resolution.command_kinds());
            }
        }
        kinds
    }

    fn method(&self) -> Result<MethodKind, InputError> {
        match &self.file.airspace.method {
            ByName::BuiltIn(word) => Ok((*word).into()),
            ByName::Own(name) => {
                let own = &self.recipe.own;
                let method = ByName::<BuiltInMethod>::find_own(self.source, name, own)?;
                Ok(MethodKind::Own(OwnMethod::new(name.get_ref(), method)))
            }
        }
    }

    /// Returns the rule for way-points: reached within a fifth of the largest separation, unless given.
    fn waypoint_rule(&self, airplanes: &[AirplaneStart]) -> WaypointRule {
        let radius_m = airplanes.iter().map(|a| a.model.separation_m).fold(0.0, f64::max);
        let given = self.file.airspace.tolerance_m;
        // The 100 m that go with the paper's separation of 500 m.
        let tolerance_m = given.map_or((radius_m / 5.0).max(1.0), f64::from);
        let passes_abeam = self.file.airspace.passes_abeam;
        WaypointRule { tolerance_m, passes: true, passes_abeam }
    }

    fn disturbance(&self) -> Disturbance {
        let section = &self.file.airspace;
        Disturbance {
            position_m: self.position_noise_m(),
            heading_rad: section.heading_noise_deg.map_or(0.0, f64::from).to_radians(),
        }
    }

    /// Returns the standard deviation of known positions, unless the category of an airplane says another one.
    pub(super) fn position_noise_m(&self) -> f64 {
        self.file.airspace.position_noise_m.map_or(0.0, f64::from)
    }

    /// Returns the number of standard deviations for which the shield allows.
    pub(super) fn error_sigmas(&self) -> f64 {
        self.file.airspace.error_sigmas.map_or(DEFAULT_SIGMAS, f64::from)
    }

    /// Returns the bounds on errors for which the shield allows, of airplanes without a category of their own.
    pub(super) fn error_bounds(&self) -> ErrorBounds {
        let sigmas = self.error_sigmas();
        let Disturbance { position_m, heading_rad } = self.disturbance();
        ErrorBounds { position_m: sigmas * position_m, heading_rad: sigmas * heading_rad }
    }

    /// Refuses errors of heading against which an airplane could not hold an orbit.
    fn check_heading_noise(&self, world: &AirspaceWorld) -> Result<(), InputError> {
        let gust_rad = world.bounds.heading_rad;
        if !world.shield || gust_rad == 0.0 {
            return Ok(());
        }
        let error = |cause: &str, remedy: &str| Err(self.source.error(None, cause, remedy));
        if world.network.is_some() {
            let cause = "errors of heading, over a network that is not to be relied on";
            let remedy = "nobody could see which orbit another one holds: leave out \
                          heading_noise_deg or [airspace.network], or set shield = \"off\"";
            return error(cause, remedy);
        }
        let weak = world.airplanes.iter().find(|a| {
            let rate_rad_s =
                world.bounds.max_orbit_rate_rad_s(&a.least_turning_model(), world.timing.dt_s);
            !a.is_non_cooperative && rate_rad_s.is_none()
        });
        let Some(weak) = weak else { return Ok(()) };
        let cause = format!(
            "gusts turn airplanes by up to {:.2} deg per dt_s (error_sigmas times \
             heading_noise_deg), and one of {:.2} deg/s cannot hold an orbit against them",
            gust_rad.to_degrees(),
            weak.least_turning_model().omega_max_rad_s.to_degrees()
        );
        let remedy = "give a smaller heading_noise_deg or error_sigmas, or set shield = \"off\"";
        error(&cause, remedy)
    }

    /// Sets the height that is enough between levels.
    pub(super) fn set_vertical_m(&self, world: &mut AirspaceWorld, vertical_m: f64) {
        world.vertical_m = vertical_m - ROUNDING_M;
        world.objective.vertical_m = world.vertical_m;
    }

    /// Refuses settings that the deployment cannot compute.
    fn check_deployment(&self, world: &AirspaceWorld) -> Result<(), InputError> {
        if let Some(given) = &self.file.airspace.groups
            && (world.groups, world.deployment) == (Grouping::Heard, Deployment::Direct)
        {
            let cause =
                "groups that are heard, but one process decides for all (deployment = \"direct\")";
            let remedy = "set deployment to team, compact-team, replica-team, pim or hierarchical-pim, or leave \
                          groups out";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        if let Some(reason) = world.deployment.unsupported_reason(&world.settings) {
            let cause = format!("deployment {}: {reason}", world.deployment.name());
            let remedy = "set order = \"parallel\" and utility = \"joint\", or \
                          estimator = { kind = \"exact\" }";
            return Err(self.source.error(None, cause, remedy));
        }
        if world.settings.local_search == LocalSearch::BranchAndBound
            && !world.deployment.knows_all_costs()
        {
            let cause = format!(
                "branch and bound in a {}, in which each airplane knows the costs of its own pairs alone",
                world.deployment.name()
            );
            let remedy = "set local_search = \"pairs\", or deployment = \"replica-team\"";
            let given = self.file.airspace.local_search.as_ref();
            return Err(self.source.error(given.map(|given| given.span()), cause, remedy));
        }
        // A stream has that many blocks of four words.
        if world.max_samples().is_none_or(|samples| samples > u64::from(u16::MAX) * 4) {
            let cause = "more samples than a random stream holds";
            let remedy = "give smaller blocks or fewer rounds, or order = \"parallel\": in \
                          sequence each airplane draws a block anew after every other";
            return Err(self.source.error(None, cause, remedy));
        }
        Ok(())
    }

    /// Refuses groups that need more memory at the start than allowed.
    fn check_group_memory(&self, compiled: &CompiledAirspace) -> Result<(), InputError> {
        let world = &compiled.world;
        if !matches!(world.method, MethodKind::Pc) {
            return Ok(());
        }
        let state = AirspaceState::restore(world, &compiled.start_snapshot());
        let (airplanes, bytes) = largest_start_group(world, &state);
        if bytes <= world.group_bytes {
            return Ok(());
        }
        let gib = bytes as f64 / GIB;
        let cause = format!(
            "{airplanes} airplanes near each other need up to {gib:.1} GiB to be optimized together"
        );
        let allowed = world.group_bytes as f64 / GIB;
        let remedy = format!(
            "give fewer airplanes, a shorter horizon, fewer turns or holds_s, or a group_memory_gib \
             above {allowed}"
        );
        Err(self.source.error(None, cause, remedy))
    }

    pub(super) fn is_paper_preset(&self) -> bool {
        self.file.airspace.preset == Preset::Paper
    }

    fn timing(&self) -> Result<TimeDiscretization, InputError> {
        let section = &self.file.airspace;
        if let Some(look_every) = section.look_every_s.as_ref().filter(|_| self.looks_anew()) {
            let every_s = look_every.get_ref().get();
            let horizon = self.horizon(every_s, every_s)?;
            return Ok(TimeDiscretization { dt_s: every_s, dtau_s: every_s, horizon });
        }
        let dt_s = section.dt_s.as_ref().map_or(5.0, |v| v.get_ref().get());
        let dtau_s = section.dtau_s.as_ref().map_or(1.0, |v| v.get_ref().get());
        let dtau_span = section.dtau_s.as_ref().map(Spanned::span);
        let span = dtau_span.or_else(|| section.dt_s.as_ref().map(Spanned::span));
        let steps = dt_s / dtau_s;
        // Decimal fractions are rounded, so that 0.3 / 0.1 is not 3.
        if (steps - steps.round()).abs() > 1e-9 || steps < 1.0 {
            let cause = format!("dt_s = {dt_s} is no multiple of dtau_s = {dtau_s}");
            return Err(self.source.error(span, cause, "give a dtau_s that divides dt_s"));
        }
        if steps > MAX_STEPS_PER_DT as f64 {
            let cause = format!("{steps} steps of dtau_s in each dt_s");
            let remedy =
                format!("give up to {MAX_STEPS_PER_DT}: each is flown and watched by itself");
            return Err(self.source.error(span, cause, remedy));
        }
        Ok(TimeDiscretization { dt_s, dtau_s, horizon: self.horizon(dt_s, dtau_s)? })
    }

    /// Returns whether all methods of the scenario look anew each time, and plan nothing.
    fn looks_anew(&self) -> bool {
        let is_reactive = |method: BuiltInMethod| {
            matches!(
                method,
                BuiltInMethod::Mvp
                    | BuiltInMethod::Orca
                    | BuiltInMethod::Bands
                    | BuiltInMethod::None
            )
        };
        let section = &self.file.airspace;
        let starts_so = match &section.method {
            ByName::BuiltIn(method) => is_reactive(*method),
            ByName::Own(_) => false,
        };
        starts_so && self.methods_of_changes().all(is_reactive)
    }

    /// Returns the number of points of a prediction, which reach as far as the scenario says.
    fn horizon(&self, dt_s: f64, dtau_s: f64) -> Result<usize, InputError> {
        let section = &self.file.airspace;
        if let Some(former) = &section.horizon {
            let remedy = match former.get_ref().as_integer() {
                Some(points) => format!("write horizon_s = {:?}", points as f64 * dtau_s),
                None => "write horizon_s, in seconds".into(),
            };
            let cause = "a horizon in points, which is a time now";
            return Err(self.source.error(former.span(), cause, remedy));
        }
        // The paper predicts 125 points of one second each.
        let preset_s: f64 = if self.is_paper_preset() { 125.0 } else { 100.0 };
        let given = section.horizon_s.as_ref();
        let horizon_s = given.map_or(preset_s.max(dt_s), |h| h.get_ref().get());
        // A time that rounding puts behind a point ends at that point.
        let points = (horizon_s / dtau_s - 1e-9).ceil();
        if horizon_s < dt_s || points > MAX_HORIZON_STEPS {
            let cause = format!("a horizon of {horizon_s} s, in steps of {dtau_s} s");
            let remedy = format!(
                "give at least dt_s = {dt_s}, which is flown before the next look, and at most \
                 {MAX_HORIZON_STEPS} steps of dtau_s, for every action is predicted in all of them"
            );
            return Err(self.source.error(given.map(Spanned::span), cause, remedy));
        }
        Ok(points as usize)
    }

    /// Refuses sets of actions that are too large for one pair of airplanes: a run checks after
    /// every pair whether it is to stop.
    fn check_action_set_sizes(&self, world: &AirspaceWorld) -> Result<(), InputError> {
        let actions = world.actions.iter().map(Vec::len).max().unwrap_or(0);
        let horizon = world.timing.horizon;
        if actions <= MAX_ACTIONS && actions * actions * horizon <= MAX_PAIR_STEPS {
            return Ok(());
        }
        let cause = format!("{actions} actions of an airplane, in {horizon} steps each");
        let remedy = format!(
            "give fewer turns, holds_s or legs, or a shorter horizon_s: up to {MAX_ACTIONS} \
             actions, and {MAX_PAIR_STEPS} steps to compare all of two airplanes"
        );
        Err(self.source.error(None, cause, remedy))
    }
}

/// Returns a number of cycles in which all should arrive. Of flights that never end it counts their start and their
/// last order.
fn cycle_limit(world: &AirspaceWorld) -> u64 {
    let mut max_end_s: f64 = 0.0;
    for i in 0..world.airplanes.len() {
        let solo_end_s = world.solo_end_s(i);
        let end_s = if solo_end_s.is_finite() { solo_end_s } else { last_change_s(world, i) };
        max_end_s = max_end_s.max(end_s);
    }
    MIN_CYCLE_LIMIT.max((CYCLE_LIMIT_FACTOR * max_end_s / world.timing.dt_s).ceil() as u64)
}

/// Returns the time of the last known change of an airplane that flies on forever.
fn last_change_s(world: &AirspaceWorld, i: usize) -> f64 {
    let airplane = &world.airplanes[i];
    let last_s = airplane.orders.last().map_or(0.0, |order| order.at_s);
    last_s.max(world.cycle_start_s(world.appearance_cycle(i)))
}

/// The fallbacks with which airplanes start.
struct FirstFallbacks {
    /// Those of all airplanes, by id.
    fallbacks: Vec<Fallback>,
    /// The pairs that are not apart.
    too_close: Vec<(u32, u32)>,
    /// Number of those of them for which the search has come to its limit.
    unproved_pairs: u64,
}

/// Returns first fallbacks that are apart as far as possible. Without the shield nobody needs any.
fn first_fallbacks_of(world: &AirspaceWorld) -> FirstFallbacks {
    let mut fallbacks = vec![Fallback::default(); world.airplanes.len()];
    if !world.shield {
        return FirstFallbacks { fallbacks, too_close: Vec::new(), unproved_pairs: 0 };
    }
    // Airplanes that enter at other times do not meet at the start.
    let starts: Vec<usize> = (0..fallbacks.len())
        .filter(|&i| world.first_controlled_cycle(i) == 0 && !world.is_non_cooperative(i as u32, 0))
        .collect();
    let mut group = Vec::with_capacity(starts.len());
    for (rank, &i) in starts.iter().enumerate() {
        let airplane = &world.airplanes[i];
        let altitude_m = airplane.altitude_m;
        let seen = observed_pose(world, i as u32, 0, airplane.start);
        group.push(ShieldedAircraft {
            frame: world.surface.frame_at(seen.at),
            pose: seen,
            orbit_pose: seen,
            v_m_s: airplane.model.v_m_s,
            omega_max_rad_s: airplane.model.omega_max_rad_s,
            orbit_rad_s: world.orbit_rad_s[i],
            separation_m: airplane.model.separation_m,
            error_m: world.error_m(i),
            levels: FlightLevelRange::from_level(altitude_m),
            drift: world.air_drift(seen.at, altitude_m, altitude_m),
            vertical_m: world.vertical_m,
            fallback: Fallback::default(),
            choices: Arc::clone(&world.fallbacks[i]),
            dt_s: world.timing.dt_s,
            exempt: ExemptIds::default(),
            rank: rank as u64,
            id: i as u32,
            areas: world.areas_around(i as u32, (seen.at, altitude_m), 0),
        });
    }
    let chosen = first_fallbacks(&group);
    for (&i, fallback) in starts.iter().zip(chosen.fallbacks) {
        fallbacks[i] = fallback;
    }
    let too_close =
        chosen.too_close.into_iter().map(|(i, j)| (starts[i] as u32, starts[j] as u32)).collect();
    FirstFallbacks { fallbacks, too_close, unproved_pairs: chosen.unproved.len() as u64 }
}
