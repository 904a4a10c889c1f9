//! Observations: the knowledge with which an airplane decides, as numbers of fixed shapes.

use crate::baseline::AircraftState;
use crate::flight::{InterOrderSegment, KnownAircraft, Point, Pose2};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::scratch::PhaseContext;
use crate::surveillance::{PerceivedTraffic, each_decides_by_tracks};
use crate::world::AirspaceWorld;
use sidestep_kernel::control::{BufferMut, ValueDomain, ValueSpace};
use sidestep_kernel::math::{atan2, hypot, wrap_angle};
use sidestep_kernel::{EntityId, EntitySlot};
use std::array::from_fn;
use std::f64::consts::PI;

/// Most others that one airplane observes, the nearest. Spaces have a fixed shape, and a crowd within a horizon of
/// flight is rarely larger.
pub(super) const MAX_NEIGHBORS: usize = 16;

/// An airplane as all of its group see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct VisibleAircraft {
    slot: EntitySlot,
    at: Point,
    altitude_m: f64,
    heading_rad: f64,
    speed_m_s: f64,
    separation_m: f64,
    is_cooperative: bool,
}

/// An airplane's knowledge of itself and of others; nothing for one that does not decide.
#[derive(Debug, Default)]
pub(super) struct AgentKnowledge {
    is_due: bool,
    at: Point,
    altitude_m: f64,
    heading_rad: f64,
    speed_m_s: f64,
    turn_rate_rad_s: f64,
    /// Its next way-point, relative to its place.
    way_point: Point,
    way_points_left: usize,
    delay_s: f64,
    /// The nearest first.
    neighbors: Vec<Neighbor>,
}

/// Another airplane, relative to the one that observes.
#[derive(Debug)]
struct Neighbor {
    aircraft: VisibleAircraft,
    relative_m: Point,
    above_m: f64,
    separation_m: f64,
    is_exempt: bool,
    /// Seconds since it was heard, if it ever was.
    unheard_s: Option<f64>,
}

impl VisibleAircraft {
    /// Returns all airplanes of a group.
    pub(super) fn from_group(
        context: &PhaseContext<'_>,
        members: &[KnownAircraft],
        non_cooperative: &[NonCooperativeAircraft],
    ) -> Vec<Self> {
        let PhaseContext { world, state, .. } = context;
        let cooperative = members.iter().map(|known| {
            let model = world.known_segment(*known).model;
            Self {
                slot: known.slot,
                at: known.pose.at,
                altitude_m: known.altitude_m,
                heading_rad: wrap_heading(known.pose.heading_rad),
                speed_m_s: model.v_m_s,
                separation_m: model.separation_m,
                is_cooperative: true,
            }
        });
        let others = non_cooperative.iter().map(|one| {
            let [vx, vy] = one.velocity_m_s;
            Self {
                slot: one.slot,
                at: one.at,
                altitude_m: state.airplanes[one.slot as usize].altitude_m.get(),
                heading_rad: atan2(vy, vx),
                speed_m_s: hypot(vx, vy),
                separation_m: one.separation_m,
                is_cooperative: false,
            }
        });
        cooperative.chain(others).collect()
    }

    /// Returns the airplanes that one has tracks of, as it sees them; `None` where all see all, or tell each other where
    /// they are.
    pub(super) fn from_tracks(
        context: &PhaseContext<'_>,
        observer: EntitySlot,
        traffic: &PerceivedTraffic,
    ) -> Option<Vec<Self>> {
        let PhaseContext { world, now, .. } = *context;
        let observations = traffic.observations.as_ref();
        let observations = observations.filter(|_| each_decides_by_tracks(world))?;
        let tracks = observations.tracks_of(observer).iter();
        let visible = tracks.map(|track| {
            let AircraftState {
                at, heading_rad, velocity: [vx, vy], separation_m, altitude_m, ..
            } = track.aircraft_state(world, 0.0);
            Self {
                slot: track.slot,
                at,
                altitude_m,
                heading_rad: wrap_heading(heading_rad),
                speed_m_s: hypot(vx, vy),
                separation_m,
                is_cooperative: !world.is_non_cooperative(track.slot, now),
            }
        });
        Some(visible.collect())
    }
}

