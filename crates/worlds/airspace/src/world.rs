//! A compiled airspace: everything that stays fixed during a run.

mod later_areas;
mod solo_flight;
#[cfg(test)]
mod tests;

use super::areas::{AreaContext, Areas, LocalAreas};
use super::baseline::mvp::{MvpRules, ResolutionSettings};
use super::flight::{
    Action, AirplaneStart, ChangeableFlight, Chart, CommandKinds, CommandLimits,
    DetourAlternatives, DoneOrders, FiledLevelSpeed, FlightChange, FlightConditions,
    FlightLevelRange, FlightOrder, FlightPhase, FlightTask, Gusts, InterOrderSegment,
    KnownAircraft, MethodCommand, Point, Pose2, RoutePosition, SegmentAfterOrder, Surface,
    TimeDiscretization, Track, WaypointRule, WindField, actions, actions_at_turn_rate,
    segments_after_orders,
};
use super::measures::{FlightEffort, MeasureSettings};
use super::method::MethodKind;
use super::non_cooperative::NonCooperativeAircraft;
use super::objective::{ActionChanges, ActionPredictions, Objective};
use super::settings::{
    Deployment, Disturbance, Grouping, ReactiveSettings, RightOfWayRule, SurveillanceSettings,
};
use super::shield::{
    AirDrift, ErrorBounds, Fallback, OrbitSide, common_orbit_rates, curvature_error_m,
};
use sidestep_collectives::{Estimator, OptimizerConfig, UpdateOrder};
use sidestep_kernel::control::AgentTeams;
use sidestep_kernel::geometry::sub;
use sidestep_kernel::network::Network;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, math};
use std::borrow::Cow;
use std::sync::Arc;

/// Meters around the reach of an airplane within which areas are considered: more than all margins of plans.
const AREA_GAP_M: f64 = 10.0;

