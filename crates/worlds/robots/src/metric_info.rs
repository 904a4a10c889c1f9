//! The metrics of a run in words, for reports.

use super::metrics::{Counters, Metrics};
use sidestep_scenario::MetricInfo;
use std::sync::LazyLock;

/// The metrics that charts show first.
pub(super) const CHART_METRICS: [&str; 6] =
    ["contacts", "trips", "tasks_finished", "coverage", "waiting_share", "robots_in_gridlock"];

/// Every metric of this world: the fields of its structs, and names that only tables have.
pub(super) static METRIC_INFO: LazyLock<Vec<MetricInfo>> = LazyLock::new(|| {
    let mut infos = Vec::new();
    infos.extend(Counters::infos());
    infos.extend(Metrics::infos());
    infos.extend(TABLE_INFO);
    infos
});

const TABLE_INFO: [MetricInfo; 2] = [
    MetricInfo { name: "body", words: "robot", unit: "", meaning: "the robot's number" },
    MetricInfo {
        name: "cycles_run",
        words: "length of the run",
        unit: "cycles",
        meaning: "cycles that were simulated",
    },
];
