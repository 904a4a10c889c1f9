//! The conversations of a cycle: the participants of them, by deployment and method, and their outcomes.

use super::common_knowledge::{filed_flight, ownship, plan_certainty, shield_exchange_setup};
use super::common_plans::CommonPlans;
use super::percept::Percept;
use crate::agents::coordinator::CoordinatorHostParticipant;
use crate::agents::exchange::{self, ShieldExchangeResult};
use crate::agents::grouping::{self, GroupingResult, SurveillanceReport};
use crate::agents::intent::{self, Intent};
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{
    ConversationEnd, ConversationProgress, EndpointConfig, FinishableParticipant, InvalidMessage,
    OptimizationResult, OptimizingAgent, OutgoingMessage, Participant, ProtocolAgent,
    ReliableEndpoint, prediction_sharing, sampling,
};
use crate::baseline::mvp::ActiveResolutions;
use crate::settings::Deployment;
use crate::shield::TurnProfile;
use crate::world::AirspaceWorld;
use sidestep_collectives::Estimator;
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// The outcome of a conversation of any subject.
pub(super) enum ConversationOutcome {
    /// The airplanes that decide together.
    Grouping(GroupingResult),
    /// The conclusion of an optimization.
    Optimization(OptimizationResult),
    /// The intentions of the group by place; `None` for one that was not heard.
    Intents(Vec<Option<Intent>>),
    /// The result of the shield's exchange.
    Exchange(ShieldExchangeResult),
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

impl From<ShieldExchangeResult> for ConversationOutcome {
    fn from(agreed: ShieldExchangeResult) -> Self {
        Self::Exchange(agreed)
    }
}

/// A participant of any kind, so that a pilot can hold the present one.
pub(super) type DynParticipant = dyn FinishableParticipant<Outcome = ConversationOutcome>;

/// A wrapper that turns the outcome of any participant into [`ConversationOutcome`].
struct ErasedParticipant<P>(P);

impl<P: Participant> Participant for ErasedParticipant<P> {
    fn progress(&self) -> ConversationProgress {
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

impl<P: FinishableParticipant<Outcome: Into<ConversationOutcome>>> FinishableParticipant
    for ErasedParticipant<P>
{
    type Outcome = ConversationOutcome;

    fn finish(&mut self) -> ConversationEnd<ConversationOutcome> {
        let ConversationEnd { outcome, unheard, late } = self.0.finish();
        ConversationEnd { outcome: outcome.map(Into::into), unheard, late }
    }
}

/// What an airplane knows at the start of a conversation.
#[derive(Clone, Copy)]
pub(super) struct PilotKnowledge<'a> {
    pub(super) world: &'a AirspaceWorld,
    pub(super) percept: &'a Percept,
    /// Airplanes nearby that are not in its group.
    pub(super) unheard: &'a [SurveillanceReport],
    /// Its knowledge of others from earlier cycles.
    pub(super) contacts: &'a TrafficPicture,
    /// The plans that all compute.
    pub(super) plans: &'a CommonPlans,
}

fn new_endpoint_participant<A>(agent: A, config: EndpointConfig) -> Box<DynParticipant>
where
    A: ProtocolAgent<Outcome: Into<ConversationOutcome>> + Send + 'static,
{
    Box::new(ErasedParticipant(ReliableEndpoint::new(agent, config)))
}

/// Returns the participant that finds an airplane's group among those near it.
pub(super) fn grouping_participant(
    world: &AirspaceWorld,
    percept: &Percept,
    contacts: &TrafficPicture,
    config: EndpointConfig,
) -> Box<DynParticipant> {
    let network = world.network.as_ref();
    let start = grouping::GroupingInput {
        me: config.me,
        near: percept.group.clone(),
        non_cooperative: percept.non_cooperative.clone(),
        expected: expected_members(percept, contacts),
        airplanes: world.airplanes.len(),
        command_limits: Arc::clone(&world.command_limits),
        surface: world.surface,
        range_m: network.map_or(f64::INFINITY, |network| network.range_m),
        certainty: plan_certainty(world),
    };
    new_endpoint_participant(grouping::GroupingAgent::new(start), config)
}

/// Returns whether each one of a group was heard lately, or is met for the first time.
fn expected_members(percept: &Percept, contacts: &TrafficPicture) -> Vec<bool> {
    percept
        .group
        .iter()
        .map(|one| {
            contacts.get(&one.id).is_none_or(|contact| contact.heard_in + 1 >= percept.cycle)
        })
        .collect()
}

/// Returns the deployment's participant of an optimization.
pub(super) fn optimization_participant(
    knowledge: PilotKnowledge<'_>,
    config: EndpointConfig,
) -> Box<DynParticipant> {
    let PilotKnowledge { world, percept, unheard, contacts, .. } = knowledge;
    let own = ownship(world, percept, unheard, contacts);
    match (world.deployment, world.settings.estimator) {
        (Deployment::Pim | Deployment::HierarchicalPim, _) => {
            let is_hierarchy = world.deployment == Deployment::HierarchicalPim;
            Box::new(ErasedParticipant(CoordinatorHostParticipant::new(own, is_hierarchy, config)))
        }
        (Deployment::Team, Estimator::Sampled { block, ageing }) => new_endpoint_participant(
            OptimizingAgent::new(sampling::SamplingAgent::new(own, block, ageing)),
            config,
        ),
        (deployment, _) => {
            let by_model = deployment == Deployment::CompactTeam;
            new_endpoint_participant(
                OptimizingAgent::new(prediction_sharing::PredictionSharingAgent::new(
                    own, by_model,
                )),
                config,
            )
        }
    }
}

/// Returns the participant of a conversation in which all tell where they intend to fly.
pub(super) fn intent_participant(
    world: &AirspaceWorld,
    percept: &Percept,
    contacts: &TrafficPicture,
    resolving: &ActiveResolutions,
    config: EndpointConfig,
) -> Box<DynParticipant> {
    let own = &percept.own;
    let start = intent::IntentInput {
        me: config.me,
        own: Intent {
            next: own.next,
            orders: own.orders,
            altitude_m: own.altitude_m,
            resolving: resolving.clone(),
        },
        filed: percept.group.iter().map(|one| filed_flight(world, one.id)).collect(),
        airplanes: world.airplanes.len(),
        expected: expected_members(percept, contacts),
    };
    new_endpoint_participant(intent::IntentExchangeAgent::new(start), config)
}

/// Returns the participant of the shield's exchange for an airplane that may fly some profiles.
pub(super) fn shield_exchange_participant(
    knowledge: PilotKnowledge<'_>,
    profiles: &[TurnProfile],
    config: EndpointConfig,
) -> Box<DynParticipant> {
    let PilotKnowledge { world, percept, unheard, contacts, plans } = knowledge;
    let plans = plans.of_group(world, percept);
    let scene = Arc::new(shield_exchange_setup(world, percept, unheard, plans));
    new_endpoint_participant(
        exchange::ShieldExchangeAgent::new(scene, config.me, profiles, contacts.clone()),
        config,
    )
}
