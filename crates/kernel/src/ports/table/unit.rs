//! Units at the end of names.

/// Name endings and their units; a longer ending comes before the shorter one that it ends with.
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

/// Splits a name into quantity and unit: `min_separation_m` is `min_separation`, in m. A name, or
/// the last part of a path, that consists only of an ending has no unit.
pub fn split_unit(name: &str) -> (&str, Option<&'static str>) {
    let split = UNITS.iter().find_map(|(ending, unit)| {
        let quantity = name.strip_suffix(ending)?;
        (!quantity.is_empty() && !quantity.ends_with('.')).then_some((quantity, Some(*unit)))
    });
    split.unwrap_or((name, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ending_hides_a_longer_one() {
        for (i, (ending, _)) in UNITS.iter().enumerate() {
            assert!(UNITS[..i].iter().all(|(earlier, _)| !ending.ends_with(earlier)), "{ending}");
        }
    }
}
