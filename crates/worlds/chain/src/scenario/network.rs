//! The section of a network that may lose and delay messages.

use super::{ChainScenarioCompiler, ChainSpec};
use crate::deploy::deployment::Deployment;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::network::{self, Network};
use sidestep_kernel::{EntityId, InputError};
use sidestep_scenario::network::{AgentNaming, SectionError, check_sides, endless_s, time_window};

pub(super) type NetworkSection = sidestep_scenario::network::NetworkSection<ChainConnectorCounts>;

/// A period in which a connector's radio is dead: it sends nothing, hears nothing, and knows it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Silence")]
pub(super) struct RadioOutageSection {
    /// Number of the connector in its chain.
    connector: u32,
    /// Number of the chain.
    #[serde(default)]
    chain: EntityId,
    /// Start of the silence, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the silence, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// A period in which no message gets from one side to another. Connectors on no side hear all, and are
/// heard by all.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Partition")]
pub(super) struct PartitionSection {
    /// Numbers of the connectors on each side.
    sides: Vec<Vec<u32>>,
    /// Number of the chain.
    #[serde(default)]
    chain: EntityId,
    /// Start of the partition, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the partition, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// A period in which a link between two neighbors works one way only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "OneWay")]
pub(super) struct UnidirectionalLinkSection {
    /// Number of the connector that is heard by the other.
    sender: u32,
    /// Number of its neighbor, which it does not hear.
    receiver: u32,
    /// Number of the chain.
    #[serde(default)]
    chain: EntityId,
    /// Start of that period, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of that period, in seconds after the start of the run; infinite unless given.
    #[serde(default = "endless_s")]
    until_s: f64,
}

/// The connectors of a scenario: their number in each chain. On the network they are counted on, chain
/// after chain.
#[derive(Debug)]
pub(super) struct ChainConnectorCounts(Vec<u32>);

impl ChainConnectorCounts {
    fn from_chains<const D: usize>(chains: &[ChainSpec<D>]) -> Self {
        Self(chains.iter().map(|spec| spec.start.points().len() as u32).collect())
    }

    /// Returns ids on the network, or which chain or connector does not exist.
    fn network_ids(
        &self,
        chain: EntityId,
        connectors: &[u32],
    ) -> Result<Vec<EntityId>, SectionError> {
        let Some((before, &[n, ..])) = self.0.split_at_checked(chain as usize) else {
            let cause = format!("chain {chain} does not exist");
            let last = self.0.len().max(1) - 1;
            return Err(SectionError::new(cause, format!("give numbers from 0 to {last}")));
        };
        if let Some(k) = connectors.iter().find(|&&k| k >= n) {
            let cause = format!("connector {k} does not exist in chain {chain}");
            return Err(SectionError::new(cause, format!("give numbers from 0 to {}", n - 1)));
        }
        let first_id: u32 = before.iter().sum();
        Ok(connectors.iter().map(|k| first_id + k).collect())
    }
}

impl AgentNaming for ChainConnectorCounts {
    type RadioOutage = RadioOutageSection;
    type Partition = PartitionSection;
    type UnidirectionalLink = UnidirectionalLinkSection;

    // That of a bus along the chain. A motion passes from connector to connector and back, which takes this time at
    // each of them, and all of it has to be over by the deadline in the cycle.
    const DEFAULT_LATENCY_S: f64 = 1e-5;
    const MIN_LATENCY_S: f64 = 1e-7;
    const CONVERSATIONS_PER_CYCLE: u32 = 1;
    const MAX_DEADLINE_TEXT: &str = "at most dt_s";

    fn radio_outage(&self, one: &RadioOutageSection) -> Result<network::RadioOutage, SectionError> {
        let agent = self.network_ids(one.chain, &[one.connector])?[0];
        Ok(network::RadioOutage { agent, window: time_window(one.from_s, one.until_s)? })
    }

    fn partition(&self, one: &PartitionSection) -> Result<network::NetworkPartition, SectionError> {
        let sides = one
            .sides
            .iter()
            .map(|side| self.network_ids(one.chain, side))
            .collect::<Result<_, _>>()?;
        check_sides(&one.sides, "connector")?;
        Ok(network::NetworkPartition { sides, window: time_window(one.from_s, one.until_s)? })
    }

    fn unidirectional_link(
        &self,
        one: &UnidirectionalLinkSection,
    ) -> Result<network::UnidirectionalLink, SectionError> {
        let UnidirectionalLinkSection { sender, receiver, chain, from_s, until_s } = *one;
        let ids = self.network_ids(chain, &[sender, receiver])?;
        if sender.abs_diff(receiver) != 1 {
            let cause = format!("connectors {sender} and {receiver} are no neighbors");
            let remedy = "only neighbors talk to each other: give numbers that differ by 1";
            return Err(SectionError::new(cause, remedy));
        }
        let window = time_window(from_s, until_s)?;
        Ok(network::UnidirectionalLink { sender: ids[0], receiver: ids[1], window })
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns the network, if the scenario has one.
    pub(super) fn network(
        &self,
        dt_s: f64,
        chains: &[ChainSpec<D>],
    ) -> Result<Option<Network>, InputError> {
        let Some(section) = &self.file.chain.network else { return Ok(None) };
        if self.file.chain.deployment == Deployment::Direct {
            let cause = "a network, but one process moves the chains (deployment = \"direct\")";
            let remedy = "set deployment = \"team\", or leave [chain.network] out";
            return Err(self.source.error(section.span(), cause, remedy));
        }
        let network = section.get_ref().network(dt_s, &ChainConnectorCounts::from_chains(chains));
        network.map(Some).map_err(|SectionError { span, cause, remedy }| {
            self.source.error(span.unwrap_or_else(|| section.span()), cause, remedy)
        })
    }
}
