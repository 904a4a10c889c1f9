//! The encounters in the legs of one cycle.

use super::{Encounter, EncounterRecord, EncounterStep, Encounters};
use crate::flight::{
    ConstantRateLeg, Frame, KinematicState, PairPlane, PairZones, Point, Proximity, RigidMotion,
    SeparationMinima, Surface,
};
use crate::flown_leg::FlownLeg;
use crate::measures::{PairMeasures, RelativeState, WellClearMinima};
use crate::world::AirspaceWorld;
use sidestep_kernel::geometry::{norm_squared, sub};
use sidestep_kernel::{Cycle, EntityId};
use std::ops::Range;

/// Fraction of a step by which a leg may seem to begin after the step that it begins in, because of rounding.
const ROUNDING: f64 = 1e-6;

/// An airplane in one cycle.
#[derive(Debug, Clone)]
struct FlownAircraft {
    id: EntityId,
    /// Where its first leg begins, in coordinates of the scenario.
    from: Point,
    /// Its velocity over the ground, where it flies straight and level through the whole cycle, on a plane.
    steady_velocity: Option<Point>,
    separation_m: f64,
    max_speed_m_s: f64,
    /// Its legs among those that all have flown in the cycle.
    flown: Range<usize>,
    /// Its motion, if a pair has needed that.
    prepared: Option<PreparedMotion>,
}

/// An airplane in the order of the sweep. Few bytes, because every one is compared with all that are near along it.
#[derive(Debug, Clone, Copy)]
struct SweepEntry {
    /// Number that no two airplanes differ in by more than their distance.
    sweep_m: f64,
    /// Another such number across it; 0 where there is none.
    across_m: f64,
    aircraft: usize,
}

/// The motion of an airplane in a cycle, in one frame.
#[derive(Debug, Clone)]
struct PreparedMotion {
    /// The frame that touches the surface where its first leg begins.
    frame: Frame,
    legs: Range<usize>,
    states: Range<usize>,
    /// Whether its flight ends in this cycle.
    has_ended: bool,
}

/// The motion of an airplane at the start of a step, in its frame.
#[derive(Debug, Clone, Copy)]
struct StepState {
    motion: KinematicState,
    altitude_m: f64,
    climb_m_s: f64,
}

/// Buffers that mean nothing between two cycles.
#[derive(Debug, Default)]
pub(crate) struct SweepBuffers {
    /// The airplanes of the cycle, by id.
    aircraft: Vec<FlownAircraft>,
    order: Vec<SweepEntry>,
    /// Legs of those that are near another one.
    legs: Vec<ConstantRateLeg>,
    /// Their states at the start of each step; none where it is not in the air.
    states: Vec<Option<StepState>>,
}

/// The cycle that is looked at.
#[derive(Debug, Clone, Copy)]
struct SweptCycle<'a> {
    world: &'a AirspaceWorld,
    measures: PairMeasures,
    cycle: Cycle,
    /// The legs of all airplanes in it, by id, each airplane's in their order.
    flown: &'a [FlownLeg],
}

/// Two airplanes of a cycle.
#[derive(Debug, Clone, Copy)]
struct FlownPair<'a> {
    ids: [EntityId; 2],
    separation_m: f64,
    /// Greatest speed at which they approach each other.
    closure_m_s: f64,
    /// Whether the flight of one of them ends in this cycle.
    has_ended: bool,
    states_a: &'a [Option<StepState>],
    states_b: &'a [Option<StepState>],
    legs_a: &'a [ConstantRateLeg],
    legs_b: &'a [ConstantRateLeg],
    plane: PairPlane,
}

impl Encounters {
    /// Looks at all pairs in a cycle, and adds the encounters that have ended to `ended`. `flown` are the legs of all
    /// airplanes in it, by id, each airplane's in their order.
    pub(crate) fn add_cycle(
        &mut self,
        world: &AirspaceWorld,
        flown: &[FlownLeg],
        buffers: &mut SweepBuffers,
        ended: &mut Vec<EncounterRecord>,
    ) {
        let (Some(measures), Some(first)) = (world.measures.pairs, flown.first()) else { return };
        let swept = SweptCycle { world, measures, cycle: first.cycle, flown };
        buffers.fill(&swept);
        buffers.for_each_near_pair(&swept, |pair| self.add_pair(&swept, pair, ended));
        self.end_unseen(first.cycle, ended);
    }

