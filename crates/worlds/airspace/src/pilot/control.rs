//! Controls: the maneuver of an airplane in a cycle, and the outcome of its conversations.

use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{ActionChoice, ReachedCost};
use crate::baseline::mvp::ActiveResolutions;
use crate::decide::ManeuverCandidates;
use crate::events::Event;
use crate::flight::MethodCommand;
use crate::shield::{CommonPlan, Fallback, ShieldDecision, TurnProfile};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};

/// The motion of an airplane in a cycle, and everything else that its run keeps of the decision: one message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AirplaneControl {
    /// Id of the airplane that flies.
    pub id: EntityId,
    /// The cycle in which it flies so.
    pub cycle: Cycle,
    /// What it flies in the cycle.
    pub maneuver: Maneuver,
    /// Outcome of the optimization; none where there was nothing to optimize.
    pub optimized: Option<OptimizationStatus>,
    /// Packets of the conversation that finds the group; none where groups are announced.
    pub grouping: NetworkTraffic,
    /// Packets of the conversation in which candidates are chosen.
    pub deciding: NetworkTraffic,
    /// Packets of the shield's exchange.
    pub shielding: NetworkTraffic,
    /// Others that it no longer hears, deadlines missed, and the like.
    pub events: Vec<Event>,
    /// What it remembers in the next cycle.
    pub memory: PilotMemory,
}

/// What an airplane flies for one `dt`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Maneuver {
    /// A profile of its choice, and a fallback after it.
    Profile {
        /// Number of the profile among its candidates: 0 for the preferred one.
        candidate: u32,
        /// Turn rate in each step.
        profile: TurnProfile,
        /// The fallback that it stores for the end of the profile.
        fallback: Fallback,
        /// Whether this is the plan that all compute for it, so that all who see it know its fallback.
        is_common: bool,
    },
    /// Its stored fallback.
    Orbit,
}

/// Outcome of an optimization for an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct OptimizationStatus {
    /// Whether a decision has reached it.
    pub is_decided: bool,
    /// Number of rounds; 0 if no decision has reached it.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
    /// The chosen action, by its number; 0 if no decision has reached it.
    pub chosen: u32,
    /// The cost of the joint action, where the airplane knows it.
    pub reached: Option<ReachedCost>,
}

/// The memory of an airplane from one cycle to the next.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PilotMemory {
    /// Its knowledge of others; empty where the network is reliable.
    pub contacts: TrafficPicture,
    /// The conflicts that it resolves; empty unless the method is MVP.
    pub resolving: ActiveResolutions,
    /// What its method has commanded last; nothing unless it commands levels or speeds.
    pub command: MethodCommand,
}

impl PilotMemory {
    /// Lets the method know of a maneuver that is not the one that it prefers.
    pub(crate) fn record_maneuver(&mut self, maneuver: &Maneuver) {
        if !maneuver.is_preferred() {
            self.resolving.record_override();
        }
    }
}

impl Maneuver {
    fn is_preferred(&self) -> bool {
        matches!(self, Self::Profile { candidate: 0, .. })
    }

    /// Returns the maneuver that follows from the shield's decision about candidates.
    pub(crate) fn from_decision(decision: ShieldDecision, candidates: &ManeuverCandidates) -> Self {
        match decision.candidate {
            Some(candidate) => Self::Profile {
                candidate: candidate as u32,
                profile: candidates.profiles[candidate].clone(),
                fallback: decision.fallback,
                is_common: false,
            },
            None => Self::Orbit,
        }
    }

    /// Returns the plan that all compute for an airplane as a maneuver.
    pub(crate) fn from_common_plan(plan: CommonPlan) -> Self {
        let CommonPlan { candidate, profile, fallback } = plan;
        Self::Profile { candidate, profile, fallback, is_common: true }
    }

    /// Returns the maneuver as a decision of the shield; `stored` is the stored fallback.
    pub(crate) fn to_shield_decision(&self, stored: Fallback) -> ShieldDecision {
        match *self {
            Self::Profile { candidate, fallback, .. } => {
                let candidate = Some(candidate as usize);
                ShieldDecision { candidate, ..ShieldDecision::from_fallback(fallback) }
            }
            Self::Orbit => ShieldDecision::from_fallback(stored),
        }
    }
}

impl OptimizationStatus {
    /// Returns the outcome with a decision, or without one.
    pub(crate) fn from_choice(decided: Option<&ActionChoice>) -> Self {
        match decided {
            Some(ActionChoice { rounds, converged, chosen, reached, .. }) => Self {
                is_decided: true,
                rounds: *rounds,
                converged: *converged,
                chosen: *chosen as u32,
                reached: *reached,
            },
            None => Self::default(),
        }
    }
}

impl AirplaneControl {
    /// Returns a control by which an airplane stays on its fallback: what it flies unless something else is decided.
    pub(crate) fn stay_on_orbit(id: EntityId, cycle: Cycle, memory: PilotMemory) -> Self {
        Self {
            id,
            cycle,
            maneuver: Maneuver::Orbit,
            optimized: None,
            grouping: NetworkTraffic::default(),
            deciding: NetworkTraffic::default(),
            shielding: NetworkTraffic::default(),
            events: Vec::new(),
            memory,
        }
    }
}
