//! What one airplane knows of all where no server tells it: a replica of the state, made of its own part and of what the
//! others report of theirs.
//!
//! ```text
//!   own control of cycle k ──> own part at t_k+1 ──┐
//!   reports of the others for t_k+1 ───────────────┴─> replica at t_k+1 ──> Percept of cycle k+1
//! ```
//!
//! Deciding happens one cycle ahead. In `[t_k, t_k+1]` an airplane flies its control of cycle `k`: a *reference*, which
//! says where it is to be at each time. Its part of the state at `t_k+1` follows from that alone, so at `t_k` it sends
//! it to all others as its *report* for cycle `k+1`, and all decide on cycle `k+1` while they fly. All see an airplane
//! where its report says, bit for bit. The vehicle is within `E` of its reference, and `E` is the error of position for which
//! the shield allows (`shield/errors.rs`): plans are computed from where an airplane is seen, and moved by at most `E`.
//!
//! **A report is missing.** An airplane that has no report for this cycle of another one, which *may be near*, talks
//! with nobody in this cycle and stays on its stored fallback ([`Replica::missing`]). May be near is whoever could have
//! come near since it was last heard, at its greatest speed.
//!
//! **Why that loses no safety.** The shield needs that in each cycle the plans of any two airplanes near each other are
//! compatible. Let `a` and `b` be near each other at `t_k+1`.
//!
//! - *Neither has the other's report.* Each may be near for the other, because the bound on where it is holds its true
//!   place. So both stay on their fallbacks, which are compatible by the invariant.
//! - *`a` has that of `b`, and `b` has not that of `a`.* `b` stays on its fallback. `a` sees `b` where `b` is, and may talk
//!   with others. `b` takes part in no conversation of this cycle, so to `a` it is one that is seen and not heard, and
//!   `a` takes no plan that is not compatible with the fallback of `b`, on either side if it cannot see on which
//!   (`agents/exchange.rs`). The plan of `a` and the fallback of `b` are compatible.
//! - *Both have both.* Both see each other where they are, and what follows are the conversations of which
//!   `agents/grouping.rs` and `agents/exchange.rs` prove that no loss of packets makes plans that are not compatible.
//!   There each may come to another group, end early, or fly its fallback after all because its control is late: plans
//!   are made to be compatible with the others' plans and with their fallbacks.
//!
//! So it does not matter who hears whom. Whoever is far away in truth is near for nobody who has its report, and one of
//! whom the replica has only a guess does not enter a percept: either it may be near, and then there is no percept, or the
//! guess is within the same bound and not near either. Those farther away of whom others in a conversation tell are
//! believed as in any flight.
//!
//! What this rests on: reports are true, a vehicle is within `E` of its reference, clocks differ by no more than is allowed
//! for in `E`, no airplane flies faster than the scenario says, and all have begun at the same state, whose fallbacks are
//! apart. A vehicle that leaves its reference, because its autopilot or a pilot has taken over, leaves the promise, too:
//! its node says so ([`Replica::note_position`]), and all that may be near it stay on their fallbacks.
//!
//! ```text
//! limits.rs     the scenarios that can be flown so, and why others cannot
//! reference.rs  where an airplane is to be at each time
//! ```

mod limits;
mod reference;
#[cfg(test)]
mod tests;

use crate::act;
use crate::agents::InvalidMessage;
use crate::flight::{Point, Pose2};
use crate::pilot::{AirplaneControl, Percept};
use crate::scenario::CompiledAirspace;
use crate::scratch::{PhaseContext, Scratch};
use crate::state::{AirplaneSnapshot, AirspaceState, PackedFlightEnd};
use crate::world::AirspaceWorld;
pub use limits::{FlightLimit, TimeShares, check_flight};
pub use reference::{ReferenceCycle, ReferencePoint};
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Meters by which an airplane may seem to have come farther than it can, because of rounding.
const ROUNDING_M: f64 = 1e-3;

/// What an airplane reports of itself: its part of the state at the start of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AirplaneReport {
    /// Its id.
    pub id: EntityId,
    /// The cycle at whose start it will be so.
    pub cycle: Cycle,
    /// Its part of the state.
    pub part: AirplaneSnapshot,
    /// Its pose on its stored fallback.
    pub orbit_pose: Pose2,
}

/// What is known of another airplane for certain.
#[derive(Debug, Clone, Copy)]
struct LastPosition {
    cycle: Cycle,
    at: Point,
}