impl AgentKnowledge {
    /// Returns the observation of one of a group.
    pub(super) fn new(
        context: &PhaseContext<'_>,
        own: &KnownAircraft,
        all: &[VisibleAircraft],
    ) -> Self {
        let PhaseContext { world, state, .. } = context;
        let InterOrderSegment { model, mission, .. } = world.known_segment(*own);
        let ahead = mission.get(own.next..).unwrap_or_default();
        Self {
            is_due: true,
            at: world.display_m(own.pose.at),
            altitude_m: own.altitude_m,
            heading_rad: wrap_heading(own.pose.heading_rad),
            speed_m_s: model.v_m_s,
            turn_rate_rad_s: state.turn_rate_rad_s(own.slot),
            way_point: ahead
                .first()
                .map_or([0.0; 2], |&goal| world.surface.offset_m(own.pose.at, goal)),
            way_points_left: ahead.len(),
            delay_s: delay_s(context, own, ahead),
            neighbors: neighbors(context, own, all),
        }
    }

    /// Writes it into a row of each buffer, in the order of [`observation_spaces`].
    pub(super) fn write(&self, world: &AirspaceWorld, row: usize, buffers: &mut [BufferMut<'_>]) {
        let mut row = ObservationRowWriter { buffers: buffers.iter_mut(), row };
        row.write_integers(&[i64::from(self.is_due)]);
        row.write_reals(&self.at);
        row.write_reals(&[self.altitude_m]);
        row.write_reals(&[self.heading_rad]);
        row.write_reals(&[self.speed_m_s]);
        row.write_reals(&[self.turn_rate_rad_s]);
        row.write_reals(&self.way_point);
        row.write_integers(&[self.way_points_left as i64]);
        row.write_reals(&[self.delay_s]);
        row.write_integers(&[self.neighbors.len() as i64]);
        row.write_integers(&self.neighbor_values(-1, |one| one.aircraft.slot.into()));
        row.write_reals(self.neighbor_values([0.0; 2], |one| one.relative_m).as_flattened());
        row.write_reals(&self.neighbor_values(0.0, |one| one.above_m));
        row.write_reals(&self.neighbor_values(0.0, |one| one.aircraft.heading_rad));
        row.write_reals(&self.neighbor_values(0.0, |one| one.aircraft.speed_m_s));
        row.write_reals(&self.neighbor_values(0.0, |one| one.separation_m));
        row.write_integers(&self.neighbor_values(0, |one| one.aircraft.is_cooperative.into()));
        row.write_integers(&self.neighbor_values(0, |one| one.is_exempt.into()));
        if world.network.is_some() {
            row.write_reals(&self.neighbor_values(-1.0, |one| one.unheard_s.unwrap_or(-1.0)));
        }
    }

    /// Returns a value of each neighbor, then `none` for the places that are left.
    fn neighbor_values<T: Copy>(&self, none: T, of: impl Fn(&Neighbor) -> T) -> [T; MAX_NEIGHBORS] {
        from_fn(|k| self.neighbors.get(k).map_or(none, &of))
    }
}

/// One airplane's row in buffers that are written one after the other.
struct ObservationRowWriter<'a, 'b> {
    buffers: std::slice::IterMut<'a, BufferMut<'b>>,
    row: usize,
}

impl ObservationRowWriter<'_, '_> {
    fn write_integers(&mut self, values: &[i64]) {
        let Some(buffer) = self.buffers.next() else { return };
        let first = self.row * values.len();
        (first..).zip(values).for_each(|(at, &value)| buffer.set_integer(at, value));
    }

