//! The knowledge with which an airplane goes into a conversation: its perceptions, and the filed flights.

use super::percept::{OwnshipState, Percept, SurveillanceReport, TrackedState, priority_rank};
use crate::agents::exchange::{ObservedAircraft, ShieldExchangeSetup};
use crate::agents::traffic_state::{LastKnownState, OrbitState, StateBeacon, TrafficPicture};
use crate::agents::{
    CommandedFlight, CommonKnowledge, FiledChanges, FiledFlight, Ownship, RouteProgress,
};
use crate::flight::{FlightLevelRange, KnownAircraft, MethodCommand, Pose2};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::{CommonPlan, Fallback, OrbitSide, PlanCertainty, ShieldedAircraft};
use crate::world::AirspaceWorld;
use sidestep_kernel::{Cycle, EntityId, math};
use std::sync::Arc;

/// Returns the knowledge that all agents of a group share before their conversations. The airplanes nearby that are
/// `not_heard` differ between agents; each assumes that its own fly straight on.
pub(super) fn common_knowledge(
    world: &AirspaceWorld,
    percept: &Percept,
    not_heard: &[SurveillanceReport],
) -> Arc<CommonKnowledge> {
    let straight = not_heard.iter().map(|one| unheard_as_non_cooperative(world, one));
    let group: Vec<KnownAircraft> =
        percept.group.iter().map(|one| one.as_known_aircraft()).collect();
    Arc::new(CommonKnowledge {
        now: percept.cycle,
        ids: percept.members().into(),
        filed: percept.group.iter().map(|one| filed_flight(world, one.id)).collect(),
        poses: percept.group.iter().map(|one| one.pose).collect(),
        air: world.flight_environment(),
        winds_m_s: group.iter().map(|known| world.air_around(*known).wind_m_s).collect(),
        objective: world.objective,
        settings: world.settings,
        streams: world.streams,
        non_cooperative: percept.non_cooperative.iter().cloned().chain(straight).collect(),
        areas: Arc::clone(&world.areas),
        commanded: commanded_flights(world, percept),
        is_shielded: world.shield,
        deviation_weights: world.deviation_weights(&group),
    })
}

/// Returns the knowledge of an airplane's agent; `contacts` hold its knowledge of others from earlier cycles.
pub(super) fn ownship(
    world: &AirspaceWorld,
    percept: &Percept,
    unheard: &[SurveillanceReport],
    contacts: &TrafficPicture,
) -> Ownship {
    let common = common_knowledge(world, percept, unheard);
    let known = percept.own.as_known_aircraft();
    let beacon = beacon(world, known);
    let mission = world.known_segment(known).mission;
    let me = percept.own_place();
    let progress = RouteProgress { mission, next: known.next, orders: known.orders };
    Ownship {
        me,
        known,
        options: common.action_predictions(me, &beacon, progress),
        beacon,
        mission: mission.to_vec(),
        contacts: contacts.clone(),
        common,
    }
}

/// Returns what all see of the levels and the speeds of a group; nothing where no method commands any.
fn commanded_flights(world: &AirspaceWorld, percept: &Percept) -> Vec<CommandedFlight> {
    if !world.has_commands() {
        return Vec::new();
    }
    let flight = |one: &SurveillanceReport| CommandedFlight {
        altitude_m: one.altitude_m,
        command: one.command,
    };
    percept.group.iter().map(flight).collect()
}

/// Returns what all know of a flight before the run.
pub(super) fn filed_flight(world: &AirspaceWorld, id: EntityId) -> FiledFlight {
    let orders = world.airplanes[id as usize].orders.len();
    let max_way_points =
        (0..=orders).map(|done| world.segment(id, done as u32).mission.len()).max().unwrap_or(0);
    FiledFlight {
        model: world.airplanes[id as usize].model.clone(),
        actions: world.actions(id).to_vec(),
        contact: state_from_flight_plan(world, id),
        turn: world.airplanes[id as usize].performance.turn,
        max_speed_m_s: world.top_m_s[id as usize],
        max_way_points,
        orders,
        changes: filed_changes(world, id),
    }
}

