//! Metrics in words.

use sidestep_kernel::ports::table::split_unit;

/// A metric of a world, for readers of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricInfo {
    /// Its name in results. One that ends in `.*` stands for all names with that beginning.
    pub name: &'static str,
    /// A few words for titles and axes, without the unit; `*` stands for the end of the name.
    pub words: &'static str,
    /// Its unit; empty for the one that the name ends in, if any.
    pub unit: &'static str,
    /// The thing counted or measured, in a phrase.
    pub meaning: &'static str,
}

/// A metric in words for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MetricLabel {
    /// A few words for titles and axes, without the unit.
    pub words: String,
    /// Its unit, if it has one.
    pub unit: Option<&'static str>,
    /// The thing counted or measured; empty where the world gives none.
    pub meaning: &'static str,
}

/// Returns a metric in words, from the list of its world; a name that is not listed is split into its
/// own words.
pub fn metric_label(infos: &[MetricInfo], name: &str) -> MetricLabel {
    // A metric of a sweep may have its table before its name: `metrics.collisions`.
    let found = find_info(infos, name).or_else(|| find_info(infos, name.split_once('.')?.1));
    if let Some((info, rest)) = found {
        let unit = if info.unit.is_empty() { split_unit(info.name).1 } else { Some(info.unit) };
        let words = info.words.replace('*', &rest.replace(['_', '-'], " "));
        return MetricLabel { words, unit, meaning: info.meaning };
    }
    let (quantity, unit) = split_unit(name);
    let words = quantity.replace('_', " ").replace('.', ": ");
    MetricLabel { words, unit, meaning: "" }
}

/// Returns the entry of a name, and the end of the name that stands for `*`.
fn find_info<'a>(infos: &'a [MetricInfo], name: &'a str) -> Option<(&'a MetricInfo, &'a str)> {
    infos.iter().find_map(|info| {
        let rest = match info.name.strip_suffix('*') {
            Some(prefix) => name.strip_prefix(prefix)?,
            None => (info.name == name).then_some("")?,
        };
        Some((info, rest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metric_is_told_by_its_world_or_else_by_its_name() {
        let meaning = |name, words, unit| MetricInfo { name, words, unit, meaning: "m" };
        let known = [
            meaning("lag_m", "lag", ""),
            meaning("hits.*", "hits of a *", ""),
            meaning("trip", "trip", "cycles"),
        ];
        let said = |name| {
            let MetricLabel { words, unit, .. } = metric_label(&known, name);
            format!("{words} ({})", unit.unwrap_or("-"))
        };
        let names = ["lag_m", "hits.glass_wall", "trip", "counts.lag_m", "a.mean_gap_m", "x"];
        let words = [
            "lag (m)",
            "hits of a glass wall (-)",
            "trip (cycles)",
            "lag (m)",
            "a: mean gap (m)",
            "x (-)",
        ];
        assert_eq!(names.map(said), words);
    }
}