    /// Looks at a pair in all steps of a cycle.
    fn add_pair(
        &mut self,
        swept: &SweptCycle<'_>,
        pair: &FlownPair<'_>,
        ended: &mut Vec<EncounterRecord>,
    ) {
        let ids = (pair.ids[0], pair.ids[1]);
        let mut open = if self.open.is_empty() { None } else { self.open.remove(&ids) };
        let zones = swept.zones(pair.separation_m);
        for k in 0..pair.states_a.len() {
            let step = swept.step(pair, k, &zones, open.is_some());
            if let Some(step) = step.filter(EncounterStep::is_eventful) {
                let new = || Encounter::new(step.from_s, swept.cycle);
                open.get_or_insert_with(new).add_step(&step);
            } else if let Some(encounter) = open.take() {
                self.end(swept.cycle, ids, encounter, ended);
            }
        }
        let Some(encounter) = open else { return };
        if pair.has_ended {
            self.end(swept.cycle, ids, encounter, ended);
        } else {
            self.open.insert(ids, Encounter { cycle: swept.cycle, ..encounter });
        }
    }
}

impl SweptCycle<'_> {
    fn zones(&self, gap_m: f64) -> PairZones {
        let separation = SeparationMinima { gap_m, vertical_m: self.world.vertical_m };
        PairZones { separation, nmac: self.measures.nmac }
    }

    /// Returns the distance in meters from which on nothing happens to a pair that passes at it.
    fn widest_m(&self, separation_m: f64) -> f64 {
        let PairMeasures { well_clear, nmac, .. } = self.measures;
        separation_m.max(well_clear.horizontal_m.unwrap_or(0.0)).max(nmac.gap_m)
    }

    /// Returns whether two airplanes that fly straight on through the whole cycle certainly have no encounter in it:
    /// with steady velocities they would pass each other, or have done so, beyond all that is looked for.
    fn passes_wide(&self, a: &FlownAircraft, b: &FlownAircraft, separation_m: f64) -> bool {
        let Some((velocity_a, velocity_b)) = a.steady_velocity.zip(b.steady_velocity) else {
            return false;
        };
        let relative = RelativeState {
            at: sub(b.from, a.from),
            velocity: sub(velocity_b, velocity_a),
            above_m: 0.0,
            climb_m_s: 0.0,
        };
        // A meter for all that is rounded.
        relative.miss_distance_m() > self.widest_m(separation_m) + 1.0
    }

    /// Returns the distance in meters from which on two airplanes have nothing to do with each other in this cycle.
    fn reach_m(&self, separation_m: f64, closure_m_s: f64) -> f64 {
        let PairMeasures { look_ahead_s, well_clear, .. } = self.measures;
        // Modified tau is never less than the time in which the distance to DMOD is closed.
        let ahead_s = look_ahead_s.max(well_clear.tau_s) + self.world.timing.dt_s;
        self.widest_m(separation_m) + closure_m_s * ahead_s
    }

    /// Returns whether two airplanes may have an encounter in this cycle.
    fn may_meet(&self, a: &FlownAircraft, b: &FlownAircraft) -> bool {
        let separation_m = a.separation_m.max(b.separation_m);
        let reach_m = self.reach_m(separation_m, a.max_speed_m_s + b.max_speed_m_s);
        self.world.surface.is_within(a.from, b.from, reach_m)
            && !self.passes_wide(a, b, separation_m)
    }

    /// Returns the start of a step, in seconds after the start of the run.
    fn step_s(&self, k: usize) -> f64 {
        let timing = self.world.timing;
        // As the steps of `act` are computed, so that the legs begin at the same bits.
        (self.cycle * timing.points_per_dt() as u64 + k as u64) as f64 * timing.dtau_s
    }

    /// Returns what a pair does in a step; `None` if one of the two is not in the air at its start.
    fn step(
        &self,
        pair: &FlownPair<'_>,
        k: usize,
        zones: &PairZones,
        is_open: bool,
    ) -> Option<EncounterStep> {
        let relative = pair.relative_state(k)?;
        let from_s = self.step_s(k);
        let until_s = from_s + self.world.timing.dtau_s;
        let is_conflict = relative.is_conflict(zones.separation, self.measures.look_ahead_s);
        let well_clear: WellClearMinima = self.measures.well_clear.of_pair(zones.separation);
        let is_violation = relative.violates_well_clear(&well_clear);
        let reach_m = zones.separation.gap_m.max(zones.nmac.gap_m)
            + pair.closure_m_s * self.world.timing.dtau_s;
        let is_near = norm_squared(relative.at) <= reach_m * reach_m;
        // Nothing can be lost in this step, and nothing is recorded of it.
        let is_idle = !(is_near || is_open || is_conflict || is_violation);
        let proximity =
            if is_idle { Proximity::NONE } else { pair.proximity([from_s, until_s], zones) };
        Some(EncounterStep { from_s, until_s, is_conflict, is_violation, proximity })
    }
}

