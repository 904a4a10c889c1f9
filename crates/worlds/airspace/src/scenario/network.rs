//! The section of a network that is not to be relied on.

use super::super::agents::network::{Network, Silence};
use super::super::deploy::Deployment;
use super::super::flight::{Airplane, FlightOrder, Task, Timing};
use super::Compiler;
use serde::Deserialize;
use sidestep_kernel::InputError;

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NetworkSection {
    loss: f64,
    duplication: f64,
    latency_s: Option<f64>,
    max_delay_s: f64,
    patience_s: Option<f64>,
    deadline_s: Option<f64>,
    silent: Vec<Silence>,
}

impl Compiler<'_> {
    /// The network, if the scenario has one.
    pub(super) fn network(
        &self,
        timing: &Timing,
        airplanes: &[Airplane],
    ) -> Result<Option<Network>, InputError> {
        let changes =
            |order: &FlightOrder| matches!(order.task, Task::Speed(_) | Task::Altitude { .. });
        let orders_change_safety = airplanes.iter().any(|a| a.orders.iter().any(changes));
        let airplanes = airplanes.len();
        let Some(section) = &self.file.airspace.network else { return Ok(None) };
        let at = || Some(section.span());
        let s = section.get_ref();
        if self.file.airspace.deployment == Deployment::Direct {
            let cause = "a network, but one process decides for all (deployment = \"direct\")";
            let remedy = "set deployment to team, compact-team, pim or hierarchical-pim, \
                          or leave [airspace.network] out";
            return Err(self.error(at(), cause, remedy));
        }
        if self.has_shield()? && orders_change_safety {
            let cause = "orders of speed or level, over a network that is not to be relied on";
            let remedy = "nobody could be sure who knows of them: leave them out, or \
                          [airspace.network], or set shield = \"off\"";
            return Err(self.error(at(), cause, remedy));
        }
        let latency_s = s.latency_s.unwrap_or(0.001);
        let network = Network {
            loss: s.loss,
            duplication: s.duplication,
            latency_s,
            max_delay_s: s.max_delay_s,
            patience_s: s.patience_s.unwrap_or(3.0 * (latency_s + s.max_delay_s)),
            deadline_s: s.deadline_s.unwrap_or(0.45 * timing.dt_s),
            silences: s.silent.clone(),
        };
        let chances = [("loss", s.loss), ("duplication", s.duplication)];
        if let Some((name, p)) = chances.iter().find(|(_, p)| !(0.0..1.0).contains(p)) {
            let cause = format!("{name} = {p} is no probability below 1");
            return Err(self.error(at(), cause, "give 0 or more and less than 1"));
        }
        let times = [latency_s, network.patience_s, network.deadline_s];
        let sane = times.iter().all(|t| *t > 0.0 && t.is_finite()) && s.max_delay_s >= 0.0;
        let fits = 2.0 * network.deadline_s <= timing.dt_s
            && 8.0 * network.patience_s.max(latency_s + s.max_delay_s) <= network.deadline_s;
        if !(sane && fits && latency_s >= 1e-6 && s.max_delay_s.is_finite()) {
            let cause = format!(
                "latency_s = {latency_s}, max_delay_s = {}, patience_s = {}, deadline_s = {}",
                s.max_delay_s, network.patience_s, network.deadline_s
            );
            let remedy = "give times above 0 (latency at least 1e-6, delay 0 or more), a patience of at \
                          most an eighth of the deadline, and a deadline of at most half of dt_s: it holds for \
                          the optimization and again for the shield's exchange";
            return Err(self.error(at(), cause, remedy));
        }
        if let Some(wrong) = s.silent.iter().find(|one| {
            one.airplane as usize >= airplanes || one.from_s.is_nan() || one.until_s.is_nan()
        }) {
            let cause = format!("airplane {} is to be silent", wrong.airplane);
            let remedy = format!("give ids from 0 to {} and times in seconds", airplanes - 1);
            return Err(self.error(at(), cause, remedy));
        }
        Ok(Some(network))
    }
}
