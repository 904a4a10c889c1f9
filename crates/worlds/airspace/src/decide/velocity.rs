//! Candidates by a method that steers each airplane: ORCA, MVP, track bands, or one of the program's own.
//!
//! Such a method considers the airplanes around it all the time: once per step of `dtau`, as its
//! authors fly it, and not once per `dt`. So the preferred profile of a `dt` is found by flying the group ahead,
//! step by step, each airplane as the method says.

use super::around_areas::{SteeredAircraft, has_areas_ahead, steer_around_areas};
use super::local_flight::LocalFlight;
use super::preferences::{rank_by_turn_difference, turn_profiles_from_actions};
use crate::baseline::{AircraftState, ReactiveMemory, bands, mvp, orca};
use crate::flight::CLIMB_M_S;
use crate::flight::{
    Frame, InterOrderSegment, KnownAircraft, LevelCommand, MethodCommand, Point, Pose2, Surface,
    rotated,
};
use crate::method::{MethodKind, MethodPercept, OwnMethod, Steering};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::purpose;
use crate::right_of_way::Yielding;
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;
use sidestep_kernel::geometry::{add, norm, sub};
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{Cycle, math};

/// Distance in meters of the point ahead that stands for a heading: any, because only its direction counts.
const LOOK_AHEAD_M: f64 = 1e3;

/// What a method keeps from step to step, by the place of the airplane in its group.
struct MethodMemory<'a> {
    /// The conflicts that airplanes resolve by MVP, and what the method has commanded last.
    kept: &'a mut [ReactiveMemory],
    /// The random streams of a method of the program's own; no other method draws.
    draws: Vec<Draws>,
}

/// The airplanes of a group in one step of a cycle.
#[derive(Clone, Copy)]
struct StepTraffic<'a> {
    now: Cycle,
    /// Seconds since the cycle began.
    elapsed_s: f64,
    group: &'a [KnownAircraft],
    /// Those around it: of them some avoid nobody.
    others: &'a [AircraftState],
}

/// The airplanes that those of a group consider beside each other, some seconds after the start of the cycle.
pub(super) type OthersAt<'a> = dyn Fn(f64) -> Vec<AircraftState> + 'a;

/// Returns the turn profiles that each airplane of a group may fly in the next `dt`: the one that the method
/// prefers, and then the others by how little they differ from it. `others_at` gives all around the group.
pub(super) fn profiles_by_velocity(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    others_at: &OthersAt<'_>,
    kept: &mut [ReactiveMemory],
    now: Cycle,
) -> Vec<Vec<TurnProfile>> {
    let mut ahead = group.to_vec();
    let mut preferred = vec![TurnProfile::default(); group.len()];
    let mut memory = MethodMemory { kept, draws: custom_method_draws(world, group, now) };
    let has_areas: Vec<bool> =
        group.iter().map(|known| has_areas_ahead(world, *known, now)).collect();
    let commands_levels = world.command_kinds().levels;
    let dtau_s = world.timing.dtau_s;
    for k in 0..world.timing.points_per_dt() {
        let elapsed_s = k as f64 * world.timing.dtau_s;
        let others = others_at(elapsed_s);
        let traffic = StepTraffic { now, elapsed_s, group: &ahead, others: &others };
        let steering = decide_steering(world, traffic, &mut memory);
        for (place, mut steering) in steering.into_iter().enumerate() {
            let known = &mut ahead[place];
            if has_areas[place] {
                let aircraft = SteeredAircraft { known: *known, now, elapsed_s };
                steering = steer_around_areas(world, aircraft, steering);
            }
            preferred[place].omegas_rad_s.push(step(world, known, steering));
            if commands_levels {
                // Else nobody asks for it within a cycle: levels are those of as far as the method looks ahead.
                let segment = world.known_segment(*known);
                known.altitude_m = segment.altitude_after_m(known.altitude_m, dtau_s);
            }
        }
    }
    group
        .iter()
        .zip(preferred)
        .map(|(known, profile)| rank_by_similarity(world, *known, profile))
        .collect()
}

