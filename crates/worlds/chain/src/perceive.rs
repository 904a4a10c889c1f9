//! Perception and decisions of navigators at the start of a cycle, with everybody else where they
//! are at that moment.

use super::driver::Driver;
use super::navigate::{Goal, Navigator};
use super::rods::geometry::distance;
use super::scratch::Scratch;
use super::state::ChainState;
use super::swarm::leader::{Decision, LeaderState, Percept, Surroundings};
use super::world::{ChainWorld, purpose};
use sidestep_kernel::{Cycle, Slot};

/// Time for which a navigator stands for what moves ahead before it takes that for a wall, s.
const STANDS_S: f64 = 10.0;

/// A worker's read-only look at a state that nobody changes meanwhile.
pub(crate) struct Looking<'a, const D: usize> {
    pub(crate) world: &'a ChainWorld<D>,
    pub(crate) state: &'a ChainState<D>,
    pub(crate) now: Cycle,
    pub(crate) scratch: &'a mut Scratch<D>,
}

/// A navigator's perception.
pub(crate) struct Sight<'a> {
    pub(crate) navigator: &'a Navigator,
    /// The connector that navigates.
    pub(crate) agent: usize,
    pub(crate) leader: LeaderState,
    pub(crate) percept: Percept,
}

impl<'a, const D: usize> Looking<'a, D> {
    /// Returns a navigator's decision; none for other drivers.
    pub(crate) fn decide(&mut self, slot: Slot) -> Option<Decision> {
        let sight = self.sight(slot)?;
        Some(sight.navigator.leader.decide(sight.leader.followed, &sight.percept))
    }

    /// Returns a navigator's perception; its laser's ranges are in the scratch.
    pub(crate) fn sight(&mut self, slot: Slot) -> Option<Sight<'a>> {
        let Self { world, state, now, .. } = *self;
        let body = state.leading(slot as usize);
        let task = world.chains[slot as usize].tasks.get(body.driving.task as usize)?;
        let Driver::Navigate(navigator) = &task.driver else { return None };
        let (leader, stood) = (body.leader(task), body.stood);
        drop(body);
        self.see_others(slot, task.agent, navigator, &leader);
        self.scratch.gather(world, state, now, std::iter::empty());
        let noise = &mut world.streams.draws(slot, now, purpose::LASER);
        let Scratch { obstacles, scan, seen, .. } = &mut *self.scratch;
        let target = navigator.goal.as_ref().and_then(Goal::target);
        let around = Surroundings { obstacles: obstacles.in_plane()?, bodies: seen, target };
        let is_patient = world.starts_s(u64::from(stood)) < STANDS_S;
        let percept = navigator.leader.perceive(&leader.pose, &around, noise, scan, is_patient);
        Some(Sight { navigator, agent: task.agent, leader, percept })
    }

    /// Gathers all parts of chains that a navigator may see, its own chain included, except itself.
    fn see_others(
        &mut self,
        slot: Slot,
        agent: usize,
        navigator: &Navigator,
        leader: &LeaderState,
    ) {
        let range_m = navigator.leader.laser.range_m();
        let seen = &mut self.scratch.seen;
        seen.clear();
        for other in 0..self.state.len() {
            let body = self.state.body(other);
            let is_own = other == slot as usize;
            body.solids().filter(|(k, _)| !(is_own && *k == agent)).for_each(|(_, solid)| {
                if distance(leader.pose.at, solid.at) - solid.radius_m <= range_m {
                    seen.push(solid.as_seen());
                }
            });
        }
    }
}
