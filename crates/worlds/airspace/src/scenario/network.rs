//! The section of a network that may lose and delay messages.

use super::compile::Compiler;
use crate::agents::network::{Network, Silence};
use crate::deploy::Deployment;
use crate::flight::Airplane;
use crate::flight::Timing;
use crate::flight::{FlightOrder, Task};
use serde::Deserialize;
use sidestep_kernel::InputError;
use sidestep_scenario::{FromBelow, NonNegative, Number, Positive, Rule};

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NetworkSection {
    loss: Option<Chance>,
    duplication: Option<Chance>,
    latency_s: Option<Number<Latency>>,
    max_delay_s: Option<NonNegative>,
    patience_s: Option<Positive>,
    deadline_s: Option<Positive>,
    silent: Vec<Silence>,
}

/// A probability below 1, because some messages must get through in the end.
type Chance = Number<FromBelow<0, 1>>;

/// A time above 0 that a clock can resolve.
#[derive(Debug, Clone, Copy)]
struct Latency;

impl Rule for Latency {
    fn allows(number: f64) -> bool {
        number >= 1e-6 && number.is_finite()
    }

    fn words() -> String {
        "at least 1e-6 s".into()
    }
}

impl NetworkSection {
    fn network(&self, timing: &Timing) -> Network {
        let latency_s = self.latency_s.map_or(0.001, f64::from);
        let max_delay_s = self.max_delay_s.map_or(0.0, f64::from);
        Network {
            loss: self.loss.map_or(0.0, f64::from),
            duplication: self.duplication.map_or(0.0, f64::from),
            latency_s,
            max_delay_s,
            patience_s: self.patience_s.map_or(3.0 * (latency_s + max_delay_s), f64::from),
            deadline_s: self.deadline_s.map_or(0.45 * timing.dt_s, f64::from),
            silences: self.silent.clone(),
        }
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
        let network = section.get_ref().network(timing);
        match wrong_times(&network, timing).or_else(|| wrong_silence(&network, airplanes.len())) {
            None => Ok(Some(network)),
            Some((cause, remedy)) => error(&cause, &remedy),
        }
    }
}

/// Returns cause and remedy of times that do not fit into a cycle.
fn wrong_times(n: &Network, timing: &Timing) -> Option<(String, String)> {
    let waits_s = n.patience_s.max(n.latency_s + n.max_delay_s);
    if 2.0 * n.deadline_s <= timing.dt_s && 8.0 * waits_s <= n.deadline_s {
        return None;
    }
    let cause = format!(
        "latency_s = {}, max_delay_s = {}, patience_s = {}, deadline_s = {}",
        n.latency_s, n.max_delay_s, n.patience_s, n.deadline_s
    );
    let remedy = "give a patience of at most an eighth of the deadline, latency and delay of no \
                  more, and a deadline of at most half of dt_s: it holds for the optimization and \
                  again for the shield's exchange";
    Some((cause, remedy.into()))
}

/// Returns cause and remedy of a silence of an airplane that does not exist, or at undefined times.
fn wrong_silence(network: &Network, airplanes: usize) -> Option<(String, String)> {
    let wrong = network.silences.iter().find(|one| {
        let is_a_while = one.from_s >= 0.0 && one.from_s < one.until_s;
        one.airplane as usize >= airplanes || !is_a_while
    })?;
    let Silence { airplane, from_s, until_s } = wrong;
    let cause = format!("airplane {airplane} is to be silent from {from_s} s until {until_s} s");
    let last = airplanes - 1;
    Some((
        cause,
        format!("give ids from 0 to {last}, from_s of at least 0, and until_s after from_s"),
    ))
}