/// Returns the turn profiles of an airplane that avoids nobody in the next `dt`: straight to its way-point, as far as no
/// area is in the way, and then the others by how little they differ from that.
pub(super) fn profiles_alone(
    world: &AirspaceWorld,
    known: KnownAircraft,
    now: Cycle,
) -> Vec<TurnProfile> {
    let mut ahead = known;
    let mut preferred = TurnProfile::default();
    for k in 0..world.timing.points_per_dt() {
        let elapsed_s = k as f64 * world.timing.dtau_s;
        let aircraft = SteeredAircraft { known: ahead, now, elapsed_s };
        let steering = steer_around_areas(world, aircraft, Steering::Proceed);
        preferred.omegas_rad_s.push(step(world, &mut ahead, steering));
    }
    rank_by_similarity(world, known, preferred)
}

/// Returns the random streams of a group's airplanes, if the method is one of the program's own.
fn custom_method_draws(world: &AirspaceWorld, group: &[KnownAircraft], now: Cycle) -> Vec<Draws> {
    if !matches!(world.method, MethodKind::Own(_)) {
        return Vec::new();
    }
    group.iter().map(|known| world.streams.draws(known.slot, now, purpose::METHOD)).collect()
}

/// Returns a turn profile, and then those of the airplane's actions by how little they differ from it.
pub(super) fn rank_by_similarity(
    world: &AirspaceWorld,
    known: KnownAircraft,
    profile: TurnProfile,
) -> Vec<TurnProfile> {
    let turn_rad_s = profile.omegas_rad_s.first().copied().unwrap_or_default();
    let others = turn_profiles_from_actions(
        world,
        known,
        &rank_by_turn_difference(world, known, turn_rad_s),
    );
    let others: Vec<TurnProfile> = others.into_iter().filter(|other| *other != profile).collect();
    [vec![profile], others].concat()
}

/// Returns what the method gives each airplane of a group for one step; those that have arrived proceed.
fn decide_steering(
    world: &AirspaceWorld,
    traffic: StepTraffic<'_>,
    memory: &mut MethodMemory<'_>,
) -> Vec<Steering> {
    let StepTraffic { group, others, .. } = traffic;
    let mut flying = Vec::new();
    for (k, known) in group.iter().enumerate() {
        if known.next < world.known_segment(*known).mission.len() {
            flying.push(k);
        }
    }
    let own = flying.iter().map(|&k| aircraft_state(world, group[k]));
    let view = TrafficView::new(world, own.chain(others.iter().copied()).collect());
    let mut steering = vec![Steering::Proceed; group.len()];
    match &world.method {
        MethodKind::Orca => {
            for (place, &k) in flying.iter().enumerate() {
                let own = &view.all[place];
                let others = view.others_seen_from(place);
                let heading_rad =
                    orca::heading_rad(own, others.iter(), world.orca, world.timing.dtau_s);
                steering[k] = heading_rad.into();
            }
        }
        MethodKind::Bands => {
            for (place, &k) in flying.iter().enumerate() {
                let own = &view.all[place];
                let others = view.others_seen_from(place);
                let omega_max_rad_s = world.known_segment(group[k]).model.omega_max_rad_s;
                let heading_rad =
                    bands::heading_rad(own, others.iter(), world.bands, omega_max_rad_s);
                steering[k] = heading_rad.into();
            }
        }
        MethodKind::Own(method) => {
            for (place, &k) in flying.iter().enumerate() {
                let others = view.others_seen_from(place);
                let own = &view.all[place];
                let one = CustomMethodContext { traffic, k, own, others: &others };
                let decided = one.decide(world, method, &mut memory.draws[k]);
                steering[k] = decided.steering;
                memory.kept[k].command = decided.command;
            }
        }
        MethodKind::Mvp => {
            let mut active: Vec<mvp::ActiveResolutions> =
                flying.iter().map(|&k| std::mem::take(&mut memory.kept[k].resolving)).collect();
            let meets = |own: usize, other: usize| view.seen_from(own, other);
            let found = mvp::resolutions(&view.all, &mut active, &world.mvp_rules(), meets);
            for ((&k, resolution), active) in flying.iter().zip(found).zip(active) {
                steering[k] = resolution.as_ref().map(|one| one.heading_rad).into();
                let kept = &mut memory.kept[k];
                kept.resolving = active;
                kept.command = mvp_command(world, group[k], resolution, kept.command);
            }
        }
        // These rank actions, and steer by none.
        MethodKind::Pc | MethodKind::None | MethodKind::External => {}
    }
    steering
}

/// The airplanes that a method considers at one time, and the frame of each.
pub(super) struct TrafficView<'a> {
    world: &'a AirspaceWorld,
    all: Vec<AircraftState>,
    frames: Vec<Frame>,
}

