//! Metrics in Prometheus' text format (version 0.0.4), served at an address.

use crate::server::Look;
use crate::server::tally::Histogram;
use crate::wire::board::serve;
use crate::words::Status;
use sidestep::kernel::InputError;
use sidestep_session::fleet::{AgentName, FleetNow, NodeNow};
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// The place where metrics are shown; without an address it shows none.
#[derive(Debug, Default)]
pub(super) struct Board(Option<Arc<Mutex<String>>>);

impl Board {
    /// Opens a board at an address, if one is given.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub(super) fn open(address: Option<&str>) -> Result<Self, InputError> {
        let Some(address) = address else { return Ok(Self::default()) };
        let text = Arc::new(Mutex::new(String::new()));
        serve(address, text.clone()).map_err(|e| {
            let remedy = "give --metrics HOST:PORT of this machine that nobody else has";
            InputError::new(format!("--metrics {address}"), e.to_string(), remedy)
        })?;
        Ok(Self(Some(text)))
    }

    /// Shows a text, which is made only if there is an address.
    pub(super) fn show(&self, text: impl FnOnce() -> String) {
        if let Some(shown) = &self.0 {
            *shown.lock().unwrap_or_else(PoisonError::into_inner) = text();
        }
    }
}

/// A text under construction.
#[derive(Default)]
struct Text(String);

impl Text {
    /// Begins a metric.
    fn metric(&mut self, name: &str, kind: &str, help: &str) {
        let _ = writeln!(self.0, "# HELP sidestep_{name} {help}\n# TYPE sidestep_{name} {kind}");
    }

    fn value(&mut self, name: &str, labels: &str, value: impl std::fmt::Display) {
        let labels = if labels.is_empty() { String::new() } else { format!("{{{labels}}}") };
        let _ = writeln!(self.0, "sidestep_{name}{labels} {value}");
    }

    fn histogram(&mut self, name: &str, help: &str, histogram: &Histogram) {
        self.metric(name, "histogram", help);
        for (bound_s, count) in histogram.cumulative() {
            self.value(&format!("{name}_bucket"), &format!("le=\"{bound_s}\""), count);
        }
        self.value(&format!("{name}_bucket"), "le=\"+Inf\"", histogram.count());
        self.value(&format!("{name}_sum"), "", histogram.sum_s);
        self.value(&format!("{name}_count"), "", histogram.count());
    }

    /// Adds a metric with a value for each agent, named by a label.
    fn each(
        &mut self,
        name: &str,
        kind: &str,
        help: &str,
        values: impl Iterator<Item = (String, f64)>,
    ) {
        self.metric(name, kind, help);
        for (agent, value) in values {
            self.value(name, &agent, value);
        }
    }
}

/// Returns the metrics of a fleet.
pub(super) fn of_fleet(now: &FleetNow, fleet: &Look<'_>) -> String {
    let mut text = Text::default();
    text.metric("cycle", "gauge", "Cycles done.");
    text.value("cycle", "", now.cycle);
    let tally = fleet.tally;
    text.histogram(
        "talk_seconds",
        "Time from the percepts of a cycle to its last control.",
        &tally.talked,
    );
    text.histogram(
        "advance_seconds",
        "Time in which the world went on by a cycle.",
        &tally.advanced,
    );
    text.histogram(
        "late_seconds",
        "In real time: by how much later than due a cycle began.",
        &tally.late,
    );
    text.metric(
        "late_cycles_total",
        "counter",
        "Cycles that began later than a tenth of their length.",
    );
    text.value("late_cycles_total", "", tally.late_cycles);
    text.metric("absurd_controls_total", "counter", "Controls that could not be flown.");
    text.value("absurd_controls_total", "", tally.absurd_controls);
    text.metric("refused_total", "counter", "Nodes that were refused, by reason.");
    for (reason, count) in &tally.refused {
        text.value("refused_total", &label("reason", reason), count);
    }
    text.metric("frames_total", "counter", "Frames that the server has sent.");
    text.value("frames_total", "", fleet.mail.counts().frames);
    text.metric("frame_bytes_total", "counter", "Bytes of frames that the server has sent.");
    text.value("frame_bytes_total", "", fleet.mail.counts().bytes);
    of_nodes(&mut text, now, fleet);
    text.0
}

