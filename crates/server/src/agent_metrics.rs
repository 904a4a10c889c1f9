//! The metrics of each agent at one cycle, by which a page colors them. They are computed on request alone: nothing is
//! paid for them otherwise.

use crate::metric_history::MetricWords;
use crate::protocol::{MetricName, Problem, ReplyBody};
use serde_json::{Map, Value};
use sidestep_kernel::{Cycle, Simulation};
use std::collections::BTreeSet;

/// Maximum number of agents whose metrics are looked at for names: all agents of a world have the same, except for values
/// that some do not have yet.
const MAX_NAMED_AGENTS: usize = 1000;

/// The metrics of all agents of a run at one cycle.
pub(crate) struct AgentMetrics {
    cycle: Cycle,
    /// The words that the sum over all agents has and the value of one has not.
    of_all: String,
    /// An object of metrics for each agent, by its number.
    agents: Vec<Value>,
}

impl AgentMetrics {
    pub(crate) fn from_run(run: &dyn Simulation) -> Self {
        let agents = match run.agent_metrics() {
            Value::Array(agents) => agents,
            _ => Vec::new(),
        };
        let of_all = format!(" of all {}s", run.agent_noun());
        Self { cycle: run.cycle(), of_all, agents }
    }

    pub(crate) fn cycle(&self) -> Cycle {
        self.cycle
    }

    pub(crate) fn agent_count(&self) -> usize {
        self.agents.len()
    }

    /// Returns the metrics that are numbers and that the world has words for, those that charts show first first.
    pub(crate) fn names(&self, words: MetricWords) -> Vec<MetricName> {
        let mut keys = BTreeSet::new();
        for agent in self.agents.iter().take(MAX_NAMED_AGENTS).filter_map(Value::as_object) {
            add_keys("", agent, &mut keys);
        }
        let mut names: Vec<MetricName> =
            keys.iter().filter_map(|key| words.agent_metric_name(key)).collect();
        for name in &mut names {
            name.label = name.label.replace(&self.of_all, "");
        }
        // The sort is stable: all others stay in the order of their keys.
        names.sort_by_key(|name| !name.is_primary);
        names
    }

    /// Returns the values of a metric, by the numbers of agents.
    pub(crate) fn values(&self, key: &str) -> Vec<Option<f64>> {
        let pointer = format!("/{}", key.replace('.', "/"));
        self.agents.iter().map(|agent| agent.pointer(&pointer).and_then(number)).collect()
    }

    /// Returns the reply to a request for the names of metrics, or for the values of one.
    ///
    /// # Errors
    /// When no agent has such a metric.
    pub(crate) fn reply(
        &self,
        metric: Option<&str>,
        words: MetricWords,
    ) -> Result<ReplyBody, Problem> {
        let cycle = self.cycle as f64;
        let Some(key) = metric else {
            let names = self.names(words);
            return Ok(ReplyBody::AgentMetrics { names, cycle, values: Vec::new() });
        };
        let values = self.values(key);
        // A mean may have no value yet for any of them: only the names tell whether a metric exists.
        if values.iter().all(Option::is_none) {
            let names = self.names(words);
            if !names.is_empty() && names.iter().all(|name| name.key != key) {
                return Err(unknown_metric(key, &names));
            }
        }
        Ok(ReplyBody::AgentMetrics { names: Vec::new(), cycle, values })
    }
}

fn unknown_metric(key: &str, names: &[MetricName]) -> Problem {
    let known: Vec<&str> = names.iter().map(|name| name.key.as_str()).collect();
    let remedy = format!("ask for one of {}", known.join(", "));
    Problem::new(format!("metric {key}"), "no agent of this run has it", remedy)
}

/// Adds the names of all numbers in an object: `counts.contacts`. A value that is not known yet has its name, too.
fn add_keys(prefix: &str, object: &Map<String, Value>, keys: &mut BTreeSet<String>) {
    for (name, value) in object {
        match value {
            Value::Object(inner) => add_keys(&format!("{prefix}{name}."), inner, keys),
            Value::Number(_) | Value::Bool(_) | Value::Null => {
                keys.insert(format!("{prefix}{name}"));
            }
            Value::String(_) | Value::Array(_) => {}
        }
    }
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Bool(flag) => Some(f64::from(u8::from(*flag))),
        _ => value.as_f64(),
    }
}
