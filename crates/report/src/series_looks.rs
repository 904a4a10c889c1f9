//! The looks of series that differ by several factors: a color for each level of the first one, a marker or dashes for each
//! level of the others.

use sidestep_document::Series;
use sidestep_draw::SeriesLook;

/// Maximum number of dashes that can be told apart.
const MAX_PATTERNS: usize = 4;

/// The names and looks of the series of a figure.
pub(crate) struct SeriesLooks {
    /// What all names begin with, such as "count, policy"; empty where names say all.
    pub(crate) heading: String,
    /// The names below the heading.
    pub(crate) labels: Vec<String>,
    pub(crate) looks: Vec<SeriesLook>,
}

/// Levels of factors, as names of variants have them: `count=6, policy=random`.
type Levels<'a> = Vec<(&'a str, &'a str)>;

impl SeriesLooks {
    /// Returns the looks of series; each has its own color where their names are not levels of the same factors.
    pub(crate) fn new(series: &[Series]) -> Self {
        Self::from_levels(series).unwrap_or_else(|| Self {
            heading: String::new(),
            labels: series.iter().map(|series| series.name.clone()).collect(),
            looks: (0..series.len()).map(SeriesLook::of_series).collect(),
        })
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
        let values = |levels: &Levels<'_>| -> Vec<String> {
            levels.iter().map(|(_, value)| (*value).to_string()).collect()
        };
        let firsts: Vec<String> = all.iter().map(|levels| levels[0].1.to_string()).collect();
        let others: Vec<String> = all.iter().map(|levels| values(levels)[1..].join(", ")).collect();
        let colors = numbers_of_first_use(&firsts);
        let patterns = numbers_of_first_use(&others);
        let has_patterns =
            factors.len() > 1 && patterns.iter().all(|pattern| *pattern < MAX_PATTERNS);
        let look = |index: usize| {
            if has_patterns {
                let pattern = patterns[index];
                SeriesLook { color: colors[index], marker: pattern, dash: pattern }
            } else {
                SeriesLook::of_series(index)
            }
        };
        Some(Self {
            heading: factors.join(", "),
            labels: all.iter().map(|levels| values(levels).join(", ")).collect(),
            looks: (0..all.len()).map(look).collect(),
        })
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

/// Returns the number of each word among the different ones, in the order of their first use.
fn numbers_of_first_use(words: &[String]) -> Vec<usize> {
    let mut known: Vec<&String> = Vec::new();
    let mut numbers = Vec::with_capacity(words.len());
    for word in words {
        let number = known.iter().position(|one| *one == word).unwrap_or_else(|| {
            known.push(word);
            known.len() - 1
        });
        numbers.push(number);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks(names: &[&str]) -> SeriesLooks {
        let series: Vec<Series> =
            names.iter().map(|name| Series { name: (*name).into(), points: Vec::new() }).collect();
        SeriesLooks::new(&series)
    }

    #[test]
    fn two_factors_are_colors_and_patterns_and_their_names_stand_once() {
        let found = looks(&["n=6, rule = a", "n=6, rule = b", "n=12, rule = a", "n=12, rule = b"]);
        assert_eq!(found.heading, "n, rule");
        assert_eq!(found.labels, ["6, a", "6, b", "12, a", "12, b"]);
        let pairs: Vec<_> = found.looks.iter().map(|look| (look.color, look.dash)).collect();
        assert_eq!(pairs, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    }

    #[test]
    fn one_factor_or_other_names_have_a_color_for_each_series() {
        let found = looks(&["n = 6", "n = 12"]);
        assert_eq!((found.heading.as_str(), found.labels[1].as_str()), ("n", "12"));
        assert_eq!(found.looks[1], SeriesLook::of_series(1));
        for names in [&["mvp", "pc"][..], &["n=6", "rule=a"], &["n=6", "pc"], &["n=6"], &[]] {
            let found = looks(names);
            assert_eq!(
                (found.heading.as_str(), &found.labels[..]),
                ("", &names.iter().map(|n| (*n).to_string()).collect::<Vec<_>>()[..])
            );
        }
    }
}
