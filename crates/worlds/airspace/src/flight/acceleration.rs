//! Changes of speed that take time: an order to a speed becomes one speed for each cycle on the way there.
//!
//! The shield's plans and fallbacks are those of one speed. So an airplane flies each cycle with one speed: the mean of
//! the speed that it would have, accelerating steadily. Then it is at the end of each cycle where an airplane is that
//! accelerates steadily, and its speed never differs from that one's by more than acceleration times `dt / 2`. Each of
//! these speeds is an order of its own, which the shield clears as it clears any order to a speed
//! (`act/orders.rs`): the invariant holds at each, and one that has to wait holds up those after it. All know them from
//! the filed flight.

use super::order::{FlightOrder, FlightTask};
use sidestep_kernel::Cycle;

/// Largest number of orders of an airplane with those that stand for accelerating: the state counts them in 16 bits.
const MAX_STEPS: usize = 60_000;

/// How an airplane changes its speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpeedChanges {
    /// Airspeed at the start, in meters per second.
    pub(crate) v_m_s: f64,
    /// Acceleration and deceleration in meters per second squared.
    pub(crate) acceleration_m_s2: f64,
    /// The first cycle in which it can be given orders.
    pub(crate) first_cycle: Cycle,
    /// Length of a cycle in seconds.
    pub(crate) dt_s: f64,
}

/// A steady change from one speed to another.
#[derive(Debug, Clone, Copy)]
struct SpeedRamp {
    from_cycle: Cycle,
    from_m_s: f64,
    to_m_s: f64,
}

impl SpeedChanges {
    /// Returns the orders with the speed of each cycle in place of those to a speed; `None` if there would be too many.
    pub(crate) fn steps(&self, orders: &[FlightOrder]) -> Option<Vec<FlightOrder>> {
        let mut all: Vec<(Cycle, FlightOrder)> = Vec::with_capacity(orders.len());
        let mut ramp = SpeedRamp { from_cycle: 0, from_m_s: self.v_m_s, to_m_s: self.v_m_s };
        for order in orders {
            let cycle = ((order.at_s / self.dt_s).ceil() as Cycle).max(self.first_cycle);
            let FlightTask::Speed(to_m_s) = order.task else {
                all.push((cycle, order.clone()));
                continue;
            };
            // From now on it changes to the new speed, from the one that it has reached by now.
            all.retain(|(planned, other)| *planned < cycle || other.task.speed_m_s().is_none());
            ramp = SpeedRamp { from_cycle: cycle, from_m_s: self.speed_at(ramp, cycle), to_m_s };
            let steps = self.step_count(ramp);
            if all.len() as f64 + steps >= MAX_STEPS as f64 {
                return None;
            }
            for k in 0..=steps as Cycle {
                all.push((cycle + k, self.step(ramp, k, order.at_s)));
            }
        }
        // Stable, so that orders of one time stay in their order.
        all.sort_by(|(_, a), (_, b)| a.at_s.total_cmp(&b.at_s));
        Some(all.into_iter().map(|(_, order)| order).collect())
    }

    /// Returns the order that gives an airplane the speed of the `k`-th cycle of a change, which was ordered at `at_s`.
    fn step(&self, ramp: SpeedRamp, k: Cycle, at_s: f64) -> FlightOrder {
        let starts_s = (ramp.from_cycle + k) as f64 * self.dt_s;
        // The first one keeps its place among other orders of the same time.
        let at_s = if k == 0 { at_s } else { starts_s };
        let task = if k as f64 >= self.step_count(ramp) {
            FlightTask::Speed(ramp.to_m_s)
        } else {
            FlightTask::Acceleration(self.mean_speed_m_s(ramp, k))
        };
        FlightOrder { at_s, task }
    }

    /// Returns the time that a change takes, in seconds.
    fn duration_s(&self, ramp: SpeedRamp) -> f64 {
        (ramp.to_m_s - ramp.from_m_s).abs() / self.acceleration_m_s2
    }

    /// Returns the number of cycles in which the speed changes; a last one that is only rounding does not count.
    fn step_count(&self, ramp: SpeedRamp) -> f64 {
        (self.duration_s(ramp) / self.dt_s - 1e-9).ceil().max(0.0)
    }

    /// Returns the speed at the start of a cycle, if no order had to wait.
    fn speed_at(&self, ramp: SpeedRamp, cycle: Cycle) -> f64 {
        let elapsed_s = cycle.saturating_sub(ramp.from_cycle) as f64 * self.dt_s;
        let change_m_s = self.acceleration_m_s2 * elapsed_s;
        ramp.from_m_s + (ramp.to_m_s - ramp.from_m_s).clamp(-change_m_s, change_m_s)
    }