impl FlownPair<'_> {
    /// Returns the second one as seen from the first at the start of a step, if both are in the air.
    fn relative_state(&self, k: usize) -> Option<RelativeState> {
        let (a, b) = self.states_a[k].as_ref().zip(self.states_b[k].as_ref())?;
        let [at_a, at_b] = self.plane.points(a.motion.at, b.motion.at);
        let (velocity_a, velocity_b) = match self.plane.motions() {
            None => (a.motion.velocity, b.motion.velocity),
            Some([first, second]) => {
                (first.direction(a.motion.velocity), second.direction(b.motion.velocity))
            }
        };
        Some(RelativeState {
            at: [at_b[0] - at_a[0], at_b[1] - at_a[1]],
            velocity: [velocity_b[0] - velocity_a[0], velocity_b[1] - velocity_a[1]],
            above_m: b.altitude_m - a.altitude_m,
            climb_m_s: b.climb_m_s - a.climb_m_s,
        })
    }

    /// Returns how near the two come in an interval.
    fn proximity(&self, interval_s: [f64; 2], zones: &PairZones) -> Proximity {
        let motions = self.plane.motions();
        let mut found = Proximity::NONE;
        for leg_a in legs_within(self.legs_a, interval_s) {
            for leg_b in legs_within(self.legs_b, interval_s) {
                let leg_a = moved(leg_a, motions.map(|motions| &motions[0]));
                let leg_b = moved(leg_b, motions.map(|motions| &motions[1]));
                found.add_legs(&leg_a, &leg_b, interval_s, zones);
            }
        }
        found
    }
}

/// Returns those of the legs that have more than a moment in common with an interval.
fn legs_within(
    legs: &[ConstantRateLeg],
    [from_s, until_s]: [f64; 2],
) -> impl Iterator<Item = &ConstantRateLeg> {
    legs.iter().filter(move |leg| leg.from_s < until_s && from_s < leg.until_s)
}

fn moved(leg: &ConstantRateLeg, motion: Option<&RigidMotion>) -> ConstantRateLeg {
    motion.map_or(*leg, |motion| leg.moved(motion))
}

impl SweepBuffers {
    /// Fills in the airplanes of a cycle.
    fn fill(&mut self, swept: &SweptCycle<'_>) {
        self.aircraft.clear();
        self.legs.clear();
        self.states.clear();
        let mut first = 0;
        for legs in swept.flown.chunk_by(|a, b| a.airplane == b.airplane) {
            let flown = first..first + legs.len();
            first = flown.end;
            self.aircraft.push(FlownAircraft::new(swept, flown));
        }
        self.order.clear();
        for (aircraft, one) in self.aircraft.iter().enumerate() {
            let across_m = match swept.world.surface {
                Surface::Plane => one.from[1],
                // Meridians meet, so that longitudes say nothing of distances.
                Surface::Earth => 0.0,
            };
            let sweep_m = swept.world.surface.sweep_m(one.from);
            self.order.push(SweepEntry { sweep_m, across_m, aircraft });
        }
        self.order.sort_unstable_by(|a, b| {
            a.sweep_m.total_cmp(&b.sweep_m).then(a.aircraft.cmp(&b.aircraft))
        });
    }

