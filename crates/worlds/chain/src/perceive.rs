//! Perception and decisions of navigators at the start of a cycle, with all other bodies where they are
//! at that moment.

use super::driver::TaskKind;
use super::navigate::{NavigationGoal, Navigator};
use super::scratch::Scratch;
use super::state::ChainWorldState;
use super::swarm::leader::{LeaderDecision, LeaderState, LeaderSurroundings, WallAndTargetPercept};
use super::world::{ChainWorld, purpose};
use sidestep_kernel::{Cycle, EntitySlot};
use sidestep_rods::geometry::distance;

/// Time for which a navigator stands for a body that moves ahead before it treats that as a wall, s. Without a limit
/// two navigators that meet would wait for each other.
const STAND_TIMEOUT_S: f64 = 10.0;

/// A worker that perceives for navigators; the state does not change meanwhile.
pub(crate) struct Perceiver<'a, const D: usize> {
    pub(crate) world: &'a ChainWorld<D>,
    pub(crate) state: &'a ChainWorldState<D>,
    pub(crate) now: Cycle,
    pub(crate) scratch: &'a mut Scratch<D>,
}

/// What a navigator knows when it decides.
pub(crate) struct NavigatorPercept<'a> {
    pub(crate) navigator: &'a Navigator,
    pub(crate) agent: usize,
    pub(crate) leader: LeaderState,
    pub(crate) percept: WallAndTargetPercept,
}

impl<'a, const D: usize> Perceiver<'a, D> {
    /// Returns a navigator's decision; none for other drivers.
    pub(crate) fn decide(&mut self, slot: EntitySlot) -> Option<LeaderDecision> {
        let own = self.percept(slot)?;
        Some(own.navigator.leader.decide(own.leader.followed, &own.percept))
    }