impl<'a> TrafficView<'a> {
    fn new(world: &'a AirspaceWorld, all: Vec<AircraftState>) -> Self {
        let frames = all.iter().map(|one| world.surface.frame_at(one.at)).collect();
        Self { world, all, frames }
    }

    /// Returns the same airplanes if each headed for its way-point.
    pub(super) fn proceeding(&self) -> Self {
        let proceed = |one: &AircraftState| {
            let speed_m_s = norm(one.velocity);
            let [east, north] = [math::cos(one.preferred_rad), math::sin(one.preferred_rad)];
            AircraftState {
                heading_rad: one.preferred_rad,
                velocity: [speed_m_s * east, speed_m_s * north],
                ..*one
            }
        };
        let all = self.all.iter().map(proceed).collect();
        Self { world: self.world, all, frames: self.frames.clone() }
    }

    fn is_on_level(&self, a: usize, b: usize) -> bool {
        // Who changes its level to resolve a conflict has to mind those on its old one, and on the one that it comes to.
        if self.world.command_kinds().levels {
            return true;
        }
        self.all[a].levels.overlaps(&self.all[b].levels, self.world.vertical_m)
    }

    /// Returns the view of a group by those that do not know which orders the others have carried out.
    pub(super) fn from_filed_group(world: &'a AirspaceWorld, group: &[KnownAircraft]) -> Self {
        let filed_state = |known: &KnownAircraft| {
            let climb_m_s = world.filed_climb_m_s(*known);
            AircraftState { climb_m_s, ..aircraft_state(world, *known) }
        };
        Self::new(world, group.iter().map(filed_state).collect())
    }

    /// Returns which of two gives way, by their places.
    fn yielding(&self, a: usize, b: usize) -> Yielding {
        let [one, other] = [&self.all[a], &self.all[b]];
        // Nobody has right of way over one that avoids nobody.
        let may_give_way = one.is_cooperative && other.is_cooperative;
        if !self.world.uses_right_of_way || !may_give_way {
            return Yielding::Both;
        }
        // Always as the one with the smaller slot sees it, so that both come to the same where both see the same. By own
        // tracks each has its own view of the other, and near the borders of a rule both may find that the other gives way.
        if one.slot < other.slot {
            self.sight(a, b).map_or(Yielding::Both, |seen| self.world.yielding(one, &seen))
        } else {
            let yielding = |seen| self.world.yielding(other, &seen).swapped();
            self.sight(b, a).map_or(Yielding::Both, yielding)
        }
    }

    /// Returns which of two gives way if they are in conflict within the horizon; `None` if they are not.
    pub(super) fn yielding_in_conflict(&self, a: usize, b: usize) -> Option<Yielding> {
        let settings = self.world.reactive_settings();
        let seen = self.sight(a, b)?;
        mvp::is_in_conflict(&self.all[a], &seen, settings).then(|| self.yielding(a, b))
    }

    /// Returns another airplane as one has to mind it: as it sees it; one that gives way not at all, unless the method is
    /// of the program's own; and one that need not give way as one that does not.
    fn seen_from(&self, own: usize, other: usize) -> Option<AircraftState> {
        let seen = self.sight(own, other)?;
        let yielding = self.yielding(own, other);
        if yielding == Yielding::Second && matches!(self.world.method, MethodKind::Own(_)) {
            return Some(seen);
        }
        yielding.as_minded(seen)
    }

    /// Returns another airplane as one sees it: in the plane of the scenario as it is, on the earth in the frame where the
    /// one is, so that positions and velocities of the two can be subtracted. `None` for one on another level, or on
    /// the earth so far away that the two cannot come too near within the look-ahead time.
    fn sight(&self, own: usize, other: usize) -> Option<AircraftState> {
        let Self { world, all, frames } = self;
        if !self.is_on_level(own, other) {
            return None;
        }
        let own_frame = &frames[own];
        let other_frame = &frames[other];
        let own = &all[own];
        let other = &all[other];
        if world.surface == Surface::Plane {
            return Some(in_air_around(own, *other));
        }
        let settings = world.reactive_settings();
        let speeds_m_s = [own, other].map(|one| math::hypot(one.velocity[0], one.velocity[1]));
        let gap_m = own.separation_m.max(other.separation_m) * settings.margin.max(1.0);
        let range_m = (speeds_m_s[0] + speeds_m_s[1]) * settings.look_ahead_s + 2.0 * gap_m;
        if own_frame.is_surely_beyond(other_frame, range_m) {
            return None;
        }
        let Pose2 { at: [x_m, y_m], heading_rad: turn_rad } = own_frame.origin_of(other_frame);
        let seen = AircraftState {
            // Of the one as it is, whose own position remains in coordinates.
            at: [own.at[0] + x_m, own.at[1] + y_m],
            heading_rad: other.heading_rad + turn_rad,
            velocity: rotated(other.velocity, turn_rad),
            preferred_rad: other.preferred_rad + turn_rad,
            ..*other
        };
        Some(in_air_around(own, seen))
    }

