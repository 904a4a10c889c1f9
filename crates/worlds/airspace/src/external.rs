//! Airplanes as a caller sees them: their observations, and the orders for those that decide by method `external`.

mod observation;
#[cfg(test)]
mod tests;

use super::external_action::ExternalAction;
use super::flight::KnownAircraft;
use super::join::CooperativeGroup;
use super::method::MethodKind;
use super::perceive::known_aircraft;
use super::scratch::{PhaseContext, Scratch};
use super::state::AirspaceState;
use super::surveillance::PerceivedTraffic;
use super::world::AirspaceWorld;
use super::{act, join};
use observation::{AgentKnowledge, VisibleAircraft};
use sidestep_kernel::control::{AgentTeam, AgentTeams, BufferMut, Order, ValueDomain, ValueSpace};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, World};
use std::collections::BTreeMap;

impl AirspaceWorld {
    /// Returns the teams: airplanes that decide, with the same actions, because all agents of a team have the same
    /// spaces. Non-cooperative airplanes are in none.
    pub(super) fn teams_by_action_space(&self) -> AgentTeams {
        let mut team_by_turns: BTreeMap<(usize, u64), usize> = BTreeMap::new();
        let mut members: Vec<Vec<EntityId>> = Vec::new();
        for i in (0..self.airplanes.len()).filter(|&i| self.is_controlled(i)) {
            let model = &self.airplanes[i].model;
            let turns = (model.turns, model.omega_max_rad_s.to_bits());
            let team = *team_by_turns.entry(turns).or_insert(members.len());
            if team == members.len() {
                members.push(Vec::new());
            }
            members[team].push(i as EntityId);
        }
        let teams = members.into_iter().enumerate().map(|(k, agents)| self.build_team(k, agents));
        AgentTeams::new(teams.collect(), Self::AGENT)
    }

    /// Returns team `k`, the first of which is named like an airplane, because most worlds have no other.
    fn build_team(&self, k: usize, agents: Vec<EntityId>) -> AgentTeam {
        let name = if k == 0 { Self::AGENT.into() } else { format!("{} {}", Self::AGENT, k + 1) };
        let action_spaces = if matches!(self.method, MethodKind::External) {
            self.action_spaces(agents[0] as usize)
        } else {
            Vec::new()
        };
        let observation_spaces = observation::observation_spaces(self, &agents);
        AgentTeam { name, agents, observation_spaces, action_spaces }
    }

    /// Returns the spaces of the orders that an airplane may be given.
    fn action_spaces(&self, i: usize) -> Vec<ValueSpace> {
        let actions = &self.actions[i];
        let numbered = actions.iter().enumerate().map(|(k, action)| format!("{k} {action}"));
        let meaning = format!(
            "its actions, the best first, each once: the shield takes the first that is safe; {}",
            numbered.collect::<Vec<_>>().join("; ")
        );
        let high = self.airplanes[i].model.omega_max_rad_s;
        let free = ValueDomain::Real { low: f64::NEG_INFINITY, high: f64::INFINITY };
        let ranks = ValueDomain::Integer { low: 0, high: actions.len() as i64 - 1 };
        vec![
            ValueSpace::new(ExternalAction::RANKING, ranks, meaning).with_shape([actions.len()]),
            ValueSpace::new(
                ExternalAction::TURN_RATE,
                ValueDomain::Real { low: -high, high },
                "the turn rate that it keeps until it decides again, positive to the left",
            ),
            ValueSpace::new(
                ExternalAction::VELOCITY,
                free,
                "the velocity through the air, east and north, to which it turns as fast as it can; its \
                 speed stays, so that the direction counts; not 0",
            )
            .with_shape([2]),
        ]
    }

    /// Returns the action that is ordered.
    pub(super) fn external_action(&self, order: &Order<'_>) -> Option<ExternalAction> {
        let space = &self.teams.as_slice()[order.team].action_spaces[order.space];
        ExternalAction::from_order(&space.name, order.values)
    }

    /// Records an order until its airplane decides. After the end of its flight an airplane never does.
    pub(super) fn store_order(&self, state: &AirspaceState, order: &Order<'_>) {
        if let Some(action) = self.external_action(order)
            && state.airplanes[order.agent as usize].is_unfinished()
        {
            state.set_external_action(order.agent, action);
        }
    }

    /// Writes the observations of a team.
    pub(super) fn observe(
        &self,
        state: &AirspaceState,
        now: Cycle,
        team: usize,
        buffers: &mut [BufferMut<'_>],
    ) {
        let agents = &self.teams.as_slice()[team].agents;
        // Airplanes that decide in no group of this cycle keep this padding.
        let padding = AgentKnowledge::default();
        (0..agents.len()).for_each(|row| padding.write(self, row, buffers));
        self.for_each_group(state, now, |context, group, traffic| {
            if group.ids.iter().all(|slot| agents.binary_search(slot).is_err()) {
                return;
            }
            let members: Vec<KnownAircraft> = group
                .ids
                .iter()
                .map(|&slot| known_aircraft(self, context.state, now, slot))
                .collect();
            let all = VisibleAircraft::from_group(context, &members, &traffic.non_cooperative);
            for own in &members {
                if let Ok(row) = agents.binary_search(&own.slot) {
                    let tracked = VisibleAircraft::from_tracks(context, own.slot, traffic);
                    let others = tracked.as_deref().unwrap_or(&all);
                    AgentKnowledge::new(context, own, others).write(self, row, buffers);
                }
            }
        });
    }

    /// Calls `visit` with the percepts of each group in cycle `now`: its airplanes that decide, and the non-cooperative
    /// ones. The cycle is started on a copy of the state, because orders that are due and airplanes that enter change
    /// the percepts.
    pub(super) fn for_each_group(
        &self,
        state: &AirspaceState,
        now: Cycle,
        mut visit: impl FnMut(&PhaseContext<'_>, &CooperativeGroup, &PerceivedTraffic),
    ) {
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let clock = ManualClock::default();
        let mut scratch = Scratch::default();
        let context = &mut PhaseContext {
            world: self,
            state: &copy,
            now,
            clock: &clock,
            scratch: &mut scratch,
        };
        let groups = join::form_groups(context);
        let mut group = Vec::new();
        for leader in (0..self.airplanes.len() as EntitySlot).filter(|&slot| groups.is_leader(slot))
        {
            groups.members(leader, &mut group);
            group.retain(|&slot| copy.is_active(self, slot, now));
            group.sort_unstable();
            let controlled = act::prepare_decisions(context, &group);
            visit(context, &controlled, &PerceivedTraffic::new(context, &group));
        }
    }
}