    /// Returns a navigator's perception; its laser's ranges are in the scratch.
    pub(crate) fn percept(&mut self, slot: EntitySlot) -> Option<NavigatorPercept<'a>> {
        let Self { world, state, now, .. } = *self;
        let body = state.body_before_deferred_motions(slot as usize);
        let task = world.chains[slot as usize].tasks.get(body.driving.task as usize)?;
        let TaskKind::Navigate(navigator) = &task.driver else { return None };
        let leader = body.leader_state(task);
        let stood = body.standstill.cycles;
        // Not held while other bodies are locked.
        drop(body);
        self.gather_others(slot, task.agent, navigator, &leader);
        self.scratch.nearby.gather(world, state, now, std::iter::empty());
        let noise = &mut world.streams.draws(slot, now, purpose::LASER);
        let Scratch { nearby, scan, robot_bodies, .. } = &mut *self.scratch;
        let target = navigator.goal.as_ref().and_then(NavigationGoal::target);
        let obstacles = nearby.all.as_planar()?;
        let around = LeaderSurroundings { obstacles, bodies: robot_bodies, target };
        let is_patient = world.cycle_start_time_s(u64::from(stood)) < STAND_TIMEOUT_S;
        navigator.leader.scan(&leader.pose, &around, noise, scan);
        let percept = navigator.leader.perceive(&leader.pose, &around, scan, is_patient);
        Some(NavigatorPercept { navigator, agent: task.agent, leader, percept })
    }

    /// Gathers all parts of chains that a navigator may see, its own chain included, except itself.
    fn gather_others(
        &mut self,
        slot: EntitySlot,
        agent: usize,
        navigator: &Navigator,
        leader: &LeaderState,
    ) {
        let range_m = navigator.leader.laser.range_m();
        let Scratch { robot_bodies, near, .. } = &mut *self.scratch;
        robot_bodies.clear();
        self.state.list_near(leader.pose.at, range_m, near);
        for &other in &*near {
            let body = self.state.body(other as usize);
            let is_own = other == slot;
            for (k, solid) in body.solids() {
                let is_itself = is_own && k == agent;
                let gap_m = distance(leader.pose.at, solid.at) - solid.radius_m;
                if !is_itself && gap_m <= range_m {
                    robot_bodies.push(solid.robot_body());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ChainScenario;
    use crate::swarm::laser::RobotBody;
    use proptest::prelude::*;
    use sidestep_rods::geometry::Point;
    use sidestep_scenario::Source;

    /// Range of the lasers, meters.
    const RANGE_M: f64 = 1.5;

    /// Chains of two connectors, and as many on wheels, each with a navigator.
    fn crowd(count: usize) -> (ChainWorld<2>, ChainWorldState<2>) {
        let chains = |at: &str, more: &str| {
            format!(
                "[[chains]]\nconnectors = 2\ncount = {count}\nat_m = {at}\napart_m = [0.0, 2.0]\nrod_m = 1.0\n{more}\n\
                 tasks = [{{ kind = \"navigate\", navigator = {{ range_m = {RANGE_M} }} }}]\n"
            )
        };
        let [bare, wheels] = [chains("[0.0, 0.0]", ""), chains("[9.0, 0.0]", "robots = {}")];
        let text = format!("format = 1\nworld = \"chain\"\n{bare}{wheels}");
        let compiled = ChainScenario::<2>::new(&Source::new("s.toml", text, "")).expect("valid");
        let state = ChainWorldState::new(&compiled.world).expect("valid");
        ((*compiled.world).clone(), state)
    }

    /// Puts the ends of all chains, and their robots, elsewhere.
    fn put(state: &ChainWorldState<2>, places: &[[Point<2>; 2]]) {
        for (slot, ends) in (0..state.len()).zip(places.iter().cycle()) {
            let mut body = state.body_mut(slot);
            body.chain.points_mut().copy_from_slice(ends);
            body.robots.iter_mut().zip(ends).for_each(|(robot, at)| robot.pose.at = *at);
        }
    }

    /// Returns the parts of all chains that the first connector of one of them sees by a look at each.
    fn seen_of_all(state: &ChainWorldState<2>, slot: usize) -> Vec<RobotBody> {
        let at = state.body(slot).chain.points()[0];
        let mut seen = Vec::new();
        for other in 0..state.len() {
            let body = state.body(other);
            let others = body.solids().filter(|(k, _)| (other, *k) != (slot, 0));
            let near =
                others.filter(|(_, solid)| distance(at, solid.at) - solid.radius_m <= RANGE_M);
            seen.extend(near.map(|(_, solid)| solid.robot_body()));
        }
        seen
    }

    fn assert_all_is_seen(world: &ChainWorld<2>, state: &ChainWorldState<2>) {
        let mut scratch = Scratch::new(world);
        let mut perceiver = Perceiver { world, state, now: 0, scratch: &mut scratch };
        for slot in 0..state.len() {
            perceiver.percept(slot as EntitySlot).expect("it navigates");
            assert_eq!(perceiver.scratch.robot_bodies, seen_of_all(state, slot), "chain {slot}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn a_navigator_sees_exactly_what_a_look_at_every_chain_shows(
            count in 1..40usize,
            places in prop::collection::vec(prop::array::uniform4(-1.0..1.0f64), 2..90),
            spread_m in prop::array::uniform2(0.1..12.0f64),
            is_rounded: bool,
        ) {
            let (world, state) = crowd(count);
            assert_all_is_seen(&world, &state);
            // Then all are elsewhere, also on the very edge of sight.
            for stretch in [1.0, 0.5] {
                let at = |part: f64, axis: usize| {
                    let m = part * stretch * spread_m[axis];
                    if is_rounded { (4.0 * m).round() / 4.0 } else { m }
                };
                let ends = |p: &[f64; 4]| [[at(p[0], 0), at(p[1], 1)], [at(p[2], 0), at(p[3], 1)]];
                put(&state, &places.iter().map(ends).collect::<Vec<_>>());
                assert_all_is_seen(&world, &state);
                assert_all_is_seen(&world, &state.trial_copy());
            }
        }
    }

    #[test]
    fn of_many_chains_a_navigator_looks_at_those_beside_it_only() {
        let (_, state) = crowd(500);
        let mut near = Vec::new();
        state.list_near([0.0, 100.0], RANGE_M, &mut near);
        assert_eq!(near, [50]);
        // A chain of 1 m that stretches from far away to here, and one that has gone.
        state.body_mut(900).chain.points_mut()[1] = [0.5, 100.0];
        state.body_mut(900).robots[1].pose.at = [0.5, 100.0];
        put_far_away(&state, 50);
        state.list_near([0.0, 100.0], RANGE_M, &mut near);
        assert_eq!(near, [900]);
    }

    fn put_far_away(state: &ChainWorldState<2>, slot: usize) {
        state.body_mut(slot).chain.points_mut().iter_mut().for_each(|at| at[0] -= 90.0);
    }
}
