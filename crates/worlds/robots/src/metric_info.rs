//! The metrics of a run in words, for reports.

use sidestep_scenario::MetricInfo;

/// Every metric of this world.
pub(super) const METRIC_INFO: &[MetricInfo] = &[
    MetricInfo {
        name: "actions",
        words: "actions",
        unit: "",
        meaning: "actions started, of all robots",
    },
    MetricInfo { name: "contacts", words: "contacts", unit: "", meaning: "contacts" },
    MetricInfo {
        name: "contacts_by_kind.*",
        words: "contacts with *",
        unit: "",
        meaning: "contacts by the kind touched; 0 for kinds never touched",
    },
    MetricInfo {
        name: "distance_m",
        words: "way of all robots",
        unit: "",
        meaning: "way of all robots together",
    },
    MetricInfo { name: "trips", words: "trips completed", unit: "", meaning: "trips completed" },
    MetricInfo {
        name: "trip_cycles_mean",
        words: "mean length of a trip",
        unit: "cycles",
        meaning: "mean length of a completed trip; none without trips",
    },
    MetricInfo {
        name: "first_visits",
        words: "boxes covered for the first time",
        unit: "",
        meaning: "boxes that no robot had covered before",
    },
    MetricInfo {
        name: "coverage",
        words: "share of the floor covered",
        unit: "",
        meaning: "share of the free boxes that a robot has covered, 0 to 1",
    },
    MetricInfo {
        name: "contacts_per_action",
        words: "contacts per action",
        unit: "",
        meaning: "share of actions that ended in a contact, 0 to 1",
    },
    MetricInfo {
        name: "group_sizes",
        words: "conflict groups by size",
        unit: "",
        meaning: "conflict groups of 1, 2-3, 4-7, ... bodies, over all cycles",
    },
    MetricInfo {
        name: "largest_group",
        words: "largest conflict group",
        unit: "bodies",
        meaning: "bodies of the largest conflict group; 0 where no two ever met",
    },
    MetricInfo { name: "body", words: "robot", unit: "", meaning: "the robot's number" },
    MetricInfo {
        name: "cycles_run",
        words: "length of the run",
        unit: "cycles",
        meaning: "cycles that were simulated",
    },
];