/// Returns what an airplane's actions change beside its turns, as it is filed.
fn filed_changes(world: &AirspaceWorld, id: EntityId) -> Option<FiledChanges> {
    let airplane = &world.airplanes[id as usize];
    let has_changes = !world.changes.is_none() && !airplane.changes.is_empty();
    has_changes.then(|| FiledChanges {
        performance: airplane.performance.clone(),
        filed: world.filed_levels_speeds(id),
    })
}

/// Returns the message in which an airplane describes itself.
pub(super) fn beacon(world: &AirspaceWorld, known: KnownAircraft) -> StateBeacon {
    let segment = world.known_segment(known);
    // One that is not heard for long is known by its last beacon, and may have gone all the way by then.
    let levels = if world.network.is_some() {
        FlightLevelRange::between(known.altitude_m, segment.altitude_m)
    } else {
        world.levels(known)
    };
    StateBeacon {
        pose: known.pose,
        goal: segment.mission.get(known.next).copied(),
        v_m_s: segment.model.v_m_s,
        omega_max_rad_s: segment.model.omega_max_rad_s,
        orbit_rad_s: world.orbit_rad_s[known.slot as usize],
        separation_m: segment.model.separation_m,
        levels: world.levels_with_changes(known, levels),
    }
}

/// Returns the knowledge that all have of a flight before they have heard it: its filed plan.
fn state_from_flight_plan(world: &AirspaceWorld, id: EntityId) -> LastKnownState {
    let i = id as usize;
    let heard_in = world.appearance_cycle(i);
    let pose = world.airplanes[i].start;
    let orbiting = OrbitState { pose, as_of: heard_in, side: world.first_fallbacks[i].orbit_side };
    let altitude_m = world.airplanes[i].altitude_m;
    let known = KnownAircraft {
        slot: id,
        pose,
        next: 0,
        orders: 0,
        altitude_m,
        command: MethodCommand::NONE,
    };
    LastKnownState {
        presumed: Some(orbiting),
        ..LastKnownState::from_beacon(beacon(world, known), heard_in)
    }
}

/// Returns whether plans that all have made from the same messages are sure to be flown.
pub(super) fn plan_certainty(world: &AirspaceWorld) -> PlanCertainty {
    match world.network {
        Some(_) => PlanCertainty::Mixable,
        None => PlanCertainty::Sure,
    }
}

/// Returns the setup of the shield's exchange, as an airplane sees it: its group, and those nearby that are
/// `unheard`. `plans` are those that all compute for its group.
pub(super) fn shield_exchange_setup(
    world: &AirspaceWorld,
    percept: &Percept,
    unheard: &[SurveillanceReport],
    plans: Vec<Option<CommonPlan>>,
) -> ShieldExchangeSetup {
    let present = percept.group.iter().zip(plans).map(|(one, common)| (one, true, common));
    let others = unheard.iter().map(|one| (one, false, None));
    let mut all: Vec<_> = present.chain(others).collect();
    all.sort_unstable_by_key(|(one, ..)| one.id);
    let mut aircraft = Vec::with_capacity(all.len());
    for (one, takes_part, common) in all {
        let seen = shielded_aircraft_from_report(world, percept, one);
        let filed_v_m_s = seen.v_m_s;
        let filed_levels = seen.levels;
        aircraft.push(ObservedAircraft {
            altitude_m: one.altitude_m,
            aircraft: if one.id == percept.own.id {
                percept.own.shielded_aircraft(world, percept.cycle)
            } else {
                seen
            },
            filed_v_m_s,
            filed_levels,
            is_on_orbit: one.orbit.is_some(),
            is_fallback_known: one.orbit.is_some() || one.tracked.is_some(),
            common,
            takes_part,
            turn: world.airplanes[one.id as usize].performance.turn,
            max_speed_m_s: world.top_m_s[one.id as usize],
            // A profile that was found by other means comes before those of its actions.
            max_profiles: world.actions(one.id).len() + 1,
        });
    }
    ShieldExchangeSetup {
        air: world.flight_environment(),
        wind_field: world.wind_field.clone(),
        vertical_m: world.vertical_m,
        now: percept.cycle,
        certainty: plan_certainty(world),
        non_cooperative: match plan_certainty(world) {
            PlanCertainty::Sure => percept.non_cooperative.clone(),
            PlanCertainty::Mixable => Vec::new(),
        },
        airplanes: world.airplanes.len(),
        max_proposal_bytes: world.max_proposal_bytes(),
        aircraft,
    }
}

