//! The looks of series that differ by factors: a color for each level of one of them, a marker and dashes for each level of
//! the others.

use sidestep_document::Series;
use sidestep_draw::{LegendGroup, LegendLook, SeriesLook, series_colors};

/// Maximum number of dashes that can be told apart.
const MAX_PATTERNS: usize = 4;

/// The looks of the series of a figure, and how a legend explains them.
pub(crate) struct SeriesLooks {
    pub(crate) looks: Vec<SeriesLook>,
    /// A group for each thing that looks tell; none where each series is listed by its name.
    pub(crate) legend: Vec<LegendGroup>,
}

/// Levels of factors, as names of variants have them: `count=6, policy=random`.
type Levels<'a> = Vec<(&'a str, &'a str)>;

impl SeriesLooks {
    /// Returns the looks of series; each has its own color where their names are not levels of the same factors.
    pub(crate) fn new(series: &[Series]) -> Self {
        let looks = (0..series.len()).map(SeriesLook::of_series).collect();
        Self::from_levels(series).unwrap_or(Self { looks, legend: Vec::new() })
    }

    fn from_levels(series: &[Series]) -> Option<Self> {
        let all: Vec<Levels<'_>> =
            series.iter().map(|series| levels(&series.name)).collect::<Option<_>>()?;
        let factors: Vec<&str> = all.first()?.iter().map(|(factor, _)| *factor).collect();
        let is_same = |levels: &Levels<'_>| {
            levels.iter().map(|(factor, _)| *factor).eq(factors.iter().copied())
        };
        if all.len() < 2 || !all.iter().all(is_same) {
            return None;
        }
        let own_look = |number: usize| {
            let SeriesLook { color, marker, dash } = SeriesLook::of_series(number);
            LegendLook { color: Some(color), marker: Some(marker), dash }
        };
        if let [factor] = factors[..] {
            let words = DistinctWords::new(all.iter().map(|levels| levels[0].1.to_string()));
            let looks = words.numbers.iter().map(|number| SeriesLook::of_series(*number)).collect();
            return Some(Self { looks, legend: vec![words.into_group(factor, own_look)] });
        }
        // Methods are what a reader compares, and often lie over each other: colors part them better than dashes.
        let is_number =
            |factor: usize| all.iter().all(|levels| levels[factor].1.parse::<f64>().is_ok());
        let mut order: Vec<usize> = (0..factors.len()).collect();
        order.sort_by_key(|factor| is_number(*factor));
        order
            .into_iter()
            .find_map(|color_factor| Self::from_colors_of(color_factor, &all, &factors))
    }

    /// Returns looks whose colors are the levels of one factor, and whose patterns are those of all others; `None` if there
    /// are not so many colors or patterns.
    fn from_colors_of(factor: usize, all: &[Levels<'_>], factors: &[&str]) -> Option<Self> {
        let colored = DistinctWords::new(all.iter().map(|levels| levels[factor].1.to_string()));
        let without_factor = |words: &mut dyn Iterator<Item = &str>| -> String {
            let others = words.enumerate().filter(|(k, _)| *k != factor).map(|(_, word)| word);
            others.collect::<Vec<_>>().join(", ")
        };
        let others = DistinctWords::new(
            all.iter().map(|levels| without_factor(&mut levels.iter().map(|(_, value)| *value))),
        );
        if others.words.len() > MAX_PATTERNS || colored.words.len() > series_colors().len() {
            return None;
        }
        let pairs = colored.numbers.iter().zip(&others.numbers);
        let looks = pairs
            .map(|(&color, &pattern)| SeriesLook { color, marker: pattern, dash: pattern })
            .collect();
        let color = |number: usize| LegendLook { color: Some(number), marker: None, dash: 0 };
        let pattern =
            |number: usize| LegendLook { color: None, marker: Some(number), dash: number };
        let legend = vec![
            colored.into_group(factors[factor], color),
            others.into_group(&without_factor(&mut factors.iter().copied()), pattern),
        ];
        Some(Self { looks, legend })
    }
}

