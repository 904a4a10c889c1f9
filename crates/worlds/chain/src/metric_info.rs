//! The metrics of a run in words, for reports.

use super::metrics::{ArmMetrics, EscapeTally, Metrics, RobotMetrics, RungTally};
use sidestep_scenario::MetricInfo;
use std::sync::LazyLock;

/// The metrics that charts show first.
pub(super) const CHART_METRICS: [&str; 6] =
    ["vetoes", "min_clearance_m", "progress", "min_own_gap_m", "penetrations", "rotations"];

/// Every metric of this world: the fields of its structs, and names that only tables have.
pub(super) static METRIC_INFO: LazyLock<Vec<MetricInfo>> = LazyLock::new(|| {
    let mut infos = Vec::new();
    infos.extend(Metrics::infos());
    infos.extend(RungTally::infos());
    infos.extend(EscapeTally::infos());
    infos.extend(RobotMetrics::infos());
    infos.extend(ArmMetrics::infos());
    infos.extend(TABLE_INFO);
    infos
});

const TABLE_INFO: [MetricInfo; 6] = [
    MetricInfo {
        name: "given_up_count",
        words: "tasks given up",
        unit: "",
        meaning: "motions and targets that were given up",
    },
    MetricInfo { name: "chain", words: "chain", unit: "", meaning: "the chain's number" },
    MetricInfo {
        name: "way_m",
        words: "way of the leaders",
        unit: "",
        meaning: "way of its leading connectors",
    },
    MetricInfo {
        name: "moved",
        words: "connectors moved",
        unit: "",
        meaning: "connectors moved, summed over the sub-steps",
    },
    MetricInfo {
        name: "joints.*",
        words: "joint *",
        unit: "",
        meaning: "its value at the end, in rad or m",
    },
    MetricInfo {
        name: "cycles_run",
        words: "length of the run",
        unit: "cycles",
        meaning: "cycles that were simulated",
    },
];