    /// Returns the mean speed in the `k`-th cycle of a change.
    fn mean_speed_m_s(&self, ramp: SpeedRamp, k: Cycle) -> f64 {
        let starts_m_s = self.speed_at(ramp, ramp.from_cycle + k);
        let left_s = (self.duration_s(ramp) - k as f64 * self.dt_s).min(self.dt_s);
        let changes_m_s = self.speed_at(ramp, ramp.from_cycle + k + 1) - starts_m_s;
        // It changes for `left_s` on average by half, and keeps the new speed for the rest of the cycle.
        starts_m_s + changes_m_s * (1.0 - 0.5 * left_s / self.dt_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn changes() -> SpeedChanges {
        SpeedChanges { v_m_s: 35.0, acceleration_m_s2: 0.5, first_cycle: 0, dt_s: 5.0 }
    }

    fn speed(at_s: f64, v_m_s: f64) -> FlightOrder {
        FlightOrder { at_s, task: FlightTask::Speed(v_m_s) }
    }

    #[test]
    fn an_order_to_a_speed_becomes_the_mean_speeds_of_the_cycles_on_the_way() {
        let steps = changes().steps(&[speed(7.0, 42.0)]).expect("few");
        let given: Vec<(f64, f64)> =
            steps.iter().map(|one| (one.at_s, one.task.speed_m_s().expect("a speed"))).collect();
        // From 10 s on 0.5 m/s2: 37.5 at 15 s, 40 at 20 s, and 42 after four of the five seconds of the third cycle.
        assert_eq!(given[..2], [(7.0, 36.25), (15.0, 38.75)]);
        assert_eq!(given.len(), 4);
        assert!((given[2].1 - 41.2).abs() < 1e-9 && given[3] == (25.0, 42.0), "{given:?}");
        assert!(matches!(steps[3].task, FlightTask::Speed(_)));
        assert!(steps[..3].iter().all(|one| matches!(one.task, FlightTask::Acceleration(_))));
    }

    #[test]
    fn a_second_order_begins_at_the_speed_that_is_reached_by_then_and_other_orders_keep_their_places()
     {
        let heading = FlightOrder { at_s: 12.0, task: FlightTask::Heading(1.0) };
        let steps = changes().steps(&[speed(0.0, 60.0), heading, speed(20.0, 35.0)]).expect("few");
        let speeds: Vec<Option<f64>> = steps.iter().map(|one| one.task.speed_m_s()).collect();
        let up = [Some(36.25), Some(38.75), Some(41.25)];
        assert_eq!(speeds[..3], up);
        assert_eq!(speeds[3], None, "the heading at 12 s stands between 10 s and 15 s");
        assert_eq!(speeds[4..], [43.75, 43.75, 41.25, 38.75, 36.25, 35.0].map(Some));
    }

    #[test]
    fn a_change_that_takes_too_many_cycles_is_none() {
        let slow = SpeedChanges { acceleration_m_s2: 1e-6, ..changes() };
        assert_eq!(slow.steps(&[speed(0.0, 99.0)]), None);
    }

    proptest! {
        /// From cycle to cycle the speed changes by no more than the acceleration allows, and at the end an airplane is
        /// where steady acceleration takes it.
        #[test]
        fn speeds_change_as_fast_as_the_airplane_accelerates(
            first in 0.0f64..300.0, gap in 0.0f64..100.0, speeds in [5.0f64..90.0, 5.0f64..90.0],
            acceleration_m_s2 in 0.1f64..9.0, first_cycle in 0u64..20,
        ) {
            let changes = SpeedChanges { acceleration_m_s2, first_cycle, ..changes() };
            let orders = [speed(first, speeds[0]), speed(first + gap, speeds[1])];
            let steps = changes.steps(&orders).expect("few");
            prop_assert!(steps.windows(2).all(|pair| pair[0].at_s <= pair[1].at_s));
            let mut v_m_s = changes.v_m_s;
            for step in &steps {
                let next_m_s = step.task.speed_m_s().expect("a speed");
                prop_assert!((next_m_s - v_m_s).abs() <= acceleration_m_s2 * 5.0 + 1e-9);
                v_m_s = next_m_s;
            }
            prop_assert_eq!(v_m_s, speeds[1]);
        }

        #[test]
        fn an_airplane_flies_as_far_as_one_that_accelerates_steadily(
            to_m_s in 5.0f64..90.0, acceleration_m_s2 in 0.1f64..9.0,
        ) {
            let changes = SpeedChanges { acceleration_m_s2, ..changes() };
            let steps = changes.steps(&[speed(0.0, to_m_s)]).expect("few");
            let cycles = steps.len() - 1;
            let flown_m: f64 =
                steps[..cycles].iter().map(|one| 5.0 * one.task.speed_m_s().expect("a speed")).sum();
            let duration_s = (to_m_s - 35.0).abs() / acceleration_m_s2;
            let steady_m = 0.5 * (35.0 + to_m_s) * duration_s + to_m_s * (5.0 * cycles as f64 - duration_s);
            prop_assert!((flown_m - steady_m).abs() < 1e-6 * steady_m.max(1.0), "{flown_m} {steady_m}");
        }
    }
}
