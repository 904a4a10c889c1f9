//! The section of a network that may lose and delay messages.

use super::compile::Compiler;
use crate::agents::network::{Bursts, Network, OneWay, Partition, Silence};
use crate::deploy::Deployment;
use crate::flight::Airplane;
use crate::flight::Timing;
use crate::flight::{FlightOrder, Task};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_kernel::{EntityId, InputError};
use sidestep_scenario::{FromBelow, NonNegative, Number, Positive, Rule, Share, Spanned, schema};
use std::ops::Range;

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NetworkSection {
    loss: Option<Chance>,
    duplication: Option<Chance>,
    latency_s: Option<Number<Latency>>,
    max_delay_s: Option<NonNegative>,
    patience_s: Option<Positive>,
    deadline_s: Option<Positive>,
    bandwidth_bit_s: Option<Number<Bandwidth>>,
    range_m: Option<Positive>,
    bursts: Option<BurstsSection>,
    silent: Vec<Spanned<Silence>>,
    partitions: Vec<Spanned<Partition>>,
    one_way: Vec<Spanned<OneWay>>,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BurstsSection {
    /// Probability of a loss within a burst.
    loss: Share,
    /// Mean length of a burst.
    lasts_s: Positive,
    /// Mean time between two bursts.
    every_s: Positive,
}

impl BurstsSection {
    fn bursts(&self) -> Bursts {
        let Self { loss, lasts_s, every_s } = self;
        Bursts { loss: loss.get(), lasts_s: lasts_s.get(), every_s: every_s.get() }
    }
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

    fn limits() -> Value {
        json!({ "minimum": 1e-6 })
    }
}

/// A bandwidth that carries a message in the time of a flight.
#[derive(Debug, Clone, Copy)]
struct Bandwidth;

impl Rule for Bandwidth {
    fn allows(number: f64) -> bool {
        number >= 1.0
    }

    fn words() -> String {
        "at least 1 bit/s".into()
    }

    fn limits() -> Value {
        schema::or_infinite(json!({ "minimum": 1 }))
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
            bandwidth_bit_s: self.bandwidth_bit_s.map_or(f64::INFINITY, f64::from),
            max_delay_s,
            patience_s: self.patience_s.map_or(3.0 * (latency_s + max_delay_s), f64::from),
            deadline_s: self.deadline_s.map_or(0.45 * timing.dt_s, f64::from),
            range_m: self.range_m.map_or(f64::INFINITY, f64::from),
            bursts: self.bursts.as_ref().map(BurstsSection::bursts),
            silences: bare(&self.silent),
            partitions: bare(&self.partitions),
            one_ways: bare(&self.one_way),
        }
    }

    /// Returns the first fault that is about airplanes that do not exist, or at undefined times:
    /// its span, cause and remedy.
    fn wrong_fault(&self, airplanes: usize) -> Option<Wrong> {
        let silent = self.silent.iter().map(|one| {
            let Silence { airplane, from_s, until_s } = one.get_ref();
            (one.span(), vec![*airplane], wrong_while(*from_s, *until_s))
        });
        let partitions = self.partitions.iter().map(|one| {
            let Partition { sides, from_s, until_s } = one.get_ref();
            (one.span(), sides.concat(), wrong_sides(sides).or(wrong_while(*from_s, *until_s)))
        });
        let one_way = self.one_way.iter().map(|one| {
            let OneWay { sender, receiver, from_s, until_s } = one.get_ref();
            (one.span(), vec![*sender, *receiver], wrong_while(*from_s, *until_s))
        });
        silent.chain(partitions).chain(one_way).find_map(|(span, ids, words)| {
            let (cause, remedy) = wrong_ids(ids, airplanes).or(words)?;
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

fn bare<T: Clone>(all: &[Spanned<T>]) -> Vec<T> {
    all.iter().map(|one| one.get_ref().clone()).collect()
}

/// Returns cause and remedy of ids that are not those of airplanes, or that are not different.
fn wrong_ids(mut ids: Vec<EntityId>, airplanes: usize) -> Option<(String, String)> {
    let named = ids.iter().find(|&&id| id as usize >= airplanes);
    if let Some(id) = named {
        let cause = format!("airplane {id} does not exist");
        return Some((cause, format!("give ids from 0 to {}", airplanes - 1)));
    }
    ids.sort_unstable();
    let twice = ids.windows(2).find(|pair| pair[0] == pair[1])?[0];
    Some((format!("airplane {twice} is named twice"), "name each airplane once".into()))
}

/// Returns cause and remedy of a partition that parts nobody.
fn wrong_sides(sides: &[Vec<EntityId>]) -> Option<(String, String)> {
    let remedy = "give at least two, e.g. sides = [[0, 2], [1, 3]]";
    (sides.len() < 2).then(|| ("a partition with fewer than two sides".into(), remedy.into()))
}

/// Returns cause and remedy of a while that is none.
fn wrong_while(from_s: f64, until_s: f64) -> Option<(String, String)> {
    let is_right = from_s >= 0.0 && from_s.is_finite() && until_s > from_s;
    let cause = format!("from_s = {from_s}, until_s = {until_s}");
    let remedy = "give times in seconds from 0 on, the end after the start";
    (!is_right).then(|| (cause, remedy.into()))
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
        if let Some((cause, remedy)) = wrong_times(&network, timing) {
            return error(&cause, &remedy);
        }
        match section.get_ref().wrong_fault(airplanes.len()) {
            Some(Wrong { span, cause, remedy }) => {
                Err(self.source.error(Some(span), cause, remedy))
            }
            None => Ok(Some(network)),
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