/// A replica of the state in one airplane: see the [module](self).
#[derive(Debug)]
pub struct Replica {
    world: Arc<AirspaceWorld>,
    id: EntityId,
    cycle: Cycle,
    state: AirspaceState,
    /// Where each airplane was when it was last heard.
    positions: Vec<LastPosition>,
    /// The cycle of the last report of each airplane; none before the first.
    reported: Vec<Option<Cycle>>,
}

impl Replica {
    /// Returns the replica of an airplane at the start of a scenario that [`check_flight`] has passed.
    ///
    /// # Panics
    /// When there is no such airplane.
    pub fn new(scenario: &CompiledAirspace, id: EntityId) -> Self {
        let world = scenario.world.clone();
        let n = world.airplanes.len();
        assert!((id as usize) < n, "there is no airplane {id}");
        let state = AirspaceState::restore(&world, &scenario.start_snapshot());
        let start = |slot: usize| LastPosition { cycle: 0, at: state.airplanes[slot].pose().at };
        let positions = (0..n).map(start).collect();
        Self { world, id, cycle: 0, positions, state, reported: vec![None; n] }
    }

    /// Returns the world.
    pub fn world(&self) -> &Arc<AirspaceWorld> {
        &self.world
    }

    /// Returns the cycle that is decided next.
    pub fn cycle(&self) -> Cycle {
        self.cycle
    }

    /// Returns whether the flight of an airplane has ended, as far as is known.
    pub fn has_ended(&self, id: EntityId) -> bool {
        !self.state.airplanes[id as usize].is_unfinished()
    }

    /// Returns whether the radio of the airplane is off in the cycle in which it is decided.
    pub fn is_radio_off(&self) -> bool {
        self.world.is_radio_off(self.id, self.cycle)
    }

    /// Returns what the airplane reports of itself for the present cycle.
    pub fn report(&self) -> AirplaneReport {
        AirplaneReport {
            id: self.id,
            cycle: self.cycle,
            part: self.state.airplane_snapshot(self.id),
            orbit_pose: self.state.orbit_pose(self.id),
        }
    }

    /// Takes the report of another airplane for the present cycle.
    ///
    /// # Errors
    /// When it is of another cycle, or cannot be: nothing is taken then.
    pub fn accept_report(&mut self, report: &AirplaneReport) -> Result<(), InvalidMessage> {
        InvalidMessage::Airplane.ensure(report.id != self.id)?;
        InvalidMessage::Plan.ensure(report.cycle == self.cycle)?;
        self.check_report(report)?;
        self.store(report);
        Ok(())
    }

    /// Takes up the airplane's own flight again from an earlier report of its own: from there on it has stayed on its
    /// fallback. The present cycle is that of the report then.
    ///
    /// # Errors
    /// When it is of another airplane, or of an earlier cycle, or cannot be.
    pub fn resume(&mut self, report: &AirplaneReport) -> Result<(), InvalidMessage> {
        InvalidMessage::Airplane.ensure(report.id == self.id)?;
        InvalidMessage::Plan.ensure(report.cycle >= self.cycle)?;
        self.check_report(report)?;
        self.store(report);
        self.cycle = report.cycle;
        Ok(())
    }

    fn store(&mut self, report: &AirplaneReport) {
        let slot = report.id as usize;
        self.state.replace_airplane(report.id, &report.part, report.orbit_pose);
        self.positions[slot] = LastPosition { cycle: report.cycle, at: report.part.pose.at };
        self.reported[slot] = Some(report.cycle);
    }

    /// Notes where an airplane is at the start of the present cycle that does not fly its reference: nobody can say where it
    /// will be.
    ///
    /// # Errors
    /// When there is no such airplane, or that is no place.
    pub fn note_position(&mut self, id: EntityId, at: Point) -> Result<(), InvalidMessage> {
        InvalidMessage::Airplane.ensure((id as usize) < self.positions.len())?;
        InvalidMessage::Number.ensure(at.into_iter().all(f64::is_finite))?;
        self.positions[id as usize] = LastPosition { cycle: self.cycle, at };
        Ok(())
    }

