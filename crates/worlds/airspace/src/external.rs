//! Airplanes as a caller sees them: their observations, and the orders for those that are decided
//! from outside.

mod observation;
#[cfg(test)]
mod tests;

use super::external_action::ExternalAction;
use super::flight::KnownAircraft;
use super::join::ControlledGroup;
use super::non_cooperative::NonCooperative;
use super::perceive::{known_aircraft, non_cooperative_aircraft};
use super::scratch::{PhaseContext, Scratch};
use super::settings::Method;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use super::{act, join};
use observation::{Observation, VisibleAircraft};
use sidestep_kernel::control::{BufferMut, Order, Space, SpaceKind, Team, Teams};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId, Slot, World};
use std::collections::BTreeMap;

impl AirspaceWorld {
    /// Returns the teams: airplanes that decide, and that turn alike. Those that mind no other are
    /// in none.
    pub(super) fn find_teams(&self) -> Teams {
        let mut places: BTreeMap<(usize, u64), usize> = BTreeMap::new();
        let mut alike: Vec<Vec<EntityId>> = Vec::new();
        for i in (0..self.airplanes.len()).filter(|&i| self.is_controlled(i)) {
            let model = &self.airplanes[i].model;
            let place = places.entry((model.turns, model.omega_max_rad_s.to_bits()));
            let place = *place.or_insert(alike.len());
            if place == alike.len() {
                alike.push(Vec::new());
            }
            alike[place].push(i as EntityId);
        }
        let team = |(k, agents): (usize, Vec<EntityId>)| {
            let name = match k {
                0 => Self::AGENT.into(),
                k => format!("{} {}", Self::AGENT, k + 1),
            };
            let first = agents[0] as usize;
            let is_external = self.method == Method::External;
            let ordered = if is_external { self.order_spaces(first) } else { Vec::new() };
            let observed = observation::spaces(self, &agents);
            Team { name, agents, observation_spaces: observed, action_spaces: ordered }
        };
        Teams::new(alike.into_iter().enumerate().map(team).collect(), Self::AGENT)
    }

    /// Returns the spaces of the orders that an airplane may be given.
    fn order_spaces(&self, i: usize) -> Vec<Space> {
        let actions = &self.actions[i];
        let numbered = actions.iter().enumerate().map(|(k, action)| format!("{k} {action}"));
        let meaning = format!(
            "its actions, the best first, each once: the shield takes the first that is safe; {}",
            numbered.collect::<Vec<_>>().join("; ")
        );
        let high = self.airplanes[i].model.omega_max_rad_s;
        let free = SpaceKind::Real { low: f64::NEG_INFINITY, high: f64::INFINITY };
        let ranks = SpaceKind::Integer { low: 0, high: actions.len() as i64 - 1 };
        vec![
            Space::new(ExternalAction::RANKING, ranks, meaning).with_shape([actions.len()]),
            Space::new(
                ExternalAction::TURN_RATE,
                SpaceKind::Real { low: -high, high },
                "the turn rate that it keeps until it decides again, positive to the left",
            ),
            Space::new(
                ExternalAction::VELOCITY,
                free,
                "the velocity through the air, east and north, to which it turns as fast as it can; its \
                 speed stays, so that the direction counts; not 0",
            )
            .with_shape([2]),
        ]
    }

    /// Returns the wish that is ordered.
    pub(super) fn external_action(&self, order: &Order<'_>) -> Option<ExternalAction> {
        let space = &self.teams.all()[order.team].action_spaces[order.space];
        ExternalAction::from_order(&space.name, order.values)
    }

    /// Notes an order until its airplane decides. After the end of its flight an airplane never does.
    pub(super) fn store_order(&self, state: &AirspaceState, order: &Order<'_>) {
        if let Some(wish) = self.external_action(order)
            && state.airplanes[order.agent as usize].is_flying()
        {
            state.set_external_action(order.agent, wish);
        }
    }

    /// Writes the observations of a team.
    pub(super) fn observe(
        &self,
        state: &AirspaceState,
        now: Cycle,
        team: usize,
        room: &mut [BufferMut<'_>],
    ) {
        let agents = &self.teams.all()[team].agents;
        let nothing = Observation::default();
        (0..agents.len()).for_each(|row| nothing.write(self, row, room));
        self.for_each_group(state, now, |turn, flown, intruders| {
            if flown.ids.iter().all(|slot| agents.binary_search(slot).is_err()) {
                return;
            }
            let known = |&slot: &Slot| known_aircraft(self, turn.state, now, slot);
            let flown: Vec<KnownAircraft> = flown.ids.iter().map(known).collect();
            let all = VisibleAircraft::from_group(turn, &flown, intruders);
            for own in &flown {
                if let Ok(row) = agents.binary_search(&own.slot) {
                    Observation::new(turn, own, &all).write(self, row, room);
                }
            }
        });
    }

    /// Calls `look` with the perceptions of each group in cycle `now`: its airplanes that decide, and those that mind
    /// no other. The cycle is started on a copy of the state, because orders that are due and airplanes that come in
    /// change the perceptions.
    pub(super) fn for_each_group(
        &self,
        state: &AirspaceState,
        now: Cycle,
        mut look: impl FnMut(&PhaseContext<'_>, &ControlledGroup, &[NonCooperative]),
    ) {
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let (clock, mut scratch) = (ManualClock::default(), Scratch::default());
        let turn = &mut PhaseContext {
            world: self,
            state: &copy,
            now,
            clock: &clock,
            scratch: &mut scratch,
        };
        let groups = join::groups(turn);
        let mut group = Vec::new();
        for leader in (0..self.airplanes.len() as Slot).filter(|&slot| groups.is_leader(slot)) {
            groups.members(leader, &mut group);
            group.retain(|&slot| copy.is_active(self, slot, now));
            group.sort_unstable();
            let flown = act::prepare(turn, &group);
            look(turn, &flown, &non_cooperative_aircraft(turn, &group));
        }
    }
}
