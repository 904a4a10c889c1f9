//! Metrics in Prometheus' text format (version 0.0.4), served at an address.

use crate::protocol::NodeStatusReport;
use crate::server::histogram::Histogram;
use crate::server::{FleetContext, ServerMetrics};
use crate::wire::access::denied_total;
use crate::wire::endpoint::parse_port;
use crate::wire::http_text::serve_http_text;
use sidestep::kernel::InputError;
use sidestep_session::fleet::{AgentName, FleetStatus, NodeStatus};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// An address at which metrics are served; without one, nothing is.
#[derive(Debug, Default)]
pub(super) struct MetricsExporter(Option<Arc<Mutex<String>>>);

impl MetricsExporter {
    /// Serves metrics at an address from now on, if one is given.
    ///
    /// # Errors
    /// When the address cannot be bound.
    pub(super) fn serve_at(address: Option<&str>) -> Result<Self, InputError> {
        let Some(address) = address else { return Ok(Self::default()) };
        let problem = |cause: String| {
            let remedy = "give --metrics HOST:PORT with a free port of this machine";
            InputError::new(format!("--metrics {address}"), cause, remedy)
        };
        let (_, port) =
            address.rsplit_once(':').ok_or_else(|| problem("the port is missing".into()))?;
        parse_port(port).map_err(problem)?;
        let text = Arc::new(Mutex::new(String::new()));
        serve_http_text(address, text.clone()).map_err(|e| problem(e.to_string()))?;
        Ok(Self(Some(text)))
    }

    /// Replaces the text that is served; it is made only if there is an address.
    pub(super) fn replace_text(&self, text: impl FnOnce() -> String) {
        if let Some(served) = &self.0 {
            *served.lock().unwrap_or_else(PoisonError::into_inner) = text();
        }
    }
}

/// A text under construction.
#[derive(Default)]
struct MetricsText(String);

impl MetricsText {
    /// Adds the lines that come once before all samples of a metric.
    fn push_header(&mut self, name: &str, kind: &str, help: &str) {
        let _ = writeln!(self.0, "# HELP sidestep_{name} {help}\n# TYPE sidestep_{name} {kind}");
    }

    fn push_sample(&mut self, name: &str, labels: &str, value: impl std::fmt::Display) {
        let labels = if labels.is_empty() { String::new() } else { format!("{{{labels}}}") };
        let _ = writeln!(self.0, "sidestep_{name}{labels} {value}");
    }

    fn push_histogram(&mut self, name: &str, help: &str, histogram: &Histogram) {
        self.push_header(name, "histogram", help);
        for (bound_s, count) in histogram.cumulative_counts() {
            self.push_sample(&format!("{name}_bucket"), &format!("le=\"{bound_s}\""), count);
        }
        self.push_sample(&format!("{name}_bucket"), "le=\"+Inf\"", histogram.count());
        self.push_sample(&format!("{name}_sum"), "", histogram.sum_s);
        self.push_sample(&format!("{name}_count"), "", histogram.count());
    }

    /// Adds a metric with a value for each agent, which is given by its label.
    fn push_per_agent(
        &mut self,
        name: &str,
        kind: &str,
        help: &str,
        values: impl Iterator<Item = (String, f64)>,
    ) {
        self.push_header(name, kind, help);
        for (agent, value) in values {
            self.push_sample(name, &agent, value);
        }
    }
}

/// Returns the metrics that the server's address serves: its own, and those of all nodes.
pub(super) fn fleet_metrics(status: &FleetStatus, fleet: &FleetContext<'_>) -> String {
    let mut text = MetricsText::default();
    text.push_header("cycle", "gauge", "Cycles done.");
    text.push_sample("cycle", "", status.cycle);
    push_cycle_times(&mut text, fleet.metrics);
    push_refusals(&mut text, fleet.metrics);
    text.push_header("frames_total", "counter", "Frames that the server has sent.");
    text.push_sample("frames_total", "", fleet.messenger.stats().frames);
    text.push_header("frame_bytes_total", "counter", "Bytes of frames that the server has sent.");
    text.push_sample("frame_bytes_total", "", fleet.messenger.stats().bytes);
    push_dropped_frames(&mut text, &fleet.messenger.stats().dropped);
    text.push_header(
        "denied_total",
        "counter",
        "Messages that a certificate does not allow, denied by the server.",
    );
    text.push_sample("denied_total", "", denied_total());
    push_node_metrics(&mut text, status, fleet);
    text.0
}

fn push_dropped_frames(text: &mut MetricsText, dropped: &BTreeMap<&'static str, u64>) {
    let help = "Frames that the server has dropped, by reason.";
    text.push_header("frames_dropped_total", "counter", help);
    for (reason, count) in dropped {
        text.push_sample("frames_dropped_total", &format_label("reason", reason), count);
    }
}

fn push_cycle_times(text: &mut MetricsText, metrics: &ServerMetrics) {
    text.push_histogram(
        "talk_seconds",
        "Time from the percepts of a cycle to its last control.",
        &metrics.decision_time,
    );
    text.push_histogram(
        "advance_seconds",
        "Time to advance the world by a cycle.",
        &metrics.advance_time,
    );
    text.push_histogram(
        "late_seconds",
        "In real time: time by which a cycle started later than due.",
        &metrics.lateness,
    );
    text.push_header(
        "late_cycles_total",
        "counter",
        "Cycles that started later than a tenth of their length.",
    );
    text.push_sample("late_cycles_total", "", metrics.late_cycles);
}

