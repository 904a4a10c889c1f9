//! Frogs as a caller sees them: their observations, and the orders to those that take any.

use super::{Hop, PondState, PondWorld};
use sidestep_kernel::World;
use sidestep_kernel::control::{AgentTeam, AgentTeams, BufferMut, ValueDomain, ValueSpace};

/// The order to hop.
pub(crate) const HOP: &str = "hop";

/// Returns the teams of a pond: one of all frogs, if they take orders.
pub(crate) fn teams(frogs: u32, pads: u32, is_external: bool) -> AgentTeams {
    if !is_external {
        return AgentTeams::default();
    }
    let last_pad = ValueDomain::Integer { low: 0, high: i64::from(pads) - 1 };
    let hops = ValueDomain::Discrete(Hop::NAMES.map(String::from).into());
    let team = AgentTeam {
        name: PondWorld::AGENT.into(),
        agents: (0..frogs).collect(),
        observation_spaces: vec![ValueSpace::new("pad", last_pad, "number of the pad under it")],
        action_spaces: vec![ValueSpace::new(HOP, hops, "the hop that it tries")],
    };
    AgentTeams::new(vec![team], PondWorld::AGENT)
}

impl PondWorld {
    pub(crate) fn takes_orders(&self) -> bool {
        !self.teams.as_slice().is_empty()
    }

    pub(crate) fn write_observations(&self, state: &PondState, buffers: &mut [BufferMut<'_>]) {
        for (frog, pad) in state.pad.iter().enumerate() {
            buffers[0].set_integer(frog, i64::from(pad));
        }
    }
}