/// A metric with a value for each node.
struct OfNode {
    name: &'static str,
    kind: &'static str,
    help: &'static str,
    value: fn(&NodeNow) -> f64,
}

const OF_NODES: [OfNode; 8] = [
    OfNode {
        name: "node_up",
        kind: "gauge",
        help: "Whether the node of an agent is there.",
        value: |node| f64::from(!["awaited", "gone"].contains(&&*node.state)),
    },
    OfNode {
        name: "controls_flown_total",
        kind: "counter",
        help: "Controls that were flown.",
        value: |node| node.flown as f64,
    },
    OfNode {
        name: "controls_late_total",
        kind: "counter",
        help: "Controls that were not there in time.",
        value: |node| node.late as f64,
    },
    OfNode {
        name: "node_lives_total",
        kind: "counter",
        help: "Times that a node has joined.",
        value: |node| node.lives as f64,
    },
    OfNode {
        name: "packets_total",
        kind: "counter",
        help: "Packets that a node has sent.",
        value: |node| node.packets as f64,
    },
    OfNode {
        name: "packet_bytes_total",
        kind: "counter",
        help: "Bytes of these.",
        value: |node| node.bytes as f64,
    },
    OfNode {
        name: "epoch",
        kind: "gauge",
        help: "Epoch of the coordinator that a node follows.",
        value: |node| node.epoch as f64,
    },
    OfNode {
        name: "heard",
        kind: "gauge",
        help: "Other agents that a node has heard in a cycle.",
        value: |node| node.heard as f64,
    },
];

fn of_nodes(text: &mut Text, now: &FleetNow, fleet: &Look<'_>) {
    for OfNode { name, kind, help, value } in &OF_NODES {
        let values = now.nodes.iter().map(|node| (label(&now.noun, &node.name), value(node)));
        text.each(name, kind, help, values);
    }
    let statuses = now.nodes.iter().filter_map(|node| {
        Some((label(&now.noun, &node.name), &fleet.seats.get(&node.agent)?.status))
    });
    of_mail(text, &statuses.collect::<Vec<_>>());
}

/// Returns a label with its value between quotes, where a quote, a backslash and the end of a line are escaped.
fn label(name: &str, value: &str) -> String {
    let value = value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n");
    format!("{name}=\"{value}\"")
}

/// Adds the mail counts of nodes, by the labels of their agents.
fn of_mail(text: &mut Text, statuses: &[(String, &Status)]) {
    let retries = statuses.iter().map(|(agent, status)| (agent.clone(), status.retries as f64));
    text.each("retries_total", "counter", "Letters that a node has sent again.", retries);
    text.metric(
        "dropped_total",
        "counter",
        "Frames and packets that a node has dropped, by reason.",
    );
    for (agent, status) in statuses {
        for (reason, count) in &status.dropped {
            let labels = format!("{agent},{}", label("reason", reason));
            text.value("dropped_total", &labels, count);
        }
    }
}

/// Returns the metrics of a node.
pub(super) fn of_node(agent: AgentName, status: &Status) -> String {
    let mut text = Text::default();
    let agent = label(agent.noun(), &agent.to_string());
    let one = |value: u64| std::iter::once((agent.clone(), value as f64));
    text.each("node_cycle", "gauge", "The cycle that a node is in.", one(status.cycle));
    text.each("packets_total", "counter", "Packets that a node has sent.", one(status.packets));
    text.each("packet_bytes_total", "counter", "Bytes of these.", one(status.bytes));
    text.each("epoch", "gauge", "Epoch of the coordinator that a node follows.", one(status.epoch));
    let heard = one(status.heard.len() as u64);
    text.each("heard", "gauge", "Other agents that a node has heard in a cycle.", heard);
    of_mail(&mut text, &[(agent.clone(), status)]);
    text.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_letters_stays_one_label() {
        assert_eq!(label("airplane", "A12"), r#"airplane="A12""#);
        assert_eq!(label("airplane", "a\"b\\c\nd"), r#"airplane="a\"b\\c\nd""#);
    }
}