/// Returns the levels that a name consists of; `None` for any other name.
fn levels(name: &str) -> Option<Levels<'_>> {
    let parts = name.split(", ").map(|part| {
        let (factor, value) = part.split_once('=')?;
        Some((factor.trim(), value.trim()))
    });
    parts.collect()
}

/// Words without repetition, in the order of their first use.
struct DistinctWords {
    words: Vec<String>,
    /// The number of each given word among the distinct ones.
    numbers: Vec<usize>,
}

impl DistinctWords {
    fn new(given: impl Iterator<Item = String>) -> Self {
        let mut words: Vec<String> = Vec::new();
        let mut numbers = Vec::new();
        for word in given {
            let known = words.iter().position(|one| *one == word);
            numbers.push(known.unwrap_or(words.len()));
            if known.is_none() {
                words.push(word);
            }
        }
        Self { words, numbers }
    }

    fn into_group(self, heading: &str, look: impl Fn(usize) -> LegendLook) -> LegendGroup {
        let entries = self.words.into_iter().enumerate().map(|(k, word)| (look(k), word)).collect();
        LegendGroup { heading: heading.to_string(), entries }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks(names: &[&str]) -> SeriesLooks {
        let series: Vec<Series> =
            names.iter().map(|name| Series { name: (*name).into(), points: Vec::new() }).collect();
        SeriesLooks::new(&series)
    }

    fn labels(group: &LegendGroup) -> Vec<&str> {
        group.entries.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn two_factors_are_colors_and_patterns_each_told_once() {
        let found = looks(&["n=6, rule = a", "n=6, rule = b", "n=12, rule = a", "n=12, rule = b"]);
        let pairs: Vec<_> = found.looks.iter().map(|look| (look.color, look.dash)).collect();
        assert_eq!(pairs, [(0, 0), (1, 0), (0, 1), (1, 1)]);
        let [colors, patterns] = &found.legend[..] else { panic!("two groups") };
        assert_eq!((colors.heading.as_str(), labels(colors)), ("rule", vec!["a", "b"]));
        assert_eq!((patterns.heading.as_str(), labels(patterns)), ("n", vec!["6", "12"]));
        assert_eq!(colors.entries[1].0, LegendLook { color: Some(1), marker: None, dash: 0 });
        assert_eq!(patterns.entries[1].0, LegendLook { color: None, marker: Some(1), dash: 1 });
    }

    #[test]
    fn colors_go_to_methods_unless_there_are_too_many_numbers_for_patterns() {
        let names: Vec<String> = (0..2 * (MAX_PATTERNS + 1))
            .map(|k| format!("n={}, rule={}", k / 2, ["a", "b"][k % 2]))
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let headings = |names: &[&str]| -> Vec<String> {
            looks(names).legend.into_iter().map(|group| group.heading).collect()
        };
        assert_eq!(headings(&names), ["n", "rule"]);
        assert_eq!(headings(&names[2..]), ["rule", "n"]);
        assert_eq!(headings(&["n=1, m=2", "n=2, m=2"]), ["n", "m"], "numbers alone in their order");
    }

    #[test]
    fn one_factor_or_other_names_have_a_color_for_each_series() {
        let found = looks(&["n = 6", "n = 12"]);
        assert_eq!(labels(&found.legend[0]), ["6", "12"]);
        assert_eq!(found.looks[1], SeriesLook::of_series(1));
        // A legend shows what is drawn: a whole line.
        let shown = LegendLook { color: Some(1), marker: Some(1), dash: 0 };
        assert_eq!(found.legend[0].entries[1].0, shown);
        let many: Vec<String> = (0..6).map(|k| format!("n={k}, rule={k}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        for names in [&["mvp", "pc"][..], &["n=6", "rule=a"], &["n=6", "pc"], &["n=6"], &[], &many]
        {
            let found = looks(names);
            assert_eq!((found.legend.len(), found.looks.len()), (0, names.len()), "{names:?}");
        }
    }
}