    fn write_reals(&mut self, values: &[f64]) {
        let Some(buffer) = self.buffers.next() else { return };
        let first = self.row * values.len();
        (first..).zip(values).for_each(|(at, &value)| buffer.set_real(at, value));
    }
}

/// Returns the nearest others of an airplane's group, the nearest first.
fn neighbors(
    context: &PhaseContext<'_>,
    own: &KnownAircraft,
    all: &[VisibleAircraft],
) -> Vec<Neighbor> {
    let PhaseContext { world, state, now, .. } = context;
    let others = all.iter().filter(|other| other.slot != own.slot);
    let distance_m = |other: &VisibleAircraft| world.surface.distance_m(own.pose.at, other.at);
    let mut nearest: Vec<(f64, &VisibleAircraft)> =
        others.map(|other| (distance_m(other), other)).collect();
    nearest.sort_unstable_by(|(a_m, a), (b_m, b)| a_m.total_cmp(b_m).then(a.slot.cmp(&b.slot)));
    nearest.truncate(MAX_NEIGHBORS);
    let exempt = state.exempt_ids(own.slot);
    let contacts = state.traffic_picture(own.slot);
    let separation_m = world.known_segment(*own).model.separation_m;
    nearest
        .into_iter()
        .map(|(_, other)| Neighbor {
            aircraft: seen_from(world, own, other),
            relative_m: world.surface.offset_m(own.pose.at, other.at),
            above_m: other.altitude_m - own.altitude_m,
            separation_m: separation_m.max(other.separation_m),
            is_exempt: exempt.binary_search(&other.slot).is_ok(),
            unheard_s: contacts
                .get(&other.slot)
                .map(|contact| world.cycle_start_s(now.saturating_sub(contact.heard_in))),
        })
        .collect()
}

/// Returns another airplane with the heading that it has in the frame of the one that observes.
fn seen_from(
    world: &AirspaceWorld,
    own: &KnownAircraft,
    other: &VisibleAircraft,
) -> VisibleAircraft {
    let pose = Pose2 { at: other.at, heading_rad: other.heading_rad };
    let heading_rad = world.surface.frame_at(own.pose.at).pose_to_local(pose).heading_rad;
    VisibleAircraft { heading_rad: wrap_heading(heading_rad), ..*other }
}

/// Returns how much later an airplane will arrive than it would alone, if it now flies straight from
/// way-point to way-point; 0 for one that goes to none, or does not arrive.
fn delay_s(context: &PhaseContext<'_>, own: &KnownAircraft, ahead: &[Point]) -> f64 {
    let PhaseContext { world, now, .. } = context;
    let i = own.slot as usize;
    let airplane = &world.airplanes[i];
    let alone_s = world.alone_s[i];
    let arrives = alone_s.is_finite() && airplane.leaves_s.is_infinite();
    if !arrives || airplane.has_fixed_heading(own.orders as usize) {
        return 0.0;
    }
    let flown_s = world.cycle_start_s(*now) - world.cycle_start_s(world.first_controlled_cycle(i));
    let air = world.air_around(*own);
    let v_m_s = world.known_segment(*own).model.v_m_s;
    let mut from = own.pose.at;
    let mut left_s = 0.0;
    for &to in ahead {
        let frame = world.surface.frame_at(from);
        left_s += air.straight_flight_time_s(frame.to_local(from), frame.to_local(to), v_m_s);
        from = to;
    }
    flown_s + left_s - alone_s
}

/// Returns a heading within half a turn to either side; one that already is stays the same to the bit.
fn wrap_heading(heading_rad: f64) -> f64 {
    if heading_rad.abs() <= PI { heading_rad } else { wrap_angle(heading_rad) }
}

/// Returns the spaces of the observations of a team's airplanes.
pub(super) fn observation_spaces(world: &AirspaceWorld, agents: &[EntityId]) -> Vec<ValueSpace> {
    let max_turn_rate_rad_s = world.airplanes[agents[0] as usize].model.omega_max_rad_s;
    let max_way_points =
        agents.iter().map(|&id| max_way_points(world, id)).max().unwrap_or(0) as i64;
    let mut spaces = vec![
        ValueSpace::new(
            "due",
            yes_no_space(),
            "whether it decides in the next cycle; all else is padding if not",
        ),
        ValueSpace::new("place_m", UNBOUNDED, "its place, east and north, as all see it")
            .with_shape([2]),
        ValueSpace::new("altitude_m", UNBOUNDED, "its altitude"),
        ValueSpace::new("heading_rad", ANGLE, "its heading, counterclockwise from east"),
        ValueSpace::new("speed_m_s", POSITIVE, "its speed through the air"),
        ValueSpace::new(
            "turn_rate_rad_s",
            ValueDomain::Real { low: -max_turn_rate_rad_s, high: max_turn_rate_rad_s },
            "its turn rate in the last step, positive to the left; 0 before the first",
        ),
        ValueSpace::new(
            "way_point_m",
            UNBOUNDED,
            "its next way-point, seen from it; 1e12 m ahead while it is to keep a heading",
        )
        .with_shape([2]),
        ValueSpace::new(
            "way_points_left",
            ValueDomain::Integer { low: 0, high: max_way_points },
            "way-points that it is still to reach",
        ),
        ValueSpace::new(
            "delay_s",
            UNBOUNDED,
            "how much later it arrives than alone if it flies straight to its way-points from now on; \
             0 if it keeps a heading, or never arrives",
        ),
    ];
    spaces.extend(neighbor_observation_spaces(world));
    spaces
}

/// Returns the largest number of way-points that an airplane has at any time, after any of its orders.
fn max_way_points(world: &AirspaceWorld, id: EntityId) -> usize {
    let orders = world.airplanes[id as usize].orders.len() as u32;
    (0..=orders).map(|done| world.segment(id, done).mission.len()).max().unwrap_or(0)
}

fn yes_no_space() -> ValueDomain {
    ValueDomain::Discrete(["no", "yes"].map(String::from).into())
}

const UNBOUNDED: ValueDomain = ValueDomain::Real { low: f64::NEG_INFINITY, high: f64::INFINITY };
const POSITIVE: ValueDomain = ValueDomain::Real { low: 0.0, high: f64::INFINITY };
const ANGLE: ValueDomain = ValueDomain::Real { low: -PI, high: PI };

/// Returns the spaces of the neighbors in observations, in the order in which [`AgentKnowledge::write`] fills them.
fn neighbor_observation_spaces(world: &AirspaceWorld) -> Vec<ValueSpace> {
    let ids = ValueDomain::Integer { low: -1, high: world.airplanes.len() as i64 - 1 };
    let each = |name: &str, bounds: ValueDomain, meaning: &str| {
        ValueSpace::new(name, bounds, meaning).with_shape([MAX_NEIGHBORS])
    };
    let mut spaces = vec![
        ValueSpace::new(
            "neighbors",
            ValueDomain::Integer { low: 0, high: MAX_NEIGHBORS as i64 },
            "others of its group that follow, the nearest first; values beyond them are padding, 0 \
             where nothing else is said",
        ),
        each("neighbor_id", ids, "their ids; -1 where there are no more"),
        each(
            "neighbor_place_m",
            UNBOUNDED,
            "their places, east and north, as all see them, seen from it",
        )
        .with_shape([MAX_NEIGHBORS, 2]),
        each("neighbor_above_m", UNBOUNDED, "how far they are above it"),
        each("neighbor_heading_rad", ANGLE, "their headings, counterclockwise from east"),
        each("neighbor_speed_m_s", POSITIVE, "their speeds through the air"),
        each("neighbor_separation_m", POSITIVE, "the distances that it and they are to keep"),
        each("neighbor_minds", yes_no_space(), "whether they mind others"),
        each(
            "neighbor_named",
            yes_no_space(),
            "whether the shield promises nothing for it and them",
        ),
    ];
    if world.network.is_some() {
        let bounds = ValueDomain::Real { low: -1.0, high: f64::INFINITY };
        let meaning = "time since it heard them or first met them; -1 where it has not";
        spaces.push(each("neighbor_unheard_s", bounds, meaning));
    }
    spaces
}
