//! Delays that are drawn for a section of robots together, before a cycle.

use super::delay::Delays;
use super::purpose;
use super::state::RobotsState;
use super::world::{RobotsWorld, Role};
use sidestep_kernel::math::ln;
use sidestep_kernel::{Cycle, EntityId};
use std::ops::Range;

impl RobotsWorld {
    /// Starts the delays of a cycle in each section whose robots are delayed together.
    pub(crate) fn start_team_delays(&self, state: &RobotsState, now: Cycle) {
        for robots in &self.delay_teams {
            let Role::Robot(model) = &self.type_of(robots.start).role else { continue };
            let Some(delays) = &model.body.delays else { continue };
            self.start_delays_of(robots.clone(), delays, state, now);
        }
    }

    fn start_delays_of(
        &self,
        robots: Range<EntityId>,
        delays: &Delays,
        state: &RobotsState,
        now: Cycle,
    ) {
        let Some(chance) = delays.team_chance() else { return };
        let mut ready: Vec<EntityId> =
            robots.clone().filter(|&id| state.delays.remaining(id) == 0).collect();
        let mut draws = self.streams.draws(robots.start, now, purpose::TEAM_DELAYS);
        // As many as arrive in a time of this length, with exponential times between them.
        let mut time_left = chance * f64::from(robots.end - robots.start);
        while !ready.is_empty() {
            time_left += ln((f64::from(draws.next_u32()) + 1.0) / 4_294_967_296.0);
            if time_left < 0.0 {
                return;
            }
            let id = ready.swap_remove(draws.uniform_below(ready.len() as u32) as usize);
            let [_, length, ..] = self.streams.block(id, now, purpose::DELAY, 0);
            state.delays.start(id, delays.sample_length(length));
        }
    }
}
