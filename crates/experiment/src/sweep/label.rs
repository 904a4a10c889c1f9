//! Names with units in them, split into words and unit.

use serde::Serialize;
use sidestep_kernel::ports::table::split_unit;
use sidestep_scenario::{MetricInfo, metric_label};
use std::fmt;

/// The label of a column on an axis. Displayed as `mean delay (%)`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Label {
    /// The quantity in words.
    pub text: String,
    /// Its unit, if the name ends with one.
    pub unit: Option<&'static str>,
}

impl Label {
    /// Returns the label of a column: `mean_delay_percent` is "mean delay", in %. The path of a key
    /// stays as it is, because users write it so: `chains.gap_m` is "chains.gap", in m.
    pub fn from_name(name: &str) -> Self {
        let (quantity, unit) = split_unit(name);
        let text = if name.contains('.') { quantity.into() } else { quantity.replace('_', " ") };
        Self { text, unit }
    }

    /// Returns the label of a metric, in the words of its world.
    pub fn from_metric(name: &str, meanings: &[MetricInfo]) -> Self {
        let label = metric_label(meanings, name);
        Self { text: label.words, unit: label.unit }
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            Some(unit) => write!(f, "{} ({unit})", self.text),
            None => f.write_str(&self.text),
        }
    }
}

/// The label with a capital, as a title begins.
pub(super) fn capitalized(label: &Label) -> String {
    let text = label.to_string();
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_its_quantity_and_unit() {
        let expected = [
            ("mean_delay_percent", "mean delay (%)"),
            ("min_separation_m", "min separation (m)"),
            ("max_speed_m_s", "max speed (m/s)"),
            ("lost_s", "lost (s)"),
            ("optimize_cpu_s", "optimize (s of processor time)"),
            ("steps_per_cpu_s", "steps (1/s of processor time)"),
            ("robots.count", "robots.count"),
            ("ground.corridor.width_m", "ground.corridor.width (m)"),
            ("chains.turn_rad_s", "chains.turn (rad/s)"),
            ("losses_of_separation", "losses of separation"),
            ("multicast_bytes", "multicast (bytes)"),
            ("bytes", "bytes"),
            ("_m", " m"),
            ("", ""),
        ];
        for (name, label) in expected {
            assert_eq!(Label::from_name(name).to_string(), label);
        }
    }
}
