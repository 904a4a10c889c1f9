//! The talks of a cycle: the parties to them, by deployment and method, and their outcomes.

use super::briefing::{certainty, filed, own_ship, scene};
use super::sight::Sight;
use crate::agents::contact::Contacts;
use crate::agents::coordinator::Host;
use crate::agents::exchange::{self, Agreed};
use crate::agents::grouping::{self, Found, Sighted};
use crate::agents::intent::{self, Intent};
use crate::agents::{
    Agent, Concludes, Conclusion, Ended, Endpoint, Optimizing, Outgoing, Party, Progress, Radio,
    Unsound, informed, sampling,
};
use crate::baseline::mvp::Resolving;
use crate::deploy::Deployment;
use crate::shield::Way;
use crate::world::AirspaceWorld;
use sidestep_collectives::Estimator;
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// The outcome of a talk.
pub(super) enum Came {
    /// The airplanes that decide together.
    Found(Found),
    /// The conclusion of an optimization.
    Decided(Conclusion),
    /// The intentions of all.
    Told(Vec<Option<Intent>>),
    /// The result of the shield's exchange.
    Agreed(Agreed),
}

impl From<Found> for Came {
    fn from(found: Found) -> Self {
        Self::Found(found)
    }
}

impl From<Conclusion> for Came {
    fn from(conclusion: Conclusion) -> Self {
        Self::Decided(conclusion)
    }
}

impl From<Vec<Option<Intent>>> for Came {
    fn from(told: Vec<Option<Intent>>) -> Self {
        Self::Told(told)
    }
}

impl From<Agreed> for Came {
    fn from(agreed: Agreed) -> Self {
        Self::Agreed(agreed)
    }
}

/// A party to a talk of any subject.
pub(super) type Speaker = dyn Concludes<Outcome = Came>;

/// A wrapper that turns the outcome of any party into [`Came`].
struct Any<P>(P);

impl<P: Party> Party for Any<P> {
    fn progress(&self) -> Progress {
        self.0.progress()
    }

    fn start(&mut self, tick: u64) {
        self.0.start(tick);
    }

    fn on_message(&mut self, from: EntityId, message: &[u8], tick: u64) -> Result<(), Unsound> {
        self.0.on_message(from, message, tick)
    }

    fn on_timer(&mut self, tick: u64) {
        self.0.on_timer(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        self.0.next_timer()
    }

    fn is_done(&self) -> bool {
        self.0.is_done()
    }

    fn take_messages(&mut self) -> Vec<Outgoing> {
        self.0.take_messages()
    }

    fn most_bytes(&self) -> usize {
        self.0.most_bytes()
    }
}

impl<P: Concludes<Outcome: Into<Came>>> Concludes for Any<P> {
    type Outcome = Came;

    fn end(&mut self) -> Ended<Came> {
        let Ended { outcome, unheard, late } = self.0.end();
        Ended { outcome: outcome.map(Into::into), unheard, late }
    }
}

fn endpoint<A>(agent: A, radio: Radio) -> Box<Speaker>
where
    A: Agent<Outcome: Into<Came>> + Send + 'static,
{
    Box::new(Any(Endpoint::new(agent, radio)))
}

/// Returns the party to a talk that finds the group.
pub(super) fn looks(
    world: &AirspaceWorld,
    sight: &Sight,
    contacts: &Contacts,
    radio: Radio,
) -> Box<Speaker> {
    let network = world.network.as_ref();
    let start = grouping::Start {
        me: radio.me,
        near: sight.group.clone(),
        intruders: sight.intruders.clone(),
        expected: expected(sight, contacts),
        airplanes: world.airplanes.len(),
        range_m: network.map_or(f64::INFINITY, |network| network.range_m),
        certainty: certainty(world),
    };
    endpoint(grouping::Agent::new(start), radio)
}

/// Returns whether each one of a group was heard lately, or is met for the first time.
fn expected(sight: &Sight, contacts: &Contacts) -> Vec<bool> {
    let is_expected =
        |id: EntityId| contacts.get(&id).is_none_or(|contact| contact.heard_in + 1 >= sight.cycle);
    sight.group.iter().map(|one| is_expected(one.id)).collect()
}

/// Returns the deployment's party to an optimization, among airplanes nearby that are `unheard`.
pub(super) fn optimizes(
    world: &AirspaceWorld,
    sight: &Sight,
    unheard: &[Sighted],
    contacts: &Contacts,
    radio: Radio,
) -> Box<Speaker> {
    let own = own_ship(world, sight, unheard, contacts);
    match (world.deployment, world.settings.estimator) {
        (Deployment::Pim | Deployment::HierarchicalPim, _) => {
            let is_hierarchy = world.deployment == Deployment::HierarchicalPim;
            Box::new(Any(Host::new(own, is_hierarchy, radio)))
        }
        (Deployment::Team, Estimator::Sampled { block, ageing }) => {
            endpoint(Optimizing::new(sampling::Agent::new(own, block, ageing)), radio)
        }
        (deployment, _) => {
            let by_model = deployment == Deployment::CompactTeam;
            endpoint(Optimizing::new(informed::Agent::new(own, by_model)), radio)
        }
    }
}

/// Returns the party to a talk in which all tell where they intend to fly.
pub(super) fn tells(
    world: &AirspaceWorld,
    sight: &Sight,
    contacts: &Contacts,
    resolving: &Resolving,
    radio: Radio,
) -> Box<Speaker> {
    let own = &sight.own;
    let start = intent::Start {
        me: radio.me,
        own: Intent {
            next: own.next,
            orders: own.orders,
            altitude_m: own.altitude_m,
            resolving: resolving.clone(),
        },
        filed: sight.group.iter().map(|one| filed(world, one.id)).collect(),
        airplanes: world.airplanes.len(),
        expected: expected(sight, contacts),
    };
    endpoint(intent::Agent::new(start), radio)
}

/// Returns the party to the shield's exchange of an airplane that may fly some ways.
pub(super) fn proposes(
    world: &AirspaceWorld,
    sight: &Sight,
    unheard: &[Sighted],
    contacts: &Contacts,
    ways: &[Way],
    radio: Radio,
) -> Box<Speaker> {
    let scene = Arc::new(scene(world, sight, unheard));
    endpoint(exchange::Agent::new(scene, radio.me, ways, contacts.clone()), radio)
}
