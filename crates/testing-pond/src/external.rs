//! Frogs as a caller sees them: their observations, and the orders to those that take any.

use super::{Hop, PondState, PondWorld};
use sidestep_kernel::World;
use sidestep_kernel::control::{BufferMut, Space, SpaceKind, Team, Teams};

/// The order to hop.
pub(crate) const HOP: &str = "hop";

/// Returns the teams of a pond: one of all frogs, if they take orders.
pub(crate) fn teams(frogs: u32, pads: u32, is_external: bool) -> Teams {
    if !is_external {
        return Teams::default();
    }
    let last_pad = SpaceKind::Integer { low: 0, high: i64::from(pads) - 1 };
    let hops = SpaceKind::Discrete(Hop::NAMES.map(String::from).into());
    let team = Team {
        name: PondWorld::AGENT.into(),
        agents: (0..frogs).collect(),
        observation_spaces: vec![Space::new("pad", last_pad, "number of the pad under it")],
        action_spaces: vec![Space::new(HOP, hops, "the hop that it tries")],
    };
    Teams::new(vec![team], PondWorld::AGENT)
}

impl PondWorld {
    pub(crate) fn takes_orders(&self) -> bool {
        !self.teams.all().is_empty()
    }

    pub(crate) fn write_observations(&self, state: &PondState, buffers: &mut [BufferMut<'_>]) {
        for (frog, pad) in state.pad.iter().enumerate() {
            buffers[0].set_integer(frog, i64::from(pad));
        }
    }
}