    /// Returns all other airplanes as one sees them.
    fn others_seen_from(&self, own: usize) -> Vec<AircraftState> {
        let slot = self.all[own].slot;
        let others = (0..self.all.len()).filter(|&k| self.all[k].slot != slot);
        others.filter_map(|other| self.seen_from(own, other)).collect()
    }
}

/// Returns what MVP commands of an airplane by a resolution: the speed, and the level that it reaches at the rate of the
/// resolution, as far as it can fly it, until the conflict is resolved. Without a resolution nothing; a resolution of
/// nothing new leaves what was commanded.
fn mvp_command(
    world: &AirspaceWorld,
    known: KnownAircraft,
    resolution: Option<mvp::Resolution>,
    last: MethodCommand,
) -> MethodCommand {
    let Some(resolution) = resolution else { return MethodCommand::NONE };
    let performance = &world.airplanes[known.slot as usize].performance;
    let level = resolution.vertical.map(|vertical| {
        let is_climb = vertical.climb_m_s > 0.0;
        let limit_m_s = performance.vertical_max_m_s(is_climb);
        // An airplane of which no limit is known changes its level as by an order without a rate.
        let max_m_s = if limit_m_s.is_finite() { limit_m_s } else { CLIMB_M_S };
        let climb_m_s = vertical.climb_m_s.clamp(-max_m_s, max_m_s);
        LevelCommand {
            altitude_m: known.altitude_m + climb_m_s * vertical.within_s,
            vertical_m_s: climb_m_s.abs(),
        }
    });
    MethodCommand { level: level.or(last.level), v_m_s: resolution.v_m_s.or(last.v_m_s) }
}

/// What a method of the program's own gives an airplane in a step.
struct CustomDecision {
    steering: Steering,
    command: MethodCommand,
}

/// One airplane for which a method of the program's own decides.
struct CustomMethodContext<'a> {
    traffic: StepTraffic<'a>,
    /// Its place in the group.
    k: usize,
    own: &'a AircraftState,
    others: &'a [AircraftState],
}

impl CustomMethodContext<'_> {
    fn decide(
        &self,
        world: &AirspaceWorld,
        method: &OwnMethod,
        draws: &mut Draws,
    ) -> CustomDecision {
        let StepTraffic { now, elapsed_s, group, .. } = self.traffic;
        let known = group[self.k];
        let InterOrderSegment { model, mission, .. } = world.known_segment(known);
        let filed = world.segment(known.slot, known.orders);
        // On the earth all positions are those in the frame where the airplane is.
        let origin = match world.surface {
            Surface::Plane => [0.0; 2],
            Surface::Earth => self.own.at,
        };
        let own = &relative_to(origin, self.own);
        let others: Vec<AircraftState> =
            self.others.iter().map(|other| relative_to(origin, other)).collect();
        let percept = MethodPercept {
            now,
            elapsed_s,
            step_s: world.timing.dtau_s,
            own,
            way_point_m: world.surface.frame_at(known.pose.at).to_local(mission[known.next]),
            omega_max_rad_s: model.omega_max_rad_s,
            filed_altitude_m: filed.altitude_m,
            filed_v_m_s: filed.model.v_m_s,
            command: known.command,
            wind_m_s: world.air_around(known).wind_m_s,
            others: &others,
        };
        let steering = method.decide(&percept, draws);
        CustomDecision { steering, command: method.command(&percept, draws) }
    }
}

/// Returns another airplane with its velocity relative to the air around one: where the two are in different winds, that of
/// the other is carried along as well.
fn in_air_around(own: &AircraftState, other: AircraftState) -> AircraftState {
    // The same bits in one wind.
    if own.drift == other.drift {
        return other;
    }
    let velocity = sub(add(other.velocity, other.drift), own.drift);
    AircraftState { velocity, drift: own.drift, ..other }
}

