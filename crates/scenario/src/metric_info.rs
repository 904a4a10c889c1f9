//! Metrics in words: each stands once, as the documentation of its field.

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

/// Declares a struct of metrics with their words: the first sentence about a field is the metric's meaning, in reports, tables
/// of sweeps and the book too.
///
/// After `=>` stand a few words for titles and axes, and in parentheses a unit that the name does not end in; a field
/// without them, such as a part with fields of its own, has no entry. A field followed by `.*` has a metric for every key.
/// `pub struct Part in "part."` is for a struct that results have under this beginning of names.
///
/// ```
/// sidestep_scenario::metrics! {
///     /// Metrics of a run.
///     #[derive(Debug)]
///     pub struct Metrics {
///         /// Meals eaten. Bites do not count.
///         pub meals: u64 => "meals",
///         /// Mean length of a meal.
///         pub meal_mean: f64 => "mean length of a meal" ("cycles"),
///     }
/// }
/// let infos = Metrics::infos();
/// assert_eq!((infos[0].name, infos[0].meaning), ("meals", "meals eaten"));
/// assert_eq!((infos[1].words, infos[1].unit), ("mean length of a meal", "cycles"));
/// ```
#[macro_export]
macro_rules! metrics {
    ($(#[$attr:meta])* pub struct $name:ident { $($fields:tt)* }) => {
        $crate::metrics! { $(#[$attr])* pub struct $name in "" { $($fields)* } }
    };
    (
        $(#[$attr:meta])*
        pub struct $name:ident in $prefix:literal {
            $(
                $(#[$($field_attr:tt)+])+
                pub $field:ident $(.$every:tt)?: $type:ty $(=> $words:literal $(($unit:literal))?)?,
            )*
        }
    ) => {
        $(#[$attr])*
        pub struct $name {
            $(
                $(#[$($field_attr)+])+
                pub $field: $type,
            )*
        }

        impl $name {
            /// Returns the fields in words.
            pub fn infos() -> ::std::vec::Vec<$crate::MetricInfo> {
                let mut infos = ::std::vec::Vec::new();
                $(
                    $crate::metrics! {
                        @push infos,
                        concat!($prefix, stringify!($field) $(, ".", stringify!($every))?),
                        [$([$($field_attr)+])+]
                        $($words $($unit)?)?
                    }
                )*
                infos
            }
        }
    };
    (@push $infos:ident, $name:expr, [$($attrs:tt)+]) => {};
    (@push $infos:ident, $name:expr, [$($attrs:tt)+] $words:literal $($unit:literal)?) => {
        $infos.push($crate::MetricInfo {
            name: $name,
            words: $words,
            unit: concat!("" $(, $unit)?),
            meaning: $crate::metrics!(@meaning [] $($attrs)+),
        });
    };
    (@meaning [$($doc:literal)*] [doc = $next:literal] $($attrs:tt)*) => {
        $crate::metrics!(@meaning [$($doc)* $next] $($attrs)*)
    };
    (@meaning [$($doc:literal)*] [$($other:tt)+] $($attrs:tt)*) => {
        $crate::metrics!(@meaning [$($doc)*] $($attrs)*)
    };
    (@meaning [$($doc:literal)*]) => {{
        const DOC: &str = concat!($($doc),*);
        const PHRASE: [u8; $crate::phrase_len(DOC)] = $crate::phrase(DOC);
        const MEANING: &str = match ::core::str::from_utf8(&PHRASE) {
            Ok(meaning) => meaning,
            Err(_) => panic!("the first sentence of a field is text"),
        };
        MEANING
    }};
}

/// Returns where the first sentence begins and where it ends, before its period: one that ends the text or stands before
/// a capital letter, which the points of "1, 2-3, ... bodies" do not.
const fn first_sentence(doc: &[u8]) -> (usize, usize) {
    let mut start = 0;
    while start < doc.len() && doc[start] == b' ' {
        start += 1;
    }
    let mut end = start;
    while end < doc.len() {
        let is_last = end + 1 == doc.len();
        let is_before_capital =
            end + 2 < doc.len() && doc[end + 1] == b' ' && doc[end + 2].is_ascii_uppercase();
        if doc[end] == b'.' && (is_last || is_before_capital) {
            break;
        }
        end += 1;
    }
    (start, end)
}

/// Returns the length of [`phrase`], in bytes.
pub const fn phrase_len(doc: &str) -> usize {
    let (start, end) = first_sentence(doc.as_bytes());
    end - start
}

/// Returns the first sentence of a documentation as a phrase: it begins with a small letter, and has no period.
pub const fn phrase<const LEN: usize>(doc: &str) -> [u8; LEN] {
    let (start, _) = first_sentence(doc.as_bytes());
    let mut phrase = [0; LEN];
    let mut i = 0;
    while i < LEN {
        phrase[i] = doc.as_bytes()[start + i];
        i += 1;
    }
    if LEN > 0 {
        phrase[0] = phrase[0].to_ascii_lowercase();
    }
    phrase
}

/// A metric in words for people, also where its world does not list it.
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
#[expect(unreachable_pub, reason = "the macro declares structs that others see")]
mod tests {
    use super::*;

    metrics! {
        /// Metrics of a pond.
        #[derive(Debug, PartialEq, Default)]
        pub struct PondMetrics in "pond." {
            /// Ponds of 1, 2-3, ... frogs, counted
            /// once. Not those without.
            #[rustfmt::skip]
            pub sizes: Vec<u64> => "ponds by size",
            /// Hops by kind.
            pub hops_by_kind.*: Vec<u64> => "hops of *" ("frogs"),
            /// A part with fields of its own.
            pub part: u64,
        }
    }

    #[test]
    fn the_first_sentence_about_a_field_is_the_meaning_of_its_metric() {
        let infos = PondMetrics::infos();
        let meaning = "ponds of 1, 2-3, ... frogs, counted once";
        let sizes = MetricInfo { name: "pond.sizes", words: "ponds by size", unit: "", meaning };
        let hops = MetricInfo {
            name: "pond.hops_by_kind.*",
            words: "hops of *",
            unit: "frogs",
            meaning: "hops by kind",
        };
        assert_eq!(infos, [sizes, hops]);
        let none = PondMetrics { sizes: Vec::new(), hops_by_kind: Vec::new(), part: 0 };
        assert_eq!(none, PondMetrics::default());
    }

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
