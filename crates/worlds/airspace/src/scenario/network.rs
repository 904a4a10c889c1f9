//! The section of a network that may lose and delay messages.

use super::compile::Compiler;
use crate::deploy::Deployment;
use crate::flight::Airplane;
use crate::flight::Timing;
use crate::flight::{FlightOrder, Task};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::network::{self, Network};
use sidestep_kernel::{EntityId, InputError};
use sidestep_scenario::network::{Names, Wrong, check_once, check_sides, during, for_ever};

pub(super) type NetworkSection = sidestep_scenario::network::NetworkSection<Airplanes>;

/// A period in which an airplane's radio is dead: it sends nothing, hears nothing, and knows it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Silence {
    /// Id of the airplane.
    airplane: EntityId,
    /// Start of the silence, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the silence, in seconds after the start of the run; infinite unless given.
    #[serde(default = "for_ever")]
    until_s: f64,
}

/// A period in which no message gets from one side to another. Airplanes on no side hear all, and
/// are heard by all.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Partition {
    /// Ids of the airplanes on each side.
    sides: Vec<Vec<EntityId>>,
    /// Start of the partition, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the partition, in seconds after the start of the run; infinite unless given.
    #[serde(default = "for_ever")]
    until_s: f64,
}

/// A period in which a link works one way only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct OneWay {
    /// Id of the airplane that is heard by the other.
    sender: EntityId,
    /// Id of the airplane that the other does not hear.
    receiver: EntityId,
    /// Start of the period, in seconds after the start of the run.
    #[serde(default)]
    from_s: f64,
    /// End of the period, in seconds after the start of the run; infinite unless given.
    #[serde(default = "for_ever")]
    until_s: f64,
}

/// The airplanes of a scenario, so many, with ids from 0 on.
#[derive(Debug)]
pub(super) struct Airplanes(usize);

impl Airplanes {
    /// Checks that airplanes exist.
    fn check(&self, ids: &[EntityId]) -> Result<(), Wrong> {
        match ids.iter().find(|&&id| id as usize >= self.0) {
            None => Ok(()),
            Some(id) => {
                let remedy = format!("give ids from 0 to {}", self.0 - 1);
                Err(Wrong::new(format!("airplane {id} does not exist"), remedy))
            }
        }
    }
}

impl Names for Airplanes {
    type Silence = Silence;
    type Partition = Partition;
    type OneWay = OneWay;

    const LATENCY_S: f64 = 0.001;
    const SHORTEST_LATENCY_S: f64 = 1e-6;
    const TALKS: u32 = 2;
    const LONGEST_DEADLINE: &str = "at most half of dt_s: it holds for the optimization and again for the \
                                    shield's exchange";

    fn silence(&self, one: &Silence) -> Result<network::Silence, Wrong> {
        self.check(&[one.airplane])?;
        let during = during(one.from_s, one.until_s)?;
        Ok(network::Silence { agent: one.airplane, during })
    }

    fn partition(&self, one: &Partition) -> Result<network::Partition, Wrong> {
        self.check(&one.sides.concat())?;
        check_sides(&one.sides, "airplane")?;
        let during = during(one.from_s, one.until_s)?;
        Ok(network::Partition { sides: one.sides.clone(), during })
    }

    fn one_way(&self, one: &OneWay) -> Result<network::OneWay, Wrong> {
        let OneWay { sender, receiver, from_s, until_s } = *one;
        self.check(&[sender, receiver])?;
        check_once(vec![sender, receiver], "airplane")?;
        Ok(network::OneWay { sender, receiver, during: during(from_s, until_s)? })
    }
}

impl Compiler<'_> {
    /// Returns the network, if the scenario has one.
    pub(super) fn network(
        &self,
        timing: &Timing,
        airplanes: &[Airplane],
    ) -> Result<Option<Network>, InputError> {
        let Some(section) = &self.file.airspace.network else { return Ok(None) };
        let error =
            |cause: &str, remedy: &str| Err(self.source.error(section.span(), cause, remedy));
        if self.file.airspace.deployment == Deployment::Direct {
            let cause = "a network, but one process decides for all (deployment = \"direct\")";
            let remedy = "set deployment to team, compact-team, pim or hierarchical-pim, \
                          or leave [airspace.network] out";
            return error(cause, remedy);
        }
        let changes =
            |order: &FlightOrder| matches!(order.task, Task::Speed(_) | Task::Altitude { .. });
        let orders_change_safety = airplanes.iter().any(|a| a.orders.iter().any(changes));
        if self.file.airspace.shield.0 && orders_change_safety {
            let cause = "orders of speed or level, over a network that is not to be relied on";
            let remedy = "nobody could be sure who knows of them: leave them out, or \
                          [airspace.network], or set shield = \"off\"";
            return error(cause, remedy);
        }
        let network = section.get_ref().network(timing.dt_s, &Airplanes(airplanes.len()));
        network.map(Some).map_err(|Wrong { span, cause, remedy }| {
            self.source.error(span.unwrap_or_else(|| section.span()), cause, remedy)
        })
    }
}
