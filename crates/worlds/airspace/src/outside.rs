//! Airplanes as a caller sees them: their observations, and the orders for those that are decided
//! from outside.

mod percept;
#[cfg(test)]
mod tests;

use super::flight::Known;
use super::intruder::Intruder;
use super::join::Flown;
use super::perceive::{intruders, known};
use super::state::AirspaceState;
use super::wish::Wish;
use super::world::{AirspaceWorld, Method};
use super::{Scratch, Turn, act, join};
use percept::{Percept, Seen};
use sidestep_kernel::control::{Bounds, CellsMut, Order, Space, Team, Teams};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId, Slot, World};
use std::collections::BTreeMap;

impl AirspaceWorld {
    /// Returns the teams: airplanes that decide, and that turn alike. Those that mind no other are
    /// in none.
    pub(super) fn find_teams(&self) -> Teams {
        let mut places: BTreeMap<(usize, u64), usize> = BTreeMap::new();
        let mut alike: Vec<Vec<EntityId>> = Vec::new();
        for i in (0..self.airplanes.len()).filter(|&i| self.decides(i)) {
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
            let ordered = if is_external { self.ordered(first) } else { Vec::new() };
            let observed = percept::spaces(self, &agents);
            Team { name, agents, observed, ordered }
        };
        Teams::new(alike.into_iter().enumerate().map(team).collect(), Self::AGENT)
    }

    /// Returns the spaces of the orders that an airplane may be given.
    fn ordered(&self, i: usize) -> Vec<Space> {
        let actions = &self.actions[i];
        let numbered = actions.iter().enumerate().map(|(k, action)| format!("{k} {action}"));
        let meaning = format!(
            "its actions, the best first, each once: the shield takes the first that is safe; {}",
            numbered.collect::<Vec<_>>().join("; ")
        );
        let most = self.airplanes[i].model.omega_max_rad_s;
        let free = Bounds::Real { least: f64::NEG_INFINITY, most: f64::INFINITY };
        let ranks = Bounds::Whole { least: 0, most: actions.len() as i64 - 1 };
        vec![
            Space::new(Wish::RANKING, ranks, meaning).shaped([actions.len()]),
            Space::new(
                Wish::TURN_RATE,
                Bounds::Real { least: -most, most },
                "the turn rate that it keeps until it decides again, positive to the left",
            ),
            Space::new(
                Wish::VELOCITY,
                free,
                "the velocity through the air, east and north, to which it turns as fast as it can; its \
                 speed stays, so that the direction counts; not 0",
            )
            .shaped([2]),
        ]
    }

    /// Returns the wish that is ordered.
    pub(super) fn wish(&self, order: &Order<'_>) -> Option<Wish> {
        let space = &self.teams.all()[order.team].ordered[order.space];
        Wish::of(&space.name, order.values)
    }

    /// Notes an order until its airplane decides. After the end of its flight an airplane never does.
    pub(super) fn note_order(&self, state: &AirspaceState, order: &Order<'_>) {
        if let Some(wish) = self.wish(order)
            && state.airplanes[order.agent as usize].is_flying()
        {
            state.put_wish(order.agent, wish);
        }
    }

    /// Writes the observations of a team.
    pub(super) fn observe(
        &self,
        state: &AirspaceState,
        now: Cycle,
        team: usize,
        room: &mut [CellsMut<'_>],
    ) {
        let agents = &self.teams.all()[team].agents;
        let nothing = Percept::default();
        (0..agents.len()).for_each(|row| nothing.write(self, row, room));
        self.perceived(state, now, |turn, flown, intruders| {
            if flown.ids.iter().all(|slot| agents.binary_search(slot).is_err()) {
                return;
            }
            let known = |&slot: &Slot| known(self, turn.state, now, slot);
            let flown: Vec<Known> = flown.ids.iter().map(known).collect();
            let all = Seen::all(turn, &flown, intruders);
            for own in &flown {
                if let Ok(row) = agents.binary_search(&own.slot) {
                    Percept::of(turn, own, &all).write(self, row, room);
                }
            }
        });
    }

    /// Calls `look` with the perceptions of each group in cycle `now`: its airplanes that decide, and those that mind
    /// no other. The cycle is started on a copy of the state, because orders that are due and airplanes that come in
    /// change the perceptions.
    pub(super) fn perceived(
        &self,
        state: &AirspaceState,
        now: Cycle,
        mut look: impl FnMut(&Turn<'_>, &Flown, &[Intruder]),
    ) {
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let (clock, mut scratch) = (ManualClock::default(), Scratch::default());
        let turn =
            &mut Turn { world: self, state: &copy, now, clock: &clock, scratch: &mut scratch };
        let groups = join::groups(turn);
        let mut group = Vec::new();
        for leader in (0..self.airplanes.len() as Slot).filter(|&slot| groups.is_leader(slot)) {
            groups.members(leader, &mut group);
            group.retain(|&slot| copy.is_there(self, slot, now));
            group.sort_unstable();
            let flown = act::begin(turn, &group);
            look(turn, &flown, &intruders(turn, &group));
        }
    }
}
