//! The section of a network that may lose and delay messages.

use super::compile::Compiler;
use crate::flight::{AirplaneStart, FlightTask, TimeDiscretization};
use crate::settings::Deployment;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::network::{self, Network};
use sidestep_kernel::{EntityId, InputError};
use sidestep_scenario::network::{
    AgentNaming, SectionError, check_sides, check_unique, endless_s, time_window,
};

pub(super) type NetworkSection = sidestep_scenario::network::NetworkSection<AirplaneIdRange>;

/// A period in which an airplane's radio is dead: it sends nothing, hears nothing, and knows it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Silence")]
pub(super) struct RadioOutageSection {
    /// Id of the airplane.
    airplane: EntityId,
    /// Start of the silence, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the silence, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// A period in which no message gets from one side to another. Airplanes on no side hear all, and
/// are heard by all.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Partition")]
pub(super) struct PartitionSection {
    /// Ids of the airplanes on each side.
    sides: Vec<Vec<EntityId>>,
    /// Start of the partition, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the partition, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// A period in which a link works one way only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "OneWay")]
pub(super) struct UnidirectionalLinkSection {
    /// Id of the airplane that is heard by the other.
    sender: EntityId,
    /// Id of the airplane that the other does not hear.
    receiver: EntityId,
    /// Start of the period, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the period, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// The airplanes of a scenario, so many, with ids from 0 on.
#[derive(Debug)]
pub(super) struct AirplaneIdRange(usize);

impl AirplaneIdRange {
    /// Checks that airplanes exist.
    fn check(&self, ids: &[EntityId]) -> Result<(), SectionError> {
        match ids.iter().find(|&&id| id as usize >= self.0) {
            None => Ok(()),
            Some(id) => {
                let remedy = format!("give ids from 0 to {}", self.0 - 1);
                Err(SectionError::new(format!("airplane {id} does not exist"), remedy))
            }
        }
    }
}

impl AgentNaming for AirplaneIdRange {
    type RadioOutage = RadioOutageSection;
    type Partition = PartitionSection;
    type UnidirectionalLink = UnidirectionalLinkSection;

    const SHARES_RADIO: bool = true;
    const DEFAULT_LATENCY_S: f64 = 0.001;
    const MIN_LATENCY_S: f64 = 1e-6;
    const CONVERSATIONS_PER_CYCLE: u32 = 2;
    const MAX_DEADLINE_TEXT: &str = "at most half of dt_s: it holds for the optimization and again for the \
                                    shield's exchange";

    fn radio_senders(&self) -> Option<u32> {
        u32::try_from(self.0).ok()
    }

    fn radio_outage(&self, one: &RadioOutageSection) -> Result<network::RadioOutage, SectionError> {
        self.check(&[one.airplane])?;
        let window = time_window(one.from_s, one.until_s)?;
        Ok(network::RadioOutage { agent: one.airplane, window })
    }

    fn partition(&self, one: &PartitionSection) -> Result<network::NetworkPartition, SectionError> {
        self.check(&one.sides.concat())?;
        check_sides(&one.sides, "airplane")?;
        let window = time_window(one.from_s, one.until_s)?;
        Ok(network::NetworkPartition { sides: one.sides.clone(), window })
    }

    fn unidirectional_link(
        &self,
        one: &UnidirectionalLinkSection,
    ) -> Result<network::UnidirectionalLink, SectionError> {
        let UnidirectionalLinkSection { sender, receiver, from_s, until_s } = *one;
        self.check(&[sender, receiver])?;
        check_unique(vec![sender, receiver], "airplane")?;
        Ok(network::UnidirectionalLink { sender, receiver, window: time_window(from_s, until_s)? })
    }
}

impl Compiler<'_> {
    /// Returns the network, if the scenario has one.
    pub(super) fn network(
        &self,
        timing: &TimeDiscretization,
        airplanes: &[AirplaneStart],
    ) -> Result<Option<Network>, InputError> {
        let Some(section) = &self.file.airspace.network else { return Ok(None) };
        let error =
            |cause: &str, remedy: &str| Err(self.source.error(section.span(), cause, remedy));
        if self.file.airspace.deployment == Deployment::Direct {
            let cause = "a network, but one process decides for all (deployment = \"direct\")";
            let remedy = "set deployment to team, compact-team, replica-team, pim or hierarchical-pim, \
                          or leave [airspace.network] out";
            return error(cause, remedy);
        }
        // The stored orbits of others depend on speed and level.
        let orders_change_safety =
            airplanes.iter().flat_map(|airplane| &airplane.orders).any(|order| {
                order.task.speed_m_s().is_some()
                    || matches!(order.task, FlightTask::Altitude { .. })
            });
        if self.file.airspace.shield.0 && orders_change_safety {
            let cause = "orders of speed or level, over a network that is not to be relied on";
            let remedy = "nobody could be sure who knows of them: leave them out, or \
                          [airspace.network], or set shield = \"off\"";
            return error(cause, remedy);
        }
        let network = section.get_ref().network(timing.dt_s, &AirplaneIdRange(airplanes.len()));
        network.map(Some).map_err(|SectionError { span, cause, remedy }| {
            self.source.error(span.unwrap_or_else(|| section.span()), cause, remedy)
        })
    }
}