fn push_refusals(text: &mut MetricsText, metrics: &ServerMetrics) {
    text.push_header(
        "absurd_controls_total",
        "counter",
        "Controls that could not be read or carried out.",
    );
    text.push_sample("absurd_controls_total", "", metrics.invalid_controls);
    text.push_header("refused_total", "counter", "Nodes that were refused, by reason.");
    for (reason, count) in &metrics.refused {
        text.push_sample("refused_total", &format_label("reason", reason), count);
    }
}

/// A metric with a sample for each node, read from the node's status.
struct NodeMetric {
    name: &'static str,
    kind: &'static str,
    help: &'static str,
    value: fn(&NodeStatus) -> f64,
}

const NODE_METRICS: [NodeMetric; 9] = [
    NodeMetric {
        name: "node_up",
        kind: "gauge",
        help: "Whether an agent has a node.",
        value: |node| f64::from(!["awaited", "gone"].contains(&&*node.state)),
    },
    NodeMetric {
        name: "controls_flown_total",
        kind: "counter",
        help: "Controls that were carried out.",
        value: |node| node.flown as f64,
    },
    NodeMetric {
        name: "controls_late_total",
        kind: "counter",
        help: "Controls that did not arrive in time.",
        value: |node| node.late as f64,
    },
    NodeMetric {
        name: "node_lives_total",
        kind: "counter",
        help: "Times that a node has joined.",
        value: |node| node.lives as f64,
    },
    NodeMetric {
        name: "packets_total",
        kind: "counter",
        help: "Packets that a node has sent.",
        value: |node| node.packets as f64,
    },
    NodeMetric {
        name: "packet_bytes_total",
        kind: "counter",
        help: "Bytes of these.",
        value: |node| node.bytes as f64,
    },
    NodeMetric {
        name: "node_frame_bytes_total",
        kind: "counter",
        help: "Bytes of all frames that a node has sent.",
        value: |node| node.frame_bytes as f64,
    },
    NodeMetric {
        name: "epoch",
        kind: "gauge",
        help: "Epoch of the coordinator that a node follows.",
        value: |node| node.epoch as f64,
    },
    NodeMetric {
        name: "heard",
        kind: "gauge",
        help: "Other agents that a node has heard in a cycle.",
        value: |node| node.heard as f64,
    },
];

fn push_node_metrics(text: &mut MetricsText, status: &FleetStatus, fleet: &FleetContext<'_>) {
    for NodeMetric { name, kind, help, value } in &NODE_METRICS {
        let values =
            status.nodes.iter().map(|node| (format_label(&status.noun, &node.name), value(node)));
        text.push_per_agent(name, kind, help, values);
    }
    let statuses = status.nodes.iter().filter_map(|node| {
        let entry = fleet.nodes.get(&node.agent)?;
        Some((format_label(&status.noun, &node.name), &entry.status))
    });
    push_messenger_metrics(text, &statuses.collect::<Vec<_>>());
    // Some systems do not tell it.
    let processor_times = status.nodes.iter().filter_map(|node| {
        let processor_s = 1e-3 * node.processor_ms? as f64;
        Some((format_label(&status.noun, &node.name), processor_s))
    });
    text.push_per_agent(
        "node_processor_seconds_total",
        "counter",
        "Processor time that a node has used since its first cycle.",
        processor_times,
    );
}

/// Returns a label with its value between quotes, where a quote, a backslash and the end of a line are escaped.
fn format_label(name: &str, value: &str) -> String {
    let value = value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n");
    format!("{name}=\"{value}\"")
}

/// Adds the counts of the nodes' messengers, by the labels of their agents.
fn push_messenger_metrics(text: &mut MetricsText, statuses: &[(String, &NodeStatusReport)]) {
    let retries = statuses.iter().map(|(agent, status)| (agent.clone(), status.retries as f64));
    text.push_per_agent(
        "retries_total",
        "counter",
        "Messages that a node has retransmitted.",
        retries,
    );
    text.push_header(
        "dropped_total",
        "counter",
        "Frames and packets that a node has dropped, by reason.",
    );
    for (agent, status) in statuses {
        for (reason, count) in &status.dropped {
            let labels = format!("{agent},{}", format_label("reason", reason));
            text.push_sample("dropped_total", &labels, count);
        }
    }
}

/// Returns the metrics that a node's own address serves.
pub(super) fn node_metrics(agent: &AgentName, status: &NodeStatusReport) -> String {
    let mut text = MetricsText::default();
    let agent = format_label(&agent.noun, &agent.to_string());
    text.push_header("node_cycle", "gauge", "The cycle that a node is in.");
    text.push_sample("node_cycle", &agent, status.cycle as f64);
    text.push_header("packets_total", "counter", "Packets that a node has sent.");
    text.push_sample("packets_total", &agent, status.packets as f64);
    text.push_header("packet_bytes_total", "counter", "Bytes of these.");
    text.push_sample("packet_bytes_total", &agent, status.bytes as f64);
    text.push_header("epoch", "gauge", "Epoch of the coordinator that a node follows.");
    text.push_sample("epoch", &agent, status.epoch as f64);
    text.push_header("heard", "gauge", "Other agents that a node has heard in a cycle.");
    text.push_sample("heard", &agent, status.heard.len() as f64);
    push_messenger_metrics(&mut text, &[(agent.clone(), status)]);
    text.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_letters_stays_one_label() {
        assert_eq!(format_label("airplane", "A12"), r#"airplane="A12""#);
        assert_eq!(format_label("airplane", "a\"b\\c\nd"), r#"airplane="a\"b\\c\nd""#);
    }
}