/// Returns another airplane as the shield of one that perceives it knows it from its visible state and its filed flight:
/// where messages get lost, no order changes its speed or its level, and commands that are in force are seen.
fn shielded_aircraft_from_report(
    world: &AirspaceWorld,
    percept: &Percept,
    one: &SurveillanceReport,
) -> ShieldedAircraft {
    let OwnshipState { id, exempt, .. } = &percept.own;
    let exempt = exempt.binary_search(&one.id).map_or(Vec::new(), |_| vec![*id]);
    shielded_aircraft_seen(world, percept.cycle, one, exempt)
}

/// Returns an airplane as all know it who have watched its flight.
pub(super) fn watched_aircraft(
    world: &AirspaceWorld,
    percept: &Percept,
    one: &SurveillanceReport,
) -> ShieldedAircraft {
    let mut exempt = Vec::new();
    for &[a, b] in &percept.exempt_pairs {
        if a == one.id {
            exempt.push(b);
        } else if b == one.id {
            exempt.push(a);
        }
    }
    exempt.sort_unstable();
    // Nobody sees how often the shield has refused its preferred maneuver.
    let rank = priority_rank(world, &one.as_tracked_aircraft(), 0);
    ShieldedAircraft { rank, ..shielded_aircraft_seen(world, percept.cycle, one, exempt) }
}

fn shielded_aircraft_seen(
    world: &AirspaceWorld,
    now: Cycle,
    one: &SurveillanceReport,
    exempt: Vec<EntityId>,
) -> ShieldedAircraft {
    let segment = world.flown_segment(one.id, 0, &one.command);
    let fallback = match one.tracked {
        Some(TrackedState { fallback, .. }) => fallback,
        // The side of one that flies a profile is not visible; the exchange tries both.
        None => Fallback::from_side(one.orbit.unwrap_or(OrbitSide::Left)),
    };
    ShieldedAircraft {
        id: one.id,
        frame: world.surface.frame_at(one.pose.at),
        pose: one.pose,
        orbit_pose: one.pose,
        v_m_s: segment.model.v_m_s,
        omega_max_rad_s: segment.model.omega_max_rad_s,
        orbit_rad_s: world.orbit_rad_s[one.id as usize],
        separation_m: segment.model.separation_m,
        error_m: world.error_m(one.id as usize),
        levels: FlightLevelRange::between(one.altitude_m, segment.altitude_m),
        drift: world.air_drift(one.pose.at, one.altitude_m, segment.altitude_m),
        vertical_m: world.vertical_m,
        fallback,
        choices: Arc::clone(&world.fallbacks[one.id as usize]),
        dt_s: world.timing.dt_s,
        exempt: exempt.into(),
        // Ranks are known from proposals only.
        rank: 0,
        areas: world.areas_around(one.id, (one.pose.at, one.altitude_m), now),
    }
}

/// Returns an airplane that was not heard as one that flies straight on, for methods that need no more than that.
pub(super) fn unheard_as_non_cooperative(
    world: &AirspaceWorld,
    one: &SurveillanceReport,
) -> NonCooperativeAircraft {
    let segment = world.flown_segment(one.id, 0, &one.command);
    let v_m_s = segment.model.v_m_s;
    let Pose2 { at, heading_rad } = one.pose;
    NonCooperativeAircraft {
        slot: one.id,
        at,
        velocity_m_s: [v_m_s * math::cos(heading_rad), v_m_s * math::sin(heading_rad)],
        top_m_s: world.top_m_s[one.id as usize],
        separation_m: segment.model.separation_m,
        error_m: world.position_bound_m(one.id as usize),
        altitude_m: one.altitude_m,
        climb_m_s: segment.signed_climb_m_s(one.altitude_m),
        levels: FlightLevelRange::between(one.altitude_m, segment.altitude_m),
        dt_s: world.timing.dt_s,
    }
}
