//! Texts of a world for people, as data: the caller that shows them decides on the layout.

use serde_json::Value;

/// Names and values, one per line.
pub type Lines = Vec<(String, String)>;

/// A statement about a state: as JSON, and in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// For machines.
    pub json: Value,
    /// For people; every line ends in a line feed.
    pub text: String,
}

/// Returns a line of a name and a value.
pub fn line(name: &str, value: impl Into<String>) -> (String, String) {
    (name.into(), value.into())
}

/// Returns a number with its thousands set apart by spaces: `1 234 567`.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let first = digits.len() % 3;
    let (head, tail) = digits.split_at(first);
    let groups = tail.as_bytes().chunks(3).map(|c| std::str::from_utf8(c).unwrap_or_default());
    let head = (!head.is_empty()).then_some(head);
    head.into_iter().chain(groups).collect::<Vec<_>>().join(" ")
}

/// Returns lines of names and values, the values below each other.
pub fn aligned(rows: &[(String, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("  {name:<width$}  {value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_below_each_other() {
        let rows = [line("a", "1"), line("long", "2")];
        assert_eq!(aligned(&rows), "  a     1\n  long  2\n");
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000].map(grouped), ["0", "999", "1 000"]);
        assert_eq!(grouped(1_234_567), "1 234 567");
    }
}