    /// Checks what an airplane reports of itself: a number that is none would make all that see it fail.
    fn check_report(&self, report: &AirplaneReport) -> Result<(), InvalidMessage> {
        let slot = report.id as usize;
        InvalidMessage::Airplane.ensure(slot < self.positions.len())?;
        let AirplaneSnapshot { pose, counts, fallback, orders, altitude_m, .. } = report.part;
        let Pose2 { at: [x, y], heading_rad } = pose;
        let Pose2 { at: [orbit_x, orbit_y], heading_rad: orbit_rad } = report.orbit_pose;
        let numbers = [x, y, heading_rad, orbit_x, orbit_y, orbit_rad, altitude_m];
        let turn_rate_rad_s = report.part.turn_rate_rad_s;
        let are_finite = numbers.into_iter().all(f64::is_finite) && turn_rate_rad_s.is_finite();
        InvalidMessage::Number.ensure(are_finite)?;
        let way_points = self.world.segment(report.id, 0).mission.len();
        // Nobody is given orders, and where messages get lost all fallbacks are orbits.
        let is_possible =
            counts[0] as usize <= way_points && orders == [0, 0] && fallback.is_orbiting();
        InvalidMessage::Plan.ensure(is_possible)?;
        // Levels are kept.
        InvalidMessage::Plan.ensure(altitude_m == self.state.airplanes[slot].altitude_m.get())?;
        let LastPosition { cycle, at } = self.positions[slot];
        let cycles = report.cycle.saturating_sub(cycle);
        let flown_m = self.world.surface.distance_m(at, pose.at);
        InvalidMessage::Plan.ensure(flown_m <= self.reach_m(slot, cycles) + ROUNDING_M)
    }

    /// Returns how far an airplane gets over the ground in some cycles, in meters.
    fn reach_m(&self, slot: usize, cycles: u64) -> f64 {
        let max_m_s = self.world.top_m_s[slot] + self.world.max_wind_m_s();
        max_m_s * self.world.timing.dt_s * cycles as f64
    }

    /// Returns the others without a report for the present cycle that may be near, by rising id.
    pub fn missing(&self) -> Vec<EntityId> {
        let ids = 0..self.positions.len() as EntityId;
        ids.filter(|&id| id != self.id && !self.is_known(id) && self.may_be_near(id)).collect()
    }

    /// Returns the others without a report for the present cycle, by rising id.
    pub fn unreported(&self) -> Vec<EntityId> {
        let ids = 0..self.positions.len() as EntityId;
        ids.filter(|&id| id != self.id && !self.is_known(id)).collect()
    }

    /// Returns whether an airplane has reported for the present cycle, or is known to be gone for good.
    fn is_known(&self, id: EntityId) -> bool {
        self.reported[id as usize] == Some(self.cycle) || self.has_ended(id)
    }

    /// Returns whether another airplane may have come near since it was last heard.
    fn may_be_near(&self, id: EntityId) -> bool {
        let own = &self.state.airplanes[self.id as usize];
        let other = id as usize;
        let altitude_m = self.state.airplanes[other].altitude_m.get();
        // Levels are kept, and those that are apart need nothing else.
        if (altitude_m - own.altitude_m.get()).abs() >= self.world.vertical_m {
            return false;
        }
        let LastPosition { cycle, at } = self.positions[other];
        let reach_m = self.reach_m(other, self.cycle.saturating_sub(cycle));
        let range_m = self.world.interaction_range_m(self.id as usize, other);
        // Rounding must not decide against the other one.
        self.world.surface.distance_m(own.pose().at, at) <= range_m + reach_m + ROUNDING_M
    }

    /// Returns the percept of the airplane in the present cycle; none if its flight has ended.
    pub fn percept(&self) -> Option<Percept> {
        let percepts = self.world.percepts(&self.state, self.cycle);
        percepts.into_iter().find(|percept| percept.own.id == self.id)
    }

    /// Returns whether two airplanes are so far apart that a radio does not reach.
    pub fn distance_m(&self, other: EntityId) -> f64 {
        self.state.distance_m([self.id, other])
    }

    /// Flies the present cycle: the airplane by its control, or on its stored fallback without one. Where the others are
    /// then is a guess until they report: on their fallbacks.
    pub fn advance(&mut self, control: Option<AirplaneControl>) {
        let slots = 0..self.positions.len() as EntityId;
        let mut scratch = Scratch::default();
        self.state.set_controls(self.cycle, control.into_iter().collect());
        for slot in slots {
            self.fly_alone(&self.state, self.cycle, slot, &mut scratch);
        }
        self.cycle += 1;
    }

    /// Flies an airplane for one cycle, as if it were alone: without orders, commands and exempt pairs its part of the state
    /// depends on its control only.
    fn fly_alone(&self, state: &AirspaceState, now: Cycle, slot: EntityId, scratch: &mut Scratch) {
        if !state.is_active(&self.world, slot, now) {
            return;
        }
        let clock = ManualClock::default();
        let context = &mut PhaseContext { world: &self.world, state, now, clock: &clock, scratch };
        act::act(context, &[slot]);
    }
}

impl AirplaneReport {
    /// Returns whether the airplane's flight has ended.
    pub fn has_ended(&self) -> bool {
        self.part.ended != PackedFlightEnd::NONE
    }
}
