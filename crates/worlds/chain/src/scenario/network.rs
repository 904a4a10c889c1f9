//! The section of a network that may lose and delay messages.

use super::{ChainSpec, Compiler};
use crate::agents::network::{Network, OneWay, Silence};
use crate::deploy::kind::Deployment;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_kernel::{EntityId, InputError};
use sidestep_scenario::{FromBelow, NonNegative, Number, Positive, Rule, Spanned};
use std::ops::Range;

/// Time that a packet takes, unless it is given, s: that of a bus along the chain.
const LATENCY_S: f64 = 1e-5;
/// Share of a cycle in which its talk ends, unless it is given.
const DEADLINE: f64 = 0.9;

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NetworkSection {
    loss: Option<Chance>,
    duplication: Option<Chance>,
    latency_s: Option<Number<Latency>>,
    max_delay_s: Option<NonNegative>,
    patience_s: Option<Positive>,
    deadline_s: Option<Positive>,
    silent: Vec<Spanned<Silence>>,
    one_way: Vec<Spanned<OneWay>>,
}

/// A probability below 1, because some messages must get through in the end.
type Chance = Number<FromBelow<0, 1>>;

/// A time above 0 that a clock can resolve.
#[derive(Debug, Clone, Copy)]
struct Latency;

impl Rule for Latency {
    fn allows(number: f64) -> bool {
        number >= 1e-7 && number.is_finite()
    }

    fn words() -> String {
        "at least 1e-7 s".into()
    }

    fn limits() -> Value {
        json!({ "minimum": 1e-7 })
    }
}

impl NetworkSection {
    fn network(&self, dt_s: f64) -> Network {
        let latency_s = self.latency_s.map_or(LATENCY_S, f64::from);
        let max_delay_s = self.max_delay_s.map_or(0.0, f64::from);
        Network {
            loss: self.loss.map_or(0.0, f64::from),
            duplication: self.duplication.map_or(0.0, f64::from),
            latency_s,
            max_delay_s,
            patience_s: self.patience_s.map_or(3.0 * (latency_s + max_delay_s), f64::from),
            deadline_s: self.deadline_s.map_or(DEADLINE * dt_s, f64::from),
            silences: self.silent.iter().map(|one| *one.get_ref()).collect(),
            one_ways: self.one_way.iter().map(|one| *one.get_ref()).collect(),
        }
    }

    /// Returns the first fault that is about connectors that do not exist, or at undefined times.
    fn wrong_fault<const D: usize>(&self, chains: &[ChainSpec<D>]) -> Option<Wrong> {
        let silent = self.silent.iter().map(|one| {
            let Silence { connector, chain, from_s, until_s } = *one.get_ref();
            (one.span(), wrong_ids(chain, &[connector], chains).or(wrong_while(from_s, until_s)))
        });
        let one_way = self.one_way.iter().map(|one| {
            let OneWay { sender, receiver, chain, from_s, until_s } = *one.get_ref();
            let wrong = wrong_ids(chain, &[sender, receiver], chains)
                .or(wrong_link(sender, receiver))
                .or(wrong_while(from_s, until_s));
            (one.span(), wrong)
        });
        silent.chain(one_way).find_map(|(span, words)| {
            let (cause, remedy) = words?;
            Some(Wrong { span, cause, remedy })
        })
    }
}

/// A fault of the scenario's network that makes no sense.
struct Wrong {
    span: Range<usize>,
    cause: String,
    remedy: String,
}

fn wrong_ids<const D: usize>(
    chain: EntityId,
    connectors: &[u32],
    chains: &[ChainSpec<D>],
) -> Option<(String, String)> {
    let Some(spec) = chains.get(chain as usize) else {
        let cause = format!("chain {chain} does not exist");
        return Some((cause, format!("give numbers from 0 to {}", chains.len().max(1) - 1)));
    };
    let n = spec.start.points().len();
    let k = connectors.iter().find(|&&k| k as usize >= n)?;
    let cause = format!("connector {k} does not exist in chain {chain}");
    Some((cause, format!("give numbers from 0 to {}", n - 1)))
}

fn wrong_link(sender: u32, receiver: u32) -> Option<(String, String)> {
    let cause = format!("connectors {sender} and {receiver} are no neighbors");
    let remedy = "only neighbors talk to each other: give numbers that differ by 1".into();
    (sender.abs_diff(receiver) != 1).then_some((cause, remedy))
}

/// Returns cause and remedy of a while that is none.
fn wrong_while(from_s: f64, until_s: f64) -> Option<(String, String)> {
    let is_right = from_s >= 0.0 && from_s.is_finite() && until_s > from_s;
    let cause = format!("from_s = {from_s}, until_s = {until_s}");
    let remedy = "give times in seconds from 0 on, the end after the start";
    (!is_right).then(|| (cause, remedy.into()))
}

impl<const D: usize> Compiler<'_, D> {
    /// Returns the network, if the scenario has one.
    pub(super) fn network(
        &self,
        dt_s: f64,
        chains: &[ChainSpec<D>],
    ) -> Result<Option<Network>, InputError> {
        let Some(section) = &self.file.chain.network else { return Ok(None) };
        let error =
            |cause: &str, remedy: &str| Err(self.source.error(section.span(), cause, remedy));
        if self.file.chain.deployment == Deployment::Direct {
            let cause = "a network, but one process moves the chains (deployment = \"direct\")";
            return error(cause, "set deployment = \"team\", or leave [chain.network] out");
        }
        let network = section.get_ref().network(dt_s);
        if let Some((cause, remedy)) = wrong_times(&network, dt_s) {
            return error(&cause, remedy);
        }
        match section.get_ref().wrong_fault(chains) {
            Some(Wrong { span, cause, remedy }) => {
                Err(self.source.error(Some(span), cause, remedy))
            }
            None => Ok(Some(network)),
        }
    }
}

/// Returns cause and remedy of times that do not fit into a cycle.
fn wrong_times(n: &Network, dt_s: f64) -> Option<(String, &'static str)> {
    let waits_s = n.patience_s.max(n.latency_s + n.max_delay_s);
    if n.deadline_s <= dt_s && 8.0 * waits_s <= n.deadline_s {
        return None;
    }
    let cause = format!(
        "latency_s = {}, max_delay_s = {}, patience_s = {}, deadline_s = {}",
        n.latency_s, n.max_delay_s, n.patience_s, n.deadline_s
    );
    let remedy = "give a patience of at most an eighth of the deadline, latency and delay of no \
                  more, and a deadline of at most dt_s";
    Some((cause, remedy))
}