/// The immutable world, shared by all runs of a scenario.
#[derive(Debug, Clone)]
pub struct AirspaceWorld {
    /// The airplanes by id.
    pub airplanes: Arc<Vec<AirplaneStart>>,
    /// Lengths of a cycle, of the steps in it, and of the horizon.
    pub timing: TimeDiscretization,
    /// Rule by which way-points count as reached.
    pub passing: WaypointRule,
    /// The objective that is minimized.
    pub objective: Objective,
    /// Settings of the optimizer, which only method `pc` has.
    pub settings: OptimizerConfig,
    /// Further hold times of actions, in seconds.
    pub holds_s: Vec<f64>,
    /// Legs to the sides, which take the place of held turns.
    pub legs: DetourAlternatives,
    /// The method by which airplanes choose their actions.
    pub method: MethodKind,
    /// Settings of MVP; without effect on other methods.
    pub mvp: ReactiveSettings,
    /// The kinds of changes among which methods `pc` and `external` may choose for some airplane.
    pub changes: CommandKinds,
    /// How MVP resolves conflicts; without effect on other methods.
    pub mvp_resolution: ResolutionSettings,
    /// Settings of ORCA; without effect on other methods.
    pub orca: ReactiveSettings,
    /// Settings of track bands; without effect on other methods.
    pub bands: ReactiveSettings,
    /// The deployment of the optimizer.
    pub deployment: Deployment,
    /// How its agents learn their groups.
    pub groups: Grouping,
    /// The network that carries its messages, if it is unreliable.
    pub network: Option<Network>,
    /// Optimizations of groups of up to this many airplanes are compared with the true minimum.
    pub minimum_up_to: usize,
    /// Bytes that the pair tables of a group may take; larger groups are not optimized.
    pub group_bytes: u64,
    /// Whether the shield filters decisions.
    pub shield: bool,
    /// The rule by which airplanes of one priority give way.
    pub right_of_way: RightOfWayRule,
    /// Whether some airplane may have right of way over another one.
    pub(crate) uses_right_of_way: bool,
    /// Airplanes at least this many meters above each other need not avoid each other. It is
    /// slightly less than the scenario asks for, so that levels in feet are apart when they are
    /// nominally so.
    pub vertical_m: f64,
    /// Altitude in meters below which an airplane that the shield holds is in danger, if one is known.
    pub safe_altitude_m: Option<f64>,
    /// Number of cycles in which recorded airplanes follow their tracks; then the method flies
    /// them.
    pub replay_cycles: Cycle,
    /// The surface that all fly over.
    pub surface: Surface,
    /// Bound in meters on how far an airplane may be from where it is in the plane of a pair, because the earth is
    /// round, see `shield/curvature.rs`; 0 in a plane.
    pub(crate) curvature_m: f64,
    /// Latitude and longitude of the origin, in degrees, where traffic has a position on earth: in a geographic scenario
    /// only where drawings have their origin.
    pub origin_deg: Option<Point>,
    /// Time of the start, in seconds since 1970, UTC, where traffic has a date.
    pub start_utc_s: Option<f64>,
    /// The wind, which all know, in meters per second. Where it differs from level to level or from place to place, the
    /// velocity of the air in which motions of different airplanes are compared.
    pub wind_m_s: Point,
    /// The wind on each level and in each place, where it differs.
    pub wind_field: Option<Arc<WindField>>,
    /// Gusts beside it, which nobody knows.
    pub gusts: Option<Gusts>,
    /// The areas to stay out of, or inside of.
    pub areas: Areas,
    /// Random errors that no airplane knows.
    pub disturbance: Disturbance,
    /// Standard deviation of each coordinate of the position in which all see an airplane, by id, in meters.
    pub(crate) position_noise_m: Arc<[f64]>,
    /// Whether some airplane is seen elsewhere than where it is.
    pub(crate) has_position_errors: bool,
    /// Bound on the errors of that position for which the shield allows, by id, in meters.
    pub(crate) position_bound_m: Arc<[f64]>,
    /// Bounds on those errors for which the shield allows.
    pub bounds: ErrorBounds,
    /// How airplanes receive each other's reports; none where all see all others at once.
    pub surveillance: Option<SurveillanceSettings>,
    /// Standard deviation of each coordinate of the velocity that an airplane reports, by id, in meters per second.
    pub(crate) velocity_noise_m_s: Arc<[f64]>,
    /// The measures that a run takes.
    pub measures: MeasureSettings,
    /// Digest of the scenario's text and seed, by which agents recognize those of the same scenario.
    pub fingerprint: u64,
    pub(crate) streams: Streams,
    /// Actions of each airplane.
    pub(crate) actions: Arc<Vec<Vec<Action>>>,
    /// The stage of each airplane's flight after each of its orders.
    pub(crate) later: Arc<Vec<Vec<SegmentAfterOrder>>>,
    /// The turn rate of each airplane's orbits, in radians per second.
    pub(crate) orbit_rad_s: Arc<Vec<f64>>,
    /// The commands that may be in force for each airplane; empty where no method commands anything.
    pub(crate) command_limits: Arc<[CommandLimits]>,
    /// The greatest speed of each airplane, in meters per second.
    pub(crate) top_m_s: Arc<Vec<f64>>,
    /// Seconds that each airplane would need if it were alone.
    pub(crate) alone_s: Arc<Vec<f64>>,
    /// What each airplane's flight would cost if it were alone; nothing where that is not measured.
    pub(crate) alone_efforts: Arc<Vec<FlightEffort>>,
    /// The fallbacks that the plans of each airplane may end with, in the order in which they are tried.
    pub(crate) fallbacks: Arc<Vec<Arc<[Fallback]>>>,
    /// The first fallbacks.
    pub(crate) first_fallbacks: Arc<Vec<Fallback>>,
    /// The airplanes that decide, by the orders that they may be given.
    pub(crate) teams: Arc<AgentTeams>,
    /// The same world under the rules that hold from later cycles on, by rising cycle.
    pub(crate) later_rules: Arc<Vec<(Cycle, AirspaceWorld)>>,
    /// The cycle from which these rules hold.
    pub(crate) rules_since: Cycle,
}

impl AirspaceWorld {
    /// Returns whether the shield may hold airplanes in a way that is counted: off a level, or below the safe altitude.
    pub(crate) fn has_holds(&self) -> bool {
        let is_level = |order: &FlightOrder| matches!(order.task, FlightTask::Altitude { .. });
        let changes_level = || self.airplanes.iter().any(|one| one.orders.iter().any(is_level));
        self.shield && (self.safe_altitude_m.is_some() || changes_level() || self.has_commands())
    }

    /// Returns the call sign of an airplane, if it has one.
    pub(crate) fn callsign(&self, id: EntityId) -> Option<String> {
        self.airplanes.get(id as usize)?.callsign.clone()
    }

    /// Returns the call signs of two airplanes, if both have one.
    pub(crate) fn callsigns(&self, [a, b]: [EntityId; 2]) -> Option<[String; 2]> {
        Some([self.callsign(a)?, self.callsign(b)?])
    }

    /// Returns the name that people use for an airplane: its call sign, or else its id.
    pub(crate) fn display_name(&self, id: EntityId) -> String {
        self.callsign(id).unwrap_or_else(|| id.to_string())
    }