    /// Calls `look` for each pair that may have an encounter, in an order that depends on places and ids alone.
    fn for_each_near_pair(&mut self, swept: &SweptCycle<'_>, mut look: impl FnMut(&FlownPair<'_>)) {
        let mut max_separation_m: f64 = 0.0;
        let mut max_speed_m_s: f64 = 0.0;
        for one in &self.aircraft {
            max_separation_m = max_separation_m.max(one.separation_m);
            max_speed_m_s = max_speed_m_s.max(one.max_speed_m_s);
        }
        for first in 0..self.order.len() {
            let entry = self.order[first];
            let speed_m_s = self.aircraft[entry.aircraft].max_speed_m_s;
            let max_reach_m = swept.reach_m(max_separation_m, speed_m_s + max_speed_m_s);
            for second in first + 1..self.order.len() {
                let other = self.order[second];
                if other.sweep_m - entry.sweep_m > max_reach_m {
                    break;
                }
                if (other.across_m - entry.across_m).abs() > max_reach_m {
                    continue;
                }
                let i = entry.aircraft.min(other.aircraft);
                let j = entry.aircraft.max(other.aircraft);
                if swept.may_meet(&self.aircraft[i], &self.aircraft[j]) {
                    self.prepare(swept, i);
                    self.prepare(swept, j);
                    look(&self.pair(i, j));
                }
            }
        }
    }

    /// Computes the motion of an airplane in the cycle, unless that is done.
    fn prepare(&mut self, swept: &SweptCycle<'_>, i: usize) {
        let Self { aircraft, legs, states, .. } = self;
        let one = &mut aircraft[i];
        if one.prepared.is_some() {
            return;
        }
        let world = swept.world;
        let frame = world.surface.frame_at(one.from);
        let flown = &swept.flown[one.flown.clone()];
        let first_leg = legs.len();
        let first_state = states.len();
        let lasting = flown.iter().filter(|one| one.leg.from_s < one.leg.until_s);
        legs.extend(lasting.map(|one| leg_in_frame(one, frame)));
        for k in 0..world.timing.points_per_dt() {
            let t_s = swept.step_s(k);
            states.push(state_at(&legs[first_leg..], t_s, world.timing.dtau_s));
        }
        one.prepared = Some(PreparedMotion {
            frame,
            legs: first_leg..legs.len(),
            states: first_state..states.len(),
            // The end of a flight is a leg that takes no time.
            has_ended: flown.iter().any(|one| one.leg.from_s == one.leg.until_s),
        });
    }

    /// Returns two airplanes whose motions are prepared; the first one has the smaller id.
    fn pair(&self, i: usize, j: usize) -> FlownPair<'_> {
        let [a, b] = [i, j].map(|k| &self.aircraft[k]);
        let [motion_a, motion_b] =
            [a, b].map(|one| one.prepared.as_ref().expect("motions are prepared before pairs"));
        FlownPair {
            ids: [a.id, b.id],
            separation_m: a.separation_m.max(b.separation_m),
            closure_m_s: a.max_speed_m_s + b.max_speed_m_s,
            has_ended: motion_a.has_ended || motion_b.has_ended,
            states_a: &self.states[motion_a.states.clone()],
            states_b: &self.states[motion_b.states.clone()],
            legs_a: &self.legs[motion_a.legs.clone()],
            legs_b: &self.legs[motion_b.legs.clone()],
            plane: PairPlane::between(motion_a.frame, motion_b.frame),
        }
    }
}

impl FlownAircraft {
    /// Returns an airplane by its legs in a cycle, of which there is at least one.
    fn new(swept: &SweptCycle<'_>, flown: Range<usize>) -> Self {
        let world = swept.world;
        let legs = &swept.flown[flown.clone()];
        let first = &legs[0];
        let max_speed_m_s = legs.iter().map(|one| one.leg.v_m_s).fold(0.0, f64::max);
        // One that comes in later is not where it is compared with others.
        let begins_s = first.leg.from_s - swept.step_s(0);
        let is_steady = legs.len() == 1
            && begins_s <= ROUNDING * world.timing.dtau_s
            && first.leg.omega_rad_s == 0.0
            && first.leg.climb_m_s == 0.0
            && world.surface == Surface::Plane;
        Self {
            id: first.airplane,
            from: first.start.at,
            steady_velocity: is_steady.then(|| first.leg.motion(first.leg.from_s).velocity),
            separation_m: world.airplanes[first.airplane as usize].model.separation_m,
            // A recorded airplane is not carried by the wind that carries the others.
            max_speed_m_s: max_speed_m_s + world.max_wind_m_s(),
            flown,
            prepared: None,
        }
    }
}

/// Returns a leg in the frame that touches the surface where the airplane was at the start of the cycle.
fn leg_in_frame(flown: &FlownLeg, frame: Frame) -> ConstantRateLeg {
    let leg = &flown.leg;
    if frame == Frame::PLANE {
        return *leg;
    }
    let pose = frame.pose_to_local(flown.start);
    ConstantRateLeg::new(leg.from_s, leg.until_s, pose, leg.v_m_s, leg.omega_rad_s)
        .with_climb(leg.altitude_m, leg.climb_m_s)
        .in_wind(leg.drift_m_s)
}

/// Returns the motion of an airplane at the start of a step; `None` if it does not fly then.
fn state_at(legs: &[ConstantRateLeg], t_s: f64, dtau_s: f64) -> Option<StepState> {
    let rounding_s = ROUNDING * dtau_s;
    // Of two legs it is on the one that begins.
    let leg = legs.iter().rev().find(|leg| leg.from_s <= t_s + rounding_s)?;
    (t_s + rounding_s < leg.until_s).then(|| StepState {
        motion: leg.motion(t_s),
        altitude_m: leg.altitude_at_m(t_s),
        climb_m_s: leg.climb_m_s,
    })
}
