//! Names with units in them, taken apart.

use serde::Serialize;
use std::fmt;

/// What a column is called on an axis. Displayed as `mean delay (%)`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Label {
    /// The quantity in words.
    pub text: String,
    /// Its unit, where the name ends with one.
    pub unit: Option<&'static str>,
}

/// Endings of names and the units they stand for; an ending stands before what it ends with.
const UNITS: [(&str, &str); 27] = [
    ("_m_s2", "m/s²"),
    ("_m_s", "m/s"),
    ("_km_h", "km/h"),
    ("_rad_s", "rad/s"),
    ("_deg_s", "°/s"),
    ("_per_cpu_s", "1/s of processor time"),
    ("_per_s", "1/s"),
    ("_cpu_s", "s of processor time"),
    ("_percent", "%"),
    ("_cycles", "cycles"),
    ("_boxes", "boxes"),
    ("_bytes", "bytes"),
    ("_rad", "rad"),
    ("_deg", "°"),
    ("_m2", "m²"),
    ("_km", "km"),
    ("_cm", "cm"),
    ("_mm", "mm"),
    ("_ft", "ft"),
    ("_kt", "kt"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_us", "µs"),
    ("_ns", "ns"),
    ("_h", "h"),
    ("_m", "m"),
    ("_s", "s"),
];

impl Label {
    /// The label of a column: `mean_delay_percent` is "mean delay", in %. The path of a key
    /// stays as it is, since it is what one writes: `chains.gap_m` is "chains.gap", in m.
    pub fn of(name: &str) -> Self {
        let unit = UNITS.iter().find_map(|(ending, unit)| {
            let quantity = name.strip_suffix(ending)?;
            (!quantity.is_empty() && !quantity.ends_with('.')).then_some((quantity, *unit))
        });
        let quantity = unit.map_or(name, |(quantity, _)| quantity);
        let text = if name.contains('.') { quantity.into() } else { quantity.replace('_', " ") };
        Self { text, unit: unit.map(|(_, unit)| unit) }
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
            ("optimise_cpu_s", "optimise (s of processor time)"),
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
            assert_eq!(Label::of(name).to_string(), label);
        }
    }

    #[test]
    fn no_ending_hides_a_longer_one() {
        for (i, (ending, _)) in UNITS.iter().enumerate() {
            assert!(UNITS[..i].iter().all(|(earlier, _)| !ending.ends_with(earlier)), "{ending}");
        }
    }
}