/// Returns an airplane with its position relative to an origin.
fn relative_to(origin: Point, one: &AircraftState) -> AircraftState {
    AircraftState { at: [one.at[0] - origin[0], one.at[1] - origin[1]], ..*one }
}

/// Flies one step as steered, and returns its turn rate.
pub(super) fn step(world: &AirspaceWorld, known: &mut KnownAircraft, steering: Steering) -> f64 {
    let flight = LocalFlight::new(world, *known, world.timing.dtau_s);
    let LocalFlight { ref model, pose, frame, air, .. } = flight;
    let autopilot = flight.autopilot();
    let omega_max_rad_s = model.omega_max_rad_s;
    let omega_rad_s = match steering {
        Steering::Proceed | Steering::Velocity([0.0, 0.0]) => {
            air.steer(&autopilot, pose, known.next)
        }
        Steering::Heading(heading_rad) => {
            let aim = point_ahead(pose, heading_rad);
            pose.steer(aim, omega_max_rad_s, autopilot.dtau_s)
        }
        Steering::Velocity([vx, vy]) => {
            let aim = point_ahead(pose, math::atan2(vy, vx));
            pose.steer(aim, omega_max_rad_s, autopilot.dtau_s)
        }
        Steering::TurnRate(omega_rad_s) => omega_rad_s.clamp(-omega_max_rad_s, omega_max_rad_s),
    };
    let after = air.after_wind_step(pose.step(model.v_m_s, omega_rad_s, autopilot.dtau_s));
    known.next = autopilot.next_way_point((pose, after), known.next);
    known.pose = frame.pose_to_world(after);
    omega_rad_s
}

/// Returns a point that lies from a pose in the direction of a heading.
fn point_ahead(pose: Pose2, heading_rad: f64) -> Point {
    let [x, y] = pose.at;
    [x + LOOK_AHEAD_M * math::cos(heading_rad), y + LOOK_AHEAD_M * math::sin(heading_rad)]
}

/// Returns a non-cooperative airplane after some seconds, with as much more separation as it flies in one `dt`.
pub(crate) fn non_cooperative_state(
    world: &AirspaceWorld,
    one: &NonCooperativeAircraft,
    seconds: f64,
) -> AircraftState {
    // In its own frame on the earth, because it may be far from all that see it.
    let frame = world.surface.frame_at(one.at);
    let [x, y] = one.in_frame(frame).position_after(seconds);
    let [vx, vy] = one.velocity_m_s;
    let [wx, wy] = world.wind_m_s;
    let heading_rad = math::atan2(vy, vx);
    let there = Pose2 { at: [x + wx * seconds, y + wy * seconds], heading_rad };
    let Pose2 { at, heading_rad: turned_rad } = frame.pose_to_world(there);
    AircraftState {
        slot: one.slot,
        at,
        heading_rad: turned_rad,
        velocity: rotated(one.velocity_m_s, turned_rad - heading_rad),
        // Its velocity is that in the common air.
        drift: [0.0; 2],
        preferred_rad: turned_rad,
        separation_m: one.required_clearance_m(0.0),
        altitude_m: one.altitude_m + one.climb_m_s * seconds,
        climb_m_s: one.climb_m_s,
        levels: one.levels,
        yields: false,
        is_cooperative: false,
    }
}

fn aircraft_state(world: &AirspaceWorld, known: KnownAircraft) -> AircraftState {
    let flight = LocalFlight::new(world, known, world.timing.dtau_s);
    let model = &flight.model;
    let Pose2 { at, heading_rad } = known.pose;
    let v = model.v_m_s;
    let preferred_rad = flight.goal().map_or(heading_rad, |goal| {
        let from = flight.pose.at;
        let aim = flight.air.aim_point(from, goal, v);
        math::atan2(aim[1] - from[1], aim[0] - from[0])
    });
    AircraftState {
        slot: known.slot,
        at,
        heading_rad,
        velocity: [v * math::cos(heading_rad), v * math::sin(heading_rad)],
        drift: flight.air.drift_m_s(),
        preferred_rad,
        separation_m: model.separation_m,
        altitude_m: known.altitude_m,
        climb_m_s: world.known_segment(known).signed_climb_m_s(known.altitude_m),
        levels: world.levels(known),
        yields: true,
        is_cooperative: true,
    }
}