    /// Returns the world with the rules that hold in a cycle.
    pub(crate) fn with_rules_of(&self, now: Cycle) -> &Self {
        let begun = self.later_rules.partition_point(|(from, _)| *from <= now);
        match begun.checked_sub(1) {
            Some(last) => &self.later_rules[last].1,
            None => self,
        }
    }

    /// Returns whether other rules hold from this cycle on.
    pub(crate) fn rules_begin_at(&self, now: Cycle) -> bool {
        self.rules_since == now && now > 0
    }

    /// Returns the world and all that it becomes by changes of rules.
    pub(crate) fn all_rules(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.later_rules.iter().map(|(_, world)| world))
    }

    /// Fills in the fields that follow from the others. Those that follow from models and orders alone, which
    /// no seed draws, are shared with the same world of another seed.
    #[must_use]
    pub(crate) fn with_derived_fields(mut self, known: Option<&Self>) -> Self {
        self.uses_right_of_way = self.may_have_right_of_way();
        self.later = Arc::new(self.airplanes.iter().map(segments_after_orders).collect());
        if let Some(known) = known {
            self.actions = Arc::clone(&known.actions);
            self.orbit_rad_s = Arc::clone(&known.orbit_rad_s);
            self.top_m_s = Arc::clone(&known.top_m_s);
        } else {
            self.actions = Arc::new(
                self.airplanes
                    .iter()
                    .map(|a| {
                        actions(&a.model, self.timing.dt_s, &self.holds_s, &self.legs, &a.changes)
                    })
                    .collect(),
            );
            self.orbit_rad_s = Arc::new(self.orbits_rad_s());
            self.top_m_s = Arc::new(self.map_airplanes(Self::max_speed_m_s));
        }
        self.command_limits = self.limits_of_commands();
        self.fallbacks =
            Arc::new((0..self.airplanes.len()).map(|i| self.fallback_choices(i)).collect());
        self.curvature_m = self.curvature_error_m();
        let mut alone_s = Vec::with_capacity(self.airplanes.len());
        let mut efforts = Vec::with_capacity(self.airplanes.len());
        for i in 0..self.airplanes.len() {
            let solo = self.solo_outcome(i);
            alone_s.push(solo.duration_s);
            efforts.push(solo.effort);
        }
        self.alone_s = Arc::new(alone_s);
        self.alone_efforts = Arc::new(efforts);
        self
    }

    /// Returns a number of each airplane.
    fn map_airplanes(&self, number: impl Fn(&Self, usize) -> f64) -> Vec<f64> {
        (0..self.airplanes.len()).map(|i| number(self, i)).collect()
    }

    /// Returns the turn rates at which airplanes orbit under the shield.
    fn orbits_rad_s(&self) -> Vec<f64> {
        let mut rates: Vec<f64> = Vec::with_capacity(self.airplanes.len());
        for airplane in &*self.airplanes {
            let model = airplane.least_turning_model();
            let max_rad_s = self.bounds.max_orbit_rate_rad_s(&model, self.timing.dt_s);
            rates.push(max_rad_s.filter(|_| self.shield).unwrap_or(model.omega_max_rad_s));
        }
        // Only airplanes that may come to orbit have to share a rate.
        let orbiting: Vec<usize> =
            (0..rates.len()).filter(|&i| self.shield && self.is_controlled(i)).collect();
        let max_rates: Vec<f64> = orbiting.iter().map(|&i| rates[i]).collect();
        for (&i, rate) in orbiting.iter().zip(common_orbit_rates(&max_rates)) {
            rates[i] = rate;
        }
        rates
    }

    /// Returns the fallbacks that the plans of an airplane may end with.
    fn fallback_choices(&self, i: usize) -> Arc<[Fallback]> {
        // Without the shield none is flown, and groups should not depend on them. Where messages get lost, airplanes have
        // to know the path of one that they cannot hear: they see on which side it orbits, unless they can compute more.
        let must_be_seen = self.network.is_some() && !self.has_common_plan(i as EntitySlot);
        if !self.shield || must_be_seen {
            return OrbitSide::BOTH.map(Fallback::from_side).into();
        }
        let radius_s = 1.0 / self.orbit_rad_s[i];
        // As long as groups need not be larger for it than the method makes them, or a little longer.
        let look_ahead_s = self.reactive_settings().look_ahead_s;
        let max_lead_s = (look_ahead_s - self.timing.dt_s - 2.0 * radius_s).max(radius_s);
        let model = &self.airplanes[i].model;
        let choices = Fallback::choices(model, self.orbit_rad_s[i], self.timing.dt_s, max_lead_s);
        self.with_escape_fallbacks(i, choices)
    }

    /// Returns whether airplanes compute plans for each other from what all see: where messages get lost, all see the same,
    /// and nothing that cannot be seen decides. A gust takes an airplane off its fallback by what nobody else knows.
    pub(crate) fn has_common_plans(&self) -> bool {
        self.network.is_some()
            && self.shield
            && self.groups == Grouping::Announced
            && self.bounds.heading_rad == 0.0
            && !matches!(self.method, MethodKind::External)
    }

    /// Returns whether all can compute a plan for an airplane. Orders are not filed: only the airplane knows of them.
    pub(crate) fn has_common_plan(&self, slot: EntitySlot) -> bool {
        self.has_common_plans() && self.airplanes[slot as usize].orders.is_empty()
    }

    /// Returns the longest time of a fallback until it orbits, in seconds.
    fn fallback_lead_s(&self, i: usize) -> f64 {
        let cycles = self.fallbacks[i].iter().map(|fallback| fallback.cycles_until_orbit()).max();
        f64::from(cycles.unwrap_or(0)) * self.timing.dt_s
    }

    /// Returns how far an airplane gets within one `dt`, and on a fallback after it, in meters.
    fn fallback_reach_m(&self, i: usize) -> f64 {
        let v_m_s = self.top_m_s[i];
        let lead_s = self.fallback_lead_s(i);
        v_m_s * (self.timing.dt_s + lead_s) + 2.0 * v_m_s / self.orbit_rad_s[i]
    }

    /// Returns how far an airplane may be from where it is in the plane of a pair that has to be kept apart.
    pub(crate) fn curvature_error_m(&self) -> f64 {
        let is_orbiting = |i: &usize| self.shield && self.is_controlled(*i);
        let reach_m =
            (0..self.airplanes.len()).filter(is_orbiting).map(|i| self.fallback_reach_m(i));
        let max_reach_m = reach_m.fold(0.0, f64::max);
        let gaps_m = self.airplanes.iter().map(|airplane| airplane.model.separation_m);
        match self.surface {
            Surface::Plane => 0.0,
            Surface::Earth => curvature_error_m(gaps_m.fold(0.0, f64::max), max_reach_m),
        }
    }

    /// Returns the standard deviation of each coordinate of the position in which all see an airplane, in meters.
    pub fn position_noise_m(&self, i: usize) -> f64 {
        self.position_noise_m[i]
    }

    /// Returns the bound on the errors of that position for which the shield allows, in meters.
    pub fn position_bound_m(&self, i: usize) -> f64 {
        self.position_bound_m[i]
    }

    /// Returns the standard deviation of each coordinate of the velocity that an airplane reports, in meters per second.
    pub fn velocity_noise_m_s(&self, i: usize) -> f64 {
        self.velocity_noise_m_s[i]
    }

    /// Returns how far an airplane may be from its plans as they are seen, in meters.
    pub(crate) fn error_m(&self, i: usize) -> f64 {
        let bounds = ErrorBounds { position_m: self.position_bound_m[i], ..self.bounds };
        bounds.error_m(self.top_m_s[i], self.timing.dt_s) + self.curvature_m
    }

    fn max_speed_m_s(&self, i: usize) -> f64 {
        let airplane = &self.airplanes[i];
        let recorded = airplane.track.as_ref().map_or(0.0, Track::max_speed_m_s);
        airplane.planned_speeds_m_s().fold(recorded, f64::max)
    }

    /// Returns how positions are drawn.
    pub(crate) fn chart(&self) -> Chart {
        Chart::new(self.surface, self.origin_deg)
    }

    /// Returns where a position is drawn, in meters.
    pub(crate) fn display_m(&self, at: Point) -> Point {
        self.chart().point(at)
    }

    /// Returns how a pose is drawn.
    pub(crate) fn display_pose(&self, pose: Pose2) -> Pose2 {
        self.chart().pose(pose)
    }

    /// Returns the properties of the air in which motions of different airplanes are compared: the air that all fly
    /// through, unless the wind differs from level to level or from place to place.
    pub fn flight_environment(&self) -> FlightConditions {
        FlightConditions {
            timing: self.timing,
            passing: self.passing,
            wind_m_s: self.wind_m_s,
            common_wind_m_s: self.wind_m_s,
            surface: self.surface,
        }
    }

    /// Returns the properties of the air in a place, in coordinates of the scenario, and on a level.
    pub fn air_at(&self, at: Point, altitude_m: f64) -> FlightConditions {
        FlightConditions { wind_m_s: self.wind_at(at, altitude_m), ..self.flight_environment() }
    }

    /// Returns the properties of the air around an airplane, as those know it that see it there.
    pub(crate) fn air_around(&self, known: KnownAircraft) -> FlightConditions {
        self.air_at(known.pose.at, known.altitude_m)
    }

    /// Returns the wind in a place and on a level, in meters per second.
    fn wind_at(&self, at: Point, altitude_m: f64) -> Point {
        match &self.wind_field {
            Some(field) => field.velocity_m_s(at, altitude_m),
            None => self.wind_m_s,
        }
    }

    /// Returns the greatest speed of the wind, in meters per second.
    pub(crate) fn max_wind_m_s(&self) -> f64 {
        match &self.wind_field {
            Some(field) => field.max_speed_m_s,
            None => math::hypot(self.wind_m_s[0], self.wind_m_s[1]),
        }
    }

    /// Returns the greatest speed of the air anywhere relative to the air in which motions are compared, in meters per
    /// second: 0 where all are in one wind.
    pub(crate) fn max_drift_m_s(&self) -> f64 {
        self.wind_field.as_ref().map_or(0.0, |field| field.max_drift_m_s)
    }

    /// Returns how the air moves that an airplane flies through which is in a place and on a level now, and will be on
    /// another one at the end of the cycle.
    pub(crate) fn air_drift(&self, at: Point, altitude_m: f64, next_altitude_m: f64) -> AirDrift {
        let Some(field) = &self.wind_field else { return AirDrift::default() };
        let drift_m_s = |altitude_m: f64| sub(field.velocity_m_s(at, altitude_m), self.wind_m_s);
        AirDrift {
            now_m_s: drift_m_s(altitude_m),
            next_m_s: drift_m_s(next_altitude_m),
            varies_by_place: field.varies_by_place(),
        }
    }

    /// Returns the properties of the air through which an airplane flies in a cycle at whose start it is somewhere, gusts
    /// included. What is planned knows nothing of these.
    pub(crate) fn flown_air(
        &self,
        slot: EntitySlot,
        now: Cycle,
        (at, altitude_m): (Point, f64),
    ) -> FlightConditions {
        let mut air = self.air_at(at, altitude_m);
        if let Some(gusts) = &self.gusts {
            let [east_m_s, north_m_s] = gusts.velocity_m_s(&self.streams, slot, now);
            air.wind_m_s = [air.wind_m_s[0] + east_m_s, air.wind_m_s[1] + north_m_s];
        }
        air
    }

    /// Returns when an airplane's flight would end if it were alone, in seconds after the start of
    /// the run.
    pub(crate) fn solo_end_s(&self, i: usize) -> f64 {
        let joins_s = self.cycle_start_s(self.first_controlled_cycle(i));
        match &self.airplanes[i].track {
            Some(track) if track.end_s() <= joins_s => track.end_s(),
            _ => joins_s + self.alone_s[i],
        }
    }

    /// Returns whether an airplane's radio is off in a cycle.
    pub(crate) fn is_radio_off(&self, id: EntityId, cycle: Cycle) -> bool {
        self.network
            .as_ref()
            .is_some_and(|network| network.is_radio_off(id, self.cycle_start_s(cycle)))
    }

    /// Returns whether airplanes remember the conflicts that they resolve.
    pub(crate) fn has_resolution_memory(&self) -> bool {
        self.all_rules().any(|world| matches!(world.method, MethodKind::Mvp))
    }

    /// Returns what the method may command beside where to turn.
    pub(crate) fn command_kinds(&self) -> CommandKinds {
        match &self.method {
            MethodKind::Mvp => self.mvp_resolution.command_kinds(),
            MethodKind::Own(own) => own.command_kinds(),
            MethodKind::Pc | MethodKind::External => self.changes,
            MethodKind::Orca | MethodKind::Bands | MethodKind::None => CommandKinds::NONE,
        }
    }

    /// Returns whether a method commands levels or speeds under some of the rules.
    pub(crate) fn has_commands(&self) -> bool {
        self.all_rules().any(|world| !world.command_kinds().is_none())
    }

    /// Returns the commands that may be in force for each airplane; none where no method commands anything.
    fn limits_of_commands(&self) -> Arc<[CommandLimits]> {
        let kinds = self.command_kinds();
        let airplanes = self.airplanes.iter().filter(|_| !kinds.is_none());
        airplanes.map(|airplane| airplane.command_limits(kinds)).collect()
    }

    /// Returns whether a command may be in force for an airplane.
    pub(crate) fn allows_command(&self, id: EntityId, command: &MethodCommand) -> bool {
        CommandLimits::allow(&self.command_limits, id, command)
    }

    /// Returns when a cycle starts, in seconds after the start of the run.
    pub fn cycle_start_s(&self, now: Cycle) -> f64 {
        now as f64 * self.timing.dt_s
    }

    /// Returns the cycle in which an airplane appears: at the start of the cycle, or within it on a recorded track.
    pub fn appearance_cycle(&self, i: usize) -> Cycle {
        let airplane = &self.airplanes[i];
        let cycles = airplane.appears_s / self.timing.dt_s;
        let is_on_track = airplane.track.is_some()
            && (airplane.is_non_cooperative || (cycles.floor() as Cycle) < self.replay_cycles);
        if is_on_track { cycles.floor() as Cycle } else { cycles.ceil() as Cycle }
    }

    /// Returns the cycle from which the method flies an airplane.
    pub fn first_controlled_cycle(&self, i: usize) -> Cycle {
        let recorded = match &self.airplanes[i] {
            AirplaneStart { track: None, .. } => 0,
            AirplaneStart { is_non_cooperative: true, .. } => Cycle::MAX,
            _ => self.replay_cycles,
        };
        self.appearance_cycle(i).max(recorded)
    }

    /// Returns whether an airplane is non-cooperative in a cycle: it follows its track, or the scenario says so.
    /// It avoids nobody, and all that the method flies avoid it.
    pub fn is_non_cooperative(&self, slot: EntitySlot, now: Cycle) -> bool {
        self.airplanes[slot as usize].is_non_cooperative || self.is_replayed(slot, now)
    }

    /// Returns whether the method ever flies an airplane, unless its track ends before.
    pub(crate) fn is_controlled(&self, i: usize) -> bool {
        // An airplane that is never cooperative never decides, and never orbits.
        !self.is_non_cooperative(i as EntitySlot, Cycle::MAX - 1)
    }

    /// Returns whether an airplane follows its track in a cycle.
    pub fn is_replayed(&self, slot: EntitySlot, now: Cycle) -> bool {
        self.airplanes[slot as usize].track.is_some()
            && now < self.first_controlled_cycle(slot as usize)
    }

    /// Returns the phase of a recorded flight at a time, in seconds after the start of the run: by its record then, or
    /// by that at its handover to the method, which flies it on the level that it had.
    pub(crate) fn flight_phase(&self, slot: EntitySlot, t_s: f64) -> Option<FlightPhase> {
        let track = self.airplanes[slot as usize].track.as_ref()?;
        let joins_s = self.cycle_start_s(self.first_controlled_cycle(slot as usize));
        Some(track.phase_at(t_s.min(joins_s)))
    }

    /// Returns the distance in meters up to which two airplanes have to avoid each other, because
    /// they could come too near within the horizon, or on orbits after the next `dt`.
    // Inlined, because the search for neighbors asks it of each pair.
    #[inline]
    pub fn interaction_range_m(&self, a: usize, b: usize) -> f64 {
        let separation_a_m = self.airplanes[a].model.separation_m;
        let separation_b_m = self.airplanes[b].model.separation_m;
        let gap_m = separation_a_m.max(separation_b_m) * self.reactive_settings().margin.max(1.0);
        // A meter for all that is rounded.
        self.reach_m(a) + self.reach_m(b) + gap_m + 1.0
    }

    /// Returns how far from where it is seen an airplane may get within the horizon, or on a fallback after the
    /// next `dt`, in meters.
    fn reach_m(&self, i: usize) -> f64 {
        let v_m_s = self.top_m_s[i];
        let look_ahead_s = self.reactive_settings().look_ahead_s;
        // Positions are seen with an error, too.
        (v_m_s * look_ahead_s).max(self.fallback_reach_m(i))
            + self.error_m(i)
            + self.position_bound_m[i]
            + self.drift_reach_m(i, look_ahead_s)
    }

    /// Returns how far the air may carry an airplane relative to others, in meters, while its method and its shield look
    /// ahead.
    fn drift_reach_m(&self, i: usize, look_ahead_s: f64) -> f64 {
        // Where it carries all alike, none.
        let Some(field) = &self.wind_field else { return 0.0 };
        field.max_drift_m_s * look_ahead_s.max(self.shield_look_ahead_s(i))
    }

    /// Returns for how long the shield looks ahead at what moves relative to the air of an airplane: a `dt`, its longest way
    /// to an orbit, and one turn.
    fn shield_look_ahead_s(&self, i: usize) -> f64 {
        let turn_s = std::f64::consts::TAU / self.orbit_rad_s[i];
        self.fallback_lead_s(i) + self.timing.dt_s + turn_s
    }

    /// Returns how far the method looks ahead, and how much separation it asks for.
    pub(crate) fn reactive_settings(&self) -> ReactiveSettings {
        match self.method {
            MethodKind::Mvp => self.mvp,
            MethodKind::Orca => self.orca,
            MethodKind::Bands => self.bands,
            MethodKind::Pc | MethodKind::None | MethodKind::External | MethodKind::Own(_) => {
                ReactiveSettings {
                    look_ahead_s: self.timing.horizon as f64 * self.timing.dtau_s,
                    margin: self.objective.inflation,
                    resolution_factor: 1.0,
                }
            }
        }
    }

    /// Returns the rules by which MVP resolves conflicts.
    pub(crate) fn mvp_rules(&self) -> MvpRules {
        MvpRules {
            settings: self.mvp,
            resolution: self.mvp_resolution,
            vertical_m: self.vertical_m,
            right_of_way: self.right_of_way,
        }
    }

    /// Returns the stage of an airplane that has carried out this number of orders.
    pub(crate) fn segment(&self, slot: EntitySlot, orders: u32) -> InterOrderSegment<'_> {
        match self.later[slot as usize].get((orders as usize).wrapping_sub(1)) {
            Some(later) => later.segment(),
            None => {
                let AirplaneStart { model, mission, altitude_m, .. } =
                    &self.airplanes[slot as usize];
                InterOrderSegment {
                    model: Cow::Borrowed(model),
                    mission,
                    altitude_m: *altitude_m,
                    climb_m_s: 0.0,
                    descent_m_s: 0.0,
                }
            }
        }
    }

    /// Returns the same with the command of a method that is in force over it.
    pub(crate) fn flown_segment(
        &self,
        slot: EntitySlot,
        orders: u32,
        command: &MethodCommand,
    ) -> InterOrderSegment<'_> {
        let filed = self.segment(slot, orders);
        // In most scenarios no method commands anything.
        if command.is_none() {
            return filed;
        }
        filed.with_command(command, &self.airplanes[slot as usize].performance)
    }

    /// Returns the stage of an airplane as its group knows it.
    pub(crate) fn known_segment(&self, known: KnownAircraft) -> InterOrderSegment<'_> {
        self.flown_segment(known.slot, known.orders, &known.command)
    }

    /// Returns the orders and way-points done with after those that are due at a time, if none
    /// waits.
    pub(crate) fn progress_after_orders(
        &self,
        slot: usize,
        orders: u32,
        next: usize,
        now_s: f64,
    ) -> (u32, usize) {
        let mut done = DoneOrders::at_cycle_start(orders as usize);
        let mut next = next;
        while let Some(order) = self.airplanes[slot].due_order(done, now_s) {
            next = self.later[slot][done.count].next.map_or(next, |next| next as usize);
            done = done.and(order);
        }
        (done.count as u32, next)
    }

    /// Returns the actions of an airplane at the speed of its start, for others that know its model.
    pub(crate) fn actions(&self, slot: EntitySlot) -> &[Action] {
        &self.actions[slot as usize]
    }

    /// Returns the actions of an airplane at the speed that it has: as many, in the same order.
    pub(crate) fn present_actions(&self, known: KnownAircraft) -> Cow<'_, [Action]> {
        let present = self.known_segment(known).model;
        let start = &self.airplanes[known.slot as usize].model;
        actions_at_turn_rate(self.actions(known.slot), start, present.omega_max_rad_s)
    }

    /// Returns the levels that an airplane is on, or passes as far as the method looks ahead.
    pub(crate) fn levels(&self, known: KnownAircraft) -> FlightLevelRange {
        let look_ahead_s = self.reactive_settings().look_ahead_s;
        self.known_segment(known).levels_within(known.altitude_m, look_ahead_s)
    }

    /// Returns what is the same for all areas around airplanes in a cycle, for methods that look so far ahead: in the air
    /// in which motions of different airplanes are compared.
    pub(crate) fn area_context(&self, now: Cycle, look_ahead_s: f64) -> AreaContext<'_> {
        AreaContext {
            areas: &self.areas,
            surface: self.surface,
            wind_m_s: self.wind_m_s,
            now_s: self.cycle_start_s(now),
            look_ahead_s,
        }
    }

    /// Returns the same for predictions.
    fn prediction_areas(&self, now: Cycle) -> AreaContext<'_> {
        self.area_context(now, self.timing.horizon_s() + self.timing.dtau_s)
    }

    /// Returns the areas that the plans of an airplane may come to, or its fallback, if all see it in some place.
    pub(crate) fn areas_around(
        &self,
        slot: EntitySlot,
        (at, altitude_m): (Point, f64),
        now: Cycle,
    ) -> LocalAreas {
        // Most scenarios have none.
        if self.areas.is_empty() || !self.shield {
            return None;
        }
        let i = slot as usize;
        let look_ahead_s = self.shield_look_ahead_s(i);
        let reach_m = self.fallback_reach_m(i) + 2.0 * self.error_m(i) + AREA_GAP_M;
        let context = AreaContext {
            wind_m_s: self.wind_at(at, altitude_m),
            ..self.area_context(now, look_ahead_s)
        };
        context.near(self.surface.frame_at(at), at, reach_m)
    }

    /// Returns where each action would lead an airplane, and the cost of that beside non-cooperative aircraft and among
    /// areas.
    pub(crate) fn action_predictions(
        &self,
        known: KnownAircraft,
        non_cooperative: &[NonCooperativeAircraft],
        now: Cycle,
    ) -> ActionPredictions {
        let InterOrderSegment { model, mission, .. } = self.known_segment(known);
        let actions = self.present_actions(known);
        let route = RoutePosition { mission, next: known.next, pose: known.pose };
        let flight = self.changeable_flight(known);
        let predictions =
            self.air_around(known).predictions(&model, &actions, route, flight.as_ref());
        let frame = self.surface.frame_at(known.pose.at);
        let mut options =
            ActionPredictions::new(predictions, frame, model.separation_m, self.levels(known));
        if let Some(flight) = flight {
            options = options.with_changes(ActionChanges::new(&flight, &actions, &self.timing));
        }
        options
            .with_non_cooperative(non_cooperative, &self.objective, self.timing.dtau_s)
            .with_areas(&self.prediction_areas(now), &self.objective, self.timing.dtau_s)
    }

    /// Returns what an airplane flies and would fly by its filed flight; `None` if it has no changes to choose from.
    fn changeable_flight(&self, known: KnownAircraft) -> Option<ChangeableFlight<'_>> {
        let airplane = &self.airplanes[known.slot as usize];
        if airplane.changes.is_empty() {
            return None;
        }
        let filed = FiledLevelSpeed::from(&self.segment(known.slot, known.orders));
        let v_m_s = self.known_segment(known).model.v_m_s;
        Some(ChangeableFlight::new(filed, &airplane.performance, known.altitude_m, v_m_s))
    }

    /// Returns some levels of an airplane, and those that its actions lead to within the horizon.
    pub(crate) fn levels_with_changes(
        &self,
        known: KnownAircraft,
        levels: FlightLevelRange,
    ) -> FlightLevelRange {
        let flight = self.changeable_flight(known).filter(|_| self.changes.levels);
        let actions = self.actions(known.slot);
        flight.map_or(levels, |flight| {
            ActionChanges::new(&flight, actions, &self.timing).extend(levels)
        })
    }

    /// Returns the level and the speed of an airplane's filed flight after each number of its orders.
    pub(crate) fn filed_levels_speeds(&self, slot: EntitySlot) -> Vec<FiledLevelSpeed> {
        let orders = 0..=self.airplanes[slot as usize].orders.len();
        orders.map(|done| (&self.segment(slot, done as u32)).into()).collect()
    }

    /// Returns the command that an action of an airplane is.
    pub(crate) fn action_command(&self, known: KnownAircraft, action: Action) -> MethodCommand {
        let flight = self.changeable_flight(known).filter(|_| action.change != FlightChange::NONE);
        flight.map_or(MethodCommand::NONE, |flight| flight.command(action.change))
    }

    /// Returns the largest number of samples that one optimization may draw from an airplane's
    /// stream; none if that number overflows.
    pub(crate) fn max_samples(&self) -> Option<u64> {
        let Estimator::Sampled { block, .. } = self.settings.estimator else { return Some(1) };
        let blocks_per_round = match self.settings.order {
            UpdateOrder::Parallel => 1,
            // One at the start of a round, and one after each player of the largest group.
            UpdateOrder::Sequence => self.airplanes.len() as u64 + 1,
        };
        let per_round = (block as u64).checked_mul(blocks_per_round)?;
        // Plus one for the final draw.
        per_round.checked_mul(self.settings.stop.max_rounds.into())?.checked_add(1)
    }
}
