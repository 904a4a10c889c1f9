//! The metrics of a run in words, for reports.

use super::metrics::{AirplaneMetrics, Metrics, PairMetrics};
use sidestep_scenario::MetricInfo;
use std::sync::LazyLock;

/// The metrics that charts show first.
pub(super) const CHART_METRICS: [&str; 6] = [
    "min_separation_m",
    "losses_of_separation",
    "mean_delay_percent",
    "arrived",
    "in_flight",
    "conflicts",
];

/// Every metric of this world: the fields of its structs, and names that only tables have.
pub(super) static METRIC_INFO: LazyLock<Vec<MetricInfo>> = LazyLock::new(|| {
    let mut infos = Vec::new();
    infos.extend(Metrics::infos());
    infos.extend(AirplaneMetrics::infos());
    infos.extend(PairMetrics::infos());
    infos.extend(TABLE_INFO);
    infos
});

const TABLE_INFO: [MetricInfo; 5] = [
    MetricInfo { name: "airplane", words: "airplane", unit: "", meaning: "the airplane's number" },
    MetricInfo {
        name: "too_close_count",
        words: "pairs without a promise",
        unit: "",
        meaning: "pairs for which the shield promises nothing",
    },
    MetricInfo {
        name: "exempt_areas_count",
        words: "exemptions from areas",
        unit: "",
        meaning: "airplanes that the shield does not keep clear of an area",
    },
    MetricInfo {
        name: "beyond_bound_count",
        words: "airplanes beyond their bounds",
        unit: "",
        meaning: "airplanes whose errors exceeded the bounds",
    },
    MetricInfo {
        name: "cycles_run",
        words: "length of the run",
        unit: "cycles",
        meaning: "cycles that were simulated",
    },
];
