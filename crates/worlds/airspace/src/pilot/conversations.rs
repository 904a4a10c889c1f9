//! The talks of a cycle: the parties to them, by deployment and method, and their outcomes.

use super::common_knowledge::{exchange_setup, filed_flight, ownship, plan_certainty};
use super::percept::Percept;
use crate::agents::coordinator::HostParticipant;
use crate::agents::exchange::{self, ExchangeResult};
use crate::agents::grouping::{self, GroupingResult, SurveillanceReport};
use crate::agents::intent::{self, Intent};
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{
    Agent, ConversationEnd, Endpoint, EndpointConfig, InvalidMessage, OptimizationResult,
    OptimizingAgent, OutgoingMessage, Participant, Progress, WithOutcome, informed, sampling,
};
use crate::baseline::mvp::ActiveResolutions;
use crate::settings::Deployment;
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;
use sidestep_collectives::Estimator;
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// The outcome of a talk.
pub(super) enum ConversationOutcome {
    /// The airplanes that decide together.
    Grouping(GroupingResult),
    /// The conclusion of an optimization.
    Optimization(OptimizationResult),
    /// The intentions of all.
    Intents(Vec<Option<Intent>>),
    /// The result of the shield's exchange.
    Exchange(ExchangeResult),
}

impl From<GroupingResult> for ConversationOutcome {
    fn from(found: GroupingResult) -> Self {
        Self::Grouping(found)
    }
}

impl From<OptimizationResult> for ConversationOutcome {
    fn from(conclusion: OptimizationResult) -> Self {
        Self::Optimization(conclusion)
    }
}

impl From<Vec<Option<Intent>>> for ConversationOutcome {
    fn from(told: Vec<Option<Intent>>) -> Self {
        Self::Intents(told)
    }
}

impl From<ExchangeResult> for ConversationOutcome {
    fn from(agreed: ExchangeResult) -> Self {
        Self::Exchange(agreed)
    }
}

/// A party to a talk of any subject.
pub(super) type DynParticipant = dyn WithOutcome<Outcome = ConversationOutcome>;

/// A wrapper that turns the outcome of any party into [`ConversationOutcome`].
struct ErasedParticipant<P>(P);

impl<P: Participant> Participant for ErasedParticipant<P> {
    fn progress(&self) -> Progress {
        self.0.progress()
    }

    fn start(&mut self, tick: u64) {
        self.0.start(tick);
    }

    fn on_message(
        &mut self,
        from: EntityId,
        message: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage> {
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

    fn take_messages(&mut self) -> Vec<OutgoingMessage> {
        self.0.take_messages()
    }

    fn max_message_bytes(&self) -> usize {
        self.0.max_message_bytes()
    }
}

impl<P: WithOutcome<Outcome: Into<ConversationOutcome>>> WithOutcome for ErasedParticipant<P> {
    type Outcome = ConversationOutcome;

    fn finish(&mut self) -> ConversationEnd<ConversationOutcome> {
        let ConversationEnd { outcome, unheard, late } = self.0.finish();
        ConversationEnd { outcome: outcome.map(Into::into), unheard, late }
    }
}

fn endpoint<A>(agent: A, radio: EndpointConfig) -> Box<DynParticipant>
where
    A: Agent<Outcome: Into<ConversationOutcome>> + Send + 'static,
{
    Box::new(ErasedParticipant(Endpoint::new(agent, radio)))
}

/// Returns the party to a talk that finds the group.
pub(super) fn grouping_participant(
    world: &AirspaceWorld,
    sight: &Percept,
    contacts: &TrafficPicture,
    radio: EndpointConfig,
) -> Box<DynParticipant> {
    let network = world.network.as_ref();
    let start = grouping::GroupingInput {
        me: radio.me,
        near: sight.group.clone(),
        intruders: sight.intruders.clone(),
        expected: expected_members(sight, contacts),
        airplanes: world.airplanes.len(),
        range_m: network.map_or(f64::INFINITY, |network| network.range_m),
        certainty: plan_certainty(world),
    };
    endpoint(grouping::GroupingAgent::new(start), radio)
}

/// Returns whether each one of a group was heard lately, or is met for the first time.
fn expected_members(sight: &Percept, contacts: &TrafficPicture) -> Vec<bool> {
    let is_expected =
        |id: EntityId| contacts.get(&id).is_none_or(|contact| contact.heard_in + 1 >= sight.cycle);
    sight.group.iter().map(|one| is_expected(one.id)).collect()
}

/// Returns the deployment's party to an optimization, among airplanes nearby that are `unheard`.
pub(super) fn optimization_participant(
    world: &AirspaceWorld,
    sight: &Percept,
    unheard: &[SurveillanceReport],
    contacts: &TrafficPicture,
    radio: EndpointConfig,
) -> Box<DynParticipant> {
    let own = ownship(world, sight, unheard, contacts);
    match (world.deployment, world.settings.estimator) {
        (Deployment::Pim | Deployment::HierarchicalPim, _) => {
            let is_hierarchy = world.deployment == Deployment::HierarchicalPim;
            Box::new(ErasedParticipant(HostParticipant::new(own, is_hierarchy, radio)))
        }
        (Deployment::Team, Estimator::Sampled { block, ageing }) => {
            endpoint(OptimizingAgent::new(sampling::SamplingAgent::new(own, block, ageing)), radio)
        }
        (deployment, _) => {
            let by_model = deployment == Deployment::CompactTeam;
            endpoint(OptimizingAgent::new(informed::InformedAgent::new(own, by_model)), radio)
        }
    }
}

/// Returns the party to a talk in which all tell where they intend to fly.
pub(super) fn intent_participant(
    world: &AirspaceWorld,
    sight: &Percept,
    contacts: &TrafficPicture,
    resolving: &ActiveResolutions,
    radio: EndpointConfig,
) -> Box<DynParticipant> {
    let own = &sight.own;
    let start = intent::IntentInput {
        me: radio.me,
        own: Intent {
            next: own.next,
            orders: own.orders,
            altitude_m: own.altitude_m,
            resolving: resolving.clone(),
        },
        filed: sight.group.iter().map(|one| filed_flight(world, one.id)).collect(),
        airplanes: world.airplanes.len(),
        expected: expected_members(sight, contacts),
    };
    endpoint(intent::IntentAgent::new(start), radio)
}

/// Returns the party to the shield's exchange of an airplane that may fly some ways.
pub(super) fn exchange_participant(
    world: &AirspaceWorld,
    sight: &Percept,
    unheard: &[SurveillanceReport],
    contacts: &TrafficPicture,
    ways: &[TurnProfile],
    radio: EndpointConfig,
) -> Box<DynParticipant> {
    let scene = Arc::new(exchange_setup(world, sight, unheard));
    endpoint(exchange::ExchangeAgent::new(scene, radio.me, ways, contacts.clone()), radio)
}
