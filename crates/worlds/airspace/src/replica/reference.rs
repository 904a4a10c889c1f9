//! The reference of an airplane: where it is to be at each time.

use super::Replica;
use crate::flight::{ConstantRateLeg, Pose2};
use crate::flown_leg::FlownLeg;
use crate::pilot::AirplaneControl;
use crate::scratch::Scratch;
use crate::state::AirspaceState;
use sidestep_kernel::{Cycle, math};

/// Longest time in seconds between two points of a reference: between them a line will do. At 8 m/s and a turn of 30 degrees
/// per second it is off the arc by 5 mm.
const MAX_STEP_S: f64 = 0.1;

/// An airplane on its reference at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferencePoint {
    /// Time in seconds after the start of the run.
    pub at_s: f64,
    /// Its position in the scenario's coordinates, and the direction of its motion over the ground.
    pub pose: Pose2,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// Speed over the ground in meters per second.
    pub ground_speed_m_s: f64,
    /// Turn rate in radians per second, positive to the left.
    pub turn_rate_rad_s: f64,
}

/// The reference of one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceCycle {
    /// The cycle.
    pub cycle: Cycle,
    /// Its points by rising time, at least two.
    pub points: Vec<ReferencePoint>,
    /// Whether the flight ends with it.
    pub is_last: bool,
}

impl Replica {
    /// Returns the reference of the airplane from the present cycle on: by its control, or on its stored fallback without one;
    /// and then on the fallback, for some cycles in all. Fewer where the flight ends.
    pub fn reference(
        &self,
        control: Option<&AirplaneControl>,
        cycles: usize,
    ) -> Vec<ReferenceCycle> {
        let copy = AirspaceState::restore(&self.world, &self.state.snapshot(self.cycle));
        let mut scratch = Scratch::default();
        let mut reference = Vec::with_capacity(cycles);
        for now in (self.cycle..).take(cycles) {
            if !copy.is_active(&self.world, self.id, now) {
                break;
            }
            let control = control.filter(|_| now == self.cycle);
            copy.set_controls(now, control.into_iter().cloned().collect());
            self.fly_alone(&copy, now, self.id, &mut scratch);
            let legs = std::mem::take(&mut scratch.flown);
            reference.push(self.reference_cycle(now, &legs));
        }
        reference
    }

    fn reference_cycle(&self, cycle: Cycle, legs: &[FlownLeg]) -> ReferenceCycle {
        let start_s = self.world.cycle_start_s(cycle);
        let dt_s = self.world.timing.dt_s;
        let steps = (dt_s / MAX_STEP_S).ceil().max(1.0);
        // A flight that ends has a leg at its end that takes no time.
        let end = legs.last().filter(|last| last.leg.until_s <= last.leg.from_s);
        let end_s = end.map_or(start_s + dt_s, |last| last.leg.from_s);
        let times = (0..=steps as u32).map(|k| start_s + dt_s * f64::from(k) / steps);
        let mut points: Vec<ReferencePoint> =
            times.filter(|at_s| *at_s < end_s).map(|at_s| self.point(legs, at_s)).collect();
        points.push(self.point(legs, end_s));
        ReferenceCycle { cycle, points, is_last: end.is_some() }
    }

    /// Returns the point at a time within some legs.
    fn point(&self, legs: &[FlownLeg], at_s: f64) -> ReferencePoint {
        let flown = |one: &&FlownLeg| one.leg.until_s > one.leg.from_s;
        let begun = legs.iter().filter(flown).take_while(|one| one.leg.from_s <= at_s).last();
        let Some(FlownLeg { leg, start, .. }) = begun.or(legs.first()) else {
            // An airplane in the air has flown something.
            unreachable!("a cycle without a leg");
        };
        // Close to its start every frame is the same, and a leg is short compared with the earth.
        let frame = self.world.surface.frame_at(start.at);
        let local = ConstantRateLeg::new(
            leg.from_s,
            leg.until_s,
            frame.pose_to_local(*start),
            leg.v_m_s,
            leg.omega_rad_s,
        );
        let local = local.with_climb(leg.altitude_m, leg.climb_m_s).in_wind(leg.drift_m_s);
        let motion = local.motion(at_s);
        let [east_m_s, north_m_s] = motion.velocity;
        let heading_rad = math::atan2(north_m_s, east_m_s);
        ReferencePoint {
            at_s,
            pose: frame.pose_to_world(Pose2 { at: motion.at, heading_rad }),
            altitude_m: local.altitude_at_m(at_s),
            ground_speed_m_s: math::hypot(east_m_s, north_m_s),
            turn_rate_rad_s: leg.omega_rad_s,
        }
    }
}
